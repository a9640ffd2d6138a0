//! Analytic functions of λ: all that counting and root finding know of a linear problem.

use faer::linalg::solvers::Solve;
use faer::{MatMut, MatRef};
use nalgebra::{Complex, DMatrix};

/// An error that changes an analytic function by less than this share of itself does not change the number of its zeros.
/// Rouché's theorem asks for less than one; the error is an estimate, hence a quarter.
pub(super) const RESOLVED: f64 = 0.25;

/// An analytic function at one λ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub value: Complex<f64>,
    /// f'/f, s: about the inverse distance of the nearest zero.
    pub log_derivative: Complex<f64>,
    /// The inverse distance of a singularity that f'/f does not show from afar, s.
    pub nearness: f64,
}

/// Between which sizes of λ the zeros of functions are.
pub(super) trait Scales {
    /// A radius outside which there is no zero with Re λ ≥ `abscissa`, 1/s.
    fn bound(&self, abscissa: f64) -> f64;

    /// The slowest rate of the problem, 1/s: λ that are smaller by many digits are zero.
    fn slowest_rate(&self) -> f64;
}

/// A function that is real on the real axis, tends to one far right, and is analytic right of a line but for the zeros of
/// its [divisors](Self::divisors).
pub(super) trait Analytic {
    fn at(&self, z: Complex<f64>) -> Sample;

    /// The same, with the share of itself by which it may change because the mesh does not resolve it.
    fn with_unresolved_share(&self, z: Complex<f64>) -> (Sample, f64) {
        (self.at(z), 0.0)
    }

    /// Where its zeros are.
    fn scales(&self) -> &dyn Scales;

    /// The denominators of a quotient. A zero next to one of their zeros is none of the problem.
    fn divisors(&self) -> Vec<&dyn Analytic> {
        Vec::new()
    }
}

/// A matrix that depends on λ, and its derivative by λ.
#[derive(Debug, Clone)]
pub(crate) struct AnalyticMatrix {
    pub value: DMatrix<Complex<f64>>,
    pub derivative: DMatrix<Complex<f64>>,
}

impl AnalyticMatrix {
    /// λ times the identity.
    pub fn lambda(z: Complex<f64>, n: usize) -> Self {
        Self { value: DMatrix::from_diagonal_element(n, n, z), derivative: DMatrix::identity(n, n) }
    }

    /// det A and its logarithmic derivative, tr(A⁻¹ A').
    pub fn determinant(self) -> (Complex<f64>, Complex<f64>) {
        let (pivots, trace) = self.pivots();
        (pivots.iter().product(), trace)
    }

    /// Numbers whose product is det A, and tr(A⁻¹ A'). The determinants of large matrices over- or underflow.
    pub fn pivots(mut self) -> (Vec<Complex<f64>>, Complex<f64>) {
        let n = self.value.nrows();
        let lu = MatRef::from_column_major_slice(self.value.as_slice(), n, n).partial_piv_lu();
        lu.solve_in_place(MatMut::from_column_major_slice_mut(self.derivative.as_mut_slice(), n, n));
        let mut pivots: Vec<Complex<f64>> = (0..n).map(|i| lu.U()[(i, i)]).collect();
        let singular = pivots.contains(&Complex::ZERO);
        // Each cycle of even length is an odd permutation of the rows.
        let (rows, _) = lu.P().arrays();
        let mut seen = vec![false; n];
        for start in 0..n {
            let (mut row, mut length) = (start, 0);
            while !std::mem::replace(&mut seen[row], true) {
                row = rows[row];
                length += 1;
            }
            if length > 0 && length % 2 == 0 {
                pivots[start] = -pivots[start];
            }
        }
        (pivots, if singular { Complex::from(f64::INFINITY) } else { self.derivative.trace() })
    }
}
