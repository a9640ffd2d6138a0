//! Neutral directions of a tangent: rotations that change the energy only by rounding.
//!
//! The direction v of a pivot d solves Lᵀ v = e, where e is the unit vector of its column, and vᵀ K
//! v = d. It is neutral if d is rounding of the sum of K_kk v_k². This sum is large for a shoot
//! that has just buckled: its frames bend by many times the twist of the apex, whose pivot is the
//! last one.

use nalgebra::Vector3;

use super::tangent::Tangent;

/// Rounding of the rotation between the ends of an element, rad. A product of two quaternions is a
/// sum of four products.
const ROTATION: f64 = 4.0 * f64::EPSILON;

impl Tangent {
    /// The sum of K_kk v_k² for the direction v of the pivot of a column.
    pub(super) fn terms_of_pivot(&mut self, column: usize) -> f64 {
        self.find_direction(column);
        (0..=column)
            .map(|k| self.size(k) * self.rhs[k] * self.rhs[k])
            .sum()
    }

    /// Finds the neutral directions along which the unbalanced `couples` (N m) do more work than
    /// their rounding. Every couple has the rounding `least` (N m). The rounding of the rotation in
    /// an element adds opposite couples at its ends. The elements have the given `compliance`,
    /// rad/(N m), and the base is clamped.
    pub(super) fn find_unbalanced(
        &mut self,
        couples: &[Vector3<f64>],
        compliance: impl Iterator<Item = f64> + Clone,
        least: f64,
    ) {
        for at in 0..self.neutral.len() {
            let (column, pivot) = self.neutral[at];
            self.find_direction(column);
            let (mut work, mut rounding, mut before) = (0.0, 0.0, Vector3::zeros());
            for ((v, couple), compliance) in self
                .rhs
                .chunks_exact(3)
                .zip(couples)
                .zip(compliance.clone())
            {
                let v = Vector3::from_column_slice(v);
                work += couple.dot(&v);
                rounding += ROTATION * (v - before).norm() / compliance + least * v.norm();
                before = v;
            }
            if work.abs() > rounding {
                self.unbalanced.push((column, pivot));
            }
        }
    }

    /// Writes the direction of the pivot of a column to the right-hand side. Its component in this
    /// column is one. Directions that are neutral already are left out.
    fn find_direction(&mut self, column: usize) {
        let Some(symbolic) = &self.symbolic else {
            return;
        };
        self.rhs.fill(0.0);
        self.rhs[column] = 1.0;
        for k in (0..column).rev() {
            let entries = symbolic.col_ptr()[k]..symbolic.col_ptr()[k + 1];
            let (pivot, below) = (self.factors[entries.start], entries.start + 1..entries.end);
            if pivot.is_finite() {
                let sum: f64 = below
                    .map(|at| self.factors[at] * self.rhs[symbolic.row_idx()[at]])
                    .sum();
                self.rhs[k] = -sum;
            }
        }
    }

    /// Gives the directions that are not balanced a positive pivot, so that a step goes along them.
    pub(super) fn release_unbalanced(&mut self) {
        for at in 0..self.unbalanced.len() {
            let (column, pivot) = self.unbalanced[at];
            self.set_pivot(column, pivot);
        }
    }

    /// Keeps the rotations in neutral directions unchanged in the following solutions.
    pub(super) fn fix_neutral(&mut self) {
        for at in 0..self.neutral.len() {
            self.set_pivot(self.neutral[at].0, f64::INFINITY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Inertia;
    use super::*;
    use nalgebra::Matrix3;

    /// A matrix with the diagonal 1, 1 + p, 1 + `stiffness`, whose second pivot is p. The direction
    /// of the third one is (b/p, −b/p, 1) with b² = p, and its stiffness is `stiffness`.
    fn inertia_of(p: f64, stiffness: f64, couple: Vector3<f64>) -> (Inertia, Tangent) {
        let (mut tangent, mut inertia, b) = (Tangent::default(), Inertia::default(), p.sqrt());
        tangent.reset(1).unwrap();
        tangent.add_diagonal(
            0,
            &Matrix3::new(1.0, 1.0, 0.0, 1.0, 1.0 + p, b, 0.0, b, 1.0 + stiffness),
        );
        let _ = tangent.factorise(&mut inertia, [1.0].into_iter()).unwrap();
        tangent.find_unbalanced(&[couple], [1.0].into_iter(), 0.0);
        (inertia, tangent)
    }

    #[test]
    fn stiffness_is_neutral_if_it_is_rounding_of_its_terms() {
        for k in 0..100 {
            // The second pivot has the rounding 2e-16, so that the third one has 2e-16/p.
            let p = 1e-6 * (1.0 + 0.1 * f64::from(k));
            let (inertia, tangent) = inertia_of(p, 0.0, Vector3::zeros());
            assert_eq!(
                (inertia.negative, inertia.neutral, tangent.unbalanced.len()),
                (0, 1, 0),
                "{p}: {inertia:?}"
            );
            let limit = 64.0 * f64::EPSILON / p;
            assert_eq!(inertia_of(p, 0.5 * limit, Vector3::zeros()).0.neutral, 1);
            assert_eq!(inertia_of(p, 2.0 * limit, Vector3::zeros()).0.neutral, 0);
            assert_eq!(inertia_of(p, -2.0 * limit, Vector3::zeros()).0.negative, 1);
        }
    }

    #[test]
    fn couple_along_a_neutral_direction_releases_it() {
        let p: f64 = 1e-6;
        let direction = Vector3::new(1.0, -1.0, p.sqrt());
        let across = direction.cross(&Vector3::z());
        // The rounding of the work, 4 ε √2 per unit of the direction, hides couples of 1e-16 along
        // it.
        for (couple, open) in [
            (direction, true),
            (direction * 1e-14, true),
            (direction * 1e-16, false),
            (across, false),
        ] {
            let (inertia, mut tangent) = inertia_of(p, 0.0, couple);
            assert_eq!(
                (inertia.neutral, tangent.unbalanced.len()),
                (1, usize::from(open)),
                "{couple}"
            );
            // An infinite pivot makes the component in its column exactly zero. With the largest
            // neutral pivot, 1.4e-8, the couple of 1e-14 would rotate by 1e-6.
            let mut turns = [couple];
            tangent.release_unbalanced();
            tangent.solve(&mut turns);
            let turn = turns[0];
            assert!(
                if open {
                    turn.dot(&direction) > 1e-6
                } else {
                    turn.z == 0.0
                },
                "{couple}: {turn}"
            );
        }
    }
}
