//! Limit cycles that are found instead of waited for, of the reduced model: circular orbits against the exact two-point problem;
//! pendular ones, roots and multipliers against numbers that were computed twice, by harmonic balance and spectral time steps, by a
//! characteristic matrix and a generator matrix.

use std::f64::consts::TAU;

use crate::fixtures::exact_orbit::{GROWTH_TIME, exact_orbit, rate};
use crate::fixtures::shoots::{ETA, HOUR, MEMORY, MINUTE, RADIUS, Reduced, STATOLITHS, reduced, steering};
use morphorod::cycle::{CircularOrbit, CircularSolver, CycleError, Multiplier, PeriodicOrbit, PeriodicSolver, Turning};
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{HistoryFunction, IntegrationError, Integrator, MethodOfSteps};
use morphorod::stability::Linearisation;
use morphorod::tropism::{
    DirectionalTropism, Oscillator, Perception, Proprioception, Response, SettledStatoliths, Site, Source,
};
use morphorod::{DynLaws, Model, Shoot, ShootBuilder};
use nalgebra::{Complex, Vector3};

/// A shoot of any length that steers all along, with equal elements.
fn shoot(length: f64, elements: u32) -> ShootBuilder<Reduced> {
    let nodes: Vec<f64> = (0..=elements).map(|i| length * f64::from(i) / f64::from(elements)).collect();
    reduced(length, GROWTH_TIME).growth(Ongoing(UniformGrowth { zone_length: 1.0, time: GROWTH_TIME })).nodes(&nodes)
}

fn circle(shoot: &Shoot<impl Model>, radius: f64) -> CircularOrbit {
    let root = Linearisation::about(shoot).unwrap().rightmost().unwrap();
    CircularSolver::default().solve(shoot, &Turning::of_mode(&root, radius)).unwrap()
}

fn pendulum(shoot: &Shoot<impl Model>, amplitude: f64, intervals: usize) -> PeriodicOrbit {
    let root = Linearisation::about(shoot).unwrap().rightmost().unwrap();
    let solver = PeriodicSolver { intervals, ..PeriodicSolver::default() };
    solver.from_mode(shoot, &root, amplitude).unwrap()
}

/// Takes the trivial multiplier out; returns its defect.
fn without_trivial(set: &mut Vec<Multiplier>) -> f64 {
    let defect = |multiplier: &Multiplier| (multiplier.value - 1.0).norm();
    let at = (0..set.len()).min_by(|a, b| defect(&set[*a]).total_cmp(&defect(&set[*b]))).unwrap();
    defect(&set.remove(at))
}

/// The multipliers in the plane of a swing and out of it, without the trivial ones, and the larger defect of these.
fn multipliers(shoot: &Shoot<impl Model>, orbit: &PeriodicOrbit) -> ([Complex<f64>; 2], f64) {
    let mut sets = orbit.multipliers(shoot, 16).unwrap();
    let defect = sets.iter_mut().map(without_trivial).fold(0.0, f64::max);
    (sets.map(|set| set[0].value), defect)
}

#[test]
fn circular_orbits_are_the_exact_ones() {
    for k in 0..16 {
        let length = 0.0657 + (0.078 - 0.0657) * f64::from(k) / 15.0;
        let (radius, height) = exact_orbit(length);
        let orbit = circle(&shoot(length, 12).into_dyn().build().unwrap(), 0.8 * radius);
        // Promised: 1e-9 of radius and height, 1e-10 of the rate; twelve elements of order eight leave 2e-10.
        assert!((orbit.radius() / radius - 1.0).abs() < 1e-9, "{length}: {} {radius}", orbit.radius());
        assert!((orbit.height() - height).abs() < 1e-9 * length, "{length}: {} {height}", orbit.height());
        assert!((orbit.rate / rate() - 1.0).abs() < 1e-10, "{length}: {}", orbit.rate);
    }
}

