//! Serialisation of states with the number of the format. Every state is checked when it is read.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{FORMAT, State, StateError};
use crate::rod::checked_when_read;

/// Returns an error unless `found` is the number of this format.
pub(crate) fn check_format(found: u32) -> Result<(), StateError> {
    if found == FORMAT { Ok(()) } else { Err(StateError::Format { found }) }
}

/// Number of the format. It is the first field, so that data of another format are refused for that reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Format;

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

checked_when_read!(State);
