//! Checkpoints: a [`State`](crate::State), and other data of a program, as bytes with a checksum.
//!
//! Numbers are written exactly, infinities included. Reading returns an error for bytes that are damaged,
//! truncated, of another version or not a checkpoint. To replace a file safely, write the new one beside it and
//! rename it.
//!
//! ```
//! use morphorod::{Shoot, State, checkpoint, constitutive::LinearElastic};
//!
//! let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
//! let shoot = Shoot::builder(law).length(0.05).radius(5e-4).build()?;
//! let record = vec![(0.0, 0.05)];
//! let bytes = checkpoint::to_bytes(&(shoot.state(), &record))?;
//! let (state, read): (State, Vec<(f64, f64)>) = checkpoint::from_bytes(&bytes)?;
//! assert!(state == *shoot.state() && read == record);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::state::{FORMAT, StateError, check_format};

/// First bytes of a checkpoint.
const NAME: &[u8; 9] = b"morphorod";
/// Length of the header: the name, the format (4 bytes), the length of the content (8 bytes), and a checksum of
/// these two and the content (4 bytes). Numbers are little-endian.
const HEAD: usize = NAME.len() + 4 + 8 + 4;

/// Error of reading or writing a checkpoint.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The bytes are not a checkpoint.
    #[error("these bytes are not a checkpoint of morphorod")]
    Foreign,
    /// The checkpoint has another format.
    #[error(transparent)]
    State(#[from] StateError),
    /// The checkpoint is truncated, or followed by other bytes.
    #[error("the checkpoint has {found} bytes but was written with {written}")]
    Length {
        /// Number of bytes.
        found: u64,
        /// Number of bytes when it was written, or the least number if the header is truncated.
        written: u64,
    },
    /// The bytes have changed since they were written.
    #[error("the checkpoint is damaged: its checksum is {found:08x} but was {written:08x}")]
    Damaged {
        /// Checksum of the bytes.
        found: u32,
        /// Checksum when they were written.
        written: u32,
    },
    /// The content is not of the requested type, or cannot be written.
    #[error("the content of the checkpoint does not have the requested type: {0}")]
    Content(String),
}

/// Returns the checkpoint of a value, such as a state or a tuple of a state and other data.
///
/// # Errors
/// [`CheckpointError::Content`] for a value whose `Serialize` fails.
pub fn to_bytes(value: &impl Serialize) -> Result<Vec<u8>, CheckpointError> {
    let content = postcard::to_allocvec(value).map_err(|error| CheckpointError::Content(error.to_string()))?;
    let (format, length) = (FORMAT.to_le_bytes(), (content.len() as u64).to_le_bytes());
    let checksum = checksum(&format, &length, &content).to_le_bytes();
    Ok([NAME.as_slice(), &format, &length, &checksum, &content].concat())
}

/// Reads a value of the type that [`to_bytes`] has written.
///
/// # Errors
/// See [`CheckpointError`].
pub fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CheckpointError> {
    let rest = bytes.strip_prefix(NAME).ok_or(CheckpointError::Foreign)?;
    let found = bytes.len() as u64;
    let cut_short = CheckpointError::Length { found, written: HEAD as u64 };
    let (format, rest) = rest.split_first_chunk::<4>().ok_or(cut_short.clone())?;
    check_format(u32::from_le_bytes(*format))?;
    let (length, rest) = rest.split_first_chunk::<8>().ok_or(cut_short.clone())?;
    let (written, content) = rest.split_first_chunk::<4>().ok_or(cut_short)?;
    let whole = u64::from_le_bytes(*length).saturating_add(HEAD as u64);
    if whole != found {
        return Err(CheckpointError::Length { found, written: whole });
    }
    let (found, written) = (checksum(format, length, content), u32::from_le_bytes(*written));
    if found != written {
        return Err(CheckpointError::Damaged { found, written });
    }
    match postcard::take_from_bytes(content) {
        Ok((value, [])) => Ok(value),
        Ok((_, rest)) => Err(CheckpointError::Content(format!("{} bytes follow the content", rest.len()))),
        Err(error) => Err(CheckpointError::Content(error.to_string())),
    }
}

fn checksum(format: &[u8], length: &[u8], content: &[u8]) -> u32 {
    let mut sum = crc32fast::Hasher::new();
    [format, length, content].into_iter().for_each(|part| sum.update(part));
    sum.finalize()
}
