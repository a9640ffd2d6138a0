//! The elimination of an element's interior unknowns from its symmetric system.

use nalgebra::{Matrix3, Vector3};

use super::Inertia;
use crate::reference_element::MAX_POINTS;

/// Largest interior pivot that is neutral, relative to the diagonal entry before elimination:
/// rounding of a few units of 1e-16 times the growth of the elimination.
const NEUTRAL: f64 = 1e-10;
/// Largest number of unknowns of an element: p rotation vectors and the rotation of the whole.
const MAX: usize = 3 * (MAX_POINTS + 1);

/// Number of columns that are processed together: the width of the vector registers, or twice that.
const LANES: usize = 4;

/// A row of the matrix, or a vector, by groups of columns.
pub(super) type Row = [[f64; LANES]; MAX.div_ceil(LANES)];

/// A symmetric matrix by its upper triangle, then the factors of its interior part.
///
/// Rows are processed in whole groups of columns, so some entries left of the diagonal are computed
/// as well.
#[derive(Debug, Clone, Default)]
pub(super) struct Elimination {
    /// After the elimination the interior rows hold D Lᵀ.
    pub rows: [Row; MAX],
    /// One over the interior pivots; zero for one that is zero.
    pub inverse: [f64; MAX],
}

/// Adds multiples of other rows to `row`, from the group of column `col` on.
#[inline]
fn add<const N: usize>(row: &mut Row, factors: [f64; N], others: [&Row; N], col: usize) {
    // The compiler unrolls and vectorises a loop with a constant number of iterations.
    match col / LANES {
        0 => add_groups::<0, N>(row, factors, others),
        1 => add_groups::<1, N>(row, factors, others),
        2 => add_groups::<2, N>(row, factors, others),
        _ => add_groups::<3, N>(row, factors, others),
    }
}

/// Adds multiples of other rows to `row`, from the group `FROM` on.
#[inline]
fn add_groups<const FROM: usize, const N: usize>(
    row: &mut Row,
    factors: [f64; N],
    others: [&Row; N],
) {
    for g in FROM..row.len() {
        let mut sum = row[g];
        for n in 0..N {
            for i in 0..LANES {
                sum[i] += factors[n] * others[n][g][i];
            }
        }
        row[g] = sum;
    }
}

impl Elimination {
    /// The 3 × 3 block with its corner at a place right of the diagonal.
    #[inline]
    pub fn block(&self, row: usize, col: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.rows[row + i].as_flattened()[col + j])
    }

    /// The 3 × 3 block with its corner at a place on the diagonal.
    #[inline]
    pub fn diagonal_block(&self, at: usize) -> Matrix3<f64> {
        let mut block = self.block(at, at);
        block.fill_lower_triangle_with_upper_triangle();
        block
    }

    /// Sets the whole matrix to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.rows.fill(Row::default());
    }

    /// Sets a 3 × 3 block with its corner at a place on or right of the diagonal.
    #[inline]
    pub fn set_block(&mut self, row: usize, col: usize, block: &Matrix3<f64>) {
        for i in 0..3 {
            let to = self.rows[row + i].as_flattened_mut();
            for j in 0..3 {
                to[col + j] = block[(i, j)];
            }
        }
    }

    /// Adds to a 3 × 3 block, as [`set_block`](Self::set_block).
    pub fn add_block(&mut self, row: usize, col: usize, block: &Matrix3<f64>) {
        self.set_block(row, col, &(self.block(row, col) + block));
    }

    /// Adds `shift` to the diagonal of the interior unknowns, which are the first, and eliminates
    /// them. Counts their pivots.
    pub fn eliminate<const P: usize>(&mut self, shift: f64, inertia: &mut Inertia) {
        let (m, n) = (3 * (P - 1), 3 * (P + 1));
        let mut diagonal = [0.0; MAX];
        for k in 0..m {
            let entry = &mut self.rows[k].as_flattened_mut()[k];
            *entry += shift;
            diagonal[k] = entry.abs();
        }
        // Three pivot rows are eliminated together, so that the rows below are read and written
        // once for all of them.
        for k in (0..m).step_by(3) {
            let (above, below) = self.rows.split_at_mut(k + 3);
            let block = &mut above[k..];
            let mut inverse = [0.0; 3];
            for b in 0..3 {
                let (pivots, rest) = block.split_at_mut(b + 1);
                let pivot_row = &pivots[b];
                let pivot = pivot_row.as_flattened()[k + b];
                inertia.count(pivot, diagonal[k + b], NEUTRAL * diagonal[k + b]);
                inverse[b] = if pivot == 0.0 { 0.0 } else { 1.0 / pivot };
                for (i, row) in rest.iter_mut().enumerate() {
                    let col = k + b + 1 + i;
                    add(
                        row,
                        [-pivot_row.as_flattened()[col] * inverse[b]],
                        [pivot_row],
                        col,
                    );
                }
            }
            let block: [&Row; 3] = [&block[0], &block[1], &block[2]];
            for (i, row) in below[..n - k - 3].iter_mut().enumerate() {
                let col = k + 3 + i;
                let factors = std::array::from_fn(|b| -block[b].as_flattened()[col] * inverse[b]);
                add(row, factors, block, col);
            }
            self.inverse[k..k + 3].copy_from_slice(&inverse);
        }
    }

    /// Applies the row operations of [`eliminate`](Self::eliminate) to a vector.
    pub fn reduce<const P: usize>(&self, vector: &mut Row) {
        for k in 0..3 * (P - 1) {
            let factor = -vector.as_flattened()[k] * self.inverse[k];
            // Entries up to the pivot do not change.
            for col in k + 1..3 * (P + 1) {
                vector.as_flattened_mut()[col] += factor * self.rows[k].as_flattened()[col];
            }
        }
    }

    /// Solves for the interior unknowns, given the reduced vector and the outer unknowns, which
    /// follow the interior ones in `x`.
    pub fn recover<const P: usize>(&self, vector: &Row, x: &mut Row) {
        for k in (0..3 * (P - 1)).rev() {
            let mut sums = [0.0; LANES];
            // Entries of `x` before `k` are still zero.
            for g in k / LANES..x.len() {
                for i in 0..LANES {
                    sums[i] += self.rows[k][g][i] * x[g][i];
                }
            }
            let sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
            x.as_flattened_mut()[k] = -(vector.as_flattened()[k] + sum) * self.inverse[k];
        }
    }
}

/// Three numbers of a row.
#[inline]
pub(super) fn vector_at(values: &Row, at: usize) -> Vector3<f64> {
    let values = values.as_flattened();
    Vector3::new(values[at], values[at + 1], values[at + 2])
}
