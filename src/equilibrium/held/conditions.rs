//! The conditions on reactions at one iteration.

use nalgebra::{DVector, Vector3};

use super::border::{Basis, Column};
use super::data::HeldSearch;
use super::elastic::Spring;
use super::sites::Site;
use crate::constitutive::Constitutive;
use crate::load::Load;

/// Compliance of a contact that sticks, relative to that of the rod to a force on its apex.
const STICKINESS: f64 = 1e-9;

/// Conditions of the reactions at one iteration: rows of T and D, and right-hand sides.
#[derive(Clone)]
pub(super) struct Conditions {
    /// Linear functions of the rotations.
    pub columns: Vec<Column>,
    /// The combination of them that each condition contains.
    pub parts: Basis,
    /// What each condition belongs to.
    pub roles: Vec<Role>,
    /// Diagonal of D.
    pub diagonal: Vec<f64>,
    /// Violated distances, m.
    pub residuals: Vec<f64>,
    /// The combinations of conditions that are solved for. Those of neighbouring contacts are divided differences,
    /// which couple only neighbours.
    pub basis: Basis,
}

impl Conditions {
    /// The values of the combinations.
    pub fn combine(&self, values: &[f64]) -> DVector<f64> {
        let sum = |combination: &Vec<(usize, f64)>| combination.iter().map(|(i, factor)| factor * values[*i]).sum();
        DVector::from_iterator(self.basis.len(), self.basis.iter().map(sum))
    }

    /// The combinations that are solved for, in terms of the columns.
    pub fn composed(&self, parts: &Basis) -> Basis {
        let compose = |combination: &Vec<(usize, f64)>| {
            let each = combination.iter().flat_map(|(i, factor)| parts[*i].iter().map(move |(c, f)| (*c, f * factor)));
            each.collect()
        };
        self.basis.iter().map(compose).collect()
    }

    /// The changes of the normal and of the tangential forces of contacts that stick.
    pub fn sticking(&self, changes: &DVector<f64>) -> Vec<(usize, f64, Vector3<f64>)> {
        let mut all: Vec<(usize, f64, Vector3<f64>)> = Vec::new();
        for (role, change) in self.roles.iter().zip(changes.iter()) {
            match role {
                Role::Fixed(site, _) => all.push((*site, *change, Vector3::zeros())),
                Role::Stick(site, direction) => {
                    if let Some((.., force)) = all.iter_mut().find(|(other, ..)| other == site) {
                        *force += direction * *change;
                    }
                }
                _ => {}
            }
        }
        all
    }

    /// The reactions to the conditions, given those to the combinations.
    pub fn distribute(&self, reactions: &DVector<f64>) -> DVector<f64> {
        let mut sum = DVector::zeros(reactions.len());
        for (combination, reaction) in self.basis.iter().zip(reactions.iter()) {
            combination.iter().for_each(|(i, factor)| sum[*i] += factor * reaction);
        }
        sum
    }
}