#[test]
fn the_roots_of_circular_orbits_have_their_known_values() {
    let known = [
        (0.0659, [Complex::new(-0.0311915495, 8.5702048686), Complex::new(-0.0630919554, 0.0)]),
        (0.0670, [Complex::new(-0.1389361492, 8.4505278875), Complex::new(-0.2930639012, 0.0)]),
    ];
    for (length, roots) in known {
        let shoot = shoot(length, 8).into_dyn().build().unwrap();
        let orbit = circle(&shoot, 0.02);
        let found = orbit.roots(&shoot, 12).unwrap();
        assert_eq!(found.unstable(), 0);
        for (root, known) in found.roots.iter().zip(roots) {
            let off = (root.value * HOUR - known).norm();
            // Promised: 1e-6. The tables have ten digits; differences of equilibria leave 1e-9 of the size of the root.
            assert!(off < 1e-8 * known.norm().max(1.0), "{length}: {:?}", root.value * HOUR);
            // The return map, another method, has the order of 16 intervals of six points.
            assert!(root.difference * HOUR < 2e-5, "{length}: {:e}", root.difference * HOUR);
        }
        // Zero but for the differences: 1e-9 of the rate of turning, 4.3 per h.
        assert!(found.trivial * HOUR < 1e-8, "{length}: {:e}", found.trivial * HOUR);
    }
}

#[test]
fn the_circular_orbit_with_statoliths_has_its_known_values() {
    let shoot = shoot(0.0659, 8).tropism(steering(STATOLITHS)).into_dyn().build().unwrap();
    let orbit = circle(&shoot, 0.03);
    // Computed to twelve digits by two other methods (mm, min).
    let found = [1e3 * orbit.radius(), 1e3 * orbit.height(), orbit.period() / MINUTE];
    for (found, known) in found.iter().zip([29.4264635251, 56.0385542275, 92.7509781920]) {
        assert!((found / known - 1.0).abs() < 1e-8, "{found} {known}");
    }
    // It is not plane: it twists by up to 0.04 1/m, elastically. Nothing drives a twist of the growth.
    let twist = |e: usize, g: usize| orbit.rod.strain(e, g).unwrap().z.abs();
    let largest = (0..8).flat_map(|e| (0..4).map(move |g| (e, g))).map(|(e, g)| twist(e, g)).fold(0.0, f64::max);
    assert!((0.035..0.045).contains(&largest), "{largest}");
    let twist = orbit.rod.points().iter().map(|point| point.intrinsic.z.abs()).fold(0.0, f64::max);
    assert!(twist < 1e-9, "{twist}");
    let roots = orbit.roots(&shoot, 12).unwrap();
    for (root, known) in roots.roots.iter().zip([Complex::new(-0.124195866, 8.004282494), Complex::from(-0.252067954)])
    {
        assert!((root.value * HOUR - known).norm() < 1e-6 * known.norm().max(1.0), "{:?}", root.value * HOUR);
    }
}

#[test]
fn pendular_orbits_have_their_known_values() {
    // Length (m), excursion and height there (mm), period (min), root in the plane (none where the table has none) and out of it, 1/h;
    // intervals of a period: more where the shoot all but buckles on its way.
    let known = [
        (0.0659, 16.766135125, 62.952493063, 87.639390134, -0.0627567395, 0.0213561488, 16),
        (0.0670, 34.194086156, 53.492920904, 87.661715125, -0.2867102380, 0.1052756418, 16),
        (0.0680, 41.972953586, f64::NAN, 87.704922215, f64::NAN, 0.18402357, 24),
        (0.0740, 56.7601829, f64::NAN, 88.25818623, f64::NAN, 0.7405488, 64),
    ];
    for (length, excursion, height, period, inside, outside, intervals) in known {
        let shoot = shoot(length, 8).into_dyn().build().unwrap();
        let orbit = pendulum(&shoot, 1e-3 * excursion, intervals);
        let (largest, rod) = orbit.largest_excursion(&shoot).unwrap();
        // Promised: 1e-8 relative, where the table has so many digits.
        let off = (1e3 * largest / excursion - 1.0).abs();
        assert!(off < 1e-8, "{length}: excursion {} off by {off:e}", 1e3 * largest);
        let off = (orbit.period / MINUTE / period - 1.0).abs();
        assert!(off < 1e-8, "{length}: period {} off by {off:e}", orbit.period / MINUTE);
        if height.is_finite() {
            // Where the excursion is largest the height changes: it has half as many digits more of the time's error.
            assert!((1e3 * rod.tip().z / height - 1.0).abs() < 1e-8, "{length}: height {}", 1e3 * rod.tip().z);
        }
        let ([in_plane, out_of_plane], defect) = multipliers(&shoot, &orbit);
        let rate = |multiplier: Complex<f64>| multiplier.norm().ln() / orbit.period * HOUR;
        // Promised: 1e-6.
        if inside.is_finite() {
            assert!((rate(in_plane) - inside).abs() < 1e-8, "{length}: in the plane {}", rate(in_plane));
        }
        assert!((rate(out_of_plane) - outside).abs() < 1e-7, "{length}: out of the plane {}", rate(out_of_plane));
        // Promised: 1e-8.
        assert!(defect < 1e-8, "{length}: trivial multipliers off by {defect:e}");
    }
}

