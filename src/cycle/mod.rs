//! Limit cycles that are found instead of waited for, stable or not, and how stable they are.
//!
//! [`CircularSolver`] finds shapes that turn rigidly about the vertical, [`PeriodicSolver`] swings of any kind. Any law that can be
//! stepped in time can be used; it supplies nothing else. Method, accuracy and limits: [`guide::cycles`](crate::guide::cycles).

mod autonomous;
mod axis;
mod branch;
mod circular;
mod error;
mod fourier;
mod map;
mod periodic;
mod point;
mod sensitivity;
mod spectrum;
mod turned;

pub use branch::{Branch, BranchPoint, Special};
pub use circular::{CircularOrbit, CircularSolver, Turning, TurningRoot, TurningRoots};
pub use error::CycleError;
pub use periodic::{Multiplier, Multipliers, OrbitHistory, PeriodicOrbit, PeriodicSolver};
