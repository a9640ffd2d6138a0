//! Normal forces of all contacts for given friction: a linear complementarity problem, by an active set.
//!
//! Neighbouring contacts of a slender rod differ by displacements that are much stiffer than their common one. Newton's
//! method for the laws then exchanges sets of loaded contacts without end. An active set changes one contact at a time,
//! and each change decreases the energy (Lawson and Hanson, *Solving Least Squares Problems*, chapter 23, 1974).

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};

use super::law::Gap;
use super::reduced::{Contact, Reduced};

/// Compliance that is added to each contact, relative to the mean one, for contacts that are not independent.
const REDUNDANT: f64 = 1e-13;
/// Penetration that is attributed to rounding, relative to the coordinates.
const ROUNDING: f64 = 1e-14;
/// Number of changes of the active set for each contact. Most problems need less than one.
const CHANGES: usize = 6;
/// Eigenvalue that is attributed to rounding, relative to the largest one.
const INDEFINITE: f64 = 1e-10;
/// Number of sets of contacts to which stiffness is added. Nearly all problems need one or two.
const STABILISATIONS: usize = 15;

impl Reduced<'_> {
    /// Sets the normal forces to those with which no contact penetrates and each loaded one touches, for the present
    /// normals, displacements along the rod, and friction, which is limited to its cone. Returns whether they exist,
    /// which they may not if the rod is unstable.
    pub(super) fn press(&self, contacts: &mut [Contact]) -> bool {
        let coordinates = self.coordinates(contacts);
        let (size, dimension) = (contacts.len(), self.free.len());
        let places: Vec<_> = contacts.iter().map(|at| Self::place(at, &coordinates)).collect();
        let gaps: Vec<Gap> =
            contacts.iter().zip(&places).map(|(at, (place, _))| self.surfaces.gap(at.obstacle, place)).collect();
        let mut normals = DMatrix::zeros(size, dimension);
        // Rows of the negative stiffness of the contact forces, with their offsets.
        let mut rows: Vec<(DVector<f64>, f64, f64)> = Vec::new();
        // The rows that displace the contacts along the rod.
        let mut slides: Vec<Option<(DVector<f64>, f64)>> = vec![None; size];
        let mut least = DVector::zeros(size);
        for (i, (at, gap)) in contacts.iter().zip(&gaps).enumerate() {
            let along = |direction: &Vector3<f64>| {
                let mut row = DVector::zeros(dimension);
                row.fixed_rows_mut::<3>(at.first).copy_from(direction);
                if at.range.is_some() {
                    row.fixed_rows_mut::<3>(at.first + 3).copy_from(&(direction * at.shift));
                }
                row
            };
            normals.set_row(i, &along(&gap.normal).transpose());
            least[i] = gap.value - at.clearance;
            let push = gap.normal.dot(&at.force);
            let eigen = gap.curvature.symmetric_eigen();
            for (side, value) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
                if push * value > 0.0 {
                    rows.push((along(&(side * (push * value).sqrt())), 0.0, -1.0));
                }
            }
            if let Some([from, to]) = at.range {
                let tangent = places[i].1;
                let slope = gap.normal.dot(&tangent);
                let mut row = along(&(gap.curvature * tangent));
                let mut turn = row.fixed_rows_mut::<3>(at.first + 3);
                turn += gap.normal;
                let moved = at.shift - slope / at.curve;
                if push > 0.0 && at.curve > 0.0 && moved > from && moved < to {
                    let factor = (push / at.curve).sqrt();
                    rows.push((&row * factor, slope * factor, 1.0));
                    least[i] -= 0.5 * slope * slope / at.curve;
                }
                slides[i] = Some((row, slope));
            }
        }
        let stiffness = DMatrix::from_fn(rows.len(), dimension, |k, j| rows[k].0[j]);
        let offsets = DVector::from_fn(rows.len(), |k, _| rows[k].1);
        let by_normals = self.compliance * normals.transpose();
        let by_rows = self.compliance * stiffness.transpose();
        let mut matrix = -(&stiffness * &by_rows);
        (0..rows.len()).for_each(|k| matrix[(k, k)] -= rows[k].2);
        let factors = matrix.lu();
        let across = &stiffness * &by_normals;
        let (inner, turned) = if rows.is_empty() {
            (across.clone(), offsets)
        } else {
            let (Some(inner), Some(turned)) = (factors.solve(&across), factors.solve(&offsets)) else { return false };
            (inner, turned)
        };
        let mut compliance = &normals * &by_normals + across.transpose() * &inner;
        compliance = (&compliance + compliance.transpose()) * 0.5;
        let present = DVector::from_fn(size, |i, _| gaps[i].normal.dot(&contacts[i].force));
        let free = least + across.transpose() * &turned - &compliance * &present;
        let redundant = REDUNDANT * compliance.trace().abs() / size as f64;
        (0..size).for_each(|i| compliance[(i, i)] += redundant);
        let extent = contacts.iter().map(|at| self.free.fixed_rows::<3>(at.first).amax()).fold(0.0, f64::max);
        let rounding = ROUNDING * extent;
        if !compliance.iter().chain(&free).all(|value| value.is_finite()) {
            return false;
        }
        let Some(normal) = stabilised(&compliance, &free, present.map(|force| force.max(0.0)), rounding) else {
            return false;
        };
        let change = &normal - &present;
        let moved = &by_normals * &change + &by_rows * (inner * &change + turned);
        for (((contact, Gap { normal: n, .. }), force), slide) in
            contacts.iter_mut().zip(&gaps).zip(&normal).zip(&slides)
        {
            let tangential = contact.force - n * n.dot(&contact.force);
            contact.force = n * *force + tangential.cap_magnitude(contact.friction * force);
            if let (Some((row, slope)), Some([from, to])) = (slide, contact.range)
                && contact.curve > 0.0
            {
                contact.shift = (contact.shift - (slope + row.dot(&moved)) / contact.curve).clamp(from, to);
            }
        }
        true
    }
}

