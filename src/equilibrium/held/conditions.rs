//! The conditions on reactions at one iteration.

use nalgebra::{DVector, Vector3};

use super::border::{Basis, Column};
use super::data::HeldSearch;
use super::elastic::Spring;
use super::sites::{Friction, Site, Touch};
use crate::constitutive::Constitutive;
use crate::load::Load;

/// Compliance of a contact that sticks, relative to that of the rod to a force on its apex.
const STICKINESS: f64 = 1e-9;
/// Smallest normal force with which the place of a contact moves along the rod, relative to the magnitude of the force
/// in the rod. Without force the motion would not be determined.
const LEAST_PUSH: f64 = 1e-9;
/// Smallest distance of two contacts in a divided difference, in elements.
const CLOSEST: f64 = 1e-9;

/// Conditions of the reactions at one iteration: rows of T and D, and right-hand sides.
#[derive(Clone, Default)]
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
    /// Adds a condition on a combination of columns.
    fn add(&mut self, columns: &[(Column, f64)], role: Role, diagonal: f64, residual: f64) {
        let first = self.columns.len();
        self.parts.push(columns.iter().enumerate().map(|(i, (_, factor))| (first + i, *factor)).collect());
        self.columns.extend(columns.iter().map(|(column, _)| *column));
        self.roles.push(role);
        self.diagonal.push(diagonal);
        self.residuals.push(residual);
    }

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
    /// The conditions of the supports on the present shape.
    pub(super) fn conditions(&self) -> Conditions {
        let mut conditions = Conditions::default();
        let least_push = LEAST_PUSH * self.force_scale();
        for (i, site) in self.sites.iter().enumerate() {
            for (direction, residual) in site.missing() {
                conditions.add(&[(displacement(site, direction), 1.0)], Role::Fixed(i, direction), 0.0, residual);
            }
            if let Some(touch) = &site.touch {
                if let Some(friction) = &touch.friction {
                    self.add_friction(&mut conditions, i, touch, friction);
                }
                self.add_contact(&mut conditions, i, touch, least_push);
            }
            for (along, stiffness, residual) in site.spring.iter().flat_map(Spring::stiff) {
                let root = stiffness.abs().sqrt();
                let role = Role::Elastic(i, along * root);
                conditions.add(&[(displacement(site, along), root)], role, -stiffness.signum(), residual);
            }
        }
        for (unknown, increase) in &self.boosts {
            // The unknown is scaled so that its diagonal entry is one.
            conditions.add(&[(Column::Turn { unknown: *unknown }, 1.0)], Role::Boost, 1.0 / increase, 0.0);
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

    /// Adds the conditions of the friction at site `i`.
    fn add_friction(&self, conditions: &mut Conditions, i: usize, touch: &Touch, friction: &Friction) {
        let site = &self.sites[i];
        if friction.sticks {
            // A tiny compliance determines the forces of contacts that an inextensible rod connects. Its part of D is
            // added in `compliance_of_contacts`.
            let lag = (friction.force - friction.earlier) * self.stickiness();
            for direction in touch.tangential() {
                let residual = direction.dot(&(friction.slip + lag));
                conditions.add(&[(displacement(site, direction), 1.0)], Role::Stick(i, direction), 0.0, residual);
            }
        } else {
            // The force turns with the trial force t of a contact that sticks: a stiffness μ λ/(c |t|) across it, for
            // the compliance c of such a contact.
            let sideways = touch.gap.normal.cross(&friction.direction);
            let stickiness = self.stickiness();
            let stiffness = friction.coefficient * touch.push / (stickiness * friction.trial(stickiness).norm());
            if stiffness > 0.0 && stiffness.is_finite() {
                let root = stiffness.sqrt();
                conditions.add(&[(displacement(site, sideways), root)], Role::Turn(i, sideways * root), -1.0, 0.0);
            }
        }
        // The tangential force f turns with the normal n: its change is −n f·∇²g·δp. See `sliding`.
        let along = touch.gap.curvature * friction.force;
        if along.norm() > 0.0 {
            let root = along.norm().sqrt();
            conditions.add(&[(displacement(site, along), 1.0 / root)], Role::Turning(i, root), -1.0, 0.0);
        }
    }

    /// Adds the stiffnesses of the normal force at site `i`: the force turns with the normal, and its place moves along
    /// the rod. The second stiffness is that of a force of at least `least_push` (N).
    fn add_contact(&self, conditions: &mut Conditions, i: usize, touch: &Touch, least_push: f64) {
        let site = &self.sites[i];
        // The normal force turns with the normal: a stiffness −λ ∇²g.
        let eigen = touch.gap.curvature.symmetric_eigen();
        for (along, value) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            let stiffness = -touch.push * value;
            if stiffness != 0.0 {
                let (along, root) = (along.into_owned(), stiffness.abs().sqrt());
                conditions.add(
                    &[(displacement(site, along), root)],
                    Role::Turn(i, along * root),
                    -stiffness.signum(),
                    0.0,
                );
            }
        }
        let (slope, bend) = touch.approach;
        if touch.floats && bend > 0.0 {
            // The place moves along the rod so that the gap stays least: a stiffness λ/g″ (docs/supports.md).
            let factor = (touch.push.max(least_push) / bend).sqrt();
            let turns = Column::Tangent { element: site.element, x: site.x, direction: touch.gap.normal };
            let bends = touch.gap.curvature * touch.tangent;
            let role = Role::Slide(i, 1.0 / (factor * bend), bends * factor);
            conditions.add(&[(turns, factor), (displacement(site, bends), factor)], role, -1.0, factor * slope);
        }
    }

    /// Divided differences of the gaps and slips at the contacts with each obstacle along the rod, up to the second.
    /// The other conditions are not combined.
    pub(super) fn differences(&self, roles: &[Role]) -> Basis {
        let mut basis: Basis = (0..roles.len()).map(|i| vec![(i, 1.0)]).collect();
        // Gaps have the kind 0, slips along and across the rod the kinds 1 and 2.
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
                let slope = 1.0 / (s - before).max(CLOSEST);
                let mut difference = vec![(i, slope), (j, -slope)];
                if k > 1 {
                    let (first, l) = along[k - 2];
                    let slope = 1.0 / (before - first).max(CLOSEST);
                    difference[1].1 -= slope;
                    difference.push((l, slope));
                }
                basis[i] = difference;
            }
        }
        basis
    }

    /// The combinations of columns in which the reactions act, if friction makes them differ from those of the
    /// conditions. Friction that slides follows the normal force; all friction turns with the normal and moves along
    /// the rod with the contact. Adds the columns that only reactions have. `None` without such friction.
    pub(super) fn sliding(&self, conditions: &mut Conditions) -> Option<Basis> {
        let mut acts = conditions.parts.clone();
        let mut differ = false;
        for (i, role) in conditions.roles.iter().enumerate() {
            let (Role::Fixed(at, _) | Role::Turning(at, _) | Role::Slide(at, ..)) = role else { continue };
            let site = &self.sites[*at];
            let Some((touch, friction)) = site.touch.as_ref().and_then(|touch| Some((touch, touch.friction?))) else {
                continue;
            };
            let more = match role {
                Role::Fixed(..) if !friction.sticks => {
                    vec![(displacement(site, friction.direction), -friction.coefficient)]
                }
                Role::Turning(_, factor) => {
                    acts[i].clear();
                    vec![(displacement(site, touch.gap.normal), *factor)]
                }
                Role::Slide(_, factor, _) => {
                    // The point at which friction acts moves along the rod with the contact.
                    let moves = Column::Tangent { element: site.element, x: site.x, direction: friction.force };
                    let turning = friction.force.dot(&(touch.gap.curvature * touch.tangent));
                    vec![(moves, *factor), (displacement(site, touch.gap.normal), -factor * turning)]
                }
                _ => continue,
            };
            differ = true;
            for (column, factor) in more {
                acts[i].push((conditions.columns.len(), factor));
                conditions.columns.push(column);
            }
        }
        differ.then_some(acts)
    }

    /// Compliance of a contact that sticks, m/N.
    pub(super) fn stickiness(&self) -> f64 {
        STICKINESS * self.length.powi(2) * self.system.compliance()
    }
}

/// The displacement of a site along a direction.
fn displacement(site: &Site, direction: Vector3<f64>) -> Column {
    Column::Place { element: site.element, x: site.x, direction }
}
