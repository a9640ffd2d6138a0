//! Analysis of measured and simulated tip tracks.

mod drift_and_windows;
mod orbit;
mod orbit_swelling;
mod simulated_orbits;
mod tracked_files;
mod tracked_noise;
mod tracked_paths;
