//! All tests of `morphorod`, in one program: what they share is compiled once, and slow tests run beside each other.

mod cycle;
mod fixtures;
mod laws;
mod project;
mod stability;
mod state;
mod statics;
mod time;
mod tracking;
