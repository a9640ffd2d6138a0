//! Failures provoked in the middle of a call: the shoot is unchanged to the bit, and a shorter step
//! may succeed.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots;
use crate::fixtures::shoots::{HOUR, growing, righting};
use approx::abs_diff_eq;
use morphorod::Still;
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::{
    ContactViolation, Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver,
};
use morphorod::integrator::{Adaptive, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::InternalForce;
use morphorod::rod::Rod;
use morphorod::tropism::{
    Declaration, Growing, Memory, Proprioception, Response, Site, Size, TropismLaw,
};
use nalgebra::Vector3;

/// Solver that fails at some of the requested equilibria, counted from one, as if it had run out of
/// iterations.
#[derive(Clone)]
struct Flaky {
    solver: NewtonSolver,
    asked: usize,
    fails: std::ops::Range<usize>,
}

impl Flaky {
    fn new(fails: std::ops::Range<usize>) -> Self {
        Self {
            solver: NewtonSolver::with_tolerance(1e-8),
            asked: 0,
            fails,
        }
    }
}

impl EquilibriumSolver for Flaky {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        self.asked += 1;
        if self.fails.contains(&self.asked) {
            let contact = Some(ContactViolation {
                obstacle: 1,
                arc_length: 0.0312,
                violation: 3.2e-7,
            });
            let (step, residual, force) = (1.0, 1.0, 0.0);
            return Err(EquilibriumError::NoConvergence {
                iterations: 0,
                step,
                residual,
                force,
                contact,
            });
        }
        self.solver.equilibrate(rod, material, force)
    }
}

#[test]
fn failed_call_leaves_the_shoot_unchanged_wherever_it_fails() {
    let start = {
        let mut shoot = growing().elements(4).into_dyn().build().unwrap();
        MethodOfSteps::new(120.0).advance(&mut shoot, HOUR).unwrap();
        shoot
    };
    // The solver fails twice: with the extrapolated initial guess and with the last shape.
    for at in 1..30 {
        let mut shoot = start.clone();
        let mut run = MethodOfSteps::with_solver(120.0, Flaky::new(at..at + 2));
        let error = run.advance(&mut shoot, 2.0 * HOUR).unwrap_err();
        assert!(
            matches!(error, IntegrationError::Equilibrium { .. }) && error.is_recoverable(),
            "{error}"
        );
        // The message states the time, the obstacle and the place.
        let (words, last) = (
            error.to_string(),
            "the contact with obstacle 1 at 0.0312 m from the base is violated by",
        );
        assert!(
            words.starts_with("at ") && words.contains(" s: no equilibrium after 0 iterations: "),
            "{words}"
        );
        assert!(
            words.contains(&format!(
                "largest force 0 N; {last} 3.2e-7 m, perhaps since the search began inside the obstacle, or since a \
                 hold is too far around it; shorter steps"
            )),
            "{words}"
        );
        assert!(shoot.state() == start.state(), "failure {at}");
        // The integrator keeps no data of the failed call. The same call now succeeds with the
        // result of an undisturbed run.
        run.advance(&mut shoot, 2.0 * HOUR).unwrap();
        let mut calm = start.clone();
        MethodOfSteps::new(120.0)
            .advance(&mut calm, 2.0 * HOUR)
            .unwrap();
        assert!(shoot.state() == calm.state(), "failure {at}");
    }
}

#[test]
fn failed_step_is_retried_with_half_its_length() {
    // Errors of steps of 120 s are 1e-7 m here. Halving one step moves the tip by less.
    let tip = |fails: std::ops::Range<usize>, retries: usize| {
        let mut shoot = righting().into_dyn().build().unwrap();
        let mut run = MethodOfSteps::with_solver(120.0, Flaky::new(fails));
        run.retries = retries;
        run.advance(&mut shoot, 2.0 * HOUR)
            .map(|cost| (shoot.tip(), cost))
    };
    let (calm, cost) = tip(0..0, 5).unwrap();
    assert_eq!(cost.retries, 0);
    for at in [2, 5, 20, 40] {
        let (found, with_retries) = tip(at..at + 4, 5).unwrap();
        assert_eq!(with_retries.retries, 2, "failure {at}");
        assert!(with_retries.steps > cost.steps);
        assert!(
            abs_diff_eq!(InNorm(found), InNorm(calm), epsilon = 1e-7),
            "failure {at}: {found:?} against {calm:?}"
        );
        // One retry is not enough.
        assert!(matches!(
            tip(at..at + 4, 1).unwrap_err(),
            IntegrationError::Equilibrium { .. }
        ));
    }
    // If no retry succeeds, their number bounds the work.
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::with_solver(120.0, Flaky::new(10..usize::MAX));
    run.retries = 8;
    let before = shoot.clone();
    assert!(run.advance(&mut shoot, 2.0 * HOUR).is_err());
    // Each trial uses two initial guesses.
    assert!(
        shoot.state() == before.state() && run.solver.asked <= 9 + 2 * (1 + 8),
        "{}",
        run.solver.asked
    );
}

