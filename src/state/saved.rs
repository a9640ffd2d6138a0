//! Serialisation of states with the number of the format. Every state is checked when it is read.

use serde::{Deserialize, Deserializer};

use super::{FORMAT, State, StateError};
use crate::rod::checked_when_read;

/// Returns an error unless `found` is the number of this format.
pub(crate) fn check_format(found: u32) -> Result<(), StateError> {
    if found == FORMAT {
        Ok(())
    } else {
        Err(StateError::Format { found })
    }
}

/// Reads the number of the format. It is the first field, so that data of another format are
/// refused for that reason.
pub(super) fn read_format<'a, D: Deserializer<'a>>(from: D) -> Result<u32, D::Error> {
    let found = u32::deserialize(from)?;
    check_format(found).map_err(serde::de::Error::custom)?;
    Ok(found)
}

checked_when_read!(State);
