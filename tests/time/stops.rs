//! Runs step by step, runs that stop at a condition, and runs that are seen at given times.

use crate::fixtures::shoots::{HOUR, RADIUS, STATOLITHS, WEIGHT, YOUNG, growing, reduced, righting, steering};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{IntegrationError, Integrator, Iterated, MethodOfSteps, Statistics};
use morphorod::{Model, Shoot, Still, Turned};
use nalgebra::Vector3;

/// A shoot that grows, steers and is turned for a while, so that its run has everything in it.
fn eventful() -> Shoot<impl Model + Clone> {
    Shoot::builder(YOUNG)
        .length(0.05)
        .radius(RADIUS)
        .growth(UniformGrowth { zone_length: 0.04, time: 20.0 * HOUR })
        .tropism(steering(STATOLITHS))
        .load(WEIGHT)
        .scene(Turned::tilted(0.7, 1.1 * HOUR, 2.3 * HOUR))
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn step_by_step_is_the_same_run() {
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
    // At its end there is no step left.
    assert_eq!(integrator.step(&mut single, end).unwrap().steps, 0);
    let mut repeated = Iterated::new(130.0);
    assert_eq!(repeated.step(&mut eventful(), end).unwrap().steps, 1);
}

#[test]
fn a_length_is_met_when_the_law_of_growth_says_so() {
    for (target, step) in [(0.055, 700.0), (0.06, 130.0), (0.0501, 700.0), (0.05 + 1e-9, 700.0)] {
        let mut shoot = eventful();
        let condition = |shoot: &Shoot<_>| shoot.rod().length() - target;
        let statistics = MethodOfSteps::new(step).advance_until(&mut shoot, 100.0 * HOUR, condition).unwrap();
        // The tip moves away by ℓg/τg, and one unit of rounding of the length passes in 5e-10 s.
        let expected = (target - 0.05) / (0.04 / (20.0 * HOUR));
        assert!((shoot.time() - expected).abs() < 1e-6, "{} for {expected}", shoot.time());
        assert!(shoot.rod().length() >= target);
        assert!(statistics.steps < shoot.time() as usize / step as usize + 60);
    }
}

#[test]
fn the_time_of_an_angle_has_the_order_of_the_integrator() {
    // When the tip of a shoot that was laid on its side looks up by 60°.
    let time = |step: f64| {
        let mut shoot = righting().into_dyn().build().unwrap();
        let up = |shoot: &Shoot<_>| (shoot.rod().apex_frame() * Vector3::z()).z - 60.0_f64.to_radians().sin();
        let _ = MethodOfSteps::new(step).advance_until(&mut shoot, 24.0 * HOUR, up).unwrap();
        // The time is known to 1e-10 of the step, and the tip turns by less than 1e-3 rad in a second.
        assert!(up(&shoot) >= 0.0 && up(&shoot) < 3e-11);
        shoot.time()
    };
    let finest = time(15.0);
    let errors = [240.0, 120.0, 60.0].map(|step| (time(step) - finest).abs());
    // A second of 1.4 hours at four minutes, and fourth order from there.
    assert!(errors[0] < 1.0, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 3.5, "{errors:?}");
    }
}

#[test]
fn a_stationary_shoot_is_recognised() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(180.0);
    assert_eq!(shoot.steering_rate(), 0.0);
    let _ = integrator.advance(&mut shoot, 2.0 * HOUR).unwrap();
    // Against the change of the intrinsic strain over the next seconds, weighted by length.
    let (rate, strains) = (shoot.steering_rate(), shoot.rod().points().to_vec());
    let mut later = shoot.clone();
    let _ = integrator.advance(&mut later, shoot.time() + 1.0).unwrap();
    let weights = morphorod::quadrature::gauss(4).1;
    let changed = later.rod().points().iter().zip(&strains).zip(weights.iter().cycle());
    let expected: f64 =
        changed.map(|((now, then), w)| (now.intrinsic - then.intrinsic).norm() * w * then.jacobian).sum();
    // The rate itself changes in twenty minutes.
    assert!((rate / expected - 1.0).abs() < 2e-3 && rate > 1e-6, "{rate} for {expected}");
    let still = |shoot: &Shoot<_>| 1e-9 - shoot.steering_rate();
    let _ = integrator.advance_until(&mut shoot, 100.0 * HOUR, still).unwrap();
    assert!(shoot.time() > 5.0 * HOUR && (shoot.steering_rate() - 1e-9).abs() < 1e-17, "{}", shoot.time());
}

