//! Checkpoints: a [`State`](crate::State), with whatever else a program needs to go on, as bytes that can be trusted.
//!
//! Every bit of a number is kept, infinities included. Bytes that are damaged, cut short, foreign or of another version are refused
//! with an error that says which. A file is best replaced whole: written beside the old one, and renamed.
//!
//! ```
//! use morphorod::{Shoot, State, checkpoint, constitutive::LinearElastic};
//!
//! let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 }).length(0.05).radius(5e-4).build()?;
//! let notes = vec![(0.0, 0.05)];
//! let bytes = checkpoint::to_bytes(&(shoot.state(), &notes))?;
//! let (state, read): (State, Vec<(f64, f64)>) = checkpoint::from_bytes(&bytes)?;
//! assert!(state == *shoot.state() && read == notes);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::state::{FORMAT, StateError, check_format};

/// What the bytes begin with.
const NAME: &[u8; 9] = b"morphorod";
/// Behind the name: the format (4 bytes), the length of the content (8), a checksum of these two and the content (4), all with the
/// lowest byte first.
const HEAD: usize = NAME.len() + 4 + 8 + 4;

/// Bytes that are no checkpoint that this version can read, or something that cannot be made one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Something else.
    #[error("this is no checkpoint of morphorod")]
    Foreign,
    /// The checkpoint has another format.
    #[error(transparent)]
    State(#[from] StateError),
    /// Cut short, or with something behind its end.
    #[error("the checkpoint has {found} bytes but was written with {written}")]
    Length {
        /// How many there are.
        found: u64,
        /// How many there were, or must be at least where the end of the length itself is missing.
        written: u64,
    },
    /// A bit is not as it was.
    #[error("the checkpoint is damaged: its checksum is {found:08x} but was {written:08x}")]
    Damaged {
        /// The checksum of what is there.
        found: u32,
        /// The checksum of what was written.
        written: u32,
    },
    /// Sound bytes of something else than what was asked for, or something that has no such form.
    #[error("the checkpoint holds something else: {0}")]
    Content(String),
}

/// Writes anything: a state, or a tuple of a state and other things.
///
/// # Errors
/// [`CheckpointError::Content`] if it says itself that it cannot be written.
pub fn to_bytes(value: &impl Serialize) -> Result<Vec<u8>, CheckpointError> {
    let content = postcard::to_allocvec(value).map_err(|error| CheckpointError::Content(error.to_string()))?;
    let (format, length) = (FORMAT.to_le_bytes(), (content.len() as u64).to_le_bytes());
    let checksum = checksum(&format, &length, &content).to_le_bytes();
    Ok([NAME.as_slice(), &format, &length, &checksum, &content].concat())
}

/// Reads what [`to_bytes`] has written, as the same type.
///
/// # Errors
/// What is wrong with the bytes.
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
        Ok((_, rest)) => Err(CheckpointError::Content(format!("{} bytes are left over", rest.len()))),
        Err(error) => Err(CheckpointError::Content(error.to_string())),
    }
}

fn checksum(format: &[u8], length: &[u8], content: &[u8]) -> u32 {
    let mut sum = crc32fast::Hasher::new();
    [format, length, content].into_iter().for_each(|part| sum.update(part));
    sum.finalize()
}
