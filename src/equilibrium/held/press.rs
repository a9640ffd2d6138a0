//! Normal forces of all contacts for given friction: a linear complementarity problem, by an active set.
//!
//! Neighbouring contacts of a slender rod differ by displacements that are much stiffer than their common one. Newton's
//! method for the laws then exchanges sets of loaded contacts without end. An active set changes one contact at a time,
//! and each change decreases the energy (Lawson and Hanson, *Solving Least Squares Problems*, chapter 23, 1974).

use nalgebra::{Cholesky, DMatrix, DVector};

use super::law::Gap;
use super::reduced::{Contact, Reduced};

/// Compliance that is added to each contact, relative to the mean one, for contacts that are not independent.
const REDUNDANT: f64 = 1e-13;
/// Penetration that is attributed to rounding, relative to the coordinates.
const ROUNDING: f64 = 1e-14;
/// Number of changes of the active set for each contact. Most problems need less than one.
const CHANGES: usize = 6;

impl Reduced<'_> {
    /// Sets the normal forces to those with which no contact penetrates and each loaded one touches, for the present
    /// normals, displacements along the rod, and friction, which is limited to its cone. Returns whether they exist,
    /// which they may not if the rod is unstable.
    pub(super) fn press(&self, contacts: &mut [Contact]) -> bool {
        let coordinates = self.coordinates(contacts);
        let gap = |at: &Contact| self.surfaces.gap(at.obstacle, &Self::place(at, &coordinates).0);
        let gaps: Vec<Gap> = contacts.iter().map(gap).collect();
        let size = contacts.len();
        let mut compliance = DMatrix::from_fn(size, size, |i, j| {
            let by_force = self.displacement(&contacts[i], &contacts[j]);
            gaps[i].normal.dot(&(by_force * gaps[j].normal))
        });
        let present = DVector::from_fn(size, |i, _| gaps[i].normal.dot(&contacts[i].force));
        let free = DVector::from_fn(size, |i, _| gaps[i].value - contacts[i].clearance) - &compliance * &present;
        let redundant = REDUNDANT * compliance.trace() / size as f64;
        (0..size).for_each(|i| compliance[(i, i)] += redundant);
        let extent = contacts.iter().map(|at| self.free.fixed_rows::<3>(at.first).amax()).fold(0.0, f64::max);
        let rounding = ROUNDING * extent;
        let Some(normal) = complementary(&compliance, &free, present.map(|force| force.max(0.0)), rounding) else {
            return false;
        };
        for ((contact, Gap { normal: n, .. }), force) in contacts.iter_mut().zip(&gaps).zip(&normal) {
            let tangential = contact.force - n * n.dot(&contact.force);
            contact.force = n * *force + tangential.cap_magnitude(contact.friction * force);
        }
        true
    }
}

/// Solves λ ≥ 0, g = C λ + g₀ ≥ 0, λᵀ g = 0 from the initial guess `forces` of λ. Gaps above `-rounding` (m) count as
/// zero. `None` if C is not positive definite on an active set, or if the changes of the set do not end.
fn complementary(
    compliance: &DMatrix<f64>,
    free: &DVector<f64>,
    mut forces: DVector<f64>,
    rounding: f64,
) -> Option<DVector<f64>> {
    let size = free.len();
    let mut active: Vec<usize> = (0..size).filter(|i| forces[*i] > 0.0).collect();
    for _ in 0..CHANGES * size {
        let count = active.len();
        let matrix = DMatrix::from_fn(count, count, |i, j| compliance[(active[i], active[j])]);
        let target = Cholesky::new(matrix)?.solve(&DVector::from_fn(count, |i, _| -free[active[i]]));
        // The forces move towards those of the active set until one of them vanishes.
        let share = |k: usize| forces[active[k]] / (forces[active[k]] - target[k]);
        let ends = (0..count).filter(|k| target[*k] < 0.0).map(|k| (share(k), k));
        let first = ends.min_by(|a, b| a.0.total_cmp(&b.0));
        let fraction = first.map_or(1.0, |(fraction, _)| fraction);
        for (i, target) in active.iter().zip(&target) {
            forces[*i] += fraction * (target - forces[*i]);
        }
        if let Some((_, k)) = first {
            forces[active.swap_remove(k)] = 0.0;
            continue;
        }
        let gaps = compliance * &forces + free;
        let deepest = (0..size).filter(|i| !active.contains(i)).min_by(|i, j| gaps[*i].total_cmp(&gaps[*j]));
        match deepest {
            Some(i) if gaps[i] < -rounding => active.push(i),
            _ => return Some(forces),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_of_many_close_contacts_are_complementary_to_their_gaps() {
        // Contacts at distances s along a clamped beam of unit length and stiffness have the compliance
        // s² (3 t − s)/6 for s ≤ t. Its condition number is 1e10. The gaps are those to a wavy obstacle.
        let places: Vec<f64> = (1..=30).map(|i| 0.4 + 0.02 * f64::from(i)).collect();
        let compliance = DMatrix::from_fn(30, 30, |i, j| {
            let (s, t) = (places[i].min(places[j]), places[i].max(places[j]));
            s * s * (3.0 * t - s) / 6.0
        });
        for phase in 0..20 {
            let gap = |i: usize| 0.02 * (9.0 * places[i] + f64::from(phase)).sin() - 0.03 * places[i] * places[i];
            let free = DVector::from_fn(30, |i, _| gap(i));
            let forces = complementary(&compliance, &free, DVector::zeros(30), 1e-14).expect("a solution");
            let gaps = &compliance * &forces + &free;
            let largest = forces.amax();
            for (force, gap) in forces.iter().zip(&gaps) {
                assert!(*force >= 0.0 && *gap >= -1e-13, "{phase}: {force:e} {gap:e}");
                assert!(force * gap <= 1e-12 * largest, "{phase}: {force:e} {gap:e}");
            }
            assert!(largest > 0.0, "{phase}");
        }
    }

    #[test]
    fn matrix_that_is_not_positive_definite_has_no_forces() {
        let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, -1.0]));
        let free = DVector::from_vec(vec![-1.0, -1.0]);
        assert_eq!(complementary(&compliance, &free, DVector::zeros(2), 1e-14), None);
    }
}
