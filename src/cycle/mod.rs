//! Periodic orbits and rotating waves, stable or unstable: their computation, their stability, and
//! their branches along a parameter.
//!
//! [`RotatingWaveSolver`] finds shapes that rotate rigidly about the vertical, [`PeriodicSolver`]
//! periodic orbits of any kind, and [`Continuation`] follows either along a parameter. Any law that
//! can be integrated in time can be used; it supplies nothing else. Method, accuracy and limits:
//! [`guide::cycles`](crate::guide::cycles).
//!
//! The terms are those of DDE-BIFTOOL and BifurcationKit. "Strain" means components 1 and 2 of the
//! intrinsic strain u* at the material points of the growth zone. "Slopes" are derivatives by time
//! multiplied by the length of an interval. The parts, from the bottom:
//!
//! | part | task |
//! |---|---|
//! | `map` | the return map x(0) ↦ x(T) by collocation in time, and its derivative, the monodromy operator |
//! | `harmonic` | periodic variables by harmonic balance, for rotating waves and for guesses from modes |
//! | `symmetry` | checks that a shoot is autonomous or periodic, and symmetric about its axis |
//! | `extended` | unknowns, phase conditions and bordered linear systems |
//! | `equations` | interface of the solver of a kind of orbit |
//! | `corrector` | Newton's method for any kind of orbit whose solver implements `Equations` |
//! | `spectrum` | leading eigenvalues of a linear map by Arnoldi's method |
//! | `periodic` | fixed points of the return map, and their Floquet multipliers |
//! | `rotating_wave` | relative equilibria in the corotating frame, and their characteristic roots |
//! | `continuation` | pseudo-arclength continuation with the secant as predictor, and bifurcations |
//!
//! Orbits of an upright shoot of constant length:
//!
//! ```
//! use std::f64::consts::PI;
//!
//! use morphorod::cycle::{Continuation, CycleError, PeriodicSolver, RotatingWaveSolver};
//! use morphorod::integrator::{Integrator, MethodOfSteps};
//! use morphorod::nalgebra::Vector3;
//! use morphorod::stability::{Linearisation, StabilityError, onset};
//! use morphorod::ShootParameters;
//!
//! let upright = |length: f64| {
//!     let parameters = ShootParameters { length, growth_time: 72e3, ..Default::default() };
//!     Ok::<_, StabilityError>(parameters.reduced().elements(4).build()?)
//! };
//! let family = |length: f64| Ok::<_, CycleError>(upright(length)?);
//! let mut shoot = family(0.067)?;
//! // Initial guess: the unstable mode of the upright shoot, with the tip 2 cm from the axis.
//! let root = Linearisation::about(&shoot)?.rightmost()?;
//! let wave = RotatingWaveSolver::default().from_mode(&shoot, &root, 0.02)?;
//! assert!((wave.radius() - 0.0305997760).abs() < 1e-9);
//! assert_eq!(wave.roots(&shoot, 2)?.unstable(), 0, "stable");
//!
//! let swing = PeriodicSolver::default().from_mode(&shoot, &root, 0.02)?;
//! assert!((swing.period / 60.0 - 87.661715).abs() < 1e-5);
//! assert_eq!(swing.multipliers(&shoot, 2)?.unstable(), 1, "unstable");
//!
//! // After half the period of a swing the shoot has rotated by π. This takes half the intervals.
//! let solver = PeriodicSolver { intervals: 8, angle: Some(PI), ..PeriodicSolver::default() };
//! let half = solver.from_mode(&shoot, &root, 0.02)?;
//! assert!((2.0 * half.period / swing.period - 1.0).abs() < 1e-8);
//!
//! // Initial guess from a simulation, here five hours after the shoot was bent.
//! shoot.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
//! MethodOfSteps::new(120.0).advance(&mut shoot, 18_000.0)?;
//! let again = PeriodicSolver::default().from_run(&shoot, 88.0 * 60.0)?;
//! assert!((again.period / swing.period - 1.0).abs() < 1e-6);
//!
//! // The branch of circles from the onset at 6.56 cm to 6.6 cm, first radius 1 cm.
//! let found = onset(|length| Linearisation::about(&upright(length)?), 0.065, 0.066)?;
//! let branch = Continuation::from_onset(RotatingWaveSolver::default(), family, &found, 0.01, 0.065..=0.066)?;
//! for point in branch.largest_step(0.2)? {
//!     let point = point?;
//!     assert_eq!(point.unstable(), 0, "{} m: the circle of {} m is stable", point.parameter, point.excursion);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
mod symmetry;

pub use continuation::{Bifurcation, BranchPoint, Continuation, OrbitSolver};
pub use disturbances::Disturbances;
pub use error::CycleError;
pub use periodic::{Multipliers, PeriodicOrbit, PeriodicSolver};
pub use rotating_wave::{RotatingWave, RotatingWaveSolver, WaveRoots};
pub use spectrum::Eigenvalue;
