//! Characteristic roots against time integration, and their number against a search of the half plane, cell by cell, for
//! the roots of the continuous problem.

mod upright;

use std::f64::consts::FRAC_PI_2;

use morphorod::growth::{GrowthLaw, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, SettledPast};
use morphorod::load::{Load, Weight};
use morphorod::stability::{Linearisation, Polarisation, StationarySolver, Unstable};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, SettledStatoliths, Statoliths, TropismLaw};
use morphorod::{Scene, Shoot, Still};
use nalgebra::{Complex, Vector3};
use proptest::prelude::*;

use upright::{HOUR, MEMORY, YOUNG};

/// The reduced shoot of a length (m), on a base that leans (rad).
fn shoot<T: TropismLaw>(
    length: f64,
    lean: f64,
    elements: usize,
    laws: T,
) -> Shoot<impl GrowthLaw, T, impl morphorod::constitutive::Constitutive, impl Load, impl Scene> {
    Shoot::builder(YOUNG)
        .length(length)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 20.0 * HOUR }))
        .tropism(laws)
        .load(Weight { density: 1000.0 })
        .scene(Still::tilted(lean))
        .build()
        .unwrap()
}

/// λ from a run: disturbs the stationary shoot a little, waits, and fits x(k + 1) = a x(k) + b x(k − 1) to the tip.
fn root_in_time<T: TropismLaw>(length: f64, lean: f64, laws: T, wait: f64) -> (Complex<f64>, Complex<f64>) {
    let mut shoot = shoot(length, lean, 6, laws);
    let _ = StationarySolver::default().solve(&mut shoot).unwrap();
    let roots = Linearisation::about(&shoot).unwrap().roots(-2e-4).unwrap();
    let rest = shoot.tip();
    // In the plane of the lean. Small, so that the cubic terms are 1e-8 of it even after it has grown a hundredfold.
    for point in shoot.rod_mut().points_mut() {
        point.intrinsic.y += 1e-4;
    }
    let mut run = MethodOfSteps::new(60.0);
    run.solver.tolerance = 1e-13;
    run.start(&mut shoot, &SettledPast).unwrap();
    run.advance(&mut shoot, wait).unwrap();
    let every = 600.0;
    let mut signal = Vec::new();
    for k in 0..40 {
        run.advance(&mut shoot, wait + every * f64::from(k)).unwrap();
        signal.push((shoot.tip() - rest).dot(&(Vector3::x() * lean.cos() + Vector3::z() * lean.sin())));
    }
    // Least squares, every equation weighted by the size of its signal.
    let mut normal = nalgebra::Matrix2::zeros();
    let mut right = nalgebra::Vector2::zeros();
    for w in signal.windows(3) {
        let scale = 1.0 / (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
        let row = nalgebra::Vector2::new(w[1], w[0]);
        normal += row * row.transpose() * scale;
        right += row * (w[2] * scale);
    }
    let fit = normal.try_inverse().unwrap() * right;
    let z = (Complex::from(fit[0]) + Complex::from(fit[0] * fit[0] + 4.0 * fit[1]).sqrt()) / 2.0;
    let found = z.ln() / every;
    let found = Complex::new(found.re, found.im.abs());
    // Swings in the plane of the lean are one of the roots of a righted shoot, those across it another.
    let nearest = roots.iter().map(|root| root.value).min_by(|a, b| (a - found).norm().total_cmp(&(b - found).norm()));
    (found, nearest.expect("roots right of the line"))
}

#[test]
fn small_disturbances_grow_and_turn_as_the_rightmost_root_says() {
    let gravity = |memory| Gravitropism { sensitivity: 0.8, memory, statoliths: SettledStatoliths };
    let bending = |memory| Proprioception { sensitivity: 20.0, memory };
    let equal = (gravity(MEMORY), bending(MEMORY));
    let slow = Gravitropism { sensitivity: 0.8, memory: MEMORY, statoliths: Statoliths { avalanche_time: 120.0 } };
    let unequal = (slow, bending(Memory { time: 600.0, delay: 840.0 }));
    let cases = [
        ("below onset", root_in_time(0.060, 0.0, equal, 10.0 * HOUR)),
        ("just below onset", root_in_time(0.065, 0.0, equal, 10.0 * HOUR)),
        ("above onset", root_in_time(0.067, 0.0, equal, 10.0 * HOUR)),
        ("righted on a tilted base", root_in_time(0.062, 0.3, equal, 12.0 * HOUR)),
        ("unequal kernels and statoliths", root_in_time(0.063, 0.0, unequal, 12.0 * HOUR)),
    ];
    for (name, (found, expected)) in cases {
        // Other roots have died out to 1e-4 by then; the error in time at 60 s is 1e-5.
        let error = (found - expected).norm() / expected.norm();
        assert!(error < 1e-3, "{name}: {found} in time, {expected} from the linear problem");
    }
}

#[test]
fn an_upright_shoot_swings_in_any_plane_and_a_righted_one_in_its_own_or_across() {
    let laws = || {
        (
            Gravitropism { sensitivity: 0.8, memory: MEMORY, statoliths: SettledStatoliths },
            Proprioception { sensitivity: 20.0, memory: MEMORY },
        )
    };
    let mut upright = shoot(0.067, 0.0, 4, laws());
    let _ = StationarySolver::default().solve(&mut upright).unwrap();
    let root = Linearisation::about(&upright).unwrap().rightmost().unwrap();
    assert_eq!((root.polarisation, root.multiplicity), (Polarisation::Isotropic, 2));
    assert!(root.growth_rate() > 0.0 && root.residual < 1e-12);
    assert!(root.displacement[0].norm() == 0.0, "the base does not move");
    let mut righted = shoot(0.06, 0.5, 4, laws());
    let _ = StationarySolver::default().solve(&mut righted).unwrap();
    let linear = Linearisation::about(&righted).unwrap();
    assert_eq!(linear.rightmost().unwrap().multiplicity, 1);
}

#[test]
fn a_stationary_shoot_has_its_closed_form_at_any_weight_and_stiffness() {
    // η θ' = −(β/r) sin θ from a horizontal base: the tip is ((2/k) atan tanh(kℓ/2), ln cosh(kℓ)/k), k = β/(ηr).
    let (k, length): (f64, f64) = (0.8 / (20.0 * 5e-4), 0.05);
    let exact = Vector3::new(2.0 / k * (k * length / 2.0).tanh().atan(), 0.0, (k * length).cosh().ln() / k);
    for scale in [1e-2, 1e-1, 1.0, 10.0, 100.0] {
        for (stiffness, density) in [(1e7 / scale, 1000.0), (1e7, 1000.0 * scale)] {
            let mut tissue = YOUNG;
            tissue.youngs_modulus = stiffness;
            let mut shoot = Shoot::builder(tissue)
                .length(length)
                .radius(5e-4)
                .elements(8)
                .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 20.0 * HOUR }))
                .tropism((
                    Gravitropism { sensitivity: 0.8, memory: MEMORY, statoliths: SettledStatoliths },
                    Proprioception { sensitivity: 20.0, memory: MEMORY },
                ))
                .load(Weight { density })
                .scene(Still::tilted(FRAC_PI_2))
                .build()
                .unwrap();
            let found = StationarySolver::default().solve(&mut shoot).unwrap();
            assert!((shoot.tip() - exact).norm() < 1e-10, "E = {stiffness:e}, ρ = {density}: {found:?}");
        }
    }
}

