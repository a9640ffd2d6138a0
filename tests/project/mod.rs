//! Tests of the project itself: layers of modules, lists of files, and the example `sweep` as a program.

mod layers;
mod manifest;
mod sweep;
