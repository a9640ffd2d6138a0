//! Differential growth at one place of the zone, and the stochastic drive.

use std::f64::consts::PI;

use crate::fixtures::shoots::{HOUR, RADIUS, YOUNG, growing, reduced};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::checkpoint::{from_bytes, to_bytes};
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{GrowthLaw, Ongoing, UniformGrowth};
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, StabilityError};
use morphorod::tropism::{Handedness, Localised, Oscillator, RandomDrive, TropismLaw};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

/// Radius (m), length of the growth zone (m) and length of the part with differential growth (m) of
/// the hook of *Averrhoa carambola*; rates of growth and of differential growth (1/s), period (s).
const HOOK: f64 = 0.26e-3;
const ZONE: f64 = 20.6e-3;
const PART: f64 = 12.2e-3;
const RATE: f64 = 1.4e-2 / HOUR;
const DIFFERENCE: f64 = 4.5e-3 / HOUR;
const PERIOD: f64 = 2.1 * HOUR;

/// Differential growth at the basal edge of the zone that oscillates in a plane.
fn hook() -> Localised<(Oscillator, Oscillator)> {
    let forwards = Oscillator::new(0.5 * DIFFERENCE / RATE, PERIOD);
    let backwards = Oscillator {
        handedness: Handedness::Clockwise,
        ..forwards
    };
    let edge = 2e-3;
    let to = ZONE - 0.5 * edge;
    Localised {
        law: (forwards, backwards),
        from: to - PART,
        to,
        edge,
    }
}

/// Swing from one side to the other (rad) of the apex of a hook with a growth law, in the last of
/// some periods.
fn swing(growth: impl GrowthLaw + Send + Sync + 'static, length: f64, periods: u32) -> f64 {
    let mut shoot = Shoot::builder(YOUNG)
        .length(length)
        .radius(HOOK)
        .elements(40)
        .growth(growth)
        .tropism(hook())
        .scene(Still::weightless())
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::with_solver(PERIOD / 48.0, Unloaded);
    let angle = |shoot: &Shoot<DynLaws>| {
        let tangent = shoot.rod().apex_frame() * Vector3::z();
        assert_abs_diff_eq!(tangent.x, 0.0, epsilon = 1e-12);
        tangent.y.atan2(tangent.z)
    };
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for step in 1..=48 * periods {
        run.advance(&mut shoot, f64::from(step) * PERIOD / 48.0)
            .unwrap();
        if step > 48 * (periods - 1) {
            (low, high) = (low.min(angle(&shoot)), high.max(angle(&shoot)));
        }
    }
    high - low
}

#[test]
fn hook_swings_by_its_closed_form() {
    let expected = 2.0 * PART * DIFFERENCE / (2.0 * PI / PERIOD * HOOK);
    assert_abs_diff_eq!(expected.to_degrees(), 8.1, epsilon = 0.05);
    // The closed form is that of a hook which does not elongate. Its extremes are at steps. The
    // error is that of four Gauss points in each element of 0.5 mm for the window.
    let still = swing(
        Ongoing(UniformGrowth {
            zone_length: ZONE,
            time: 1.0 / RATE,
        }),
        ZONE,
        1,
    );
    assert_relative_eq!(still, expected, epsilon = 0.0, max_relative = 1e-6);
    // Growth stretches curved tissue at the rate ε̇0. This part is a quarter of a period behind the
    // bending. It changes the swing by (ε̇0/ω)² = 2e-5.
    let grown = swing(
        UniformGrowth {
            zone_length: ZONE,
            time: 1.0 / RATE,
        },
        2.0 * ZONE,
        6,
    );
    assert_relative_eq!(grown, expected, epsilon = 0.0, max_relative = 1e-4);
}

