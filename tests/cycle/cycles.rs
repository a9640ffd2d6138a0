//! Periodic orbits of the reduced model, compared with the exact solution of the two-point boundary
//! value problem and with reference values from two other methods.

use super::{assert_complex_eq, mode, planes, shoot};
use crate::fixtures::exact_orbit::{GROWTH_TIME, exact_orbit, rate};
use crate::fixtures::shoots::{HOUR, MEMORY, MINUTE, RADIUS, STATOLITHS, WEIGHT, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::cycle::{PeriodicOrbit, PeriodicSolver, RotatingWave, RotatingWaveSolver};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{DynLaws, Shoot};
use nalgebra::Complex;

pub(super) fn plain(length: f64, elements: u32) -> Shoot<DynLaws> {
    shoot(length, elements).into_dyn().build().unwrap()
}

/// Parameters of the reduced model with equal memories.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parameters {
    /// Young's modulus, Pa.
    pub(super) youngs_modulus: f64,
    pub(super) beta: f64,
    pub(super) eta: f64,
    /// Growth time, s.
    pub(super) growth_time: f64,
    pub(super) memory: Memory,
    /// Length, m.
    pub(super) length: f64,
}

impl Parameters {
    pub(super) fn shoot(&self, elements: u32) -> Shoot<DynLaws> {
        let nodes: Vec<f64> = (0..=elements)
            .map(|i| self.length * f64::from(i) / f64::from(elements))
            .collect();
        let steering = (
            Gravitropism {
                sensitivity: self.beta,
                perception: SettledStatoliths,
            }
            .remembered(self.memory),
            Proprioception {
                sensitivity: self.eta,
            }
            .remembered(self.memory),
        );
        Shoot::builder(LinearElastic {
            youngs_modulus: self.youngs_modulus,
            poissons_ratio: 0.5,
        })
        .length(self.length)
        .nodes(&nodes)
        .radius(RADIUS)
        .growth(Ongoing(UniformGrowth {
            zone_length: 1.0,
            time: self.growth_time,
        }))
        .tropism(steering)
        .load(WEIGHT)
        .into_dyn()
        .build()
        .unwrap()
    }
}

pub(super) fn circle(shoot: &Shoot<DynLaws>, radius: f64) -> RotatingWave {
    RotatingWaveSolver::default()
        .from_mode(shoot, &mode(shoot), radius)
        .unwrap()
}

pub(super) fn swing(shoot: &Shoot<DynLaws>, amplitude: f64, intervals: usize) -> PeriodicOrbit {
    let solver = PeriodicSolver {
        intervals,
        ..PeriodicSolver::default()
    };
    solver.from_mode(shoot, &mode(shoot), amplitude).unwrap()
}

/// Leading multipliers in the plane of a swing and out of it, without the trivial ones, and the
/// larger error of the trivial ones.
pub(super) fn multipliers(
    shoot: &Shoot<DynLaws>,
    orbit: &PeriodicOrbit,
) -> ([Complex<f64>; 2], f64) {
    let found = orbit.multipliers(shoot, 1).unwrap();
    (planes(&found.values).map(|set| set[0].value), found.trivial)
}

#[test]
fn circular_orbits_are_the_exact_ones() {
    for k in 0..16 {
        let length = 0.0657 + (0.078 - 0.0657) * f64::from(k) / 15.0;
        let (radius, height) = exact_orbit(length);
        let orbit = circle(&plain(length, 12), 0.8 * radius);
        // Required accuracy: 1e-9 of radius and height, 1e-10 of the rate. The error due to
        // twelve elements of order eight is 2e-10.
        let equal = relative_eq!(orbit.radius(), radius, epsilon = 0.0, max_relative = 1e-9);
        assert!(
            equal,
            "{length}: radius {} against {radius}",
            orbit.radius()
        );
        let equal = abs_diff_eq!(orbit.height(), height, epsilon = 1e-9 * length);
        assert!(
            equal,
            "{length}: height {} against {height}",
            orbit.height()
        );
        let equal = relative_eq!(orbit.rate, rate(), epsilon = 0.0, max_relative = 1e-10);
        assert!(equal, "{length}: rate {} against {}", orbit.rate, rate());
    }
}

