//! Progress bar of a long run.

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
        let style = ProgressStyle::with_template(
            "{prefix} [{bar:40}] {percent:>3} % in {elapsed}, {eta} remaining",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
        let bar = ProgressBar::with_draw_target(Some(STEPS), target)
            .with_style(style)
            .with_prefix(label.to_string());
        Self { bar }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Sets the completed fraction, from 0 to 1. A smaller fraction than an earlier one has no
    /// effect.
    pub fn set(&self, fraction: f64) {
        let position = (fraction.clamp(0.0, 1.0) * STEPS as f64) as u64;
        self.bar.set_position(position.max(self.bar.position()));
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
