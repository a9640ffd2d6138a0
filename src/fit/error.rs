//! Errors of fits.

use crate::error::{Number, ParameterError, debug_by_display};
use crate::integrator::IntegrationError;

/// Reason why parameters cannot be estimated.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A setting of the fit, or a law of the shoot, is out of range.
    #[error(transparent)]
    Setting(#[from] ParameterError),
    /// A frame of the data is invalid.
    #[error("frame number {frame} of series {series} {problem}")]
    Frame {
        /// Index of the series, from 0.
        series: usize,
        /// Index of the frame in it, from 0.
        frame: usize,
        /// Description of the defect.
        problem: &'static str,
    },
    /// A series as a whole is invalid.
    #[error("series {series} {problem}")]
    Series {
        /// Index of the series, from 0.
        series: usize,
        /// Description of the defect.
        problem: &'static str,
    },
    /// The data have fewer residuals than there are unknowns.
    #[error(
        "the data have {coordinates} coordinates, which cannot determine the {parameters} unknowns (free parameters \
         and noise): add frames or fix parameters"
    )]
    Insufficient {
        /// Number of residuals: measured coordinates, without those along centre lines.
        coordinates: usize,
        /// Number of free parameters, and one more if the noise of any series is estimated.
        parameters: usize,
    },
    /// No free parameter has an effect on the data, which end within one time step.
    #[error(
        "no free parameter has an effect on the data, which end {:.4} s after the start of the shoot: are their times \
         in s, and do they reach beyond the delays of the laws?",
        Number(*duration)
    )]
    NoEffect {
        /// Time from the start of the shoot to the last frame, s.
        duration: f64,
    },
    /// The sizes of data and shoot differ by a factor that suggests a wrong unit.
    #[error(
        "series {series} extends to {:.4} m from the base, but the shoot at the initial values to {:.4} m: is the \
         unit of the data m, and that of their times s?",
        Number(*observed), Number(*modelled)
    )]
    Unit {
        /// Index of the series, from 0.
        series: usize,
        /// Largest distance of a point from the base in the data, m.
        observed: f64,
        /// Extent of the shoot at the initial values, m. For data that are too large, it is the
        /// length at the end of the data in the view. For data that are too small, it is that
        /// length, or the distance of the tip in the view.
        modelled: f64,
    },
    /// A parameter is invalid.
    #[error("parameter '{name}' {problem}")]
    Parameter {
        /// Name of the parameter.
        name: String,
        /// Description of the defect.
        problem: &'static str,
    },
    /// A series names a parameter that the family does not have.
    #[error("series {series} names a parameter '{name}', which the family does not have")]
    UnknownName {
        /// Index of the series, from 0.
        series: usize,
        /// Name that the family does not have.
        name: String,
    },
    /// The family returned an error.
    #[error("the family has no shoot for {}: {problem}", describe(values))]
    Family {
        /// Names and values of all parameters.
        values: Vec<(String, f64)>,
        /// Message of the family.
        problem: String,
    },
    /// A shoot of the family could not be advanced to the times of the data.
    #[error("the shoot for {} failed: {error}", describe(values))]
    Run {
        /// Names and values of all parameters.
        values: Vec<(String, f64)>,
        /// Error of the integrator.
        error: Box<IntegrationError>,
    },
    /// The work exceeds [`Fit::max_work`](super::Fit::max_work).
    #[error(
        "the simulations exceed the limit `max_work` of {limit} evaluations of the forces in an element. Each covers \
         {:.4} s, in which the shoot grows from {:.4} m to {:.4} m: are the times of the data and those of the laws \
         in s? If they are, increase the limit, or take fewer initial guesses or longer time steps",
        Number(*duration), Number(lengths[0]), Number(lengths[1])
    )]
    WorkLimit {
        /// The limit.
        limit: usize,
        /// Time from the start of the shoot to the last frame of a simulation, s.
        duration: f64,
        /// Lengths of the shoot at both times, m.
        lengths: [f64; 2],
    },
    /// Two fits cannot be compared.
    #[error("the fits have different data, noise or losses, so that they cannot be compared")]
    OtherData,
    /// The searches of a profile did not find an end of the interval.
    #[error(
        "{searches} searches did not find the end of an interval, and reached {}",
        describe(values)
    )]
    NoInterval {
        /// Number of searches for an end of the interval.
        searches: usize,
        /// Names and values of all parameters where the last search ended.
        values: Vec<(String, f64)>,
    },
}

debug_by_display!(FitError);

/// Returns an error, the text of the first condition that is true, if there is one.
pub(super) fn refuse(conditions: &[(bool, &'static str)]) -> Result<(), &'static str> {
    conditions
        .iter()
        .find(|(is_true, _)| *is_true)
        .map_or(Ok(()), |(_, problem)| Err(problem))
}

/// Names and values of parameters as text.
fn describe(values: &[(String, f64)]) -> String {
    values
        .iter()
        .map(|(name, value)| format!("{name} = {:.7}", Number(*value)))
        .collect::<Vec<_>>()
        .join(", ")
}
