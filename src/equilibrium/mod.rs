//! Equilibrium of a rod under its load, equations (1) and (9) to (12).

mod balance;
mod checks;
mod coarse;
mod element;
mod elimination;
mod error;
mod held;
mod joints;
mod line;
mod neutral;
mod newton;
mod points;
mod rod_energy;
mod saddle;
mod search;
mod system;
mod tangent;
mod unloaded;
mod valley;

pub(crate) use balance::check_balance;
pub(crate) use checks::check_stiffness;
pub use error::{ContactViolation, EquilibriumError};
pub(crate) use newton::{LARGEST_TOLERANCE, check_tolerance};
pub use newton::{NewtonSolver, NewtonWorkspace};
pub use rod_energy::{NodeTangent, RodEnergy};
pub use unloaded::Unloaded;

use nalgebra::Vector3;

use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;
use crate::support::{Patch, Reaction, Support};

/// Signs of the eigenvalues of the second derivative of the energy.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Inertia {
    /// Number of negative eigenvalues, the Morse index: zero at a stable equilibrium.
    pub negative: usize,
    /// Number of eigenvalues that are zero up to rounding. An isotropic buckled shoot on an exactly
    /// upright base has one, for rotations about the vertical, and is stable.
    pub neutral: usize,
    /// Number of positive eigenvalues.
    pub positive: usize,
    /// Smallest pivot relative to the diagonal entry before elimination: a measure of the distance
    /// from a change of stability. It is negative if an eigenvalue is, and infinite by default,
    /// without any pivot. With a support it has no sign: it is the magnitude of this pivot, or of
    /// the smallest scaled eigenvalue for the reactions if that is less, and only the counts decide
    /// stability.
    pub margin: f64,
}

impl Default for Inertia {
    fn default() -> Self {
        Self {
            negative: 0,
            neutral: 0,
            positive: 0,
            margin: f64::INFINITY,
        }
    }
}

/// Counts, error and stability of an equilibrium. The counts do not include the search on a coarse
/// mesh that improves a straight initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
#[non_exhaustive]
pub struct Equilibrium {
    /// Number of iterations. Each Newton iteration has a new tangent.
    pub iterations: usize,
    /// Number of factorisations of the tangent, including those with a trial shift.
    pub factorisations: usize,
    /// Number of evaluations of the energy and its gradient without tangent.
    pub evaluations: usize,
    /// Estimated largest error of a frame against the exact stationary point of the discrete
    /// energy, rad. With obstacles it is at least the largest penetration of the discrete rod
    /// relative to the length, which a coarse rod may have between its stations. A contact point is
    /// at a node, and a contact segment has nodes at its ends. A solver moves these nodes a limited
    /// number of times. If a node is still away from its place, the error is at least its distance
    /// along the rod relative to the length, which may be far larger than the error of the shape.
    /// It does not contain rotations in the directions that [`Inertia::neutral`] counts: the
    /// couples along them are rounding.
    pub error: f64,
    /// Total energy, J: the elastic energy, which is zero without elastic strain, minus ∫ n · p′
    /// ds, the work of the load as the tissue moves from the position of the base to its own. Zero
    /// for [`Unloaded`], which does not evaluate it.
    pub energy: f64,
    /// Numbers of positive, negative and neutral eigenvalues of the tangent at the equilibrium. For
    /// a solver without tangent the counts are zero and the margin is infinite.
    pub inertia: Inertia,
    /// Displacement of the tip (m) since the first unstable configuration of the search, unless the
    /// equilibrium is the continuation of the initial guess. It is the continuation if the
    /// unbalanced couples of the guess cause at least a fifth of the rotation from there. `None` if
    /// all configurations of the search were stable.
    ///
    /// For a rod with a support it is the largest displacement of the centre line, by more than 1e-3
    /// of the length, in an increment of the motion of holds, base and obstacles in which the rod
    /// releases more than twice the energy that the linear rod of its end predicts. Such an
    /// increment is halved until its displacement changes by less than 0.5 %, at most ten times. In
    /// contact it is halved in a time step only. The first increment counts if the rod was in
    /// equilibrium before: in a time step, or with the reactions of an earlier search. In contact a
    /// descent to a distant equilibrium is a jump, too, and so is the jump of a search
    /// without obstacles if the rod touched none before. After a descent the friction of contacts
    /// depends on its iterations, in each of which it dissipates energy.
    pub jump: Option<f64>,
    /// Smallest pivot of the last tangent, relative to that of the same rod without load: a
    /// distance from the loss of stability that does not depend on the mesh. Zero with a neutral
    /// rotation of frames, and for a solver without tangent.
    pub(crate) resistance: f64,
}

