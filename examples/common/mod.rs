//! Command line, tables, progress bar, figures and films of the examples.
//!
//! These modules do not depend on the library. Examples pass plain numbers to them, so that the
//! file of an example shows only the use of the library.

// Each example compiles its own copy of this module and uses only a part of it.
#![allow(dead_code, unused_imports)]

pub mod centre_lines;
pub mod figure;
pub mod file;
pub mod film;
pub mod options;
pub mod progress;
pub mod render;
pub mod table;
pub mod track_options;
pub mod tracks;

pub use figure::{
    Axes, FramedPanel, FramedShape, Map, Orbit, Series, Strip, Style, TimedPath, frames_figure, lines_figure,
    map_figure, orbits_figure, panels_figure, path_figure, shapes_figure, strips_figure,
};
pub use film::{Film, Frame};
pub use options::{Opt, Options};
pub use progress::Progress;
pub use render::{Station, VtkSeries, write_tube};
pub use table::Table;

use std::error::Error;
use std::process::ExitCode;

/// Returns the exit code of a program and prints the message of an error.
pub fn finish(outcome: Result<(), Box<dyn Error>>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
