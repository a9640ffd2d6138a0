//! Time steps of a run, shared by the integrators.

mod collocation;
mod contact_changes;
mod elongation;
mod follow;
mod gradient_integral;
mod grid;
mod memories;
mod mesh;
mod options;
mod part;
mod phases;
mod picard;
mod point_step;
mod relaxation;
mod start;
mod step_end;
mod time_step;
mod transient;

use nalgebra::Vector3;

use super::error::Outcome;
use super::undo::undo_on_error;
use super::{
    ConstantHistory, FIRST_STEP, HistoryFunction, IntegrationError, MAX_HALVINGS, ORDER, ROUNDING, Statistics,
};
use crate::equilibrium::{Equilibrium, EquilibriumSolver, IncrementStart};
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Unshaped;
use crate::scene::after;
use crate::shoot::{Mesh, Shoot};
use crate::state::{Spare, State};
use crate::tropism::{Declaration, Growing};
use collocation::ExponentialCollocation;
use gradient_integral::GradientIntegral;
pub use grid::Grid;
pub(super) use grid::GridUse;
pub(super) use mesh::compliance;
pub(super) use options::{MAX_CORRECTIONS, RunOptions, check_ahead, check_growth, shortest_period};
use part::StepPart;
pub use point_step::PointStep;
use step_end::EQUAL_STEPS;
pub(super) use step_end::{StepEnd, next_discontinuity_ahead, permitted_step};
pub use time_step::TimeStep;

/// Workspace of a run. It keeps no state between calls.
#[derive(Debug, Clone, Default)]
pub(super) struct Stepper {
    laws: Declaration,
    gradient_integral: GradientIntegral,
    /// The integral up to the exit of a point from the growth zone.
    exit_integral: GradientIntegral,
    collocation: ExponentialCollocation,
    force: InternalForce,
    /// Data that the solver of an equilibrium must not change.
    unshaped: Unshaped,
    /// Stimuli of a point.
    stimuli: Vec<f64>,
    /// Intrinsic strain (1/m) and distance from the apex (m) of the zone's points at the start of the step.
    starts: Vec<(Vector3<f64>, f64)>,
    /// Places of these points at the start of the step.
    places: Vec<Growing>,
    /// Changes of their intrinsic strains in the step, 1/m.
    changes: Vec<Vector3<f64>>,
    spare: Spare,
    /// The start of an increment; `None` without obstacles.
    increment_start: Option<IncrementStart>,
    /// Whether the search omits the descent to any equilibrium. It then fails where a branch of equilibria ends.
    omits_descent: bool,
    statistics: Statistics,
    /// Largest work of the call.
    max_work: usize,
    pub grid: GridUse,
    /// Copy of the state before a step that may be repeated.
    backup: Option<State>,
}

/// Interval of a step.
#[derive(Debug, Clone, Copy)]
struct StepInterval {
    from: f64,
    to: f64,
    /// Number of growing elements that leave the zone.
    leaving: usize,
    /// Times between which the growth law is evaluated, s: after a discontinuity at the start, and before one
    /// at the end.
    growth: [f64; 2],
}

