//! Errors of integrators.

use super::MAX_PARTS;
use crate::equilibrium::EquilibriumError;
use crate::error::ParameterError;

/// Reason why a call of an integrator failed. The shoot is as it was before the call.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationError {
    /// A parameter or setting is invalid.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No equilibrium was found.
    #[error("at {time} s: {source}")]
    Equilibrium {
        /// Time of the equilibrium, s.
        time: f64,
        /// Error of the equilibrium solver.
        source: EquilibriumError,
    },
    /// The corrections of a step did not converge.
    #[error(
        "the step to {time} s did not converge in {corrections} corrections: the last changed an angle by {change:.3e} rad"
    )]
    NotConverged {
        /// End of the step, s.
        time: f64,
        /// Number of corrections.
        corrections: usize,
        /// Largest change of an angle in the last correction, rad.
        change: f64,
    },
    /// The laws' variables of a point could not be integrated over the step.
    #[error("the variables of material point {point} cannot be integrated to {time} s")]
    Variables {
        /// End of the step, s.
        time: f64,
        /// Index of the point, counted from the base.
        point: usize,
    },
    /// The tissue that leaves the growth zone in a step would be divided into more than 1024 elements.
    #[error(
        "from {time} s on a step of {step} s would leave more than {MAX_PARTS} elements behind: take a shorter one"
    )]
    GrowsTooFast {
        /// Start of the step, s.
        time: f64,
        /// Length of the step, s.
        step: f64,
    },
    /// Tissue is stretched so unevenly within an element that its Gauss points do not resolve it.
    #[error(
        "growth up to {time} s stretches some tissue of element {element} {ratio:.1} times as much as other, which its points do not \
         resolve: take more elements, or a shorter step"
    )]
    Uneven {
        /// End of the step, s.
        time: f64,
        /// Index of the element, counted from the base.
        element: usize,
        /// Largest length per coordinate at its points over the smallest.
        ratio: f64,
    },
    /// The tolerance was not met within the permitted number of steps.
    #[error("the tolerance {tolerance:e} is not met: {}, after {steps} steps", describe_estimate(*reached))]
    ToleranceNotMet {
        /// Tolerance, relative to the length.
        tolerance: f64,
        /// Estimated error that was reached, relative to the length; infinite if there is no estimate yet.
        reached: f64,
        /// Number of steps, trial runs included.
        steps: usize,
    },
    /// A condition did not hold by the latest time.
    #[error("the condition does not hold by {time} s; it is {value} then, and would hold at zero or above")]
    NotReached {
        /// Time that was reached, s.
        time: f64,
        /// Value of the condition at that time.
        value: f64,
    },
    /// A law returned a value that is not finite.
    #[error("the {what} is not finite at {time} s")]
    NotFinite {
        /// Name of the value.
        what: &'static str,
        /// Time, s.
        time: f64,
    },
}

fn describe_estimate(error: f64) -> String {
    if error.is_finite() {
        return format!("the error reached is {error:.1e} of the length");
    }
    "there is no estimate of the error yet (advance in pieces, to an earlier time first)".to_owned()
}

impl IntegrationError {
    /// Returns whether a shorter step may succeed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Equilibrium { source, .. } => source.is_recoverable(),
            Self::NotConverged { .. } | Self::Variables { .. } | Self::GrowsTooFast { .. } | Self::Uneven { .. } => {
                true
            }
            Self::Parameter(_) | Self::NotFinite { .. } | Self::NotReached { .. } | Self::ToleranceNotMet { .. } => {
                false
            }
        }
    }
}
