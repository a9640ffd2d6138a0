//! Runs of a call. Each starts from the state at the beginning of the call, and is a value that later runs are compared
//! with.

use std::rc::Rc;

use super::division::{FIRST_LENGTH, cut, longest_element, merge_lossless};
use super::hidden_strain::{hidden_strain, nodes_at_steep_places};
use super::richardson::{AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, SAFETY};
use super::track::PositionTrack;
use super::{Adaptive, Outcome, Statistics, tolerance_of_equilibria};
use crate::equilibrium::Equilibrium;
use crate::integrator::IntegrationError;
use crate::integrator::stepper::StepEnd;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::{Plan, State};
use crate::tropism::Declaration;

/// Tolerance of the initial equilibrium, relative to that of the run: as for merging.
const INITIAL: f64 = AIM_OF_MERGING;

/// Largest number of times that a run is repeated with additional nodes.
const REPETITIONS: usize = 3;
/// Smallest distance of an additional node from other nodes, relative to its element: far above rounding.
const AT_NODE: f64 = 1e-6;
/// Largest time over the delays after the call, in longest steps. It bounds the work for long delays.
const MOST_LATER_STEPS: f64 = 1000.0;

/// Result of a run.
pub(super) struct TrialRun {
    /// Resolution of the run. Its longest element is not longer than those of the initial equilibrium.
    pub plan: Plan,
    /// Statistics of the run, without the time after the end of the call except for the loss of mergers.
    pub statistics: Statistics,
    /// State at the end of the call.
    state: State,
    pub track: PositionTrack,
    /// Error of the initial equilibrium, relative to the length.
    pub initial: f64,
    /// Error of the intrinsic strain between the material points, relative to the length.
    pub hidden: f64,
}

impl TrialRun {
    /// Returns the largest distances from a run with longer steps, relative to the length: over the time of the call,
    /// and over this time and the delays after it.
    pub fn differences(&self, coarser: &Self) -> [f64; 2] {
        self.track.distances(&coarser.track, self.plan.until)
    }

    /// Returns the errors of equilibria and corrections, relative to the length, which the comparison with another run
    /// does not show.
    pub fn error_of_equilibria(&self) -> f64 {
        self.statistics.equilibrium_error + tolerance_of_equilibria(self.plan.tolerance)
    }

    /// Number of elements in the growth zone at the end of the call.
    pub fn elements(&self) -> usize {
        self.state.rod.elements() - self.state.rod.first_growing
    }

    /// Returns the ratio of the longest elements of a run to those of this run, averaged over the steps. Growing
    /// elements are halved at different times in the two runs.
    pub fn element_ratio(&self, coarser: &Self) -> f64 {
        coarser.track.longest_element() / self.track.longest_element()
    }
}

/// Runs of a call.
pub(super) struct Runs<'a, M> {
    pub integrator: &'a mut Adaptive,
    pub shoot: &'a mut Shoot<M>,
    /// State at the beginning of the call.
    pub start: &'a State,
    /// This state with fewer elements, if it has no history.
    undivided: State,
    /// Statistics of all runs, as trial runs.
    spent: Statistics,
    /// Time of the last snap in a run, before the end of the call, s.
    snap: Option<f64>,
    /// Initial meshes of the runs, of a shoot without a history.
    meshes: Vec<FirstMesh>,
    /// Additional nodes of all runs, as distances from the apex at t = 0, m.
    nodes: Vec<f64>,
    /// Declaration of the laws.
    pub laws: Declaration,
    /// Time that all runs over the delays have reached, s.
    reached: f64,
}

/// Elements of the initial equilibrium for a longest element.
struct FirstMesh {
    longest_element: f64,
    state: State,
    found: Equilibrium,
    /// Estimated error of the equilibrium, relative to the length.
    error: f64,
}

