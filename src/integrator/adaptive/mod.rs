//! Integrator that chooses its steps and elements for a tolerance, and estimates its error.
//!
//! **The main loop is `Runs::choose` in `choice.rs`.** It makes runs from the state at the
//! beginning of the call, and estimates the error from the differences of two runs:
//!
//! ```text
//! Adaptive::advance_at_most (mod.rs)    follows the plan in the state if it is still valid, or
//! └─ Runs::choose (choice.rs)           chooses a new one:
//!    ├─ first_runs                      halves long steps until the runs show an order of convergence
//!    │  └─ compare                      errors of one plan:
//!    │     ├─ run, run                  1. step h and few elements; 2. step h/2 and shorter elements
//!    │     ├─ refine_elements           3. elements: runs with step h and shorter elements
//!    │     └─ refine_merging            4. merging: a run that merges less
//!    └─ loop                            5. steps: reduces them by the observed order, until the tolerance is met
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `runs` | a run as a value: its plan, statistics, final state and track |
//! | `space` | refinement of elements and merging by runs with equal steps |
//! | `richardson` | error and observed order from the differences of runs, ratio of the next refinement |
//! | `track` | positions of a shoot in a run, and the distance between two runs |
//! | `division` | division of a shoot into elements of a given length |
//! | `equilibrium_mesh` | elements for the equilibrium at the start of a run |
//! | `hidden_strain` | error of the intrinsic strain where a law is not smooth inside an element |
//! | `hidden_turns` | error of an equilibrium where the stiffness is not smooth inside an element |

mod choice;
mod division;
mod equilibrium_mesh;
mod hidden_strain;
mod hidden_turns;
mod richardson;
mod runs;
mod space;
mod track;

use std::ops::RangeInclusive;

use super::error::Outcome;
use super::stepper::{MAX_CORRECTIONS, Run, RunOptions, Stepper, check_ahead, shortest_period};
use super::undo::undo_on_error;
use super::{ConstantHistory, HistoryFunction, Integrator, Statistics};
use crate::equilibrium::{Equilibrium, NewtonSolver};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::{Mesh, Shoot};
use crate::state::{Plan, State};
use runs::Runs;

/// Permitted tolerances. The rounding of positions, which are sums over all elements, is a tenth of
/// the smallest one. With a tolerance above the largest one the first digit of a position may be
/// wrong.
const TOLERANCES: RangeInclusive<f64> = 1e-12..=0.1;
/// Ratio of the tolerance of equilibria and corrections (rad) to the tolerance of the shape. Errors
/// of single steps may accumulate.
const EQUILIBRIUM: f64 = 1e-2;
/// Smallest and largest tolerance of equilibria and corrections, rad: rounding, and the largest
/// error for which Newton's method still converges to the same branch of equilibria.
const EQUILIBRIUM_BOUNDS: [f64; 2] = [1e-13, 1e-7];

/// Integrator that chooses steps, elements, merging and the accuracy of equilibria so that the
/// error of the shape is below a tolerance, and that estimates this error.
///
/// It makes several runs over the time of a call with increasing resolution, and compares the last
/// one with the one before. All trial runs together usually have one to five times the steps of the
/// last run, most of them with fewer elements. The steps are those of
/// [`MethodOfSteps`](super::MethodOfSteps). [`guide::accuracy`](crate::guide::accuracy) describes
/// the runs.
///
/// ```
/// # use morphorod::{ShootParameters, Still};
/// use morphorod::integrator::{Adaptive, Integrator};
/// # let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
/// # let mut shoot = parameters.reduced().scene(Still::tilted(0.5)).build()?;
/// let cost = Adaptive::new(1e-5).advance(&mut shoot, 3600.0)?;
/// assert!(cost.error.is_some_and(|error| error <= 1e-5));
/// // Other settings are written as a struct literal.
/// let bounded = Adaptive { max_work: 100_000, ..Adaptive::new(1e-5) };
/// # let _ = bounded;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Tolerance
/// The tolerance bounds the distance between the centre line and that of the same shoot without
/// numerical errors, divided by the length, at all times of the call. The state at the beginning of
/// the call counts as exact. For example, a taper is that of the initial elements.
/// [`Statistics::error`] is the estimate for this call and the calls of `Adaptive` before it, since
/// the last change of the intrinsic strain or call of another integrator, with a safety factor of
/// two. The error of a run that calls `advance` every hour may therefore exceed the tolerance. One
/// call of [`advance_showing`](Integrator::advance_showing) has the same output times, with one
/// estimate for all of them.
///
/// The first trial runs continue for the longest delay after the call, because the delayed
/// variables at its end affect the shape until then. The laws and the scene are evaluated for these
/// times too, and the plan is valid for them: a later call within the delay makes no trial runs.
///
/// A law that jumps along the shoot, or is steep within an element, is found at the end of each
/// run, and its error is a part of the estimate. The estimate is too small for a law that jumps at
/// a material point of an elongating shoot, and for one that was steep only at earlier times.
///
/// The estimate is that of positions. To estimate the error of an angle, or of a time that
/// [`advance_until`](Integrator::advance_until) finds, make a second run with a tenth of the
/// tolerance.
///
/// [`advance`](Integrator::advance) compares its result with the trial run before it, and refines
/// further if necessary. Calls that stop before the given time, such as [`step`](Integrator::step)
/// and the methods that use it, first make trial runs to that time, and then use the plan that
/// follows from them. Their estimate is extrapolated from the trial runs. The plan is part of the
/// state. A call to a later time makes new trial runs from the present state: a few long calls cost
/// less than many short ones. Trial runs come before all outputs of a call except the first, at the
/// present time.
#[derive(Debug, Clone)]
pub struct Adaptive {
    /// Largest error of the shape as a distance relative to the length, from 1e-12 to 0.1.
    pub tolerance: f64,
    /// Largest [`work`](Statistics::work) of a call with its trial runs; one million by default,
    /// which takes minutes. A long run with a small tolerance may need more. It is checked after
    /// every equilibrium. In contact a unit of work may take milliseconds.
    /// [`advance_until`](Integrator::advance_until) and the methods with output times call the
    /// integrator once for each step, and the limit holds for each of these calls.
    pub max_work: usize,
    /// Memory that successive calls reuse; `..Adaptive::new(tolerance)` sets it.
    pub workspace: AdaptiveWorkspace,
}

