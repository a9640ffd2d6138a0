//! Obstacles that yield to the forces of their contacts.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::border::congruent;
use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::sites::Site;
use super::touch::Obstacles;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::Reaction;

impl Obstacles<'_> {
    /// Displaces each obstacle by the opposite of its given force on the rod (N).
    pub fn pull(&mut self, forces: Vec<Vector3<f64>>) {
        self.yielded = self.compliances.iter().zip(&forces).map(|(compliance, force)| -(compliance * force)).collect();
        self.forces = forces;
    }

    /// Displaces the obstacles by a fraction of a step of these forces.
    pub fn advance(&mut self, fraction: f64) {
        if self.yields() {
            let forces = self.forces.iter().zip(&self.step).map(|(force, step)| force + step * fraction).collect();
            self.pull(forces);
        }
    }

    /// Whether an obstacle yields.
    pub fn yields(&self) -> bool {
        self.compliances.iter().any(|compliance| *compliance != Matrix3::zeros())
    }

    /// The displacements of the obstacles in an earlier equilibrium with the given reactions, m.
    pub fn displacements(&self, reactions: &[Reaction]) -> Vec<Vector3<f64>> {
        let forces = self.sums(reactions.iter().filter_map(|reaction| Some((reaction.obstacle?, reaction.force))));
        self.compliances.iter().zip(forces).map(|(compliance, force)| -(compliance * force)).collect()
    }

    /// Energy of the springs of the obstacles, J.
    pub fn energy(&self) -> f64 {
        self.forces.iter().zip(&self.yielded).map(|(force, displacement)| -0.5 * force.dot(displacement)).sum()
    }

    /// The displacement of an obstacle in excess of that by the forces at the contacts, m.
    pub fn lag(&self, obstacle: usize, sites: &[Site]) -> Vector3<f64> {
        if self.compliances[obstacle] == Matrix3::zeros() {
            return Vector3::zeros();
        }
        self.compliances[obstacle] * (self.sums(forces(sites))[obstacle] - self.forces[obstacle])
    }

    /// The sums of forces on the rod, for each obstacle.
    pub fn sums(&self, forces: impl Iterator<Item = (usize, Vector3<f64>)>) -> Vec<Vector3<f64>> {
        let mut sums = vec![Vector3::zeros(); self.contacts.len()];
        for (obstacle, force) in forces {
            // An earlier equilibrium may have had more obstacles.
            if let Some(sum) = sums.get_mut(obstacle) {
                *sum += force;
            }
        }
        sums
    }
}

/// The forces of contacts on the rod (N), with their obstacles.
pub(super) fn forces(sites: &[Site]) -> impl Iterator<Item = (usize, Vector3<f64>)> {
    sites.iter().filter_map(|site| Some((site.touch?.obstacle, site.force)))
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// The obstacle whose displacement enters a condition, and the direction of this displacement.
    pub(super) fn relative(&self, role: &Role) -> Option<(usize, Vector3<f64>)> {
        match role {
            Role::Fixed(site, direction)
            | Role::Stick(site, direction)
            | Role::Turn(site, direction)
            | Role::Slide(site, _, direction) => Some((self.sites[*site].touch?.obstacle, *direction)),
            Role::Elastic(..) | Role::Turning(..) | Role::Boost => None,
        }
    }

    /// The force of a reaction on the rod per unit, in the direction of its condition. If contacts slide (`slides`),
    /// the friction follows the normal force.
    fn force_along(&self, role: &Role, direction: Vector3<f64>, slides: bool) -> Vector3<f64> {
        let Role::Fixed(site, _) = role else {
            return direction;
        };
        let friction = self.sites[*site].touch.and_then(|touch| touch.friction);
        match friction.filter(|friction| slides && !friction.sticks) {
            Some(friction) => direction - friction.direction * friction.coefficient,
            None => direction,
        }
    }

    /// Sets the step of the forces on the obstacles to given changes of the reactions, in addition to `rest` (N).
    pub(super) fn set_step(&mut self, conditions: &Conditions, changes: &DVector<f64>, rest: Vec<Vector3<f64>>) {
        let mut step = rest;
        for (role, change) in conditions.roles.iter().zip(changes.iter()) {
            if let Some((obstacle, direction)) = self.relative(role) {
                step[obstacle] += self.force_along(role, direction, true) * *change;
            }
        }
        self.obstacles.step = step;
    }

    /// Moves the rod and the obstacles by a fraction of the step.
    pub(super) fn advance(&mut self, rod: &mut Rod, fraction: f64) {
        self.system.advance::<P>(rod, fraction);
        self.obstacles.advance(fraction);
    }

    /// Second derivatives of the energy by the reactions, from obstacles that yield: −aᵢ · S fⱼ for an obstacle of
    /// compliance S, a displacement along aᵢ in condition i, and a force along fⱼ of reaction j. The directions aᵢ and
    /// fᵢ are equal unless contacts slide (`slides`): the friction follows the normal force. Contacts that stick have a
    /// compliance of their own.
    pub(super) fn compliance_of_contacts(&self, conditions: &Conditions, slides: bool) -> DMatrix<f64> {
        let n = conditions.roles.len();
        let sticks = |role: &Role| matches!(role, Role::Stick(..));
        if !self.obstacles.yields() && !conditions.roles.iter().any(sticks) {
            return DMatrix::zeros(n, n);
        }
        let each: Vec<_> = conditions.roles.iter().map(|role| self.relative(role)).collect();
        let mut plain = DMatrix::from_fn(n, n, |i, j| match (each[i], each[j]) {
            (Some((a, d)), Some((b, e))) if a == b => {
                -d.dot(&(self.obstacles.compliances[a] * self.force_along(&conditions.roles[j], e, slides)))
            }
            _ => 0.0,
        });
        let stickiness = self.stickiness();
        for (i, _) in conditions.roles.iter().enumerate().filter(|(_, role)| sticks(role)) {
            plain[(i, i)] -= stickiness;
        }
        congruent(&conditions.basis, plain)
    }
}