#[test]
fn the_roots_of_circular_orbits_have_their_known_values() {
    let known = [
        (
            0.0659,
            [
                Complex::new(-0.0311915495, 8.5702048686),
                Complex::new(-0.0630919554, 0.0),
            ],
        ),
        (
            0.0670,
            [
                Complex::new(-0.1389361492, 8.4505278875),
                Complex::new(-0.2930639012, 0.0),
            ],
        ),
    ];
    for (length, roots) in known {
        let shoot = plain(length, 8);
        let orbit = circle(&shoot, 0.02);
        let found = orbit.roots(&shoot, 2).unwrap();
        assert_eq!(found.unstable(), 0);
        for (root, known) in found.roots.iter().zip(roots) {
            // Required accuracy: 1e-6. The reference values have ten decimals. The error due to
            // finite differences of equilibria is 1e-9 of the modulus of the root.
            assert_complex_eq(
                length,
                root.value * HOUR,
                known,
                1e-8 * known.norm().max(1.0),
            );
            // The residual is the distance from the root of the return map, an independent method.
            // Its error is that of 16 intervals of six points.
            assert!(
                root.residual * HOUR < 2e-5,
                "{length}: {:e}",
                root.residual * HOUR
            );
        }
        // The trivial root is zero up to the error of the finite differences, which is 1e-9 of the
        // rate of rotation (4.3 per h).
        assert!(
            found.trivial * HOUR < 1e-8,
            "{length}: {:e}",
            found.trivial * HOUR
        );
    }
}

