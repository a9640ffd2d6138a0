//! Progress bar over simulated time.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Number of steps of the bar. Small steps give a smooth estimate of the remaining time.
const STEPS: u64 = 10_000;

/// Progress bar on the terminal, hidden if stderr is not a terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Starts a bar with a label.
    pub fn new(label: &str) -> Self {
        // Repeated bars would fill the log of a batch run.
        let target = if std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let style = ProgressStyle::with_template("{prefix} [{bar:40}] {percent:>3} %, {eta} remaining")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> ");
        let bar = ProgressBar::with_draw_target(Some(STEPS), target).with_style(style).with_prefix(label.to_string());
        Self { bar }
    }

    /// Starts a line with a label that counts simulations, whose total number is unknown.
    pub fn counting(label: &str) -> Self {
        let progress = Self::new(label);
        if let Ok(style) = ProgressStyle::with_template("{prefix}: {pos} simulations in {elapsed}") {
            progress.bar.set_style(style);
        }
        progress
    }

    /// Counts a simulation.
    pub fn count(&self) {
        self.bar.inc(1);
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Sets the simulated fraction of the time, from 0 to 1.
    pub fn set(&self, fraction: f64) {
        self.bar.set_position((fraction.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// Hides the bar while `print` writes text.
    pub fn suspend<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }

    /// Replaces the bar by the total duration.
    pub fn finish(&self) {
        if let Ok(style) = ProgressStyle::with_template("{prefix}: finished in {elapsed}") {
            self.bar.set_style(style);
        }
        self.bar.finish();
    }
}
