//! The number of zeros of an analytic function right of a line, by the argument principle.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::analytic::{Analytic, AnalyticSample, NOT_A_NUMBER, RESOLVED, limited};
use crate::error::ensure;
use crate::linearisation::{Outcome, StabilityError};
use crate::numerics::scalar::sort_by_value;

/// Largest number of halvings of a panel. A zero that the argument then does not resolve lies on
/// the line: 2⁻⁴⁵ of a panel is 3e-14, which is rounding.
const DEPTH: usize = 45;

/// A line on which a function was sampled to count the zeros right of it.
pub(super) struct CountedLine {
    pub abscissa: f64,
    /// The number of zeros with Re λ > `abscissa`.
    pub number: usize,
    /// Im λ of the samples, ascending, with the length of the step of Newton's method there. Panels
    /// are short next to a zero, so that samples are dense there.
    pub steps: Vec<(f64, f64)>,
}

/// The number of zeros with Re λ > `abscissa`, with the samples on the line.
///
/// # Errors
/// A zero on the line, which cannot be counted, a function that the mesh does not resolve there, or
/// too much work.
pub(super) fn count_along(f: &dyn Analytic, abscissa: f64) -> Outcome<CountedLine> {
    limited(f, |f| follow_line(f, abscissa))
}

fn follow_line(f: &dyn Analytic, abscissa: f64) -> Outcome<CountedLine> {
    let mut steps = Vec::new();
    let mut error = 0.0_f64;
    // The count ends at the first sample that the mesh does not resolve, whose error is reported.
    let mut on_line = |w: f64| {
        if !(error < RESOLVED) {
            return NOT_A_NUMBER;
        }
        let (sample, of_mesh) = f.with_mesh_error(Complex::new(abscissa, w));
        error = of_mesh;
        steps.push((w, sample.log_derivative.norm().recip()));
        sample
    };
    // The contour is the upper half of the line up to a bound beyond which there is no zero. The
    // lower half is symmetric, and the arc far right contributes nothing, because f is real at its
    // right end and |f − 1| < 1 beyond the bound. The panels are octaves. They begin at the
    // distance of the line from zero, where roots accumulate without proprioception.
    let top = 8.0 * f.characteristic().bound(abscissa);
    let slow = f.characteristic().slowest_rate();
    let octaves = (top / (0.25 * abscissa.abs()).clamp(1e-12 * slow, 0.1 * slow))
        .log2()
        .ceil() as i32;
    let places =
        std::iter::once(0.0).chain((0..=octaves).rev().map(|octave| top * 0.5_f64.powi(octave)));
    // The ends of all panels come first, because unresolved waves are found there with the least
    // work. A sample that is not finite ends them, since the bound may be infinite.
    let finite = |end: &(f64, AnalyticSample)| end.1.value.is_finite();
    let ends: Option<Vec<_>> = places
        .map(|w| Some((w, on_line(w))).filter(finite))
        .collect();
    let change: Option<f64> = ends.as_ref().and_then(|ends| {
        ends.windows(2)
            .map(|panel| argument(&mut on_line, panel[0], panel[1], 0))
            .sum()
    });
    let (elements, what) = (
        f.characteristic().elements(),
        "waves of the characteristic function (relative)",
    );
    ensure(
        error < RESOLVED,
        StabilityError::UnderResolved {
            elements,
            what,
            error,
        },
    )?;
    let value = ends
        .iter()
        .flatten()
        .last()
        .map_or(NOT_A_NUMBER, |(_, sample)| *sample)
        .value;
    let failed = |what, residual| StabilityError::NoConvergence { what, residual };
    let change = change.ok_or(failed(
        "count of roots (one lies on the line)",
        value.norm(),
    ))?;
    // The argument changes from its value at `top` to zero at infinity, where f = 1.
    let count = (value.arg() - change) / PI;
    let number = whole(count).ok_or(failed("count of roots", count - count.round()))?;
    sort_by_value(&mut steps, |step| step.0);
    Ok(CountedLine {
        abscissa,
        number,
        steps,
    })
}

/// The number of zeros minus the number of poles in a rectangle between two corners; none if one
/// lies on its sides.
pub(super) fn count_within(
    f: &dyn Analytic,
    low: Complex<f64>,
    high: Complex<f64>,
) -> Option<usize> {
    let corners = [
        low,
        Complex::new(high.re, low.im),
        high,
        Complex::new(low.re, high.im),
    ];
    let changes = (0..4).map(|i| {
        let side = corners[(i + 1) % 4] - corners[i];
        let mut on_side = |t: f64| {
            let at = f.at(corners[i] + side * t);
            AnalyticSample {
                log_derivative: at.log_derivative * side,
                nearness: at.nearness * side.norm(),
                ..at
            }
        };
        let ends = [on_side(0.0), on_side(1.0)];
        argument(&mut on_side, (0.0, ends[0]), (1.0, ends[1]), 0)
    });
    whole(changes.sum::<Option<f64>>()? / TAU)
}

/// The whole number nearest to a change of the argument over 2π, or over π on half a line; none if
/// it is negative, or if the change is not near it.
fn whole(count: f64) -> Option<usize> {
    let nearest = count.round();
    ((count - nearest).abs() < 0.05 && nearest >= 0.0).then_some(nearest as usize)
}

/// The change of the argument of `f` between two points. Panels are halved until the change over
/// each is small and reliable.
fn argument(
    f: &mut impl FnMut(f64) -> AnalyticSample,
    (a, fa): (f64, AnalyticSample),
    (b, fb): (f64, AnalyticSample),
    depth: usize,
) -> Option<f64> {
    let middle = 0.5 * (a + b);
    let fm = f(middle);
    let (left, right) = ((fm.value / fa.value).arg(), (fb.value / fm.value).arg());
    if !(left.is_finite() && right.is_finite()) {
        return None;
    }
    // The inverse distance of the nearest zero is about |f'/f|. Two zeros close to the line and to
    // each other change the argument by 2π between samples with equal values and derivatives of the
    // argument. Hence a panel must also be shorter than twice that distance. A zero beside its
    // middle then changes the argument by π/2 at most.
    let steepest = [fa, fm, fb]
        .map(|at| at.log_derivative.norm().max(at.nearness))
        .into_iter()
        .fold(0.0, f64::max);
    if left.abs() < 0.5
        && right.abs() < 0.5
        && (left - right).abs() < 0.25
        && (b - a) * steepest < 2.0
    {
        return Some(left + right);
    }
    if depth == DEPTH {
        return None;
    }
    Some(
        argument(f, (a, fa), (middle, fm), depth + 1)?
            + argument(f, (middle, fm), (b, fb), depth + 1)?,
    )
}
