//! Equilibria of a held rod next to a given one, to first order.

use super::conditions::Conditions;
use super::data::HeldSearch;
use super::dense::Dense;
use super::elastic::Spring;
use super::sites::Site;
use crate::constitutive::Constitutive;
use crate::equilibrium::line::strain_line;
use crate::equilibrium::{EquilibriumError, NearbyEquilibria};
use crate::error::ParameterError;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::support::Reaction;

/// The factorised bordered tangent at an equilibrium of a held rod.
pub(in crate::equilibrium) struct HeldTangent<'a, C, L, const P: usize> {
    search: HeldSearch<'a, C, L, P>,
    conditions: Conditions,
    dense: Dense,
    /// The holds with their forces in the equilibrium.
    sites: Vec<Site>,
}

impl<'a, C: Constitutive, L: Load, const P: usize> HeldSearch<'a, C, L, P> {
    /// Factorises the bordered tangent at an equilibrium, whose reactions are known.
    ///
    /// # Errors
    /// Reactions or rotations that are not determined to first order.
    pub fn linearise(mut self, rod: &Rod) -> Result<HeldTangent<'a, C, L, P>, EquilibriumError> {
        self.locate(rod);
        self.apply(rod);
        let (_, inertia) = self.factorise(rod, 0.0)?;
        let (inertia, conditions, dense) = self.close(rod, inertia)?;
        let (name, neutral) = ("neutral directions of the held rod", inertia.neutral);
        let requirement = "zero: shape and reactions must be determined to first order, unlike those of a straight \
            rod whose ends are held";
        ParameterError::unless(neutral == 0, name, neutral as f64, requirement)?;
        let sites = self.sites.clone();
        Ok(HeldTangent { search: self, conditions, dense, sites })
    }
}

impl<C: Constitutive, L: Load, const P: usize> NearbyEquilibria for HeldTangent<'_, C, L, P> {
    fn follow(&mut self, rod: &mut Rod) {
        let Self { search, conditions, dense, sites } = self;
        search.sites.clone_from(sites);
        search.apply(rod);
        search.unbalance(rod);
        let changes = search.step(conditions, dense);
        search.system.start.keep(rod);
        search.system.advance::<P>(rod, 1.0);
        search.add_reactions(conditions, &changes, 1.0);
        search.apply(rod);
        search.balance_frames(rod);
        let mut strains = std::mem::take(rod.line_strains_mut());
        strain_line(&mut strains, rod, search.material, search.force);
        *rod.line_strains_mut() = strains;
        let reactions = search.reactions(rod);
        search.force.react(rod, &reactions);
    }

    fn force(&self) -> &InternalForce {
        self.search.force
    }
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// The reactions of springs and elastic joints at a shape. Holds keep the forces of the initial guess.
    pub fn reactions_at(mut self, rod: &Rod) -> Vec<Reaction> {
        self.locate(rod);
        self.sites.iter_mut().filter_map(|site| site.spring.as_mut()).for_each(Spring::relax);
        self.stretch_joints(rod);
        self.reactions(rod)
    }

    /// Computes the couples of held frames, which balance those of the rod with its present shape and reactions.
    pub(super) fn balance_frames(&mut self, rod: &Rod) {
        self.unbalance(rod);
        self.system.balance::<P>();
    }

    /// Evaluates the gradient of the energy of the rod and of its elastic joints.
    fn unbalance(&mut self, rod: &Rod) {
        self.system.evaluate::<P>(rod, self.material, self.force);
        self.stretch_joints(rod);
    }
}

impl<C, L, const P: usize> Drop for HeldTangent<'_, C, L, P> {
    /// Removes the joints from the workspace, which a free rod may use next.
    fn drop(&mut self) {
        self.search.system.joints.clear();
    }
}
