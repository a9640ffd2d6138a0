//! The run and its steps, shared by the integrators.

use nalgebra::Vector3;

use super::collocation::ExponentialCollocation;
use super::course::{Correction, Course, Step, check_ahead};
use super::gradient_integral::GradientIntegral;
use super::step_size::{AROUND, Stop, next_stop};
use super::{EmptyHistory, FIRST_STEP, HistoryFunction, IntegrationError, ORDER, Outcome, Statistics, mesh};
use crate::equilibrium::EquilibriumSolver;
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::model::Model;
use crate::scene::after;
use crate::shoot::{Mesh, Shoot};
use crate::state::{Spare, State, intrinsic_moments};
use crate::tropism::Declaration;

/// Workspace for stepping; no state.
#[derive(Debug, Clone, Default)]
pub(super) struct Stepper {
    pub laws: Declaration,
    pub gradient_integral: GradientIntegral,
    /// The same up to the exit of a point.
    pub exit_integral: GradientIntegral,
    pub collocation: ExponentialCollocation,
    pub force: InternalForce,
    /// Intrinsic strain and distance from the apex of the zone's points at the start of the step.
    pub starts: Vec<(Vector3<f64>, f64)>,
    pub spare: Spare,
    pub statistics: Statistics,
    backup: Option<State>,
}

