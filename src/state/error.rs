//! Errors of states.

use super::FORMAT;
use crate::error::{ParameterError, debug_by_display};
use crate::rod::RodError;

/// Reason why a state is refused: it is damaged, or belongs to another shoot.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// The data were written by another version of this crate.
    #[error("the state has format {found}; this version reads format {FORMAT}")]
    Format {
        /// Number of the format of the data.
        found: u32,
    },
    /// A number of the state or a parameter of the laws is out of range, or two parts of the state
    /// do not have the same size.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The rod is damaged.
    #[error(transparent)]
    Rod(#[from] RodError),
    /// The state belongs to other laws.
    #[error(
        "the state has {} variables and {} stimuli at a point, but the laws of the shoot have {} and {}; \
         `with_model_restarted` gives a shoot such laws without a history",
        found.0, found.1, expected.0, expected.1
    )]
    Laws {
        /// Number of variables and number of stimuli at a material point of the state.
        found: (usize, usize),
        /// The same numbers of the shoot's laws.
        expected: (usize, usize),
    },
}

debug_by_display!(StateError);
