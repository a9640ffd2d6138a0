//! Carries a shoot from one time to another, equilibrium included.

mod adaptive;
mod begin;
mod collocation;
mod course;
mod elongation;
mod gradient_integral;
mod iterated;
mod memories;
mod mesh;
mod method_of_steps;
mod phases;
mod relaxation;
mod simulation;
mod step_size;
mod stepper;
mod stops;

pub use crate::state::{EmptyHistory, GivenHistory, HistoryFunction, SteadyHistory};
pub use adaptive::Adaptive;
pub use iterated::Iterated;
pub use method_of_steps::MethodOfSteps;
pub use simulation::Simulation;

use crate::equilibrium::{Equilibrium, EquilibriumError};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// The order in time. Stimuli are interpolated through so many levels, the variables are collocated at so many points, and
/// between levels they are cubic. Three levels would give a third order, five still the fourth of the cubic.
const ORDER: usize = 4;

/// What is said of a stimulus that is not finite.
const STIMULUS: &str = "stimulus of a tropism law (one that looks where it is must declare `with_position`)";

/// After a discontinuity the first step is this fraction of a full one, and the following ones double what has passed. Its
/// stimuli are interpolated through two levels only: an error of third order, in a step 64 times shorter.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// Growth may divide a step into so many parts, each of which leaves an element behind.
const MOST_PARTS: f64 = 1024.0;

/// What a run has cost, and how accurate its parts say they were.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Statistics {
    /// Steps in time; looks between them are none.
    pub steps: usize,
    /// Equilibria that were found.
    pub equilibria: usize,
    /// Newton iterations of all equilibria.
    pub iterations: usize,
    /// Factorisations of all equilibria.
    pub factorisations: usize,
    /// Evaluations of energy and gradient without a tangent.
    pub evaluations: usize,
    /// Elements that were cut in two.
    pub splits: usize,
    /// Pairs of elements that were merged.
    pub merges: usize,
    /// The smallest tolerance with which the same pairs would have been merged, rad.
    pub merging: f64,
    /// Intervals that the variables of a point had to be halved into, a step of a point counting as one interval.
    pub halvings: usize,
    /// Steps that failed and were tried again with half their length.
    pub retries: usize,
    /// Steps in which the shape lost its stability and went over to another one. Quasi-statics says nothing of the way; what laws
    /// remember is smooth across it.
    pub snaps: usize,
    /// When the last of them ended, s.
    pub last_snap: Option<f64>,
    /// The longest way of the tip in one of them, m.
    pub largest_jump: f64,
    /// Steps of trial runs, which only looked ahead. What they cost is in the other counts.
    pub trial_steps: usize,
    /// The largest error that an equilibrium was left with, rad.
    pub equilibrium_error: f64,
    /// The estimated largest error of the shape, as a distance relative to the length, where the integrator makes an estimate.
    pub error: Option<f64>,
}

impl std::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.equilibria += other.equilibria;
        self.iterations += other.iterations;
        self.factorisations += other.factorisations;
        self.evaluations += other.evaluations;
        self.splits += other.splits;
        self.merges += other.merges;
        self.merging = self.merging.max(other.merging);
        self.halvings += other.halvings;
        self.retries += other.retries;
        self.snaps += other.snaps;
        self.last_snap = other.last_snap.or(self.last_snap);
        self.largest_jump = self.largest_jump.max(other.largest_jump);
        self.trial_steps += other.trial_steps;
        self.equilibrium_error = self.equilibrium_error.max(other.equilibrium_error);
        // Estimates are of the run up to then.
        self.error = [self.error, other.error].into_iter().flatten().reduce(f64::max);
    }
}

impl Statistics {
    /// What a run costs that only looks ahead: it makes no step that stays.
    fn as_trial(self) -> Self {
        Self { trial_steps: self.trial_steps + self.steps, ..self.undone_since(Self::default()) }
    }

    /// The same costs, when all that was made since then is taken back.
    fn undone_since(self, then: Self) -> Self {
        let Self { steps, splits, merges, merging, snaps, last_snap, largest_jump, .. } = then;
        Self { steps, splits, merges, merging, snaps, last_snap, largest_jump, ..self }
    }
}