impl Stepper {
    /// Solves the first equilibrium, unless it is `known`, and sets the history of the laws. After an error the caller
    /// restores the shoot.
    pub fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        history: &impl HistoryFunction,
        known: Option<Equilibrium>,
    ) -> Outcome<Statistics> {
        self.prepare(shoot, usize::MAX)?;
        self.begin(shoot, solver, history, known)?;
        Ok(self.statistics())
    }

    /// Advances the shoot, and calls `observe` at the start and after every step with the end of that step.
    /// After an error the caller restores the shoot.
    pub fn advance<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        solver: &mut impl EquilibriumSolver,
        options: RunOptions,
        mut observe: impl FnMut(&Shoot<M>, Option<StepEnd>),
    ) -> Outcome<Statistics> {
        // The caller adds the statistics of a call that fails.
        self.reset_statistics();
        options.check(shoot)?;
        // A call of a few steps ends soon.
        if options.max_steps == usize::MAX {
            check_growth(shoot, options.until)?;
        }
        self.resume(shoot, solver, options.max_work, options.known)?;
        self.reserve_levels(&mut shoot.state, &options);
        observe(shoot, None);
        let mut retries_left = options.retries;
        while shoot.state.time < options.until && self.statistics.steps < options.max_steps {
            let end = self.next_step(shoot, solver, &options, &mut retries_left)?;
            observe(shoot, Some(end));
        }
        Ok(self.statistics())
    }

    /// Prepares for steps: begins a run unless the shoot was started, checks its history, and passes the discontinuity
    /// of an exchange of laws.
    pub fn resume(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        max_work: usize,
        known: Option<Equilibrium>,
    ) -> Outcome {
        self.prepare(shoot, max_work)?;
        if shoot.state.history.levels() == 0 {
            self.begin(shoot, solver, &ConstantHistory::Empty, known)?;
        }
        let (declared, known) = (self.laws.size(), shoot.state.history.size());
        let requirement = "that of the shoot's laws";
        ParameterError::count("number of variables in the state", [known.0, declared.variables], requirement)?;
        ParameterError::count("number of stimuli in the state", [known.1, declared.stimuli], requirement)?;
        shoot.state.check_reach(self.laws.longest_delay())?;
        if shoot.state.changed { self.pass_discontinuity(shoot, solver, 0) } else { Ok(()) }
    }

    /// Reads the declaration of the laws, and resets the statistics. A plan of earlier calls is dropped.
    fn prepare(&mut self, shoot: &mut Shoot<impl Model>, max_work: usize) -> Result<(), ParameterError> {
        shoot.state.plan = None;
        self.reset_statistics();
        self.max_work = max_work;
        self.laws.read(shoot.model.tropism());
        self.stimuli.resize(self.laws.size().stimuli, 0.0);
        self.laws.check()
    }

    fn reset_statistics(&mut self) {
        self.statistics = Statistics::default();
        self.collocation.halvings = 0;
    }

    /// Returns the statistics of the last call, also of one that failed.
    pub fn statistics(&self) -> Statistics {
        Statistics { halvings: self.collocation.halvings, ..self.statistics }
    }

    /// Makes one step and passes the discontinuity at its end, if there is one. The step ends where a contact begins
    /// or ends. After a recoverable error it is repeated with half its length, while retries are left. If these
    /// attempts fail, too, the error is that of the first attempt, unless a later one is not recoverable.
    fn next_step(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        options: &RunOptions,
        retries_left: &mut usize,
    ) -> Outcome<StepEnd> {
        let mut end = self.choose_step_end(shoot, options)?;
        let (locates, mut first) = (self.locates_contacts(shoot), None);
        while locates || *retries_left > 0 {
            let counts = self.statistics;
            let mut backup = self.backup.take();
            let result = undo_on_error(shoot, &mut backup, |shoot, start| {
                if locates {
                    return self.step_with_contacts(shoot, solver, start, end, options);
                }
                self.step(shoot, solver, end, options).map(|()| end)
            });
            self.backup = backup;
            match result {
                Err(error) if error.is_recoverable() && *retries_left > 0 => {
                    *retries_left -= 1;
                    self.statistics = self.statistics.undone_since(counts);
                    self.statistics.retries += 1;
                    let step = 0.5 * (end.time - shoot.state.time);
                    self.grid.rewind(self.grid.position().saturating_sub(1));
                    let first = first.get_or_insert(error);
                    let chosen = self.choose_step_end(shoot, &RunOptions { step, ..*options });
                    end = chosen.map_err(|_| first.clone())?;
                }
                result => return result.map_err(|error| first_cause(first, error)),
            }
        }
        self.step(shoot, solver, end, options).map(|()| end).map_err(|error| first_cause(first, error))
    }

    /// Makes one step, and passes the discontinuity at its end.
    fn step(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        end: StepEnd,
        options: &RunOptions,
    ) -> Outcome {
        let mut step = TimeStep::begin(self, (shoot, solver), (end, &options.mesh), None)?;
        step.integrate_intrinsic()?;
        let mut corrections = 0;
        loop {
            let _ = step.equilibrate()?;
            step.sense()?;
            step.integrate_variables()?;
            if step.is_explicit() {
                break;
            }
            let change = step.integrate_intrinsic()?;
            if change <= options.tolerance {
                break;
            }
            if corrections == options.max_corrections {
                return Err(IntegrationError::NotConverged { time: end.time, change });
            }
            corrections += 1;
        }
        step.finish().map(|_| ())
    }

    /// Adds an equilibrium to the statistics. After a snap the earlier equilibria are no longer extrapolated.
    ///
    /// # Errors
    /// The work exceeds its limit.
    fn record(&mut self, found: &Equilibrium, shoot: &mut Shoot<impl Model>) -> Outcome {
        self.statistics.add_equilibrium(found);
        if self.statistics.work() > self.max_work {
            return Err(IntegrationError::WorkLimit { time: shoot.state.time, limit: self.max_work });
        }
        if let Some(jump) = found.jump {
            self.statistics.add_snap(shoot.state.time, jump);
            shoot.state.predictor.forget();
        }
        Ok(())
    }

    /// Adapts the elements to a step, stores the initial strains and positions, and appends a level to the history.
    fn begin_step(&mut self, shoot: &mut Shoot<impl Model>, mesh: &Mesh, end: StepEnd) -> Outcome<StepInterval> {
        let (from, to) = (shoot.state.time, end.time);
        let growth = [if from == shoot.state.smooth_since { after(from) } else { from }, end.before()];
        let laws = (shoot.model.growth(), shoot.model.constitutive());
        let leaving = match self.grid.take_next() {
            Some(step) => mesh::follow(&mut shoot.state, laws, growth, &step, &mut self.statistics)?,
            None => {
                let recorded = self.grid.recorded();
                mesh::adapt(&mut shoot.state, laws, mesh, growth, (&mut self.statistics, recorded))
            }
        };
        if let Some(step) = self.grid.recorded() {
            (step.leaving, step.merge_next) = (leaving, shoot.state.merge_next);
        }
        let rod = &shoot.state.rod;
        self.starts.clear();
        self.starts.extend(rod.points()[rod.zone()].iter().map(|point| (point.intrinsic, point.apex_distance)));
        shoot.state.history.push(to, &mut self.spare);
        Ok(StepInterval { from, to, leaving, growth })
    }

    /// Moves the tissue that has left the zone to the mature part, and drops levels of the history that are no
    /// longer needed.
    fn end_step(&mut self, shoot: &mut Shoot<impl Model>, step: StepInterval) {
        shoot.state.mature(step.leaving);
        shoot.state.contact.mature();
        // The choice of the steps after a breaking point depends on the discontinuity that caused it, for a few steps.
        let (history, needed) = (&mut shoot.state.history, step.to - self.laws.longest_delay());
        let kinks = history.discontinuities().any(|level| history.time(level) <= needed);
        let kept = if kinks { EQUAL_STEPS * (step.to - step.from) } else { 0.0 };
        history.forget(needed - kept, &mut self.spare);
        self.statistics.steps += 1;
    }

    /// Solves the equilibrium after a discontinuity at the present time, and restarts interpolation from there. The
    /// `generation` is the number of delays through which a discontinuity of a law or the scene has caused it.
    fn pass_discontinuity(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        generation: u8,
    ) -> Outcome {
        let time = shoot.state.time;
        self.begin_increment(shoot);
        let found = self.solve_equilibrium(shoot, solver, after(time))?;
        self.record(&found, shoot)?;
        shoot.state.history.push_discontinuity(generation, &mut self.spare);
        self.sense(shoot)?;
        self.evaluate_rates(shoot);
        (shoot.state.smooth_since, shoot.state.changed) = (time, false);
        shoot.state.predictor.forget();
        Ok(())
    }

    /// Allocates all levels that the history will have, so that later steps need no allocation.
    fn reserve_levels(&mut self, state: &mut State, options: &RunOptions) {
        // Full steps over the longest delay, or to the end if that is earlier; the first steps; and those
        // around the ends.
        let known = state.history.levels() as f64;
        let full = (self.laws.longest_delay() / options.step).min(known + (options.until - state.time) / options.step);
        let levels = full.min(1e6) as usize + (1.0 / FIRST_STEP).log2() as usize + 2 * ORDER;
        state.history.reserve(levels, &mut self.spare);
    }
}

/// Returns the error of a step whose first attempt failed, too. An error that no shorter step avoids takes precedence.
fn first_cause(first: Option<IntegrationError>, last: IntegrationError) -> IntegrationError {
    if last.is_recoverable() { first.unwrap_or(last) } else { last }
}
