//! A bound on the work of a search.

use std::cell::Cell;

use nalgebra::Complex;

use super::analytic::{Analytic, Sample, Scales};
use super::error::StabilityError;

/// Evaluations of a function in one search. A shoot of a few elements needs some hundred, next to an essential spectrum that is
/// about to cross the axis a few thousand.
const MOST: usize = 20_000;

/// A function that may be evaluated so many times; from then on it is not a number, and every search in it ends.
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

/// Does a search in a function, with a bound on its evaluations.
///
/// # Errors
/// That of the search, or that it took more than the bound.
pub(super) fn limited<T>(
    function: &dyn Analytic,
    search: impl FnOnce(&dyn Analytic) -> Result<T, StabilityError>,
) -> Result<T, StabilityError> {
    let limited = Limited { function, left: Cell::new(MOST) };
    let answer = search(&limited);
    if limited.left.get() == 0 { Err(StabilityError::TooMuchWork { evaluations: MOST }) } else { answer }
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
