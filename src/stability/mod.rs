//! When does a shoot begin to oscillate? Stationary shoots, their characteristic roots, and where these cross the axis.
//!
//! A shoot is *stationary* when it is in mechanical equilibrium and its laws ask for no change of the intrinsic strain:
//! [`StationarySolver`] finds such a state. [`Linearisation`] is the linear problem of small disturbances δu* exp(λt)
//! about it, with whatever laws the shoot was built from and with the delays entering exactly:
//!
//! ```text
//! M(λ) δu* = 0,   M(λ) = λ − T(λ) X,   T = REGR [G_y exp(−λd) (λ − F_y)⁻¹ F_x + G_x].
//! ```
//!
//! X turns a disturbance of the intrinsic strain into that of the stimuli, by way of the equilibrium; F are the laws' rates
//! and G their gradients. All derivatives are differences of the laws' own functions, unless a law offers its own; so one
//! written downstream is covered as it stands. [`onset`] finds where the rightmost root crosses the axis as a parameter
//! changes, [`crossings`] where any root does, and [`boundary`] follows a crossing in two parameters. Method, cost and
//! limits: `docs/stability.md`.

mod analytic;
mod block;
mod boundary;
mod count;
mod error;
mod follow;
mod linear;
mod linearisation;
mod modes;
mod onset;
mod roots;
mod short_waves;
mod spectrum;
mod stationary;
mod steady;
mod transfer;

pub use boundary::{BoundaryPoint, BoundarySettings, boundary};
pub use error::StabilityError;
pub use linearisation::{Linearisation, Unstable};
pub use modes::{Polarisation, Root};
pub use onset::{Onset, crossings, onset};
pub use stationary::{Stationary, StationarySolver};
