//! Equilibrium of a rod under its load, equations (1) and (9) to (12).

mod balance;
mod coarse;
mod element;
mod elimination;
mod error;
mod held;
mod joints;
mod line;
mod newton;
mod points;
mod rod_energy;
mod saddle;
mod search;
mod system;
mod tangent;
mod unloaded;

pub(crate) use balance::check_balance;
pub use error::{ContactViolation, EquilibriumError};
pub(crate) use newton::{LARGEST_TOLERANCE, check_tolerance};
pub use newton::{NewtonSolver, NewtonWorkspace};
pub use rod_energy::{NodeTangent, RodEnergy};
pub use unloaded::Unloaded;

use nalgebra::Vector3;

use crate::check::{self, LawError};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::{Rod, Tissue, centre_line_tangent};
use crate::scene::Environment;
use crate::support::{Patch, Reaction, Support};

/// Signs of the eigenvalues of the second derivative of the energy.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Inertia {
    /// Number of negative eigenvalues, the Morse index: zero at a stable equilibrium.
    pub negative: usize,
    /// Number of eigenvalues that are zero up to rounding. An isotropic buckled shoot on an exactly upright base has
    /// one, for rotations about the vertical, and is stable.
    pub neutral: usize,
    /// Number of positive eigenvalues.
    pub positive: usize,
    /// Smallest pivot relative to the diagonal entry before elimination: a measure of the distance from a change of
    /// stability. It is negative if an eigenvalue is, and infinite by default, without any pivot. With a support it has
    /// no sign: it is the magnitude of this pivot, or of the smallest scaled eigenvalue for the reactions if that is
    /// less, and only the counts decide stability.
    pub margin: f64,
}

impl Default for Inertia {
    fn default() -> Self {
        Self { negative: 0, neutral: 0, positive: 0, margin: f64::INFINITY }
    }
}

/// Counts, error and stability of an equilibrium. The counts do not include the search on a coarse mesh that improves a
/// straight initial guess.
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
    /// Estimated largest error of a frame against the exact stationary point of the discrete energy, rad. With
    /// obstacles it is at least the largest penetration of the discrete rod relative to the length, which a coarse rod
    /// may have between its stations.
    pub error: f64,
    /// Total energy, J: the elastic energy, which is zero without elastic strain, minus ∫ n · p′ ds, the work of
    /// the load as the tissue moves from the position of the base to its own. Zero for [`Unloaded`], which does not
    /// evaluate it.
    pub energy: f64,
    /// Signs of the eigenvalues of the tangent at the equilibrium. For a solver without tangent the counts are zero
    /// and the margin is infinite.
    pub inertia: Inertia,
    /// Displacement of the tip (m) since the first unstable configuration of the search, unless the equilibrium is the
    /// continuation of the initial guess. It is the continuation if the unbalanced couples of the guess cause at least
    /// a fifth of the rotation from there. For a rod with a support it is the largest displacement of the centre
    /// line from the initial guess. `None` if all configurations of the search were stable, and if a rod with a support
    /// was found by a descent within 1e-3 of the length from the initial guess.
    pub jump: Option<f64>,
    /// Smallest pivot of the last tangent, relative to that of the same rod without load: a distance from the loss of
    /// stability that does not depend on the mesh. Zero for a solver without tangent.
    pub(crate) resistance: f64,
}

/// Equilibrium of a rod with a support.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct Held {
    /// Counts, error and stability. The inertia is that on the directions that the supports permit.
    pub equilibrium: Equilibrium,
    /// Number of increments in which the holds were moved to their places, and in a time step also the base and the
    /// obstacles. They are the load path, on which an equilibrium depends if there are several.
    pub increments: usize,
    /// The reactions: of the holds of positions in their order, of the springs with a potential, of the
    /// contacts, and of the holds of frames alone. They are also the [`Rod::reactions`] of `rod`.
    pub reactions: Vec<Reaction>,
    /// The rod in its shape, with additional nodes where contacts begin and end.
    pub rod: Rod,
    pub(crate) patches: Vec<Patch>,
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
    /// Reactions and contacts of the last equilibrium.
    pub(crate) earlier: (&'a [Reaction], &'a [Patch]),
    /// Shape of the last equilibrium with its nodes at contacts; `None` without such nodes.
    pub(crate) shape: Option<&'a Rod>,
    /// The rod at the end of the increment before, the time since then (s), and its reactions: contacts are followed
    /// from there, and friction depends on the displacement.
    pub(crate) before: Option<(&'a Rod, f64, &'a [Reaction])>,
    /// Whether the search fails where no equilibrium is within 1e-3 of the length from the initial guess. Otherwise a
    /// rod in contact descends to another equilibrium.
    pub(crate) nearby: bool,
}