impl std::ops::AddAssign<Equilibrium> for Statistics {
    fn add_assign(&mut self, found: Equilibrium) {
        self.equilibria += 1;
        self.iterations += found.iterations;
        self.factorisations += found.factorisations;
        self.evaluations += found.evaluations;
        self.equilibrium_error = self.equilibrium_error.max(found.error);
    }
}

/// Why a run stopped. The shoot is as it was before the call.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationError {
    /// A setting makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No equilibrium was found.
    #[error("at {time} s: {source}")]
    Equilibrium {
        /// The time for which it was sought, s.
        time: f64,
        /// Why there is none.
        source: EquilibriumError,
    },
    /// The step is longer than the shortest delay of the laws, and this integrator reads only the past.
    #[error("{}", step_too_long(*step, *delay))]
    StepTooLong {
        /// The step, s.
        step: f64,
        /// The shortest delay, s.
        delay: f64,
    },
    /// The corrections of a step did not converge.
    #[error(
        "the step to {time} s did not converge in {corrections} corrections: the last changed an angle by {change:.3e} rad"
    )]
    NotConverged {
        /// The end of the step, s.
        time: f64,
        /// Corrections done.
        corrections: usize,
        /// What the last one changed, rad.
        change: f64,
    },
    /// The variables of a point could not be carried over the step.
    #[error("the variables of material point {point} cannot be carried to {time} s")]
    Variables {
        /// The end of the step, s.
        time: f64,
        /// The point, counted from the base.
        point: usize,
    },
    /// So much tissue leaves the growth zone in a step that it would be divided into more than 1024, each of which leaves an element
    /// behind.
    #[error(
        "from {time} s on a step of {step} s would leave more than {MOST_PARTS} elements behind: take a shorter one"
    )]
    GrowsTooFast {
        /// The time from which it was to be made, s.
        time: f64,
        /// The step, s.
        step: f64,
    },
    /// Tissue is stretched so unevenly within an element that its points no longer say where it is.
    #[error(
        "growth up to {time} s stretches some tissue of element {element} {ratio:.1} times as much as other, which its points do not \
         resolve: take more elements, or a shorter step"
    )]
    Uneven {
        /// The end of the step, s.
        time: f64,
        /// The element, counted from the base.
        element: usize,
        /// The largest length per coordinate at its points, by the least.
        ratio: f64,
    },
    /// A tolerance was not met in the steps that are allowed.
    #[error("the tolerance {tolerance:e} is not met: {}, after {steps} steps", reached_so_far(*reached))]
    ToleranceNotMet {
        /// The tolerance, relative to the length.
        tolerance: f64,
        /// The estimated error that was reached, relative to the length; infinite if there is no estimate yet.
        reached: f64,
        /// Steps made, trials included.
        steps: usize,
    },
    /// A condition did not hold by the latest time.
    #[error("the condition does not hold by {time} s; it is {value} then, and would hold at zero or above")]
    NotReached {
        /// The time that was reached, s.
        time: f64,
        /// The condition's value then.
        value: f64,
    },
    /// A law answered with something that is not a number.
    #[error("the {what} is not finite at {time} s")]
    NotFinite {
        /// What was not finite.
        what: &'static str,
        /// When, s.
        time: f64,
    },
}

fn step_too_long(step: f64, delay: f64) -> String {
    if delay == 0.0 {
        return "the laws answer without delay, and this integrator reads only the past; take `Iterated` or `Adaptive`"
            .to_owned();
    }
    format!(
        "a step of {step} s is longer than the shortest delay of the laws, {delay} s; take a shorter step, or `Iterated`"
    )
}

fn reached_so_far(error: f64) -> String {
    if error.is_finite() {
        return format!("the error reached is {error:.1e} of the length");
    }
    "there is no estimate of the error yet (advance in pieces, to an earlier time first)".to_owned()
}

