//! Tests of the project itself: layers of modules, lists of files, and the example `sweep` as a
//! program.

mod figures;
mod layers;
mod links;
mod manifest;
mod sweep;
