//! Errors of steady states, characteristic roots and their continuation.

use crate::equilibrium::EquilibriumError;
use crate::error::{Known, Number, ParameterError, debug_by_display};

/// Largest number of elements of a shoot to which `Linearisation::resolved` divides it. On this
/// mesh one evaluation of the characteristic function takes about a tenth of a second.
pub(crate) const MOST_RESOLVED_ELEMENTS: usize = 128;

/// The result of a part of a computation.
pub(crate) type Outcome<T = ()> = Result<T, StabilityError>;

/// Reason why there is no steady state, root or crossing of the imaginary axis.
#[derive(Clone, PartialEq, thiserror::Error)]
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
        /// Number of negative eigenvalues of the second derivative of the energy.
        negative: usize,
    },
    /// A law, a load, growth, gravity, the base or a support depends on time, as an oscillator
    /// does.
    #[error(
        "the shoot is not autonomous: its laws, loads, growth, base or support depend on time and change by \
         {:.4} 1/m; remove the time-dependent part",
        Number(*change)
    )]
    NotAutonomous {
        /// Largest change, 1/m: of the growth gradient, of the rotation of the base over the length
        /// of the shoot, or of force, REGR and support, relative, over this length.
        change: f64,
    },
    /// The state that a law returns from [`steady`](crate::tropism::TropismLaw::steady) is not a
    /// steady state of its [`rates`](crate::tropism::TropismLaw::rates). The provided `steady`
    /// writes zeros.
    #[error(
        "`steady` of the law {law} is not a steady state of its `rates`: variable {variable} of the shoot, counted \
         from zero over all laws, changes by {:.4} (its unit per second)",
        Number(*rate)
    )]
    NotSteady {
        /// Name of the type of the law.
        law: &'static str,
        /// Number of the variable at a point, counted from zero over all laws.
        variable: usize,
        /// Rate of the variable, in its unit per second.
        rate: f64,
        /// Rate relative to the sum of its terms; infinite if all terms are zero.
        share: f64,
    },
    /// The growth gradients do not vanish, in the given state or after a search. A tilted shoot
    /// without proprioception has no steady state.
    #[error(
        "the shoot is not in a steady state: the laws have a growth gradient of {:.4} 1/m{}; a tilted shoot without \
         proprioception has none",
        Number(*gradient), advice(*iterations)
    )]
    NotSteadyState {
        /// Number of iterations of the search; zero if the given state was checked.
        iterations: usize,
        /// Largest growth gradient, 1/m.
        gradient: f64,
    },
    /// No law senses the strain, and the base is not along gravity: there is no shape in which the
    /// growth gradients vanish.
    #[error(
        "no law senses the bending of the shoot, without which a tilted shoot has no steady state: add \
         `Proprioception`, or make the base vertical"
    )]
    NoProprioception,
    /// No law acts on any point of the growth zone.
    #[error(
        "no differential growth: there is no law, or its sensitivity is zero, or no tissue grows"
    )]
    NothingDriven,
    /// No root crosses the imaginary axis in the range of the parameter.
    #[error(
        "no root crosses the axis: at the ends of the range {} and {} roots are unstable; take a wider range",
        unstable[0], unstable[1]
    )]
    NoCrossing {
        /// Numbers of unstable roots at both ends of the range.
        unstable: [usize; 2],
    },
    /// Infinitely many roots are unstable, because the essential spectrum extends right of the
    /// axis. On a mesh their number is proportional to that of its points.
    #[error("infinitely many roots are unstable: the essential spectrum reaches {:.4} 1/s", Number(*abscissa))]
    InfinitelyMany {
        /// Largest real part of the essential spectrum, 1/s.
        abscissa: f64,
    },
    /// The mesh does not resolve the steady state, or waves that contribute to the characteristic
    /// function. Take more elements;
    /// [`Linearisation::resolved`](crate::stability::Linearisation::resolved) does so for waves.
    /// Next to the essential spectrum, and with fast growth and no proprioception, ever shorter
    /// waves contribute, and possibly no mesh resolves them. A tilted shoot without proprioception
    /// has no steady state, which appears as a shape that no mesh resolves.
    #[error(
        "the mesh of {elements} elements in the growth zone does not resolve {what}: the error is {:.2}; take more \
         elements (for waves, `Linearisation::resolved` tries up to {} in the whole shoot); with fast growth or little \
         proprioception no mesh may suffice",
        Number(*error), MOST_RESOLVED_ELEMENTS
    )]
    UnderResolved {
        /// The number of elements in the growth zone.
        elements: usize,
        /// The quantity, with the unit of its error.
        what: &'static str,
        /// Its estimated error.
        error: f64,
    },
    /// The finest mesh allowed does not meet the tolerance.
    #[error(
        "the relative error due to the mesh is {} with {elements} elements, and does not meet the tolerance of {}: \
         take a larger tolerance or permit more elements",
        Known(*error), Number(*tolerance)
    )]
    ToleranceNotMet {
        /// The tolerance that was requested.
        tolerance: f64,
        /// The estimated relative error; infinite if no two meshes gave a result.
        error: f64,
        /// The number of elements of the last mesh with an estimate; zero if there was none.
        elements: usize,
    },
    /// A number that follows from the shoot and its laws is infinite or not a number.
    #[error(
        "the {what} is not finite: check the laws of the shoot, for example by `Shoot::check_laws`"
    )]
    NotFinite {
        /// The quantity.
        what: &'static str,
    },
    /// All roots accumulate at the essential spectrum, or at λ = 0 where no law senses the strain
    /// at its own place.
    #[error(
        "no isolated root lies right of the essential spectrum: use `essential_spectrum` or `unstable`"
    )]
    NoIsolatedRoot,
    /// The work exceeds its limit. Either the rates of too many variables depend on each other,
    /// whose matrix is factorised in each evaluation of the characteristic function. Or a search or
    /// count meets too many roots, for example left of the axis if delays are longer than memory
    /// times, or next to the essential spectrum.
    #[error("too much work: {:.2} {what}, of which at most {:.2} are allowed", Number(*amount), Number(*most))]
    TooMuchWork {
        /// The kind of work.
        what: &'static str,
        /// Work required, or done before the search ended.
        amount: f64,
        /// Limit of the work.
        most: f64,
    },
    /// A root, a crossing or a count of roots did not converge.
    #[error(
        "{what} did not converge: the last residual or change is {}; a start nearer to the solution, or more elements \
         may help",
        Known(*residual)
    )]
    NoConvergence {
        /// The quantity.
        what: &'static str,
        /// The last residual, distance or change of the iteration; its unit depends on `what`.
        residual: f64,
    },
}

debug_by_display!(StabilityError);

/// The part of a message about a search with a number of iterations, or about a state that was
/// checked without one.
fn advice(iterations: usize) -> String {
    match iterations {
        0 => "; `solve_steady_state` searches for one".to_string(),
        _ => format!(" after {iterations} iterations"),
    }
}
