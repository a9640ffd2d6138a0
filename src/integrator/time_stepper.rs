//! Time steps for integrators outside the crate.

use super::error::Outcome;
use super::stepper::{
    GridUse, Run, StepEnd, Stepper, TimeStep, check_ahead, next_discontinuity_ahead, permitted_step,
};
use super::undo::undo_on_error;
use super::{HistoryFunction, ROUNDING, Statistics};
use crate::equilibrium::EquilibriumSolver;
use crate::error::ParameterError;
use crate::model::Model;
use crate::scene::after;
use crate::shoot::Shoot;
use crate::state::State;

/// The parts of a run, from which an [`Integrator`](super::Integrator) is composed: the start, the
/// choice of the ends of steps, and [steps](TimeStep) of several parts. It has workspace only;
/// everything that later steps depend on is in the state of the shoot.
///
/// An integrator of second order: the midpoint rule for the strain, and Heun's method for the
/// variables of the laws. The strain is not corrected, so that steps that are longer than the
/// shortest delay are refused.
///
/// ```
/// use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
/// use morphorod::integrator::{HistoryFunction, IntegrationError, Integrator, Statistics};
/// use morphorod::integrator::{TimeStep, TimeStepper};
/// use morphorod::{Model, ParameterError, Shoot};
///
/// struct Heun {
///     step: f64,
///     solver: NewtonSolver,
///     parts: TimeStepper,
/// }
///
/// /// Makes the parts of a step.
/// fn make<M: Model>(step: &mut TimeStep<M, NewtonSolver>) -> Result<(), IntegrationError> {
///     let [start, end] = step.times();
///     let requirement = "at most the shortest delay of the laws (s)";
///     ParameterError::unless(step.is_explicit(), "time step", end - start, requirement)?;
///     // Differential growth by the midpoint rule, up to the exit of each point from the growth zone.
///     let mut changes = Vec::new();
///     for point in step.points() {
///         let [from, to] = step.growth_interval(point).unwrap_or(step.times());
///         changes.push(step.intrinsic_rate(point, 0.5 * (from + to))? * (to - from));
///     }
///     step.change_intrinsic(&changes)?;
///     let _ = step.equilibrate()?;
///     step.sense()?;
///     let (mut guess, mut rates) = (Vec::new(), Vec::new());
///     step.set_variables(|at, variables| {
///         guess.clear();
///         guess.extend(at.variables.iter().zip(at.rates).map(|(y, rate)| y + (end - start) * rate));
///         rates.resize(guess.len(), 0.0);
///         at.rates_at(&guess, at.stimuli[1], &mut rates);
///         for (y, (first, last)) in variables.iter_mut().zip(at.rates.iter().zip(&rates)) {
///             *y += 0.5 * (end - start) * (first + last);
///         }
///     })?;
///     Ok(())
/// }
///
/// impl Integrator for Heun {
///     fn start(
///         &mut self,
///         shoot: &mut Shoot<impl Model>,
///         history: &impl HistoryFunction,
///     ) -> Result<Statistics, IntegrationError> {
///         self.parts.start(shoot, &mut self.solver, history)
///     }
///
///     fn advance_at_most(
///         &mut self,
///         shoot: &mut Shoot<impl Model>,
///         until: f64,
///         max_steps: usize,
///     ) -> Result<Statistics, IntegrationError> {
///         let Self { step, solver, parts } = self;
///         parts.undo_on_error(shoot, |parts, shoot| {
///             let mut cost = parts.prepare(shoot, solver, until)?;
///             while shoot.time() < until && cost.steps < max_steps {
///                 let end = parts.next_end(shoot, *step, until)?;
///                 let mut step = parts.begin(shoot, solver, end)?;
///                 make(&mut step)?;
///                 cost += step.finish()?;
///             }
///             Ok(cost)
///         })
///     }
/// }
/// ```
#[derive(Debug, Clone, Default)]
pub struct TimeStepper {
    pub(super) stepper: Stepper,
    /// State before the step.
    backup: Option<State>,
    /// State before the call.
    pub(super) before_call: Option<State>,
}

