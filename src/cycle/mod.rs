//! Limit cycles that are found instead of waited for, stable or not, and how stable they are.
//!
//! [`CircularSolver`] finds shapes that turn rigidly about the vertical, [`PeriodicSolver`] swings of any kind. Any law that can be
//! stepped in time can be used; it supplies nothing else. Method, accuracy and limits: [`guide::cycles`](crate::guide::cycles).

mod autonomous;
mod axis;
mod branch;
mod circular;
mod entry;
mod error;
mod exponents;
mod follow;
mod follow_circular;
mod follow_periodic;
mod forced;
mod fourier;
mod gmres;
mod grid;
mod march;
mod newton;
mod periodic;
mod periodic_solver;
mod plane;
mod point;
mod sensitivity;
mod special;
mod state;
mod swing;
mod turn;
mod turned;
mod turning_roots;
mod variation;

pub use branch::{Branch, BranchPoint};
pub use circular::{CircularOrbit, CircularSolver, Turning};
pub use entry::OrbitHistory;
pub use error::CycleError;
pub use exponents::Special;
pub use periodic_solver::PeriodicSolver;
pub use swing::{Multiplier, PeriodicOrbit};
pub use turning_roots::{TurningRoot, TurningRoots};
