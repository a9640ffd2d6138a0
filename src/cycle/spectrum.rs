//! Leading eigenvalues of a linear operator that is only applied to vectors, with a bound on the
//! modulus of all others.
//!
//! Arnoldi's method finds one vector of each eigenvalue, and none that is absent from its first
//! vector. Converged vectors are therefore deflated: their components are removed from all further
//! vectors. The method is then repeated with another first vector until the largest remaining
//! eigenvalue is smaller than those that were found. See Y. Saad, *Numerical methods for large
//! eigenvalue problems*, 2nd ed. (2011), section 6.2.3.

use nalgebra::{Complex, DMatrix, DVector};

use super::error::{CycleError, Outcome};
use super::map::CONVERGED;
use crate::error::ensure;
use crate::numerics::krylov::{Krylov, Ritz, orthogonalise, ritz_values};
use crate::numerics::scalar::sort_by_value;
use crate::stability::StabilityError;

/// Largest dimension of a Krylov subspace, several times that needed for the leading eigenvalues of
/// return maps.
const MOST: usize = 160;
/// Largest number of eigenvalues that can be requested: each needs about four vectors.
pub(super) const MOST_VALUES: usize = MOST / 4;
/// Smallest modulus of an eigenvalue that is resolved. After deflation, rounding and differences
/// have this size.
const SMALLEST: f64 = 1e-3;
/// Every eigenvalue of at least this modulus is found, however few are requested, so that the
/// number outside the unit circle is certain.
const LIMIT: f64 = 0.9;
/// Residual of a converged eigenvector of norm one, relative to the eigenvalue. The error of the
/// eigenvalue is larger by its condition number, which is about 30 for return maps.
const TOLERANCE: f64 = 1e-10;
/// Norm of a vector after deflation that is rounding, relative to the norm before: the root of the
/// machine precision, and a factor of ten.
const NEGLIGIBLE: f64 = 1e-7;
/// Relative residual of the largest remaining eigenvalue at which it bounds the modulus of all
/// remaining ones.
const BOUND: f64 = 0.01;
/// Factor between that eigenvalue and the bound. Within a cluster the largest one is approximated
/// from below.
const MARGIN: f64 = 1.1;

/// A Floquet multiplier of a periodic orbit, or a characteristic root of a rotating wave.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Eigenvalue {
    /// Multiplier μ: over a period, the disturbance that is its eigenvector is multiplied by μ. For
    /// a rotating wave, root λ with Im λ ≥ 0 in the corotating frame, 1/s: disturbances are
    /// proportional to exp(λt), and the conjugate of λ is a root, too.
    pub value: Complex<f64>,
    /// Norm |A v − μ v| for the eigenvector v of norm one, where A is the monodromy operator after
    /// deflation of larger multipliers. For a root, its distance from the root that corresponds to
    /// a multiplier of the return map, 1/s.
    pub residual: f64,
}

/// The leading eigenvalues of an operator.
#[derive(Debug, Clone)]
pub(super) struct LeadingSpectrum {
    /// Eigenvalues, largest modulus first. Both of a conjugate pair are listed.
    pub values: Vec<Eigenvalue>,
    /// Bound on the modulus of all other eigenvalues.
    pub radius: f64,
}

/// Result of Arnoldi's method.
enum Leading {
    /// Eigenvalues that have converged.
    Values(Vec<Ritz>),
    /// Bound on the modulus of all eigenvalues.
    Bound(f64),
}