#[test]
fn what_never_holds_is_told_with_the_time_and_value_reached() {
    let mut shoot = eventful();
    let mut integrator = MethodOfSteps::new(300.0);
    let _ = integrator.advance(&mut shoot, 0.5 * HOUR).unwrap();
    let before = shoot.state().clone();
    let error = integrator.advance_until(&mut shoot, HOUR, |shoot| shoot.rod().length() - 1.0).unwrap_err();
    let IntegrationError::NotReached { time, value } = error else { panic!("{error}") };
    assert!(time == HOUR && (value + 0.948).abs() < 1e-3, "{error}");
    assert!(error.to_string().contains("by 3600 s") && !error.is_recoverable());
    assert_eq!(shoot.state(), &before);
    // One that is not a number at some time.
    let bad = |shoot: &Shoot<_>| if shoot.time() > 2400.0 { f64::NAN } else { -1.0 };
    let error = integrator.advance_until(&mut shoot, HOUR, bad).unwrap_err();
    assert!(matches!(error, IntegrationError::NotFinite { what: "condition", .. }), "{error}");
    assert_eq!(shoot.state(), &before);
    // One that holds: no step.
    let statistics = integrator.advance_until(&mut shoot, HOUR, |_| 0.0).unwrap();
    assert_eq!((statistics.steps, shoot.state()), (0, &before));
    // The latest time is in the past.
    assert!(integrator.advance_until(&mut shoot, 0.0, |_| -1.0).is_err());
    assert_eq!(shoot.state(), &before);
    // One that jumps, or is infinite before it holds, is found all the same.
    for below in [-1.0, f64::NEG_INFINITY] {
        let mut shoot = shoot.clone();
        let jump = |shoot: &Shoot<_>| if shoot.time() >= 2512.3 { 1.0 } else { below };
        let _ = integrator.advance_until(&mut shoot, HOUR, jump).unwrap();
        assert!(shoot.time() >= 2512.3 && shoot.time() < 2512.3 + 1e-7, "{}", shoot.time());
    }
    // And one that begins to hold where a scene jumps, at the jump.
    let leans = |shoot: &Shoot<_>| (shoot.rod().frames()[0] * Vector3::z()).x - 0.3;
    let _ = integrator.advance_until(&mut shoot, 2.0 * HOUR, leans).unwrap();
    assert!((shoot.time() - 1.1 * HOUR).abs() < 1e-9, "{}", shoot.time());
}

#[test]
fn a_shoot_is_seen_at_any_time_and_its_run_does_not_notice() {
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
        assert_eq!(path.iter().map(|(time, ..)| *time).collect::<Vec<_>>(), times);
        // At every time the shoot is as a run of short steps finds it.
        let (mut fine, mut short) = (eventful(), MethodOfSteps::new(15.0));
        for (time, tip, length) in &path {
            let _ = short.advance(&mut fine, *time).unwrap();
            // The fourth order of the step, and 1e-5 m at four minutes.
            let bound = 1e-5 * (step / 240.0_f64).powi(4) + 1e-10;
            assert!((fine.tip() - tip).norm() < bound, "{time} s: {:e} m", (fine.tip() - tip).norm());
            assert!((fine.rod().length() - length).abs() < 1e-14);
        }
    }
}

