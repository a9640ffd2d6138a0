//! Normal forces of all contacts for given friction: a linear complementarity problem, by an active set.
//!
//! Neighbouring contacts of a slender rod differ by displacements that are much stiffer than their common one. Newton's
//! method for the laws then exchanges sets of loaded contacts without end. An active set changes one contact at a time,
//! and each change decreases the energy (Lawson and Hanson, *Solving Least Squares Problems*, chapter 23, 1974).

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};

use super::law::Gap;
use super::reduced::{LinearContact, Reduced};

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

/// A contact, linearised at the place that it has with the present forces.
struct Linearised {
    gap: Gap,
    /// The gap (m) at the place of least gap, to second order, and its derivatives by the coordinates.
    least: f64,
    normal: DVector<f64>,
    /// The slope along the rod and its derivatives by the coordinates, if the contact moves along the rod.
    slide: Option<(f64, DVector<f64>)>,
    /// The second derivatives of the gap, times the force.
    bends: Vec<Bend>,
}

/// A term σ (b · u + c)²/2 by which displacements u of the coordinates change the work of a normal force.
struct Bend {
    /// The row b, and the constant c.
    row: DVector<f64>,
    offset: f64,
    /// The sign σ: positive where the contact slides to a smaller gap, and negative where it turns about the obstacle.
    sign: f64,
}

/// The response to normal forces of a rod whose contacts slide and turn.
struct Pressed {
    /// Change of the gaps by the normal forces, m/N, and without changes of these forces, m.
    compliance: DMatrix<f64>,
    settled: DVector<f64>,
    /// Change of the coordinates by the normal forces, and without changes of these forces.
    by_forces: DMatrix<f64>,
    moved: DVector<f64>,
}

impl Reduced<'_> {
    /// Sets the normal forces to those with which no contact penetrates and each loaded one touches, for the present
    /// normals, displacements along the rod, and friction, which is limited to its cone. Returns whether they exist,
    /// which they may not if the rod is unstable.
    pub(super) fn press(&self, contacts: &mut [LinearContact]) -> bool {
        let coordinates = self.coordinates(contacts);
        let linear: Vec<Linearised> = contacts.iter().map(|at| self.linearised(at, &coordinates)).collect();
        let Some(Pressed { mut compliance, settled, by_forces, moved }) = self.pressed(&linear) else { return false };
        let size = contacts.len();
        let present = DVector::from_fn(size, |i, _| linear[i].gap.normal.dot(&contacts[i].force));
        let least = DVector::from_fn(size, |i, _| linear[i].least);
        let free = least + settled - &compliance * &present;
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
        let moved = by_forces * (&normal - &present) + moved;
        for ((contact, at), force) in contacts.iter_mut().zip(&linear).zip(&normal) {
            let n = &at.gap.normal;
            let tangential = contact.force - n * n.dot(&contact.force);
            contact.force = n * *force + tangential.cap_magnitude(contact.friction * force);
            if let (Some((slope, row)), Some([from, to])) = (&at.slide, contact.range)
                && contact.curve > 0.0
            {
                contact.travel = (contact.travel - (slope + row.dot(&moved)) / contact.curve).clamp(from, to);
            }
        }
        true
    }

    fn linearised(&self, at: &LinearContact, coordinates: &DVector<f64>) -> Linearised {
        // Derivatives of the component of the place in a direction.
        let along = |direction: Vector3<f64>| {
            let mut row = DVector::zeros(coordinates.len());
            LinearContact { force: direction, ..*at }.load(&mut row);
            row
        };
        let (place, tangent) = Self::place(at, coordinates);
        let gap = self.surfaces.gap(at.obstacle, &place);
        let mut least = gap.value - at.clearance;
        let mut bends = Vec::new();
        let push = gap.normal.dot(&at.force);
        let eigen = gap.curvature.symmetric_eigen();
        for (side, value) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            if push * value > 0.0 {
                bends.push(Bend { row: along(side * (push * value).sqrt()), offset: 0.0, sign: -1.0 });
            }
        }
        let slide = at.range.map(|[from, to]| {
            let slope = gap.normal.dot(&tangent);
            let mut row = along(gap.curvature * tangent);
            let mut turn = row.fixed_rows_mut::<3>(at.first + 3);
            turn += gap.normal;
            let moved = at.travel - slope / at.curve;
            if push > 0.0 && at.curve > 0.0 && moved > from && moved < to {
                let factor = (push / at.curve).sqrt();
                bends.push(Bend { row: &row * factor, offset: slope * factor, sign: 1.0 });
                least -= 0.5 * slope * slope / at.curve;
            }
            (slope, row)
        });
        Linearised { gap, least, normal: along(gap.normal), slide, bends }
    }

    /// Eliminates the displacements that the second derivatives of the gaps cause. `None` if their equations are
    /// singular.
    fn pressed(&self, linear: &[Linearised]) -> Option<Pressed> {
        let dimension = self.free.len();
        let bends: Vec<&Bend> = linear.iter().flat_map(|at| &at.bends).collect();
        let normals = DMatrix::from_fn(linear.len(), dimension, |i, j| linear[i].normal[j]);
        let rows = DMatrix::from_fn(bends.len(), dimension, |k, j| bends[k].row[j]);
        let offsets = DVector::from_fn(bends.len(), |k, _| bends[k].offset);
        let by_normals = self.compliance * normals.transpose();
        let by_rows = self.compliance * rows.transpose();
        let mut matrix = -(&rows * &by_rows);
        (0..bends.len()).for_each(|k| matrix[(k, k)] -= bends[k].sign);
        let across = &rows * &by_normals;
        let factors = matrix.lu();
        // The elimination of no displacement is not singular.
        let solve = |rhs: &DMatrix<f64>| if bends.is_empty() { Some(rhs.clone()) } else { factors.solve(rhs) };
        let (inner, turned) = (solve(&across)?, solve(&DMatrix::from_columns(&[offsets]))?.column(0).into_owned());
        let compliance = &normals * &by_normals + across.transpose() * &inner;
        Some(Pressed {
            compliance: (&compliance + compliance.transpose()) * 0.5,
            settled: across.transpose() * &turned,
            moved: &by_rows * turned,
            by_forces: by_normals + by_rows * inner,
        })
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
    let mut least = least_negative(compliance, &all);
    if !least.is_finite() {
        return complementary(compliance, free, forces, rounding);
    }
    let mut set: Vec<usize> = (0..size).filter(|i| forces[*i] > 0.0).collect();
    let loaded = least_negative(compliance, &set);
    if loaded.is_finite() {
        least = loaded;
    } else {
        set = all;
    }
    for _ in 0..STABILISATIONS {
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
        least = least_negative(compliance, &set);
        if !least.is_finite() {
            return None;
        }
    }
    None
}

