//! The condensed tangent: a symmetric block tridiagonal matrix of 3 × 3 blocks, and its factors L D Lᵀ.

use nalgebra::{Matrix3, Vector3};

use super::{EquilibriumError, Inertia};

/// Largest neutral pivot, relative to the diagonal entry before elimination. Rounding contributes a few units
/// of 1e-16 times the growth of the elimination, and the error of the equilibrium adds to it: just above the
/// critical length a neutral pivot is accurate to 3e-11. A length that differs by 1e-8 from the critical one
/// has a pivot of about 1e-9.
pub(super) const NEUTRAL: f64 = 1e-10;

/// Smallest pivot, relative to the diagonal entry, with which the tangent of a held rod is factorised: half of the digits
/// remain. Smaller ones occur where the rod would be at its stability limit without the holds.
const BOOSTED: f64 = 1e-6;

/// Replacement of a pivot that is zero. It counts as neutral, and its inverse is finite.
const ZERO_PIVOT: f64 = f64::MIN_POSITIVE * 1e100;

/// The matrix and its factors. Rows are in natural order: elimination from base to apex has no fill-in.
#[derive(Debug, Default)]
pub(super) struct Tangent {
    blocks: Vec<Block>,
    factors: Vec<Factor>,
}

/// Columns of the upper triangle for an unknown frame.
#[derive(Debug, Clone, Default)]
struct Block {
    /// The upper triangle is used.
    diagonal: Matrix3<f64>,
    /// Rows of the frame before, columns of this one.
    coupling: Matrix3<f64>,
}

/// Factors of the columns of a block.
#[derive(Debug, Clone, Default)]
struct Factor {
    pivots: Vector3<f64>,
    /// Reciprocals of the pivots, by which a solution is multiplied; zero for a neutral direction.
    inverse: Vector3<f64>,
    /// Entries of L in the block: (1, 0), (2, 0) and (2, 1).
    lower: [f64; 3],
    /// Transposed entries of L in the rows of the next frame.
    next: Matrix3<f64>,
}

impl Tangent {
    /// Sets the number of unknown frames, and every entry to zero. Allocates only beyond the largest earlier number.
    pub fn reset(&mut self, blocks: usize) {
        self.blocks.clear();
        self.blocks.resize(blocks, Block::default());
        self.factors.resize(blocks, Factor::default());
    }

    /// Adds to the diagonal block of an unknown frame; the upper triangle of `m` is read.
    pub fn add_diagonal(&mut self, block: usize, m: &Matrix3<f64>) {
        self.blocks[block].diagonal += m;
    }

    /// Sets the block that couples frame `block` (columns) to the one before it (rows).
    pub fn set_coupling(&mut self, block: usize, m: &Matrix3<f64>) {
        self.blocks[block].coupling = *m;
    }

    /// Computes the factors.
    fn factorise_values(&mut self) -> Result<(), EquilibriumError> {
        let mut diagonal = self.blocks.first().map_or(Matrix3::zeros(), |block| block.diagonal);
        for (b, factor) in self.factors.iter_mut().enumerate() {
            let next = self.blocks.get(b + 1);
            let mut rows = next.map_or(Matrix3::zeros(), |next| next.coupling);
            let regular = |pivot: f64| if pivot.abs() < f64::MIN_POSITIVE { ZERO_PIVOT } else { pivot };
            let first = regular(diagonal[(0, 0)]);
            let (a, b) = (diagonal[(0, 1)] / first, diagonal[(0, 2)] / first);
            let second = regular(diagonal[(1, 1)] - a * diagonal[(0, 1)]);
            let mixed = diagonal[(1, 2)] - a * diagonal[(0, 2)];
            let c = mixed / second;
            let third = regular(diagonal[(2, 2)] - b * diagonal[(0, 2)] - c * mixed);
            factor.pivots = Vector3::new(first, second, third);
            factor.inverse = factor.pivots.map(|pivot| 1.0 / pivot);
            factor.lower = [a, b, c];
            for j in 0..3 {
                rows[(1, j)] -= a * rows[(0, j)];
                rows[(2, j)] -= b * rows[(0, j)] + c * rows[(1, j)];
            }
            for j in 0..3 {
                for i in 0..3 {
                    factor.next[(i, j)] = rows[(i, j)] * factor.inverse[i];
                }
            }
            if let Some(next) = next {
                diagonal = next.diagonal - rows.tr_mul(&factor.next);
            }
        }
        let finite = self.factors.iter().all(|factor| factor.pivots.iter().all(|pivot| pivot.is_finite()));
        if finite { Ok(()) } else { Err(EquilibriumError::NotFinite { what: "tangent" }) }
    }