/// The error of a map of s Radau points in an interval falls with the power s + 1 at least, inside the intervals where delays read.
#[test]
fn multipliers_converge_with_the_intervals() {
    let shoot = shoot(0.067, 4).into_dyn().build().unwrap();
    let orbit = |intervals: usize| {
        let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
        let solver = PeriodicSolver { intervals, stages: 3, ..PeriodicSolver::default() };
        let orbit = solver.from_mode(&shoot, &root, 0.034).unwrap();
        multipliers(&shoot, &orbit).0
    };
    let [coarse, middle, fine] = [12, 24, 48].map(orbit);
    for which in 0..2 {
        let order = ((coarse[which] - middle[which]).norm() / (middle[which] - fine[which]).norm()).log2();
        assert!(order > 3.5, "order {order}");
    }
}

/// The same orbit on twice the intervals is near at once, and tells how accurate the first was.
#[test]
fn an_orbit_is_refined_from_a_coarse_one() {
    let shoot = shoot(0.067, 4).into_dyn().build().unwrap();
    let coarse = pendulum(&shoot, 0.034, 12);
    let solver = PeriodicSolver { intervals: 24, ..PeriodicSolver::default() };
    let fine = solver.from_orbit(&shoot, &coarse).unwrap();
    assert!(fine.iterations <= 4, "{}", fine.iterations);
    // 87.661715148 and 87.661715126 min: 2.5e-10.
    let change = (fine.period / coarse.period - 1.0).abs();
    assert!(change > 0.0 && change < 1e-9, "{change:e}");
    let [(before, _), (after, _)] = [&coarse, &fine].map(|orbit| multipliers(&shoot, orbit));
    for (before, after) in before.iter().zip(&after) {
        assert!((before - after).norm() < 1e-7, "{before} {after}");
    }
    assert!((fine.period / pendulum(&shoot, 0.034, 24).period - 1.0).abs() < 1e-10);
}

#[test]
fn near_the_onset_the_swing_is_wider_than_the_circle_by_the_root_of_four_thirds() {
    let onset = 0.0656148664908;
    let ratio = |beyond: f64| {
        let shoot = shoot(onset + beyond, 8).into_dyn().build().unwrap();
        let radius = circle(&shoot, (0.771 * beyond).sqrt()).radius();
        let (amplitude, _) = pendulum(&shoot, (1.028 * beyond).sqrt(), 12).largest_excursion(&shoot).unwrap();
        (amplitude / radius).powi(2)
    };
    // The ratio is linear in the length to first order: two lengths cancel that.
    let [near, far] = [4e-6, 8e-6].map(ratio);
    let extrapolated = 2.0 * near - far;
    assert!((extrapolated - 4.0 / 3.0).abs() < 1e-4, "{extrapolated} from {near} and {far}");

    // 2e-4 cm beyond the onset: with μ the growth rate of the upright shoot there, the roots are −μ and −2μ of the circle, −2μ and 2μ/3
    // of the swing.
    let shoot = shoot(onset + 2e-6, 8).into_dyn().build().unwrap();
    let mu = 1.119568989 * 2e-4;
    let roots = circle(&shoot, 1.2e-3).roots(&shoot, 12).unwrap().roots;
    for (root, known) in roots.iter().zip([-mu, -2.0 * mu]) {
        assert!((root.value.re * HOUR / known - 1.0).abs() < 0.01, "{} {known}", root.value.re * HOUR);
    }
    let orbit = pendulum(&shoot, 1.4e-3, 16);
    let ([inside, outside], _) = multipliers(&shoot, &orbit);
    for (multiplier, known) in [(inside, -2.0 * mu), (outside, 2.0 / 3.0 * mu)] {
        let rate = multiplier.norm().ln() / orbit.period * HOUR;
        assert!((rate / known - 1.0).abs() < 0.01, "{rate} {known}");
    }
}

