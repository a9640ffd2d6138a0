//! Trial runs of a call. Each starts from the state at the beginning of the call, and is compared with the run
//! before.

use super::elements::cut;
use super::richardson::{AIM, SAFETY};
use super::track::Track;
use super::{Adaptive, Outcome, Statistics};
use crate::integrator::IntegrationError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::{Plan, State};

/// Trial runs of a call.
pub(super) struct Trials<'a, M> {
    pub integrator: &'a mut Adaptive,
    pub shoot: &'a mut Shoot<M>,
    /// State at the beginning of the call.
    pub start: &'a State,
    /// Statistics of the last run.
    pub last: Statistics,
    /// Statistics of the runs before it.
    earlier: Statistics,
    /// Error of the initial equilibrium of the last run, relative to the length.
    pub initial_error: f64,
    /// Tracks of the last run and of the run with which it is compared.
    tracks: [Track; 2],
}

impl<'a, M: Model> Trials<'a, M> {
    pub fn new(integrator: &'a mut Adaptive, shoot: &'a mut Shoot<M>, start: &'a State) -> Self {
        let (last, earlier) = Default::default();
        Self { integrator, shoot, start, last, earlier, initial_error: 0.0, tracks: Default::default() }
    }

    /// Returns whether the shoot had a history at the beginning of the call.
    pub fn has_started(&self) -> bool {
        self.start.history.levels() > 0
    }

    /// Makes a run to the end of a plan. `reached` is the present error estimate, for the error message.
    pub fn run(&mut self, plan: &Plan, reached: f64) -> Outcome {
        self.shoot.state.copy_from(self.start);
        let most = self.integrator.max_steps;
        let ahead = (plan.until - self.shoot.time()) / plan.step;
        if self.steps() as f64 + ahead > most as f64 {
            return Err(self.not_met(reached));
        }
        self.tracks.swap(0, 1);
        let mut track = std::mem::take(&mut self.tracks[0]);
        track.clear();
        self.divide(plan)?;
        let left = most - self.steps();
        let result = self.integrator.follow(self.shoot, plan, plan.until, left, |shoot, end| track.record(shoot, end));
        self.tracks[0] = track;
        self.earlier += std::mem::replace(&mut self.last, result?).as_trial();
        if self.shoot.time() < plan.until { Err(self.not_met(reached)) } else { Ok(()) }
    }

    /// Makes the first steps of a plan, without a comparison. Returns the statistics of the call.
    pub fn run_uncompared(&mut self, plan: &Plan, max_steps: usize) -> Outcome<Statistics> {
        self.shoot.state.copy_from(self.start);
        self.divide(plan)?;
        let result = self.integrator.follow(self.shoot, plan, plan.until, max_steps, |_, _| ())?;
        self.earlier += std::mem::replace(&mut self.last, result).as_trial();
        Ok(self.statistics())
    }

    /// Divides the shoot into elements for a run. For a shoot without a history, refines the mesh of the
    /// initial equilibrium, whose error is a part of the error in space.
    fn divide(&mut self, plan: &Plan) -> Outcome {
        cut(self.shoot, plan.longest_element);
        if !self.has_started() {
            let tolerance = AIM[1] / SAFETY * self.integrator.tolerance;
            let (error, statistics) = self.integrator.refine_equilibrium(self.shoot, tolerance)?;
            self.initial_error = error;
            self.earlier += statistics.as_trial();
        }
        Ok(())
    }

    /// Returns the largest distance between the last run and the run with which it is compared, relative to the
    /// length.
    pub fn difference(&self) -> f64 {
        self.tracks[0].distance(&self.tracks[1])
    }

    /// Returns the ratio of the longest elements of these two runs, averaged over the steps. Growing elements
    /// are halved at different times in the two runs.
    pub fn element_ratio(&self) -> f64 {
        self.tracks[1].longest_element() / self.tracks[0].longest_element()
    }

    /// Discards the last run, so that the next run is compared with the run before it.
    pub fn keep_earlier(&mut self) {
        self.tracks.swap(0, 1);
    }

    /// Returns the statistics of the call. The last run is its result.
    pub fn statistics(&self) -> Statistics {
        let mut all = self.last;
        all += self.earlier;
        all
    }

    fn steps(&self) -> usize {
        self.last.steps + self.earlier.trial_steps
    }

    /// Returns the error for a tolerance that is not met.
    pub fn not_met(&self, reached: f64) -> IntegrationError {
        IntegrationError::ToleranceNotMet { tolerance: self.integrator.tolerance, reached, steps: self.steps() }
    }
}
