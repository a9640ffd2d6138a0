//! Serialisation of states with the number of the format. Every state is checked when it is read.

use nalgebra::Vector3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{ContactState, FORMAT, History, Plan, Predictor, State, StateError};
use crate::rod::Rod;

/// Returns an error unless `found` is the number of this format.
pub(crate) fn check_format(found: u32) -> Result<(), StateError> {
    if found == FORMAT { Ok(()) } else { Err(StateError::Format { found }) }
}

/// Number of the format. It is the first field, so that data of another format are refused for that reason.
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

/// Serialised form of a [`State`].
#[derive(Serialize, Deserialize)]
pub(super) struct Saved {
    format: Format,
    time: f64,
    rod: Rod,
    predictor: Predictor,
    history: History,
    smooth_since: f64,
    gravity: Vector3<f64>,
    changed: bool,
    merge_next: usize,
    plan: Option<Plan>,
    contact: ContactState,
}

impl From<State> for Saved {
    fn from(state: State) -> Self {
        let State { time, rod, predictor, history, smooth_since, gravity, .. } = state;
        let State { changed, merge_next, plan, contact, .. } = state;
        let format = Format;
        Self { format, time, rod, predictor, history, smooth_since, gravity, changed, merge_next, plan, contact }
    }
}

impl TryFrom<Saved> for State {
    type Error = StateError;

    fn try_from(saved: Saved) -> Result<Self, StateError> {
        let Saved { time, rod, predictor, history, smooth_since, gravity, .. } = saved;
        let Saved { changed, merge_next, plan, contact, .. } = saved;
        let state = Self { time, rod, predictor, history, smooth_since, gravity, changed, merge_next, plan, contact };
        state.check()?;
        Ok(state)
    }
}
