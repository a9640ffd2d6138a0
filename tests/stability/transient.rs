//! Transient growth of disturbances, compared with a closed form and with time integration, and
//! refused requests.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps, SteadyHistory};
use morphorod::load::Weight;
use morphorod::stability::{Linearisation, StabilityError, SteadyStateSolver, Unstable};
use morphorod::tropism::{Gravitropism, Memory, Proprioception, Response, SettledStatoliths};
use morphorod::{DynLaws, Shoot};

const HOUR: f64 = 3600.0;

/// Stationary upright shoot of 6.5 cm with memories and delays of 12 min.
fn upright(stiffness: f64, growth_time: f64, eta: f64, elements: usize) -> Shoot<DynLaws> {
    let memory = Memory { time: 720.0, delay: 720.0 };
    let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: stiffness, poissons_ratio: 0.5 })
        .length(0.065)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
        .tropism((
            Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory),
            Proprioception { sensitivity: eta }.remembered(memory),
        ))
        .load(Weight { density: 1000.0 })
        .into_dyn()
        .build()
        .unwrap();
    let _ = SteadyStateSolver::default().solve(&mut shoot).unwrap();
    shoot
}

/// A shoot without weight and gravitropism has a closed form: every disturbance satisfies τ ü + u̇
/// + b u = 0 with u̇(0) = −b u(0) and b = η/τg.
#[test]
fn transient_growth_without_weight_has_a_closed_form() {
    let (tau, eta, growth_time) = (14400.0, 20.0, 20.0 * HOUR);
    let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(0.05)
        .radius(5e-4)
        .elements(2)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: growth_time }))
        .tropism(Proprioception { sensitivity: eta }.remembered(Memory { time: tau, delay: 0.0 }))
        .into_dyn()
        .build()
        .unwrap();
    let _ = SteadyStateSolver::default().solve(&mut shoot).unwrap();
    let found = Linearisation::about(&shoot).unwrap().transient_growth(10.0 * HOUR).unwrap();
    let (b, decay) = (eta / growth_time, 0.5 / tau);
    let omega = (b / tau - decay * decay).sqrt();
    let sine = (decay - b) / omega;
    let exact = |t: f64| ((-decay * t).exp() * ((omega * t).cos() + sine * (omega * t).sin())).abs();
    let off = |(t, gain): &(f64, f64)| (gain - exact(*t)).abs();
    let worst = found.history.iter().map(off).fold(0.0, f64::max);
    // The estimate is the difference between the sum and the sum of half as many terms. Errors
    // decrease as the square of the number of terms, so that the error is at most a third of the
    // difference. The iteration of the series leaves 1e-6.
    assert!(worst < found.error.max(1e-6) && found.error <= 1e-4, "{worst:e}, estimated {:e}", found.error);
    // The gain is largest where u̇ = 0, after half an oscillation.
    let time = (std::f64::consts::PI - (b / (decay * sine + omega)).atan()) / omega;
    assert_abs_diff_eq!(found.gain, exact(time), epsilon = 1e-4);
    assert!(found.gain > 1.2, "{}", found.gain);
    // Near its maximum the gain changes with the square of the time. An error of 1e-4 of the gain
    // moves the maximum by this time.
    let flat = (2e-4_f64).sqrt() / omega;
    assert_abs_diff_eq!(found.time, time, epsilon = flat);
}

