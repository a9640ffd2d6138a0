//! Solver for equilibria by Newton's method: settings and interface.

use nalgebra::Vector3;

use super::contact::{self, ContactSearch, body_of};
use super::held::{Found, HeldSearch, HeldWorkspace};
use super::line::{check_line, complete, strain_line};
use super::search::Search;
use super::system::System;
use super::unloaded::check_turns;
use super::{
    Equilibrium, EquilibriumError, EquilibriumSolver, Held, HeldRod, Inertia, NearbyEquilibria, check_stiffness,
};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;
use crate::support::{Reaction, Support};

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

/// Newton's method for equations (9) to (12), with faer's sparse LDLᵀ factorisation.
///
/// The solver has settings and workspace, but no state: calls with equal rods give equal results. Settings are
/// written as a struct literal:
///
/// ```
/// use morphorod::equilibrium::NewtonSolver;
///
/// let solver = NewtonSolver { stable_only: false, max_iterations: 50, ..NewtonSolver::default() };
/// # let _ = solver;
/// ```
#[derive(Debug, Clone)]
pub struct NewtonSolver {
    /// Largest acceptable error of a frame against the exact stationary point of the discrete energy, rad; positive.
    pub tolerance: f64,
    /// Largest number of Newton iterations. With a support, the increments of the load path and the search for
    /// contacts have bounds of their own, and [`Equilibrium::iterations`], the sum over them, may be larger.
    pub max_iterations: usize,
    /// Whether only stable equilibria are accepted: the energy is minimised, and the search leaves saddles. Otherwise
    /// the search finds the equilibrium close to the initial guess, stable or not, by Newton's method with a bounded
    /// step.
    pub stable_only: bool,
    /// Memory that successive calls reuse, allocated by the first of them. Its type is not exported;
    /// `..NewtonSolver::default()` sets it.
    pub workspace: Workspace,
}

/// Memory that successive calls of a [`NewtonSolver`] reuse. A clone is empty.
#[derive(Debug, Default)]
pub struct Workspace {
    system: System,
    held: HeldWorkspace,
    /// Strain of the centre line of an equilibrium before it is accepted.
    line_strains: Vec<Vector3<f64>>,
}

impl Clone for Workspace {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria only.
    fn default() -> Self {
        Self { tolerance: 1e-11, max_iterations: 1000, stable_only: true, workspace: Workspace::default() }
    }
}

