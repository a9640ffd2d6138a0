//! Steps that are repeated with what they led to: for laws that respond without delay.

use super::course::{CORRECTIONS, Correction, Course};
use super::stepper::Stepper;
use super::{HistoryFunction, IntegrationError, Integrator, Statistics};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// An implicit integrator for laws of any delay, none included: fourth order in time, a few equilibria in a step.
///
/// A step is that of [`MethodOfSteps`](super::MethodOfSteps), repeated with the variables at its end until they agree
/// with what they lead to. The repetition contracts by about the step times the laws' fastest growth response.
#[derive(Debug, Clone)]
pub struct Iterated<E = NewtonSolver> {
    /// Longest step, s.
    pub step: f64,
    /// Largest change of an angle by the last repetition of a step, rad.
    pub tolerance: f64,
    /// Bound on the repetitions of a step.
    pub max_corrections: usize,
    /// How often in a call a step that fails is tried again with half its length, as in
    /// [`MethodOfSteps::retries`](super::MethodOfSteps::retries).
    pub retries: usize,
    /// Finds the shapes.
    pub solver: E,
    stepper: Stepper,
}

impl Iterated<NewtonSolver> {
    /// Steps of `step` seconds, repeated to 1e-8 rad, and Newton's method to the same.
    #[must_use]
    pub fn new(step: f64) -> Self {
        Self::with_solver(step, NewtonSolver::with_tolerance(1e-8))
    }
}

impl<E> Iterated<E> {
    /// Steps of `step` seconds with the given solver.
    #[must_use]
    pub fn with_solver(step: f64, solver: E) -> Self {
        Self { step, tolerance: 1e-8, max_corrections: CORRECTIONS, retries: 0, solver, stepper: Stepper::default() }
    }
}

impl<E: EquilibriumSolver> Integrator for Iterated<E> {
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
        ParameterError::positive("tolerance of the corrections", self.tolerance)?;
        let correction = Some(Correction { tolerance: self.tolerance, most: self.max_corrections });
        let mesh = shoot.mesh;
        let course =
            Course { until, size: self.step, most_steps, retries: self.retries, correction, mesh, coarsest: 0.0 };
        self.stepper.advance(shoot, &mut self.solver, course)
    }
}
