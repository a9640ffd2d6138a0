//! Limit cycles that are found instead of waited for.

mod autonomous;
mod circular;
mod error;
mod fourier;
mod gmres;
mod grid;
mod march;
mod periodic;
mod point;
mod sensitivity;
mod turned;
mod turning_roots;
mod variation;

pub use circular::{CircularOrbit, CircularSolver, Turning};
pub use error::CycleError;
pub use periodic::{Multiplier, PeriodicOrbit, PeriodicSolver};
pub use turning_roots::{TurningRoot, TurningRoots};
