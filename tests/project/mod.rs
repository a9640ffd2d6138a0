//! The project itself: its layers, its list of files, and the example `sweep` as a program.

mod layers;
mod manifest;
mod sweep;
