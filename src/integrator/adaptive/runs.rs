//! Runs of a call. Each starts from the state at the beginning of the call. Its result is kept for
//! the comparison with later runs.

use std::rc::Rc;

use super::division::{
    FIRST_LENGTH, LOSSLESS, cut, cut_each, cut_to, first_in_zone, longest_element, merge_lossless,
};
use super::hidden_strain::{hidden_strain, nodes_at_steep_places};
use super::richardson::{AIM_IN_SPACE, AIM_OF_MERGING, ASYMPTOTIC, SAFETY};
use super::track::PositionTrack;
use super::{Adaptive, Outcome, Statistics, options_of, tolerance_of_equilibria};
use crate::equilibrium::Equilibrium;
use crate::integrator::stepper::StepEnd;
use crate::integrator::{IntegrationError, ROUNDING};
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::{Plan, State};
use crate::tropism::Declaration;

/// Tolerance of the initial equilibrium, relative to that of the run: the same share as that of
/// merging.
const INITIAL: f64 = AIM_OF_MERGING;

/// Largest number of times that a run is repeated with additional nodes.
const REPETITIONS: usize = 3;
/// Smallest distance of an additional node from other nodes, relative to its element: far above
/// rounding.
const AT_NODE: f64 = 1e-6;
/// Largest time for which a run continues after the call, in units of its longest step. It bounds
/// the work for long delays.
const MOST_LATER_STEPS: f64 = 1000.0;

/// Result of a run.
pub(super) struct TrialRun {
    /// Plan of the run. Its longest element is at most that of the initial mesh over
    /// [`FIRST_LENGTH`].
    pub plan: Plan,
    /// Statistics of the run, without the time after the end of the call except for the loss of
    /// mergers.
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
    /// Returns the largest distances from a coarser run, relative to the length: over the time of
    /// the call, and over this time and the delays after it.
    pub fn differences(&self, coarser: &Self) -> [f64; 2] {
        self.track.distances(&coarser.track, self.plan.until)
    }

    /// Returns the errors of equilibria and corrections, relative to the length, which the
    /// comparison with another run does not show.
    pub fn error_of_equilibria(&self) -> f64 {
        self.statistics.equilibrium_error + tolerance_of_equilibria(self.plan.tolerance)
    }

    /// Number of elements in the growth zone at the end of the call.
    pub fn growing_elements(&self) -> usize {
        self.state.rod.elements() - self.state.rod.first_growing
    }

    /// Returns the ratio of the longest elements of a run to those of this run, averaged over the
    /// steps. Growing elements are halved at different times in the two runs.
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
    /// Time to which all runs were continued, s.
    compared_until: f64,
}

/// Elements of the initial equilibrium for a longest element.
struct FirstMesh {
    longest_element: f64,
    state: State,
    /// The equilibrium, and its estimated error without a safety factor, relative to the length.
    found: (Equilibrium, f64),
}

impl<'a, M: Model> Runs<'a, M> {
    pub fn new(integrator: &'a mut Adaptive, shoot: &'a mut Shoot<M>, start: &'a State) -> Self {
        let (spent, meshes, nodes) = (Statistics::default(), Vec::new(), Vec::new());
        let laws = Declaration::of(shoot.model.tropism());
        Self {
            integrator,
            shoot,
            start,
            spent,
            snap: None,
            meshes,
            nodes,
            laws,
            compared_until: f64::INFINITY,
        }
    }

    /// Returns whether the shoot had a history at the beginning of the call.
    pub fn has_started(&self) -> bool {
        self.start.history.levels() > 0
    }

    /// Returns the length above which growth divides elements in a run with the elements of a shoot
    /// with a history, m.
    pub fn longest_at_start(&self) -> f64 {
        let kept = self.start.plan.map(|plan| plan.longest_element);
        kept.unwrap_or_else(|| longest_element(self.start) / FIRST_LENGTH)
    }

    /// Makes a run to the end of a plan. `reached` is the present error estimate, for the error
    /// message.
    pub fn run(&mut self, plan: Plan, reached: f64) -> Outcome<TrialRun> {
        // Each step needs at least one unit of work.
        if (plan.until - self.start.time) / plan.step > self.work_left() as f64 {
            return Err(self.not_met(reached));
        }
        self.run_at_most(plan, usize::MAX, reached)
    }

