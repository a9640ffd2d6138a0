//! What the examples share: command line, tables, progress bar and figures.
//!
//! Nothing here knows the library: examples hand over plain numbers, so that
//! an example's own file shows only the use of the library.

// Every example compiles its own copy of this module and uses a part of it.
#![allow(dead_code, unused_imports)]

pub mod figure;
pub mod options;
pub mod progress;
pub mod table;

pub use figure::{Axes, Map, Series, Style, lines_figure, map_figure, panels_figure, path_figure, shapes_figure};
pub use options::{Opt, Options};
pub use progress::Progress;
pub use table::Table;

use std::error::Error;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
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

/// Replaces a file, or makes a new one: whenever the program is killed there is the old one or the new one, whole.
pub fn replace(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let named = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", file.display()));
    let mut new = file.as_os_str().to_owned();
    new.push(".new");
    let mut out = File::create(&new).map_err(named)?;
    out.write_all(bytes)?;
    out.sync_all()?;
    std::fs::rename(&new, file).map_err(named)
}
