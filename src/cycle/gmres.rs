//! Krylov's subspaces: linear systems and leading eigenvalues of an operator that is only applied.

use nalgebra::{Complex, DMatrix, DVector, Schur};

use crate::error::ParameterError;
use crate::stability::StabilityError;

/// An orthonormal basis of x, A x, A² x, …, and what A does to it.
pub(super) struct Krylov {
    pub basis: Vec<DVector<f64>>,
    /// A basis = basis H: one row more than columns.
    pub hessenberg: DMatrix<f64>,
}

/// Vectors at most: by then multipliers are rounding, and eigenvalues of so large a matrix take seconds.
const MOST: usize = 400;

impl Krylov {
    /// Refuses a number of vectors that makes no sense.
    pub fn check(most: usize) -> Result<(), ParameterError> {
        ParameterError::unless((1..=MOST).contains(&most), "number of vectors", most as f64, "from 1 to 400")
    }

    /// With at most `most` applications; fewer where the subspace is invariant to `rounding`, relative to what A made of the vector.
    pub fn of<E>(
        start: &DVector<f64>,
        most: usize,
        rounding: f64,
        mut apply: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
        mut enough: impl FnMut(&DMatrix<f64>) -> bool,
    ) -> Result<Self, E> {
        let mut basis = vec![start.normalize()];
        let mut hessenberg = DMatrix::zeros(1, 0);
        while hessenberg.ncols() < most {
            let k = hessenberg.ncols();
            let mut next = apply(&basis[k])?;
            let size = next.norm();
            hessenberg = hessenberg.resize(k + 2, k + 1, 0.0);
            // Twice is enough for orthogonality to rounding.
            for _ in 0..2 {
                for (i, vector) in basis.iter().enumerate() {
                    let part = vector.dot(&next);
                    next.axpy(-part, vector, 1.0);
                    hessenberg[(i, k)] += part;
                }
            }
            let left = next.norm();
            if !(left > rounding * size) {
                return Ok(Self { basis, hessenberg });
            }
            hessenberg[(k + 1, k)] = left;
            basis.push(next / left);
            if enough(&hessenberg) {
                break;
            }
        }
        Ok(Self { basis, hessenberg })
    }

    /// Σ weights · basis.
    pub fn combine(&self, weights: &DVector<f64>) -> DVector<f64> {
        let mut out = DVector::zeros(self.basis[0].len());
        self.basis.iter().zip(weights.iter()).for_each(|(vector, weight)| out.axpy(*weight, vector, 1.0));
        out
    }

    /// Eigenvalues of A, the largest first, each with the residual |A v − μ v| of its vector of norm one.
    ///
    /// # Errors
    /// A map that is not finite, or of which the iteration for the eigenvalues does not end.
    pub fn eigenvalues(&self) -> Result<Vec<(Complex<f64>, f64)>, StabilityError> {
        let k = self.hessenberg.ncols();
        let square = self.hessenberg.rows(0, k).clone_owned();
        let last = if self.hessenberg.nrows() > k { self.hessenberg[(k, k - 1)] } else { 0.0 };
        // It would go on for ever.
        if !square.iter().all(|x| x.is_finite()) {
            return Err(StabilityError::NotFinite { what: "linearised map" });
        }
        // Now and then what lies below rounding does not become small enough: then some digits fewer have to do.
        let schur =
            [1.0, 1e2, 1e4].iter().find_map(|x| Schur::try_new(square.clone(), x * f64::EPSILON, 100 * k + 100));
        let what = "the iteration for the multipliers";
        let schur = schur.ok_or(StabilityError::NoConvergence { what, residual: f64::INFINITY })?;
        let values = schur.complex_eigenvalues();
        let complex = square.map(Complex::from);
        let mut out: Vec<(Complex<f64>, f64)> = values
            .iter()
            .map(|value| {
                // Inverse iteration, a little off the eigenvalue.
                let shift = value + Complex::from(1e-12 * value.norm().max(1e-12));
                let lu = (&complex - DMatrix::from_diagonal_element(k, k, shift)).lu();
                let mut vector = DVector::from_fn(k, |i, _| Complex::new(1.0, 0.1 * (i as f64).sin()));
                for _ in 0..3 {
                    if let Some(next) = lu.solve(&vector).filter(|next| next.norm().is_normal()) {
                        vector = next.normalize();
                    }
                }
                let residual = (&complex * &vector - &vector * *value).norm() + last * vector[k - 1].norm();
                (*value, residual)
            })
            .collect();
        out.sort_by(|a, b| b.0.norm().total_cmp(&a.0.norm()));
        Ok(out)
    }
}

/// Solves A x = `right` to a relative residual; returns what was reached, too.
pub(super) fn gmres<E>(
    right: &DVector<f64>,
    tolerance: f64,
    most: usize,
    apply: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
) -> Result<(DVector<f64>, f64), E> {
    let size = right.norm();
    if !(size > 0.0) {
        return Ok((DVector::zeros(right.len()), 0.0));
    }
    let best = |hessenberg: &DMatrix<f64>| {
        // Singular values of it would be sought for ever.
        if !hessenberg.iter().all(|x| x.is_finite()) {
            return (DVector::zeros(hessenberg.ncols()), f64::NAN);
        }
        let mut target = DVector::zeros(hessenberg.nrows());
        target[0] = size;
        let weights = hessenberg.clone().svd(true, true).solve(&target, 1e-14).unwrap_or_else(|_| target.clone());
        let left = (hessenberg * &weights - target).norm() / size;
        (weights, left)
    };
    let krylov = Krylov::of(right, most, 1e-15, apply, |hessenberg| best(hessenberg).1 < tolerance)?;
    let (weights, left) = best(&krylov.hessenberg);
    Ok((krylov.combine(&weights), left))
}
