//! Solver for equilibria by Newton's method: settings and interface.

use nalgebra::Vector3;

use super::line::{check_line, strain_line};
use super::search::Search;
use super::system::System;
use super::unloaded::check_turns;
use super::{Equilibrium, EquilibriumError, EquilibriumSolver, Inertia, check_stiffness};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;

/// Calls a method that is generic over the number of Gauss points in an element.
macro_rules! with_points {
    ($rod:expr, $object:expr, $method:ident $arguments:tt) => {
        match $rod.order().points() {
            1 => $object.$method::<1> $arguments,
            2 => $object.$method::<2> $arguments,
            3 => $object.$method::<3> $arguments,
            _ => $object.$method::<4> $arguments,
        }
    };
}

/// Kind of equilibria that are accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Branch {
    /// Stable equilibria: the energy is minimised, and the search leaves saddles.
    #[default]
    Stable,
    /// The equilibrium close to the initial guess, stable or not, by Newton's method with a bounded step.
    Nearest,
}

/// Newton's method over faer's sparse LDLᵀ factorisation, equations (9) to (12).
///
/// The solver has settings and workspace, but no state: calls with equal rods give equal results.
#[derive(Debug)]
pub struct NewtonSolver {
    /// Largest acceptable error of a frame against the exact minimum of the discrete energy, rad.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Kind of equilibria that are accepted.
    pub branch: Branch,
    system: System,
    /// Strain of the centre line of an equilibrium before it is accepted.
    line_strains: Vec<Vector3<f64>>,
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria.
    fn default() -> Self {
        let (system, line_strains) = (System::default(), Vec::new());
        Self { tolerance: 1e-11, max_iterations: 1000, branch: Branch::Stable, system, line_strains }
    }
}

impl NewtonSolver {
    /// A solver with the given largest error of a frame, rad, and the other defaults.
    #[must_use]
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { tolerance, ..Self::default() }
    }
}

impl Clone for NewtonSolver {
    /// Clones the settings. The workspace is allocated when it is needed.
    fn clone(&self) -> Self {
        let Self { tolerance, max_iterations, branch, .. } = *self;
        Self { tolerance, max_iterations, branch, ..Self::default() }
    }
}

impl EquilibriumSolver for NewtonSolver {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        ParameterError::positive("tolerance of the equilibrium", self.tolerance)?;
        force.check(rod)?;
        if !force.largest().is_finite() {
            return Err(EquilibriumError::NotFinite { what: "force in the rod" });
        }
        self.system.initial.keep(rod);
        let answer = with_points!(rod, self, search(rod, material, force)).and_then(|found| {
            strain_line(&mut self.line_strains, rod, material, force);
            check_line(&self.line_strains, force)?;
            std::mem::swap(rod.line_strains_mut(), &mut self.line_strains);
            Ok(found)
        });
        if answer.is_err() {
            self.system.initial.restore(rod);
        }
        if let Err(EquilibriumError::NoConvergence { .. } | EquilibriumError::Folded { .. }) = answer {
            // These are the most likely reasons.
            check_stiffness(rod, material, force.environment().time)?;
            check_turns(rod)?;
        }
        answer
    }
}

impl NewtonSolver {
    /// The inertia of the second derivative of the energy at the current frames, in equilibrium or not.
    ///
    /// # Errors
    /// An input that is not finite.
    pub fn inertia(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Inertia, EquilibriumError> {
        self.factorise(rod, material, &InternalForce::of(rod, load, environment))
    }

    /// Factorises the tangent at an equilibrium.
    ///
    /// # Errors
    /// An input that is not finite.
    pub(crate) fn linearise<'a, C: Constitutive>(
        &'a mut self,
        rod: &Rod,
        material: &'a C,
        force: &'a InternalForce,
    ) -> Result<FactorisedTangent<'a, C>, EquilibriumError> {
        self.factorise(rod, material, force)?;
        Ok(FactorisedTangent { system: &mut self.system, material, force })
    }

    fn factorise(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Inertia, EquilibriumError> {
        with_points!(rod, self.system, assemble(rod, material, force, 0.0)).map(|(_, inertia)| inertia)
    }

    fn search<const P: usize>(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let stable = self.branch == Branch::Stable;
        Search::<_, P>::new(&mut self.system, rod, material, force, stable, self.tolerance)
            .run(rod, self.max_iterations)
    }
}

/// The factorised tangent at an equilibrium.
pub(crate) struct FactorisedTangent<'a, C> {
    system: &'a mut System,
    material: &'a C,
    force: &'a InternalForce,
}

impl<C: Constitutive> FactorisedTangent<'_, C> {
    /// Moves the frames of `rod` to equilibrium to first order. `rod` is a copy of the linearised rod with a small
    /// disturbance of the intrinsic strain.
    pub fn follow(&mut self, rod: &mut Rod) {
        with_points!(rod, self.system, follow(rod, self.material, self.force));
        let mut strains = std::mem::take(rod.line_strains_mut());
        strain_line(&mut strains, rod, self.material, self.force);
        *rod.line_strains_mut() = strains;
    }
}