impl<'a, M: Model> Runs<'a, M> {
    pub fn new(integrator: &'a mut Adaptive, shoot: &'a mut Shoot<M>, start: &'a State) -> Self {
        if start.history.levels() == 0 {
            merge_lossless(shoot);
        }
        let mut laws = Declaration::default();
        laws.read(shoot.model.tropism());
        let (spent, meshes, undivided) = (Statistics::default(), Vec::new(), shoot.state.clone());
        let nodes = Vec::new();
        Self { integrator, shoot, start, undivided, spent, snap: None, meshes, nodes, laws, reached: f64::INFINITY }
    }

    /// Returns whether the shoot had a history at the beginning of the call.
    pub fn has_started(&self) -> bool {
        self.start.history.levels() > 0
    }

    /// Makes a run to the end of a plan. `reached` is the present error estimate, for the error message.
    pub fn run(&mut self, plan: Plan, reached: f64) -> Outcome<TrialRun> {
        // Every step has an equilibrium.
        if (plan.until - self.start.time) / plan.step > self.work_left() as f64 {
            return Err(self.not_met(reached));
        }
        self.run_at_most(plan, usize::MAX).map_err(|error| match error {
            IntegrationError::WorkLimit { .. } => self.not_met(reached),
            error => error,
        })
    }

    /// Makes a run to the end of a plan, and continues it over the longest delay. What the memories hold at the end of
    /// the call acts until then, and the plan holds for this time, so that the losses of its mergers count. The
    /// continuation ends early where it fails or snaps, which is not a failure of the call.
    pub fn run_over_delays(&mut self, plan: Plan) -> Outcome<Rc<TrialRun>> {
        let mut run = self.run(plan, f64::INFINITY)?;
        let (plan, longest_delay) = (run.plan, self.laws.longest_delay());
        if longest_delay > 0.0 {
            let until = plan.until + longest_delay.min(MOST_LATER_STEPS * plan.coarsest_step);
            let (samples, track) = (run.track.samples(), &mut run.track);
            let record = |shoot: &Shoot<M>, end: Option<_>| {
                if end.is_some() {
                    track.record(shoot, end)
                }
            };
            match self.follow(&plan, until, usize::MAX, None, record) {
                Ok(later) if later.snaps == 0 => {
                    run.statistics.merge_loss = run.statistics.merge_loss.max(later.merge_loss);
                }
                _ => run.track.truncate(samples),
            }
        }
        self.reached = self.reached.min(run.track.end());
        Ok(Rc::new(run))
    }

    /// Makes the first steps of a plan, by at most `max_steps`. A run whose elements hide too much of the intrinsic
    /// strain is repeated with additional nodes.
    pub fn run_at_most(&mut self, plan: Plan, max_steps: usize) -> Outcome<TrialRun> {
        let mut run = self.run_once(plan, max_steps)?;
        for repetition in 0..=REPETITIONS {
            let duration = self.shoot.time() - self.start.time;
            let enough = AIM_IN_SPACE * self.integrator.tolerance;
            run.hidden = hidden_strain(self.shoot, duration)?;
            if run.hidden <= enough || repetition == REPETITIONS {
                break;
            }
            let nodes = nodes_at_steep_places(self.shoot, duration, enough);
            if nodes.is_empty() {
                break;
            }
            self.nodes.extend(nodes);
            self.meshes.clear();
            run = self.run_once(plan, max_steps)?;
        }
        Ok(run)
    }

    /// Makes the first steps of a plan with the present nodes.
    fn run_once(&mut self, mut plan: Plan, max_steps: usize) -> Outcome<TrialRun> {
        let mut track = PositionTrack::default();
        let known = self.divide(&mut plan)?;
        let initial = self.initial_error(&plan);
        let record = |shoot: &Shoot<M>, end| track.record(shoot, end);
        let statistics = self.follow(&plan, plan.until, max_steps, known, record)?;
        Ok(TrialRun { plan, statistics, state: self.shoot.state.clone(), track, initial, hidden: 0.0 })
    }

