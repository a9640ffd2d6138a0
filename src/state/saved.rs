//! The state of a shoot as it is written and read: with the number of its format, and checked when it is read.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{History, Plan, Predictor, State, StateError};
use crate::rod::Rod;

/// Number of the format, to be increased whenever the written data change.
pub(crate) const FORMAT: u32 = 8;

/// Returns an error for the number of another format.
pub(crate) fn check_format(found: u32) -> Result<(), StateError> {
    if found == FORMAT { Ok(()) } else { Err(StateError::Format { found, known: FORMAT }) }
}

/// The number of the format. It is written first, so that data of another format are refused for that reason.
#[derive(Debug, Clone, Copy)]
struct Format;

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        FORMAT.serialize(to)
    }
}

impl<'a> Deserialize<'a> for Format {
    fn deserialize<D: Deserializer<'a>>(from: D) -> Result<Self, D::Error> {
        check_format(u32::deserialize(from)?).map_err(serde::de::Error::custom)?;
        Ok(Self)
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
