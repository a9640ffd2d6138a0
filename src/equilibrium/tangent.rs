//! The condensed tangent: a symmetric block tridiagonal matrix of 3 × 3 blocks, factorised by faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::simplicial::{
    SimplicialLdltRef, SymbolicSimplicialCholesky, factorize_simplicial_numeric_ldlt,
    factorize_simplicial_numeric_ldlt_scratch, factorize_simplicial_symbolic_cholesky,
    factorize_simplicial_symbolic_cholesky_scratch, prefactorize_symbolic_cholesky,
    prefactorize_symbolic_cholesky_scratch,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra::{Matrix3, Vector3};

use super::error::Outcome;
use super::{EquilibriumError, Inertia};
use crate::error::ParameterError;

/// Largest pivot, relative to the diagonal entry, whose direction is examined. In a shoot that is
/// longer than its critical length by 1e-7 of it, frames bend by 1e3 times the twist of the apex.
/// The rounding of the pivot is then 1e6 times [`STIFFNESS`], 7e-9.
const SUSPECT: f64 = 1e-6;
/// Rounding of a stiffness vᵀ K v relative to the sum of K_kk v_k². Six products with two
/// operations each contribute 6 ε, and the error of the equilibrium and of the entries of K
/// contributes too.
pub(super) const STIFFNESS: f64 = 32.0 * f64::EPSILON;
/// Smallest pivot, relative to the diagonal entry, with which the tangent of a held rod is
/// factorised: half of the digits remain. Smaller ones occur where the rod would be at its
/// stability limit without the holds.
const BOOSTED: f64 = 1e-6;
/// Number of steps of inverse iteration for a soft direction. If the stiffness of the others is a
/// hundred times as large, these steps reduce their part by 1e6.
const INVERSE_STEPS: usize = 3;
/// Smallest pivot beside a short element, relative to the diagonal entry. The pivot is a difference
/// of numbers of the size of that entry, so that its relative rounding is 2e-4 at most.
const ACCURATE: f64 = 1e-12;

/// The matrix, its factors L D Lᵀ and their workspace. Rows are in natural order: elimination from
/// base to apex has no fill-in.
///
/// The pattern is analysed for a capacity of blocks. Unused blocks are the identity, so that an
/// additional element does not require a new analysis.
#[derive(Default)]
pub(super) struct Tangent {
    /// Blocks on the diagonal, of which the upper triangle is read.
    diagonal: Vec<Matrix3<f64>>,
    /// Blocks that couple each frame (columns) to the one before it (rows); zero for the first
    /// frame.
    coupling: Vec<Matrix3<f64>>,
    blocks: usize,
    capacity: usize,
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
    /// The upper triangle of the matrix by columns.
    values: Vec<f64>,
    pub(super) factors: Vec<f64>,
    pub(super) symbolic: Option<SymbolicSimplicialCholesky<usize>>,
    stack: Option<MemBuffer>,
    pub(super) rhs: Vec<f64>,
    /// Columns of neutral directions, each with a positive pivot for steps along it: the size of
    /// its pivot, or the rounding of its stiffness if that is larger.
    pub(super) neutral: Vec<(usize, f64)>,
    /// The neutral directions along which the work of the unbalanced couples exceeds rounding.
    pub(super) unbalanced: Vec<(usize, f64)>,
}

impl std::fmt::Debug for Tangent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Tangent {{ blocks: {} of {} }}",
            self.blocks, self.capacity
        )
    }
}

impl Tangent {
    /// Makes room for `blocks` unknown frames and sets every entry to zero. Allocates only beyond
    /// the capacity.
    pub fn reset(&mut self, blocks: usize) -> Outcome {
        if blocks > self.capacity || 2 * blocks < self.capacity {
            // An eighth more than needed, so that a growing shoot allocates rarely.
            self.analyse(blocks + blocks / 8)?;
        }
        self.blocks = blocks;
        self.diagonal.clear();
        self.diagonal.resize(blocks, Matrix3::zeros());
        self.diagonal.resize(self.capacity, Matrix3::identity());
        self.coupling.clear();
        self.coupling.resize(self.capacity, Matrix3::zeros());
        Ok(())
    }

