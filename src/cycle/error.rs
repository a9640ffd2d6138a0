//! Why no cycle was found.

use crate::equilibrium::EquilibriumError;
use crate::error::ParameterError;
use crate::numerics::krylov::RitzError;
use crate::stability::StabilityError;

/// Why no cycle was found. The shoot is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CycleError {
    /// A setting makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No mechanical equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// A question of stability has no answer.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// A shoot that gets longer has no cycle.
    #[error("the growth law elongates the shoot: nothing comes back; `growth::Ongoing` keeps its length")]
    Elongates,
    /// Some tissue of the zone does not steer.
    #[error("{points} material points of the zone are not driven: each would keep any strain that it has")]
    NotDriven {
        /// How many.
        points: usize,
    },
    /// The laws ask for twist; only strain that bends is sought.
    #[error(
        "the laws ask for a twist of {twist:.1e} 1/m beside a bend of {bend:.1e} 1/m: cycles are found of bending only"
    )]
    Twists {
        /// The largest gradient of twist, 1/m.
        twist: f64,
        /// The largest gradient of bend, 1/m.
        bend: f64,
    },
    /// Laws, loads, elasticity or the scene are not invariant under rotations about the tangent of the base.
    #[error(
        "the {what} breaks the axis of the shoot: it changes by {defect:.1e} of itself when all is turned about it"
    )]
    NoAxis {
        /// The part of the shoot that breaks the symmetry.
        what: &'static str,
        /// Relative change under rotation.
        defect: f64,
    },
    /// The relative periodic orbit is a rotating wave, whose period is not determined.
    #[error(
        "the orbit is a rotating wave, which returns rotated after any time: `RotatingWaveSolver` finds it, or an orbit without an angle"
    )]
    RotatingWave,
    /// The rotation of a variable with the shoot is not declared.
    #[error(
        "variable {variable} of the laws does not declare its rotation, so that nothing is known of a shoot that has turned"
    )]
    Undeclared {
        /// Its number at a point, all laws counted.
        variable: usize,
    },
    /// What drives the shoot does not come back after the period that was given.
    #[error("what drives the shoot is not the same after {period} s: it changes by {change:.1e} of itself")]
    NoCommonPeriod {
        /// The period, s.
        period: f64,
        /// Relative change after the period.
        change: f64,
    },
    /// The variables of a point do not come back to what they were.
    #[error("the laws' variables do not come back after a period: the last correction was {change:.1e}")]
    Variables {
        /// The last correction.
        change: f64,
    },
    /// The iteration ended in the stationary state.
    #[error("no orbit near the start: the iteration went to the stationary state, to a strain of {strain:.1e} 1/m")]
    Stationary {
        /// The largest intrinsic strain that drives, 1/m.
        strain: f64,
    },
    /// The direction of a branch changes however short the steps are.
    #[error(
        "the branch is lost beyond {parameter}: within a step of {step:.1e} its direction changes to cos = {turn:.2}"
    )]
    Lost {
        /// The parameter of the last place.
        parameter: f64,
        /// The shortest step that was tried.
        step: f64,
        /// The cosine of the angle.
        turn: f64,
    },
    /// A place at which the stability changes is not found.
    #[error(
        "the place at which the stability changes, next to {parameter}, is only known within {width:.1e} of a step"
    )]
    BifurcationNotLocated {
        /// The parameter of the last place that was tried.
        parameter: f64,
        /// The width that is left, in units of the step.
        width: f64,
    },
    /// Leading roots or multipliers that did not converge: a list without them could hide an unstable one.
    #[error(
        "the leading roots or multipliers are not complete: {found} of {wanted} converged with {vectors} Krylov vectors"
    )]
    Incomplete {
        /// Number of converged eigenvalues.
        found: usize,
        /// Number of eigenvalues that were requested, trivial ones included.
        wanted: usize,
        /// Number of Krylov vectors.
        vectors: usize,
    },
    /// The return map and the characteristic function of a rotating wave have different roots.
    #[error(
        "the return map on {intervals} intervals and the characteristic function of the rotating wave have different roots"
    )]
    RootsDisagree {
        /// Largest number of intervals that was tried.
        intervals: usize,
    },
    /// The intervals of a period do not resolve the orbit.
    #[error(
        "{intervals} intervals do not resolve the orbit: the relative error of its period, its shape or a trivial multiplier is about \
         {error:.1e}"
    )]
    Unresolved {
        /// Estimate of the relative error of period and shape, or distance of a trivial multiplier from 1.
        error: f64,
        /// Number of intervals in the period.
        intervals: usize,
    },
    /// Newton's method did not converge.
    #[error(
        "Newton's method goes no further after {iterations} iterations, with {residual:.1e} left, relative: the start may be too far from \
         a cycle, or there may be none"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// What is left, relative.
        residual: f64,
    },
}

impl From<RitzError> for CycleError {
    fn from(error: RitzError) -> Self {
        let what = "the iteration for the multipliers";
        Self::Stability(match error {
            RitzError::NotFinite => StabilityError::NotFinite { what: "linearised map" },
            RitzError::NoConvergence => StabilityError::NoConvergence { what, residual: f64::INFINITY },
        })
    }
}

impl CycleError {
    /// The error that the caller gets. Errors of the initial guess are returned as they are. In later iterations they mean that Newton's
    /// method did not converge.
    pub(super) fn after(self, iterations: usize, residual: f64) -> Self {
        match self {
            Self::Equilibrium(_) | Self::Parameter(_) if iterations > 0 => Self::NotConverged { iterations, residual },
            error => error,
        }
    }
}
