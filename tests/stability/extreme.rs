//! Stability at extremes: delays that are long against memories, points that all differ, ranges with many roots at one end. None
//! may take more than the bound on the work, and the answers are those of other methods.

use crate::fixtures::upright;
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{GrowthLaw, LinearProfile, Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, SteadyHistory};
use morphorod::load::Weight;
use morphorod::nalgebra::{Complex, Vector3};
use morphorod::stability::{Linearisation, StabilityError, StationarySolver, Unstable, onset};
use morphorod::tropism::{Gravitropism, Memory, Perception, Proprioception, Response, SettledStatoliths, Statoliths};
use morphorod::{Model, Shoot, Still};
use proptest::prelude::*;

use crate::fixtures::upright::continuous::Upright;

/// A shoot with statoliths and proprioception of equal memories, on a base that leans.
#[derive(Debug, Clone, Copy)]
struct Leaning {
    memory: Memory,
    avalanche_time: f64,
    beta: f64,
    eta: f64,
    /// s.
    growth_time: f64,
    /// Pa.
    stiffness: f64,
    length: f64,
    tilt: f64,
    elements: usize,
}

/// Delay is 35 times the memory.
const LONG: Leaning = Leaning {
    memory: Memory { time: 73.0, delay: 2540.0 },
    avalanche_time: 23.6,
    beta: 0.305,
    eta: 24.3,
    growth_time: 62371.0,
    stiffness: 46.4e6,
    length: 0.0428,
    tilt: 0.9,
    elements: 2,
};

impl Leaning {
    fn shoot(&self) -> Result<Shoot<impl Model>, StabilityError> {
        let growth = UniformGrowth { zone_length: 0.1, time: self.growth_time };
        self.with(growth, Statoliths { avalanche_time: self.avalanche_time })
    }

    /// The same with another growth law and another perception of gravity.
    fn with<P>(&self, growth: impl GrowthLaw, perception: P) -> Result<Shoot<impl Model>, StabilityError>
    where
        P: Perception,
        Gravitropism<P>: Response,
    {
        let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: self.stiffness, poissons_ratio: 0.5 })
            .length(self.length)
            .radius(5e-4)
            .elements(self.elements)
            .growth(Ongoing(growth))
            .tropism((
                Gravitropism { sensitivity: self.beta, perception }.remembered(self.memory),
                Proprioception { sensitivity: self.eta }.remembered(self.memory),
            ))
            .load(Weight { density: 1000.0 })
            .scene(Still::tilted(self.tilt))
            .build()?;
        let _ = StationarySolver::default().solve(&mut shoot)?;
        Ok(shoot)
    }

    /// The rightmost root of τg λ (1 + τm λ) + η exp(−λτr) = 0, by Newton's method from many places.
    fn essential(&self) -> Complex<f64> {
        let Memory { time, delay } = self.memory;
        let unit = time.max(delay).recip();
        let mut best = Complex::from(f64::NEG_INFINITY);
        for k in 0..6000 {
            let mut z = Complex::new(0.3 * f64::from(k % 30) - 7.0, 0.4 * f64::from(k / 30)) * unit;
            let mut step = Complex::from(f64::INFINITY);
            for _ in 0..60 {
                let lag = (-z * delay).exp() * self.eta;
                let f = self.growth_time * z * (z * time + 1.0) + lag;
                step = f / (self.growth_time * (z * (2.0 * time) + 1.0) - lag * delay);
                z -= step;
            }
            if step.norm() < 1e-10 * z.norm() && z.re > best.re {
                best = z;
            }
        }
        Complex::new(best.re, best.im.abs())
    }
}

