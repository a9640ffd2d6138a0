//! The state of a shoot as it is written and read: with the number of its format, and checked when it is read.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{History, Plan, Predictor, State, StateError};
use crate::rod::Rod;

/// To be counted up whenever what is written changes.
pub(crate) const FORMAT: u32 = 8;

/// The number of the format: it stands first, so that a file of another format is refused for that reason.
#[derive(Debug, Clone, Copy)]
struct Format;

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        FORMAT.serialize(to)
    }
}

impl<'a> Deserialize<'a> for Format {
    fn deserialize<D: Deserializer<'a>>(from: D) -> Result<Self, D::Error> {
        match u32::deserialize(from)? {
            FORMAT => Ok(Self),
            found => Err(serde::de::Error::custom(StateError::Format { found, known: FORMAT })),
        }
    }
}

/// What is written of a [`State`].
#[derive(Serialize, Deserialize)]
pub(super) struct Saved {
    format: Format,
    time: f64,
    rod: Rod,
    predictor: Predictor,
    history: History,
    smooth_since: f64,
    changed: bool,
    merge_next: usize,
    plan: Option<Plan>,
}

impl From<State> for Saved {
    fn from(state: State) -> Self {
        let State { time, rod, predictor, history, smooth_since, changed, merge_next, plan } = state;
        Self { format: Format, time, rod, predictor, history, smooth_since, changed, merge_next, plan }
    }
}

impl TryFrom<Saved> for State {
    type Error = StateError;

    fn try_from(saved: Saved) -> Result<Self, StateError> {
        let Saved { format: Format, time, rod, predictor, history, smooth_since, changed, merge_next, plan } = saved;
        let state = Self { time, rod, predictor, history, smooth_since, changed, merge_next, plan };
        state.check()?;
        Ok(state)
    }
}
