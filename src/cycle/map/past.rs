//! The past that a state of the return map contains.

use super::phase_state::PhaseState;
use crate::cycle::error::CycleError;
use crate::error::ParameterError;
use crate::tropism::{Declaration, TropismLaw};

/// The longest delay of the laws, s.
pub(super) fn longest_delay(laws: &Declaration) -> f64 {
    laws.variables().iter().filter_map(|variable| variable.delay).fold(0.0, f64::max)
}

/// Extends the past of a state if a delay of the laws is longer, for a period (s). Returns whether it did.
pub(crate) fn extend_past(
    law: &impl TropismLaw,
    start: &mut PhaseState,
    intervals: usize,
    period: f64,
) -> Result<bool, CycleError> {
    let (longest, own) = (longest_delay(&Declaration::of(law)), start.slopes.len());
    // Differences by the period change the delay by far less than a tenth of an interval.
    let short = longest * intervals as f64 / period + 0.1 > own as f64;
    if short {
        start.keep(own.max(kept(longest, intervals, period)?));
    }
    Ok(short)
}

/// Number of intervals of the past that contain the longest delay, with half an interval in reserve, since the
/// period is an unknown.
pub(super) fn kept(longest: f64, intervals: usize, period: f64) -> Result<usize, CycleError> {
    let (what, periods) = ("longest delay, in periods", longest / period);
    let requirement = "at most 16: check the unit of the period (s), since a state contains the past over the delay";
    ParameterError::unless(periods <= 16.0, what, periods, requirement)?;
    Ok(((longest * intervals as f64 / period + 0.5).ceil() as usize).max(1))
}
