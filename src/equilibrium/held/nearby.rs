//! Equilibria of a held rod next to a given one, to first order.

use nalgebra::DVector;

use super::linear::Linear;
use super::search::HeldSearch;
use super::sites::HeldSite;
use crate::equilibrium::{EquilibriumError, NearbyEquilibria};
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::rod::Rod;

/// The factorised bordered tangent at an equilibrium of a held rod.
pub(in crate::equilibrium) struct HeldTangent<'a> {
    search: HeldSearch<'a>,
    linear: Linear,
    /// The holds with their forces in the equilibrium.
    sites: Vec<HeldSite>,
}

impl<'a> HeldSearch<'a> {
    /// Factorises the bordered tangent at an equilibrium, whose reactions are known.
    ///
    /// # Errors
    /// Reactions or rotations that are not determined to first order.
    pub fn linearised(mut self, rod: &Rod) -> Result<HeldTangent<'a>, EquilibriumError> {
        if let Some(base) = &mut self.body.system_mut().joints.free_base {
            base.exact = true;
        }
        self.locate(rod);
        self.apply(rod);
        let (_, pivots) = self.factorise(rod, 0.0)?;
        self.body.balance();
        let linear = self.linearise(rod);
        let (name, neutral) = ("neutral directions of the held rod", self.inertia_of(&linear, pivots).neutral);
        let requirement = "zero: shape and reactions must be determined to first order, unlike those of a straight \
            rod whose ends are held";
        ParameterError::unless(neutral == 0, name, neutral as f64, requirement)?;
        let sites = self.sites.clone();
        Ok(HeldTangent { search: self, linear, sites })
    }

    /// Computes the couples of held frames, which balance those of the rod with its present shape and reactions.
    pub(super) fn balance_frames(&mut self, rod: &Rod) {
        self.body.evaluate(rod);
        self.stretch_joints(rod);
        self.body.balance();
    }
}

impl NearbyEquilibria for HeldTangent<'_> {
    fn follow(&mut self, rod: &mut Rod) {
        let Self { search, linear, sites } = self;
        search.sites.clone_from(sites);
        search.apply(rod);
        search.balance_frames(rod);
        linear.free = linear.response.free(search.body.system_mut());
        let nothing = DVector::zeros(linear.response.size());
        let links = linear.links_by(&nothing, &DVector::zeros(linear.size));
        let reactions = linear.reactions(&DVector::zeros(linear.size), &links);
        linear.response.load(search.body.system_mut(), &reactions);
        search.body.solve();
        search.body.system_mut().start.keep(rod);
        search.body.advance(rod, 1.0);
        search.add_links(&linear.roles, &links, 1.0);
        search.apply(rod);
        search.balance_frames(rod);
        *rod.line_strains_mut() = search.body.strain_line(rod);
        let reactions = search.reactions(rod);
        search.body.force_mut().react(rod, &reactions);
    }

    fn force(&self) -> &InternalForce {
        self.search.body.force()
    }
}
