//! The shape at rest under the present loads, equations (1) and (9) to (12).

mod element;
mod elimination;
mod line;
mod newton;
mod search;
mod system;
mod tangent;
mod unloaded;

pub use newton::{Branch, NewtonSolver};
pub use unloaded::Unloaded;

use nalgebra::Vector3;

use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::{Rod, Tissue, centre_line_tangent};
use crate::scene::Environment;

/// q ℓ³/(E I) at which a slender upright shoot of length ℓ, weight q per length and bending stiffness E I begins to buckle
/// under its own weight: (9/4) j², with j = 1.866350858873895 the first zero of the Bessel function J₋₁⸝₃.
///
/// A. G. Greenhill, *Determination of the greatest height consistent with stability that a vertical pole or mast can be made*,
/// Proc. Camb. Phil. Soc. 4, 65–73 (1881).
pub const GREENHILL: f64 = 7.837_347_438_943_484;

/// Signs of the eigenvalues of the energy's second derivative: how stable an equilibrium is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Inertia {
    /// Number of negative eigenvalues, the Morse index: zero at a stable equilibrium.
    pub negative: usize,
    /// Number of neutral directions: zero up to rounding. An isotropic shoot that is buckled on an exactly upright
    /// base has one, its turn about the vertical, and is stable all the same.
    pub neutral: usize,
    /// Number of positive eigenvalues.
    pub positive: usize,
    /// The smallest pivot relative to the diagonal entry that it came from: how far from losing (or gaining) stability.
    pub margin: f64,
}

impl Default for Inertia {
    fn default() -> Self {
        Self { negative: 0, neutral: 0, positive: 0, margin: f64::INFINITY }
    }
}

/// How an equilibrium was found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[must_use]
#[non_exhaustive]
pub struct Equilibrium {
    /// Newton iterations, each with a fresh tangent.
    pub iterations: usize,
    /// Factorisations of the tangent, those with a trial shift included.
    pub factorisations: usize,
    /// Evaluations of the energy and its gradient without a tangent.
    pub evaluations: usize,
    /// Estimated largest error of a frame against the exact minimum of the discrete energy, rad.
    pub error: f64,
    /// Total energy, J.
    pub energy: f64,
    /// Signs of the eigenvalues of the tangent at the answer. All zero for a solver that needs no tangent.
    pub inertia: Inertia,
    /// How far the tip came (m) from where the first guess, or what followed from it, was found unstable: the answer need not be its
    /// continuation. None if it was stable all the way.
    pub jump: Option<f64>,
    /// Smallest pivot of the last tangent, relative to that of the same rod without load: a distance from the loss of stability that does
    /// not depend on the mesh. Zero for a solver that needs no tangent.
    pub(crate) resistance: f64,
}

/// Why there is no equilibrium to report. The rod is as it was before the call.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// The iteration came to its bound. A nearer first guess, a finer mesh or a smaller load may help.
    #[error(
        "no equilibrium after {iterations} Newton iterations: the last step turned a frame by {step:.3e} rad, \
             the largest unbalanced couple is {residual:.3e} N m, the largest force {force:.3e} N"
    )]
    NoConvergence {
        /// Newton iterations done.
        iterations: usize,
        /// The largest rotation of the last step, rad.
        step: f64,
        /// The largest unbalanced couple, N m.
        residual: f64,
        /// The largest force in the rod, N: the load under which it was sought.
        force: f64,
    },
    /// On the way to an equilibrium an element would turn by π, where its rotation vector ends. Shorter elements are needed.
    #[error("element {element} would turn by π; it needs to be shorter: take more elements, or a smaller load")]
    Folded {
        /// The element, counted from the base.
        element: usize,
    },
    /// The only equilibrium found is unstable.
    #[error("the equilibrium found is unstable: {negative} negative eigenvalues")]
    Unstable {
        /// Number of negative eigenvalues.
        negative: usize,
    },
    /// The rod is compressed to nothing somewhere.
    #[error(
        "a stretch of {stretch:.3e} at {arc_length:.4} m from the base leaves nothing of the rod: the force reaches {force:.3e} N"
    )]
    Crushed {
        /// The stretch v3, which should be positive.
        stretch: f64,
        /// Where it is, by arc length from the base, m.
        arc_length: f64,
        /// The largest force in the rod, N.
        force: f64,
    },
    /// An input was not a number, or an elastic law answered so.
    #[error("the {what} is not finite")]
    NotFinite {
        /// What was not finite.
        what: &'static str,
    },
    /// The factorisation found no memory.
    #[error("no memory to factorise {unknowns} unknowns")]
    OutOfMemory {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// A setting of the solver makes no sense.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A solver that takes no load was given one.
    #[error("this solver takes no load, but the force in the rod reaches {force:.3e} N")]
    Loaded {
        /// The largest force, N.
        force: f64,
    },
}

impl EquilibriumError {
    /// Whether a smaller load, a nearer guess or a smaller time step may succeed where this failed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::NoConvergence { .. } | Self::Unstable { .. } | Self::Folded { .. })
    }
}

/// Refuses an elastic law that has no stiffness at some place of a rod at a time (s), or that no force can strain soundly.
pub(crate) fn check_stiffness(rod: &Rod, material: &impl Constitutive, time: f64) -> Result<(), ParameterError> {
    for point in rod.points() {
        let (tissue, zero) = (Tissue::of(point, time), Vector3::zeros());
        let at = |error: ParameterError| error.at(rod.initial_length - point.initial_apex_distance);
        let stiffness = material.respond(&tissue, &zero).tangent.diagonal();
        for (i, name) in ["stiffness K1", "stiffness K2", "stiffness K3"].into_iter().enumerate() {
            let sound = stiffness[i] > 0.0 && stiffness[i].is_finite();
            ParameterError::unless(sound, name, stiffness[i], "positive and finite (N m²)").map_err(at)?;
        }
        let Some(line) = material.line_response(&tissue, &zero) else { continue };
        let compliance = line.compliance.diagonal();
        for (i, name) in ["compliance to shear along d1", "compliance to shear along d2", "compliance to stretch"]
            .into_iter()
            .enumerate()
        {
            let sound = compliance[i] >= 0.0 && compliance[i].is_finite();
            ParameterError::unless(sound, name, compliance[i], "zero or positive, and finite (1/N)").map_err(at)?;
        }
        let strained = (line.strain - centre_line_tangent()).norm();
        let name = "shear or stretch without force";
        // As frames: of norm 1 to 1e-9.
        ParameterError::unless(strained < 1e-9, name, strained, "zero").map_err(at)?;
    }
    Ok(())
}

/// Finds the shape at rest.
pub trait EquilibriumSolver {
    /// Turns the frames of `rod` into an equilibrium under its intrinsic strains and the force in it, starting from the
    /// frames that it has. The base frame stays. The force must be that in this rod as it is.
    ///
    /// # Errors
    /// See [`EquilibriumError`]; the rod is then as it was.
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError>;

    /// The same under a load.
    ///
    /// # Errors
    /// See [`EquilibriumError`]; the rod is then as it was.
    fn solve(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Equilibrium, EquilibriumError> {
        let force = InternalForce::of(rod, load, environment);
        self.equilibrate(rod, material, &force)
    }
}
