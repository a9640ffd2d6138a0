//! Errors of the analysis of tip tracks.

use crate::error::{Number, ParameterError, debug_by_display};

/// Reason why a tip track cannot be analysed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackingError {
    /// A setting is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A time or a position is missing or invalid.
    #[error("position number {index} {problem}")]
    Position {
        /// Index of the position and its time, from 0.
        index: usize,
        /// Description of the defect.
        problem: &'static str,
    },
    /// The track is too short for the analysis, has too few positions, or they are too far apart.
    #[error("the {what} is {} but must be at least {}", Number(*value), Number(*needed))]
    Insufficient {
        /// Name of the quantity, with its unit.
        what: &'static str,
        /// Value of the quantity.
        value: f64,
        /// Smallest permitted value.
        needed: f64,
    },
}

debug_by_display!(TrackingError);

impl TrackingError {
    /// Returns an error unless a quantity has at least the needed value.
    pub(super) fn unless_at_least(needed: f64, what: &'static str, value: f64) -> Result<(), Self> {
        if value >= needed {
            Ok(())
        } else {
            Err(Self::Insufficient {
                what,
                value,
                needed,
            })
        }
    }

    /// Returns an error unless there are at least the needed number of positions.
    pub(super) fn unless_positions(needed: usize, positions: usize) -> Result<(), Self> {
        Self::unless_at_least(needed as f64, "number of positions", positions as f64)
    }
}
