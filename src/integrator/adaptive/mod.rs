//! Digits instead of steps: an integrator that is given a tolerance, and says how accurate its answer is.

mod cut;
mod estimate;
mod explore;
mod jumps;
mod rest;
mod track;

use super::course::{CORRECTIONS, Correction, Course, check_ahead};
use super::stepper::Stepper;
use super::stops::guarded;
use super::{EmptyHistory, HistoryFunction, IntegrationError, Integrator, Statistics};
use crate::equilibrium::NewtonSolver;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::{Mesh, Shoot};
use crate::state::Plan;
use track::Track;

/// The smallest tolerance: rounding alone, of positions that are sums over all elements, comes to a tenth of it.
const SMALLEST: f64 = 1e-12;
/// From here on it is no accuracy any more.
const LARGEST: f64 = 0.1;
/// Equilibria and corrections are found to this part of the tolerance: errors of single steps may add up.
const EQUILIBRIUM: f64 = 1e-3;
/// The largest error of an equilibrium that a run still follows, rad.
const LOOSEST_EQUILIBRIUM: f64 = 1e-7;
/// No equilibrium is more accurate than this: rounding, rad.
const TIGHTEST_EQUILIBRIUM: f64 = 1e-13;

/// An integrator that chooses steps, elements, merging and the accuracy of equilibria by itself, so that the shape keeps a
/// tolerance, and that estimates its error.
///
/// It goes through the time ahead several times: with few elements, with a few more, with half the steps, then with the
/// resolution that these differences ask for, and compares the last run with the one before. What a run costs is proportional to
/// its steps, so that the trials together cost about half of the answer. The method is that of
/// [`MethodOfSteps`](super::MethodOfSteps); where steps are longer than the shortest delay of the laws it is that of
/// [`Iterated`](super::Iterated), so that it takes laws of any delay. [`guide::accuracy`](crate::guide::accuracy) has the details.
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
/// # What the tolerance is about
/// The largest distance, at any time of the call, between the centre line and that of the same shoot without any error of
/// numerics, divided by the length. What a shoot holds when the call begins is taken as exact: a section is that which its
/// elements hold, and elements are cut but never joined once a run has started. [`Statistics::error`] is the estimate, of this
/// call and of those before it together; it includes a factor of two for safety. So the error of a run that calls `advance` every
/// hour may come to more than the tolerance: one call of [`advance_showing`](Integrator::advance_showing) shows the hours on its way,
/// and gives one estimate for all of them.
///
/// The estimate is of positions. That of an angle, or of a time that [`advance_until`](Integrator::advance_until) finds, is what
/// changes in it when the run is made again with a tenth of the tolerance.
///
/// [`advance`](Integrator::advance) holds its answer against the trial before it, and refines again if it has to. Calls
/// that stop on the way, as [`step`](Integrator::step) and all that is made of it, look ahead first, to the time that they are given,
/// and then go there by what they have chosen: the estimate is then an extrapolation from the trials. What was chosen is part of
/// the shoot's state. A later call to a later time looks ahead anew, from where the shoot is: few long calls cost less than many
/// short ones.
#[derive(Debug, Clone)]
pub struct Adaptive {
    /// Largest error of the shape, relative to the length: from 1e-12 to 0.1.
    pub tolerance: f64,
    /// Bound on the steps of a call, trials included.
    pub max_steps: usize,
    solver: NewtonSolver,
    stepper: Stepper,
    /// The last run and the one before it.
    tracks: [Track; 2],
}

impl Adaptive {
    /// Keeps the tolerance, relative to the length, in at most a million steps.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            max_steps: 1_000_000,
            solver: NewtonSolver::default(),
            stepper: Stepper::default(),
            tracks: Default::default(),
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        let ok = (SMALLEST..=LARGEST).contains(&self.tolerance);
        ParameterError::unless(ok, "tolerance", self.tolerance, "from 1e-12, the smallest that is possible, to 0.1")
    }

    /// The way through the time to `until` at a resolution.
    fn course(&mut self, shoot: &Shoot<impl Model>, resolution: &Plan, most_steps: usize) -> Course {
        let tolerance = of_equilibria(resolution.tolerance);
        self.solver.tolerance = tolerance;
        self.stepper.laws.read(shoot.model.tropism());
        let past_only = self.stepper.reads_past_alone(resolution.step);
        let correction = Correction { tolerance, most: CORRECTIONS };
        Course {
            until: resolution.until,
            size: resolution.step,
            most_steps,
            retries: 0,
            correction: if past_only { None } else { Some(correction) },
            mesh: Mesh { longest_element: resolution.longest_element, merge_tolerance: resolution.merge_tolerance },
            coarsest: resolution.coarsest,
        }
    }
}

/// How closely equilibria are found in a run for a tolerance, rad.
fn of_equilibria(tolerance: f64) -> f64 {
    (EQUILIBRIUM * tolerance).clamp(TIGHTEST_EQUILIBRIUM, LOOSEST_EQUILIBRIUM)
}

impl Integrator for Adaptive {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.check()?;
        guarded(shoot, |shoot, _| self.rest(shoot, history))
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        most_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        self.check()?;
        check_ahead("time to advance to", shoot, until)?;
        let started = shoot.state.history.levels() > 0;
        if until == shoot.time() && !started {
            return self.start(shoot, &EmptyHistory);
        }
        let planned = shoot
            .state
            .plan
            .filter(|plan| started && !shoot.state.changed && plan.tolerance == self.tolerance && until <= plan.until);
        let Some(plan) = planned else {
            return self.look_ahead(shoot, until, most_steps);
        };
        let course = Course { until, ..self.course(shoot, &plan, most_steps) };
        let statistics = self.stepper.advance(shoot, &mut self.solver, course)?;
        shoot.state.plan = Some(plan);
        Ok(Statistics { error: Some(plan.error), ..statistics })
    }
}
