//! Kinds of bifurcations, by the exponents that cross the imaginary axis.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::cycle::disturbances::Disturbances;

/// A bifurcation on a branch of orbits: an exponent crosses the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bifurcation {
    /// The parameter has an extremum: there is no orbit of this branch beyond.
    Fold,
    /// A real exponent crosses zero and the parameter has no extremum: a branch of less symmetry begins, for example of ellipses where a
    /// swing leaves its plane.
    Pitchfork,
    /// A multiplier crosses −1: a branch of orbits with twice the period begins.
    PeriodDoubling,
    /// A pair of exponents crosses the axis: motion with a second period begins, on a torus.
    Torus,
}

/// Distance from the real axis, or from ±π, of an exponent times the period that counts as zero. Two exponents that meet beside the
/// trivial ones are known to the square root of rounding.
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

/// The kind of a bifurcation, by the critical exponent times the period, which may be the logarithm of a multiplier (`multiplied`).
pub(super) fn kind(exponent: Complex<f64>, multiplied: bool) -> Bifurcation {
    let angle = exponent.im.abs();
    if angle < NEAR {
        Bifurcation::Pitchfork
    } else if multiplied && (angle - PI).abs() < NEAR {
        Bifurcation::PeriodDoubling
    } else {
        Bifurcation::Torus
    }
}
