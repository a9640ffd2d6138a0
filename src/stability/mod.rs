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

mod blocks;
mod boundary;
mod characteristic;
mod count;
mod linear;
mod modes;
mod onset;
mod roots;
mod settled;
mod short_waves;
mod stationary;
mod transfer;

pub use boundary::{BoundaryPoint, boundary};
pub use count::Unstable;
pub use linear::Linearisation;
pub use modes::{Polarisation, Root};
pub use onset::{Onset, crossings, onset};
pub use stationary::{Stationary, StationarySolver};

use crate::equilibrium::EquilibriumError;
use crate::error::ParameterError;

/// Why a question of stability has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StabilityError {
    /// A setting makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No mechanical equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The equilibrium is unstable by itself, before any growth.
    #[error(
        "the equilibrium is mechanically unstable, with {negative} negative eigenvalues: the shoot buckles or falls, \
             whatever it senses; make it shorter, lighter or stiffer"
    )]
    MechanicallyUnstable {
        /// Number of negative eigenvalues of the energy.
        negative: usize,
    },
    /// A law, a load, gravity or the base depends on time (an oscillator, say): nothing is stationary.
    #[error(
        "something depends on time: the laws ask for different growth at different times (by {change:.3e} 1/m), or the \
             base turns; the shoot is forced, leave the forcing out"
    )]
    Forced {
        /// By how much the gradient changes, or the turn of the base over the length, 1/m.
        change: f64,
    },
    /// The shoot is not stationary.
    #[error("the shoot is not stationary: the laws ask for a gradient of {gradient:.3e} 1/m")]
    NotStationary {
        /// The largest gradient asked for, 1/m.
        gradient: f64,
    },
    /// No stationary state was found; a tilted shoot without proprioception has none.
    #[error(
        "no stationary state after {iterations} iterations: the laws still ask for a gradient of {gradient:.3e} 1/m"
    )]
    NoStationaryState {
        /// Iterations done.
        iterations: usize,
        /// The largest gradient still asked for, 1/m.
        gradient: f64,
    },
    /// The laws are content at every material point, but the shape between them is not resolved: there is no such state, as
    /// with a tilted shoot without proprioception, or the elements are too long for it.
    #[error(
        "the shape with which the laws are content is not resolved: within one element its strain departs from a \
             polynomial of lower degree by {turn:.3e} rad"
    )]
    Unresolved {
        /// The largest turn within an element by the highest polynomial of the strain, rad.
        turn: f64,
    },
    /// No law acts on any point of the growth zone.
    #[error("nothing is steered: there is no law, or its sensitivity is zero, or no tissue grows")]
    NothingDriven,
    /// The parameter range holds no crossing of the axis.
    #[error(
        "no root crosses the axis between {from} and {to}: {unstable_from} and {unstable_to} unstable roots at the ends"
    )]
    NoCrossing {
        /// Start of the range.
        from: f64,
        /// End of the range.
        to: f64,
        /// Unstable roots at the start.
        unstable_from: usize,
        /// Unstable roots at the end.
        unstable_to: usize,
    },
    /// Infinitely many roots are unstable: the essential spectrum lies right of the axis.
    #[error("infinitely many roots are unstable: the essential spectrum reaches {abscissa:.3e} 1/s")]
    InfinitelyMany {
        /// Largest real part of the essential spectrum, 1/s.
        abscissa: f64,
    },
    /// The mesh does not resolve waves that matter for the answer; take more elements. Next to the essential spectrum, and
    /// with fast growth and no proprioception, ever shorter waves matter, and no mesh may do.
    #[error(
        "the elements are too long for the waves that matter: their error may change the characteristic function by \
             {blur:.1e} of itself; take more elements"
    )]
    Coarse {
        /// The share by which the characteristic function may change, at the λ where it is largest.
        blur: f64,
    },
    /// All roots pile up at the essential spectrum, or at λ = 0 where no law senses the strain at its own place.
    #[error(
        "no isolated root lies right of the essential spectrum and of the rates of the memories; essential() and \
             unstable() have answers"
    )]
    NoIsolatedRoot,
    /// A count of roots or a root did not come out to the accuracy asked for.
    #[error("{what} did not converge: {residual:.3e} is left")]
    NoConvergence {
        /// What was sought.
        what: &'static str,
        /// What is left of the residual.
        residual: f64,
    },
}
