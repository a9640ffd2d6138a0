//! Linear complementarity problem of normal forces, by an active set.
//!
//! Neighbouring contacts of a slender rod differ by displacements that are much stiffer than their
//! common one. Newton's method for the laws then exchanges sets of loaded contacts without end. An
//! active set changes one contact at a time, and each change decreases the energy (Lawson and
//! Hanson, *Solving Least Squares Problems*, chapter 23, 1974).

use nalgebra::{Cholesky, DMatrix, DVector};

/// Number of changes of the active set for each contact. Most problems need less than one.
const CHANGES: usize = 6;
/// Eigenvalue that is attributed to rounding, relative to the largest one.
const INDEFINITE: f64 = 1e-10;
/// Number of sets of contacts to which stiffness is added. Nearly all problems need one or two.
const STABILISATIONS: usize = 15;

/// The problem of finding forces λ ≥ 0 with gaps g = C λ + g₀ ≥ 0 and λᵀ g = 0.
pub(super) struct Complementarity {
    /// Compliance C, m/N. It is symmetric.
    pub compliance: DMatrix<f64>,
    /// Gaps g₀ without forces, m.
    pub free: DVector<f64>,
    /// Penetration that counts as zero, m.
    pub rounding: f64,
}

impl Complementarity {
    /// Solves the problem from the initial guess `forces`, also for a rod that is stable only while
    /// it is held by its loaded contacts. C is indefinite then. The stiffness ρ at the loaded
    /// contacts makes it positive definite: with the forces λ = λ′ − ρ g the solution λ′ for the
    /// stiffened rod is that for the rod, if the contacts with stiffness remain loaded. Those that
    /// do not lose their stiffness, and the problem is solved again (augmented Lagrangian Hessian;
    /// Nocedal and Wright, *Numerical Optimization*, 2006, section 18.3).
    pub fn stabilised(&self, mut forces: DVector<f64>) -> Option<DVector<f64>> {
        let Self {
            compliance,
            free,
            rounding,
        } = self;
        let all: Vec<usize> = (0..free.len()).collect();
        let mut least = self.least_negative(&all);
        if !least.is_finite() {
            return self.solve(forces);
        }
        let loaded = |forces: &DVector<f64>| {
            all.iter()
                .copied()
                .filter(|i| forces[*i] > 0.0)
                .collect::<Vec<_>>()
        };
        let mut set = loaded(&forces);
        let of_loaded = self.least_negative(&set);
        if of_loaded.is_finite() {
            least = of_loaded;
        } else {
            set.clone_from(&all);
        }
        for _ in 0..STABILISATIONS {
            // This stiffness makes every negative eigenvalue of the block of `set` positive, except
            // for rounding.
            let stiffness = 2.0 / least;
            let columns = compliance.select_columns(&set);
            let mut matrix = columns.select_rows(&set);
            (0..set.len()).for_each(|i| matrix[(i, i)] += 1.0 / stiffness);
            let factors = matrix.lu();
            let stiffened = compliance - &columns * factors.solve(&columns.transpose())?;
            let gaps = free - &columns * factors.solve(&free.select_rows(&set))?;
            let present = compliance * &forces + free;
            for i in &set {
                forces[*i] = (forces[*i] + stiffness * present[*i]).max(0.0);
            }
            forces = Self {
                compliance: stiffened,
                free: gaps,
                rounding: *rounding,
            }
            .solve(forces)?;
            if set.iter().all(|i| forces[*i] > 0.0) {
                return Some(forces);
            }
            set = loaded(&forces);
            least = self.least_negative(&set);
            if !least.is_finite() {
                return None;
            }
        }
        None
    }

    /// Returns the smallest magnitude of the negative eigenvalues of a diagonal block of C. It is
    /// infinite if all eigenvalues are positive.
    fn least_negative(&self, set: &[usize]) -> f64 {
        let block = self.compliance.select_rows(set).select_columns(set);
        if set.is_empty() || Cholesky::new(block.clone()).is_some() {
            return f64::INFINITY;
        }
        let eigenvalues = block.symmetric_eigenvalues();
        let rounding = INDEFINITE * eigenvalues.amax();
        eigenvalues
            .iter()
            .map(|value| -value)
            .filter(|size| *size > rounding)
            .fold(f64::INFINITY, f64::min)
    }

