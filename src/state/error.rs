//! Why something cannot be the state of a shoot.

use crate::error::ParameterError;
use crate::rod::RodError;

/// A state that is damaged, or belongs to another shoot.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// A file of another version of this crate.
    #[error("the state is written in format {found}; this version reads format {known}")]
    Format {
        /// The format of the file.
        found: u32,
        /// The format that can be read.
        known: u32,
    },
    /// A parameter of the laws, or of what they ask of the state, makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The rod is damaged.
    #[error(transparent)]
    Rod(#[from] RodError),
    /// Lists that do not belong together.
    #[error("the state has {found} {what} but must have {expected}")]
    Size {
        /// What there are too many or too few of.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A number that cannot be.
    #[error("the {what} is {value} in the state but must be {requirement}")]
    Value {
        /// What it is.
        what: &'static str,
        /// The number.
        value: f64,
        /// What it must be, with its unit.
        requirement: &'static str,
    },
    /// A state of other laws.
    #[error(
        "the state keeps {variables} variables and {stimuli} stimuli at a point, \
             but the laws of the shoot have {own_variables} and {own_stimuli}; \
             `with_model_restarted` gives a shoot such laws without a history"
    )]
    Laws {
        /// Variables at a point of the state.
        variables: usize,
        /// Stimuli at a point of the state.
        stimuli: usize,
        /// Variables of the shoot's laws.
        own_variables: usize,
        /// Stimuli of the shoot's laws.
        own_stimuli: usize,
    },
}

impl StateError {
    /// Refuses a number unless `ok`.
    pub(super) fn unless(ok: bool, what: &'static str, value: f64, requirement: &'static str) -> Result<(), Self> {
        if ok { Ok(()) } else { Err(Self::Value { what, value, requirement }) }
    }

    /// Refuses a list that does not have the `expected` size.
    pub(super) fn size(what: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::Size { what, found, expected }) }
    }
}
