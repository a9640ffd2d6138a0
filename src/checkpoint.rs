//! Checkpoints: a [`State`](crate::State), and other data that a program needs to resume, as bytes
//! with a checksum.
//!
//! All bits of the numbers are kept, also those of infinities. Bytes that are damaged, truncated,
//! foreign or of another version are refused with errors that distinguish these cases. To replace a
//! file safely, write a new file beside it and rename that.
//!
//! ```
//! use morphorod::{Shoot, State, checkpoint, constitutive::LinearElastic};
//!
//! let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
//! let shoot = Shoot::builder(law).length(0.05).radius(5e-4).build()?;
//! let notes = vec![(0.0, 0.05)];
//! let bytes = checkpoint::to_bytes(&(shoot.state(), &notes))?;
//! let (state, read): (State, Vec<(f64, f64)>) = checkpoint::from_bytes(&bytes)?;
//! assert!(state == *shoot.state() && read == notes);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::debug_by_display;
use crate::state::{FORMAT, StateError, check_format};

/// First bytes of a checkpoint.
const NAME: &[u8; 9] = b"morphorod";
/// Length of the header in bytes: the name, the format (4), the length of the content (8), and a
/// checksum of the format, the length and the content (4), all little-endian.
const HEADER: u64 = NAME.len() as u64 + 4 + 8 + 4;

/// Reason why bytes are not a valid checkpoint, or why data cannot be written as one.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The bytes do not begin with the name of this format.
    #[error("this is not a checkpoint of morphorod, which `checkpoint::to_bytes` writes")]
    Foreign,
    /// The checkpoint has another format.
    #[error(transparent)]
    State(#[from] StateError),
    /// The checkpoint is truncated, or followed by other bytes.
    #[error(
        "the checkpoint has {found} bytes but must have {expected}: it is truncated, or followed by other bytes"
    )]
    Length {
        /// Number of bytes.
        found: u64,
        /// Number of bytes that were written; if the header is truncated, the length of the header.
        expected: u64,
    },
    /// The content does not match its checksum.
    #[error(
        "the checkpoint is damaged: its content was changed after it was written, and does not match its checksum"
    )]
    Damaged,
    /// The content is valid, but of another type than the requested one, or the data cannot be
    /// serialised.
    #[error(
        "the checkpoint is intact, but its data are not of the requested type: read the type that was written ({0})"
    )]
    Content(String),
}

debug_by_display!(CheckpointError);

/// Serialises a value, such as a state, or a tuple of a state and other data.
///
/// # Errors
/// [`CheckpointError::Content`] if the value cannot be serialised.
pub fn to_bytes(value: &impl Serialize) -> Result<Vec<u8>, CheckpointError> {
    let content = postcard::to_allocvec(value)
        .map_err(|error| CheckpointError::Content(error.to_string()))?;
    let (format, length) = (FORMAT.to_le_bytes(), (content.len() as u64).to_le_bytes());
    let checksum = checksum(&format, &length, &content).to_le_bytes();
    Ok([NAME.as_slice(), &format, &length, &checksum, &content].concat())
}

/// Deserialises a value of the same type from the bytes that [`to_bytes`] has returned.
///
/// # Errors
/// Any [`CheckpointError`]. The variant indicates what is wrong with the bytes.
pub fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CheckpointError> {
    let rest = bytes.strip_prefix(NAME).ok_or(CheckpointError::Foreign)?;
    let found = bytes.len() as u64;
    let cut_short = CheckpointError::Length {
        found,
        expected: HEADER,
    };
    let (format, rest) = rest.split_first_chunk::<4>().ok_or(cut_short.clone())?;
    check_format(u32::from_le_bytes(*format))?;
    let (length, rest) = rest.split_first_chunk::<8>().ok_or(cut_short.clone())?;
    let (written, content) = rest.split_first_chunk::<4>().ok_or(cut_short)?;
    let expected = u64::from_le_bytes(*length).saturating_add(HEADER);
    if found != expected {
        return Err(CheckpointError::Length { found, expected });
    }
    if checksum(format, length, content) != u32::from_le_bytes(*written) {
        return Err(CheckpointError::Damaged);
    }
    match postcard::take_from_bytes(content) {
        Ok((value, [])) => Ok(value),
        Ok((_, rest)) => Err(CheckpointError::Content(format!(
            "{} more bytes follow",
            rest.len()
        ))),
        Err(error) => Err(CheckpointError::Content(error.to_string())),
    }
}

fn checksum(format: &[u8], length: &[u8], content: &[u8]) -> u32 {
    let mut sum = crc32fast::Hasher::new();
    [format, length, content]
        .into_iter()
        .for_each(|part| sum.update(part));
    sum.finalize()
}