    /// Solves the problem from the initial guess `forces`. `None` if C is not positive definite on
    /// an active set, or if the changes of the set do not end.
    fn solve(&self, mut forces: DVector<f64>) -> Option<DVector<f64>> {
        let Self {
            compliance,
            free,
            rounding,
        } = self;
        let size = free.len();
        let mut active: Vec<usize> = (0..size).filter(|i| forces[*i] > 0.0).collect();
        for _ in 0..CHANGES * size {
            let count = active.len();
            let matrix = DMatrix::from_fn(count, count, |i, j| compliance[(active[i], active[j])]);
            let target =
                Cholesky::new(matrix)?.solve(&DVector::from_fn(count, |i, _| -free[active[i]]));
            // The forces move towards those of the active set until one of them vanishes.
            let fraction = |k: usize| forces[active[k]] / (forces[active[k]] - target[k]);
            let ends = (0..count)
                .filter(|k| target[*k] < 0.0)
                .map(|k| (fraction(k), k));
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
            let deepest = (0..size)
                .filter(|i| !active.contains(i))
                .min_by(|i, j| gaps[*i].total_cmp(&gaps[*j]));
            match deepest {
                Some(i) if gaps[i] < -rounding => active.push(i),
                _ => return Some(forces),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_of_many_close_contacts_are_complementary_to_their_gaps() {
        // Contacts at distances s along a clamped beam of unit length and stiffness have the
        // compliance s² (3 t − s)/6 for s ≤ t. Its condition number is 1e10. The gaps are those to
        // a wavy obstacle.
        let places: Vec<f64> = (1..=30).map(|i| 0.4 + 0.02 * f64::from(i)).collect();
        let compliance = DMatrix::from_fn(30, 30, |i, j| {
            let (s, t) = (places[i].min(places[j]), places[i].max(places[j]));
            s * s * (3.0 * t - s) / 6.0
        });
        for phase in 0..20 {
            let gap = |i: usize| {
                0.02 * (9.0 * places[i] + f64::from(phase)).sin() - 0.03 * places[i] * places[i]
            };
            let free = DVector::from_fn(30, |i, _| gap(i));
            let problem = Complementarity {
                compliance: compliance.clone(),
                free,
                rounding: 1e-14,
            };
            let forces = problem.solve(DVector::zeros(30)).expect("a solution");
            let gaps = &compliance * &forces + &problem.free;
            let largest = forces.amax();
            for (force, gap) in forces.iter().zip(&gaps) {
                assert!(
                    *force >= 0.0 && *gap >= -1e-13,
                    "{phase}: {force:e} {gap:e}"
                );
                assert!(force * gap <= 1e-12 * largest, "{phase}: {force:e} {gap:e}");
            }
            assert!(largest > 0.0, "{phase}");
        }
    }

    #[test]
    fn rod_that_its_contacts_hold_has_the_forces_of_these_contacts() {
        // The first contact holds a direction in which the rod alone is unstable: g₁ = g₀ − λ₁ with
        // g₀ = 0.5. The second one touches, is open, or opens since the first one pushes it away by
        // c λ₁.
        for (coupling, gap, expected) in [
            (0.0, -1.0, 1.0),
            (0.0, 0.3, 0.0),
            (0.4, -1.0, 0.69),
            (3.0, -1.0, 0.0),
        ] {
            let compliance = DMatrix::from_row_slice(2, 2, &[-1.0, coupling, coupling, 1.0]);
            // With the force λ₂ the first gap is g₀ + c λ₂ − λ₁ = 0.
            let free = DVector::from_vec(vec![0.5, gap]);
            let problem = Complementarity {
                compliance,
                free,
                rounding: 1e-14,
            };
            let forces = problem
                .stabilised(DVector::from_vec(vec![0.4, 0.0]))
                .expect("forces");
            let first = 0.5 + coupling * forces[1];
            let gaps = &problem.compliance * &forces + &problem.free;
            assert!(
                (forces[0] - first).abs() < 1e-14 && gaps[0].abs() < 1e-14,
                "{coupling} {gap}: {forces:?}"
            );
            let second = ((-gap - 0.5 * coupling) / (1.0 + coupling * coupling)).max(0.0);
            assert!(
                (second - expected).abs() < 0.01 && (forces[1] - second).abs() < 1e-14,
                "{forces:?}"
            );
            assert!(
                gaps[1] > -1e-14 && (gaps[1] * forces[1]).abs() < 1e-14,
                "{gaps:?}"
            );
        }
    }

    #[test]
    fn matrix_that_is_not_positive_definite_has_no_forces() {
        let compliance = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, -1.0]));
        let free = DVector::from_vec(vec![-1.0, -1.0]);
        let problem = Complementarity {
            compliance,
            free,
            rounding: 1e-14,
        };
        assert_eq!(problem.solve(DVector::zeros(2)), None);
    }
}
