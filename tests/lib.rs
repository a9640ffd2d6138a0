//! Chapters of the documentation whose programs need the dependencies of the tests. The programs
//! run as documentation tests of this crate.

/// Chapter on saving. Its programs need `serde_json`.
#[doc = include_str!("../docs/saving.md")]
pub struct Saving;
