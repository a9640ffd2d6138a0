//! Chapters of the documentation whose programs need dependencies of the tests. They are compiled and run from here.

/// Needs a format to write in.
#[doc = include_str!("../docs/saving.md")]
pub struct Saving;