    /// Makes a run to the end of a plan, and continues it over the longest delay, since the delayed
    /// variables at the end of the call affect the shape until then. The plan is valid for this
    /// time, so that the losses of its mergers count. The continuation ends early where it fails or
    /// snaps, which is not a failure of the call.
    pub fn run_over_delays(&mut self, plan: Plan) -> Outcome<Rc<TrialRun>> {
        let mut run = self.run(plan, f64::INFINITY)?;
        let (plan, longest_delay) = (run.plan, self.laws.longest_delay());
        if longest_delay > 0.0 {
            let until = plan.until + longest_delay.min(MOST_LATER_STEPS * plan.coarsest_step);
            let (samples, track) = (run.track.samples.len(), &mut run.track);
            let record = |shoot: &Shoot<M>, end: Option<_>| {
                if end.is_some() {
                    track.record(shoot, end)
                }
            };
            match self.advance_by(&plan, until, usize::MAX, None, record) {
                Ok(later) if later.snaps == 0 => {
                    run.statistics.merge_loss = run.statistics.merge_loss.max(later.merge_loss);
                }
                _ => run.track.samples.truncate(samples),
            }
        }
        self.compared_until = self.compared_until.min(run.track.end());
        Ok(Rc::new(run))
    }

    /// Makes the first steps of a plan, by at most `max_steps`. A run whose elements do not resolve
    /// the intrinsic strain is repeated with additional nodes. `reached` is the present error
    /// estimate, for the error message.
    pub fn run_at_most(&mut self, plan: Plan, max_steps: usize, reached: f64) -> Outcome<TrialRun> {
        let enough = AIM_IN_SPACE * self.integrator.tolerance;
        let mut repetition = 0;
        loop {
            let mut run = self
                .run_once(plan, max_steps)
                .map_err(|error| match error {
                    IntegrationError::WorkLimit { .. } => self.not_met(reached),
                    error => error,
                })?;
            let duration = self.shoot.time() - self.start.time;
            run.hidden = hidden_strain(self.shoot, duration)?;
            if run.hidden <= enough || repetition == REPETITIONS {
                return Ok(run);
            }
            let nodes = nodes_at_steep_places(self.shoot, duration, enough);
            if nodes.is_empty() {
                return Ok(run);
            }
            self.nodes.extend(nodes);
            self.meshes.clear();
            repetition += 1;
        }
    }

    /// Makes the first steps of a plan with the present nodes.
    fn run_once(&mut self, mut plan: Plan, max_steps: usize) -> Outcome<TrialRun> {
        let mut track = PositionTrack::default();
        let (known, initial) = self.divide(&mut plan)?.unzip();
        let record = |shoot: &Shoot<M>, end| track.record(shoot, end);
        let statistics = self.advance_by(&plan, plan.until, max_steps, known, record)?;
        let (state, initial) = (self.shoot.state.clone(), initial.unwrap_or(0.0));
        Ok(TrialRun {
            plan,
            statistics,
            state,
            track,
            initial,
            hidden: 0.0,
        })
    }

    /// Advances the shoot by a plan. The work of a run that fails counts, too.
    fn advance_by(
        &mut self,
        plan: &Plan,
        until: f64,
        max_steps: usize,
        known: Option<Equilibrium>,
        observe: impl FnMut(&Shoot<M>, Option<StepEnd>),
    ) -> Outcome<Statistics> {
        let options = options_of(plan, until, [max_steps, self.work_left()], known);
        let workspace = &mut self.integrator.workspace;
        workspace.solver.tolerance = options.tolerance;
        let result = workspace.run(self.shoot).advance(options, observe);
        let statistics = workspace.stepper.statistics;
        self.spent += statistics.as_trial();
        self.snap = statistics
            .last_snap
            .filter(|time| *time <= plan.until)
            .or(self.snap);
        result
    }

    /// Returns the work that the limit of a call leaves.
    fn work_left(&self) -> usize {
        self.integrator.max_work.saturating_sub(self.spent.work())
    }