#[test]
fn window_of_a_localised_law_has_its_area_and_bounds() {
    let law = hook();
    let (n, h) = (4000, ZONE / 4000.0);
    let area: f64 = (0..n)
        .map(|i| law.window((f64::from(i) + 0.5) * h) * h)
        .sum();
    // The midpoint rule for a function with two continuous derivatives.
    assert_relative_eq!(area, PART, epsilon = 0.0, max_relative = 1e-6);
    assert_eq!(
        [
            law.window(0.0),
            law.window(0.01),
            law.window(0.5 * (law.from + law.to)),
            law.window(1.0)
        ],
        [0.0, 1.0, 1.0, 0.0]
    );
    assert_relative_eq!(
        law.window(law.from),
        0.5,
        epsilon = 0.0,
        max_relative = 1e-12
    );
    let name = |law: Localised<Oscillator>| law.check().unwrap_err().name;
    let good = Localised {
        law: Oscillator::new(0.1, 100.0),
        from: 0.0,
        to: 0.01,
        edge: 1e-3,
    };
    assert_eq!(
        name(Localised { edge: 0.0, ..good }),
        "edge of a localised law"
    );
    assert_eq!(
        name(Localised { to: 0.0, ..good }),
        "distance from the apex at which a law ends"
    );
    assert_eq!(
        name(Localised {
            from: f64::NAN,
            ..good
        }),
        "distance from the apex at which a law begins"
    );
}

/// Correlation time, s.
const TAU: f64 = 600.0;
const DRIVE: RandomDrive = RandomDrive {
    sensitivity: 0.1,
    correlation_time: TAU,
    seed: 7,
};

/// B-spline of degree n about zero, by its recursion.
fn spline(n: i32, x: f64) -> f64 {
    if n == 0 {
        return if (-0.5..0.5).contains(&x) { 1.0 } else { 0.0 };
    }
    let half = 0.5 * f64::from(n + 1);
    ((half + x) * spline(n - 1, x + 0.5) + (half - x) * spline(n - 1, x - 0.5)) / f64::from(n)
}

/// Covariance at a distance in time (in τ) of a cubic spline whose coefficients, τ/8 apart, are an
/// Ornstein–Uhlenbeck process: averaged over the knots, it is the B-spline of degree seven with the
/// covariances exp(−|k|/8).
fn covariance(s: f64) -> f64 {
    (-40..=40_i32)
        .map(|k| spline(7, 8.0 * s - f64::from(k)) * (-f64::from(k.abs()) / 8.0).exp())
        .sum()
}

#[test]
fn drive_has_the_variance_and_the_correlation_of_its_process() {
    // The two numbers of the documentation.
    assert_abs_diff_eq!(covariance(0.0), 0.934, epsilon = 5e-4);
    assert_abs_diff_eq!(covariance(2.0) * f64::exp(2.0), 1.005, epsilon = 5e-4);
    let n = 200_000;
    // A quarter of the correlation time, and a part of the distance of knots that visits all places
    // in it.
    let every = TAU * 0.260_3;
    let values: Vec<[f64; 2]> = (0..n)
        .map(|i| DRIVE.value((f64::from(i) - 1e5) * every))
        .collect();
    for component in [0, 1] {
        let mean = values.iter().map(|x| x[component]).sum::<f64>() / f64::from(n);
        // The standard error of the mean is √(2τ/T) = 0.0062 over T = 52,000 τ, that of a
        // covariance at most √(2τ/T) times the square root of two. Four of them.
        assert_abs_diff_eq!(mean, 0.0, epsilon = 4.0 * 0.0062);
        for lag in [0, 1, 2, 4, 8, 20] {
            let pairs = values
                .iter()
                .zip(&values[lag..])
                .map(|(a, b)| a[component] * b[component]);
            let found = pairs.sum::<f64>() / f64::from(n - lag as i32);
            let expected = covariance(lag as f64 * 0.260_3);
            assert_abs_diff_eq!(found, expected, epsilon = 4.0 * 0.0088);
        }
        // A normal distribution has the fourth moment three.
        let fourth = values.iter().map(|x| x[component].powi(4)).sum::<f64>() / f64::from(n);
        assert_abs_diff_eq!(fourth / covariance(0.0).powi(2), 3.0, epsilon = 0.2);
    }
    let cross = values.iter().map(|x| x[0] * x[1]).sum::<f64>() / f64::from(n);
    assert_abs_diff_eq!(cross, 0.0, epsilon = 4.0 * 0.0062);
    let other = RandomDrive { seed: 8, ..DRIVE };
    let cross = (0..n)
        .map(|i| other.value((f64::from(i) - 1e5) * every)[0] * values[i as usize][0])
        .sum::<f64>();
    assert_abs_diff_eq!(cross / f64::from(n), 0.0, epsilon = 4.0 * 0.0062);
}