/// Returns the smallest magnitude of the negative eigenvalues of a block of a symmetric matrix. It is infinite if all
/// eigenvalues are positive.
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
    fn rod_that_its_contacts_hold_has_the_forces_of_these_contacts() {
        // The first contact holds a direction in which the rod alone is unstable: g₁ = g₀ − λ₁ with g₀ = 0.5. The
        // second one touches, is open, or opens since the first one pushes it away by c λ₁.
        for (coupling, gap, expected) in [(0.0, -1.0, 1.0), (0.0, 0.3, 0.0), (0.4, -1.0, 0.69), (3.0, -1.0, 0.0)] {
            let compliance = DMatrix::from_row_slice(2, 2, &[-1.0, coupling, coupling, 1.0]);
            // With the force λ₂ the first gap is g₀ + c λ₂ − λ₁ = 0.
            let free = DVector::from_vec(vec![0.5, gap]);
            let forces = stabilised(&compliance, &free, DVector::from_vec(vec![0.4, 0.0]), 1e-14).expect("forces");
            let first = 0.5 + coupling * forces[1];
            let gaps = &compliance * &forces + &free;
            assert!((forces[0] - first).abs() < 1e-14 && gaps[0].abs() < 1e-14, "{coupling} {gap}: {forces:?}");
            let second = ((-gap - 0.5 * coupling) / (1.0 + coupling * coupling)).max(0.0);
            assert!((second - expected).abs() < 0.01 && (forces[1] - second).abs() < 1e-14, "{forces:?}");
            assert!(gaps[1] > -1e-14 && (gaps[1] * forces[1]).abs() < 1e-14, "{gaps:?}");
        }
    }

    #[test]
    fn matrix_that_is_not_positive_definite_has_no_forces() {
        let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, -1.0]));
        let free = DVector::from_vec(vec![-1.0, -1.0]);
        assert_eq!(complementary(&compliance, &free, DVector::zeros(2), 1e-14), None);
    }
}
