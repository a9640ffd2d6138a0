//! Steady states of shoots, their characteristic roots, and the parameters at which roots cross the
//! imaginary axis.
//!
//! A shoot is in a *steady state* when it is in mechanical equilibrium and the gradients of its
//! laws vanish; [`solve_steady_state`] finds such a state. [`Linearisation`] describes small
//! disturbances δu* exp(λt) of it by the characteristic matrix M(λ), for any laws, with exact
//! delays:
//!
//! ```text
//! M(λ) δu* = 0,   M(λ) = λ − T(λ) X,   T = REGR [G_y exp(−λd) (λ − F_y)⁻¹ F_x + G_x].
//! ```
//!
//! X is the derivative of the stimuli in equilibrium with respect to the intrinsic strain, F are
//! the rates of the laws and G their gradients. Derivatives are differences of the laws' own
//! functions, so that user-defined laws need nothing else. Unstable roots are counted by the
//! argument principle. [`onset`] finds the value of a parameter at which the rightmost root crosses
//! the axis, [`crossings`] those at which any root does, and [`boundary`] follows a crossing in two
//! parameters. [`Refinement`] does the same by mesh refinement to a tolerance; `with_error`
//! estimates the error of a given mesh. Method, cost and limits:
//! [`guide::stability`](crate::guide::stability).
//!
//! The length at which an upright shoot begins to oscillate, and the period:
//!
//! ```
//! use morphorod::ShootParameters;
//! use morphorod::stability::{Linearisation, StabilityError, onset, solve_steady_state};
//!
//! // The linearisation of a shoot of a length (m). Its waves need more elements the longer it is.
//! let family = |length: f64| -> Result<Linearisation, StabilityError> {
//!     let parameters = ShootParameters { length, growth_time: 72e3, ..Default::default() };
//!     let mut shoot = parameters.reduced().elements(4).build()?;
//!     solve_steady_state(&mut shoot)?;
//!     Linearisation::about(&shoot)
//! };
//! assert_eq!(family(0.06)?.unstable()?, 0);
//! let found = onset(family, 0.06, 0.07)?;
//! assert!((found.parameters[0] - 0.065614866).abs() < 1e-9, "m");
//! assert!((found.period() / 60.0 - 87.638359).abs() < 1e-5, "min");
//! let leading = family(0.067)?.rightmost()?;
//! assert!(leading.growth_rate() > 0.0 && leading.period() < 90.0 * 60.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod continuation;
mod spectrum;

pub use continuation::{BoundarySettings, Crossing, Refinement, boundary, crossings, onset};
pub use spectrum::{ForcedResponse, Linearisation, Root, solve_steady_state};

pub use crate::linearisation::StabilityError;