#[test]
fn delays_that_are_long_against_memories_are_no_obstacle() {
    for delay in [500.0, 1000.0, 2540.0, 7300.0] {
        let leaning = Leaning { memory: Memory { delay, ..LONG.memory }, ..LONG };
        let linear = Linearisation::about(&leaning.shoot().unwrap()).unwrap();
        let found = linear.essential_spectrum().unwrap()[0];
        let expected = leaning.essential();
        // The statoliths of a leaning shoot are no part of proprioception. Differences of the laws leave 1e-9.
        assert!((found - expected).norm() < 1e-7 * expected.norm(), "{delay} s: {found} against {expected}");
        assert_eq!(matches!(linear.unstable(), Ok(Unstable::Infinite { .. })), expected.re > 0.0, "{delay} s");
    }
}

#[test]
fn points_that_all_differ_share_their_guesses() {
    // With a linear profile REGR is 2 (1 − σ/ℓg)/τg at a distance σ from the apex: the local problem is that of uniform growth
    // of this rate, and the fastest point of the mesh, next to the apex, is the rightmost or the leftmost.
    let leaning = Leaning { elements: 5, tilt: 0.0, ..LONG };
    let profile = LinearProfile { zone_length: 0.1, time: leaning.growth_time };
    let shoot = leaning.with(profile, SettledStatoliths).unwrap();
    let found = Linearisation::about(&shoot).unwrap().essential_spectrum().unwrap();
    // Gauss points of order eight in the element at the apex: the last is this share of it from its end.
    let nearest = 0.069_431_844_202_973_71 * leaning.length / 5.0;
    let growth_time = leaning.growth_time / (2.0 * (1.0 - nearest / 0.1));
    let expected = Leaning { growth_time, ..leaning }.essential();
    assert!((found[0] - expected).norm() < 1e-7 * expected.norm(), "{} against {expected}", found[0]);
    assert_eq!(found.len(), 20, "{found:?}");
}

#[test]
fn an_onset_does_not_depend_on_the_far_end_of_its_range() {
    let shoot = Upright {
        beta: 1.910_980_44,
        eta: 3.127_642_50,
        gravity: Memory { time: 1_031.172_52, delay: 1_773.001_01 },
        bending: Memory { time: 384.787_60, delay: 1_340.058_91 },
        growth_time: 24_089.465_18,
    };
    // By the continuous problem.
    let (expected, _) = shoot.crossing(0.026_853, 0.000_399);
    for to in [0.05, 0.0785] {
        let found = onset(|length| shoot.linear(length, 16), 0.012, to).unwrap();
        // Sixteen elements put it off by 4e-9 of itself, see docs/stability.md.
        assert!((found.parameter / expected - 1.0).abs() < 2e-8, "{to}: {found:?} against {expected}");
    }
}

#[test]
fn without_proprioception_nothing_is_sought_left_of_zero() {
    let gravity = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(upright::MEMORY);
    let shoot = Shoot::builder(upright::YOUNG)
        .length(0.05)
        .radius(5e-4)
        .elements(4)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: 72e3 }))
        .tropism(gravity)
        .load(Weight { density: 1000.0 })
        .into_dyn()
        .build()
        .unwrap();
    let linear = Linearisation::about(&shoot).unwrap();
    // What a mesh has there is its own: the continuous problem has infinitely many right of any such line.
    assert!(matches!(linear.roots(-1e-4), Err(StabilityError::Parameter(_))));
    assert_eq!(linear.rightmost().unwrap_err(), StabilityError::NoIsolatedRoot);
    assert!(linear.roots(1e-8).unwrap().is_empty());
}

