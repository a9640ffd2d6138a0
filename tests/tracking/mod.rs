//! Analysis of measured and simulated tip tracks.

mod drift_and_windows;
mod error_bars;
mod orbit;
mod orbit_swelling;
mod outliers;
mod simulated_orbits;
mod swings;
mod tracked_files;
mod tracked_noise;
mod tracked_paths;
