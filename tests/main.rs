//! All tests of `morphorod` in one program. Shared code is compiled once, and slow tests run in
//! parallel.

mod cycle;
mod fit;
mod fixtures;
mod laws;
mod project;
mod stability;
mod state;
mod statics;
mod time;
mod tracking;
