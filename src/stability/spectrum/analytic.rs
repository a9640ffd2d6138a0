//! Analytic functions of λ whose zeros are counted and found, with a limit of the number of
//! evaluations.

use std::cell::Cell;

use nalgebra::Complex;

use super::characteristic::CharacteristicMatrix;
use crate::linearisation::{Outcome, StabilityError};

/// Largest relative error of an analytic function that does not change the number of its zeros.
/// Rouché's theorem requires less than one. The error is an estimate, hence the margin of four.
pub(super) const RESOLVED: f64 = 0.25;

/// Largest number of evaluations in one search. A shoot of a few elements needs some hundred, and a
/// shoot whose essential spectrum is close to the axis a few thousand.
const MOST: usize = 20_000;

/// An analytic function at one λ.
#[derive(Debug, Clone, Copy)]
pub(super) struct AnalyticSample {
    pub value: Complex<f64>,
    /// f'/f, s: about the inverse distance of the nearest zero.
    pub log_derivative: Complex<f64>,
    /// Inverse distance of the nearest singularity that f'/f does not show at a distance, s.
    pub nearness: f64,
}

/// A function that is real on the real axis, tends to one far right, and is analytic right of a
/// line except at the zeros of its [divisors](Self::divisors).
pub(super) trait Analytic {
    fn at(&self, z: Complex<f64>) -> AnalyticSample;

    /// The function, and its relative error due to waves that the mesh does not resolve. The
    /// function is NaN if the estimate before its evaluation is not [below the limit](RESOLVED).
    fn with_mesh_error(&self, z: Complex<f64>) -> (AnalyticSample, f64) {
        (self.at(z), 0.0)
    }

    /// The characteristic matrix from which the function is computed. It has the bound and the time
    /// scales of the zeros.
    fn characteristic(&self) -> &CharacteristicMatrix;

    /// The denominators of a quotient. A zero of the quotient next to a zero of one of them is due
    /// to the mesh.
    fn divisors(&self) -> Vec<&dyn Analytic> {
        Vec::new()
    }
}

/// Runs a search on a function, with a limit of the number of evaluations.
///
/// # Errors
/// Errors of the search, and a search that exceeds the limit.
pub(super) fn limited<T>(
    function: &dyn Analytic,
    search: impl FnOnce(&dyn Analytic) -> Outcome<T>,
) -> Outcome<T> {
    let limited = Limited {
        function,
        left: Cell::new(MOST),
    };
    let answer = search(&limited);
    if limited.left.get() > 0 {
        return answer;
    }
    let what =
        "evaluations of the characteristic function, which has too many roots in the region,";
    Err(StabilityError::TooMuchWork {
        what,
        amount: MOST as f64,
        most: MOST as f64,
    })
}

/// A function whose value is NaN after a given number of evaluations, so that every search in it
/// ends.
struct Limited<'a> {
    function: &'a dyn Analytic,
    /// Number of evaluations left.
    left: Cell<usize>,
}

impl Limited<'_> {
    /// The function, unless its evaluations are used up.
    fn take(&self) -> Option<&dyn Analytic> {
        let left = self.left.get();
        self.left.set(left.saturating_sub(1));
        (left > 0).then_some(self.function)
    }
}

impl Analytic for Limited<'_> {
    fn at(&self, z: Complex<f64>) -> AnalyticSample {
        self.take().map_or(NOT_A_NUMBER, |function| function.at(z))
    }

    fn with_mesh_error(&self, z: Complex<f64>) -> (AnalyticSample, f64) {
        self.take()
            .map_or((NOT_A_NUMBER, 0.0), |function| function.with_mesh_error(z))
    }

    fn characteristic(&self) -> &CharacteristicMatrix {
        self.function.characteristic()
    }

    fn divisors(&self) -> Vec<&dyn Analytic> {
        self.function.divisors()
    }
}

/// A sample that ends a search.
pub(super) const NOT_A_NUMBER: AnalyticSample = {
    let nan = Complex::new(f64::NAN, f64::NAN);
    AnalyticSample {
        value: nan,
        log_derivative: nan,
        nearness: f64::NAN,
    }
};