impl Stepper {
    /// Finds the first equilibrium and gives the laws a history. If that fails, the shoot is as it was.
    pub fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.guarded(shoot, |stepper, shoot| stepper.begin(shoot, solver, history))
    }

    /// Carries the shoot along its course. If that fails, the shoot is as it was.
    pub fn advance(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        course: Course,
    ) -> Result<Statistics, IntegrationError> {
        self.advance_watched(shoot, solver, course, |_, _| ())
    }

    /// The same, and lets `watch` see the shoot at the start and after every step, with the stop at which that ended.
    pub fn advance_watched<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        solver: &mut impl EquilibriumSolver,
        course: Course,
        watch: impl FnMut(&Shoot<M>, Option<Stop>),
    ) -> Result<Statistics, IntegrationError> {
        ParameterError::positive("time step", course.size)?;
        check_ahead("time to advance to", shoot, course.until)?;
        self.guarded(shoot, |stepper, shoot| {
            if shoot.state.history.levels() == 0 {
                stepper.begin(shoot, solver, &EmptyHistory)?;
            }
            stepper.run(shoot, solver, course, watch)
        })
    }

    /// Whether the laws ask for nothing within a step of so many seconds that is not known before it. Rounding of a step that is meant to
    /// equal the delay is no fault.
    pub fn reads_past_alone(&self, step: f64) -> bool {
        step <= self.laws.shortest_delay() * (1.0 + 1e-12)
    }

    /// Runs `work` on the shoot; if it fails, puts the shoot back as it was.
    fn guarded<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        work: impl FnOnce(&mut Self, &mut Shoot<M>) -> Outcome,
    ) -> Result<Statistics, IntegrationError> {
        self.statistics = Statistics::default();
        self.collocation.halvings = 0;
        self.laws.read(shoot.model.tropism());
        self.laws.check()?;
        let backup = self.backup.get_or_insert_with(|| shoot.state.clone());
        backup.copy_from(&shoot.state);
        if let Err(error) = work(self, shoot) {
            if let Some(backup) = &self.backup {
                shoot.state.copy_from(backup);
            }
            return Err(error);
        }
        self.statistics.halvings = self.collocation.halvings;
        Ok(self.statistics)
    }

    fn run<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        solver: &mut impl EquilibriumSolver,
        mut course: Course,
        mut watch: impl FnMut(&Shoot<M>, Option<Stop>),
    ) -> Outcome {
        let Course { until, size, most_steps, .. } = course;
        self.check_history(&shoot.state)?;
        // What was chosen for a tolerance does not hold for other steps than those; `Adaptive` puts it back.
        shoot.state.plan = None;
        self.reserve_levels(&mut shoot.state, size, until);
        if shoot.state.changed {
            self.pass_discontinuity(shoot, solver)?;
        }
        watch(shoot, None);
        while shoot.state.time < until && self.statistics.steps < most_steps {
            let stop = next_stop(shoot, &self.laws, &course)?;
            let stop = match course.retries {
                0 => self.go(shoot, solver, &course, stop)?,
                _ => self.try_to_go(shoot, solver, &mut course, stop)?,
            };
            watch(shoot, Some(stop));
        }
        Ok(())
    }

    /// A step of a course to its stop, and over the discontinuity there if there is one.
    fn go(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        course: &Course,
        stop: Stop,
    ) -> Result<Stop, IntegrationError> {
        self.step(shoot, solver, stop, course.correction, &course.mesh)?;
        if stop.discontinuity {
            self.pass_discontinuity(shoot, solver)?;
        }
        Ok(stop)
    }

    /// The same; if it fails, half as far, and so on while there are retries left. What is left of them stays in the course.
    fn try_to_go(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        course: &mut Course,
        mut stop: Stop,
    ) -> Result<Stop, IntegrationError> {
        let (before, made) = (shoot.state.clone(), self.statistics);
        loop {
            match self.go(shoot, solver, course, stop) {
                Err(error) if error.is_recoverable() && course.retries > 0 => {
                    shoot.state.copy_from(&before);
                    course.retries -= 1;
                    self.statistics = self.statistics.undone_since(made);
                    self.statistics.retries += 1;
                    let size = 0.5 * (stop.time - before.time);
                    stop = next_stop(shoot, &self.laws, &Course { size, ..*course })?;
                }
                gone => return gone,
            }
        }
    }

    /// One step, to the near side of a discontinuity if it ends at one.
    fn step(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
        stop: Stop,
        correction: Option<Correction>,
        mesh: &Mesh,
    ) -> Outcome {
        let (to, read_at) = (stop.time, stop.before());
        let step = self.open(shoot, mesh, stop);
        self.collocation.renew();
        let before = intrinsic_moments(&shoot.state.rod);
        self.drive(shoot, step)?;
        self.elongate(shoot, step)?;
        shoot.state.predictor.extrapolate(&mut shoot.state.rod, &before, step.from, to);
        shoot.state.time = to;
        let jump = match self.equilibrate(shoot, solver, read_at) {
            // Extrapolation may lead astray; the last shape is the nearest that is known to be one.
            Err(error) if error.is_recoverable() => {
                shoot.state.predictor.take_last(&mut shoot.state.rod);
                self.equilibrate(shoot, solver, read_at)?
            }
            found => found?,
        };
        self.note(jump, shoot);
        self.sense(shoot)?;
        self.carry(shoot, step)?;
        if let Some(Correction { tolerance, most }) = correction {
            let mut corrections = 0;
            // What the new variables change of the intrinsic strain.
            let mut change = self.drive(shoot, step)?;
            while !(change <= tolerance) {
                if corrections == most {
                    return Err(IntegrationError::NotConverged { time: to, corrections, change });
                }
                corrections += 1;
                let jump = self.equilibrate(shoot, solver, read_at)?;
                self.note(jump, shoot);
                self.sense(shoot)?;
                self.carry(shoot, step)?;
                change = self.drive(shoot, step)?;
            }
        }
        self.close(shoot, step);
        Ok(())
    }

    /// Writes down a snap, once in a step. What is extrapolated from before it is no guess any more.
    fn note(&mut self, jump: Option<f64>, shoot: &mut Shoot<impl Model>) {
        if let Some(jump) = jump {
            let last = self.statistics.last_snap.replace(shoot.state.time);
            self.statistics.snaps += usize::from(last != Some(shoot.state.time));
            self.statistics.largest_jump = self.statistics.largest_jump.max(jump);
            shoot.state.predictor.forget();
        }
    }

    /// Prepares the elements for a step, keeps where it starts, and opens a level of the history.
    fn open(&mut self, shoot: &mut Shoot<impl Model>, mesh: &Mesh, stop: Stop) -> Step {
        let (from, to, fresh) = (shoot.state.time, stop.time, shoot.state.smooth_since);
        let growth = [if from == fresh { after(from) } else { from }, stop.before()];
        let leaving = mesh::adapt(
            &mut shoot.state,
            (shoot.model.growth(), shoot.model.constitutive()),
            mesh,
            growth,
            &mut self.statistics,
        );
        let rod = &shoot.state.rod;
        self.starts.clear();
        self.starts.extend(rod.points()[rod.zone()].iter().map(|point| (point.intrinsic, point.apex_distance)));
        shoot.state.history.push(to, &mut self.spare);
        Step { from, to, leaving, growth }
    }

    /// Tissue leaves the zone, and levels of the history that nothing will read again are dropped.
    fn close(&mut self, shoot: &mut Shoot<impl Model>, step: Step) {
        shoot.state.mature(step.leaving, |point| point.exit_time);
        // A little longer than it is read, so that the steps behind a breaking point know of it.
        let behind = AROUND * (step.to - step.from);
        shoot.state.history.forget(step.to - self.laws.longest_delay() - behind, ORDER, &mut self.spare);
        self.statistics.steps += 1;
    }

    /// Something has a discontinuity at the present time: finds the shape after it and begins afresh from there.
    pub fn pass_discontinuity(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        solver: &mut impl EquilibriumSolver,
    ) -> Outcome {
        let time = shoot.state.time;
        let jump = self.equilibrate(shoot, solver, after(time))?;
        self.note(jump, shoot);
        shoot.state.history.push(time, &mut self.spare);
        self.sense(shoot)?;
        self.find_rates(shoot);
        (shoot.state.smooth_since, shoot.state.changed) = (time, false);
        shoot.state.predictor.forget();
        Ok(())
    }

    /// Refuses a state whose history belongs to other laws.
    fn check_history(&self, state: &State) -> Result<(), ParameterError> {
        let (size, known) = (self.laws.size(), state.history.size());
        let own = known == (size.variables, size.stimuli);
        ParameterError::unless(own, "number of variables in the state", known.0 as f64, "that of the shoot's laws")?;
        let reach = state.history.oldest().map_or(f64::NEG_INFINITY, |oldest| state.time - oldest);
        ParameterError::unless(
            reach >= self.laws.longest_delay() * (1.0 - 1e-9),
            "time that the state looks back",
            reach,
            "at least the longest delay of the shoot's laws (s)",
        )
    }

    /// Sets memory aside for all levels that the history will hold, so that no later step asks for any.
    fn reserve_levels(&mut self, state: &mut State, size: f64, until: f64) {
        // Full steps over the longest delay, or to the end if that comes first, those of a start, and the ones around the
        // ends.
        let known = state.history.levels() as f64;
        let full = (self.laws.longest_delay() / size).min(known + (until - state.time) / size);
        let levels = full.min(1e6) as usize + (1.0 / FIRST_STEP).log2() as usize + 2 * ORDER;
        state.history.reserve(levels, &mut self.spare);
    }
}