    fn analyse(&mut self, capacity: usize) -> Outcome {
        let n = 3 * capacity;
        self.capacity = capacity;
        self.col_ptr.clear();
        self.row_idx.clear();
        self.col_ptr.push(0);
        for block in 0..capacity {
            for b in 0..3 {
                let first = 3 * block.saturating_sub(1);
                self.row_idx.extend(first..=3 * block + b);
                self.col_ptr.push(self.row_idx.len());
            }
        }
        self.values = Vec::with_capacity(self.row_idx.len());
        self.rhs = vec![0.0; n];
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx);
        let (mut tree, mut counts) = (vec![0isize; n], vec![0usize; n]);
        let mut memory = MemBuffer::new(
            prefactorize_symbolic_cholesky_scratch::<usize>(n, self.row_idx.len())
                .or(factorize_simplicial_symbolic_cholesky_scratch::<usize>(n)),
        );
        let tree = prefactorize_symbolic_cholesky(
            &mut tree,
            &mut counts,
            pattern,
            MemStack::new(&mut memory),
        );
        let requirement = "small enough for the memory to factorise the tangent";
        let symbolic = factorize_simplicial_symbolic_cholesky(
            pattern,
            tree,
            &counts,
            MemStack::new(&mut memory),
        )
        .map_err(|_| ParameterError::refused("number of elements", capacity as f64, requirement))?;
        self.factors = vec![0.0; symbolic.len_val()];
        self.stack = Some(MemBuffer::new(factorize_simplicial_numeric_ldlt_scratch::<
            usize,
            f64,
        >(n)));
        self.symbolic = Some(symbolic);
        Ok(())
    }

    /// Adds to the diagonal block of an unknown frame.
    #[inline]
    pub fn add_diagonal(&mut self, block: usize, m: &Matrix3<f64>) {
        self.diagonal[block] += m;
    }

    /// Sets the block that couples frame `block` (columns) to the one before it (rows).
    pub fn set_coupling(&mut self, block: usize, m: &Matrix3<f64>) {
        self.coupling[block] = *m;
    }

    /// Computes the factors L D Lᵀ.
    fn factorise_values(&mut self) -> Outcome {
        self.values.clear();
        for (diagonal, coupling) in self.diagonal.iter().zip(&self.coupling) {
            // The coupling block has the columns a, b and c, and the diagonal block has d, e and f.
            let ([a, b, c], [d, e, f]) = (coupling.data.0, diagonal.data.0);
            if self.values.is_empty() {
                // No frame is before the first one.
                self.values.extend([d[0], e[0], e[1], f[0], f[1], f[2]]);
            } else {
                self.values
                    .extend([a[0], a[1], a[2], d[0], b[0], b[1], b[2], e[0], e[1]]);
                self.values.extend([c[0], c[1], c[2], f[0], f[1], f[2]]);
            }
        }
        // A pivot of exactly zero is replaced by a rounding of the matrix. A smaller one would make
        // later factors overflow.
        let replacement = (f64::EPSILON * self.floor()).max(f64::MIN_POSITIVE * 1e100);
        let n = 3 * self.capacity;
        let (Some(symbolic), Some(stack)) = (&self.symbolic, &mut self.stack) else {
            return Ok(());
        };
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx);
        let factorised = factorize_simplicial_numeric_ldlt(
            &mut self.factors,
            SparseColMatRef::new(pattern, &self.values),
            faer::linalg::cholesky::ldlt::factor::LdltRegularization {
                dynamic_regularization_signs: None,
                dynamic_regularization_delta: replacement,
                dynamic_regularization_epsilon: f64::MIN_POSITIVE,
            },
            symbolic,
            MemStack::new(stack),
        );
        factorised
            .map(|_| ())
            .map_err(|_| EquilibriumError::NotFinite { what: "tangent" })
    }

    /// The pivot of a column.
    #[inline]
    pub(super) fn pivot(&self, column: usize) -> f64 {
        self.symbolic.as_ref().map_or(f64::INFINITY, |symbolic| {
            self.factors[symbolic.col_ptr()[column]]
        })
    }

    /// Replaces the pivot of a column.
    pub(super) fn set_pivot(&mut self, column: usize, pivot: f64) {
        if let Some(symbolic) = &self.symbolic {
            self.factors[symbolic.col_ptr()[column]] = pivot;
        }
    }

    /// The size of the diagonal entry of a column.
    #[inline]
    pub(super) fn size(&self, column: usize) -> f64 {
        self.diagonal[column / 3][(column % 3, column % 3)].abs()
    }

    /// The smallest size of a block on the diagonal. Short elements have large diagonal entries,
    /// relative to which the stiffness of the rest of the rod may be tiny. It must not count as a
    /// small pivot.
    fn floor(&self) -> f64 {
        let largest = |block: usize| (0..3).map(|b| self.size(3 * block + b)).fold(0.0, f64::max);
        (0..self.blocks).map(largest).fold(f64::INFINITY, f64::min)
    }

    /// Confines the rotation of an unknown frame to the range of a projection. The removed
    /// directions get the identity, scaled as the rest of the block.
    pub fn project(&mut self, block: usize, projection: &Matrix3<f64>) {
        let mut diagonal = self.diagonal[block];
        diagonal.fill_lower_triangle_with_upper_triangle();
        let rest = (Matrix3::identity() - projection) * (diagonal.trace().abs() / 3.0);
        self.diagonal[block] = projection * diagonal * projection + rest;
        self.coupling[block] *= projection;
        if let Some(next) = self.coupling.get_mut(block + 1) {
            *next = projection * *next;
        }
    }

    /// Factorises a tangent that may be singular: a diagonal entry with a small pivot, or with the
    /// largest component of a direction whose stiffness is below `soft` (N m/rad), is increased, and
    /// appended with the increase to `boosts`. Adds the pivots to `inertia`.
    pub fn factorise_boosted(
        &mut self,
        inertia: &mut Inertia,
        boosts: &mut Vec<(usize, f64)>,
        soft: f64,
    ) -> Outcome {
        boosts.clear();
        let floor = self.floor();
        // A diagonal entry that vanishes by chance is no scale of its pivot.
        let scale = |size: f64| size.max(BOOSTED * floor);
        let least = |size: f64| (BOOSTED * floor.min(size)).max(ACCURATE * size);
        loop {
            self.factorise_values()?;
            let is_boosted = |column: usize| boosts.iter().any(|(own, _)| *own == column);
            let is_small = |column: &usize| {
                let pivot = self.pivot(*column).abs();
                !(pivot > least(scale(self.size(*column))))
            };
            let column = match (0..3 * self.blocks).find(is_small) {
                Some(column) if is_boosted(column) => {
                    return Err(EquilibriumError::NotFinite { what: "tangent" });
                }
                Some(column) => column,
                None => match self.softest(soft) {
                    Some(column) if !is_boosted(column) => column,
                    _ => break,
                },
            };
            let size = scale(self.size(column));
            let increase = size.min(floor).max(f64::MIN_POSITIVE.sqrt());
            self.diagonal[column / 3][(column % 3, column % 3)] += increase;
            boosts.push((column, increase));
        }
        for column in 0..3 * self.blocks {
            inertia.count(self.pivot(column), self.size(column), 0.0);
        }
        Ok(())
    }

    /// The column with the largest component of the softest direction, by inverse iteration, if its
    /// stiffness (N m/rad) is below a bound. Pivots do not show it: that of the last frame is large
    /// if the direction is small there.
    fn softest(&mut self, bound: f64) -> Option<usize> {
        if bound <= 0.0 {
            return None;
        }
        let start = |k: usize| Vector3::from_fn(|axis, _| (1.0 + (3 * k + axis) as f64).sin());
        let mut direction: Vec<Vector3<f64>> = (0..self.blocks).map(start).collect();
        let mut stiffness = f64::INFINITY;
        for _ in 0..INVERSE_STEPS {
            let last = direction.clone();
            self.solve(&mut direction);
            let product = |a: &[Vector3<f64>]| -> f64 {
                a.iter().zip(&direction).map(|(a, b)| a.dot(b)).sum()
            };
            let largest = direction.iter().map(Vector3::amax).fold(0.0, f64::max);
            stiffness = product(&last) / largest.powi(2);
            direction.iter_mut().for_each(|turn| *turn /= largest);
        }
        let size = |column: &usize| direction[column / 3][column % 3].abs();
        let columns = 0..3 * self.blocks;
        let largest = columns.max_by(|a, b| size(a).total_cmp(&size(b)));
        largest.filter(|_| stiffness.abs() < bound)
    }

    /// Factorises and adds the pivots to `inertia`. Their signs are those of the eigenvalues
    /// (Sylvester). Returns the smallest pivot relative to that of the same rod without load, given
    /// the elements' `compliance`, rad/(N m).
    pub fn factorise(
        &mut self,
        inertia: &mut Inertia,
        compliance: impl Iterator<Item = f64> + Clone,
    ) -> Outcome<f64> {
        self.factorise_values()?;
        self.neutral.clear();
        self.unbalanced.clear();
        // In a rod without load the part up to a frame and the element beyond it are springs in
        // parallel.
        let behind = compliance.clone().skip(1).chain([f64::INFINITY]);
        let unloaded = compliance.scan(0.0, |sum, c| {
            *sum += c;
            Some(*sum)
        });
        let unloaded = unloaded
            .zip(behind)
            .map(|(before, behind)| 1.0 / before + 1.0 / behind);
        let mut least = f64::INFINITY;
        for (column, unloaded) in (0..3 * self.blocks).zip(unloaded.flat_map(|pivot| [pivot; 3])) {
            let (pivot, scale) = (self.pivot(column), self.size(column));
            let terms = if pivot.abs() <= SUSPECT * scale {
                self.terms_of_pivot(column)
            } else {
                0.0
            };
            let neutral = inertia.count(pivot, scale, STIFFNESS * terms);
            least = least.min(if neutral {
                0.0
            } else {
                pivot / unloaded.min(scale)
            });
            if neutral {
                // An infinite pivot leaves the rotation in this direction unchanged, instead of a
                // quotient of two rounding errors.
                self.set_pivot(column, f64::INFINITY);
                self.neutral
                    .push((column, pivot.abs().max(f64::EPSILON * terms)));
            }
        }
        Ok(least)
    }

    /// Solves for the frames' rotations in place.
    pub fn solve(&mut self, x: &mut [Vector3<f64>]) {
        let n = 3 * self.capacity;
        self.rhs.fill(0.0);
        for (to, from) in self.rhs.chunks_exact_mut(3).zip(x.iter()) {
            to.copy_from_slice(from.as_slice());
        }
        if let (Some(symbolic), Some(stack)) = (&self.symbolic, &mut self.stack) {
            SimplicialLdltRef::new(symbolic, &self.factors).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
                Par::Seq,
                MemStack::new(stack),
            );
        }
        for (to, from) in x.iter_mut().zip(self.rhs.chunks_exact(3)) {
            to.copy_from_slice(from);
        }
    }
}

