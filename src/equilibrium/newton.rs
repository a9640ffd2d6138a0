//! Solver for equilibria by Newton's method: settings and interface.

use nalgebra::Vector3;

use super::checks::{check_finite, explained};
use super::error::Outcome;
use super::held::{Body, HeldSearch, jump_between};
use super::line::{check_line, strain_line};
use super::search::NewtonSearch;
use super::system::System;
use super::{
    Equilibrium, EquilibriumError, EquilibriumSolver, Held, HeldRod, Inertia, NearbyEquilibria,
    Past, RodEnergy,
};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::scene::Environment;
use crate::support::{Reaction, Support};

/// Newton's method for equations (9) to (12), with faer's sparse LDLᵀ factorisation.
///
/// The solver has settings and workspace, but no state: calls with equal rods give equal results.
/// Settings are written as a struct literal:
///
/// ```
/// use morphorod::equilibrium::NewtonSolver;
///
/// let solver = NewtonSolver { stable_only: false, max_iterations: 50, ..NewtonSolver::default() };
/// # let _ = solver;
/// ```
#[derive(Debug, Clone)]
pub struct NewtonSolver {
    /// Largest acceptable error of a frame against the exact stationary point of the discrete
    /// energy, rad: from 2.3e-16 to 0.1, 1e-11 by default. `Adaptive` sets it from its tolerance,
    /// and `MethodOfSteps::new` uses 1e-8.
    pub tolerance: f64,
    /// Largest number of Newton iterations. With a support, it holds for each increment of the load
    /// path, and [`Equilibrium::iterations`], the sum over the increments, may be larger.
    pub max_iterations: usize,
    /// Whether only stable equilibria are accepted: the energy is minimised, and the search leaves
    /// saddles. Otherwise the search finds the equilibrium close to the initial guess, stable or
    /// not, by Newton's method with a bounded step. If this fails for a rod with supports, a
    /// descent to a stable equilibrium follows, whose distance is [`Equilibrium::jump`].
    pub stable_only: bool,
    /// Memory that successive calls reuse, allocated by the first of them;
    /// `..NewtonSolver::default()` sets it.
    pub workspace: NewtonWorkspace,
}

/// Memory that successive calls of a [`NewtonSolver`] reuse. A clone is empty.
#[derive(Debug, Default)]
pub struct NewtonWorkspace {
    system: System,
    /// Memory for strains of the centre line.
    line_strains: Vec<Vector3<f64>>,
}

impl Clone for NewtonWorkspace {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Default for NewtonSolver {
    /// Error 1e-11 rad, at most 1000 iterations, stable equilibria only.
    fn default() -> Self {
        Self {
            tolerance: 1e-11,
            max_iterations: 1000,
            stable_only: true,
            workspace: NewtonWorkspace::default(),
        }
    }
}

impl NewtonSolver {
    /// A solver with the given largest error of a frame, rad, and the other defaults. The tolerance
    /// must be positive; [`equilibrate`](EquilibriumSolver::equilibrate) returns an error
    /// otherwise.
    #[must_use]
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self {
            tolerance,
            ..Self::default()
        }
    }

    /// The inertia of the second derivative of the energy at the current frames, in equilibrium or
    /// not. The variables are the rotations of the frames at the ends of the elements, except the
    /// base, and the rotation vectors of the nodes inside the elements.
    ///
    /// # Errors
    /// [`EquilibriumError::NotFinite`] for an input that is not finite, and
    /// [`EquilibriumError::Parameter`] for a rod of more elements than fit in memory.
    #[doc(alias = "self-buckling")]
    pub fn inertia(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        environment: &Environment,
    ) -> Result<Inertia, EquilibriumError> {
        material.check()?;
        let force = InternalForce::of(rod, load, environment);
        Ok(self
            .workspace
            .system
            .assemble(rod, &RodEnergy::new(material, &force), 0.0)?
            .1)
    }

