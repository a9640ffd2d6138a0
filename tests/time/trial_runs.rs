//! Numbers of trial runs and of equilibria of runs with a tolerance.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::shoots::{HOUR, WEIGHT, YOUNG, righting, rod};
use morphorod::Still;
use morphorod::integrator::{Adaptive, ConstantHistory, Integrator};

#[test]
fn equilibrium_is_solved_once_on_a_mesh_and_once_on_its_halves() {
    let shoot = rod(YOUNG, 0.0659)
        .load(WEIGHT)
        .scene(Still::tilted(FRAC_PI_2))
        .build();
    let mut shoot = shoot.unwrap();
    let cost = Adaptive::new(1e-4)
        .start(&mut shoot, &ConstantHistory::Empty)
        .unwrap();
    // Each search from the last shape needs one tangent.
    assert!(cost.equilibria == 2 && cost.factorisations == 2, "{cost:?}");
}

#[test]
fn smooth_shoot_needs_no_run_that_only_confirms_its_elements() {
    let trial_steps = |tolerance: f64| {
        Adaptive::new(tolerance)
            .advance(&mut righting().build().unwrap(), 1.5 * HOUR)
            .unwrap()
            .trial_steps
    };
    // Steps of 675 s, a sixteenth of that after the start and after the delay, take 18 steps, and
    // half of them 26. Over the delay of 720 s after the call they take 2 and 3 steps.
    assert_eq!(trial_steps(1e-3), 18 + 2 + 3);
    assert_eq!(trial_steps(1e-4), 18 + 2 + 26 + 3);
    // Two runs with more elements, because the bound from the first two exceeds a fifth of the
    // tolerance.
    assert_eq!(trial_steps(1e-5), 18 + 2 + 26 + 3 + 2 * (18 + 2));
}

#[test]
fn output_times_and_conditions_in_the_first_step_choose_no_further_resolution() {
    let end = 1.5 * HOUR;
    let shown = |times: &[f64]| {
        let mut shoot = righting().build().unwrap();
        let cost = Adaptive::new(1e-4)
            .advance_showing(&mut shoot, end, times.iter().copied(), |_| ())
            .unwrap();
        (cost.trial_steps, cost.error)
    };
    let (steps, error) = shown(&[end]);
    // Each output time in the first step costs one step to it.
    assert_eq!(shown(&[1.0]), (steps + 1, error));
    assert_eq!(shown(&[1.0, 2.0, 3.0]), (steps + 3, error));
    // The time of the condition is found by three steps.
    let mut shoot = righting().build().unwrap();
    let cost = Adaptive::new(1e-4)
        .advance_until(&mut shoot, end, |shoot| shoot.time() - 1.0)
        .unwrap();
    assert_eq!((cost.trial_steps, cost.error), (steps + 3, error));
}

#[test]
fn error_of_a_run_contains_that_of_its_start() {
    // A shoot without growth and tropism, whose shape does not change after the start.
    let shoot = rod(YOUNG, 0.3).load(WEIGHT).scene(Still::tilted(FRAC_PI_2));
    let mut shoot = shoot.build().unwrap();
    let mut run = Adaptive::new(1e-4);
    let start = run
        .start(&mut shoot, &ConstantHistory::Empty)
        .unwrap()
        .error;
    let whole = run.advance(&mut shoot, HOUR).unwrap().error;
    assert!(start > Some(1e-5) && whole >= start, "{start:?} {whole:?}");
}
