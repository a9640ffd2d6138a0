//! Nothing but the chapters of the documentation whose programs need what only tests may: they are compiled and run from here.

/// Needs a format to write in.
#[doc = include_str!("../docs/saving.md")]
pub struct Saving;
