//! Leading eigenvalues of an operator that is only applied, with a bound on the modulus of all others.
//!
//! Arnoldi's method finds one vector for each eigenvalue and none for eigenvalues whose vectors are absent from its start. Vectors that
//! have converged are therefore deflated, and the method is repeated from another start on what is left, until the largest remaining
//! eigenvalue is smaller than those that were found. See Y. Saad, *Numerical Methods for Large Eigenvalue Problems*, 2nd ed. (2011), 6.2.3.

use nalgebra::{Complex, DMatrix, DVector};

use super::error::CycleError;
use crate::error::ParameterError;
use crate::numerics::krylov::{Krylov, Ritz, ritz_values};

/// Largest number of vectors in a subspace. A multiple of the number that leading eigenvalues of return maps require, a few tens.
const MOST: usize = 160;
/// Eigenvalues of smaller modulus are not resolved: rounding and the differences in the linearised map have this share of it after
/// deflation.
const SMALLEST: f64 = 1e-3;
/// Every eigenvalue of at least this modulus is found, however few are requested: the number outside the unit circle is then certain.
const LIMIT: f64 = 0.9;
/// Residual of a converged eigenvector of norm one, relative to the eigenvalue. The error of the eigenvalue is larger by the condition
/// of the eigenvector, which is some tens for return maps.
const CONVERGED: f64 = 1e-10;
/// The same, relative to the norm of the operator: rounding of its application.
const ROUNDING: f64 = 1e-14;
/// Relative residual at which the largest remaining eigenvalue bounds the modulus of all remaining ones.
const BOUND: f64 = 0.01;
/// Factor between that eigenvalue and the bound: within a cluster the largest one is approached from below.
const MARGIN: f64 = 1.1;
/// Norm of a vector that is rounding, relative to the norm before deflation.
const NEGLIGIBLE: f64 = 1e-7;
/// Smallest number of vectors of a bound: by then the largest eigenvalue dominates a start without a pattern.
const FEWEST: usize = 8;

/// The leading eigenvalues of an operator.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    /// Eigenvalues with the residuals |A v − μ v| of their vectors of norm one, largest modulus first. Both of a conjugate pair are
    /// listed.
    pub values: Vec<(Complex<f64>, f64)>,
    /// All other eigenvalues have at most this modulus.
    pub radius: f64,
}

/// What a Krylov subspace shows.
enum Found {
    /// These eigenvalues have converged.
    Values(Vec<Ritz>),
    /// All eigenvalues have at most this modulus.
    Bound(f64),
}

impl Spectrum {
    /// All eigenvalues outside [`LIMIT`], and at least `count` leading ones unless the others are below [`SMALLEST`], of an operator
    /// on vectors with `size` components.
    ///
    /// # Errors
    /// A number of eigenvalues that is not from 1 to 40, eigenvalues that do not converge with [`MOST`] vectors, an operator that is
    /// not finite.
    pub fn of(
        size: usize,
        count: usize,
        mut apply: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, CycleError>,
    ) -> Result<Self, CycleError> {
        check_count(count)?;
        let mut out = Self { values: Vec::new(), radius: 0.0 };
        let mut locked: Vec<DVector<f64>> = Vec::new();
        while locked.len() < size {
            let mut begin = apply(&without_pattern(size, locked.len()))?;
            let whole = begin.norm();
            deflate(&locked, &mut begin);
            if begin.norm() <= NEGLIGIBLE * whole {
                break;
            }
            out.values.sort_by(|a, b| b.0.norm().total_cmp(&a.0.norm()));
            // The bound on the others must be smaller than the last one of the leading eigenvalues.
            let below = out.values.get(count - 1).map_or(0.0, |(value, _)| value.norm().min(LIMIT));
            let missing = count.saturating_sub(out.values.len());
            let deflated = |x: &DVector<f64>| {
                let mut next = apply(x)?;
                deflate(&locked, &mut next);
                Ok::<_, CycleError>(next)
            };
            let mut found = Ok(None);
            let krylov = Krylov::of(&begin, MOST.min(size - locked.len()), ROUNDING, deflated, |hessenberg| {
                let vectors = hessenberg.ncols();
                if vectors < FEWEST || !vectors.is_multiple_of((vectors / 8).max(2)) {
                    return false;
                }
                found = decide(hessenberg, missing, below);
                !matches!(found, Ok(None))
            })?;
            if matches!(found, Ok(None)) {
                found = decide(&krylov.hessenberg, missing, below);
            }
            match found? {
                Some(Found::Bound(radius)) => {
                    out.radius = radius;
                    break;
                }
                Some(Found::Values(values)) => {
                    for one in values {
                        lock(&mut locked, &krylov, &one.weights);
                        out.values.push((one.value, one.residual));
                    }
                }
                None => {
                    let (found, vectors) = (out.values.len(), krylov.hessenberg.ncols());
                    return Err(CycleError::Incomplete { found, wanted: count, vectors });
                }
            }
        }
        out.values.sort_by(|a, b| b.0.norm().total_cmp(&a.0.norm()));
        out.values.retain(|(value, _)| value.norm() > out.radius);
        Ok(out)
    }
}

/// Refuses a number of eigenvalues that makes no sense.
pub(super) fn check_count(count: usize) -> Result<(), ParameterError> {
    ParameterError::unless((1..=MOST / 4).contains(&count), "number of eigenvalues", count as f64, "from 1 to 40")
}

