//! Obstacles that yield to the forces of their contacts.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::sites::Site;
use super::touch::Obstacles;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::support::Reaction;

impl Obstacles<'_> {
    /// The displacement of an obstacle (m) by the forces on the rod (N), to which those on the obstacle are opposite.
    fn displacement(&self, obstacle: usize, forces: impl Iterator<Item = (usize, Vector3<f64>)>) -> Vector3<f64> {
        let own = forces.filter(|(other, _)| *other == obstacle);
        -(self.compliances[obstacle] * own.map(|(_, force)| force).sum::<Vector3<f64>>())
    }

    /// The displacements of the obstacles in an earlier equilibrium with the given reactions, m.
    pub fn displacements(&self, reactions: &[Reaction]) -> Vec<Vector3<f64>> {
        let forces = || reactions.iter().filter_map(|reaction| Some((reaction.obstacle?, reaction.force)));
        (0..self.contacts.len()).map(|obstacle| self.displacement(obstacle, forces())).collect()
    }

    /// Displaces the obstacles by the forces at the contacts.
    pub fn yield_to(&mut self, sites: &[Site]) {
        for obstacle in 0..self.contacts.len() {
            if self.compliances[obstacle] != Matrix3::zeros() {
                self.yielded[obstacle] = self.displacement(obstacle, forces(sites));
            }
        }
    }

    /// Energy of the springs of the obstacles at the forces of the contacts, J.
    pub fn energy(&self, sites: &[Site]) -> f64 {
        let soft = self.compliances.iter().enumerate().filter(|(_, compliance)| **compliance != Matrix3::zeros());
        let each = soft.map(|(obstacle, compliance)| {
            let own = forces(sites).filter(|(other, _)| *other == obstacle);
            let force = own.map(|(_, force)| force).sum::<Vector3<f64>>();
            0.5 * force.dot(&(compliance * force))
        });
        each.sum()
    }

    /// The displacement of an obstacle in excess of that by the present forces, m.
    pub fn lag(&self, obstacle: usize, sites: &[Site]) -> Vector3<f64> {
        if self.compliances[obstacle] == Matrix3::zeros() {
            return Vector3::zeros();
        }
        self.yielded[obstacle] - self.displacement(obstacle, forces(sites))
    }
}

/// The forces of contacts on the rod (N), with their obstacles.
fn forces(sites: &[Site]) -> impl Iterator<Item = (usize, Vector3<f64>)> {
    sites.iter().filter_map(|site| Some((site.touch?.obstacle, site.force)))
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// The direction in which a displacement relative to an obstacle enters a condition, with the obstacle.
    pub(super) fn relative(&self, role: &Role) -> Option<(usize, Vector3<f64>)> {
        match role {
            Role::Fixed(site, direction)
            | Role::Stick(site, direction)
            | Role::Turn(site, direction)
            | Role::Slide(site, _, direction) => Some((self.sites[*site].touch?.obstacle, *direction)),
            Role::Elastic(..) | Role::Turning(..) | Role::Boost => None,
        }
    }

    /// Second derivatives of the energy by the reactions, from obstacles that yield: −aᵢ · S fⱼ for an obstacle of
    /// compliance S, a displacement along aᵢ in condition i, and a force along fⱼ of reaction j. They are equal unless
    /// contacts slide (`slides`): the friction follows the normal force. Contacts that stick have a compliance of their own.
    pub(super) fn compliance_of_contacts(&self, conditions: &Conditions, slides: bool) -> DMatrix<f64> {
        let n = conditions.roles.len();
        let each: Vec<_> = conditions.roles.iter().map(|role| self.relative(role)).collect();
        let force = |j: usize, direction: Vector3<f64>| {
            let Role::Fixed(site, _) = conditions.roles[j] else { return direction };
            let friction = self.sites[site].touch.and_then(|touch| touch.friction);
            match friction.filter(|friction| slides && !friction.sticks) {
                Some(friction) => direction - friction.direction * friction.coefficient,
                None => direction,
            }
        };
        let mut plain = DMatrix::from_fn(n, n, |i, j| match (each[i], each[j]) {
            (Some((a, d)), Some((b, e))) if a == b => -d.dot(&(self.obstacles.compliances[a] * force(j, e))),
            _ => 0.0,
        });
        let stickiness = self.stickiness();
        for (i, _) in conditions.roles.iter().enumerate().filter(|(_, role)| matches!(role, Role::Stick(..))) {
            plain[(i, i)] -= stickiness;
        }
        if plain.iter().all(|value| *value == 0.0) {
            return plain;
        }
        let mut basis = DMatrix::<f64>::zeros(n, n);
        for (i, combination) in conditions.basis.iter().enumerate() {
            combination.iter().for_each(|(j, factor)| basis[(i, *j)] += factor);
        }
        &basis * plain * basis.transpose()
    }
}
