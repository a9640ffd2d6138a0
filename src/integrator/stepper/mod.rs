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
    ConstantHistory, FIRST_STEP, HistoryFunction, IntegrationError, MAX_HALVINGS, ORDER, ROUNDING,
    Statistics,
};
use crate::equilibrium::{Equilibrium, EquilibriumSolver, IncrementStart};
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::model::Model;
use crate::scene::after;
use crate::shoot::{Mesh, Shoot};
use crate::state::{Moments, Nodes, Spare, State, intrinsic_moments};
use crate::support::Support;
use crate::tropism::{Declaration, Growing};
use collocation::{ExponentialCollocation, Levels};
use gradient_integral::GradientIntegral;
pub use grid::Grid;
pub(super) use grid::GridUse;
pub(super) use mesh::compliance;
pub(super) use options::{MAX_CORRECTIONS, RunOptions, check_ahead, check_growth, shortest_period};
use part::{PART_NAMES, StepPart};
pub use point_step::PointStep;
use step_end::EQUAL_STEPS;
pub(super) use step_end::{StepEnd, next_discontinuity_ahead, permitted_step};
pub use time_step::TimeStep;
use time_step::{CHANGED_ZONE, check_base_turn};
use transient::smooth_levels;

/// Workspace of a run. It keeps no state between calls.
#[derive(Debug, Clone, Default)]
pub(super) struct Stepper {
    laws: Declaration,
    gradient_integral: GradientIntegral,
    collocation: ExponentialCollocation,
    force: InternalForce,
    /// Stimuli of a point.
    stimuli: Vec<f64>,
    /// Intrinsic strains of the zone's points at the start of the step, 1/m.
    starts: Vec<Vector3<f64>>,
    /// Places of these points at the start of the step.
    places: Vec<Growing>,
    /// Changes of their intrinsic strains in the step, 1/m.
    changes: Vec<Vector3<f64>>,
    spare: Spare,
    /// The start of an increment; `None` without obstacles.
    increment_start: Option<IncrementStart>,
    /// Whether the search omits the descent to any equilibrium. It then fails where a branch of
    /// equilibria ends.
    omits_descent: bool,
    /// Whether the shape of the rod is extrapolated and not an equilibrium.
    is_extrapolated: bool,
    /// Statistics of the last call, also of one that failed.
    pub statistics: Statistics,
    /// Largest work of the call.
    max_work: usize,
    pub grid: GridUse,
    /// Copy of the state before a step that may be repeated.
    backup: Option<State>,
}

/// Interval of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepInterval {
    from: f64,
    to: f64,
    /// Number of growing elements that leave the zone.
    leaving: usize,
    /// Times between which the growth law is evaluated, s: after a discontinuity at the start, and
    /// before one at the end.
    growth: [f64; 2],
    /// Levels through which stimuli are interpolated, with their times in s.
    levels: (Nodes, Levels),
    /// How the step ends.
    end: StepEnd,
    /// Moments of the intrinsic strain at the start.
    moments: Moments,
}

/// A run: its workspace, the shoot, and the solver of equilibria. What needs a solver is a method
/// of `Run`. The other parts of a step are methods of [`Stepper`].
#[derive(Debug)]
pub(super) struct Run<'a, M, E> {
    pub stepper: &'a mut Stepper,
    pub shoot: &'a mut Shoot<M>,
    pub solver: &'a mut E,
}

