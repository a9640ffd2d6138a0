//! Krylov subspace methods for an operator of which only products with vectors are known: the
//! Arnoldi iteration, Ritz values, and GMRES (Saad and Schultz 1986, SIAM J. Sci. Stat. Comput. 7,
//! 856).

use nalgebra::{Complex, DMatrix, DVector};

use super::dense::{real_schur, singular_values};
use super::scalar::sort_by_value;

/// The Arnoldi relation A V = V H of a Krylov subspace span{x, A x, A² x, …}.
pub(crate) struct Krylov {
    /// Orthonormal basis V.
    pub basis: Vec<DVector<f64>>,
    /// Hessenberg matrix H. It has one row more than columns unless the subspace is invariant.
    pub hessenberg: DMatrix<f64>,
}

impl Krylov {
    /// Runs the Arnoldi iteration with at most `most` applications of A. It ends early when
    /// `decide` returns an answer for the Hessenberg matrix, or when the subspace is invariant: the
    /// new vector is smaller than `rounding` times A v. The second argument of `decide` is true at
    /// the end. Returns the subspace and the answer.
    pub fn of<T, E>(
        start: &DVector<f64>,
        most: usize,
        rounding: f64,
        mut apply: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
        mut decide: impl FnMut(&DMatrix<f64>, bool) -> Option<T>,
    ) -> Result<(Self, Option<T>), E> {
        let mut basis = vec![start.normalize()];
        let mut hessenberg = DMatrix::zeros(1, 0);
        loop {
            let k = hessenberg.ncols();
            let mut next = apply(&basis[k])?;
            let size = next.norm();
            hessenberg = hessenberg.resize(k + 2, k + 1, 0.0);
            orthogonalise(&basis, &mut next, |i, part| hessenberg[(i, k)] += part);
            let remainder = next.norm();
            let invariant = !(remainder > rounding * size);
            if !invariant {
                hessenberg[(k + 1, k)] = remainder;
                basis.push(next / remainder);
            }
            let last = invariant || k + 1 >= most;
            let answer = decide(&hessenberg, last);
            if last || answer.is_some() {
                return Ok((Self { basis, hessenberg }, answer));
            }
        }
    }

    /// The linear combination of the basis vectors with some weights.
    pub fn combine(&self, weights: &DVector<f64>) -> DVector<f64> {
        let mut out = DVector::zeros(self.basis[0].len());
        self.basis
            .iter()
            .zip(weights.iter())
            .for_each(|(vector, weight)| out.axpy(*weight, vector, 1.0));
        out
    }
}

/// Makes a vector orthogonal to an orthonormal basis up to rounding, by two passes of the
/// Gram–Schmidt process (Giraud et al. 2005). Calls `removed` with the index of each basis vector
/// and the component along it in each pass.
pub(crate) fn orthogonalise(
    basis: &[DVector<f64>],
    vector: &mut DVector<f64>,
    mut removed: impl FnMut(usize, f64),
) {
    for _ in 0..2 {
        for (i, known) in basis.iter().enumerate() {
            let part = known.dot(vector);
            vector.axpy(-part, known, 1.0);
            removed(i, part);
        }
    }
}

/// An approximate eigenvalue of A, with its vector v of norm one.
#[derive(Debug, Clone)]
pub(crate) struct Ritz {
    pub value: Complex<f64>,
    /// Residual |A v − μ v|.
    pub residual: f64,
    /// Coefficients of v in the basis.
    pub weights: DVector<Complex<f64>>,
}

/// The null vector of a nearly singular matrix, of norm one, by inverse iteration.
pub(crate) fn null_vector(matrix: DMatrix<Complex<f64>>) -> DVector<Complex<f64>> {
    // The entries have no pattern: null vectors in practice are not orthogonal to this vector.
    let start = |i: usize, _| Complex::new(1.0 + 0.1 * (i as f64).sin(), 0.3 * (i as f64).cos());
    let mut vector = DVector::from_fn(matrix.nrows(), start);
    let lu = matrix.lu();
    for _ in 0..3 {
        if let Some(next) = lu.solve(&vector).filter(|next| next.norm().is_normal()) {
            vector = next.normalize();
        }
    }
    vector
}

