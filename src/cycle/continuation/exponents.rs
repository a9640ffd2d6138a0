//! What passes where exponents pass the imaginary axis.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::cycle::disturbances::Disturbances;

/// What happens on a branch of cycles where an exponent passes the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Special {
    /// The branch turns back: there is no cycle beyond this value of the parameter.
    Fold,
    /// A real exponent passes zero, while the parameter goes on: a branch of cycles of less symmetry begins, as of ellipses where a swing leaves
    /// its plane.
    Pitchfork,
    /// A multiplier passes −1: a branch of cycles begins that come back after two periods.
    PeriodDoubling,
    /// A pair of exponents passes the axis: a motion with a second period begins, on a torus. The tip draws a rosette, or swings more and less.
    Torus,
}

/// An exponent times the period that is nearer to the real axis, or to ±π, than this is there: next to the trivial ones two that meet
/// are known to the square root of rounding.
const NEAR: f64 = 1e-3;

/// Number of exponents with positive real part.
pub(super) fn growing<'a>(exponents: impl IntoIterator<Item = &'a Complex<f64>>) -> usize {
    exponents.into_iter().filter(|exponent| exponent.re > 0.0).count()
}

/// The exponents in the plane and out of it, or all in one list if they are not `divided`, largest real part first.
pub(super) fn lists(exponents: &Disturbances<Complex<f64>>, divided: bool) -> [Vec<Complex<f64>>; 2] {
    if divided {
        return exponents.lists().map(<[_]>::to_vec);
    }
    let mut all: Vec<_> = exponents.iter().copied().collect();
    all.sort_by(|a, b| b.re.total_cmp(&a.re));
    [all, Vec::new()]
}

/// What passes the axis, by its exponent times the period; whether that is the logarithm of a multiplier.
pub(super) fn kind(exponent: Complex<f64>, multiplied: bool) -> Special {
    let angle = exponent.im.abs();
    if angle < NEAR {
        Special::Pitchfork
    } else if multiplied && (angle - PI).abs() < NEAR {
        Special::PeriodDoubling
    } else {
        Special::Torus
    }
}