/// As [`complementary`], also for a rod that is stable only while it is held by its loaded contacts. C is indefinite
/// then. The stiffness ρ at the loaded contacts makes it positive definite: with the forces λ = λ′ − ρ g the solution
/// λ′ for the stiffened rod is that for the rod, if the contacts with stiffness remain loaded. Those that do not lose
/// their stiffness, and the problem is solved again (augmented Lagrangian Hessian; Nocedal and Wright, *Numerical
/// Optimization*, 2006, section 18.3).
fn stabilised(
    compliance: &DMatrix<f64>,
    free: &DVector<f64>,
    mut forces: DVector<f64>,
    rounding: f64,
) -> Option<DVector<f64>> {
    let size = free.len();
    let all: Vec<usize> = (0..size).collect();
    if !least_negative(compliance, &all).is_finite() {
        return complementary(compliance, free, forces, rounding);
    }
    let mut set: Vec<usize> = (0..size).filter(|i| forces[*i] > 0.0).collect();
    if !least_negative(compliance, &set).is_finite() {
        set = all;
    }
    for _ in 0..STABILISATIONS {
        let least = least_negative(compliance, &set);
        if !least.is_finite() {
            return None;
        }
        // The smallest negative eigenvalue changes its sign.
        let stiffness = 2.0 / least;
        let columns = compliance.select_columns(&set);
        let mut matrix = columns.select_rows(&set);
        (0..set.len()).for_each(|i| matrix[(i, i)] += 1.0 / stiffness);
        let factors = matrix.lu();
        let stiffened = compliance - &columns * factors.solve(&columns.transpose())?;
        let gaps = free - &columns * factors.solve(&free.select_rows(&set))?;
        let start = forces.clone();
        let present = compliance * &forces + free;
        for i in &set {
            forces[*i] = (start[*i] + stiffness * present[*i]).max(0.0);
        }
        forces = complementary(&stiffened, &gaps, forces, rounding)?;
        let loaded = |i: &usize| forces[*i] > 0.0;
        if set.iter().all(loaded) {
            return Some(forces);
        }
        set = (0..size).filter(loaded).collect();
    }
    None
}

/// The smallest size of a negative eigenvalue of a block of a symmetric matrix; infinite if there is none.
fn least_negative(matrix: &DMatrix<f64>, set: &[usize]) -> f64 {
    let block = matrix.select_rows(set).select_columns(set);
    if set.is_empty() || Cholesky::new(block.clone()).is_some() {
        return f64::INFINITY;
    }
    let eigenvalues = block.symmetric_eigenvalues();
    let rounding = INDEFINITE * eigenvalues.amax();
    eigenvalues.iter().map(|value| -value).filter(|size| *size > rounding).fold(f64::INFINITY, f64::min)
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