impl<M: Model, E: EquilibriumSolver> Run<'_, M, E> {
    /// Solves the first equilibrium, unless it is `known`, and sets the history of the laws. After
    /// an error the caller restores the shoot.
    pub fn start(
        &mut self,
        history: &impl HistoryFunction,
        known: Option<Equilibrium>,
    ) -> Outcome<Statistics> {
        self.stepper.prepare(self.shoot, usize::MAX)?;
        self.begin(history, known)?;
        Ok(self.stepper.statistics)
    }

    /// Advances the shoot, and calls `observe` at the start and after every step with the end of
    /// that step. After an error the caller restores the shoot.
    pub fn advance(
        &mut self,
        options: RunOptions,
        mut observe: impl FnMut(&Shoot<M>, Option<StepEnd>),
    ) -> Outcome<Statistics> {
        // The caller adds the statistics of a call that fails.
        self.stepper.statistics = Statistics::default();
        options.check(self.shoot)?;
        // A call of a few steps ends soon.
        if options.max_steps == usize::MAX {
            check_growth(self.shoot, options.until)?;
        }
        self.resume(options.max_work, options.known)?;
        self.stepper.reserve_levels(&mut self.shoot.state, &options);
        observe(self.shoot, None);
        let mut retries_left = options.retries;
        while self.shoot.state.time < options.until
            && self.stepper.statistics.steps < options.max_steps
        {
            let end = self.next_step(&options, &mut retries_left)?;
            observe(self.shoot, Some(end));
        }
        Ok(self.stepper.statistics)
    }

    /// Prepares for steps: begins a run unless the shoot was started, checks its history, and
    /// passes the discontinuity of an exchange of laws.
    pub fn resume(&mut self, max_work: usize, known: Option<Equilibrium>) -> Outcome {
        self.stepper.prepare(self.shoot, max_work)?;
        if self.shoot.state.history.levels() == 0 {
            self.begin(&ConstantHistory::Empty, known)?;
        }
        let (laws, state) = (&self.stepper.laws, &self.shoot.state);
        let (declared, stored, requirement) = (
            laws.size(),
            state.history.size(),
            "that of the shoot's laws",
        );
        ParameterError::count(
            "number of variables in the state",
            [stored.0, declared.variables],
            requirement,
        )?;
        ParameterError::count(
            "number of stimuli in the state",
            [stored.1, declared.stimuli],
            requirement,
        )?;
        state.check_reach(laws.longest_delay())?;
        if state.changed {
            self.pass_discontinuity(0)
        } else {
            Ok(())
        }
    }

    /// Makes one step and passes the discontinuity at its end, if there is one. The step ends where
    /// a contact begins or ends. After a recoverable error it is repeated with half its length,
    /// while retries are left. If these attempts fail, too, the error is that of the first attempt,
    /// unless a later one is not recoverable.
    fn next_step(&mut self, options: &RunOptions, retries_left: &mut usize) -> Outcome<StepEnd> {
        let mut end = self.stepper.choose_step_end(self.shoot, options)?;
        let (locates, mut first) = (self.stepper.locates_contacts(self.shoot), None);
        while locates || *retries_left > 0 {
            let counts = self.stepper.statistics;
            let mut backup = self.stepper.backup.take();
            let result = undo_on_error(self.shoot, &mut backup, |shoot, start| {
                let mut run = Run {
                    stepper: self.stepper,
                    shoot,
                    solver: self.solver,
                };
                if locates {
                    run.step_with_contacts(start, end, options)
                } else {
                    run.step(end, options)
                }
            });
            let Self { stepper, shoot, .. } = self;
            stepper.backup = backup;
            match result {
                Err(error) if error.is_recoverable() && *retries_left > 0 => {
                    *retries_left -= 1;
                    stepper.statistics = stepper.statistics.undone_since(counts);
                    stepper.statistics.retries += 1;
                    let step = 0.5 * (end.time - shoot.state.time);
                    stepper
                        .grid
                        .rewind(stepper.grid.position().saturating_sub(1));
                    let first = first.get_or_insert(error);
                    let chosen = stepper.choose_step_end(shoot, &RunOptions { step, ..*options });
                    end = chosen.map_err(|_| first.clone())?;
                }
                result => return result.map_err(|error| first_cause(first, error)),
            }
        }
        self.step(end, options)
            .map_err(|error| first_cause(first, error))
    }

    /// Makes one step, and passes the discontinuity at its end.
    fn step(&mut self, end: StepEnd, options: &RunOptions) -> Outcome<StepEnd> {
        let interval = self.stepper.begin_step(self.shoot, &options.mesh, end)?;
        let run = Run {
            stepper: self.stepper,
            shoot: self.shoot,
            solver: self.solver,
        };
        let mut step = TimeStep::new(run, interval, None);
        step.integrate_intrinsic()?;
        for corrections in 0.. {
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
                return Err(IntegrationError::NotConverged {
                    time: end.time,
                    change,
                });
            }
        }
        step.finish().map(|_| end)
    }

    /// Solves the equilibrium after a discontinuity at the present time, and restarts interpolation
    /// from there. The `generation` is the number of delays through which a discontinuity of a law
    /// or the scene has caused it.
    fn pass_discontinuity(&mut self, generation: u8) -> Outcome {
        let time = self.shoot.state.time;
        self.stepper.begin_increment(self.shoot);
        let found = self.solve_equilibrium(after(time))?;
        let Self { stepper, shoot, .. } = self;
        stepper.record(&found, shoot)?;
        shoot
            .state
            .history
            .push(time, generation, &mut stepper.spare);
        stepper.sense(shoot)?;
        stepper.evaluate_rates(shoot);
        (shoot.state.smooth_since, shoot.state.changed) = (time, false);
        shoot.state.predictor.forget();
        Ok(())
    }
}

impl Stepper {
    /// Reads the declaration of the laws, and resets the statistics. A plan of earlier calls is
    /// dropped.
    fn prepare(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        max_work: usize,
    ) -> Result<(), ParameterError> {
        shoot.state.plan = None;
        self.statistics = Statistics::default();
        self.max_work = max_work;
        self.laws.read(shoot.model.tropism());
        self.stimuli.resize(self.laws.size().stimuli, 0.0);
        self.laws.check()
    }