/// Ritz values of the Hessenberg matrix of a subspace in order of decreasing modulus, up to and
/// including the first one that `more` rejects. `None` for a matrix that is not finite, or whose
/// Schur form is not found.
pub(crate) fn ritz_values(
    hessenberg: &DMatrix<f64>,
    more: impl Fn(&Ritz) -> bool,
) -> Option<Vec<Ritz>> {
    let k = hessenberg.ncols();
    let square = hessenberg.rows(0, k).clone_owned();
    let last = if hessenberg.nrows() > k {
        hessenberg[(k, k - 1)]
    } else {
        0.0
    };
    let mut values: Vec<Complex<f64>> = real_schur(&square)?
        .complex_eigenvalues()
        .iter()
        .copied()
        .collect();
    sort_by_value(&mut values, |value| -value.norm());
    let complex = square.map(Complex::from);
    let mut out = Vec::new();
    for value in values {
        // The shift is close to the eigenvalue, so that the matrix is nonsingular.
        let shift = value + Complex::from(1e-12 * value.norm().max(1e-12));
        let weights = null_vector(&complex - DMatrix::from_diagonal_element(k, k, shift));
        let residual =
            (&complex * &weights - &weights * value).norm() + last * weights[k - 1].norm();
        let one = Ritz {
            value,
            residual,
            weights,
        };
        let ends = !more(&one);
        out.push(one);
        if ends {
            break;
        }
    }
    Some(out)
}

