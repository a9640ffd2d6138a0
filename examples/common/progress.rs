//! A progress bar over simulated time.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of the bar; fine enough for a smooth estimate of the time left.
const STEPS: u64 = 10_000;

/// A progress bar on the terminal, silent when stderr is not one.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Starts a bar with `label` before it.
    pub fn new(label: &str) -> Self {
        // Logs of a batch run would fill with redrawn bars otherwise.
        let target = if std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let style = ProgressStyle::with_template("{prefix} [{bar:40}] {percent:>3} %, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> ");
        let bar = ProgressBar::with_draw_target(Some(STEPS), target).with_style(style).with_prefix(label.to_string());
        Self { bar }
    }

    /// Shows the fraction (0 to 1) of the simulated time that is done.
    pub fn set(&self, fraction: f64) {
        self.bar.set_position((fraction.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// Runs `print` with the bar out of the way, for a line of text meanwhile.
    pub fn suspend<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }

    /// Ends the bar, leaving the line with its total duration.
    pub fn finish(&self) {
        if let Ok(style) = ProgressStyle::with_template("{prefix} done in {elapsed}") {
            self.bar.set_style(style);
        }
        self.bar.finish();
    }
}