/// Equilibrium of a rod with a support.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct Held {
    /// Counts, error and stability. The inertia is that on the directions that the supports permit.
    pub equilibrium: Equilibrium,
    /// Number of increments in which the holds were moved to their places, and in a time step also
    /// the base and the obstacles. They are the load path, on which an equilibrium depends if there
    /// are several.
    pub increments: usize,
    /// The reactions: of the holds of positions in their order, of the springs with a potential, of
    /// the contacts, and of the holds of frames alone. They are also the [`Rod::reactions`] of
    /// `rod`.
    pub reactions: Vec<Reaction>,
    /// The rod in its shape, with additional nodes where contacts begin and end.
    pub rod: Rod,
    pub(crate) patches: Vec<Patch>,
}

/// A rod with its contacts at the start of an increment in time.
#[derive(Debug, Clone)]
pub(crate) struct IncrementStart {
    /// The rod, with additional nodes at contacts.
    pub rod: Rod,
    /// Time, s.
    pub time: f64,
    pub reactions: Vec<Reaction>,
    pub patches: Vec<Patch>,
}

/// A rod with a support, whose equilibrium is sought.
#[derive(Debug)]
pub struct HeldRod<'a, C, L, U> {
    /// The rod in the initial shape of the search, without additional nodes at contacts.
    pub rod: &'a Rod,
    /// The elastic law.
    pub material: &'a C,
    /// The load.
    pub load: &'a L,
    /// The support.
    pub support: &'a U,
    /// Time and gravity.
    pub environment: &'a Environment,
    /// What the search takes from earlier equilibria.
    pub(crate) past: Past<'a>,
}

/// What a search takes from earlier equilibria, and whether it omits the last descent; nothing, and
/// no, by default.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Past<'a> {
    /// Reactions and contacts of the last equilibrium.
    pub earlier: (&'a [Reaction], &'a [Patch]),
    /// Shape of the last equilibrium with its nodes at contacts; `None` without such nodes.
    pub shape: Option<&'a Rod>,
    /// The start of the increment in time: contacts are followed from there, and friction depends
    /// on the displacement.
    pub start: Option<&'a IncrementStart>,
    /// Rotation vectors of the last equilibrium, if `rod` has an extrapolated shape and touches no
    /// obstacle.
    pub last: Option<&'a [Vector3<f64>]>,
    /// Whether the descent to any equilibrium is omitted. In contact this descent follows a failure
    /// of Newton's method and of a descent within 1e-3 of the length. A free rod ignores it.
    pub omits_descent: bool,
}

impl Equilibrium {
    /// Checks what a solver reports.
    ///
    /// # Errors
    /// The first number that no equilibrium has.
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative(
            "error that the equilibrium solver reports",
            self.error,
            "rad",
        )?;
        ParameterError::finite(
            "energy that the equilibrium solver reports",
            self.energy,
            "J",
        )?;
        ParameterError::not_negative(
            "jump that the equilibrium solver reports",
            self.jump.unwrap_or(0.0),
            "m",
        )?;
        let (name, margin) = (
            "margin of stability that the equilibrium solver reports",
            self.inertia.margin,
        );
        ParameterError::unless(
            !margin.is_nan(),
            name,
            margin,
            "a number, or infinite without a tangent",
        )
    }
}

impl std::fmt::Display for Equilibrium {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Inertia {
            negative,
            neutral,
            positive,
            ..
        } = self.inertia;
        write!(
            f,
            "{} iterations, error {:.1e} rad, energy {:.6e} J",
            self.iterations, self.error, self.energy
        )?;
        if negative + neutral + positive > 0 {
            write!(f, ", {negative} negative and {neutral} neutral eigenvalues")?;
        }
        self.jump.map_or(Ok(()), |jump| {
            write!(f, ", {jump:.1e} m from an unstable shape")
        })
    }
}

/// Equilibria next to a given one, to first order.
pub(crate) trait NearbyEquilibria {
    /// Moves the frames of `rod` to equilibrium to first order. `rod` is a copy of the linearised
    /// rod with a small disturbance of the intrinsic strain.
    fn follow(&mut self, rod: &mut Rod);

    /// The force in the rod that was moved last.
    fn force(&self) -> &InternalForce;
}

