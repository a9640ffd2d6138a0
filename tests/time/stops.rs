//! Runs step by step, runs that stop at a condition, and runs with output times.

use crate::fixtures::gauss::gauss;
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    HOUR, MEMORY, STATOLITHS, elongating, growing, reduced, remembering, righting, steering,
};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use morphorod::integrator::{IntegrationError, Integrator, MethodOfSteps, Statistics};
use morphorod::tropism::{Memory, SettledStatoliths};
use morphorod::{DynLaws, Shoot, Still, Turned};
use nalgebra::Vector3;

/// Shoot that grows and steers, with tissue that leaves the growth zone and a base that is tilted
/// for a while.
fn eventful() -> Shoot<DynLaws> {
    elongating(0.05, 0.04, 20.0 * HOUR)
        .tropism(steering(STATOLITHS))
        .scene(Turned::tilted(0.7, 1.1 * HOUR, 2.3 * HOUR))
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn single_steps_repeat_the_run_of_one_call() {
    let end = 4.0 * HOUR;
    let (mut whole, mut single) = (eventful(), eventful());
    let expected = MethodOfSteps::new(130.0).advance(&mut whole, end).unwrap();
    let mut integrator = MethodOfSteps::new(130.0);
    let (mut found, mut calls) = (Statistics::default(), 0);
    while single.time() < end {
        let one = integrator.step(&mut single, end).unwrap();
        assert_eq!(one.steps, 1);
        found += one;
        calls += 1;
    }
    assert_eq!((single.state(), calls), (whole.state(), expected.steps));
    assert_eq!(found, expected);
    // A call at the end time takes no step.
    assert_eq!(integrator.step(&mut single, end).unwrap().steps, 0);
}

#[test]
fn stop_at_a_length_occurs_at_the_time_of_the_closed_form() {
    for (target, step) in [
        (0.055, 700.0),
        (0.06, 130.0),
        (0.0501, 700.0),
        (0.05 + 1e-9, 700.0),
    ] {
        let mut shoot = eventful();
        let condition = |shoot: &Shoot<_>| shoot.rod().length() - target;
        let statistics = MethodOfSteps::new(step)
            .advance_until(&mut shoot, 100.0 * HOUR, condition)
            .unwrap();
        // The length increases at ℓg/τg, by one unit in its last place in 1.2e-11 s.
        let expected = (target - 0.05) / (0.04 / (20.0 * HOUR));
        assert_abs_diff_eq!(shoot.time(), expected, epsilon = 1e-6);
        assert!(shoot.rod().length() >= target);
        assert!(statistics.steps < shoot.time() as usize / step as usize + 60);
    }
}

#[test]
fn stop_at_an_angle_has_the_order_of_the_integrator() {
    // Time at which the tip of a righting shoot points upwards at 60° to the horizontal.
    let time = |step: f64| {
        let mut shoot = righting().into_dyn().build().unwrap();
        let up = |shoot: &Shoot<_>| {
            (shoot.rod().apex_frame() * Vector3::z()).z - 60.0_f64.to_radians().sin()
        };
        let _ = MethodOfSteps::new(step)
            .advance_until(&mut shoot, 24.0 * HOUR, up)
            .unwrap();
        // The time is located to 1e-10 of the step, and the tip rotates by less than 1e-3 rad in a
        // second.
        assert!(up(&shoot) >= 0.0 && up(&shoot) < 3e-11);
        shoot.time()
    };
    let finest = time(15.0);
    let errors = [240.0, 120.0, 60.0].map(|step| (time(step) - finest).abs());
    // With steps of four minutes the error of the time, which is 1.4 h, is below one second. It
    // decreases at fourth order.
    assert!(errors[0] < 1.0, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 3.5, "{errors:?}");
    }
}