    /// Adds an equilibrium to the statistics. After a snap the earlier equilibria are no longer
    /// extrapolated.
    ///
    /// # Errors
    /// The work exceeds its limit.
    fn record(&mut self, found: &Equilibrium, shoot: &mut Shoot<impl Model>) -> Outcome {
        self.statistics.add_equilibrium(found);
        if self.statistics.work() > self.max_work {
            return Err(IntegrationError::WorkLimit {
                time: shoot.state.time,
                limit: self.max_work,
            });
        }
        if let Some(jump) = found.jump {
            self.statistics.add_snap(shoot.state.time, jump);
        }
        // Motions along neutral directions are rounding, which extrapolations would amplify.
        let drifts = found.inertia.neutral > 0 && !shoot.model.support().is_absent();
        if drifts {
            shoot.state.contact.forget();
        }
        if drifts || found.jump.is_some() {
            shoot.state.predictor.forget();
        }
        Ok(())
    }

    /// Begins a step: adapts the elements, stores the initial strains and positions, appends a
    /// level to the history, and moves the tissue to the end of the step. After an error the caller
    /// restores the shoot.
    pub fn begin_step(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        mesh: &Mesh,
        end: StepEnd,
    ) -> Outcome<StepInterval> {
        let (from, to) = (shoot.state.time, end.time);
        check_base_turn(shoot, [from, to])?;
        shoot.check_zone(&shoot.state, CHANGED_ZONE)?;
        self.begin_increment(shoot);
        let growth = [
            if from == shoot.state.smooth_since {
                after(from)
            } else {
                from
            },
            end.before(),
        ];
        let laws = (shoot.model.growth(), shoot.model.constitutive());
        let leaving = match self.grid.take_next() {
            Some(step) => {
                mesh::follow(&mut shoot.state, laws, growth, &step, &mut self.statistics)?
            }
            None => mesh::adapt(
                &mut shoot.state,
                laws,
                mesh,
                growth,
                (&mut self.statistics, self.grid.recorded()),
            ),
        };
        if let Some(step) = self.grid.recorded() {
            (step.leaving, step.merge_next) = (leaving, shoot.state.merge_next);
        }
        let rod = &shoot.state.rod;
        let points = &rod.points()[rod.zone()];
        self.starts.clear();
        self.starts
            .extend(points.iter().map(|point| point.intrinsic));
        self.places.clear();
        self.places.extend(
            points
                .iter()
                .map(|point| Growing::of(point, growth[0], point.apex_distance)),
        );
        shoot.state.history.push(to, 0, &mut self.spare);
        let (levels, moments) = (
            smooth_levels(&shoot.state, &self.laws, to - from),
            intrinsic_moments(rod),
        );
        self.gradient_integral.begin_step(&self.laws, levels);
        self.collocation.begin_step();
        let step = StepInterval {
            from,
            to,
            leaving,
            growth,
            levels,
            end,
            moments,
        };
        self.elongate(shoot, step)?;
        shoot.state.time = to;
        Ok(step)
    }

    /// Moves the tissue that has left the zone to the mature part, and drops levels of the history
    /// that are no longer needed.
    fn end_step(&mut self, shoot: &mut Shoot<impl Model>, step: StepInterval) {
        shoot.state.mature(step.leaving);
        shoot.state.contact.mature();
        // The choice of the steps after a breaking point depends on the discontinuity that caused
        // it, for a few steps.
        let (history, needed) = (
            &mut shoot.state.history,
            step.to - self.laws.longest_delay(),
        );
        let kinks = history
            .discontinuities()
            .any(|level| history.time(level) <= needed);
        let kept = if kinks {
            EQUAL_STEPS * (step.to - step.from)
        } else {
            0.0
        };
        history.forget(needed - kept, &mut self.spare);
        self.statistics.steps += 1;
    }

    /// Allocates all levels that the history will have, so that later steps need no allocation.
    fn reserve_levels(&mut self, state: &mut State, options: &RunOptions) {
        // Full steps over the longest delay, or to the end if that is earlier; the first steps; and
        // those around the ends.
        let known = state.history.levels() as f64;
        let full = (self.laws.longest_delay() / options.step)
            .min(known + (options.until - state.time) / options.step);
        let levels = full.min(1e6) as usize + (1.0 / FIRST_STEP).log2() as usize + 2 * ORDER;
        state.history.reserve(levels, &mut self.spare);
    }
}

/// Returns the error of a step whose first attempt failed, too. An error that no shorter step
/// avoids takes precedence.
fn first_cause(first: Option<IntegrationError>, last: IntegrationError) -> IntegrationError {
    if last.is_recoverable() {
        first.unwrap_or(last)
    } else {
        last
    }
}