impl NewtonSolver {
    /// A solver with the given largest error of a frame, rad, and the other defaults. The tolerance must be positive;
    /// [`equilibrate`](EquilibriumSolver::equilibrate) returns an error otherwise.
    #[must_use]
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self { tolerance, ..Self::default() }
    }

    /// The inertia of the second derivative of the energy at the current frames, in equilibrium or not. The variables
    /// are the rotations of the frames at the ends of the elements, except the base, and the rotation vectors of the
    /// nodes inside the elements.
    ///
    /// # Errors
    /// [`EquilibriumError::NotFinite`] for an input that is not finite, and [`EquilibriumError::Parameter`] for
    /// a rod of more elements than fit in memory.
    pub fn inertia(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Inertia, EquilibriumError> {
        self.factorise(rod, material, &InternalForce::of(rod, load, environment))
    }

    /// Factorises the tangent at an equilibrium under a load and with a support. `force` is the force in the rod, with
    /// the reactions.
    ///
    /// # Errors
    /// See [`inertia`](Self::inertia); holds for which shape or reactions are not determined to first order.
    pub(crate) fn linearise<'a>(
        &'a mut self,
        rod: &'a Rod,
        material: &'a impl Constitutive,
        (load, support): (&'a impl Load, &'a impl Support),
        force: &'a mut InternalForce,
    ) -> Result<Box<dyn NearbyEquilibria + 'a>, EquilibriumError> {
        if support.is_absent() {
            self.factorise(rod, material, force)?;
            return Ok(Box::new(FactorisedTangent { system: &mut self.workspace.system, material, force }));
        }
        with_points!(rod, self, linearise_held(rod, (material, load), force, support))
    }

    fn linearise_held<'a, const P: usize>(
        &'a mut self,
        rod: &'a Rod,
        material: (&'a impl Constitutive, &'a impl Load),
        force: &'a mut InternalForce,
        support: &'a impl Support,
    ) -> Result<Box<dyn NearbyEquilibria + 'a>, EquilibriumError> {
        let Workspace { system, held, .. } = &mut self.workspace;
        let reactions = force.reactions().to_vec();
        let mut search = HeldSearch::<_, _, P>::new((system, held), rod, material, force, support, (false, 1.0))?;
        search.guess_forces(&reactions);
        Ok(Box::new(search.linearise(rod)?))
    }

    fn factorise(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Inertia, EquilibriumError> {
        with_points!(rod, self.workspace.system, assemble(rod, material, force, 0.0)).map(|(_, inertia)| inertia)
    }

    /// Moves the frames of `rod` to an equilibrium under a load and with supports.
    ///
    /// Holds move from the present places of the rod to the requested ones in increments of at most 0.05 times the
    /// length and 0.3 rad, each of which ends in equilibrium. This is the load path. A start inside an obstacle is
    /// pushed out along the normal. `rod` keeps its nodes. [`Held::rod`] has additional nodes where contacts begin and
    /// end, and represents the shape between nodes more accurately. Both have the [`reactions`](Rod::reactions), which
    /// a [`Profile`](crate::profile::Profile) of them includes.
    ///
    /// # Errors
    /// See [`EquilibriumError`]; the rod does not change then.
    pub fn solve_held(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        load: &impl Load,
        support: &impl Support,
        environment: &Environment,
    ) -> Result<Held, EquilibriumError> {
        let held = self.hold(&HeldRod {
            rod,
            material,
            load,
            support,
            environment,
            earlier: (&[], &[]),
            shape: None,
            before: None,
        })?;
        if held.rod.elements() == rod.elements() {
            rod.copy_from(&held.rod);
        } else {
            rod.sample_shape(&held.rod);
        }
        Ok(held)
    }

    /// The inertia of the second derivative of the energy on the directions that supports permit, at the current
    /// frames and with the given reactions.
    ///
    /// # Errors
    /// See [`EquilibriumError`].
    pub fn inertia_held(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        support: &impl Support,
        environment: &Environment,
        reactions: &[Reaction],
    ) -> Result<Inertia, EquilibriumError> {
        let mut force = InternalForce::of(rod, load, environment);
        with_points!(rod, self, inertia_of(rod, (material, load), &mut force, support, reactions))
    }

    fn inertia_of<const P: usize>(
        &mut self,
        rod: &Rod,
        material: (&impl Constitutive, &impl Load),
        force: &mut InternalForce,
        support: &impl Support,
        reactions: &[Reaction],
    ) -> Result<Inertia, EquilibriumError> {
        let Workspace { system, held, .. } = &mut self.workspace;
        let mut search = HeldSearch::<_, _, P>::new((system, held), rod, material, force, support, (false, 1.0))?;
        search.guess_forces(reactions);
        let inertia = search.inertia(rod);
        self.workspace.system.joints.clear();
        inertia
    }

    /// The reactions of springs and elastic joints at a shape, in equilibrium or not. Holds keep the forces of `guess`.
    ///
    /// # Errors
    /// Holds that do not belong to the rod.
    pub(crate) fn reactions_at(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        (load, support): (&impl Load, &impl Support),
        environment: &Environment,
        guess: &[Reaction],
    ) -> Result<Vec<Reaction>, EquilibriumError> {
        let mut force = InternalForce::of(rod, load, environment);
        let reactions = with_points!(rod, self, reactions_of(rod, (material, load), &mut force, support, guess));
        self.workspace.system.joints.clear();
        reactions
    }

    fn reactions_of<const P: usize>(
        &mut self,
        rod: &Rod,
        material: (&impl Constitutive, &impl Load),
        force: &mut InternalForce,
        support: &impl Support,
        guess: &[Reaction],
    ) -> Result<Vec<Reaction>, EquilibriumError> {
        let Workspace { system, held, .. } = &mut self.workspace;
        let mut search = HeldSearch::<_, _, P>::new((system, held), rod, material, force, support, (false, 1.0))?;
        search.guess_forces(guess);
        Ok(search.reactions_at(rod))
    }

    fn search_held<C: Constitutive, L: Load, U: Support, const P: usize>(
        &mut self,
        held: &HeldRod<C, L, U>,
        quick: bool,
    ) -> Result<Held, EquilibriumError> {
        let &HeldRod { rod, material, load, support, environment, earlier, shape: last, before } = held;
        let mut force = InternalForce::of(rod, load, environment);
        if !force.largest().is_finite() {
            return Err(EquilibriumError::NotFinite { what: "force in the rod" });
        }
        let kind = (self.stable_only, self.tolerance);
        let Workspace { system, held, .. } = &mut self.workspace;
        let mut search = HeldSearch::<_, _, P>::new((system, held), rod, (material, load), &mut force, support, kind)?;
        if let Some(before) = before {
            search.since(before);
        }
        search.end_early(quick);
        let mut shape = rod.clone();
        search.guess(&mut shape, earlier, last);
        let Found { equilibrium, increments, foundations, reactions, patches } =
            search.run(&mut shape, self.max_iterations)?;
        complete(&mut shape, material, &force, &reactions)?;
        Ok(Held { equilibrium, increments, foundations, reactions, rod: shape, patches })
    }

    /// Searches for an equilibrium with supports. A `quick` search ends after its first failure.
    fn search_with_points<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
        quick: bool,
    ) -> Result<Held, EquilibriumError> {
        let answer = match held.rod.order().points() {
            1 => self.search_held::<_, _, _, 1>(held, quick),
            2 => self.search_held::<_, _, _, 2>(held, quick),
            3 => self.search_held::<_, _, _, 3>(held, quick),
            _ => self.search_held::<_, _, _, 4>(held, quick),
        };
        self.workspace.system.joints.clear();
        answer
    }

    /// Searches for an equilibrium with contacts by the contact problem in each iteration.
    fn search_contacts<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
    ) -> Result<Held, EquilibriumError> {
        let &HeldRod { rod, material, load, support, environment, earlier, shape: last, before } = held;
        let mut force = InternalForce::of(rod, load, environment);
        let bound = self.max_iterations;
        let body = body_of(rod, (material, load), &mut force, &mut self.workspace.system);
        let mut search = ContactSearch::new(body, rod, support, (self.stable_only, self.tolerance))?;
        if let Some(before) = before {
            search.since(before);
        }
        let mut shape = rod.clone();
        search.guess(&mut shape, earlier, last);
        let contact::Found { equilibrium, increments, reactions, patches } = search.run(&mut shape, bound)?;
        complete(&mut shape, material, &force, &reactions)?;
        Ok(Held { equilibrium, increments, foundations: 0, reactions, rod: shape, patches })
    }

    fn search<const P: usize>(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let system = &mut self.workspace.system;
        Search::<_, P>::new(system, rod, material, force, self.stable_only, self.tolerance)
            .run(rod, self.max_iterations)
    }
}