/// Followed in time by another method: what is a little out of the plane grows by the multiplier, from swing to swing.
#[test]
fn a_swing_that_is_pushed_to_the_side_leaves_its_plane_by_the_multiplier() {
    let mut shoot = shoot(0.067, 4).into_dyn().build().unwrap();
    let orbit = pendulum(&shoot, 0.034, 16);
    let ([_, multiplier], _) = multipliers(&shoot, &orbit);
    let (_, rod) = orbit.largest_excursion(&shoot).unwrap();
    let about = if rod.tip().x.abs() > rod.tip().y.abs() { 0 } else { 1 };
    let history = orbit.enter(&mut shoot).unwrap();
    // The swing's bend is 10 1/m. At the end this is 1e-3 of it, and changes its own growth by the square of that; an error of an
    // equilibrium is 1e-8 of it.
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::ith(about, 2e-3));
    let mut run = MethodOfSteps::with_solver(orbit.period / 240.0, NewtonSolver::with_tolerance(1e-11));
    run.start(&mut shoot, &history).unwrap();
    let aside = |shoot: &Shoot<DynLaws>| if about == 0 { shoot.tip().y } else { shoot.tip().x };
    let mut seen = Vec::new();
    for k in 0..=18 {
        run.advance(&mut shoot, f64::from(k) * orbit.period).unwrap();
        seen.push(aside(&shoot));
    }
    // What has turned stays aside by the same at the same phase: differences from swing to swing are free of it. The first eight
    // swings hold what dies out, with multipliers of 0.24: 1e-5 of it is left.
    let growth = ((seen[18] - seen[17]) / (seen[8] - seen[7])).powf(0.1);
    assert!((growth / multiplier.re - 1.0).abs() < 1e-4, "{growth} {multiplier} {seen:?}");
}

/// Light from a lamp above the shoot, at a finite distance: tissue perceives in what direction it is.
struct Lamp(Vector3<f64>);

impl Perception for Lamp {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut morphorod::tropism::Declaration) -> Source {
        to.with_position().stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&(self.0 - site.position).normalize());
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

#[test]
fn a_shoot_with_a_law_of_ones_own_swings_too() {
    let lamp = Lamp(Vector3::z() * 0.5);
    let mut shoot = shoot(0.068, 4)
        .tropism((
            DirectionalTropism { sensitivity: 0.8, perception: lamp }.remembered(MEMORY),
            Proprioception { sensitivity: ETA }.remembered(MEMORY),
        ))
        .into_dyn()
        .build()
        .unwrap();
    let circular = circle(&shoot, 0.03);
    assert_eq!(circular.roots(&shoot, 12).unwrap().unstable(), 0);
    // Equal memories: the rate is that of every circular orbit, whatever is perceived.
    assert!((circular.rate / rate() - 1.0).abs() < 1e-10, "{} {}", circular.rate, rate());

    let orbit = pendulum(&shoot, 0.04, 16);
    let ([_, outside], _) = multipliers(&shoot, &orbit);
    assert!(outside.norm() > 1.1, "{outside}");
    // Three swings in time end where they began, up to the error of the steps and what this lets grow.
    let history = orbit.enter(&mut shoot).unwrap();
    let mut run = MethodOfSteps::new(orbit.period / 240.0);
    run.start(&mut shoot, &history).unwrap();
    let before = shoot.tip();
    run.advance(&mut shoot, 3.0 * orbit.period).unwrap();
    let off = (shoot.tip() - before).norm();
    assert!(off < 1e-6 * 0.068, "{off:e}");
    // And half a swing later it is on the other side.
    run.advance(&mut shoot, 3.5 * orbit.period).unwrap();
    let mirrored = Vector3::new(-before.x, -before.y, before.z);
    assert!((shoot.tip() - mirrored).norm() < 2e-6 * 0.068);
    assert!(orbit.period > 0.9 * TAU / rate());
}

