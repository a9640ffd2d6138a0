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
        let linear = self.linear_rod(rod)?;
        let (name, neutral) = (
            "neutral directions of the held rod",
            self.inertia_of(&linear, false).neutral,
        );
        let requirement = "zero: shape and reactions must be determined to first order, unlike those of a straight \
            rod whose ends are held";
        ParameterError::unless(neutral == 0, name, neutral as f64, requirement)?;
        let sites = self.sites.clone();
        Ok(HeldTangent {
            search: self,
            linear,
            sites,
        })
    }

    /// Evaluates the unbalanced couples and those of held frames for the present shape and
    /// reactions. Returns the energy of the rod with its loads, J.
    pub(super) fn balance(&mut self, rod: &Rod) -> f64 {
        let energy = self.body.evaluate(rod);
        self.found.evaluations += 1;
        self.stretch_joints(rod);
        self.body.balance();
        energy
    }
}

impl NearbyEquilibria for HeldTangent<'_> {
    fn follow(&mut self, rod: &mut Rod) {
        let Self {
            search,
            linear,
            sites,
        } = self;
        search.sites.clone_from(sites);
        search.apply(rod);
        search.balance(rod);
        linear.free = linear.response.free(search.body.system_mut());
        let nothing = DVector::zeros(linear.response.size());
        let links = linear.links_by(&nothing, &DVector::zeros(linear.size));
        let reactions = linear.reactions(&DVector::zeros(linear.size), &links);
        linear.response.load(search.body.system_mut(), &reactions);
        search.body.system_mut().solve();
        search.body.system_mut().start.keep(rod);
        search.body.system().advance(rod, 1.0);
        search.add_links(&linear.roles, &links, 1.0);
        search.apply(rod);
        search.balance(rod);
        rod.line_strains = search.body.strain_line(rod);
        let reactions = search.reactions(rod);
        search.body.force_mut().react(rod, &reactions);
    }

    fn force(&self) -> &InternalForce {
        self.search.body.force()
    }
}
