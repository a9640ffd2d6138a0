//! Characteristic roots against time integration, and their number against a search of the half plane, cell by cell, for
//! the roots of the continuous problem.

use std::f64::consts::FRAC_PI_2;

use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, SteadyHistory};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, Polarisation, StabilityError, StationarySolver, Unstable};
use morphorod::tropism::{
    Gravitropism, Growing, Handedness, Memory, Proprioception, Response, SettledStatoliths, Statoliths, TropismLaw,
};
use morphorod::{Model, Shoot, Still};
use nalgebra::{Complex, Vector3};
use proptest::prelude::*;

use crate::fixtures::upright::{HOUR, MEMORY, YOUNG};

/// The reduced shoot of a length (m), on a base that leans (rad).
fn shoot<T: TropismLaw>(length: f64, lean: f64, elements: usize, laws: T) -> Shoot<impl Model<Tropism = T>> {
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
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::y() * 1e-4);
    let mut run = MethodOfSteps::new(60.0);
    run.solver.tolerance = 1e-13;
    run.start(&mut shoot, &SteadyHistory).unwrap();
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
    let gravity = |memory| Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory);
    let bending = |memory| Proprioception { sensitivity: 20.0 }.remembered(memory);
    let equal = (gravity(MEMORY), bending(MEMORY));
    let slow = Gravitropism { sensitivity: 0.8, perception: Statoliths { avalanche_time: 120.0 } }.remembered(MEMORY);
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

/// Gravitropism that misses the vertical by an angle about d3, rad: it has a sense of turning.
#[derive(Clone, Copy)]
struct Screwed(f64);

impl Response for Screwed {
    type Perception = SettledStatoliths;
    fn perception(&self) -> &SettledStatoliths {
        &SettledStatoliths
    }
    fn gradient(&self, at: &Growing, [h1, h2]: [f64; 2]) -> Vector3<f64> {
        let (sin, cos) = self.0.sin_cos();
        Vector3::new(-h2 * cos - h1 * sin, h1 * cos - h2 * sin, 0.0) * (0.8 / at.section.radius())
    }
}

#[test]
fn a_root_that_turns_tells_its_sense() {
    for angle in [0.1, -0.1] {
        let laws = (Screwed(angle).remembered(MEMORY), Proprioception { sensitivity: 20.0 }.remembered(MEMORY));
        let mut shoot = shoot(0.067, 0.0, 4, laws);
        let _ = StationarySolver::default().solve(&mut shoot).unwrap();
        let root = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
        let Polarisation::Turning(sense) = root.polarisation else { panic!("{:?}", root.polarisation) };
        assert!(root.growth_rate() > 0.0 && root.multiplicity == 1);
        // In time: after a kick to one side the growing mode is left, and the tip goes round in its sense and period.
        shoot.set_intrinsic(|point| point.intrinsic + Vector3::y() * 1e-4);
        let mut integrator = MethodOfSteps::new(120.0);
        let _ = integrator.start(&mut shoot, &SteadyHistory).unwrap();
        let _ = integrator.advance(&mut shoot, 30.0 * HOUR).unwrap();
        let (before, start) = (shoot.tip(), shoot.time());
        let _ = integrator.advance(&mut shoot, start + 0.125 * root.period()).unwrap();
        let turned = before.cross(&shoot.tip()).z / (before.xy().norm() * shoot.tip().xy().norm());
        // By an eighth of a turn, sin 45°; the other sense has died down to a percent.
        assert!((turned.abs() - 0.5_f64.sqrt()).abs() < 0.05, "{turned}");
        let counterclockwise = sense == Handedness::Counterclockwise;
        assert_eq!(turned > 0.0, counterclockwise, "{angle}: {turned} for {sense:?}");
    }
}

#[test]
fn an_upright_shoot_swings_in_any_plane_and_a_righted_one_in_its_own_or_across() {
    let laws = || {
        (
            Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY),
            Proprioception { sensitivity: 20.0 }.remembered(MEMORY),
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
                    Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY),
                    Proprioception { sensitivity: 20.0 }.remembered(MEMORY),
                ))
                .load(Weight { density })
                .scene(Still::tilted(FRAC_PI_2))
                .into_dyn()
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
    /// a and b.
    fn gains(&self, z: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
        let filter = (-z * self.memory.delay).exp() / (z * self.growth_time * (z * self.memory.time + 1.0));
        (filter * (self.beta / 5e-4), filter * self.eta)
    }

    /// κ of the short waves exp(−κs), 1/m.
    fn wave(&self, z: Complex<f64>) -> Complex<f64> {
        let (a, b) = self.gains(z);
        a / (b + 1.0)
    }

    fn value(&self, z: Complex<f64>) -> Complex<f64> {
        let radius: f64 = 5e-4;
        let bending = YOUNG.stiffness(radius).x;
        let weight = 1000.0 * 9.81 * std::f64::consts::PI * radius * radius;
        let (a, b) = self.gains(z);
        // Short waves go as exp(−κs), κ = a/(1 + b): a fifth of that in a step at most.
        let waves = self.wave(z).norm() * self.length;
        let steps = 60 + (5.0 * waves.min(1e4)) as u32;
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
        // At least 256 steps on a side, none of which turns by more than 0.2; nor the short waves, which turn fast next to
        // the essential spectrum. Without proprioception it is at zero, and they have no amplitude there.
        let waves = (self.wave(b.0) - self.wave(a.0)).norm() * self.length;
        let short = self.eta == 0.0 || waves < 0.5;
        if depth >= 8 && (change.abs() < 0.2 && short || depth > 40) {
            return change;
        }
        let middle = (a.0 + b.0) / 2.0;
        let middle = (middle, self.value(middle));
        self.turn(a, middle, depth + 1) + self.turn(middle, b, depth + 1)
    }

    /// All cells of a grid over the unstable half plane that hold roots, with their number.
    fn search(&self) -> (f64, usize) {
        let unit = 1.0 / self.memory.delay;
        let mut sum = 0.0;
        let mut largest = 0.0_f64;
        for re in [6e-6, 0.6, 6.0].windows(2) {
            // Answers k turns too late swing k times in a delay: |Im λ| = 2πk/τr. The real axis is in the middle of the
            // first cell, so that no root lies on an edge.
            for im in [-6e-3, 1.5, 3.0, 4.5, 6.0, 12.0, 24.0, 48.0, 96.0].windows(2) {
                let count = self.count(Complex::new(re[0], im[0]) * unit, Complex::new(re[1], im[1]) * unit);
                largest = largest.max((count - count.round()).abs());
                sum += count.round();
            }
        }
        (largest, sum as usize)
    }
}