/// Whether a small disturbance grows between two times, by time integration: the factor by which the largest displacement of
/// the tip over two delays changes.
fn growth_in_time(leaning: &Leaning) -> f64 {
    let mut shoot = leaning.shoot().unwrap();
    let rest = shoot.tip();
    // The cubic terms are 1e-6 of it, even after a growth of a hundredfold.
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::new(5e-5, 1e-4, 0.0));
    let Memory { time, delay } = leaning.memory;
    let slowest = time.max(delay).max(leaning.growth_time / leaning.eta);
    let mut run = MethodOfSteps::new(delay.min(slowest / 20.0));
    run.solver.tolerance = 1e-13;
    run.start(&mut shoot, &SteadyHistory).unwrap();
    let mut largest = |shoot: &mut _, from: f64| {
        let until = (0..40).map(|k| from + 2.0 * slowest * f64::from(k) / 40.0);
        until.fold(0.0, |largest: f64, t| {
            run.advance(shoot, t).unwrap();
            largest.max((Shoot::tip(shoot) - rest).norm())
        })
    };
    let first = largest(&mut shoot, 6.0 * slowest);
    largest(&mut shoot, 12.0 * slowest) / first
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_shoot_has_an_answer_within_the_bound(
        memory_time in 1.0..3.5_f64,
        ratio in -2.0..2.0_f64,
        avalanche in 0.0..2.8_f64,
        beta in -1.3..0.7_f64,
        eta in -0.5..1.8_f64,
        growth in 4.0..5.7_f64,
        stiffness in 6.5..8.0_f64,
        length in 0.1..0.95_f64,
        tilt in 0.0..1.5_f64,
        elements in 2..6_usize,
    ) {
        let time = 10.0_f64.powf(memory_time);
        let youngs_modulus = 10.0_f64.powf(stiffness);
        // Greenhill's, of the stiffness.
        let greenhill = (7.837 * youngs_modulus * 5e-4_f64.powi(2) / 4.0 / (1000.0 * 9.81)).cbrt();
        let leaning = Leaning {
            memory: Memory { time, delay: time * 10.0_f64.powf(ratio) },
            avalanche_time: 10.0_f64.powf(avalanche),
            beta: 10.0_f64.powf(beta),
            eta: 10.0_f64.powf(eta),
            growth_time: 10.0_f64.powf(growth),
            stiffness: youngs_modulus,
            length: length * greenhill,
            tilt,
            elements,
        };
        // A shape of more waves than so few elements hold, or none.
        let Ok(shoot) = leaning.shoot() else { return Err(TestCaseError::reject("not stationary")) };
        let linear = Linearisation::about(&shoot).unwrap();
        let essential = linear.essential_spectrum().unwrap().first().copied();
        let expected = leaning.essential();
        // Two roots that meet on the real axis answer to the 1e-9 of the differences by its square root.
        let near = 1e-4 * expected.norm();
        let left = -0.9 / time.max(leaning.avalanche_time);
        let found = essential.is_some_and(|essential| (essential - expected).norm() < near);
        // Those further left are not sought.
        prop_assert!(found || expected.re < left, "{essential:?} against {expected}");
        let told = |error: &StabilityError| {
            matches!(error, StabilityError::UnderResolved { .. } | StabilityError::NoIsolatedRoot)
        };
        let (count, rightmost) = (linear.unstable(), linear.rightmost());
        prop_assert!(count.as_ref().err().is_none_or(told), "{count:?}");
        prop_assert!(rightmost.as_ref().err().is_none_or(told), "{rightmost:?}");
        if let (Ok(Unstable::Finite(number)), Ok(root)) = (count, rightmost) {
            prop_assert_eq!(number > 0, root.growth_rate() > 0.0);
        }
    }
}

#[test]
fn counts_say_what_disturbances_do() {
    // Delays of a tenth to thirty times the memory; stable ones, and one whose waves all grow.
    let with = |time: f64, delay: f64| Leaning { memory: Memory { time, delay }, ..LONG };
    for (leaning, unstable) in [
        (with(2540.0, 254.0), false),
        (with(500.0, 1500.0), false),
        (with(73.0, 2190.0), false),
        (with(73.0, 7300.0), true),
    ] {
        let found = Linearisation::about(&leaning.shoot().unwrap()).unwrap().unstable().unwrap();
        assert_eq!(found != Unstable::Finite(0), unstable, "{leaning:?}: {found:?}");
        let factor = growth_in_time(&leaning);
        assert_eq!(factor > 1.0, unstable, "{leaning:?}: {factor}");
    }
}