/// The continuous problem of the upright shoot, EI [(1 + b) θ'' + a θ'] + q (ℓ − s) θ = 0, θ(0) = 0: its characteristic
/// function (1 + b) θ'(ℓ) + a θ(ℓ) for θ'(0) = 1, by the classical Runge–Kutta method.
struct Continuous {
    beta: f64,
    eta: f64,
    memory: Memory,
    growth_time: f64,
    length: f64,
}

impl Continuous {
    fn value(&self, z: Complex<f64>) -> Complex<f64> {
        let radius: f64 = 5e-4;
        let bending = YOUNG.stiffness(radius).x;
        let weight = 1000.0 * 9.81 * std::f64::consts::PI * radius * radius;
        let filter = (-z * self.memory.delay).exp() / (z * self.growth_time * (z * self.memory.time + 1.0));
        let (a, b) = (filter * (self.beta / radius), filter * self.eta);
        let steps = 60;
        let h = self.length / f64::from(steps);
        let (mut angle, mut slope) = (Complex::new(0.0, 0.0), Complex::new(1.0, 0.0));
        let rate = |s: f64, angle: Complex<f64>, slope: Complex<f64>| {
            -(a * slope + angle * (weight * (self.length - s) / bending)) / (b + 1.0)
        };
        for i in 0..steps {
            let s = h * f64::from(i);
            let k1 = (slope, rate(s, angle, slope));
            let k2 = (slope + k1.1 * (h / 2.0), rate(s + h / 2.0, angle + k1.0 * (h / 2.0), slope + k1.1 * (h / 2.0)));
            let k3 = (slope + k2.1 * (h / 2.0), rate(s + h / 2.0, angle + k2.0 * (h / 2.0), slope + k2.1 * (h / 2.0)));
            let k4 = (slope + k3.1 * h, rate(s + h, angle + k3.0 * h, slope + k3.1 * h));
            angle += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
            slope += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
        }
        (b + 1.0) * slope + a * angle
    }