#[test]
fn the_circular_orbit_with_statoliths_has_its_known_values() {
    let shoot = shoot(0.0659, 8)
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    let orbit = circle(&shoot, 0.03);
    // Reference values (mm, min), computed to twelve digits by two other methods.
    assert_relative_eq!(
        1e3 * orbit.radius(),
        29.4264635251,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_relative_eq!(
        1e3 * orbit.height(),
        56.0385542275,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_relative_eq!(
        orbit.period() / MINUTE,
        92.7509781920,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    // The shape is not planar. The largest elastic twist is 0.04 1/m, and the growth has no twist.
    let twist = |e: usize, g: usize| orbit.rod.strain(e, g).unwrap().z.abs();
    let largest = (0..8)
        .flat_map(|e| (0..4).map(move |g| (e, g)))
        .map(|(e, g)| twist(e, g))
        .fold(0.0, f64::max);
    assert!((0.035..0.045).contains(&largest), "{largest}");
    let twist = orbit
        .rod
        .points()
        .iter()
        .map(|point| point.intrinsic.z.abs())
        .fold(0.0, f64::max);
    assert!(twist < 1e-9, "{twist}");
    let roots = orbit.roots(&shoot, 2).unwrap();
    for (root, known) in roots.roots.iter().zip([
        Complex::new(-0.124195866, 8.004282494),
        Complex::from(-0.252067954),
    ]) {
        assert_complex_eq(
            "root",
            root.value * HOUR,
            known,
            1e-6 * known.norm().max(1.0),
        );
    }
}

/// Reference values of a swing, computed by two other methods.
struct KnownSwing {
    /// Length, m.
    length: f64,
    /// Largest excursion of the tip, mm.
    excursion: f64,
    /// Height of the tip at the largest excursion, mm, if known.
    height: Option<f64>,
    /// Period, min.
    period: f64,
    /// Leading exponents of disturbances in the plane, if known, and out of it, 1/h.
    inside: Option<f64>,
    outside: f64,
}

impl KnownSwing {
    /// Compares these values with the swing on a given mesh and a given number of intervals in a
    /// period. The error due to six elements is 1e-9 of the excursion. Shoots that almost buckle
    /// during their swing need more intervals.
    fn assert_found(&self, elements: u32, intervals: usize) {
        let shoot = plain(self.length, elements);
        let orbit = swing(&shoot, 1e-3 * self.excursion, intervals);
        let (largest, rod) = orbit.largest_excursion(&shoot).unwrap();
        // Required relative accuracy: 1e-8, if the reference value has enough digits.
        assert_relative_eq!(
            1e3 * largest,
            self.excursion,
            epsilon = 0.0,
            max_relative = 1e-8
        );
        assert_relative_eq!(
            orbit.period / MINUTE,
            self.period,
            epsilon = 0.0,
            max_relative = 1e-8
        );
        if let Some(height) = self.height {
            // The height changes in time at the largest excursion. Its error is of first order in
            // the error of the time of this excursion.
            assert_relative_eq!(
                1e3 * rod.tip().z,
                height,
                epsilon = 0.0,
                max_relative = 1e-8
            );
        }
        let (found, defect) = multipliers(&shoot, &orbit);
        let [inside, outside] =
            found.map(|multiplier| multiplier.norm().ln() / orbit.period * HOUR);
        // Required accuracy of the exponents: 1e-6.
        if let Some(known) = self.inside {
            assert_abs_diff_eq!(inside, known, epsilon = 1e-8);
        }
        assert_abs_diff_eq!(outside, self.outside, epsilon = 1e-7);
        // Required accuracy of the trivial multipliers: 1e-8.
        assert!(defect < 1e-8, "trivial multipliers off by {defect:e}");
    }
}

#[test]
fn swing_at_6_59_cm_has_its_known_values() {
    KnownSwing {
        length: 0.0659,
        excursion: 16.766135125,
        height: Some(62.952493063),
        period: 87.639390134,
        inside: Some(-0.0627567395),
        outside: 0.0213561488,
    }
    .assert_found(6, 16);
}

#[test]
fn swing_at_6_70_cm_has_its_known_values() {
    KnownSwing {
        length: 0.0670,
        excursion: 34.194086156,
        height: Some(53.492920904),
        period: 87.661715125,
        inside: Some(-0.2867102380),
        outside: 0.1052756418,
    }
    .assert_found(6, 16);
}

#[test]
fn swing_at_6_80_cm_has_its_known_values() {
    KnownSwing {
        length: 0.0680,
        excursion: 41.972953586,
        height: None,
        period: 87.704922215,
        inside: None,
        outside: 0.18402357,
    }
    .assert_found(6, 24);
}

/// This shoot almost buckles during its swing.
#[test]
fn swing_at_7_40_cm_has_its_known_values() {
    KnownSwing {
        length: 0.0740,
        excursion: 56.7601829,
        height: None,
        period: 88.25818623,
        inside: None,
        outside: 0.7405488,
    }
    .assert_found(6, 64);
}

/// The error of the return map with s Radau points in an interval is at least of order s + 1 in the
/// length of the interval. This order also holds at delayed times inside the intervals.
#[test]
fn multipliers_converge_with_the_number_of_intervals() {
    let shoot = plain(0.067, 4);
    let root = mode(&shoot);
    let orbit = |intervals: usize| {
        let solver = PeriodicSolver {
            intervals,
            stages: 3,
            accuracy: 1e-2,
            ..PeriodicSolver::default()
        };
        multipliers(&shoot, &solver.from_mode(&shoot, &root, 0.034).unwrap()).0
    };
    let [coarse, middle, fine] = [12, 24, 48].map(orbit);
    for which in 0..2 {
        let order =
            ((coarse[which] - middle[which]).norm() / (middle[which] - fine[which]).norm()).log2();
        assert!(order > 3.5, "order {order}");
    }
}

/// An orbit is a good initial guess for the same orbit on twice as many intervals. The change
/// estimates the error of the coarser orbit.
#[test]
fn coarse_orbit_is_refined_on_twice_the_intervals() {
    let shoot = plain(0.067, 4);
    let coarse = swing(&shoot, 0.034, 12);
    let solver = PeriodicSolver {
        intervals: 24,
        ..PeriodicSolver::default()
    };
    let fine = solver.from_orbit(&shoot, &coarse).unwrap();
    assert!(fine.iterations <= 4, "{}", fine.iterations);
    // The periods are 87.661715148 and 87.661715126 min. Their relative difference of 2.5e-10 is
    // not zero.
    assert_relative_eq!(
        fine.period,
        coarse.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert_ne!(fine.period, coarse.period);
    let [(before, _), (after, _)] = [&coarse, &fine].map(|orbit| multipliers(&shoot, orbit));
    for (before, after) in before.iter().zip(&after) {
        assert_complex_eq("multiplier", *before, *after, 1e-7);
    }
    assert_relative_eq!(
        fine.period,
        swing(&shoot, 0.034, 24).period,
        epsilon = 0.0,
        max_relative = 1e-10
    );
}

/// Length at the onset of oscillations, m.
const ONSET: f64 = 0.0656148664908;

#[test]
fn near_the_onset_the_swing_is_wider_than_the_circle_by_the_root_of_four_thirds() {
    let ratio = |beyond: f64| {
        let shoot = plain(ONSET + beyond, 8);
        let radius = circle(&shoot, (0.771 * beyond).sqrt()).radius();
        let (amplitude, _) = swing(&shoot, (1.028 * beyond).sqrt(), 12)
            .largest_excursion(&shoot)
            .unwrap();
        (amplitude / radius).powi(2)
    };
    // The ratio is linear in the length to first order. Extrapolation from two lengths eliminates
    // this term.
    let [near, far] = [4e-6, 8e-6].map(ratio);
    assert_abs_diff_eq!(2.0 * near - far, 4.0 / 3.0, epsilon = 1e-4);
}

/// The growth rate of the mode of the upright shoot at 2e-4 cm beyond the onset is μ. The roots of
/// the circle are −μ and −2μ. The exponents of the swing are −2μ and 2μ/3.
#[test]
fn near_the_onset_roots_are_multiples_of_the_growth_rate_of_the_upright_shoot() {
    let shoot = plain(ONSET + 2e-6, 8);
    let mu = 1.119568989 * 2e-4;
    let roots = circle(&shoot, 1.2e-3).roots(&shoot, 2).unwrap().roots;
    for (root, known) in roots.iter().zip([-mu, -2.0 * mu]) {
        assert_relative_eq!(
            root.value.re * HOUR,
            known,
            epsilon = 0.0,
            max_relative = 0.01
        );
    }
    let orbit = swing(&shoot, 1.4e-3, 16);
    let ([inside, outside], _) = multipliers(&shoot, &orbit);
    for (multiplier, known) in [(inside, -2.0 * mu), (outside, 2.0 / 3.0 * mu)] {
        let rate = multiplier.norm().ln() / orbit.period * HOUR;
        assert_relative_eq!(rate, known, epsilon = 0.0, max_relative = 0.01);
    }
}

/// Graviceptive oscillations, without proprioception. Radius and height of the circle (mm) were
/// computed by another program, which integrates the equation of `fixtures::exact_orbit` with a
/// relative error below 1e-13; its critical length is 7.1003931 cm.
#[test]
fn without_proprioception_the_circle_is_exact_and_stable_and_the_swing_unstable() {
    let parameters = |length: f64| Parameters {
        youngs_modulus: 1e7,
        beta: 0.8,
        eta: 0.0,
        growth_time: GROWTH_TIME,
        memory: MEMORY,
        length,
    };
    for (length, radius, height) in [
        (0.0712, 12.7809522478, 69.6674545114),
        (0.0715, 20.0657912690, 67.6598407635),
    ] {
        let shoot = parameters(length).shoot(12);
        let wave = circle(&shoot, 1e-3 * radius);
        // Twelve elements have the same relative error as with proprioception.
        assert_relative_eq!(
            1e3 * wave.radius(),
            radius,
            epsilon = 0.0,
            max_relative = 1e-9
        );
        assert_relative_eq!(
            1e3 * wave.height(),
            height,
            epsilon = 0.0,
            max_relative = 1e-9
        );
        assert_relative_eq!(wave.rate, rate(), epsilon = 0.0, max_relative = 1e-10);
        assert_eq!(wave.roots(&shoot, 1).unwrap().unstable(), 0, "{length}");
    }
    // Near the onset the disturbance out of the plane of a swing grows with 2/3 of the growth rate
    // of the upright shoot, to the first order in the distance from the onset.
    let shoot = parameters(0.07105).shoot(8);
    let mu = mode(&shoot).value.re * HOUR;
    let orbit = swing(&shoot, 7e-3, 16);
    let found = orbit.multipliers(&shoot, 1).unwrap();
    assert_eq!(found.unstable(), 1);
    let [_, outside] = planes(&found.values);
    let rate = outside[0].value.norm().ln() / orbit.period * HOUR;
    assert_relative_eq!(rate, 2.0 / 3.0 * mu, epsilon = 0.0, max_relative = 0.01);
}

/// An initial guess of a third of the amplitude suffices, unless the shoot almost buckles.
#[test]
fn a_third_of_the_amplitude_is_a_sufficient_initial_guess() {
    for (length, amplitude) in [(0.0659, 0.0168), (0.0670, 0.0342), (0.0690, 0.0469)] {
        let shoot = plain(length, 4);
        let [third, whole] =
            [1.0 / 3.0, 1.0].map(|share| swing(&shoot, share * amplitude, 24).period);
        // The tolerance of both orbits is 1e-10. The phases of their grids differ, but the error
        // due to 24 intervals is less than the tolerance.
        let equal = relative_eq!(third, whole, epsilon = 0.0, max_relative = 1e-9);
        assert!(equal, "{length}: periods {third} and {whole}");
        let [third, whole] =
            [1.0 / 3.0, 1.0].map(|share| circle(&shoot, share * amplitude).radius());
        let equal = relative_eq!(third, whole, epsilon = 0.0, max_relative = 1e-9);
        assert!(equal, "{length}: radii {third} and {whole}");
    }
}