#[test]
fn cuts_of_a_failed_step_are_not_counted() {
    // Tissue leaves the zone after 1.2 hours, and every step then cuts an element. The cut of the
    // failed step is undone.
    let run = |fails: std::ops::Range<usize>| {
        let mut shoot = growing().elements(4).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::with_solver(120.0, Flaky::new(fails));
        run.retries = 1;
        run.advance(&mut shoot, 2.0 * HOUR).unwrap()
    };
    let (calm, cost) = (run(0..0), run(60..62));
    assert_eq!((calm.retries, cost.retries), (0, 1));
    assert_eq!(
        cost.splits - calm.splits,
        cost.steps - calm.steps,
        "{calm:?}, {cost:?}"
    );
}

/// Law whose gradient is multiplied by `answer`, NaN or infinity, after `left` evaluations.
struct Failing<L> {
    law: L,
    left: Arc<AtomicUsize>,
    answer: f64,
}

impl<L: TropismLaw> TropismLaw for Failing<L> {
    fn declare(&self, to: &mut Declaration) {
        self.law.declare(to);
    }
    fn size(&self) -> Size {
        self.law.size()
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.law.sense(site, stimuli);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.law.rates(variables, stimuli, rates);
    }
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.law.initial(stimuli, variables);
    }
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        let gradient = self.law.gradient(at, past, now);
        match self.left.load(Ordering::Relaxed) {
            0 => gradient * self.answer,
            left => {
                self.left.store(left - 1, Ordering::Relaxed);
                gradient
            }
        }
    }
}

#[test]
fn law_that_returns_nan_or_infinity_is_an_error_that_leaves_the_shoot_unchanged() {
    for answer in [f64::NAN, f64::INFINITY] {
        let left = Arc::new(AtomicUsize::new(5000));
        let law = Failing {
            law: shoots::steering(shoots::STATOLITHS),
            left: Arc::clone(&left),
            answer,
        };
        let mut shoot = righting().tropism(law).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::new(120.0);
        run.retries = 3;
        // Seven hours take at least 50,000 evaluations.
        let mut before = None;
        let error = loop {
            before.replace(shoot.state().clone());
            let until = shoot.time() + HOUR;
            if let Err(error) = run.advance(&mut shoot, until) {
                break error;
            }
            assert!(shoot.time() < 7.0 * HOUR, "{left:?} evaluations left");
        };
        assert!(
            matches!(error, IntegrationError::Undefined { .. }),
            "{error}"
        );
        assert!(before.is_some_and(|before| before == *shoot.state()));
        left.store(usize::MAX, Ordering::Relaxed);
        let until = shoot.time() + HOUR;
        assert!(
            run.advance(&mut shoot, until)
                .is_ok_and(|cost| cost.retries == 0)
        );
    }
}

#[test]
fn response_that_diverges_is_an_error_where_the_shoot_is_no_longer_slender() {
    // Oscillations of delayed proprioception grow if η τr/τg > π/2. Here the ratio is 3 and 20.
    for sensitivity in [30.0, 200.0] {
        let memory = Memory {
            time: 720.0,
            delay: HOUR,
        };
        let make = || {
            let law = Proprioception { sensitivity }.remembered(memory);
            shoots::reduced(0.05, 10.0 * HOUR)
                .tropism(law)
                .scene(Still::tilted(1.0))
                .elements(40)
                .into_dyn()
                .build()
        };
        let before = make().unwrap();
        let mut shoot = before.clone();
        let error = MethodOfSteps::new(300.0)
            .advance(&mut shoot, 200.0 * HOUR)
            .unwrap_err();
        let IntegrationError::NotSlender {
            time,
            arc_length,
            curvature,
            radius,
        } = error
        else {
            panic!("{error}")
        };
        // The section is circular. The couple of the weight, and with it the curvature, is largest
        // at the base. In a step of a twelfth of the delay the curvature increases by less than a
        // half.
        assert!(
            (radius - shoots::RADIUS).abs() < 1e-15 && arc_length < 1e-3,
            "{error}"
        );
        assert!(
            (1.0..1.5).contains(&(curvature * radius)) && time < 12.0 * HOUR,
            "{error}"
        );
        assert!(shoot.state() == before.state() && !error.is_recoverable());
        // Half the step finds the same time up to a step.
        let half = MethodOfSteps::new(150.0)
            .advance(&mut shoot, 200.0 * HOUR)
            .unwrap_err();
        let IntegrationError::NotSlender { time: again, .. } = half else {
            panic!("{half}")
        };
        assert!(
            (again - time).abs() <= 300.0,
            "{again} s instead of {time} s"
        );
        // Trial runs neither refine it away nor hide it.
        let chosen = Adaptive::new(1e-4)
            .advance(&mut shoot, 200.0 * HOUR)
            .unwrap_err();
        assert!(
            matches!(chosen, IntegrationError::NotSlender { .. }),
            "{chosen}"
        );
    }
}