/// Memory that successive calls of [`Adaptive`] reuse.
#[derive(Debug, Clone, Default)]
pub struct AdaptiveWorkspace {
    solver: NewtonSolver,
    stepper: Stepper,
    /// State before the call.
    backup: Option<State>,
}

impl AdaptiveWorkspace {
    /// The run of a shoot in this memory.
    fn run<'a, M>(&'a mut self, shoot: &'a mut Shoot<M>) -> Run<'a, M, NewtonSolver> {
        Run {
            stepper: &mut self.stepper,
            shoot,
            solver: &mut self.solver,
        }
    }
}

impl Adaptive {
    /// An integrator with a tolerance relative to the length.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            max_work: 1_000_000,
            workspace: AdaptiveWorkspace::default(),
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        let ok = TOLERANCES.contains(&self.tolerance);
        ParameterError::unless(
            ok,
            "tolerance",
            self.tolerance,
            "from 1e-12, which rounding permits, to 0.1",
        )
    }
}

/// Returns the options of a run by a plan to the time `until` (s), from an equilibrium if that is
/// `known`.
fn options_of(
    plan: &Plan,
    until: f64,
    [max_steps, max_work]: [usize; 2],
    known: Option<Equilibrium>,
) -> RunOptions {
    RunOptions {
        until,
        step: plan.step,
        max_steps,
        max_work,
        retries: 0,
        tolerance: tolerance_of_equilibria(plan.tolerance),
        max_corrections: MAX_CORRECTIONS,
        mesh: Mesh {
            longest_element: plan.longest_element,
            merge_tolerance: plan.merge_tolerance,
        },
        coarsest_step: Some(plan.coarsest_step),
        known,
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
    ) -> Outcome<Statistics> {
        self.check()?;
        undo_on_error(shoot, &mut None, |shoot, _| {
            self.start_on_refined_elements(shoot, history)
        })
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Outcome<Statistics> {
        self.check()?;
        check_ahead("time to advance to", shoot, until)?;
        shortest_period(shoot)?;
        let started = shoot.state.history.levels() > 0;
        if until == shoot.time() && !started {
            return self.start(shoot, &ConstantHistory::Empty);
        }
        let mut backup = self.workspace.backup.take();
        let outcome = undo_on_error(shoot, &mut backup, |shoot, start| {
            let valid = started && !start.changed;
            let usable =
                |plan: &Plan| valid && plan.tolerance == self.tolerance && until <= plan.until;
            let (plan, statistics) = match start.plan.filter(usable) {
                Some(plan) => {
                    let options = options_of(&plan, until, [max_steps, self.max_work], None);
                    self.workspace.solver.tolerance = options.tolerance;
                    (plan, self.workspace.run(shoot).advance(options, |_, _| ())?)
                }
                None => Runs::new(self, shoot, start).choose(until, max_steps)?,
            };
            shoot.state.plan = Some(plan);
            Ok(Statistics {
                error: Some(plan.error),
                ..statistics
            })
        });
        self.workspace.backup = backup;
        outcome
    }
}
