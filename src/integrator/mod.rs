//! Carries a shoot from one time to another, equilibrium included.

mod feedback;
mod guess;
mod iterated;
mod local;
mod mesh;
mod past;
mod start;
mod stepper;
mod steps;

pub use iterated::Iterated;

pub use past::{EmptyHistory, GivenHistory, Past, SteadyHistory};
pub use steps::MethodOfSteps;

use crate::equilibrium::EquilibriumError;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

/// What a run has cost, and how accurate its parts say they were.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Steps in time.
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
    /// Intervals that the variables of a point had to be halved into, a step of a point counting as one interval.
    pub halvings: usize,
    /// The largest error that an equilibrium was left with, rad.
    pub equilibrium_error: f64,
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
        self.halvings += other.halvings;
        self.equilibrium_error = self.equilibrium_error.max(other.equilibrium_error);
    }
}

/// Why a run stopped. The shoot is as it was before the call.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    /// The step is longer than what the laws look back, and this integrator reads only the past.
    #[error(
        "a step of {step} s is longer than the delay of {delay} s that the laws look back; \
             take a shorter step, or `Iterated`"
    )]
    StepTooLong {
        /// The step, s.
        step: f64,
        /// The shortest delay, s.
        delay: f64,
    },
    /// The corrections of a step did not come to rest.
    #[error(
        "the step to {time} s was not settled after {corrections} corrections: the last changed an angle by {change:.3e} rad"
    )]
    NotSettled {
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
    /// A law answered with something that is not a number.
    #[error("the {what} is not finite at {time} s")]
    NotFinite {
        /// What was not finite.
        what: &'static str,
        /// When, s.
        time: f64,
    },
}

impl IntegrationError {
    /// Whether a smaller step may succeed where this failed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Equilibrium { source, .. } => source.is_recoverable(),
            Self::StepTooLong { .. } | Self::NotSettled { .. } | Self::Variables { .. } => true,
            Self::Parameter(_) | Self::NotFinite { .. } => false,
        }
    }
}

/// Carries a shoot in time.
pub trait Integrator {
    /// Finds the first equilibrium of a shoot at t = 0 and gives its laws a past. A run that is not started so starts
    /// with [`EmptyHistory`]; starting again begins a new history at the present time.
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn start(&mut self, shoot: &mut Shoot<impl Model>, past: &impl Past) -> Result<Statistics, IntegrationError>;

    /// Carries the shoot exactly to time `until` (s), stepping onto every discontinuity that its laws announce.
    ///
    /// # Errors
    /// See [`IntegrationError`]; the shoot is then as it was.
    fn advance(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Result<Statistics, IntegrationError>;
}