#[test]
fn steering_rate_is_the_rate_of_intrinsic_strain_and_detects_a_stationary_shoot() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(180.0);
    assert_eq!(shoot.steering_rate(), 0.0);
    let _ = integrator.advance(&mut shoot, 2.0 * HOUR).unwrap();
    // Compare the rate with the change of the intrinsic strain over the next second, weighted by
    // length.
    let (rate, strains) = (shoot.steering_rate(), shoot.rod().points().to_vec());
    let mut later = shoot.clone();
    let _ = integrator.advance(&mut later, shoot.time() + 1.0).unwrap();
    let weights = gauss(4).1;
    let changed = later
        .rod()
        .points()
        .iter()
        .zip(&strains)
        .zip(weights.iter().cycle());
    let expected: f64 = changed
        .map(|((now, then), w)| (now.intrinsic - then.intrinsic).norm() * w * then.jacobian)
        .sum();
    // The rate varies on a time scale of twenty minutes.
    assert!(rate > 1e-6, "{rate}");
    assert_relative_eq!(rate, expected, epsilon = 0.0, max_relative = 2e-3);
    let still = |shoot: &Shoot<_>| 1e-9 - shoot.steering_rate();
    let _ = integrator
        .advance_until(&mut shoot, 100.0 * HOUR, still)
        .unwrap();
    assert!(shoot.time() > 5.0 * HOUR, "{}", shoot.time());
    assert_abs_diff_eq!(shoot.steering_rate(), 1e-9, epsilon = 1e-17);
}