    /// The pivot of a column.
    fn pivot(&self, column: usize) -> f64 {
        self.factors[column / 3].pivots[column % 3]
    }

    /// The size of the diagonal entry of a column.
    fn size(&self, column: usize) -> f64 {
        self.blocks[column / 3].diagonal[(column % 3, column % 3)].abs()
    }

    /// Confines the rotation of an unknown frame to the range of a projection. The removed directions get the identity,
    /// scaled as the rest of the block.
    pub fn project(&mut self, block: usize, projection: &Matrix3<f64>) {
        let diagonal = self.blocks[block].diagonal;
        let diagonal = Matrix3::from_fn(|row, col| diagonal[(row.min(col), row.max(col))]);
        let rest = (Matrix3::identity() - projection) * (diagonal.trace().abs() / 3.0);
        self.blocks[block].diagonal = projection * diagonal * projection + rest;
        self.blocks[block].coupling *= projection;
        if let Some(next) = self.blocks.get_mut(block + 1) {
            next.coupling = projection * next.coupling;
        }
    }

    /// Factorises a tangent whose leading parts may be singular: a diagonal entry with a small pivot is increased, and
    /// appended with the increase to `boosts`. Adds the pivots to `inertia`.
    pub fn factorise_boosted(
        &mut self,
        inertia: &mut Inertia,
        boosts: &mut Vec<(usize, f64)>,
    ) -> Result<(), EquilibriumError> {
        boosts.clear();
        loop {
            self.factorise_values()?;
            let small =
                (0..3 * self.blocks.len()).find(|&column| !(self.pivot(column).abs() > BOOSTED * self.size(column)));
            let Some(column) = small else { break };
            if boosts.iter().any(|(boosted, _)| *boosted == column) {
                return Err(EquilibriumError::NotFinite { what: "tangent" });
            }
            let increase = self.size(column).max(f64::MIN_POSITIVE.sqrt());
            self.blocks[column / 3].diagonal[(column % 3, column % 3)] += increase;
            boosts.push((column, increase));
        }
        for column in 0..3 * self.blocks.len() {
            inertia.count(self.pivot(column), self.size(column), 0.0);
        }
        Ok(())
    }

    /// Factorises and adds the pivots to `inertia`. Their signs are those of the eigenvalues (Sylvester). Returns the
    /// smallest pivot relative to that of the same rod without load, given the elements' `compliance`, rad/(N m).
    pub fn factorise(
        &mut self,
        inertia: &mut Inertia,
        compliance: impl Iterator<Item = f64> + Clone,
    ) -> Result<f64, EquilibriumError> {
        self.factorise_values()?;
        // Short elements have large diagonal entries, relative to which the stiffness of the rest of the rod
        // may be tiny. It must not count as neutral.
        let largest = |block: &Block| block.diagonal.diagonal().amax();
        let floor = self.blocks.iter().map(largest).fold(f64::INFINITY, f64::min);
        // In a rod without load the part up to a frame and the element beyond it are springs in parallel.
        let behind = compliance.clone().skip(1).chain([f64::INFINITY]);
        let unloaded = compliance.scan(0.0, |sum, c| {
            *sum += c;
            Some(*sum)
        });
        let unloaded = unloaded.zip(behind).map(|(before, behind)| 1.0 / before + 1.0 / behind);
        let mut least = f64::INFINITY;
        for ((block, factor), unloaded) in self.blocks.iter().zip(&mut self.factors).zip(unloaded) {
            for i in 0..3 {
                let (pivot, scale) = (factor.pivots[i], block.diagonal[(i, i)].abs());
                least = least.min(pivot / unloaded.min(scale));
                let neutral = (NEUTRAL * floor.min(scale)).max(32.0 * f64::EPSILON * scale);
                if inertia.count(pivot, scale, neutral) == Sign::Neutral {
                    // A direction without stiffness and couple is kept unchanged, instead of changed by a quotient of
                    // two rounding errors.
                    factor.inverse[i] = 0.0;
                }
            }
        }
        Ok(least)
    }

    /// Solves for the frames' rotations in place.
    pub fn solve(&self, x: &mut [Vector3<f64>]) {
        let mut before = Vector3::zeros();
        for (x, factor) in x.iter_mut().zip(&self.factors) {
            let [a, b, c] = factor.lower;
            *x -= before;
            x.y -= a * x.x;
            x.z -= b * x.x + c * x.y;
            before = factor.next.tr_mul(x);
        }
        let mut after = Vector3::zeros();
        for (x, factor) in x.iter_mut().zip(&self.factors).rev() {
            let [a, b, c] = factor.lower;
            *x = x.component_mul(&factor.inverse) - factor.next * after;
            x.y -= c * x.z;
            x.x -= a * x.y + b * x.z;
            after = *x;
        }
    }
}