/// A weak oscillator below the onset: the cycle is the linear response, and what a run in time settles to.
#[test]
fn a_shoot_with_an_oscillator_has_the_cycle_that_it_settles_to() {
    let (alpha, period) = (1e-3, 24.0 * MINUTE);
    let still = shoot(0.05, 4).into_dyn().build().unwrap();
    let linear = Linearisation::about(&still).unwrap();
    let gradient = Vector3::new(Complex::from(alpha / RADIUS), Complex::new(0.0, -alpha / RADIUS), Complex::from(0.0));
    let response = linear.response(TAU / period, &gradient).unwrap();
    let expected = response.displacement.last().unwrap().fixed_rows::<2>(0).norm() / 2.0_f64.sqrt();

    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let mut driven = shoot(0.05, 4)
        .tropism((Oscillator::new(alpha, period), gravitropism, proprioception))
        .into_dyn()
        .build()
        .unwrap();
    let orbit = PeriodicSolver::default().forced(&driven, period).unwrap();
    let other = PeriodicSolver::default().forced(&driven, 1.1 * period);
    assert!(matches!(other, Err(CycleError::NoCommonPeriod { .. })), "{other:?}");
    let (excursion, _) = orbit.largest_excursion(&driven).unwrap();
    // The tip's circle is 4e-5 of the length: what is not linear is the square of that.
    assert!((excursion / expected - 1.0).abs() < 1e-6, "{excursion} {expected}");
    // No disturbance is kept.
    let largest = orbit.multipliers(&driven, 12).unwrap().map(|set| set[0].value.norm());
    assert!(largest.iter().all(|multiplier| *multiplier < 1.0), "{largest:?}");
    let history = orbit.enter(&mut driven).unwrap();
    let mut run = MethodOfSteps::with_solver(period / 64.0, NewtonSolver::with_tolerance(1e-12));
    run.start(&mut driven, &history).unwrap();
    let before = driven.tip();
    run.advance(&mut driven, 5.0 * period).unwrap();
    // Of the circle a step of a 64th of the period leaves 1e-5.
    assert!((driven.tip() - before).norm() < 1e-4 * excursion, "{:e}", (driven.tip() - before).norm() / excursion);
}

/// A third of the amplitude is enough to start from, as long as the shoot does not come close to buckling.
#[test]
fn rough_starts_lead_to_the_orbit() {
    for (length, amplitude) in [(0.0659, 0.0168), (0.0670, 0.0342), (0.0690, 0.0469)] {
        let shoot = shoot(length, 4).into_dyn().build().unwrap();
        let [third, whole] = [1.0 / 3.0, 1.0].map(|share| pendulum(&shoot, share * amplitude, 24));
        // Both are found to 1e-10; where the grid lies differs, and 24 intervals leave less than that.
        assert!((third.period / whole.period - 1.0).abs() < 1e-9, "{length}: {} {}", third.period, whole.period);
        let [third, whole] = [1.0 / 3.0, 1.0].map(|share| circle(&shoot, share * amplitude));
        assert!(
            (third.radius() / whole.radius() - 1.0).abs() < 1e-9,
            "{length}: {} {}",
            third.radius(),
            whole.radius()
        );
    }
}

/// The past of an orbit serves the laws whose orbit it is, at the phase at which it was found.
#[test]
fn the_past_of_an_orbit_is_no_other_shoots() {
    let plain = || shoot(0.067, 4).into_dyn().build().unwrap();
    let mut swinging = plain();
    let history = pendulum(&swinging, 0.034, 12).enter(&mut swinging).unwrap();
    let site = Site::new(swinging.environment(), swinging.rod().frames()[0], swinging.rod());
    let mut variables = [f64::INFINITY; 4];
    history.variables(swinging.model().tropism(), f64::NAN, &site, &[], &mut variables);
    // Of other laws, which keep seven numbers and not four, nothing is known, and nothing is made up.
    let mut others = shoot(0.067, 4).tropism(steering(STATOLITHS)).into_dyn().build().unwrap();
    let refused = MethodOfSteps::new(60.0).start(&mut others, &history);
    assert!(matches!(refused, Err(IntegrationError::NotFinite { .. })), "{refused:?}");

    let period = 24.0 * MINUTE;
    let (gravitropism, proprioception) = steering(SettledStatoliths);
    let laws = (Oscillator::new(1e-3, period), gravitropism, proprioception);
    let mut driven = shoot(0.05, 4).tropism(laws).into_dyn().build().unwrap();
    let orbit = PeriodicSolver::default().forced(&driven, period).unwrap();
    let mut run = MethodOfSteps::new(60.0);
    run.advance(&mut driven, 0.3 * period).unwrap();
    let before = driven.clone();
    assert!(matches!(orbit.enter(&mut driven), Err(CycleError::Parameter(_))));
    assert!(driven.state() == before.state(), "an error leaves the shoot as it was");
    run.advance(&mut driven, 2.0 * period).unwrap();
    assert!(orbit.enter(&mut driven).is_ok());
}