#[test]
fn condition_that_is_not_met_is_an_error_with_the_time_and_value_reached() {
    let mut shoot = eventful();
    let mut integrator = MethodOfSteps::new(300.0);
    let _ = integrator.advance(&mut shoot, 0.5 * HOUR).unwrap();
    let before = shoot.state().clone();
    let error = integrator
        .advance_until(&mut shoot, HOUR, |shoot| shoot.rod().length() - 1.0)
        .unwrap_err();
    let IntegrationError::NotReached { time, value } = error else {
        panic!("{error}")
    };
    assert_eq!(time, HOUR);
    assert_abs_diff_eq!(value, -0.948, epsilon = 1e-3);
    assert!(error.to_string().contains("by 3600 s") && !error.is_recoverable());
    assert_eq!(shoot.state(), &before);
    // A condition that is NaN at some time is an error.
    let bad = |shoot: &Shoot<_>| {
        if shoot.time() > 2400.0 {
            f64::NAN
        } else {
            -1.0
        }
    };
    let error = integrator.advance_until(&mut shoot, HOUR, bad).unwrap_err();
    assert!(
        matches!(
            error,
            IntegrationError::NotFinite {
                what: "condition",
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(shoot.state(), &before);
    // A condition that holds at once takes no step.
    let statistics = integrator.advance_until(&mut shoot, HOUR, |_| 0.0).unwrap();
    assert_eq!((statistics.steps, shoot.state()), (0, &before));
    // A latest time in the past is an error.
    assert!(integrator.advance_until(&mut shoot, 0.0, |_| -1.0).is_err());
    assert_eq!(shoot.state(), &before);
    // The time is located if the condition jumps or is infinite before it holds.
    for below in [-1.0, f64::NEG_INFINITY] {
        let mut shoot = shoot.clone();
        let jump = |shoot: &Shoot<_>| if shoot.time() >= 2512.3 { 1.0 } else { below };
        let _ = integrator.advance_until(&mut shoot, HOUR, jump).unwrap();
        assert!(
            shoot.time() >= 2512.3 && shoot.time() < 2512.3 + 1e-7,
            "{}",
            shoot.time()
        );
    }
    // A condition that is met by a jump of the scene stops at the jump.
    let leans = |shoot: &Shoot<_>| (shoot.rod().frames()[0] * Vector3::z()).x - 0.3;
    let _ = integrator
        .advance_until(&mut shoot, 2.0 * HOUR, leans)
        .unwrap();
    assert_abs_diff_eq!(shoot.time(), 1.1 * HOUR, epsilon = 1e-9);
}

#[test]
fn output_times_leave_the_run_unchanged_and_show_accurate_shapes() {
    let end = 3.0 * HOUR;
    for step in [240.0, 120.0, 60.0] {
        let (mut alone, mut seen) = (eventful(), eventful());
        let _ = MethodOfSteps::new(step).advance(&mut alone, end).unwrap();
        let times: Vec<f64> = (0..=67).map(|i| end * f64::from(i) / 67.0).collect();
        let mut path = Vec::new();
        let mut integrator = MethodOfSteps::new(step);
        let shown = integrator.advance_showing(&mut seen, end, times.iter().copied(), |shoot| {
            path.push((shoot.time(), shoot.tip(), shoot.rod().length()));
        });
        assert!(shown.is_ok());
        assert_eq!(seen.state(), alone.state());
        assert_eq!(
            path.iter().map(|(time, ..)| *time).collect::<Vec<_>>(),
            times
        );
        // At every output time the shape agrees with that of a run with short steps.
        let (mut fine, mut short) = (eventful(), MethodOfSteps::new(15.0));
        for (time, tip, length) in &path {
            let _ = short.advance(&mut fine, *time).unwrap();
            // The bound is of fourth order in the step, and 1e-5 m at four minutes.
            let bound = 1e-5 * (step / 240.0_f64).powi(4) + 1e-10;
            assert!(
                abs_diff_eq!(InNorm(fine.tip()), InNorm(*tip), epsilon = bound),
                "steps of {step} s, at {time} s: {:?} against {tip:?}, bound {bound:e}",
                fine.tip()
            );
            assert_abs_diff_eq!(fine.rod().length(), *length, epsilon = 1e-14);
        }
    }
}

#[test]
fn one_call_shows_output_times_and_stops_at_an_event() {
    let condition = |shoot: &Shoot<DynLaws>| shoot.rod().length() - 0.0505;
    let times = || (0..=60).map(|k| 100.0 * f64::from(k));
    let shoot = elongating(0.05, 0.07, 72e3)
        .scene(Still::tilted(0.2))
        .into_dyn()
        .build()
        .unwrap();
    let (mut stopped, mut shown, mut both) = (shoot.clone(), shoot.clone(), shoot);
    let mut integrator = MethodOfSteps::new(300.0);
    let _ = integrator
        .advance_until(&mut stopped, 2.0 * HOUR, condition)
        .unwrap();
    let mut expected = Vec::new();
    let _ = integrator
        .advance_showing(&mut shown, 2.0 * HOUR, times(), |shoot| {
            expected.push(shoot.tip())
        })
        .unwrap();
    let mut path = Vec::new();
    let record = |shoot: &Shoot<DynLaws>| path.push(shoot.tip());
    let _ = integrator
        .advance_showing_until(&mut both, 2.0 * HOUR, times(), record, condition)
        .unwrap();
    assert_eq!(both.state(), stopped.state());
    // The event is at 72e3 s ln(1.01) = 716 s, in the third step.
    let (before, last) = path.split_at(7);
    assert_eq!(before, &expected[..7]);
    // The last output is in the step that the event shortens, which has an error of fourth order.
    assert_eq!(last.len(), 1);
    assert_abs_diff_eq!(InNorm(last[0]), InNorm(expected[7]), epsilon = 1e-8);
}

#[test]
fn output_times_out_of_order_are_refused() {
    let mut shoot = reduced(0.05, 20.0 * HOUR)
        .scene(Still::tilted(0.2))
        .into_dyn()
        .build()
        .unwrap();
    let mut integrator = MethodOfSteps::new(300.0);
    let _ = integrator.advance(&mut shoot, HOUR).unwrap();
    let before = shoot.state().clone();
    for times in [[1.5, 1.2], [0.5, 1.2], [1.2, 2.5], [1.2, f64::NAN]] {
        let error = integrator
            .advance_showing(
                &mut shoot,
                2.0 * HOUR,
                times.map(|hours| hours * HOUR),
                |_| {},
            )
            .unwrap_err();
        assert!(error.to_string().contains("output time"), "{error}");
        assert_eq!(shoot.state(), &before);
    }
    let mut calls = 0;
    let _ = integrator
        .advance_showing(&mut shoot, 2.0 * HOUR, [HOUR, HOUR, 2.0 * HOUR], |_| {
            calls += 1
        })
        .unwrap();
    assert_eq!((calls, shoot.time()), (3, 2.0 * HOUR));
}

#[test]
fn output_time_costs_one_equilibrium_and_a_stop_a_few() {
    let mut shoot = growing().into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(180.0);
    let _ = integrator.advance(&mut shoot, 2.0 * HOUR).unwrap();
    let plain = integrator.advance(&mut shoot.clone(), 3.0 * HOUR).unwrap();
    let times = (1..=30).map(|i| 2.0 * HOUR + 117.0 * f64::from(i));
    let mut seen = shoot.clone();
    let shown = integrator
        .advance_showing(&mut seen, 3.0 * HOUR, times, |_| {})
        .unwrap();
    // One of the output times is the end of a step. Output times do not count as steps.
    assert_eq!(shown.equilibria, plain.equilibria + 29);
    assert_eq!(
        (shown.steps, shown.splits, shown.merges),
        (plain.steps, plain.splits, plain.merges)
    );
    let target = shoot.rod().length() + 1e-4;
    let stopped = integrator
        .advance_until(&mut shoot, 3.0 * HOUR, |shoot| {
            shoot.rod().length() - target
        })
        .unwrap();
    let steps = ((shoot.time() - 2.0 * HOUR) / 180.0).ceil() as usize;
    assert_eq!(stopped.steps, steps);
    assert!(
        stopped.equilibria < steps + 10,
        "{} for {steps} steps",
        stopped.equilibria
    );
}

#[test]
fn stops_at_almost_equal_times_keep_the_accuracy() {
    // Extrapolation from levels at almost equal times would magnify their rounding errors.
    let end = |stops: &[f64], delay: f64| {
        let laws = remembering(Memory { delay, ..MEMORY }, MEMORY).steering(SettledStatoliths);
        let mut shoot = righting().tropism(laws).into_dyn().build().unwrap();
        for until in stops.iter().chain(&[2.0 * HOUR]) {
            let _ = MethodOfSteps::new(180.0)
                .advance(&mut shoot, *until)
                .unwrap();
        }
        shoot.tip()
    };
    // Steps are explicit with the first delay, and implicit without a delay.
    for delay in [MEMORY.delay, 0.0] {
        let plain = end(&[3960.0], delay);
        for gap in [5e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 0.1] {
            for stops in [
                [3960.0, 3960.0 + gap].as_slice(),
                &[3960.0, 3960.0 + gap, 3960.0 + 2.0 * gap],
                &[gap, 3960.0],
            ] {
                let tip = end(stops, delay);
                // Division of a step into two unequal parts changes the tip by the error of a step,
                // about 1e-7 m.
                assert!(
                    abs_diff_eq!(InNorm(tip), InNorm(plain), epsilon = 5e-7),
                    "delay {delay}, {stops:?}: {tip:?} against {plain:?}"
                );
            }
        }
    }
}

#[test]
fn any_change_of_sign_of_a_condition_is_located_in_bounded_work() {
    let at = 2512.3;
    let conditions: [&dyn Fn(f64) -> f64; 14] = [
        &|t| (t - at).min(0.0),
        &|t| (t - at).min(1e-15),
        &|t| (t - at).max(-1e-15),
        &|t| if t >= at { 0.0 } else { -1.0 },
        &|t| if t >= at { f64::INFINITY } else { -1.0 },
        &|t| if t >= at { 1e30 } else { -1.0 },
        &|t| if t >= at { 1.0 } else { -1e30 },
        &|t| if t >= at { 1e12 } else { -1.0 },
        &|t| if t >= at { 1.0 } else { f64::NEG_INFINITY },
        &|t| 1.0 - (at - t).exp(),
        &|t| (10.0 * (t - at)).exp() - 1.0,
        &|t| (t - at).powi(9),
        &|t| (t - at).cbrt(),
        &|t| t - at,
    ];
    for (i, condition) in conditions.iter().enumerate() {
        let mut shoot = eventful();
        let mut steps = MethodOfSteps::new(180.0);
        let _ = steps.advance(&mut shoot, 2340.0).unwrap();
        let found = steps
            .advance_until(&mut shoot, HOUR, |shoot| condition(shoot.time()))
            .unwrap();
        // The time is located to 1e-10 of the step, or for flat conditions to the rounding of their
        // values.
        assert!(
            abs_diff_eq!(shoot.time(), at, epsilon = 1e-6),
            "condition {i}: {} against {at}",
            shoot.time()
        );
        assert!(
            found.steps == 1 && found.equilibria < 110,
            "condition {i}: {found:?}"
        );
    }
}
