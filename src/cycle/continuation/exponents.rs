//! Kinds of bifurcations. The kind is determined by the exponents that cross the imaginary axis.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::cycle::disturbances::Disturbances;

/// A bifurcation on a branch of orbits: an exponent crosses the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bifurcation {
    /// The parameter has an extremum, beyond which this branch has no orbit.
    Fold,
    /// A real exponent crosses zero and the parameter has no extremum: a branch with less symmetry begins, for
    /// example one of ellipses at a planar swing.
    Pitchfork,
    /// A multiplier crosses −1: a branch of orbits with twice the period begins.
    PeriodDoubling,
    /// A pair of exponents crosses the imaginary axis: quasiperiodic motion on a torus begins.
    Torus,
}

/// Largest imaginary part of an exponent times the period, or distance of this product from ±π, that counts as zero.
/// Two nearly equal exponents are accurate to the square root of the error of the linearisation, 1e-6.
const NEAR: f64 = 1e-3;

/// Number of exponents with positive real part.
pub(super) fn growing<'a>(exponents: impl IntoIterator<Item = &'a Complex<f64>>) -> usize {
    exponents.into_iter().filter(|exponent| exponent.re > 0.0).count()
}

/// The exponents in the plane and out of it, or all in one list unless `divided`, largest real part first.
pub(super) fn lists(exponents: &Disturbances<Complex<f64>>, divided: bool) -> [Vec<Complex<f64>>; 2] {
    if divided {
        return exponents.lists().map(<[_]>::to_vec);
    }
    let mut all: Vec<_> = exponents.iter().copied().collect();
    all.sort_by(|a, b| b.re.total_cmp(&a.re));
    [all, Vec::new()]
}

/// The kind of a bifurcation with a critical exponent times the period, which is the logarithm of a multiplier if
/// `floquet`.
pub(super) fn kind(exponent: Complex<f64>, floquet: bool) -> Bifurcation {
    let angle = exponent.im.abs();
    if angle < NEAR {
        Bifurcation::Pitchfork
    } else if floquet && (angle - PI).abs() < NEAR {
        Bifurcation::PeriodDoubling
    } else {
        Bifurcation::Torus
    }
}
