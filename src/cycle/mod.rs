//! Limit cycles that are found instead of waited for, stable or not, and how stable they are.
//!
//! [`CircularSolver`] finds shapes that turn rigidly about the vertical, [`PeriodicSolver`] swings of any kind. Any law that can be
//! stepped in time can be used; it supplies nothing else. Method, accuracy and limits: [`guide::cycles`](crate::guide::cycles).

mod autonomous;
mod axis;
mod continuation;
mod corrector;
mod disturbances;
mod equations;
mod error;
mod extended;
mod fourier;
mod gmres;
mod map;
mod periodic;
mod point;
mod rotating_wave;
mod sensitivity;
mod spectrum;
mod turned;

pub use continuation::{Branch, BranchPoint, OrbitSolver, Special};
pub use disturbances::Disturbances;
pub use error::CycleError;
pub use periodic::{Multiplier, Multipliers, OrbitHistory, PeriodicOrbit, PeriodicSolver};
pub use rotating_wave::{CircularOrbit, CircularSolver, Turning, TurningRoot, TurningRoots};
