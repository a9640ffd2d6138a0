//! An integrator of second order, composed of the parts of a step.

use morphorod::equilibrium::EquilibriumSolver;
use morphorod::integrator::{
    HistoryFunction, IntegrationError, Integrator, PointStep, Statistics, TimeStep, TimeStepper,
};
use morphorod::{Model, ParameterError, Shoot};

/// The midpoint rule for the intrinsic strain, and Heun's method for the variables of the laws. One
/// equilibrium per step.
///
/// The strain at the end of a step follows from delayed variables. It is not corrected with the
/// variables at the end, so that a step that is longer than the shortest delay is refused.
pub struct Heun<E> {
    /// Longest step, s.
    pub step: f64,
    pub solver: E,
    pub parts: TimeStepper,
}

impl<E: EquilibriumSolver> Heun<E> {
    pub fn new(step: f64, solver: E) -> Self {
        Self {
            step,
            solver,
            parts: TimeStepper::default(),
        }
    }
}

/// Changes the intrinsic strain by the midpoint rule.
pub fn midpoint<M: Model, E: EquilibriumSolver>(
    step: &mut TimeStep<M, E>,
) -> Result<(), IntegrationError> {
    let [start, end] = step.times();
    let requirement = "at most the shortest delay of the laws (s)";
    ParameterError::unless(step.is_explicit(), "time step", end - start, requirement)?;
    let mut changes = Vec::new();
    for point in step.points() {
        // A point that leaves the growth zone in the step grows until its exit.
        let [from, to] = step.growth_interval(point).unwrap_or(step.times());
        changes.push(step.intrinsic_rate(point, 0.5 * (from + to))? * (to - from));
    }
    step.change_intrinsic(&changes)?;
    Ok(())
}

/// Makes the parts of a step. A step that is dropped before `finish` is undone.
fn make<M: Model, E: EquilibriumSolver>(step: &mut TimeStep<M, E>) -> Result<(), IntegrationError> {
    midpoint(step)?;
    let _ = step.equilibrate()?;
    step.sense()?;
    let [from, to] = step.times();
    step.set_variables(|at, variables| heun(at, to - from, variables))
}

/// Heun's method for the variables of a point over a step of `size` seconds.
fn heun(at: &PointStep, size: f64, variables: &mut [f64]) {
    let guess: Vec<f64> = at
        .variables
        .iter()
        .zip(at.rates)
        .map(|(y, rate)| y + size * rate)
        .collect();
    let mut rates = vec![0.0; guess.len()];
    at.rates_at(&guess, at.stimuli[1], &mut rates);
    for (y, (first, last)) in variables.iter_mut().zip(at.rates.iter().zip(rates)) {
        *y += 0.5 * size * (first + last);
    }
}

impl<E: EquilibriumSolver> Integrator for Heun<E> {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.parts.start(shoot, &mut self.solver, history)
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let Self {
            step,
            solver,
            parts,
        } = self;
        parts.undo_on_error(shoot, |parts, shoot| {
            let mut cost = parts.prepare(shoot, solver, until)?;
            while shoot.time() < until && cost.steps < max_steps {
                let end = parts.next_end(shoot, *step, until)?;
                let mut step = parts.begin(shoot, solver, end)?;
                make(&mut step)?;
                cost += step.finish()?;
            }
            Ok(cost)
        })
    }
}