impl IntegrationError {
    /// Whether a smaller step may succeed where this failed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Equilibrium { source, .. } => source.is_recoverable(),
            Self::StepTooLong { delay, .. } => *delay > 0.0,
            Self::NotConverged { .. } | Self::Variables { .. } | Self::GrowsTooFast { .. } | Self::Uneven { .. } => {
                true
            }
            Self::Parameter(_) | Self::NotFinite { .. } | Self::NotReached { .. } | Self::ToleranceNotMet { .. } => {
                false
            }
        }
    }
}

/// What a part of a run may end in.
type Outcome = Result<(), IntegrationError>;

/// Carries a shoot in time.
pub trait Integrator {
    /// Finds the equilibrium of a shoot at its present time and gives its laws a history. A run that is not started so
    /// starts with [`EmptyHistory`]; starting again begins a new history.
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError>;

    /// Carries the shoot exactly to time `until` (s), stepping onto every discontinuity that its laws announce. Laws are read
    /// a few units of rounding before and after one, never at it. A shoot that is carried to a discontinuity shows what
    /// follows it.
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn advance(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Result<Statistics, IntegrationError> {
        self.advance_at_most(shoot, until, usize::MAX)
    }

    /// The same, but stops after so many steps if the time is not reached by then.
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        most_steps: usize,
    ) -> Result<Statistics, IntegrationError>;

    /// Takes one step of those by which [`advance`](Self::advance) goes to time `until` (s): the way to see the shoot after every
    /// step. Where the shoot is at that time already there is no step.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// let mut integrator = MethodOfSteps::new(600.0);
    /// while shoot.time() < 7200.0 {
    ///     integrator.step(&mut shoot, 7200.0)?;
    ///     println!("{} s: {:?}", shoot.time(), shoot.tip());
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn step(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Result<Statistics, IntegrationError> {
        self.advance_at_most(shoot, until, 1)
    }

    /// Carries the shoot until a condition first holds, at the latest until the time `latest` (s). The condition is a function of
    /// the shoot that is negative before and zero or positive from then on; it is asked after every step, and where its sign has
    /// changed in a step the time of that is found by taking shorter ones. It should be continuous there. **What begins and
    /// ceases to hold within one step is not seen:** ask for a sign that stays, as of a component that passes through zero, or
    /// take steps that are short against what is looked for. An integrator by tolerance chooses its steps for all the time until
    /// `latest` before it goes: a `latest` soon after the event costs least.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// // Until it is 6 cm long, within ten days.
    /// MethodOfSteps::new(600.0).advance_until(&mut shoot, 864e3, |shoot| shoot.rod().length() - 0.06)?;
    /// assert!((shoot.time() - 72e3 * f64::ln(6.0 / 5.0)).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// A shoot that no longer moves: `|shoot| 1e-9 - shoot.steering_rate()`, in rad/s.
    ///
    /// # Errors
    /// [`NotReached`](IntegrationError::NotReached) if the condition does not hold by then, and all others; the shoot is then as it
    /// was. To keep where it came to, write a loop over [`step`](Self::step) instead.
    fn advance_until<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        latest: f64,
        condition: impl FnMut(&Shoot<M>) -> f64,
    ) -> Result<Statistics, IntegrationError>
    where
        Self: Sized,
    {
        stops::advance_until(self, shoot, latest, condition)
    }

    /// Carries the shoot to time `until` (s), and shows it at given times on the way, in increasing order, without shortening a step
    /// for them: integrators of fixed resolution take the same steps as in [`advance`](Self::advance). A look between two steps costs one further equilibrium, and
    /// does not count as a step.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// let minutes = (0..=60).map(|minute| 60.0 * f64::from(minute));
    /// let mut path = Vec::new();
    /// MethodOfSteps::new(600.0).advance_showing(&mut shoot, 3600.0, minutes, |shoot| path.push(shoot.tip()))?;
    /// assert_eq!(path.len(), 61);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A time that is not between the present, the time before it, and `until`, and all others; the shoot is then as it was.
    fn advance_showing<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        until: f64,
        times: impl IntoIterator<Item = f64>,
        show: impl FnMut(&Shoot<M>),
    ) -> Result<Statistics, IntegrationError>
    where
        Self: Sized,
    {
        stops::advance_showing(self, shoot, until, times, show)
    }
}
