//! The response of a rod and its reactions: factors of the tangent, inertia, steps.

use nalgebra::{DMatrix, DVector, Vector3};

use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::dense::{Dense, NEUTRAL};
use super::sites::Site;
use super::yielding::forces;
use crate::constitutive::Constitutive;
use crate::equilibrium::{EquilibriumError, Inertia};
use crate::load::Load;
use crate::rod::Rod;

/// Largest number of steps by which the rod returns to the conditions.
const RESTORATIONS: usize = 6;
/// Violation of the conditions relative to the length at which the return to them ends.
pub(super) const RESTORED: f64 = 1e-12;
/// Violation of the conditions relative to the length that is acceptable if it does not decrease further.
pub(super) const ACCEPTED: f64 = 1e-8;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Assembles and factorises the tangent with a shift. Returns the energy (J) and the signs of its pivots.
    pub(super) fn factorise(&mut self, rod: &Rod, shift: f64) -> Result<(f64, Inertia), EquilibriumError> {
        let (energy, mut inertia) = self.system.condense::<P>(rod, self.material, self.force, shift)?;
        self.stretch_joints(rod);
        self.system.joints.apply(&mut self.system.tangent);
        self.system.tangent.factorise_boosted(&mut inertia, &mut self.boosts)?;
        self.found.factorisations += 1 + self.boosts.len();
        self.energy_scale = self.energy_scale.max(energy.abs() / self.length);
        if energy.is_finite() { Ok((energy, inertia)) } else { Err(EquilibriumError::NotFinite { what: "energy" }) }
    }

    /// Computes the matrix of the reactions for the factorised tangent, whose pivots have the signs `inertia`. Returns
    /// it with the inertia on the directions that the conditions permit.
    pub(super) fn close(
        &mut self,
        rod: &Rod,
        mut inertia: Inertia,
    ) -> Result<(Inertia, Conditions, Dense), EquilibriumError> {
        let mut conditions = self.conditions();
        let acts = self.sliding(&mut conditions);
        let basis = conditions.composed(&conditions.parts);
        let acts = acts.map(|acts| conditions.composed(&acts));
        let (columns, force) = (&conditions.columns, &*self.force);
        self.border.assemble::<P>(self.system, rod, self.material, force, (columns, &basis, acts.as_ref()));
        let matrix = |compliance: &DMatrix<f64>, products: &DMatrix<f64>| {
            let mut matrix = &self.border.yields + compliance - products;
            conditions.diagonal.iter().enumerate().for_each(|(i, d)| matrix[(i, i)] += d);
            matrix
        };
        let compliance = self.compliance_of_contacts(&conditions, false);
        let coupled = self.border.coupling.as_ref().map(|products| {
            // The direction of friction enters by the displacements of obstacles that yield.
            let sliding = self.obstacles.yields().then(|| self.compliance_of_contacts(&conditions, true));
            matrix(sliding.as_ref().unwrap_or(&compliance), products)
        });
        let mut dense = matrix(&compliance, &self.border.gram);
        // The symmetric part omits the rotation of friction with the normal.
        for (i, _) in conditions.roles.iter().enumerate().filter(|(_, role)| matches!(role, Role::Turning(..))) {
            dense.row_mut(i).fill(0.0);
            dense.column_mut(i).fill(0.0);
            dense[(i, i)] = -self.border.sizes[i] - 1.0;
        }
        // The bordered matrix has one negative eigenvalue for every condition and every spring of positive stiffness.
        let scale = DVector::from_fn(dense.nrows(), |i, _| {
            1.0 / (self.border.sizes[i] - self.border.yields[(i, i)] + conditions.diagonal[i].abs())
                .sqrt()
                .max(f64::MIN_POSITIVE)
        });
        let finite = dense.iter().all(|value| value.is_finite());
        if !finite {
            return Err(EquilibriumError::NotFinite { what: "tangent" });
        }
        let dense = Dense::of(&dense, scale, coupled);
        let expected = conditions.diagonal.iter().filter(|d| **d <= 0.0).count();
        let positive = conditions.roles.len() - expected;
        let mut negative = inertia.negative;
        let mut above = inertia.positive;
        for value in dense.eigenvalues.iter() {
            inertia.margin = inertia.margin.min(value.abs());
            if value.abs() <= NEUTRAL {
                inertia.neutral += 1;
            } else if *value < 0.0 {
                negative += 1;
            } else {
                above += 1;
            }
        }
        inertia.negative = negative.saturating_sub(expected);
        inertia.positive = above.saturating_sub(positive + self.system.joints.confined_directions() + expected);
        Ok((inertia, conditions, dense))
    }

    /// The inertia at the present configuration.
    pub fn inertia(mut self, rod: &Rod) -> Result<Inertia, EquilibriumError> {
        self.locate(rod);
        self.apply(rod);
        let (_, inertia) = self.factorise(rod, 0.0)?;
        self.close(rod, inertia).map(|(inertia, ..)| inertia)
    }

    /// Solves for the step of rotations and reactions. Returns the changes of the reactions.
    pub(super) fn step(&mut self, conditions: &Conditions, dense: &Dense) -> DVector<f64> {
        self.system.balance::<P>();
        self.respond(conditions, dense)
    }

    /// Solves for the response to the unbalanced couples and the violated conditions.
    pub(super) fn respond(&mut self, conditions: &Conditions, dense: &Dense) -> DVector<f64> {
        let free = self.border.step::<P>(self.system);
        let rhs = free + conditions.combine(&conditions.residuals);
        let changes = dense.solve(&rhs);
        self.border.load::<P>(self.system, &changes);
        self.system.solve::<P>();
        let changes = conditions.distribute(&changes);
        if self.obstacles.yields() {
            let present = self.obstacles.sums(forces(&self.sites));
            let rest = present.iter().zip(&self.obstacles.forces).map(|(present, force)| present - force).collect();
            self.set_step(conditions, &changes, rest);
        }
        changes
    }

    /// Moves the rod back to the conditions, by steps with the existing factors. Returns whether it succeeds.
    pub(super) fn restore_conditions(&mut self, rod: &mut Rod, conditions: &Conditions, dense: &Dense) -> bool {
        let mut last = f64::INFINITY;
        for _ in 0..RESTORATIONS {
            self.locate(rod);
            let violation = self.violation();
            if violation <= RESTORED * self.length {
                return true;
            }
            if !(violation < 0.5 * last) {
                return violation <= ACCEPTED * self.length;
            }
            last = violation;
            for element in &mut self.system.elements {
                element.clear_gradient();
            }
            self.system.turns.fill(Vector3::zeros());
            let violated: Vec<f64> = self.sites.iter().flat_map(Site::missing).map(|(_, distance)| distance).collect();
            let mut missing = violated.into_iter();
            let missing = conditions.roles.iter().map(|role| match role {
                Role::Fixed(..) => missing.next().unwrap_or(0.0),
                _ => 0.0,
            });
            let missing: Vec<f64> = missing.collect();
            let changes = dense.solve(&conditions.combine(&missing));
            self.border.load::<P>(self.system, &changes);
            self.system.solve::<P>();
            self.system.start.keep(rod);
            if self.obstacles.yields() {
                let none = vec![Vector3::zeros(); self.obstacles.contacts.len()];
                self.set_step(conditions, &conditions.distribute(&changes), none);
            }
            self.advance(rod, 1.0);
        }
        self.locate(rod);
        self.violation() <= ACCEPTED * self.length
    }
}
