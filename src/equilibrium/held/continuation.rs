//! Whether an equilibrium is the continuation of an earlier one, or the rod has jumped.
//!
//! The earlier shape, with its base and held frames moved to their new places, is not in
//! equilibrium any more. On the way to the new equilibrium the rod releases energy: the decrease of
//! E − Σ f · p, where the reactions f of the new equilibrium act at the places p. The linear rod of
//! the new equilibrium predicts the motion v from the couples of the earlier shape and the motion of
//! the held places, and with it the energy ½ vᵀ K v. For a short motion along a branch of equilibria
//! this is the released energy, and both vanish as the square of the motion. At the end of a branch,
//! and between branches, the rod releases energy although almost nothing has changed, and the
//! prediction is small.

use nalgebra::{DVector, Vector3};

use super::inertia::Bordered;
use super::line::jump_between;
use super::linear::{Conditions, Linear};
use super::search::HeldSearch;
use super::settings;
use crate::equilibrium::EquilibriumError;
use crate::load::PointReaction;
use crate::rod::Rod;
use crate::support::Reaction;

/// An equilibrium from which the rod moves.
pub(super) struct Origin {
    pub rod: Rod,
    pub reactions: Vec<Reaction>,
}

/// The energy that the rod releases on the way from one equilibrium to the next, J.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Release {
    pub actual: f64,
    /// The energy that the linear rod of the new equilibrium releases.
    pub predicted: f64,
}

impl HeldSearch<'_> {
    /// The energy that is released on the way from an earlier equilibrium to the present one. It is
    /// zero if the motion is too short to be a jump. Base and held frames of the origin are at
    /// their present places.
    pub(super) fn release(
        &mut self,
        rod: &Rod,
        origin: &Origin,
    ) -> Result<Release, EquilibriumError> {
        if jump_between(&origin.rod, rod) <= settings::NEAR_MOTION * self.length {
            return Ok(Release::default());
        }
        let mut from = rod.clone();
        from.sample_shape(&origin.rod);
        let sites = self.sites.clone();
        let candidates = self.candidates.clone();
        let linear = self.linear_rod(rod)?;
        let end = self.energy_with_reactions(rod, linear.factors.energy);
        self.apply(&from);
        self.locate(&from);
        let energy = self.body.evaluate(&from);
        let start = self.energy_with_reactions(&from, energy);
        self.sites.clone_from(&sites);
        self.candidates.clone_from(&candidates);
        self.locate(rod);
        let predicted = self.predict(rod, &from, &origin.reactions, &linear);
        (self.sites, self.candidates) = (sites, candidates);
        self.apply(rod);
        self.locate(rod);
        self.balance(rod);
        Ok(Release {
            actual: start - end,
            predicted,
        })
    }

    /// The energy (J) of the rod, its springs, and its present reactions as dead loads. The rod
    /// with its loads and reactions had the given energy at the last evaluation.
    fn energy_with_reactions(&mut self, rod: &Rod, energy: f64) -> f64 {
        let springs = self.sites.iter().filter_map(|site| {
            let spring = site.spring?;
            Some(spring.energy + spring.force.dot(&(site.position - rod.base_position())))
        });
        let springs: f64 = springs.sum();
        energy + springs + self.stretch_joints(rod)
    }

    /// The energy ½ vᵀ K v (J) of the motion v from an earlier shape that the linear rod of the
    /// present equilibrium predicts.
    fn predict(&mut self, rod: &Rod, from: &Rod, reactions: &[Reaction], linear: &Linear) -> f64 {
        let Bordered {
            diagonal,
            rows,
            matrix,
            scale,
        } = self.bordered(linear);
        let after = self.coordinates(linear);
        self.guess_forces(reactions);
        self.locate(from);
        let moved = after - self.coordinates(linear);
        let force = |reaction: &Reaction| {
            let (element, x) = rod.locate_initial(reaction.initial_apex_distance)?;
            Some(PointReaction {
                element,
                x,
                force: reaction.force,
                couple: Vector3::zeros(),
            })
        };
        let forces: Vec<PointReaction> = reactions.iter().filter_map(force).collect();
        let yields = self.yields(from);
        self.body.force_mut().set_reactions(from, &forces, yields);
        self.balance(from);
        let base_force = self.body.system().base_force;
        // A hold moves as it did, and a spring may have another law. The other conditions with a
        // stiffness are those of contact forces that turn and move.
        let links = self.residuals(&linear.roles);
        let moved = &rows * moved;
        let violations = DVector::from_fn(diagonal.len(), |i, _| match links.get(i) {
            _ if diagonal[i] == 0.0 => -moved[i],
            Some(violation) => *violation,
            None => 0.0,
        });
        let free = &rows * linear.response.free(self.body.system_mut());
        let forces = Conditions::new(&matrix, scale).solve(&(free + &violations));
        let reactions = rows.tr_mul(&forces);
        linear.response.load(self.body.system_mut(), &reactions);
        let system = self.body.system_mut();
        system.solve();
        let by_couples = base_force.dot(&system.base_motion) - system.slope();
        let each = forces.iter().zip(violations.iter()).zip(&diagonal);
        let by_violations = each.map(|((force, violation), diagonal)| {
            if *diagonal == 0.0 {
                -force * violation
            } else {
                violation * (force - violation / diagonal)
            }
        });
        0.5 * (by_couples + by_violations.sum::<f64>())
    }

    /// The coordinates of a linear rod on the shape at the last evaluation.
    fn coordinates(&self, linear: &Linear) -> DVector<f64> {
        let response = &linear.response;
        let mut all = DVector::zeros(response.size());
        let sites = self.sites.iter().map(|site| (site.position, None));
        let candidates = self.candidates.iter();
        let places = sites.chain(candidates.map(|at| (at.position, Some(at.tangent))));
        for (i, ((position, tangent), with_tangent)) in
            places.zip(response.with_tangents()).enumerate()
        {
            let first = response.first(i);
            all.fixed_rows_mut::<3>(first).copy_from(&position);
            if let Some(tangent) = tangent.filter(|_| with_tangent) {
                all.fixed_rows_mut::<3>(first + 3).copy_from(&tangent);
            }
        }
        all
    }
}