    /// Factorises the tangent at an equilibrium under a load and with a support. `force` is the
    /// force in the rod, with the reactions.
    ///
    /// # Errors
    /// See [`inertia`](Self::inertia); holds for which shape or reactions are not determined to
    /// first order.
    pub(crate) fn linearise<'a>(
        &'a mut self,
        rod: &'a Rod,
        material: &'a impl Constitutive,
        (load, support): (&'a impl Load, &'a impl Support),
        force: &'a mut InternalForce,
    ) -> Result<Box<dyn NearbyEquilibria + 'a>, EquilibriumError> {
        if support.is_absent() {
            let body = RodEnergy::new(material, force);
            self.workspace.system.assemble(rod, &body, 0.0)?;
            return Ok(Box::new(FactorisedTangent {
                system: &mut self.workspace.system,
                body,
            }));
        }
        let reactions = force.reactions().to_vec();
        let mut search = self.held(rod, (material, load), force, support, (false, 1.0))?;
        search.guess_forces(&reactions);
        Ok(Box::new(search.linearised(rod)?))
    }

    /// A search for equilibria of a rod with a support.
    fn held<'a>(
        &'a mut self,
        rod: &'a Rod,
        (material, load): (&'a impl Constitutive, &'a impl Load),
        force: &'a mut InternalForce,
        support: &'a impl Support,
        kind: (bool, f64),
    ) -> Result<HeldSearch<'a>, EquilibriumError> {
        let system = &mut self.workspace.system;
        HeldSearch::new(
            Box::new(Body {
                system,
                material,
                load,
                force,
            }),
            rod,
            support,
            kind,
        )
    }

    /// Moves the frames of `rod` to an equilibrium under a load and with supports.
    ///
    /// Holds move from the present places of the rod to the requested ones in increments of at most
    /// 0.05 times the length and 0.3 rad, each of which ends in equilibrium. This is the load path.
    /// Beside obstacles the increments become shorter, so that held frames do not move the rod past
    /// one. A start inside an obstacle is pushed out along the normal. `rod` keeps its nodes.
    /// [`Held::rod`] has additional nodes where contacts begin and end, and represents the shape
    /// between nodes more accurately. Both have the [`reactions`](Rod::reactions), which a
    /// [`Profile`](crate::profile::Profile) of them includes.
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
        material.check()?;
        let held = self.hold(&HeldRod {
            rod,
            material,
            load,
            support,
            environment,
            past: Past::default(),
        })?;
        if held.rod.elements() == rod.elements() {
            rod.copy_from(&held.rod);
        } else {
            rod.sample_shape(&held.rod);
        }
        Ok(held)
    }

    /// The inertia of the second derivative of the energy on the directions that holds, springs and
    /// joints permit, at the current frames and with the given reactions, of which a missing one is
    /// zero. For contacts see [`Equilibrium::inertia`].
    ///
    /// # Errors
    /// See [`EquilibriumError`]; a reaction of an obstacle.
    pub fn inertia_held(
        &mut self,
        rod: &Rod,
        material: &impl Constitutive,
        load: &impl Load,
        support: &impl Support,
        environment: &Environment,
        reactions: &[Reaction],
    ) -> Result<Inertia, EquilibriumError> {
        material.check()?;
        support.check()?;
        let contacts = reactions
            .iter()
            .filter(|reaction| reaction.obstacle.is_some())
            .count();
        let requirement = "zero: `Equilibrium::inertia` is that of an equilibrium in contact";
        ParameterError::unless(
            contacts == 0,
            "number of reactions of obstacles",
            contacts as f64,
            requirement,
        )?;
        let mut force = InternalForce::of(rod, load, environment);
        let mut search = self.held(rod, (material, load), &mut force, support, (false, 1.0))?;
        search.guess_forces(reactions);
        search.inertia(rod)
    }

    /// The reactions of springs and elastic joints at a shape, in equilibrium or not. Holds keep
    /// the forces of `guess`.
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
        let mut search = self.held(rod, (material, load), &mut force, support, (false, 1.0))?;
        search.guess_forces(guess);
        Ok(search.reactions_at(rod))
    }

    /// The equilibrium of the free rod, for a rod with obstacles only that touched none at the
    /// start of the increment. `None` if it is not found next to the initial guess, or if the rod
    /// touches or could pass an obstacle. The counts of the search are written to `spent`.
    fn search_free<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
        spent: &mut Equilibrium,
    ) -> Result<Option<Held>, EquilibriumError> {
        let &HeldRod {
            rod,
            material,
            load,
            support,
            environment,
            past,
        } = held;
        let Some(start) = past.start.filter(|start| start.reactions.is_empty()) else {
            return Ok(None);
        };
        let touches =
            !past.earlier.1.is_empty() || support.base().is_some() || support.contacts().is_empty();
        if touches
            || !support.holds(environment.time).is_empty()
            || !support.potentials().is_empty()
        {
            return Ok(None);
        }
        let mut shape = rod.clone();
        let mut force = InternalForce::of(rod, load, environment);
        let equilibrium = match self.equilibrate(&mut shape, material, &force) {
            Ok(found) => found,
            Err(error) if error.is_recoverable() => return Ok(None),
            Err(error) => return Err(error),
        };
        *spent = equilibrium;
        if equilibrium.jump.is_some() {
            return Ok(None);
        }
        let mut search = self.held(rod, (material, load), &mut force, support, (true, 1.0))?;
        search.since(start, None);
        let held = Held {
            equilibrium,
            increments: 1,
            reactions: Vec::new(),
            rod: shape,
            patches: Vec::new(),
        };
        Ok(search.stays_clear(&held.rod)?.then_some(held))
    }

    fn search_held<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
    ) -> Outcome<Held> {
        let mut spent = Equilibrium::default();
        if let Some(free) = self.search_free(held, &mut spent)? {
            return Ok(free);
        }
        let &HeldRod {
            rod,
            material,
            load,
            support,
            environment,
            past,
        } = held;
        let mut force = InternalForce::of(rod, load, environment);
        check_finite(rod, &force)?;
        let (kind, bound) = ((self.stable_only, self.tolerance), self.max_iterations);
        let mut search = self.held(rod, (material, load), &mut force, support, kind)?;
        if let Some(start) = past.start {
            search.since(start, support.base());
        }
        search.omits_descent = past.omits_descent;
        search.last = past.last;
        let mut shape = rod.clone();
        search.guess(&mut shape, past.earlier, past.shape);
        let mut held = search.run(shape, bound)?;
        if spent.jump.is_some() {
            // The search without obstacles passed an unstable shape and jumped. The obstacles may
            // have stopped the fall.
            held.equilibrium
                .jump
                .get_or_insert(jump_between(rod, &held.rod));
        }
        held.equilibrium.iterations += spent.iterations;
        held.equilibrium.factorisations += spent.factorisations;
        held.equilibrium.evaluations += spent.evaluations;
        held.rod.line_strains = strain_line(Vec::new(), &held.rod, material, &force);
        check_line(&held.rod.line_strains, &force)?;
        held.rod.reactions.clone_from(&held.reactions);
        Ok(held)
    }
}

