//! Errors of the solvers of periodic orbits and rotating waves.

use crate::equilibrium::EquilibriumError;
use crate::error::{Known, Number, ParameterError, debug_by_display};
use crate::stability::StabilityError;

/// The result of a part of a computation.
pub(in crate::cycle) type Outcome<T = ()> = Result<T, CycleError>;

/// Reason why an orbit, its stability or its branch was not computed. The shoot is unchanged.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CycleError {
    /// A setting is out of range, or does not belong to the shoot.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No mechanical equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The laws depend on time, have no steady state, or cannot be linearised.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The growth law elongates the shoot, which therefore has no periodic orbit.
    #[error(
        "the growth law elongates the shoot, so that no state returns; `growth::Ongoing` keeps the length constant"
    )]
    Elongates,
    /// The laws request a twist. Only orbits of bending are computed.
    #[error("the laws request a twist of {:.2} 1/m, but only orbits without twist are computed", Number(*twist))]
    Twists {
        /// Largest growth gradient of the twist, 1/m.
        twist: f64,
    },
    /// The shoot lacks a symmetry that the equations assume: laws, loads, elasticity or the scene
    /// change under a rotation about the tangent of the base, or under a shift in time by the
    /// period of the forcing.
    #[error("{what}, but it changes by {:.2} of its size", Number(*change))]
    NotInvariant {
        /// Requirement of the symmetry, which names the part of the shoot.
        what: &'static str,
        /// Change relative to the size.
        change: f64,
    },
    /// The relative periodic orbit is a rotating wave, which returns rotated after any time: its
    /// period is not determined.
    #[error(
        "the orbit is a rotating wave, whose period is not determined: use `RotatingWaveSolver`, or no angle"
    )]
    RotatingWave,
    /// A law does not declare how one of its variables rotates with the shoot.
    #[error(
        "variable {variable} of the laws, counted from zero over all laws, does not declare its rotation"
    )]
    Undeclared {
        /// Number of the variable at a material point, counted from zero over all laws.
        variable: usize,
    },
    /// Newton's method converged to the stationary state.
    #[error(
        "no orbit near the initial guess: the iteration converged to the stationary state, with a change of strain of \
         {:.2} 1/m; a larger amplitude or another period may help, if the shoot has an orbit",
        Number(*strain)
    )]
    Stationary {
        /// Largest change of the intrinsic strain, 1/m.
        strain: f64,
    },
    /// A branch cannot be followed, or a bifurcation on it cannot be located, with the shortest
    /// step.
    #[error("at parameter {}, with a step of {:.2}: {what}", Number(*parameter), Number(*step))]
    Lost {
        /// What fails.
        what: &'static str,
        /// Parameter of the last point.
        parameter: f64,
        /// Shortest step that was tried.
        step: f64,
    },
    /// Leading roots or multipliers did not converge. A list without them could omit an unstable
    /// one.
    #[error("only {found} of {wanted} leading eigenvalues converged; the others may be unstable")]
    Incomplete {
        /// Number of converged eigenvalues.
        found: usize,
        /// Number of requested eigenvalues, the trivial ones included.
        wanted: usize,
    },
    /// The largest number of intervals does not resolve the orbit or its multipliers.
    #[error(
        "{intervals} intervals do not resolve the orbit or its multipliers: the relative error is {}; take more \
         `intervals` or a larger `accuracy`",
        Known(*error)
    )]
    Unresolved {
        /// Relative error of period and shape, distance of a trivial multiplier from 1, or
        /// difference between a root of a rotating wave and its multiplier in units of the rate;
        /// infinite if there is no such root.
        error: f64,
        /// Number of intervals in the period.
        intervals: usize,
    },
    /// The limit of work that a setting of the solver gives.
    #[error(
        "no orbit within the limit `max_work`: the relative residual is {} after {work} equilibria",
        Known(*residual)
    )]
    WorkLimit {
        /// Number of equilibria.
        work: usize,
        /// Last relative residual.
        residual: f64,
    },
    /// An iteration did not converge.
    #[error(
        "the iteration for {what} did not converge: the relative residual is {} after {iterations} iterations; \
         check the units of the initial guess (a period in s, an amplitude in m, a rate in rad/s), and that the shoot \
         is beyond its onset; a nearer guess, more `max_iterations` or a larger `tolerance` may help",
        Known(*residual)
    )]
    NotConverged {
        /// Unknowns of the iteration.
        what: &'static str,
        /// Number of iterations.
        iterations: usize,
        /// Last relative residual.
        residual: f64,
    },
}

debug_by_display!(CycleError);

impl CycleError {
    /// The error of Newton's method for an orbit.
    pub(super) fn not_converged(iterations: usize, residual: f64) -> Self {
        Self::NotConverged {
            what: "the orbit",
            iterations,
            residual,
        }
    }

    /// The error of an iteration for the variables of the laws, by its last relative change.
    pub(super) fn variables(iterations: usize, residual: f64) -> Self {
        Self::NotConverged {
            what: "the variables of the laws",
            iterations,
            residual,
        }
    }

    /// Converts an equilibrium or parameter error of a later Newton iteration into `NotConverged`.
    /// All other errors, and those of the initial guess, are returned unchanged.
    pub(super) fn after(self, iterations: usize, residual: f64) -> Self {
        match self {
            Self::Equilibrium(_) | Self::Parameter(_) if iterations > 0 => {
                Self::not_converged(iterations, residual)
            }
            error => error,
        }
    }
}