/// What a condition belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Role {
    /// Component of the force of a hold: site and direction.
    Fixed(usize, Vector3<f64>),
    /// Force of a spring along a principal axis: site, and axis times √|κ| for the stiffness κ.
    Elastic(usize, Vector3<f64>),
    /// A force of a contact that turns, as the spring of a stiffness κ: site, and direction times √|κ|.
    Turn(usize, Vector3<f64>),
    /// Tangential component of a force of friction: site and direction.
    Stick(usize, Vector3<f64>),
    /// Motion of the place of a contact along the rod: site, factor of the motion (m), and the change of the slope by a
    /// displacement times the inverse of this factor.
    Slide(usize, f64, Vector3<f64>),
    /// Rotation of a force of friction with the normal: site, and factor of the force, √N/√m.
    Turning(usize, f64),
    /// Increase of a pivot.
    Boost,
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// The conditions of the holds and contacts on the present shape.
    pub(super) fn conditions(&self) -> Conditions {
        let mut conditions = Conditions {
            columns: Vec::new(),
            parts: Vec::new(),
            roles: Vec::new(),
            diagonal: Vec::new(),
            residuals: Vec::new(),
            basis: Vec::new(),
        };
        let mut add = |columns: &[(Column, f64)], role, diagonal, residual| {
            let first = conditions.columns.len();
            conditions.parts.push(columns.iter().enumerate().map(|(i, (_, factor))| (first + i, *factor)).collect());
            conditions.columns.extend(columns.iter().map(|(column, _)| *column));
            conditions.roles.push(role);
            conditions.diagonal.push(diagonal);
            conditions.residuals.push(residual);
        };
        let floor = 1e-9 * self.force_scale();
        let stickiness = self.stickiness();
        for (i, site) in self.sites.iter().enumerate() {
            let (element, x) = (site.element, site.x);
            let place = |direction| Column::Place { element, x, direction };
            for (direction, residual) in site.missing() {
                add(&[(place(direction), 1.0)], Role::Fixed(i, direction), 0.0, residual);
            }
            if let Some((touch, friction)) = site.touch.as_ref().and_then(|touch| Some((touch, touch.friction?))) {
                if friction.sticks {
                    // A tiny compliance determines the forces of contacts that an inextensible rod connects.
                    let lag = friction.force - friction.earlier;
                    for direction in touch.tangential() {
                        let residual = direction.dot(&(friction.slip + lag * stickiness));
                        // The compliance follows in `compliance_of_contacts`.
                        add(&[(place(direction), 1.0)], Role::Stick(i, direction), 0.0, residual);
                    }
                } else {
                    // The force turns with the direction of the slip: a stiffness μ λ/|Δ| across it.
                    let sideways = touch.gap.normal.cross(&friction.direction);
                    let stiffness =
                        friction.coefficient * touch.push / (stickiness * friction.trial(stickiness).norm());
                    if stiffness > 0.0 && stiffness.is_finite() {
                        let root = stiffness.sqrt();
                        add(&[(place(sideways), root)], Role::Turn(i, sideways * root), -1.0, 0.0);
                    }
                }
            }
            if let Some((touch, friction)) = site.touch.as_ref().and_then(|touch| Some((touch, touch.friction?))) {
                // The tangential force f turns with the normal n: its change is −n f·∇²g·δp. See `sliding`.
                let along = touch.gap.curvature * friction.force;
                if along.norm() > 0.0 {
                    add(&[(place(along), 1.0 / along.norm().sqrt())], Role::Turning(i, along.norm().sqrt()), -1.0, 0.0);
                }
            }
            if let Some(touch) = &site.touch {
                // The normal force turns with the normal: a stiffness −λ ∇²g.
                let eigen = touch.gap.curvature.symmetric_eigen();
                for (along, value) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
                    let stiffness = -touch.push * value;
                    if stiffness != 0.0 {
                        let (along, root) = (along.into_owned(), stiffness.abs().sqrt());
                        add(&[(place(along), root)], Role::Turn(i, along * root), -stiffness.signum(), 0.0);
                    }
                }
                let (slope, bend) = touch.approach;
                if touch.floats && bend > 0.0 {
                    // The place moves along the rod so that the gap stays least: a stiffness λ/g″ (docs/supports.md).
                    let factor = (touch.push.max(floor) / bend).sqrt();
                    let turns = Column::Tangent { element, x, direction: touch.gap.normal };
                    let bends = touch.gap.curvature * touch.tangent;
                    let columns = [(turns, factor), (place(bends), factor)];
                    let role = Role::Slide(i, 1.0 / (factor * bend), bends * factor);
                    add(&columns, role, -1.0, factor * slope);
                }
            }
            for (along, stiffness, residual) in site.spring.iter().flat_map(Spring::stiff) {
                let root = stiffness.abs().sqrt();
                add(&[(place(along), root)], Role::Elastic(i, along * root), -stiffness.signum(), residual);
            }
        }
        for (unknown, increase) in &self.boosts {
            // The unknown is scaled so that its diagonal entry is one.
            add(&[(Column::Turn { unknown: *unknown }, 1.0)], Role::Boost, 1.0 / increase, 0.0);
        }
        // The displacement of an obstacle is an unknown that may lag behind the forces of its contacts.
        for (role, residual) in conditions.roles.iter().zip(&mut conditions.residuals) {
            if let Some((obstacle, direction)) = self.relative(role) {
                *residual += direction.dot(&self.obstacles.lag(obstacle, &self.sites));
            }
        }
        conditions.basis = self.differences(&conditions.roles);
        conditions
    }

    /// Divided differences of the gaps and slips at the contacts with each obstacle along the rod, up to the second;
    /// the other conditions as they are.
    pub(super) fn differences(&self, roles: &[Role]) -> Basis {
        let mut basis: Basis = (0..roles.len()).map(|i| vec![(i, 1.0)]).collect();
        // Gaps, and slips along and across the rod.
        let kind = |role: &Role| match role {
            Role::Fixed(site, _) => Some((*site, 0)),
            Role::Stick(site, direction) => {
                let along = self.sites[*site].touch.map(|touch| touch.tangential()[0]);
                Some((*site, if along == Some(*direction) { 1 } else { 2 }))
            }
            _ => None,
        };
        let kinds: Vec<_> = roles.iter().map(kind).collect();
        let groups = (0..self.obstacles.contacts.len()).flat_map(|obstacle| (0..3).map(move |kind| (obstacle, kind)));
        for (obstacle, kind) in groups {
            let mut along: Vec<(f64, usize)> = Vec::new();
            for (i, own) in kinds.iter().enumerate() {
                if let Some((site, own)) = own
                    && *own == kind
                    && self.sites[*site].touch.is_some_and(|touch| touch.obstacle == obstacle)
                {
                    along.push((self.sites[*site].element as f64 + self.sites[*site].x, i));
                }
            }
            along.sort_by(|a, b| a.0.total_cmp(&b.0));
            for k in 1..along.len() {
                let (s, i) = along[k];
                let (before, j) = along[k - 1];
                let slope = 1.0 / (s - before).max(1e-9);
                let mut difference = vec![(i, slope), (j, -slope)];
                if k > 1 {
                    let (first, l) = along[k - 2];
                    let slope = 1.0 / (before - first).max(1e-9);
                    difference[1].1 -= slope;
                    difference.push((l, slope));
                }
                basis[i] = difference;
            }
        }
        basis
    }

    /// The columns of the reactions if contacts slide: the friction follows the normal force. `None` if none does.
    pub(super) fn sliding(&self, conditions: &mut Conditions) -> Option<Basis> {
        let mut acts = conditions.parts.clone();
        let mut slides = false;
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Fixed(at, _) = role
                && let Site { element, x, touch: Some(touch), .. } = self.sites[*at]
                && let Some(friction) = touch.friction.filter(|friction| !friction.sticks)
            {
                slides = true;
                acts[i].push((conditions.columns.len(), -friction.coefficient));
                conditions.columns.push(Column::Place { element, x, direction: friction.direction });
            }
        }
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Turning(at, factor) = role
                && let Site { element, x, touch: Some(touch), .. } = self.sites[*at]
            {
                slides = true;
                acts[i] = vec![(conditions.columns.len(), *factor)];
                conditions.columns.push(Column::Place { element, x, direction: touch.gap.normal });
            }
        }
        // The point at which friction acts moves along the rod with the contact.
        for (i, role) in conditions.roles.iter().enumerate() {
            if let Role::Slide(at, factor, _) = role
                && let Site { element, x, touch: Some(touch), .. } = self.sites[*at]
                && let Some(friction) = touch.friction
            {
                slides = true;
                acts[i].push((conditions.columns.len(), *factor));
                conditions.columns.push(Column::Tangent { element, x, direction: friction.force });
                let turning = friction.force.dot(&(touch.gap.curvature * touch.tangent));
                acts[i].push((conditions.columns.len(), -factor * turning));
                conditions.columns.push(Column::Place { element, x, direction: touch.gap.normal });
            }
        }
        slides.then_some(acts)
    }

    /// Compliance of a contact that sticks, m/N.
    pub(super) fn stickiness(&self) -> f64 {
        STICKINESS * self.length.powi(2) * self.system.compliance()
    }
}