/// The sign of a pivot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    Negative,
    Neutral,
    Positive,
}

impl Inertia {
    /// Counts one pivot, given the diagonal entry that it came from and the size below which it is neutral.
    pub(super) fn count(&mut self, pivot: f64, scale: f64, neutral: f64) -> Sign {
        self.margin = self.margin.min(pivot / scale);
        if pivot.abs() <= neutral {
            self.neutral += 1;
            Sign::Neutral
        } else if pivot < 0.0 {
            self.negative += 1;
            Sign::Negative
        } else {
            self.positive += 1;
            Sign::Positive
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use nalgebra::{DMatrix, DVector};

    /// Numbers without a pattern between −1 and 1.
    fn number(k: usize) -> f64 {
        (k as f64 * 2.399_963).sin()
    }

    fn block(k: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| number(9 * k + 3 * i + j))
    }

    /// A tangent of five frames and the same matrix in full. Diagonal blocks are shifted by multiples of the identity.
    fn tangent(shifts: [f64; 5]) -> (Tangent, DMatrix<f64>) {
        let (mut tangent, mut full) = (Tangent::default(), DMatrix::zeros(15, 15));
        tangent.reset(5);
        for (b, shift) in shifts.into_iter().enumerate() {
            let diagonal = block(2 * b) + block(2 * b).transpose() + Matrix3::identity() * shift;
            tangent.add_diagonal(b, &diagonal);
            full.view_mut((3 * b, 3 * b), (3, 3)).copy_from(&diagonal);
            if b > 0 {
                let coupling = block(2 * b + 1);
                tangent.set_coupling(b, &coupling);
                full.view_mut((3 * b - 3, 3 * b), (3, 3)).copy_from(&coupling);
                full.view_mut((3 * b, 3 * b - 3), (3, 3)).copy_from(&coupling.transpose());
            }
        }
        (tangent, full)
    }

    #[test]
    fn solution_and_signs_of_pivots_are_those_of_the_full_matrix() {
        for shifts in [[8.0; 5], [8.0, -8.0, 8.0, 8.0, -8.0], [8.0, 2.0, -2.0, 2.0, 8.0]] {
            let (mut tangent, full) = tangent(shifts);
            let mut inertia = Inertia::default();
            let _ = tangent.factorise(&mut inertia, [1.0; 5].into_iter()).unwrap();
            let eigenvalues = full.clone().symmetric_eigenvalues();
            let negative = eigenvalues.iter().filter(|value| **value < 0.0).count();
            assert_eq!((inertia.negative, inertia.neutral, inertia.positive), (negative, 0, 15 - negative));
            let rhs: Vec<Vector3<f64>> = (0..5).map(|k| block(20 + k).column(0).into()).collect();
            let mut x = rhs.clone();
            tangent.solve(&mut x);
            let flat = |x: &[Vector3<f64>]| DVector::from_iterator(15, x.iter().flat_map(|x| x.iter().copied()));
            // Elimination multiplies the rounding of entries of the order of ten by the largest entry of L.
            assert_abs_diff_eq!((full * flat(&x) - flat(&rhs)).norm(), 0.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn direction_without_stiffness_is_neutral_and_keeps_its_rotation() {
        let (mut tangent, mut inertia) = (Tangent::default(), Inertia::default());
        tangent.reset(2);
        tangent.add_diagonal(0, &Matrix3::new(2.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0));
        tangent.add_diagonal(1, &Matrix3::identity());
        let _ = tangent.factorise(&mut inertia, [1.0; 2].into_iter()).unwrap();
        assert_eq!((inertia.negative, inertia.neutral, inertia.positive), (0, 1, 5));
        let mut x = [Vector3::new(1.0, 1.0, 1.0); 2];
        tangent.solve(&mut x);
        assert_eq!(x, [Vector3::new(0.5, 1.0, 0.0), Vector3::new(1.0, 1.0, 1.0)]);
    }

    #[test]
    fn matrix_that_is_not_finite_is_an_error() {
        let (mut tangent, _) = tangent([8.0, 8.0, f64::NAN, 8.0, 8.0]);
        assert!(tangent.factorise(&mut Inertia::default(), [1.0; 5].into_iter()).is_err());
    }
}