#[test]
fn drive_is_continuous_with_two_derivatives() {
    let h = 1e-3 * TAU;
    let third = |t: f64| {
        let [a, b, c, d] = [-1.5, -0.5, 0.5, 1.5].map(|k| DRIVE.value(t + k * h)[0]);
        (d - 3.0 * c + 3.0 * b - a).abs()
    };
    // Third differences of a cubic spline with knots τ/8 apart are at most h³ (8/τ)³ times twice
    // the sum of three differences of coefficients, which are below six. A kink in the second
    // derivative would give 1e-4.
    let largest = (0..20_000)
        .map(|i| third(f64::from(i) * 0.37 * h))
        .fold(0.0, f64::max);
    assert!(largest < 8e-3_f64.powi(3) * 2.0 * 8.0 * 6.0, "{largest:e}");
}

/// Shoot without weight whose response is the integral of the drive alone.
fn driven() -> Shoot<DynLaws> {
    reduced(0.03, 20.0 * HOUR)
        .elements(1)
        .tropism(DRIVE)
        .load(())
        .scene(Still::weightless())
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn drive_bends_the_shoot_by_its_integral() {
    let mut shoot = driven();
    MethodOfSteps::with_solver(0.04 * TAU, Unloaded)
        .advance(&mut shoot, 10.0 * TAU)
        .unwrap();
    // Simpson's rule with 400 intervals between knots.
    let n = 32_000;
    let h = 10.0 * TAU / f64::from(n);
    let mut sum = [0.0; 2];
    for i in 0..=n {
        let weight = if i == 0 || i == n {
            1.0
        } else {
            2.0 + 2.0 * f64::from(i % 2)
        };
        let x = DRIVE.value(f64::from(i) * h);
        sum = [0, 1].map(|k| sum[k] + weight * x[k] * h / 3.0);
    }
    let intrinsic = shoot.rod().points()[0].intrinsic * (RADIUS * 20.0 * HOUR / 0.1);
    // Steps of a third of a distance of knots have three Gauss points each, and contain kinks of
    // the third derivative, (0.3)⁴/720 of the third differences in each of 80 knots.
    for (found, expected) in intrinsic.iter().zip(sum) {
        assert_abs_diff_eq!(found / TAU, expected / TAU, epsilon = 1e-4);
    }
    // The variance of the strain would be a statement of chance; its drive is refused where it has
    // no meaning.
    let refused = MethodOfSteps::with_solver(0.13 * TAU, Unloaded).advance(&mut driven(), TAU);
    assert!(refused.is_err(), "steps longer than the distance of knots");
    assert!(matches!(
        Linearisation::about(&driven()),
        Err(StabilityError::NotAutonomous { .. })
    ));
    assert!(
        RandomDrive {
            correlation_time: 0.0,
            ..DRIVE
        }
        .check()
        .is_err()
    );
}

/// Final state of a run that stops after `stop` steps and continues in a new shoot from the bytes
/// of its state.
fn bytes(run: &(impl Integrator + Clone), stop: usize, seed: u64) -> Vec<u8> {
    let make = || {
        let law = (
            growing().build().unwrap().model().tropism,
            RandomDrive { seed, ..DRIVE },
        );
        growing()
            .elements(4)
            .tropism(law)
            .into_dyn()
            .build()
            .unwrap()
    };
    let (mut shoot, mut first, end) = (make(), run.clone(), HOUR);
    for _ in 0..stop {
        if shoot.time() < end {
            let _ = first.step(&mut shoot, end).unwrap();
        }
    }
    let saved = to_bytes(shoot.state()).unwrap();
    let (mut shoot, mut second) = (make(), run.clone());
    shoot.restore(&from_bytes(&saved).unwrap()).unwrap();
    while shoot.time() < end {
        let _ = second.step(&mut shoot, end).unwrap();
    }
    to_bytes(shoot.state()).unwrap()
}

#[test]
fn runs_with_one_seed_have_the_same_bytes_also_after_they_are_resumed() {
    let steps = MethodOfSteps::new(60.0);
    let whole = bytes(&steps, 0, 7);
    assert!(whole == bytes(&steps, 0, 7));
    assert!(whole != bytes(&steps, 0, 8), "another seed");
    for stop in [1, 17, 40] {
        assert!(
            whole == bytes(&steps, stop, 7),
            "resumed after {stop} steps"
        );
    }
    let adaptive = Adaptive::new(1e-4);
    assert!(bytes(&adaptive, 0, 7) == bytes(&adaptive, 5, 7));
}
