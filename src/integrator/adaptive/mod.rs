//! An integrator that chooses its steps and elements for a tolerance, and estimates its error.
//!
//! `choice` has the choice of the resolution, by the runs of `trials` and the estimates of `richardson`; `equilibrium_mesh` has the choice of
//! elements for an equilibrium.

mod choice;
mod elements;
mod equilibrium_mesh;
mod hidden_turns;
mod richardson;
mod track;
mod trials;

use std::ops::RangeInclusive;

use super::stepper::{MAX_CORRECTIONS, RunOptions, StepEnd, Stepper, check_ahead};
use super::undo::undo_on_error;
use super::{EmptyHistory, HistoryFunction, IntegrationError, Integrator, Statistics};
use crate::equilibrium::NewtonSolver;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::{Mesh, Shoot};
use crate::state::{Plan, State};
use trials::Trials;

/// Tolerances: rounding of positions, which are sums over all elements, is a tenth of the smallest. Above the largest the shape has
/// no correct digit.
const TOLERANCES: RangeInclusive<f64> = 1e-12..=0.1;
/// Tolerance of equilibria and corrections, rad, over the tolerance of the shape: errors of single steps may add up.
const EQUILIBRIUM: f64 = 1e-3;
/// Bounds on the tolerance of equilibria and corrections, rad: rounding, and the largest error with which Newton's method still follows
/// a branch of equilibria.
const EQUILIBRIUM_BOUNDS: [f64; 2] = [1e-13, 1e-7];

/// An integrator that chooses steps, elements, merging and the accuracy of equilibria, so that the error of the shape is below a
/// tolerance, and that estimates this error.
///
/// It makes several runs through the time ahead: with few elements, with more, with less merging, with half the steps, and then with the resolution that
/// follows from the differences of these runs. It compares the last run with the one before. The trial runs together have
/// between a third of the steps of the last run and twice as many. The method is that of
/// [`MethodOfSteps`](super::MethodOfSteps). [`guide::accuracy`](crate::guide::accuracy) has the details.
///
/// ```
/// # use morphorod::{Shoot, constitutive::LinearElastic, growth::{Ongoing, UniformGrowth}, load::Weight, Still};
/// # use morphorod::tropism::{Memory, Proprioception, Response, Gravitropism, SettledStatoliths};
/// use morphorod::integrator::{Adaptive, Integrator};
/// # let memory = Memory { time: 720.0, delay: 720.0 };
/// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
/// #     .length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 }))
/// #     .tropism((Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }.remembered(memory),
/// #         Proprioception { sensitivity: 20.0 }.remembered(memory)))
/// #     .scene(Still::tilted(0.5)).load(Weight { density: 1000.0 }).build()?;
/// let cost = Adaptive::new(1e-5).advance(&mut shoot, 3600.0)?;
/// assert!(cost.error.is_some_and(|error| error <= 1e-5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Tolerance
/// The tolerance bounds the largest distance, at any time of the call, between the centre line and that of the same shoot without
/// numerical errors, divided by the length. The state at the beginning of the call is taken as exact: a section is that which the
/// elements store, and elements are cut but never merged without loss once a run has started. [`Statistics::error`] is the estimate for
/// this call and those before it together, with a safety factor of two. The error of a run that calls `advance` every hour may therefore
/// exceed the tolerance. One call of [`advance_showing`](Integrator::advance_showing) shows the same hours with one estimate for
/// all of them.
///
/// The estimate is of positions. The error of an angle, or of a time that [`advance_until`](Integrator::advance_until) finds, can be
/// estimated by a second run with a tenth of the tolerance.
///
/// [`advance`](Integrator::advance) compares its answer with the trial before it, and refines further if necessary. Calls that stop
/// on the way, such as [`step`](Integrator::step) and the methods that use it, first make trial runs to the given time, and then use the
/// chosen resolution. Their estimate is extrapolated from the trials. The chosen resolution is part of the state. A later call to a later
/// time makes new trials from the present state: few long calls cost less than many short ones.
#[derive(Debug, Clone)]
pub struct Adaptive {
    /// Largest error of the shape, relative to the length: from 1e-12 to 0.1.
    pub tolerance: f64,
    /// Largest number of steps in a call, trial runs included.
    pub max_steps: usize,
    solver: NewtonSolver,
    stepper: Stepper,
    backup: Option<State>,
}

impl Adaptive {
    /// An integrator with a tolerance relative to the length, and at most a million steps in a call.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        let (solver, stepper) = (NewtonSolver::default(), Stepper::default());
        Self { tolerance, max_steps: 1_000_000, solver, stepper, backup: None }
    }

    fn check(&self) -> Result<(), ParameterError> {
        let ok = TOLERANCES.contains(&self.tolerance);
        ParameterError::unless(ok, "tolerance", self.tolerance, "from 1e-12, the smallest that is possible, to 0.1")
    }

    /// Advances the shoot with the resolution of a plan.
    fn follow<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        plan: &Plan,
        until: f64,
        max_steps: usize,
        observe: impl FnMut(&Shoot<M>, Option<StepEnd>),
    ) -> Result<Statistics, IntegrationError> {
        let tolerance = tolerance_of_equilibria(plan.tolerance);
        self.solver.tolerance = tolerance;
        let options = RunOptions {
            until,
            step: plan.step,
            max_steps,
            retries: 0,
            tolerance,
            max_corrections: MAX_CORRECTIONS,
            mesh: Mesh { longest_element: plan.longest_element, merge_tolerance: plan.merge_tolerance },
            coarsest_step: Some(plan.coarsest_step),
        };
        self.stepper.advance(shoot, &mut self.solver, options, observe)
    }

    /// Calls `work`. If it fails, the shoot returns to its state before.
    fn undo_on_error<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        work: impl FnOnce(&mut Self, &mut Shoot<M>, &State) -> Result<Statistics, IntegrationError>,
    ) -> Result<Statistics, IntegrationError> {
        let mut backup = self.backup.take();
        let answer = undo_on_error(shoot, &mut backup, |shoot, before| work(self, shoot, before));
        self.backup = backup;
        answer
    }
}

/// Returns the tolerance of equilibria and corrections in a run with a tolerance, rad.
fn tolerance_of_equilibria(tolerance: f64) -> f64 {
    let [smallest, largest] = EQUILIBRIUM_BOUNDS;
    (EQUILIBRIUM * tolerance).clamp(smallest, largest)
}

impl Integrator for Adaptive {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.check()?;
        self.undo_on_error(shoot, |integrator, shoot, _| integrator.start_on_refined_elements(shoot, history))
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        self.check()?;
        check_ahead("time to advance to", shoot, until)?;
        let started = shoot.state.history.levels() > 0;
        if until == shoot.time() && !started {
            return self.start(shoot, &EmptyHistory);
        }
        self.undo_on_error(shoot, |integrator, shoot, start| {
            let valid = started && !start.changed;
            let usable = |plan: &Plan| valid && plan.tolerance == integrator.tolerance && until <= plan.until;
            let (plan, statistics) = match start.plan().filter(usable) {
                Some(plan) => (plan, integrator.follow(shoot, &plan, until, max_steps, |_, _| ())?),
                None => Trials::new(integrator, shoot, start).choose(until, max_steps)?,
            };
            shoot.state.plan = Some(Plan { reached: shoot.time(), ..plan });
            Ok(Statistics { error: Some(plan.error), ..statistics })
        })
    }
}