impl Inertia {
    /// Counts one pivot, given the diagonal entry that it came from and the size below which it is
    /// neutral. Returns whether it is neutral.
    pub(super) fn count(&mut self, pivot: f64, scale: f64, neutral: f64) -> bool {
        self.margin = self.margin.min(pivot / scale);
        let is_neutral = pivot.abs() <= neutral;
        let sign = match pivot {
            _ if is_neutral => &mut self.neutral,
            ..0.0 => &mut self.negative,
            _ => &mut self.positive,
        };
        *sign += 1;
        is_neutral
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

    /// A tangent of five frames and the same matrix in full. Diagonal blocks are shifted by
    /// multiples of the identity.
    fn tangent(shifts: [f64; 5]) -> (Tangent, DMatrix<f64>) {
        let (mut tangent, mut full) = (Tangent::default(), DMatrix::zeros(15, 15));
        tangent.reset(5).unwrap();
        for (b, shift) in shifts.into_iter().enumerate() {
            let diagonal = block(2 * b) + block(2 * b).transpose() + Matrix3::identity() * shift;
            tangent.add_diagonal(b, &diagonal);
            full.view_mut((3 * b, 3 * b), (3, 3)).copy_from(&diagonal);
            if b > 0 {
                let coupling = block(2 * b + 1);
                tangent.set_coupling(b, &coupling);
                full.view_mut((3 * b - 3, 3 * b), (3, 3))
                    .copy_from(&coupling);
                full.view_mut((3 * b, 3 * b - 3), (3, 3))
                    .copy_from(&coupling.transpose());
            }
        }
        (tangent, full)
    }

    #[test]
    fn sound_pivots_beside_a_stiff_spring_are_not_increased() {
        // A chain of springs of stiffness 1, clamped at its start, of which the second one is much
        // stiffer. Couples of one on the last block rotate it by the sum of the compliances.
        for stiffness in [1.0, 1e7, 1e10] {
            let springs = [1.0, stiffness, 1.0, 1.0];
            let (mut tangent, mut inertia, mut boosts) =
                (Tangent::default(), Inertia::default(), Vec::new());
            tangent.reset(springs.len()).unwrap();
            for (block, spring) in springs.into_iter().enumerate() {
                let matrix = Matrix3::from_diagonal_element(spring);
                tangent.add_diagonal(block, &matrix);
                if block > 0 {
                    tangent.add_diagonal(block - 1, &matrix);
                    tangent.set_coupling(block, &-matrix);
                }
            }
            tangent
                .factorise_boosted(&mut inertia, &mut boosts, 0.0)
                .unwrap();
            assert_eq!((boosts, inertia.positive), (Vec::new(), 12));
            let mut turns = [
                Vector3::zeros(),
                Vector3::zeros(),
                Vector3::zeros(),
                Vector3::repeat(1.0),
            ];
            tangent.solve(&mut turns);
            let expected = 3.0 + 1.0 / stiffness;
            // The pivot after the stiff spring has this rounding relative to the other springs.
            let rounding = 4.0 * f64::EPSILON * stiffness;
            turns[3].iter().for_each(|turn| {
                assert_abs_diff_eq!(*turn, expected, epsilon = rounding * expected)
            });
        }
    }

    #[test]
    fn soft_direction_that_is_small_in_the_last_block_is_found_although_its_pivots_are_large() {
        // v = (1, ε) about d1 has the stiffness λ (1 + ε²), and the last pivot is λ/ε².
        let (epsilon, lambda): (f64, f64) = (0.1, 1e-6);
        let boosted = |soft: f64| {
            let mut tangent = Tangent::default();
            let mut boosts = Vec::new();
            tangent.reset(2).unwrap();
            let diagonal = [epsilon * epsilon + lambda, 1.0 + lambda];
            for (block, entry) in diagonal.into_iter().enumerate() {
                tangent.add_diagonal(
                    block,
                    &Matrix3::from_diagonal(&Vector3::new(entry, 1.0, 1.0)),
                );
            }
            let coupling = Vector3::new(-epsilon, 0.0, 0.0);
            tangent.set_coupling(1, &Matrix3::from_diagonal(&coupling));
            tangent
                .factorise_boosted(&mut Inertia::default(), &mut boosts, soft)
                .unwrap();
            boosts
                .iter()
                .map(|(column, _)| *column)
                .collect::<Vec<usize>>()
        };
        let stiffness = lambda * (1.0 + epsilon * epsilon);
        assert!(boosted(0.9 * stiffness).is_empty());
        assert_eq!(boosted(1.1 * stiffness), [0]);
    }

    #[test]
    fn solution_and_signs_of_pivots_are_those_of_the_full_matrix() {
        for shifts in [
            [8.0; 5],
            [8.0, -8.0, 8.0, 8.0, -8.0],
            [8.0, 2.0, -2.0, 2.0, 8.0],
        ] {
            let (mut tangent, full) = tangent(shifts);
            let mut inertia = Inertia::default();
            let _ = tangent
                .factorise(&mut inertia, [1.0; 5].into_iter())
                .unwrap();
            let eigenvalues = full.clone().symmetric_eigenvalues();
            let negative = eigenvalues.iter().filter(|value| **value < 0.0).count();
            assert_eq!(
                (inertia.negative, inertia.neutral, inertia.positive),
                (negative, 0, 15 - negative)
            );
            let rhs: Vec<Vector3<f64>> = (0..5).map(|k| block(20 + k).column(0).into()).collect();
            let mut x = rhs.clone();
            tangent.solve(&mut x);
            let flat = |x: &[Vector3<f64>]| {
                DVector::from_iterator(15, x.iter().flat_map(|x| x.iter().copied()))
            };
            // Elimination multiplies the rounding of entries of the order of ten by the largest
            // entry of L.
            assert_abs_diff_eq!((full * flat(&x) - flat(&rhs)).norm(), 0.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn direction_without_stiffness_is_neutral_and_keeps_its_rotation() {
        let (mut tangent, mut inertia) = (Tangent::default(), Inertia::default());
        tangent.reset(2).unwrap();
        tangent.add_diagonal(
            0,
            &Matrix3::new(2.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0),
        );
        tangent.add_diagonal(1, &Matrix3::identity());
        let _ = tangent
            .factorise(&mut inertia, [1.0; 2].into_iter())
            .unwrap();
        assert_eq!(
            (inertia.negative, inertia.neutral, inertia.positive),
            (0, 1, 5)
        );
        let mut x = [Vector3::new(1.0, 1.0, 1.0); 2];
        tangent.solve(&mut x);
        assert_eq!(
            x,
            [Vector3::new(0.5, 1.0, 0.0), Vector3::new(1.0, 1.0, 1.0)]
        );
    }

    #[test]
    fn matrix_that_is_not_finite_is_an_error() {
        let (mut tangent, _) = tangent([8.0, 8.0, f64::NAN, 8.0, 8.0]);
        assert!(
            tangent
                .factorise(&mut Inertia::default(), [1.0; 5].into_iter())
                .is_err()
        );
    }
}
