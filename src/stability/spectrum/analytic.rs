//! Analytic functions of λ whose zeros are counted and found, with a bound on the number of evaluations.

use std::cell::Cell;

use nalgebra::Complex;

use crate::stability::error::StabilityError;

/// Largest relative error of an analytic function that does not change the number of its zeros. Rouché's theorem requires
/// less than one; the error is an estimate, hence a quarter.
pub(super) const RESOLVED: f64 = 0.25;

/// Largest number of evaluations in one search. A shoot of a few elements needs some hundred, next to an essential spectrum
/// that is about to cross the axis a few thousand.
const MOST: usize = 20_000;

/// An analytic function at one λ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub value: Complex<f64>,
    /// f'/f, s: about the inverse distance of the nearest zero.
    pub log_derivative: Complex<f64>,
    /// The inverse distance of a singularity that f'/f does not show from afar, s.
    pub nearness: f64,
}

/// The range of |λ| that contains the zeros of a function.
pub(super) trait Scales {
    /// A radius outside which there is no zero with Re λ ≥ `abscissa`, 1/s.
    fn bound(&self, abscissa: f64) -> f64;

    /// The slowest rate of the laws, 1/s: λ that are smaller by many digits are zero.
    fn slowest_rate(&self) -> f64;

    /// Size of λ below which its error is not relative to |λ|: a thousandth of the slowest rate, 1/s.
    fn smallest_modulus(&self) -> f64 {
        1e-3 * self.slowest_rate()
    }
}

/// A function that is real on the real axis, tends to one far right, and is analytic right of a line except at the zeros of
/// its [divisors](Self::divisors).
pub(super) trait Analytic {
    fn at(&self, z: Complex<f64>) -> Sample;

    /// The same, with the relative error of the function due to waves that the mesh does not resolve.
    fn with_unresolved_share(&self, z: Complex<f64>) -> (Sample, f64) {
        (self.at(z), 0.0)
    }

    /// The range that contains its zeros.
    fn scales(&self) -> &dyn Scales;

    /// The denominators of a quotient. A zero of the quotient next to a zero of one of them is due to the mesh.
    fn divisors(&self) -> Vec<&dyn Analytic> {
        Vec::new()
    }
}

/// Runs a search on a function, with a bound on the number of evaluations.
///
/// # Errors
/// Those of the search, or that it exceeded the bound.
pub(super) fn limited<T>(
    function: &dyn Analytic,
    search: impl FnOnce(&dyn Analytic) -> Result<T, StabilityError>,
) -> Result<T, StabilityError> {
    let limited = Limited { function, left: Cell::new(MOST) };
    let answer = search(&limited);
    if limited.left.get() == 0 { Err(StabilityError::TooMuchWork { evaluations: MOST }) } else { answer }
}

/// A function that is not a number after a given number of evaluations. Every search in it then ends.
struct Limited<'a> {
    function: &'a dyn Analytic,
    left: Cell<usize>,
}

impl Limited<'_> {
    fn take(&self) -> bool {
        let left = self.left.get();
        self.left.set(left.saturating_sub(1));
        left > 0
    }
}

impl Analytic for Limited<'_> {
    fn at(&self, z: Complex<f64>) -> Sample {
        if self.take() { self.function.at(z) } else { NOT_A_NUMBER }
    }

    fn with_unresolved_share(&self, z: Complex<f64>) -> (Sample, f64) {
        if self.take() { self.function.with_unresolved_share(z) } else { (NOT_A_NUMBER, 0.0) }
    }

    fn scales(&self) -> &dyn Scales {
        self.function.scales()
    }

    fn divisors(&self) -> Vec<&dyn Analytic> {
        self.function.divisors()
    }
}

const NOT_A_NUMBER: Sample = {
    let nan = Complex::new(f64::NAN, f64::NAN);
    Sample { value: nan, log_derivative: nan, nearness: f64::NAN }
};