/// The number of unstable roots on the first mesh that resolves the waves that matter and on the next one, and the
/// rightmost point of the essential spectrum.
fn unstable(problem: &Continuous) -> (Vec<Unstable>, f64) {
    let mut counts = Vec::new();
    let mut essential = f64::NEG_INFINITY;
    for elements in [3, 4, 6, 8, 12, 16, 24, 36, 48, 64] {
        let memory = problem.memory;
        let laws = (
            Gravitropism { sensitivity: problem.beta, perception: SettledStatoliths }.remembered(memory),
            (problem.eta > 0.0).then_some(Proprioception { sensitivity: problem.eta }.remembered(memory)),
        );
        let shoot = Shoot::builder(YOUNG)
            .length(problem.length)
            .radius(5e-4)
            .elements(elements)
            .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: problem.growth_time }))
            .tropism(laws)
            .load(Weight { density: 1000.0 })
            .into_dyn()
            .build()
            .unwrap();
        let linear = Linearisation::about(&shoot).unwrap();
        essential = linear.essential_spectrum().unwrap().first().map_or(f64::NEG_INFINITY, |z| z.re);
        match linear.unstable() {
            Ok(number) => counts.push(number),
            Err(StabilityError::UnderResolved { .. }) => {}
            Err(error) => panic!("{elements} elements: {error}"),
        }
        if counts.len() == 2 {
            break;
        }
    }
    (counts, essential)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn the_number_of_unstable_roots_is_that_of_a_search_of_the_half_plane(
        beta in 0.3..1.5_f64,
        eta in 5.0..40.0_f64,
        minutes in 6.0..18.0_f64,
        ratio in 0.5..2.0_f64,
        hours in 3.6..40.0_f64,
        length in 0.02..0.078_f64,
    ) {
        let memory = Memory { time: 60.0 * minutes * ratio, delay: 60.0 * minutes };
        let problem = Continuous { beta, eta, memory, growth_time: hours * HOUR, length };
        let (counts, essential) = unstable(&problem);
        // Left of the axis. Closer than a fiftieth of the memory's rate the waves are too short for 64 elements.
        prop_assume!(essential < -0.02 / memory.time);
        let (rounding, found) = problem.search();
        prop_assert!(rounding < 1e-6);
        // Every root has its conjugate, and every plane its own.
        prop_assert_eq!(counts, vec![Unstable::Finite(4 * found); 2]);
    }
}

#[test]
fn roots_next_to_the_essential_spectrum_and_without_proprioception_are_counted() {
    let greenhill = 0.079_328_85;
    // Growth time (h), length over Greenhill's, η, and the number in the first quadrant, which a walk along the axis
    // finds with the continuous problem.
    let cases = [
        (4.2, 0.98, 20.0, 8),
        (4.2, 0.2, 20.0, 0),
        (4.4, 0.9, 20.0, 5),
        (10.0, 0.999, 20.0, 4),
        (7.0, 0.9, 0.0, 2),
        (20.0, 0.99, 0.0, 1),
        (1.0, 0.2, 0.0, 0),
    ];
    for (hours, ratio, eta, number) in cases {
        let growth_time = hours * HOUR;
        let problem = Continuous { beta: 0.8, eta, memory: MEMORY, growth_time, length: ratio * greenhill };
        assert_eq!(problem.search().1, number, "{hours} h, {ratio}");
        assert_eq!(unstable(&problem).0, vec![Unstable::Finite(4 * number); 2], "{hours} h, {ratio}");
    }
}

#[test]
fn every_root_that_is_counted_is_found_and_a_coarse_mesh_is_told() {
    // The short waves of fast gravitropism alone: four elements have roots of their own right of the axis, and the shoot
    // has none.
    let gravity = || Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(MEMORY);
    let fast = |length: f64, hours: f64, elements: usize| {
        let shoot = Shoot::builder(YOUNG)
            .length(length)
            .radius(5e-4)
            .elements(elements)
            .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: hours * HOUR }))
            .tropism(gravity())
            .load(Weight { density: 1000.0 })
            .into_dyn()
            .build()
            .unwrap();
        Linearisation::about(&shoot).unwrap()
    };
    let line = 1e-5 / MEMORY.time;
    assert!(fast(0.0159, 2.0, 3).roots(line).unwrap().is_empty());
    let roots = fast(0.0714, 7.0, 16).roots(line).unwrap();
    assert_eq!(roots.iter().map(|root| root.multiplicity).sum::<usize>(), 4);
    // Residuals are relative to |M| |v|: rounding.
    assert!(roots.iter().all(|root| root.residual < 1e-13 && root.growth_rate() > 0.0));
    let coarse = fast(0.0714, 2.0, 4).unstable();
    assert!(matches!(coarse, Err(StabilityError::UnderResolved { share }) if share > 0.5), "{coarse:?}");
}
