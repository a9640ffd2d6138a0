//! Standard output that may be closed or full.

use std::error::Error;
use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::process::ExitCode;
use std::sync::OnceLock;

/// First error of the standard output.
static FAILURE: OnceLock<std::io::Error> = OnceLock::new();

/// Prints a line like the macro of the standard library, which panics if the output is closed (`|
/// head -1`) or full. After an error nothing more is printed, and [`finish`](crate::finish) reports
/// it.
#[macro_export]
macro_rules! println {
    ($($text:tt)*) => { $crate::output::print_line(format_args!($($text)*)) };
}

/// Prints a line; the first error is kept.
#[doc(hidden)]
pub fn print_line(text: Arguments) {
    if FAILURE.get().is_none()
        && let Err(error) = writeln!(stdout(), "{text}")
    {
        let _ = FAILURE.set(error);
    }
}

/// Returns the exit code of a program and prints the message of an error. A closed output is no
/// error.
pub fn finish(outcome: Result<(), Box<dyn Error>>) -> ExitCode {
    let printed = || match FAILURE.get() {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(format!("the standard output: {error}").into())
        }
        _ => Ok(()),
    };
    match outcome.and_then(|()| printed()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}
