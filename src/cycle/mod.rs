//! Periodic orbits and rotating waves, stable or unstable: their computation, their stability, and their branches
//! along a parameter.
//!
//! [`RotatingWaveSolver`] finds shapes that rotate rigidly about the vertical, [`PeriodicSolver`] periodic orbits
//! of any kind, and [`Continuation`] follows either along a parameter. Any law that can be integrated in time can
//! be used; it supplies nothing else. Method, accuracy and limits: [`guide::cycles`](crate::guide::cycles).
//!
//! The terms are those of DDE-BIFTOOL and BifurcationKit. "Strain" means components 1 and 2 of the intrinsic strain
//! u* at the material points of the growth zone. "Slopes" are derivatives by time multiplied by the length of an
//! interval. The parts, from the bottom:
//!
//! | part | task |
//! |---|---|
//! | `map` | the return map x(0) ↦ x(T) by collocation in time, and its derivative, the monodromy operator |
//! | `harmonic` | periodic variables by harmonic balance, for rotating waves and for guesses from modes |
//! | `symmetry` | checks that a shoot is autonomous or periodic, and symmetric about its axis |
//! | `extended` | unknowns, phase conditions and bordered linear systems |
//! | `corrector` | Newton's method for any kind of orbit that implements `Equations` |
//! | `periodic` | fixed points of the return map, and their Floquet multipliers |
//! | `rotating_wave` | relative equilibria in the corotating frame, and their characteristic roots |
//! | `continuation` | pseudo-arclength continuation with the secant as predictor, and bifurcations |

mod continuation;
mod corrector;
mod disturbances;
mod equations;
mod error;
mod extended;
mod harmonic;
mod map;
mod maximum;
mod periodic;
mod phase_grid;
mod rotated;
mod rotating_wave;
mod sensitivity;
mod spectrum;
mod symmetry;

pub use continuation::{Bifurcation, BranchPoint, Continuation, OrbitSolver};
pub use disturbances::Disturbances;
pub use error::CycleError;
pub use periodic::{Multipliers, PeriodicOrbit, PeriodicSolver};
pub use rotating_wave::{RotatingWave, RotatingWaveSolver, WaveRoots};
pub use spectrum::Eigenvalue;