/// Solves A x = `right` by GMRES without restarts, with at most `most` applications of A. Returns x
/// and its relative residual.
pub(crate) fn gmres<E>(
    right: &DVector<f64>,
    tolerance: f64,
    most: usize,
    apply: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
) -> Result<(DVector<f64>, f64), E> {
    let size = right.norm();
    if size == 0.0 {
        return Ok((DVector::zeros(right.len()), 0.0));
    }
    let best = |hessenberg: &DMatrix<f64>| {
        let mut target = DVector::zeros(hessenberg.nrows());
        target[0] = size;
        let solved =
            singular_values(hessenberg.clone()).and_then(|svd| svd.solve(&target, 1e-14).ok());
        let Some(weights) = solved else {
            return (DVector::zeros(hessenberg.ncols()), f64::NAN);
        };
        let residual = (hessenberg * &weights - target).norm() / size;
        (weights, residual)
    };
    let (krylov, found) = Krylov::of(right, most, 1e-15, apply, |hessenberg, last| {
        Some(best(hessenberg)).filter(|(_, residual)| last || *residual < tolerance)
    })?;
    // The last call always returns an answer.
    let (weights, residual) = found.unwrap_or_else(|| best(&krylov.hessenberg));
    Ok((krylov.combine(&weights), residual))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::convert::Infallible;

    use approx::{assert_abs_diff_eq, assert_relative_eq};

    use super::*;

    /// A matrix and the number of its applications.
    struct Operator {
        matrix: DMatrix<f64>,
        applied: Cell<usize>,
    }

    impl Operator {
        fn new(n: usize, rows: &[f64]) -> Self {
            Self {
                matrix: DMatrix::from_row_slice(n, n, rows),
                applied: Cell::new(0),
            }
        }

        fn diagonal(values: &[f64]) -> Self {
            Self {
                matrix: DMatrix::from_diagonal(&vector(values)),
                applied: Cell::new(0),
            }
        }

        fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Infallible> {
            self.applied.set(self.applied.get() + 1);
            Ok(&self.matrix * x)
        }

        fn solve(&self, right: &[f64], most: usize) -> (DVector<f64>, f64) {
            self.applied.set(0);
            gmres(&vector(right), 1e-12, most, |x| self.apply(x)).unwrap()
        }

        fn krylov(&self, start: &[f64], most: usize) -> Krylov {
            self.applied.set(0);
            Krylov::of(
                &vector(start),
                most,
                1e-13,
                |x| self.apply(x),
                |_, _| None::<()>,
            )
            .unwrap()
            .0
        }
    }

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    /// All approximate eigenvalues with their residuals.
    fn eigenvalues(krylov: &Krylov) -> Option<Vec<(Complex<f64>, f64)>> {
        let all = ritz_values(&krylov.hessenberg, |_| true)?;
        Some(
            all.into_iter()
                .map(|one| (one.value, one.residual))
                .collect(),
        )
    }

    /// P diag(3, −2, R) P⁻¹ with R = (1, −2; 2, 1), whose eigenvalues are 1 ± 2i, and P of
    /// determinant one.
    fn dense() -> Operator {
        #[rustfmt::skip]
        let (diagonal, basis) = (
            DMatrix::from_row_slice(4, 4, &[
                3.0, 0.0, 0.0, 0.0,
                0.0, -2.0, 0.0, 0.0,
                0.0, 0.0, 1.0, -2.0,
                0.0, 0.0, 2.0, 1.0,
            ]),
            DMatrix::from_row_slice(4, 4, &[
                1.0, 0.0, 0.0, 0.0,
                2.0, 1.0, 0.0, 0.0,
                0.0, -1.0, 1.0, 0.0,
                1.0, 0.0, 3.0, 1.0,
            ]),
        );
        let inverse = basis.clone().try_inverse().unwrap();
        Operator {
            matrix: basis * diagonal * inverse,
            applied: Cell::new(0),
        }
    }

    #[test]
    fn the_basis_is_orthonormal_and_satisfies_the_relation_of_arnoldi() {
        let operator = dense();
        let krylov = operator.krylov(&[1.0, 1.0, -1.0, 0.5], 3);
        let basis = DMatrix::from_columns(&krylov.basis);
        assert_eq!(
            (
                operator.applied.get(),
                krylov.basis.len(),
                krylov.hessenberg.shape()
            ),
            (3, 4, (4, 3))
        );
        // Rounding of sums of four numbers of the size of ten.
        assert_abs_diff_eq!(
            basis.tr_mul(&basis),
            DMatrix::identity(4, 4),
            epsilon = 1e-14
        );
        assert_abs_diff_eq!(
            &operator.matrix * basis.columns(0, 3),
            &basis * &krylov.hessenberg,
            epsilon = 1e-13
        );
        assert_abs_diff_eq!(
            krylov.combine(&vector(&[1.0, 2.0, 0.0])),
            &basis * vector(&[1.0, 2.0, 0.0, 0.0]),
            epsilon = 1e-14
        );
    }

    #[test]
    fn a_basis_of_the_whole_space_gives_all_eigenvalues() {
        let found = eigenvalues(&dense().krylov(&[1.0, 1.0, -1.0, 0.5], 4)).unwrap();
        let exact = [
            Complex::new(3.0, 0.0),
            Complex::new(1.0, 2.0),
            Complex::new(1.0, -2.0),
            Complex::new(-2.0, 0.0),
        ];
        assert_eq!(found.len(), 4);
        for exact in exact {
            let nearest = found
                .iter()
                .min_by(|a, b| (a.0 - exact).norm().total_cmp(&(b.0 - exact).norm()))
                .unwrap();
            // Rounding times the condition of the eigenvectors, some tens.
            assert_abs_diff_eq!((nearest.0 - exact).norm(), 0.0, epsilon = 1e-13);
            assert!(nearest.1 < 1e-12, "its residual is rounding: {nearest:?}");
        }
        assert!(
            found
                .windows(2)
                .all(|pair| pair[0].0.norm() >= pair[1].0.norm()),
            "the largest comes first"
        );
    }

    #[test]
    fn eigenvalues_of_a_small_basis_lie_within_their_residuals_of_exact_ones() {
        // The bound of Bauer and Fike for symmetric matrices, whose eigenvalues are 10, 5, 1, 0.5,
        // 0.1, 0.05 and 0.01.
        let exact = [10.0, 5.0, 1.0, 0.5, 0.1, 0.05, 0.01];
        let found = eigenvalues(&Operator::diagonal(&exact).krylov(&[1.0; 7], 4)).unwrap();
        assert_eq!(found.len(), 4);
        for (value, residual) in &found {
            let distance = exact
                .iter()
                .map(|x| (value - x).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                distance <= residual + 1e-13,
                "{value} {residual}: {distance}"
            );
        }
        // The largest has converged further than the others, whose residuals are larger than
        // rounding.
        assert!(found[0].1 < 0.05 && found[3].1 > 1e-6, "{found:?}");
    }

    #[test]
    fn the_basis_ends_where_the_subspace_is_invariant() {
        // The start lies in the plane of the first and the third axis.
        let operator = Operator::diagonal(&[4.0, 3.0, 2.0, 1.0]);
        let krylov = operator.krylov(&[1.0, 0.0, 1.0, 0.0], 4);
        assert_eq!(
            (
                operator.applied.get(),
                krylov.basis.len(),
                krylov.hessenberg.ncols()
            ),
            (2, 2, 2)
        );
        let found = eigenvalues(&krylov).unwrap();
        for ((value, residual), exact) in found.iter().zip([4.0, 2.0]) {
            assert_abs_diff_eq!((value - exact).norm(), 0.0, epsilon = 1e-14);
            assert!(*residual < 1e-11);
        }
    }

    #[test]
    fn gmres_finds_the_known_solution() {
        let operator = dense();
        let exact = vector(&[1.0, -2.0, 3.0, 0.5]);
        let (found, residual) = operator.solve((&operator.matrix * &exact).as_slice(), 4);
        // The tolerance of the residual, times the condition of the matrix of about a hundred.
        assert_relative_eq!(found, exact, epsilon = 0.0, max_relative = 1e-10);
        assert!(
            residual < 1e-12 && operator.applied.get() == 4,
            "{residual}"
        );
    }

    #[test]
    fn gmres_returns_a_nan_residual_for_a_right_side_that_is_not_finite() {
        for value in [f64::NAN, f64::INFINITY] {
            let (_, residual) = dense().solve(&[1.0, value, 0.0, 0.0], 4);
            assert!(residual.is_nan(), "{value}: {residual}");
        }
    }

    #[test]
    fn gmres_needs_one_application_for_each_distinct_eigenvalue() {
        let operator = Operator::diagonal(&[1.0, 1.0, 2.0, 2.0, 5.0, 5.0]);
        let (found, residual) = operator.solve(&[1.0; 6], 6);
        assert_eq!(operator.applied.get(), 3);
        // Rounding of a system of three unknowns.
        assert_abs_diff_eq!(
            found,
            vector(&[1.0, 1.0, 0.5, 0.5, 0.2, 0.2]),
            epsilon = 1e-14
        );
        assert!(residual < 1e-14);
        assert!(
            operator.solve(&[1.0; 6], 2).1 > 0.01,
            "two applications are not enough"
        );
    }

    #[test]
    fn gmres_makes_no_progress_on_a_cyclic_shift_before_the_last_application() {
        // A x = e1 with A e1 = e2, …, A e5 = e1: all residuals but the last are those of x = 0.
        let mut operator = Operator::new(5, &[0.0; 25]);
        (0..5).for_each(|k| operator.matrix[((k + 1) % 5, k)] = 1.0);
        let right = [1.0, 0.0, 0.0, 0.0, 0.0];
        for most in 1..5 {
            let (found, residual) = operator.solve(&right, most);
            assert_abs_diff_eq!(residual, 1.0, epsilon = 1e-15);
            assert_abs_diff_eq!(found.norm(), 0.0, epsilon = 1e-15);
        }
        let (found, residual) = operator.solve(&right, 5);
        assert_abs_diff_eq!(found, vector(&[0.0, 0.0, 0.0, 0.0, 1.0]), epsilon = 1e-15);
        assert_abs_diff_eq!(residual, 0.0, epsilon = 1e-15);
        assert_eq!(operator.applied.get(), 5);
    }

    #[test]
    fn an_eigenvector_on_the_right_side_takes_one_application() {
        let operator = Operator::new(2, &[2.0, 1.0, 1.0, 2.0]);
        let (found, residual) = operator.solve(&[3.0, 3.0], 2);
        assert_eq!(operator.applied.get(), 1);
        assert_abs_diff_eq!(found, vector(&[1.0, 1.0]), epsilon = 1e-15);
        assert!(residual < 1e-15);
    }

    #[test]
    fn a_singular_consistent_system_is_solved_in_the_range() {
        // The null vector is (1, −1, 0), and the right side is orthogonal to it.
        let operator = Operator::new(3, &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 3.0]);
        let (found, residual) = operator.solve(&[2.0, 2.0, 6.0], 3);
        assert_abs_diff_eq!(found, vector(&[1.0, 1.0, 2.0]), epsilon = 1e-14);
        assert!(residual < 1e-14);
    }

    #[test]
    fn an_inconsistent_system_reports_the_residual_that_remains() {
        // The part of (1, 1, 1) outside of the range is 1/√3 of its norm.
        let (found, residual) = Operator::diagonal(&[1.0, 2.0, 0.0]).solve(&[1.0; 3], 3);
        assert_abs_diff_eq!(residual, 3f64.sqrt().recip(), epsilon = 1e-14);
        assert_abs_diff_eq!(
            found.rows(0, 2).clone_owned(),
            vector(&[1.0, 0.5]),
            epsilon = 1e-13
        );
    }

    #[test]
    fn a_right_side_of_zero_needs_no_application() {
        let operator = dense();
        assert_eq!(operator.solve(&[0.0; 4], 4), (DVector::zeros(4), 0.0));
        assert_eq!(operator.applied.get(), 0);
    }

    #[test]
    fn an_operator_that_is_not_finite_gives_no_small_residual_and_no_eigenvalues() {
        for bad in [f64::NAN, f64::INFINITY] {
            let operator = Operator::diagonal(&[1.0, bad, 3.0]);
            let residual = operator.solve(&[1.0; 3], 3).1;
            assert!(
                !(residual < 0.5),
                "callers reject what is not below a bound: {residual}"
            );
            let found = eigenvalues(&operator.krylov(&[1.0; 3], 3));
            assert!(found.is_none(), "{found:?}");
        }
    }

    #[test]
    fn an_error_of_the_operator_is_passed_on() {
        let solved = gmres(&vector(&[1.0, 2.0]), 1e-12, 2, |_| {
            Err("error of the operator")
        });
        assert_eq!(solved, Err("error of the operator"));
    }
}
