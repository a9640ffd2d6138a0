//! Matrices that are analytic functions of λ, and Newton's method for zeros of analytic functions.

use faer::linalg::solvers::Solve;
use faer::{MatMut, MatRef};
use nalgebra::{Complex, DMatrix};

use super::error::StabilityError;

/// A matrix that depends on λ, and its derivative with respect to λ.
#[derive(Debug, Clone)]
pub(crate) struct AnalyticMatrix {
    pub value: DMatrix<Complex<f64>>,
    pub derivative: DMatrix<Complex<f64>>,
}

impl AnalyticMatrix {
    /// λ times the identity.
    pub fn lambda(z: Complex<f64>, n: usize) -> Self {
        Self {
            value: DMatrix::from_diagonal_element(n, n, z),
            derivative: DMatrix::identity(n, n),
        }
    }

    /// det A and its logarithmic derivative, tr(A⁻¹ A').
    pub fn determinant(self) -> (Complex<f64>, Complex<f64>) {
        let (pivots, trace) = self.pivots();
        (pivots.iter().product(), trace)
    }

    /// Numbers whose product is det A, and tr(A⁻¹ A'), which is infinite if A is singular. The
    /// determinant itself of a large matrix overflows or underflows.
    pub fn pivots(mut self) -> (Vec<Complex<f64>>, Complex<f64>) {
        let n = self.value.nrows();
        let lu = MatRef::from_column_major_slice(self.value.as_slice(), n, n).partial_piv_lu();
        lu.solve_in_place(MatMut::from_column_major_slice_mut(
            self.derivative.as_mut_slice(),
            n,
            n,
        ));
        let mut pivots: Vec<Complex<f64>> = (0..n).map(|i| lu.U()[(i, i)]).collect();
        let singular = pivots.contains(&Complex::ZERO);
        // An odd permutation of the rows has an odd number of pairs in the wrong order.
        let (rows, _) = lu.P().arrays();
        let inversions = (0..n).map(|i| rows[..i].iter().filter(|row| **row > rows[i]).count());
        if inversions.sum::<usize>() % 2 == 1 {
            pivots[0] = -pivots[0];
        }
        (
            pivots,
            if singular {
                Complex::from(f64::INFINITY)
            } else {
                self.derivative.trace()
            },
        )
    }
}

/// The eigenvalues of a square matrix. `what` names the search.
///
/// # Errors
/// An iteration that does not converge.
pub(crate) fn eigenvalues(
    matrix: &DMatrix<f64>,
    what: &'static str,
) -> Result<Vec<Complex<f64>>, StabilityError> {
    let view = MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols());
    view.eigenvalues()
        .map_err(|_| StabilityError::NoConvergence {
            what,
            residual: matrix.amax(),
        })
}

/// The step −f/f' of Newton's method, from f'/f. It is zero where f'/f is infinite, because f is
/// zero there.
pub(crate) fn newton_step(log_derivative: Complex<f64>) -> Complex<f64> {
    if log_derivative.re.is_infinite() {
        Complex::ZERO
    } else {
        -log_derivative.inv()
    }
}

/// Finds a zero of an analytic function near `start` by Newton's method. `step` returns −f/f' at λ,
/// and `scale` the size of λ to which `accuracy` is relative. The iteration also ends when a step
/// below 10⁴ times the accuracy does not decrease, because it then consists of rounding.
///
/// # Errors
/// The size of the last step, if the iteration does not converge.
pub(crate) fn newton(
    start: Complex<f64>,
    accuracy: f64,
    scale: impl Fn(Complex<f64>) -> f64,
    step: impl Fn(Complex<f64>) -> Complex<f64>,
) -> Result<Complex<f64>, f64> {
    let (mut z, mut last) = (start, f64::INFINITY);
    for _ in 0..60 {
        let change = step(z);
        z += change;
        let size = change.norm();
        if !size.is_finite() {
            break;
        }
        let converged = accuracy * scale(z);
        if size <= converged || (size < 1e4 * converged && size >= last) {
            return Ok(z);
        }
        last = size;
    }
    Err(last)
}