/// Largest tolerance of frames and corrections, rad. With a larger one no digit of the shape would
/// be correct.
pub(crate) const LARGEST_TOLERANCE: f64 = 0.1;

/// Returns an error for a tolerance (rad) below the rounding of a rotation or above
/// [`LARGEST_TOLERANCE`].
pub(crate) fn check_tolerance(name: &'static str, tolerance: f64) -> Result<(), ParameterError> {
    let ok = (f64::EPSILON..=LARGEST_TOLERANCE).contains(&tolerance);
    ParameterError::unless(
        ok,
        name,
        tolerance,
        "from 2.3e-16, the rounding of a number, to 0.1 (rad)",
    )
}

impl EquilibriumSolver for NewtonSolver {
    fn is_trusted(&self) -> bool {
        true
    }

    fn hold<C: Constitutive, L: Load, U: Support>(
        &mut self,
        held: &HeldRod<C, L, U>,
    ) -> Outcome<Held> {
        check_tolerance("tolerance of the equilibrium", self.tolerance)?;
        held.support.check()?;
        let &HeldRod {
            rod,
            material,
            load,
            environment,
            ..
        } = held;
        let with_reason = |error| {
            let force = InternalForce::of(rod, load, environment);
            explained(error, rod, &RodEnergy::new(material, &force))
        };
        self.search_held(held).map_err(with_reason)
    }

    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        check_tolerance("tolerance of the equilibrium", self.tolerance)?;
        force.check(rod)?;
        if !force.largest().is_finite() {
            check_finite(rod, force)?;
        }
        self.workspace.system.initial.keep(rod);
        let (body, system) = (RodEnergy::new(material, force), &mut self.workspace.system);
        let search = NewtonSearch::new(system, rod, &body, self.stable_only, self.tolerance);
        let answer = search.run(rod, self.max_iterations).and_then(|found| {
            let strains = strain_line(
                std::mem::take(&mut self.workspace.line_strains),
                rod,
                material,
                force,
            );
            check_line(&strains, force)?;
            self.workspace.line_strains = std::mem::replace(&mut rod.line_strains, strains);
            rod.reactions.clear();
            Ok(found)
        });
        if answer.is_err() {
            self.workspace.system.initial.restore(rod);
            check_finite(rod, force)?;
        }
        answer.map_err(|error| explained(error, rod, &body))
    }
}

/// The factorised tangent at an equilibrium of a free rod.
struct FactorisedTangent<'a, C> {
    system: &'a mut System,
    body: RodEnergy<'a, C>,
}

impl<C: Constitutive> NearbyEquilibria for FactorisedTangent<'_, C> {
    fn follow(&mut self, rod: &mut Rod) {
        // The rod moves by a Newton step with the factorised tangent and the gradient at its
        // frames.
        self.system.evaluate(rod, &self.body);
        self.system.balance();
        self.system.solve();
        self.system.start.keep(rod);
        self.system.advance(rod, 1.0);
        let strains = std::mem::take(&mut rod.line_strains);
        rod.line_strains = strain_line(strains, rod, self.body.material, self.body.force);
    }

    fn force(&self) -> &InternalForce {
        self.body.force
    }
}
