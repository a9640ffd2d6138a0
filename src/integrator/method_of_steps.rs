//! The method of steps: what the laws ask for during a step is known before it.

use super::course::Course;
use super::stepper::Stepper;
use super::{HistoryFunction, IntegrationError, Integrator, Statistics};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// An explicit integrator for delayed laws: one equilibrium in a step, fourth order in time.
///
/// As long as a step is not longer than the shortest delay, the laws read only the past, and the intrinsic strain at the
/// end of the step is a quadrature. Then one equilibrium gives the shape, and the stimuli that it offers, interpolated
/// in time through four equilibria, carry the laws' variables. Method and order of accuracy: [`guide::method`](crate::guide::method).
#[derive(Debug, Clone, Default)]
pub struct MethodOfSteps<E = NewtonSolver> {
    /// Longest step, s.
    pub step: f64,
    /// How often in a call a step that fails is tried again with half its length, where that may help; none by default.
    /// [`Statistics::retries`] has the number.
    pub retries: usize,
    /// Finds the shapes.
    pub solver: E,
    stepper: Stepper,
}

impl MethodOfSteps<NewtonSolver> {
    /// Steps of `step` seconds and Newton's method to 1e-8 rad, well below the error in time of any usual step.
    #[must_use]
    pub fn new(step: f64) -> Self {
        Self::with_solver(step, NewtonSolver::with_tolerance(1e-8))
    }
}

impl<E> MethodOfSteps<E> {
    /// Steps of `step` seconds with the given solver.
    #[must_use]
    pub fn with_solver(step: f64, solver: E) -> Self {
        Self { step, retries: 0, solver, stepper: Stepper::default() }
    }
}

impl<E: EquilibriumSolver> Integrator for MethodOfSteps<E> {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.stepper.start(shoot, &mut self.solver, history)
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        most_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let Self { step, retries, solver, stepper } = self;
        ParameterError::positive("time step", *step)?;
        stepper.laws.read(shoot.model.tropism());
        stepper.laws.check()?;
        if !stepper.reads_past_alone(*step) {
            let delay = stepper.laws.shortest_delay();
            return Err(IntegrationError::StepTooLong { step: *step, delay });
        }
        let mesh = shoot.mesh;
        let course =
            Course { until, size: *step, most_steps, retries: *retries, correction: None, mesh, coarsest: 0.0 };
        stepper.advance(shoot, solver, course)
    }
}
