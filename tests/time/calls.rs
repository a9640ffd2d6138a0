//! Tolerance in several calls, limits of work, and numbers of steps with short delays.

use crate::fixtures::shoots::{ETA, HOUR, WEIGHT, reduced, righting};
use morphorod::integrator::{Adaptive, IntegrationError, Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::tropism::{Memory, Oscillator, Proprioception, Response};
use morphorod::{Model, Shoot, Still};

/// Shoot with an oscillator whose bending acts a delay later, through a memory.
fn echo(period: f64, time: f64, delay: f64) -> Shoot<impl Model> {
    let response = Proprioception { sensitivity: ETA }.remembered(Memory { time, delay });
    let laws = (Oscillator::new(0.1, period), response);
    reduced(0.05, 10.0 * HOUR)
        .tropism(laws)
        .load(WEIGHT)
        .scene(Still::tilted(0.3))
        .build()
        .unwrap()
}

fn distance(a: &Rod, b: &Rod) -> f64 {
    a.centre_line_at(41)
        .iter()
        .zip(b.centre_line_at(41))
        .map(|(a, b)| (a - b).norm() / 0.05)
        .fold(0.0, f64::max)
}

#[test]
fn memories_that_a_call_leaves_keep_the_tolerance_in_the_next_one() {
    for (period, time, delay, stop, end) in [
        (5600.0, 125.0, 5200.0, 3000.0, 7800.0),
        (1440.0, 720.0, 1800.0, 1700.0, 3400.0),
    ] {
        let mut reference = echo(period, time, delay);
        let mut steps = MethodOfSteps::new(5.0);
        (steps.tolerance, steps.solver.tolerance) = (1e-12, 1e-12);
        steps.advance(&mut reference, end).unwrap();
        for tolerance in [1e-4, 1e-6, 1e-7] {
            let mut shoot = echo(period, time, delay);
            let mut integrator = Adaptive::new(tolerance);
            integrator.advance(&mut shoot, stop).unwrap();
            let estimate = integrator.advance(&mut shoot, end).unwrap().error.unwrap();
            let error = distance(shoot.rod(), reference.rod());
            // The error of the reference is 4e-10. A comparison within each call gave 85 times the
            // tolerance and 216 times the estimate.
            assert!(
                error <= tolerance && error <= estimate,
                "{tolerance:.0e}: {error:.1e}, estimate {estimate:.1e}"
            );
        }
    }
}

#[test]
fn calls_within_the_delay_of_the_first_one_need_no_trial_runs() {
    let mut shoot = righting().build().unwrap();
    let mut integrator = Adaptive::new(1e-5);
    assert!(integrator.advance(&mut shoot, 300.0).unwrap().trial_steps > 0);
    // The delays are 720 s.
    for time in [500.0, 1000.0] {
        assert_eq!(integrator.advance(&mut shoot, time).unwrap().trial_steps, 0);
    }
}

#[test]
fn breaking_points_of_breaking_points_cost_no_steps() {
    // A memory of 3 s that acts after a long delay is faster than any step. A short delay of a slow
    // memory must not make a chain of discontinuities from it.
    let slow = Proprioception { sensitivity: ETA }.remembered(Memory {
        time: 1000.0,
        delay: 2.5,
    });
    let fast = Proprioception { sensitivity: 0.1 }.remembered(Memory {
        time: 3.0,
        delay: 4265.0,
    });
    let laws = (slow, fast, Oscillator::new(0.1, 5000.0));
    let mut shoot = reduced(0.05, 10.0 * HOUR)
        .tropism(laws)
        .scene(Still::tilted(0.3))
        .build()
        .unwrap();
    let cost = Adaptive::new(1e-5).advance(&mut shoot, 4265.0).unwrap();
    // The chain has 1,700 discontinuities with seven steps each.
    assert!(cost.steps + cost.trial_steps < 500, "{cost:?}");
}

#[test]
fn limit_of_work_is_an_error_that_leaves_the_shoot_as_it_was() {
    let mut shoot = righting().build().unwrap();
    let mut steps = MethodOfSteps::new(60.0);
    let needed = steps.advance(&mut shoot.clone(), HOUR).unwrap().work();
    let before = shoot.state().clone();
    steps.max_work = needed - 1;
    let error = steps.advance(&mut shoot, HOUR).unwrap_err();
    assert_eq!(
        error,
        IntegrationError::WorkLimit {
            time: HOUR,
            limit: needed - 1
        }
    );
    assert!(shoot.state() == &before);
    steps.max_work = needed;
    let _ = steps.advance(&mut shoot, HOUR).unwrap();
    // A call that makes trial runs for a single step states its own limit.
    let needed = Adaptive::new(1e-6)
        .step(&mut shoot.clone(), 3.0 * HOUR)
        .unwrap()
        .work();
    let mut limited = Adaptive {
        max_work: needed - 1,
        ..Adaptive::new(1e-6)
    };
    let error = limited.step(&mut shoot.clone(), 3.0 * HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::ToleranceNotMet { .. }),
        "{error}"
    );
    // A run by a plan has the same limit.
    let mut integrator = Adaptive::new(1e-6);
    integrator.step(&mut shoot, 3.0 * HOUR).unwrap();
    integrator.max_work = 10;
    let error = integrator.advance(&mut shoot, 3.0 * HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::WorkLimit { limit: 10, .. }),
        "{error}"
    );
}
