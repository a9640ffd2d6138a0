//! Trial runs of a call. Each starts from the state at the beginning of the call, and is compared with the run
//! before.

use super::elements::{FIRST_LENGTH, cut, longest_element, merge_lossless};
use super::richardson::{AIM_OF_MERGING, ASYMPTOTIC, SAFETY};
use super::track::Track;
use super::{Adaptive, Outcome, Statistics};
use crate::equilibrium::Equilibrium;
use crate::integrator::IntegrationError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::{Plan, State};

/// Tolerance of the initial equilibrium, relative to that of the run: as for merging.
const INITIAL: f64 = AIM_OF_MERGING;

/// Trial runs of a call.
pub(super) struct Trials<'a, M> {
    pub integrator: &'a mut Adaptive,
    pub shoot: &'a mut Shoot<M>,
    /// State at the beginning of the call.
    pub start: &'a State,
    /// This state with fewer elements, if it has no history.
    undivided: State,
    /// Statistics of the last run.
    pub last: Statistics,
    /// Statistics of the runs before it.
    earlier: Statistics,
    /// Initial meshes of the runs before, of a shoot without a history.
    meshes: Vec<FirstMesh>,
    /// Tracks of the last run and of the run with which it is compared.
    tracks: [Track; 2],
    /// The run that was kept while others were made.
    kept: Option<Kept>,
}

/// Elements of the initial equilibrium for a longest element.
struct FirstMesh {
    longest_element: f64,
    state: State,
    found: Equilibrium,
    /// Estimated error of the equilibrium, relative to the length.
    error: f64,
}

/// A run that may be the result, or be compared with a later run.
struct Kept {
    state: State,
    statistics: Statistics,
    track: Track,
}

impl<'a, M: Model> Trials<'a, M> {
    pub fn new(integrator: &'a mut Adaptive, shoot: &'a mut Shoot<M>, start: &'a State) -> Self {
        let (last, earlier, meshes, tracks) = Default::default();
        if start.history.levels() == 0 {
            merge_lossless(shoot);
        }
        let undivided = shoot.state.clone();
        Self { integrator, shoot, start, undivided, last, earlier, meshes, tracks, kept: None }
    }

    /// Returns whether the shoot had a history at the beginning of the call.
    pub fn has_started(&self) -> bool {
        self.start.history.levels() > 0
    }

    /// Makes a run to the end of a plan. `reached` is the present error estimate, for the error message. The longest
    /// element of the plan is reduced to that of the initial equilibrium.
    pub fn run(&mut self, plan: &mut Plan, reached: f64) -> Outcome {
        let most = self.integrator.max_steps;
        let ahead = (plan.until - self.start.time) / plan.step;
        if self.steps() as f64 + ahead > most as f64 {
            return Err(self.not_met(reached));
        }
        self.tracks.swap(0, 1);
        let mut track = std::mem::take(&mut self.tracks[0]);
        track.clear();
        let known = self.divide(plan)?;
        let left = most - self.steps();
        let record = |shoot: &Shoot<M>, end| track.record(shoot, end);
        let result = self.integrator.follow(self.shoot, plan, plan.until, left, known, record);
        self.tracks[0] = track;
        self.earlier += std::mem::replace(&mut self.last, result?).as_trial();
        if self.shoot.time() < plan.until { Err(self.not_met(reached)) } else { Ok(()) }
    }

    /// Makes the first steps of a plan, without a comparison. Returns the statistics of the call.
    pub fn run_uncompared(&mut self, plan: &mut Plan, max_steps: usize) -> Outcome<Statistics> {
        let known = self.divide(plan)?;
        let result = self.integrator.follow(self.shoot, plan, plan.until, max_steps, known, |_, _| ())?;
        self.earlier += std::mem::replace(&mut self.last, result).as_trial();
        Ok(self.statistics())
    }

    /// Restores the state at the beginning of the call, and divides the shoot into elements for a run. For a shoot
    /// without a history, refines the mesh of the initial equilibrium, whose error is a part of the error in space.
    /// Returns this equilibrium.
    fn divide(&mut self, plan: &mut Plan) -> Outcome<Option<Equilibrium>> {
        if let Some(mesh) = self.meshes.iter().find(|mesh| mesh.longest_element == plan.longest_element) {
            self.shoot.state.copy_from(&mesh.state);
            return Ok(Some(mesh.found));
        }
        if self.has_started() {
            self.shoot.state.copy_from(self.start);
            cut(self.shoot, plan.longest_element);
            return Ok(None);
        }
        self.shoot.state.copy_from(&self.undivided);
        cut(self.shoot, plan.longest_element);
        // The comparison of runs shows the error of the shape as well, except near buckling and where the stiffness
        // is discontinuous.
        let tolerance = INITIAL * self.integrator.tolerance;
        let weight = (tolerance / ASYMPTOTIC).min(1.0);
        let (error, found, statistics) = self.integrator.refine_equilibrium(self.shoot, tolerance, weight)?;
        self.earlier += statistics.as_trial();
        // Longer elements than these would not change the initial mesh.
        plan.longest_element = plan.longest_element.min(longest_element(&self.shoot.state) / FIRST_LENGTH);
        let state = self.shoot.state.clone();
        self.meshes.retain(|mesh| mesh.longest_element != plan.longest_element);
        self.meshes.push(FirstMesh { longest_element: plan.longest_element, state, found, error });
        Ok(Some(found))
    }

    /// Returns the error of the initial equilibrium in the runs of a plan, relative to the length.
    pub fn initial_error(&self, plan: &Plan) -> f64 {
        let mesh = self.meshes.iter().find(|mesh| mesh.longest_element == plan.longest_element);
        mesh.map_or(0.0, |mesh| mesh.error / SAFETY)
    }

    /// Keeps the last run, so that the next run is compared with the run before it.
    pub fn keep(&mut self) {
        self.tracks.swap(0, 1);
        let (statistics, track) = (std::mem::take(&mut self.last), std::mem::take(&mut self.tracks[1]));
        self.kept = Some(Kept { state: self.shoot.state.clone(), statistics, track });
    }

    /// Returns the largest distance between the kept run and the last run, relative to the length.
    pub fn difference_of_kept(&self) -> f64 {
        self.kept.as_ref().map_or(f64::INFINITY, |kept| kept.track.distance(&self.tracks[0]))
    }

    /// Discards the runs after the kept one.
    pub fn return_to_kept(&mut self) {
        if let Some(kept) = self.kept.take() {
            self.shoot.state.copy_from(&kept.state);
            self.tracks[0] = kept.track;
            self.earlier += std::mem::replace(&mut self.last, kept.statistics).as_trial();
        }
    }

    /// Discards the kept run.
    pub fn discard_kept(&mut self) {
        self.earlier += self.kept.take().map_or_else(Statistics::default, |kept| kept.statistics.as_trial());
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
        let kept = self.kept.as_ref().map_or(0, |kept| kept.statistics.steps);
        self.last.steps + kept + self.earlier.trial_steps
    }

    /// Returns the error for a tolerance that is not met.
    pub fn not_met(&self, reached: f64) -> IntegrationError {
        IntegrationError::ToleranceNotMet { tolerance: self.integrator.tolerance, reached, steps: self.steps() }
    }
}
