//! The project itself: its layers, its manifest and the program `sweep`.

mod layers;
mod manifest;
mod sweep;