impl LeadingSpectrum {
    /// Computes all eigenvalues outside [`LIMIT`], and at least `count` leading ones unless the
    /// others are below [`SMALLEST`], of an operator on vectors with `size` components. `count` is
    /// from 1 to [`MOST_VALUES`].
    ///
    /// # Errors
    /// Eigenvalues that do not converge with [`MOST`] vectors, or an operator that is not finite.
    pub fn of(
        size: usize,
        count: usize,
        apply: &mut dyn FnMut(&DVector<f64>) -> Outcome<DVector<f64>>,
    ) -> Outcome<Self> {
        let mut out = Self {
            values: Vec::new(),
            radius: 0.0,
        };
        let mut locked: Vec<DVector<f64>> = Vec::new();
        while locked.len() < size {
            let mut begin = apply(&without_pattern(size, locked.len()))?;
            let whole = begin.norm();
            orthogonalise(&locked, &mut begin, |_, _| ());
            if begin.norm() <= NEGLIGIBLE * whole {
                break;
            }
            // The bound on the others must be smaller than the last one of the leading eigenvalues.
            let below = out
                .values
                .get(count - 1)
                .map_or(0.0, |last| last.value.norm().min(LIMIT));
            let missing = count.saturating_sub(out.values.len());
            let deflated = |x: &DVector<f64>| {
                let mut next = apply(x)?;
                let finite = next.iter().all(|x| x.is_finite());
                ensure(
                    finite,
                    StabilityError::NotFinite {
                        what: "linearised map",
                    },
                )?;
                orthogonalise(&locked, &mut next, |_, _| ());
                Ok::<_, CycleError>(next)
            };
            let most = MOST.min(size - locked.len());
            let (krylov, found) =
                Krylov::of(&begin, most, CONVERGED, deflated, |hessenberg, last| {
                    let vectors = hessenberg.ncols();
                    // From eight vectors on, the largest eigenvalue dominates a first vector
                    // without symmetry.
                    let due = last || vectors >= 8 && vectors.is_multiple_of((vectors / 8).max(2));
                    if due {
                        decide(hessenberg, missing, below).transpose()
                    } else {
                        None
                    }
                })?;
            match found.transpose()? {
                Some(Leading::Bound(radius)) => {
                    out.radius = radius;
                    break;
                }
                Some(Leading::Values(values)) => {
                    for one in values {
                        lock(&mut locked, &krylov, &one.weights);
                        out.values.push(Eigenvalue {
                            value: one.value,
                            residual: one.residual,
                        });
                    }
                    sort_by_value(&mut out.values, |one| -one.value.norm());
                }
                None => {
                    return Err(CycleError::Incomplete {
                        found: out.values.len(),
                        wanted: count,
                    });
                }
            }
        }
        out.values.retain(|one| one.value.norm() > out.radius);
        Ok(out)
    }
}

/// Removes the eigenvalue nearest to a number from a list, if their distance is below a limit.
/// Returns the distance.
pub(super) fn remove_nearest(
    list: &mut Vec<Eigenvalue>,
    to: Complex<f64>,
    within: f64,
) -> Option<f64> {
    let distances = list.iter().map(|one| (one.value - to).norm()).enumerate();
    let (nearest, distance) = distances
        .filter(|(_, d)| *d < within)
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    list.remove(nearest);
    Some(distance)
}

/// Returns the leading eigenvalues if `missing` of them have converged, a bound on all eigenvalues
/// if it is smaller than `below`, or none if more vectors are needed.
fn decide(hessenberg: &DMatrix<f64>, missing: usize, below: f64) -> Outcome<Option<Leading>> {
    let rounding = CONVERGED * hessenberg.norm();
    let converged = |one: &Ritz| {
        one.residual <= (TOLERANCE * one.value.norm()).max(rounding) && one.value.norm() > SMALLEST
    };
    let failed = StabilityError::NoConvergence {
        what: "the iteration for the multipliers",
        residual: f64::INFINITY,
    };
    let mut leading = ritz_values(hessenberg, converged).ok_or(failed)?;
    let bound = |one: &Ritz| MARGIN * (one.value.norm() + one.residual);
    if let Some(first) = leading.first() {
        if bound(first) < SMALLEST {
            return Ok(Some(Leading::Bound(SMALLEST)));
        }
        if first.residual <= BOUND * first.value.norm() && bound(first) < below {
            return Ok(Some(Leading::Bound(bound(first))));
        }
    }
    let last = leading.pop_if(|one| !converged(one));
    let ends = last.is_none_or(|one| bound(&one) < SMALLEST);
    let enough = leading.len() >= missing.max(1) || ends && !leading.is_empty();
    Ok(enough.then_some(Leading::Values(leading)))
}

