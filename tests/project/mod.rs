//! The project itself: its layers and its list of tests.

mod layers;
mod manifest;