/// A solver for the equilibrium of a rod.
///
/// Steepest descent, with steps that the tangent scales:
///
/// ```
/// use morphorod::constitutive::{Constitutive, LinearElastic};
/// use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver, RodEnergy};
/// use morphorod::load::{InternalForce, Weight};
/// use morphorod::nalgebra::{UnitQuaternion, Vector3};
/// use morphorod::rod::Rod;
/// use morphorod::{Order, Scene, Still};
///
/// struct Descent {
///     /// Couple at which the search ends, N m.
///     couple: f64,
/// }
///
/// impl EquilibriumSolver for Descent {
///     fn equilibrate(
///         &mut self,
///         rod: &mut Rod,
///         material: &impl Constitutive,
///         force: &InternalForce,
///     ) -> Result<Equilibrium, EquilibriumError> {
///         let energy = RodEnergy::new(material, force);
///         // The sum of a row bounds the eigenvalues of the tangent (Gershgorin).
///         let stiffness = energy.tangent(rod)?.to_dense().row_iter().map(|row| row.abs().sum()).fold(0.0, f64::max);
///         let (mut shape, mut frames) = (rod.clone(), rod.node_frames());
///         let (mut found, mut largest) = (Equilibrium::default(), f64::INFINITY);
///         for evaluation in 1..=100_000 {
///             let (value, couples) = energy.couples(&shape)?;
///             (found.evaluations, found.energy) = (evaluation, value);
///             largest = couples[1..].iter().map(|couple| couple.norm()).fold(0.0, f64::max);
///             if largest <= self.couple {
///                 // The rod changes only now: after an error it is the one before the call.
///                 rod.set_shape(&frames, &energy.line_strains(&shape)?)?;
///                 return Ok(found);
///             }
///             for (frame, couple) in frames.iter_mut().zip(&couples).skip(1) {
///                 *frame *= UnitQuaternion::from_scaled_axis(couple / stiffness);
///             }
///             shape.set_shape(&frames, &[])?;
///         }
///         let (step, residual, force) = (largest / stiffness, largest, force.largest());
///         Err(EquilibriumError::NoConvergence { iterations: 100_000, step, residual, force, contact: None })
///     }
/// }
///
/// let scene = Still::tilted(1.0);
/// let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// let (weight, now) = (Weight { density: 1000.0 }, scene.environment(0.0));
/// let rod = Rod::uniform(0.04, 0.5e-3, scene.base, 2, Order::Four)?;
/// let (mut descended, mut exact) = (rod.clone(), rod);
/// let _ = Descent { couple: 1e-15 }.solve(&mut descended, &tissue, &weight, &now)?;
/// let _ = NewtonSolver::default().solve(&mut exact, &tissue, &weight, &now)?;
/// assert!((descended.tip() - exact.tip()).norm() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait EquilibriumSolver {
    /// Moves the frames of `rod` to an equilibrium under its intrinsic strain and the force in it.
    /// The initial guess is the current configuration. The frame of the base does not change. The
    /// force must be that in this rod.
    ///
    /// An integrator adds the counts of the result to its
    /// [`Statistics`](crate::integrator::Statistics), on which limits of work depend. It reports a
    /// snap for a result with `jump`. `error` is a part of the error estimate of
    /// [`Adaptive`](crate::integrator::Adaptive). The other fields are for the user.
    ///
    /// An integrator examines the result of a solver that is not [trusted](Self::is_trusted).
    ///
    /// # Errors
    /// See [`EquilibriumError`]; the rod does not change then.
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError>;

    /// Whether the solver examines its results itself, as those of the crate do; `false` by
    /// default.
    ///
    /// If not, an integrator compares elements, growth zone and base of a shoot without supports
    /// with those before each call, and its material points with those before the first one. A
    /// shape that is farther from equilibrium than 0.1 rad and than the `error` that the solver
    /// reports is an error. This costs one evaluation of the couples.
    fn is_trusted(&self) -> bool {
        false
    }

    /// Finds an equilibrium of a rod with a support. A solver that does not implement this method
    /// returns an error.
    ///
    /// # Errors
    /// See [`EquilibriumError`].
    fn hold<C: Constitutive, L: Load, U: Support>(
        &mut self,
        _held: &HeldRod<C, L, U>,
    ) -> Result<Held, EquilibriumError> {
        let name = "number of supports";
        let requirement = "zero for a solver that does not implement `EquilibriumSolver::hold`";
        Err(ParameterError::refused(name, 1.0, requirement).into())
    }

    /// Moves the frames of `rod` to an equilibrium under a load. The parameters of the elastic law
    /// are checked.
    ///
    /// # Errors
    /// See [`EquilibriumError`]; the rod does not change then.
    fn solve(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Equilibrium, EquilibriumError> {
        material.check()?;
        let force = InternalForce::of(rod, load, environment);
        self.equilibrate(rod, material, &force)
    }
}
