//! Newton's method for the frames of a rod: settings, and what it is asked for.

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
        match $rod.order.points() {
            1 => $object.$method::<1> $arguments,
            2 => $object.$method::<2> $arguments,
            3 => $object.$method::<3> $arguments,
            _ => $object.$method::<4> $arguments,
        }
    };
}

/// Which equilibria are acceptable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Branch {
    /// A stable one: the energy is minimised, and saddles are left on their way down.
    #[default]
    Stable,
    /// The one nearest to the first guess, stable or not: plain Newton with a bounded step.
    Nearest,
}

/// Newton's method over faer's sparse LDLᵀ factorisation, equations (9) to (12).
///
/// Keeps settings and memory, no state: two calls with equal rods give equal answers.
#[derive(Debug)]
pub struct NewtonSolver {
    /// Largest acceptable error of a frame against the exact minimum of the discrete energy, rad.
    pub tolerance: f64,
    /// Bound on the iterations.
    pub max_iterations: usize,
    /// Which equilibria are acceptable.
    pub branch: Branch,
    system: System,
    /// Shear and stretch of the answer before it is given.
    line_strains: Vec<Vector3<f64>>,
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria only.
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
    /// Clones the settings; the memory is made anew when it is needed.
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
            std::mem::swap(&mut rod.line_strains, &mut self.line_strains);
            Ok(found)
        });
        if answer.is_err() {
            self.system.initial.restore(rod);
        }
        if let Err(EquilibriumError::NoConvergence { .. } | EquilibriumError::Folded { .. }) = answer {
            // The most likely reasons, if they are there.
            check_stiffness(rod, material, force.environment().time)?;
            check_turns(rod)?;
        }
        answer
    }
}

impl NewtonSolver {
    /// The signs of the energy's second derivative at the frames that the rod has, whether in equilibrium or not.
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

/// The tangent at an equilibrium, factorised.
pub(crate) struct FactorisedTangent<'a, C> {
    system: &'a mut System,
    material: &'a C,
    force: &'a InternalForce,
}

impl<C: Constitutive> FactorisedTangent<'_, C> {
    /// Moves the frames of `rod` to equilibrium again, to first order. It is a copy of the rod that was linearised,
    /// whose intrinsic strain was disturbed a little.
    pub fn follow(&mut self, rod: &mut Rod) {
        with_points!(rod, self.system, follow(rod, self.material, self.force));
        let mut strains = std::mem::take(&mut rod.line_strains);
        strain_line(&mut strains, rod, self.material, self.force);
        rod.line_strains = strains;
    }
}
