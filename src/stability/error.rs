//! Errors of steady states, characteristic roots and their continuation.

use crate::equilibrium::EquilibriumError;
use crate::error::ParameterError;
use crate::linear::LawError;

/// Reason why there is no steady state, root or boundary of stability.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StabilityError {
    /// A parameter is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No mechanical equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The mechanical equilibrium is unstable.
    #[error(
        "the shoot buckles or falls: its equilibrium has {negative} unstable directions; make it shorter or stiffer"
    )]
    MechanicallyUnstable {
        /// Number of negative eigenvalues of the energy.
        negative: usize,
    },
    /// A law, a load, growth, gravity or the base depends on time, as an oscillator does.
    #[error("the shoot is forced: its laws, loads or base change in time, by {change:.3e} 1/m; leave the forcing out")]
    NotAutonomous {
        /// Change of the gradient; or rotation of the base, or relative change of force and REGR, over the length; 1/m.
        change: f64,
    },
    /// The state that a law returns from [`steady`](crate::tropism::TropismLaw::steady) is no steady state of its
    /// [`rates`](crate::tropism::TropismLaw::rates). The provided `steady` writes zeros.
    #[error(
        "`steady` of the law {law} is not a steady state of its `rates`: variable {variable} of the shoot, counted from \
         zero over all laws, changes by {rate:.3e} per second, {share:.1e} of the terms of this rate"
    )]
    NotSteady {
        /// The law, by the name of its type.
        law: &'static str,
        /// The number of the variable at a point, counted from zero over all laws.
        variable: usize,
        /// The rate of the variable, its unit per second.
        rate: f64,
        /// The rate relative to the sum of its terms; infinite if all terms are zero.
        share: f64,
    },
    /// The shoot is not in a steady state.
    #[error("the shoot is not in a steady state: the laws have a gradient of {gradient:.3e} 1/m")]
    NotSteadyState {
        /// The largest gradient of the laws, 1/m.
        gradient: f64,
    },
    /// No steady state was found; a tilted shoot without proprioception has none.
    #[error("no steady state: after {iterations} iterations the laws have a gradient of {gradient:.3e} 1/m")]
    NoSteadyState {
        /// Number of iterations.
        iterations: usize,
        /// The largest gradient of the laws, 1/m.
        gradient: f64,
    },
    /// The gradients of the laws vanish at all material points, but the shape between the points is not resolved: there is no
    /// steady state, as with a tilted shoot without proprioception, or the elements are too long for it.
    #[error("the mesh does not resolve the steady state: waves inside an element turn it by {turn:.3e} rad")]
    Unresolved {
        /// The largest rotation within an element by the highest polynomial of the strain, rad.
        turn: f64,
    },
    /// No law acts on any point of the growth zone.
    #[error("nothing is steered: there is no law, or its sensitivity is zero, or no tissue grows")]
    NothingDriven,
    /// No root crosses the axis in the range of the parameter.
    #[error("no root crosses the axis: {unstable_from} are unstable at {from}, {unstable_to} at {to}")]
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
    /// The mesh does not resolve waves that contribute to the answer; take more elements. Next to the essential spectrum, and
    /// with fast growth and no proprioception, ever shorter waves contribute, and it may be that no mesh resolves them.
    #[error("short waves matter that the mesh does not resolve (to {share:.1e} of the function); take more elements")]
    UnderResolved {
        /// Relative error of the characteristic function, at the λ where it is largest.
        share: f64,
    },
    /// The finest mesh allowed does not meet the tolerance.
    #[error(
        "the mesh puts the answer off by {error:.1e} of itself with {elements} elements, more than {tolerance:.1e}"
    )]
    ToleranceNotMet {
        /// The tolerance that was requested.
        tolerance: f64,
        /// The estimated relative error; infinite if no two meshes had an answer.
        error: f64,
        /// The number of elements of the last mesh with an estimate; zero if there was none.
        elements: usize,
    },
    /// A number that follows from the shoot and its laws is infinite or not a number.
    #[error("the {what} is not finite")]
    NotFinite {
        /// The quantity.
        what: &'static str,
    },
    /// All roots accumulate at the essential spectrum, or at λ = 0 where no law senses the strain at its own place.
    #[error("no isolated root lies right of the essential spectrum; essential_spectrum() and unstable() have answers")]
    NoIsolatedRoot,
    /// The rates of too many variables depend on each other. Each evaluation of the characteristic function factorises their matrix at
    /// every point at which the laws linearise differently.
    #[error(
        "too many variables of the laws depend on each other: {variables} at a point; an evaluation of the characteristic function takes \
         {operations:.1e} operations for them, and at most {most:.1e} are allowed"
    )]
    TooManyVariables {
        /// The largest number of variables at a point that depend on each other.
        variables: usize,
        /// Σ n³ over all sets of n variables that depend on each other, at the points that differ.
        operations: f64,
        /// The largest number of operations that is allowed.
        most: f64,
    },
    /// A search for roots, or their count, needs too many evaluations, because very many roots lie in its region, as left of the
    /// axis where delays are long compared with memories, or next to the essential spectrum.
    #[error(
        "roots are too many: the search was given up after {evaluations} evaluations of the characteristic function"
    )]
    TooMuchWork {
        /// Number of evaluations.
        evaluations: usize,
    },
    /// A root, a crossing or a count of roots did not converge.
    #[error("{what} did not converge: {residual:.3e} is left")]
    NoConvergence {
        /// The quantity.
        what: &'static str,
        /// The last residual.
        residual: f64,
    },
}

impl From<LawError> for StabilityError {
    fn from(error: LawError) -> Self {
        match error {
            LawError::NonFinite { what } => Self::NotFinite { what },
            LawError::Unsteady { law, variable, rate, share } => Self::NotSteady { law, variable, rate, share },
            LawError::TimeDependent { change } => Self::NotAutonomous { change },
        }
    }
}