impl TimeStepper {
    /// Solves the equilibrium of a shoot at its present time, and sets the history of its laws, as
    /// [`Integrator::start`](super::Integrator::start).
    ///
    /// # Errors
    /// The errors of [`Integrator::start`](super::Integrator::start). The shoot does not change
    /// then.
    pub fn start<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        solver: &mut impl EquilibriumSolver,
        history: &impl HistoryFunction,
    ) -> Outcome<Statistics> {
        let Self {
            stepper, backup, ..
        } = self;
        undo_on_error(shoot, backup, |shoot, _| {
            Run {
                stepper,
                shoot,
                solver,
            }
            .start(history, None)
        })
    }

    /// Prepares a shoot for steps to the time `until` (s): starts it with an empty history unless
    /// it was started, and computes the shape after an exchange of its laws. A resolution that
    /// [`Adaptive`](super::Adaptive) has chosen is no longer used. [`begin`](Self::begin) does the
    /// same.
    ///
    /// # Errors
    /// The errors of [`start`](Self::start). [`Parameter`](super::IntegrationError::Parameter) for
    /// a time that is in the past or not finite, and for a history that does not fit the laws. The
    /// shoot does not change then.
    pub fn prepare<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        solver: &mut impl EquilibriumSolver,
        until: f64,
    ) -> Outcome<Statistics> {
        check_ahead("time to advance to", shoot, until)?;
        let Self {
            stepper, backup, ..
        } = self;
        undo_on_error(shoot, backup, |shoot, _| {
            Run {
                stepper,
                shoot,
                solver,
            }
            .resume(usize::MAX, None)
        })?;
        Ok(stepper.statistics)
    }

    /// Calls `work`, which may make several steps, and restores the state of the shoot if it fails:
    /// an [`Integrator`](super::Integrator) leaves the shoot unchanged after an error.
    ///
    /// # Errors
    /// The error of `work`.
    pub fn undo_on_error<M: Model, T>(
        &mut self,
        shoot: &mut Shoot<M>,
        work: impl FnOnce(&mut Self, &mut Shoot<M>) -> Outcome<T>,
    ) -> Outcome<T> {
        let mut before = self.before_call.take();
        let outcome = undo_on_error(shoot, &mut before, |shoot, _| work(self, shoot));
        self.before_call = before;
        outcome
    }

    /// The end of a step of at most `longest` seconds towards the time `until` (s). It is earlier
    /// at the next discontinuity that the laws or the scene announce, and if the tissue would grow
    /// by more than an element in the step. Steps that are longer than the shortest delay of the
    /// laws, see [`is_explicit`](TimeStep::is_explicit), are permitted.
    ///
    /// # Errors
    /// [`Parameter`](super::IntegrationError::Parameter) for a step that is not positive, for a
    /// time that is not in the future, and for discontinuities without end;
    /// [`GrowsTooFast`](super::IntegrationError::GrowsTooFast).
    pub fn next_end(&self, shoot: &Shoot<impl Model>, longest: f64, until: f64) -> Outcome<f64> {
        ParameterError::positive("time step", longest, "s")?;
        let now = check_future("end of the steps", shoot, until)?;
        let target = next_discontinuity_ahead(shoot, until)?.min(until);
        let step = permitted_step(shoot, [longest, until], &shoot.mesh)?;
        Ok(if target - now <= step * (1.0 + ROUNDING) {
            target
        } else {
            now + step
        })
    }

    /// Begins a step to the time `end` (s), which [`next_end`](Self::next_end) bounds. The
    /// equilibria of the step use the solver. Changes of contact with obstacles in the step are not
    /// located.
    ///
    /// # Errors
    /// The errors of [`prepare`](Self::prepare); [`Parameter`](super::IntegrationError::Parameter)
    /// for an end that is not in the future, after a discontinuity, or later than growth permits;
    /// [`GrowsTooFast`](super::IntegrationError::GrowsTooFast),
    /// [`Uneven`](super::IntegrationError::Uneven),
    /// [`BaseTurns`](super::IntegrationError::BaseTurns). The shoot does not change then.
    pub fn begin<'a, M: Model, E: EquilibriumSolver>(
        &'a mut self,
        shoot: &'a mut Shoot<M>,
        solver: &'a mut E,
        end: f64,
    ) -> Outcome<TimeStep<'a, M, E>> {
        check_future("end of the step", shoot, end)?;
        let Self {
            stepper, backup, ..
        } = self;
        let step = undo_on_error(shoot, backup, |shoot, _| {
            let grids = if matches!(stepper.grid, GridUse::Free) {
                0.0
            } else {
                1.0
            };
            let (name, requirement) = (
                "number of grids that are recorded or followed",
                "zero for single steps",
            );
            ParameterError::unless(grids == 0.0, name, grids, requirement)?;
            Run {
                stepper,
                shoot,
                solver,
            }
            .resume(usize::MAX, None)?;
            let discontinuity = next_discontinuity_ahead(shoot, end)?;
            let requirement = "not after the next discontinuity of a law or the scene (s)";
            ParameterError::unless(end <= discontinuity, "end of the step", end, requirement)?;
            let (step, mesh) = (end - shoot.time(), shoot.mesh);
            let permitted = permitted_step(shoot, [step, end], &mesh)?;
            let requirement = "within the bound that growth sets on a step, see `next_end` (s)";
            ParameterError::unless(
                step <= permitted * (1.0 + ROUNDING),
                "end of the step",
                end,
                requirement,
            )?;
            let discontinuity = end == discontinuity;
            stepper.begin_step(
                shoot,
                &mesh,
                StepEnd {
                    discontinuity,
                    ..StepEnd::smooth(end, end)
                },
            )
        })?;
        Ok(TimeStep::new(
            Run {
                stepper,
                shoot,
                solver,
            },
            step,
            backup.as_ref(),
        ))
    }
}

/// Returns the time of a shoot, or an error unless a time (s) is finite and in its future by more
/// than rounding.
fn check_future(
    name: &'static str,
    shoot: &Shoot<impl Model>,
    time: f64,
) -> Result<f64, ParameterError> {
    let now = shoot.time();
    let ok = time > after(after(now)) && time.is_finite();
    ParameterError::unless(
        ok,
        name,
        time,
        "finite, and later than the present by more than rounding (s)",
    )?;
    Ok(now)
}
