//! Decompositions of dense matrices with a limited number of iterations.

use nalgebra::{DMatrix, Dyn, SVD, Schur};

/// Returns the largest number of iterations for a matrix with `n` rows or columns. An eigenvalue or
/// a singular value usually needs two or three; for some matrices the iteration does not converge.
pub(crate) fn most_iterations(n: usize) -> usize {
    100 * n + 100
}

/// Real Schur form of a square matrix. `None` for a matrix that is not finite, or whose Schur form
/// is not found.
pub(crate) fn real_schur(matrix: &DMatrix<f64>) -> Option<Schur<f64, Dyn>> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let most = most_iterations(matrix.nrows());
    // Subdiagonal entries do not always fall below rounding. A larger threshold is tried then, with
    // which the eigenvalues have two or four digits less.
    [1.0, 1e2, 1e4]
        .iter()
        .find_map(|x| Schur::try_new(matrix.clone(), x * f64::EPSILON, most))
}

/// Singular value decomposition with both factors. `None` for a matrix that is not finite, or whose
/// decomposition is not found.
pub(crate) fn singular_values(matrix: DMatrix<f64>) -> Option<SVD<f64, Dyn, Dyn>> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let most = most_iterations(matrix.nrows().max(matrix.ncols()));
    // The threshold is that of nalgebra without a limit of iterations.
    matrix.try_svd(true, true, 5.0 * f64::EPSILON, most)
}