    /// Advances the shoot with the resolution of a plan. The work counts, also if the run fails.
    fn follow(
        &mut self,
        plan: &Plan,
        until: f64,
        max_steps: usize,
        known: Option<Equilibrium>,
        observe: impl FnMut(&Shoot<M>, Option<StepEnd>),
    ) -> Outcome<Statistics> {
        let limits = [max_steps, self.work_left()];
        let result = self.integrator.follow(self.shoot, plan, until, limits, known, observe);
        let statistics = self.integrator.workspace.stepper.statistics();
        self.spent += statistics.as_trial();
        self.snap = statistics.last_snap.filter(|time| *time <= plan.until).or(self.snap);
        result
    }

    /// Returns the work that the limit of a call leaves.
    fn work_left(&self) -> usize {
        self.integrator.max_work.saturating_sub(self.spent.work())
    }

    /// Makes a run the result of the call, whose steps and elements have an `error`. Returns its resolution and the
    /// statistics of the call.
    pub fn accept(&mut self, run: &TrialRun, error: f64) -> (Plan, Statistics) {
        self.shoot.state.copy_from(&run.state);
        let error = self.start.plan.map_or(0.0, |plan| plan.error) + error + run.error_of_equilibria();
        let trial_steps = self.spent.trial_steps - run.statistics.steps;
        let statistics = Statistics { trial_steps, ..self.spent.undone_since(run.statistics) };
        // The resolution is sufficient as far as the runs were compared.
        let until = self.reached.max(run.plan.until);
        (Plan { until, error, ..run.plan }, statistics)
    }

    /// Restores the state at the beginning of the call, and divides the shoot into elements for a run. For a shoot
    /// without a history, refines the mesh of the initial equilibrium, whose error is a part of the error in space, and
    /// reduces the longest element of the plan to that of this mesh. Returns this equilibrium.
    fn divide(&mut self, plan: &mut Plan) -> Outcome<Option<Equilibrium>> {
        if let Some(mesh) = self.meshes.iter().find(|mesh| mesh.longest_element == plan.longest_element) {
            self.shoot.state.copy_from(&mesh.state);
            return Ok(Some(mesh.found));
        }
        if self.has_started() {
            self.shoot.state.copy_from(self.start);
            cut(self.shoot, plan.longest_element);
            self.add_nodes();
            return Ok(None);
        }
        self.shoot.state.copy_from(&self.undivided);
        cut(self.shoot, plan.longest_element);
        self.add_nodes();
        // The comparison of runs shows the error of the shape as well, except near buckling and where the stiffness
        // is discontinuous.
        let tolerance = INITIAL * self.integrator.tolerance;
        let weight = (tolerance / ASYMPTOTIC).min(1.0);
        let (error, found) = self.integrator.refine_equilibrium(self.shoot, tolerance, weight, &mut self.spent)?;
        // Longer elements than these would not change the initial mesh.
        plan.longest_element = plan.longest_element.min(longest_element(&self.shoot.state) / FIRST_LENGTH);
        let state = self.shoot.state.clone();
        self.meshes.retain(|mesh| mesh.longest_element != plan.longest_element);
        self.meshes.push(FirstMesh { longest_element: plan.longest_element, state, found, error });
        Ok(Some(found))
    }

    /// Divides elements at the additional nodes.
    fn add_nodes(&mut self) {
        for distance in &self.nodes {
            let state = &mut self.shoot.state;
            if let Some((e, x)) = state.rod.locate_initial(*distance)
                && x > AT_NODE
                && x < 1.0 - AT_NODE
            {
                state.split(e, x);
            }
        }
    }

    /// Returns whether no run has required additional nodes.
    pub fn is_smooth(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Returns the error of the initial equilibrium in the runs of a plan, relative to the length.
    fn initial_error(&self, plan: &Plan) -> f64 {
        let mesh = self.meshes.iter().find(|mesh| mesh.longest_element == plan.longest_element);
        mesh.map_or(0.0, |mesh| mesh.error / SAFETY)
    }

    /// Returns the error for a tolerance that is not met.
    pub fn not_met(&self, reached: f64) -> IntegrationError {
        let (tolerance, work, snap) = (self.integrator.tolerance, self.spent.work(), self.snap);
        IntegrationError::ToleranceNotMet { tolerance, reached, work, snap }
    }
}