impl Equilibrium {
    /// Checks what a solver reports.
    ///
    /// # Errors
    /// The first number that no equilibrium has.
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative("error that the equilibrium solver reports", self.error, "rad")?;
        ParameterError::finite("energy that the equilibrium solver reports", self.energy, "J")?;
        ParameterError::not_negative("jump that the equilibrium solver reports", self.jump.unwrap_or(0.0), "m")?;
        let (name, margin) = ("margin of stability that the equilibrium solver reports", self.inertia.margin);
        ParameterError::unless(!margin.is_nan(), name, margin, "a number, or infinite without a tangent")
    }
}

impl std::fmt::Display for Equilibrium {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Inertia { negative, neutral, positive, .. } = self.inertia;
        write!(f, "{} iterations, error {:.1e} rad, energy {:.6e} J", self.iterations, self.error, self.energy)?;
        if negative + neutral + positive > 0 {
            write!(f, ", {negative} negative and {neutral} neutral eigenvalues")?;
        }
        self.jump.map_or(Ok(()), |jump| write!(f, ", {jump:.1e} m from an unstable shape"))
    }
}

/// Largest angle (rad) or strain that an elastic law may request without load, due to rounding.
const UNSTRAINED: f64 = 1e-9;

/// Returns an error for an elastic law without positive stiffness, or without a finite response to a force, at
/// some place of a rod at a time (s).
pub(crate) fn check_stiffness(rod: &Rod, material: &impl Constitutive, time: f64) -> Result<(), ParameterError> {
    let (length, zero) = (rod.length(), Vector3::zeros());
    let responds = |tissue: &Tissue| usize::from(material.line_response(tissue, &zero).is_some());
    let at_base = rod.points().first().map_or(0, |point| responds(&Tissue::of(point, time)));
    for point in rod.points() {
        let tissue = Tissue::of(point, time);
        let at = |error: ParameterError| error.at(rod.initial_length() - point.initial_apex_distance);
        let response = material.respond(&tissue, &zero);
        let stiffness = response.tangent.diagonal();
        for (i, name) in ["stiffness K1", "stiffness K2", "stiffness K3"].into_iter().enumerate() {
            // A subnormal number has lost digits.
            let sound = stiffness[i] > 0.0 && stiffness[i].is_normal();
            let requirement = "positive and finite: check the elastic law, its modulus and the radius (N m²)";
            ParameterError::unless(sound, name, stiffness[i], requirement).map_err(at)?;
        }
        let (couple, requirement) =
            (response.couple.norm(), "zero: describe a prestrain by the intrinsic strain (N m)");
        // The couple times the length over the stiffness is the angle by which the rod bends.
        let vanishes = couple * length < UNSTRAINED * stiffness.min();
        ParameterError::unless(vanishes, "couple without elastic strain", couple, requirement).map_err(at)?;
        ParameterError::finite("elastic energy without elastic strain", response.energy, "J/m").map_err(at)?;
        let (name, counts) = ("number of responses of the centre line to a force", [responds(&tissue), at_base]);
        let requirement = "as at the base: `line_response` returns `None` at all places or at none";
        ParameterError::count(name, counts, requirement).map_err(at)?;
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
        ParameterError::unless(strained < UNSTRAINED, name, strained, "zero").map_err(at)?;
    }
    Ok(())
}

/// Returns an error for an elastic law whose methods contradict each other at the base or at the apex of a rod.
pub(crate) fn check_law(rod: &Rod, material: &impl Constitutive, force: &InternalForce) -> Result<(), Box<LawError>> {
    let (length, p, last) = (rod.length(), rod.order().points(), rod.points().len() - 1);
    [0, last].into_iter().try_for_each(|i| {
        let tissue = Tissue::of(&rod.points()[i], force.environment().time);
        let along = rod.frame_at_point(i / p, i % p).inverse_transform_vector(&force.at_points()[i]);
        let points = check::STRAINS.map(|strain| (Vector3::from(strain) / length, along));
        check::elastic_law(material, &tissue, &points).map_err(Box::new)
    })
}

/// Equilibria next to a given one, to first order.
pub(crate) trait NearbyEquilibria {
    /// Moves the frames of `rod` to equilibrium to first order. `rod` is a copy of the linearised rod with a small
    /// disturbance of the intrinsic strain.
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
    /// Moves the frames of `rod` to an equilibrium under its intrinsic strain and the force in it. The initial
    /// guess is the current configuration. The frame of the base does not change. The force must be that in
    /// this rod.
    ///
    /// An integrator adds the counts of the result to its [`Statistics`](crate::integrator::Statistics), on which
    /// limits of work depend. It reports a snap for a result with `jump`. `error` is a part of the error estimate of
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

    /// Whether the solver examines its results itself, as those of the crate do; `false` by default.
    ///
    /// If not, an integrator compares elements, growth zone and base of a shoot without supports with those before each
    /// call, and its material points with those before the first one. A shape that is farther from equilibrium than 0.1
    /// rad and than the `error` that the solver reports is an error. This costs one evaluation of the couples.
    fn is_trusted(&self) -> bool {
        false
    }

    /// Finds an equilibrium of a rod with a support. A solver that does not implement this method returns an error.
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

    /// Moves the frames of `rod` to an equilibrium under a load. The parameters of the elastic law are checked.
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
