//! Periodic orbits and rotating waves, stable or not, with their stability, and their branches along a parameter.
//!
//! [`RotatingWaveSolver`] finds shapes that rotate rigidly about the vertical, [`PeriodicSolver`] periodic orbits of any kind.
//! [`Continuation`] follows either along a parameter. Any law that can be
//! stepped in time can be used; it supplies nothing else. Method, accuracy and limits: [`guide::cycles`](crate::guide::cycles).

mod autonomous;
mod axis;
mod continuation;
mod corrector;
mod disturbances;
mod equations;
mod error;
mod extended;
mod harmonic;
mod map;
mod periodic;
mod phase_grid;
mod rotated;
mod rotating_wave;
mod sensitivity;
mod spectrum;

pub use continuation::{Bifurcation, BranchPoint, Continuation, OrbitSolver};
pub use disturbances::Disturbances;
pub use error::CycleError;
pub use periodic::{Multiplier, Multipliers, OrbitHistory, PeriodicOrbit, PeriodicSolver};
pub use rotating_wave::{RotatingWave, RotatingWaveSolver, WaveGuess, WaveRoot, WaveRoots};