    /// The number of roots in a rectangle, by walking around it in small steps.
    fn count(&self, low: Complex<f64>, high: Complex<f64>) -> f64 {
        let corners = [low, Complex::new(high.re, low.im), high, Complex::new(low.re, high.im), low];
        let sides =
            corners.windows(2).map(|side| self.turn((side[0], self.value(side[0])), (side[1], self.value(side[1])), 0));
        sides.sum::<f64>() / std::f64::consts::TAU
    }

    /// By how much the argument of the value changes between two points.
    fn turn(&self, a: (Complex<f64>, Complex<f64>), b: (Complex<f64>, Complex<f64>), depth: u32) -> f64 {
        let change = (b.1 / a.1).arg();
        // At least 256 steps on a side, none of which turns by more than 0.2.
        if depth >= 8 && (change.abs() < 0.2 || depth > 40) {
            return change;
        }
        let middle = (a.0 + b.0) / 2.0;
        let middle = (middle, self.value(middle));
        self.turn(a, middle, depth + 1) + self.turn(middle, b, depth + 1)
    }

    /// All cells of a grid over the unstable half plane that hold roots, with their number.
    fn search(&self) -> (f64, usize) {
        let reach = 6.0 / self.memory.delay;
        let edges = [1e-6, 0.1, 1.0].map(|part| part * reach);
        let mut sum = 0.0;
        let mut largest = 0.0_f64;
        for re in edges.windows(2) {
            for part in 0..4 {
                let (low, high) = (reach * 0.25 * f64::from(part), reach * 0.25 * f64::from(part + 1));
                // The real axis is in the middle of the first cell, so that no root lies on an edge.
                let low = if part == 0 { -1e-3 * reach } else { low };
                let count = self.count(Complex::new(re[0], low), Complex::new(re[1], high));
                largest = largest.max((count - count.round()).abs());
                sum += count.round();
            }
        }
        (largest, sum as usize)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(50))]
    #[test]
    fn the_number_of_unstable_roots_is_that_of_a_search_of_the_half_plane(
        beta in 0.3..1.5_f64,
        eta in 5.0..40.0_f64,
        minutes in 6.0..18.0_f64,
        ratio in 0.5..2.0_f64,
        hours in 4.0..40.0_f64,
        length in 0.03..0.076_f64,
    ) {
        let memory = Memory { time: 60.0 * minutes * ratio, delay: 60.0 * minutes };
        let growth_time = hours * HOUR;
        let count = |elements: usize| {
            let laws = (
                Gravitropism { sensitivity: beta, memory, statoliths: SettledStatoliths },
                Proprioception { sensitivity: eta, memory },
            );
            let mut shoot = Shoot::builder(YOUNG)
                .length(length)
                .radius(5e-4)
                .elements(elements)
                .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
                .tropism(laws)
                .load(Weight { density: 1000.0 })
                .build()
                .unwrap();
            let _ = StationarySolver::default().solve(&mut shoot).unwrap();
            let linear = Linearisation::about(&shoot).unwrap();
            (linear.unstable().unwrap(), linear.essential().unwrap()[0].re)
        };
        let (coarse, essential) = count(6);
        // Next to the essential spectrum roots pile up without end, and a mesh resolves some of them: it must be left of
        // the axis by a tenth of the memory's rate for the count to be the mesh's as well.
        prop_assume!(essential < -0.1 / memory.time);
        let (rounding, found) = Continuous { beta, eta, memory, growth_time, length }.search();
        prop_assert!(rounding < 1e-6);
        // Every root has its conjugate, and every plane its own.
        prop_assert_eq!(coarse, Unstable::Finite(4 * found));
        prop_assert_eq!(count(8).0, coarse, "another mesh");
    }
}