/// The leading eigenvalues if as many as are missing have converged, a bound on all eigenvalues if it is smaller than `below`, or nothing
/// if more vectors are needed.
fn decide(hessenberg: &DMatrix<f64>, missing: usize, below: f64) -> Result<Option<Found>, CycleError> {
    let rounding = ROUNDING * hessenberg.norm();
    let converged =
        |one: &Ritz| one.residual <= (CONVERGED * one.value.norm()).max(rounding) && one.value.norm() > SMALLEST;
    let mut leading = ritz_values(hessenberg, converged)?;
    let bound = |one: &Ritz| MARGIN * (one.value.norm() + one.residual);
    if let Some(first) = leading.first() {
        if bound(first) < SMALLEST {
            return Ok(Some(Found::Bound(SMALLEST)));
        }
        if first.residual <= BOUND * first.value.norm() && bound(first) < below {
            return Ok(Some(Found::Bound(bound(first))));
        }
    }
    let last = leading.pop_if(|one| !converged(one));
    let ends = last.is_none_or(|one| bound(&one) < SMALLEST);
    let enough = leading.len() >= missing.max(1) || ends && !leading.is_empty();
    Ok(enough.then_some(Found::Values(leading)))
}

/// Adds the real and the imaginary part of an eigenvector to an orthonormal basis.
fn lock(locked: &mut Vec<DVector<f64>>, krylov: &Krylov, weights: &DVector<Complex<f64>>) {
    for part in [weights.map(|x| x.re), weights.map(|x| x.im)] {
        let mut vector = krylov.combine(&part);
        let whole = part.norm();
        deflate(locked, &mut vector);
        // The other vector of a conjugate pair, or the imaginary part of a real one, adds nothing.
        if vector.norm() > NEGLIGIBLE * whole.max(1.0) {
            locked.push(vector.normalize());
        }
    }
}

/// Removes the part of a vector that lies in the span of an orthonormal basis.
fn deflate(basis: &[DVector<f64>], vector: &mut DVector<f64>) {
    // Twice is enough for orthogonality to rounding.
    for _ in 0..2 {
        basis.iter().for_each(|known| vector.axpy(-known.dot(vector), known, 1.0));
    }
}

/// A vector with components between −1 and 1 that is not orthogonal to any eigenvector of a physical problem.
fn without_pattern(size: usize, number: usize) -> DVector<f64> {
    let number = number as f64;
    DVector::from_fn(size, |k, _| (2.399_963 * k as f64 + 0.7 * number + 1e-3 * (k as f64).powi(2)).sin())
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    fn diagonal(values: &[f64], count: usize) -> Result<Spectrum, CycleError> {
        let values = DVector::from_column_slice(values);
        Spectrum::of(values.len(), count, |x| Ok(values.component_mul(x)))
    }

    fn moduli(found: &Spectrum) -> DVector<f64> {
        DVector::from_iterator(found.values.len(), found.values.iter().map(|(value, _)| value.norm()))
    }

    /// A Krylov subspace contains one vector of each different eigenvalue.
    #[test]
    fn equal_eigenvalues_are_all_found() {
        let mut values = vec![2.0, 2.0, 2.0, 1.5, 1.5];
        values.extend((1..60).map(|k| 0.4 * 0.8_f64.powi(k)));
        let found = diagonal(&values, 4).unwrap();
        let expected = DVector::from_column_slice(&values[..5]);
        // A few roundings of vectors that converged to 1e-10; the operator is symmetric, and its eigenvalues err by the square.
        assert_abs_diff_eq!(moduli(&found).rows(0, 5).clone_owned(), expected, epsilon = 1e-12);
    }

    #[test]
    fn all_eigenvalues_outside_the_radius_are_in_the_list() {
        let values: Vec<f64> = (0..120).map(|k| 1.3 * 0.93_f64.powi(k)).collect();
        for count in [1, 3, 12, 30] {
            let found = diagonal(&values, count).unwrap();
            let listed = found.values.len();
            assert!(listed >= count && found.radius < 0.91, "{count}: {found:?}");
            assert_eq!(values.iter().filter(|value| **value > found.radius).count(), listed, "{count}");
        }
    }

    #[test]
    fn a_list_ends_where_eigenvalues_are_rounding() {
        let mut values = vec![0.7, 0.2];
        values.resize(50, 1e-5);
        let found = diagonal(&values, 6).unwrap();
        assert_abs_diff_eq!(moduli(&found), DVector::from_column_slice(&[0.7, 0.2]), epsilon = 1e-12);
        assert_eq!(found.radius, SMALLEST);
    }

    /// All eigenvalues of a cyclic shift have modulus one. With fewer vectors than its size none converges.
    #[test]
    fn eigenvalues_that_do_not_converge_are_an_error() {
        let size = 2 * MOST;
        let found = Spectrum::of(size, 1, |x| Ok(DVector::from_fn(size, |k, _| x[(k + 1) % size])));
        assert!(matches!(found, Err(CycleError::Incomplete { found: 0, wanted: 1, vectors: MOST })), "{found:?}");
    }

    #[test]
    fn an_operator_that_is_zero_has_no_eigenvalues_outside_its_radius() {
        let found = Spectrum::of(20, 3, |x| Ok(x * 0.0)).unwrap();
        assert!(found.values.is_empty() && found.radius <= SMALLEST, "{found:?}");
    }

    #[test]
    fn the_number_of_eigenvalues_is_checked() {
        assert!(check_count(1).is_ok() && check_count(MOST / 4).is_ok());
        assert!(check_count(0).is_err() && check_count(MOST / 4 + 1).is_err());
    }
}