/// Integrates the disturbance with the largest gain in time, and compares the displacement of the
/// tip with the gains.
fn assert_gain_is_reached_in_time(mut shoot: Shoot<DynLaws>, least: f64, most: f64) {
    let linear = Linearisation::about(&shoot).unwrap();
    assert_eq!(linear.unstable().unwrap(), Unstable::Finite(0));
    let duration = 11.0 * HOUR;
    let found = linear.transient_growth(duration).unwrap();
    assert!((least..most).contains(&found.gain), "{}", found.gain);
    assert!(found.error <= 1e-4 * found.gain.max(1.0));
    assert!(found.history.iter().all(|(_, gain)| *gain <= found.gain * (1.0 + 1e-12)));
    // The largest displacement is 1e-4 of the length, so that cubic terms are 1e-8 of it.
    let size = 1e-4 * 0.065 / found.gain;
    let rest = shoot.tip();
    let mut strain = found.strain.iter();
    shoot.set_intrinsic(|point| point.intrinsic + size * strain.next().expect("all tissue grows"));
    let mut run = MethodOfSteps::new(90.0);
    run.solver.tolerance = 1e-13;
    run.start(&mut shoot, &SteadyHistory).unwrap();
    for &(t, gain) in found.history.iter().step_by(8).skip(1) {
        if t > found.time {
            break;
        }
        let _ = run.advance(&mut shoot, t).unwrap();
        let moved = (shoot.tip() - rest).norm() / size;
        // No disturbance exceeds the gain.
        assert!(moved <= gain + 1e-3 * found.gain, "{moved} beside {gain} at {t} s");
    }
    let _ = run.advance(&mut shoot, found.time).unwrap();
    let moved = (shoot.tip() - rest).norm() / size;
    // The tolerance covers the error of the time steps, 2e-4 at this growth rate, and the error of
    // the gain.
    assert_relative_eq!(moved, found.gain, epsilon = 0.0, max_relative = 1e-3);
}

#[test]
fn optimal_disturbance_reaches_the_gain_in_time_integration() {
    assert_gain_is_reached_in_time(upright(1e7, 20.0 * HOUR, 20.0, 4), 1.5, 1.7);
    assert_gain_is_reached_in_time(upright(1e9, 3.0 * HOUR, 2.0, 8), 195.0, 210.0);
}

#[test]
fn gain_agrees_on_two_meshes() {
    let gain = |elements: usize| {
        let found = Linearisation::about(&upright(1e9, 3.0 * HOUR, 2.0, elements)).unwrap();
        found.transient_growth(11.0 * HOUR).unwrap().gain
    };
    assert_relative_eq!(gain(8), gain(12), epsilon = 0.0, max_relative = 1e-3);
}

#[test]
fn gain_of_an_unstable_shoot_grows_at_the_rate_of_its_rightmost_root() {
    let linear = Linearisation::about(&upright(1e7, 17.0 * HOUR, 20.0, 4)).unwrap();
    let rate = linear.rightmost().unwrap().growth_rate();
    assert!(rate > 0.0);
    // Peaks of the gain after the contributions of the other roots have decayed.
    let found = linear.transient_growth(60.0 * HOUR).unwrap();
    let peaks: Vec<(f64, f64)> = found
        .history
        .windows(3)
        .filter(|w| w[1].0 > 30.0 * HOUR && w[1].1 > w[0].1 && w[1].1 >= w[2].1)
        .map(|w| w[1])
        .collect();
    let (first, last) = (peaks[0], peaks[peaks.len() - 1]);
    let measured = (last.1 / first.1).ln() / (last.0 - first.0);
    // The gain is sampled about thirty times a period, which changes a peak by up to one percent.
    assert_abs_diff_eq!(measured, rate, epsilon = 0.05 * rate);
}

#[test]
fn invalid_and_too_long_durations_are_refused() {
    let linear = Linearisation::about(&upright(1e7, 20.0 * HOUR, 20.0, 4)).unwrap();
    for duration in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = linear.transient_growth(duration).unwrap_err();
        assert!(matches!(error, StabilityError::Parameter(_)) && error.to_string().contains("duration"), "{error}");
    }
    // In a very short time the gain stays one.
    let found = linear.transient_growth(1e-3).unwrap();
    assert_abs_diff_eq!(found.gain, 1.0, epsilon = 1e-6);
    // The duration is a thousand years.
    let error = linear.transient_growth(3e10).unwrap_err();
    assert!(matches!(error, StabilityError::TooMuchWork { .. }), "{error}");
}