/// Adds the real and the imaginary part of an eigenvector to an orthonormal basis.
fn lock(locked: &mut Vec<DVector<f64>>, krylov: &Krylov, weights: &DVector<Complex<f64>>) {
    for part in [weights.map(|x| x.re), weights.map(|x| x.im)] {
        let mut vector = krylov.combine(&part);
        let whole = part.norm();
        orthogonalise(locked, &mut vector, |_, _| ());
        // Conjugate pairs have one subspace, and the imaginary part of a real eigenvector is zero.
        if vector.norm() > NEGLIGIBLE * whole.max(1.0) {
            locked.push(vector.normalize());
        }
    }
}

/// A vector without symmetry, with components between −1 and 1. It is not orthogonal to
/// eigenvectors of physical problems.
fn without_pattern(size: usize, number: usize) -> DVector<f64> {
    let number = number as f64;
    DVector::from_fn(size, |k, _| {
        (2.399_963 * k as f64 + 0.7 * number + 1e-3 * (k as f64).powi(2)).sin()
    })
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    fn diagonal(values: &[f64], count: usize) -> Result<LeadingSpectrum, CycleError> {
        let values = DVector::from_column_slice(values);
        LeadingSpectrum::of(values.len(), count, &mut |x| Ok(values.component_mul(x)))
    }

    fn moduli(found: &LeadingSpectrum) -> DVector<f64> {
        DVector::from_iterator(
            found.values.len(),
            found.values.iter().map(|one| one.value.norm()),
        )
    }

    /// A Krylov subspace contains one vector of each different eigenvalue.
    #[test]
    fn equal_eigenvalues_are_all_found() {
        let mut values = vec![2.0, 2.0, 2.0, 1.5, 1.5];
        values.extend((1..60).map(|k| 0.4 * 0.8_f64.powi(k)));
        let found = diagonal(&values, 4).unwrap();
        let expected = DVector::from_column_slice(&values[..5]);
        // The operator is symmetric: eigenvalues have the square of the error 1e-10 of their
        // vectors, and rounding.
        assert_abs_diff_eq!(
            moduli(&found).rows(0, 5).clone_owned(),
            expected,
            epsilon = 1e-12
        );
    }

    #[test]
    fn all_eigenvalues_outside_the_radius_are_in_the_list() {
        let values: Vec<f64> = (0..120).map(|k| 1.3 * 0.93_f64.powi(k)).collect();
        for count in [1, 3, 12, 30] {
            let found = diagonal(&values, count).unwrap();
            let listed = found.values.len();
            assert!(listed >= count && found.radius < 0.91, "{count}: {found:?}");
            assert_eq!(
                values.iter().filter(|value| **value > found.radius).count(),
                listed,
                "{count}"
            );
        }
    }

    #[test]
    fn eigenvalues_below_the_smallest_modulus_are_not_listed() {
        let mut values = vec![0.7, 0.2];
        values.resize(50, 1e-5);
        let found = diagonal(&values, 6).unwrap();
        assert_abs_diff_eq!(
            moduli(&found),
            DVector::from_column_slice(&[0.7, 0.2]),
            epsilon = 1e-12
        );
        assert_eq!(found.radius, SMALLEST);
    }

    /// All eigenvalues of a cyclic shift have modulus one. None converges with fewer vectors than
    /// its size.
    #[test]
    fn eigenvalues_that_do_not_converge_are_an_error() {
        let size = 2 * MOST;
        let found = LeadingSpectrum::of(size, 1, &mut |x| {
            Ok(DVector::from_fn(size, |k, _| x[(k + 1) % size]))
        });
        assert!(
            matches!(
                found,
                Err(CycleError::Incomplete {
                    found: 0,
                    wanted: 1
                })
            ),
            "{found:?}"
        );
    }

    #[test]
    fn an_operator_that_is_zero_has_no_eigenvalues_outside_its_radius() {
        let found = LeadingSpectrum::of(20, 3, &mut |x| Ok(x * 0.0)).unwrap();
        assert!(
            found.values.is_empty() && found.radius <= SMALLEST,
            "{found:?}"
        );
    }
}
