//! Analysis of measured and simulated tip tracks.

mod drift_and_windows;
mod error_bars;
mod growing_amplitude;
mod oscillations;
mod outliers;
mod simulated_tracks;
mod swings;
mod tracked_files;
mod tracked_mechanism;
mod tracked_noise;
mod tracked_paths;