impl EquilibriumSolver for NewtonSolver {
    fn hold<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
    ) -> Result<Held, EquilibriumError> {
        ParameterError::positive("tolerance of the equilibrium", self.tolerance)?;
        held.support.check()?;
        // A search for the contacts that does not succeed at once seldom does later.
        let contacts = self.stable_only && !held.support.contacts().is_empty();
        let fails = |error: &EquilibriumError| contacts && error.is_recoverable();
        let mut answer = self.search_with_points(held, contacts);
        if answer.as_ref().is_err_and(fails) {
            answer = self.search_contacts(held);
            self.workspace.system.joints.clear();
        }
        if answer.as_ref().is_err_and(fails) {
            answer = self.search_with_points(held, false);
        }
        answer
    }

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
        self.workspace.system.initial.keep(rod);
        let answer = with_points!(rod, self, search(rod, material, force)).and_then(|found| {
            let strains = &mut self.workspace.line_strains;
            strain_line(strains, rod, material, force);
            check_line(strains, force)?;
            std::mem::swap(rod.line_strains_mut(), strains);
            rod.reactions_mut().clear();
            Ok(found)
        });
        if answer.is_err() {
            self.workspace.system.initial.restore(rod);
        }
        if let Err(EquilibriumError::NoConvergence { .. } | EquilibriumError::Folded { .. }) = answer {
            // The most likely reasons are a law without stiffness and elements that are too long.
            check_stiffness(rod, material, force.environment().time)?;
            check_turns(rod)?;
        }
        answer
    }
}

/// The factorised tangent at an equilibrium of a free rod.
struct FactorisedTangent<'a, C> {
    system: &'a mut System,
    material: &'a C,
    force: &'a InternalForce,
}

impl<C: Constitutive> NearbyEquilibria for FactorisedTangent<'_, C> {
    fn follow(&mut self, rod: &mut Rod) {
        with_points!(rod, self.system, follow(rod, self.material, self.force));
        let mut strains = std::mem::take(rod.line_strains_mut());
        strain_line(&mut strains, rod, self.material, self.force);
        *rod.line_strains_mut() = strains;
    }

    fn force(&self) -> &InternalForce {
        self.force
    }
}