#[test]
fn times_that_are_out_of_order_are_refused() {
    let mut shoot = reduced(0.05, 20.0 * HOUR).scene(Still::tilted(0.2)).into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(300.0);
    let _ = integrator.advance(&mut shoot, HOUR).unwrap();
    let before = shoot.state().clone();
    for times in [[1.5, 1.2], [0.5, 1.2], [1.2, 2.5], [1.2, f64::NAN]] {
        let error =
            integrator.advance_showing(&mut shoot, 2.0 * HOUR, times.map(|hours| hours * HOUR), |_| {}).unwrap_err();
        assert!(error.to_string().contains("time at which to show the shoot"), "{error}");
        assert_eq!(shoot.state(), &before);
    }
    let mut calls = 0;
    let _ = integrator.advance_showing(&mut shoot, 2.0 * HOUR, [HOUR, HOUR, 2.0 * HOUR], |_| calls += 1).unwrap();
    assert_eq!((calls, shoot.time()), (3, 2.0 * HOUR));
}

#[test]
fn a_look_costs_one_equilibrium_and_a_stop_a_few() {
    let mut shoot = growing().into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(180.0);
    let _ = integrator.advance(&mut shoot, 2.0 * HOUR).unwrap();
    let plain = integrator.advance(&mut shoot.clone(), 3.0 * HOUR).unwrap();
    let times = (1..=30).map(|i| 2.0 * HOUR + 117.0 * f64::from(i));
    let mut seen = shoot.clone();
    let shown = integrator.advance_showing(&mut seen, 3.0 * HOUR, times, |_| {}).unwrap();
    // One of the times is the end of a step. Looks are no steps.
    assert_eq!(shown.equilibria, plain.equilibria + 29);
    assert_eq!((shown.steps, shown.splits, shown.merges), (plain.steps, plain.splits, plain.merges));
    let target = shoot.rod().length() + 1e-4;
    let stopped = integrator.advance_until(&mut shoot, 3.0 * HOUR, |shoot| shoot.rod().length() - target).unwrap();
    let steps = ((shoot.time() - 2.0 * HOUR) / 180.0).ceil() as usize;
    assert_eq!(stopped.steps, steps);
    assert!(stopped.equilibria < steps + 10, "{} for {steps} steps", stopped.equilibria);
}

#[test]
fn a_stop_just_before_another_time_does_no_harm() {
    // Levels that are all but one are no ground to extrapolate from: what they differ by is rounding.
    let end = |stops: &[f64], iterated: bool| {
        let mut shoot = righting().into_dyn().build().unwrap();
        for until in stops.iter().chain(&[2.0 * HOUR]) {
            let _ = if iterated {
                Iterated::new(180.0).advance(&mut shoot, *until).unwrap()
            } else {
                MethodOfSteps::new(180.0).advance(&mut shoot, *until).unwrap()
            };
        }
        shoot.tip()
    };
    for iterated in [false, true] {
        let plain = end(&[3960.0], iterated);
        for gap in [5e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 0.1] {
            for stops in
                [[3960.0, 3960.0 + gap].as_slice(), &[3960.0, 3960.0 + gap, 3960.0 + 2.0 * gap], &[gap, 3960.0]]
            {
                let apart = (end(stops, iterated) - plain).norm();
                // A step in two unequal parts differs by its own error in time, about 1e-7 m.
                assert!(apart < 5e-7, "{stops:?}: {apart:e} m");
            }
        }
    }
}

#[test]
fn any_condition_that_changes_its_sign_is_found_in_bounded_work() {
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
        let found = steps.advance_until(&mut shoot, HOUR, |shoot| condition(shoot.time())).unwrap();
        // Known to 1e-10 of the step, and flat ones to rounding of their values.
        assert!((shoot.time() - at).abs() < 1e-6, "condition {i}: {}", shoot.time());
        assert!(found.steps == 1 && found.equilibria < 110, "condition {i}: {found:?}");
    }
}