    /// Makes a run the result of the call, whose steps and elements have an `error`. Returns its
    /// resolution and the statistics of the call.
    pub fn accept(&mut self, run: &TrialRun, error: f64) -> (Plan, Statistics) {
        self.shoot.state.copy_from(&run.state);
        let error =
            self.start.plan.map_or(0.0, |plan| plan.error) + error + run.error_of_equilibria();
        let trial_steps = self.spent.trial_steps - run.statistics.steps;
        let statistics = Statistics {
            trial_steps,
            ..self.spent.undone_since(run.statistics)
        };
        // The plan is valid up to the time to which the runs were compared.
        let until = self.compared_until.max(run.plan.until);
        (
            Plan {
                until,
                error,
                ..run.plan
            },
            statistics,
        )
    }

    /// Restores the state at the beginning of the call, and divides the shoot into elements for a
    /// run. For a shoot without a history, refines the mesh of the initial equilibrium, whose error
    /// is a part of the error in space, and reduces the longest element of the plan to that of this
    /// mesh. Returns this equilibrium with its error, relative to the length.
    fn divide(&mut self, plan: &mut Plan) -> Outcome<Option<(Equilibrium, f64)>> {
        if let Some(mesh) = self
            .meshes
            .iter()
            .find(|mesh| mesh.longest_element == plan.longest_element)
        {
            self.shoot.state.copy_from(&mesh.state);
            return Ok(Some(mesh.found));
        }
        self.shoot.state.copy_from(self.start);
        if self.has_started() {
            // Elements may have different lengths. Those of the zone are divided alike, so that the
            // difference of two runs shows the errors of all.
            let parts = (self.longest_at_start() / plan.longest_element * (1.0 - ROUNDING))
                .ceil()
                .max(1.0);
            plan.longest_element = self.longest_at_start() / parts;
            let (longest, first) = (plan.longest_element, first_in_zone(&self.start.rod));
            cut_each(&mut self.shoot.state, |rod, e| {
                if e < first {
                    cut_to(rod, e, longest)
                } else {
                    parts as usize
                }
            });
            self.add_nodes();
            return Ok(None);
        }
        merge_lossless(self.shoot);
        cut(self.shoot, plan.longest_element);
        self.add_nodes();
        // The comparison of runs shows the error of the shape as well, except near buckling and
        // where the stiffness is discontinuous. With this weight the difference of the two meshes
        // need only be below `ASYMPTOTIC`.
        let tolerance = INITIAL * self.integrator.tolerance;
        let weight = (tolerance / ASYMPTOTIC).min(1.0);
        let (error, equilibrium) =
            self.integrator
                .refine_equilibrium(self.shoot, tolerance, weight, &mut self.spent)?;
        let found = (equilibrium, error / SAFETY);
        // Longer elements than these would not change the initial mesh.
        plan.longest_element = plan
            .longest_element
            .min(longest_element(&self.shoot.state) / FIRST_LENGTH);
        let state = self.shoot.state.clone();
        self.meshes
            .retain(|mesh| mesh.longest_element != plan.longest_element);
        self.meshes.push(FirstMesh {
            longest_element: plan.longest_element,
            state,
            found,
        });
        Ok(Some(found))
    }

    /// Divides elements at the additional nodes.
    fn add_nodes(&mut self) {
        let inside = |(_, x): &(usize, f64)| *x > AT_NODE && *x < 1.0 - AT_NODE;
        for distance in &self.nodes {
            let state = &mut self.shoot.state;
            if let Some((e, x)) = state.rod.locate_initial(*distance).filter(inside) {
                state.split(e, x);
            }
        }
    }

    /// Returns whether the tissue in a run is likely to be smooth. Merged tissue and tissue with a
    /// history often are not, nor is tissue that has required additional nodes.
    pub fn is_smooth(&self, run: &TrialRun) -> bool {
        !self.has_started() && self.nodes.is_empty() && run.statistics.merge_loss <= LOSSLESS
    }

    /// Returns the error for a tolerance that is not met.
    pub fn not_met(&self, reached: f64) -> IntegrationError {
        let (tolerance, work, snap) = (self.integrator.tolerance, self.spent.work(), self.snap);
        IntegrationError::ToleranceNotMet {
            tolerance,
            reached,
            work,
            snap,
        }
    }
}
