//! What the examples share: command line, tables, progress bar and figures.
//!
//! Nothing here knows the library: examples hand over plain numbers, so that
//! an example's own file shows only the use of the library.

// Every example compiles its own copy of this module and uses a part of it.
#![allow(dead_code, unused_imports)]

pub mod centre_lines;
pub mod figure;
pub mod file;
pub mod film;
pub mod options;
pub mod progress;
pub mod render;
pub mod table;
pub mod tracks;

pub use figure::{
    Axes, FramedShape, Map, Orbit, Series, Strip, Style, TimedPath, frames_figure, lines_figure, map_figure,
    orbits_figure, panels_figure, path_figure, shapes_figure, strips_figure,
};
pub use film::{Film, Frame};
pub use options::{Opt, Options};
pub use progress::Progress;
pub use render::{Station, VtkSeries, write_tube};
pub use table::Table;

use std::error::Error;
use std::process::ExitCode;

/// Ends a program: an error is printed as its message, not as the compiler would write the value.
pub fn finish(outcome: Result<(), Box<dyn Error>>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
