//! The zeros of an analytic function: found by Newton's method, checked by counting.

use nalgebra::Complex;

use super::analytic::Analytic;
use super::count::{count_right_of, count_within};
use super::error::StabilityError;

/// A pole further from a zero than this share of it has nothing to do with it.
const NEIGHBOUR: f64 = 0.3;
/// Points on a line from which Newton's method may start.
const GRID: usize = 48;
/// Roots closer than this share of themselves are one.
const SAME: f64 = 1e-8;

/// How many roots a root with Im λ ≥ 0 stands for: two with its conjugate.
pub(super) fn with_conjugate(z: &Complex<f64>) -> usize {
    if z.im > 1e-9 * z.norm() { 2 } else { 1 }
}

/// −f/f', the step of Newton's method.
fn newton_step(f: &dyn Analytic, z: Complex<f64>) -> Complex<f64> {
    let slope = f.at(z).log_derivative;
    // At a root to the last digit: a pivot is zero.
    if slope.re.is_infinite() { Complex::ZERO } else { -slope.inv() }
}

/// Newton's method for a zero near `start`.
pub(super) fn polish(f: &dyn Analytic, start: Complex<f64>) -> Result<Complex<f64>, StabilityError> {
    let mut z = start;
    let mut last = f64::INFINITY;
    let smallest = f.scales().slowest_rate() * 1e-3;
    for _ in 0..60 {
        let step = newton_step(f, z);
        z += step;
        let size = step.norm();
        if !size.is_finite() {
            break;
        }
        // Rounding of the determinant's quotient; beyond it steps no longer shrink.
        let scale = z.norm().max(smallest);
        if size <= 1e-13 * scale || (size < 1e-9 * scale && size >= last) {
            return Ok(z);
        }
        last = size;
    }
    Err(StabilityError::NoConvergence { what: "characteristic root", residual: last })
}

/// All zeros with Re λ > `abscissa` and Im λ ≥ 0, rightmost first.
///
/// Newton's method is started where its step is shortest along lines in the region; counting says whether that has found
/// them all. If not, the lines are drawn more densely, and then the region is halved.
pub(super) fn roots_right_of(f: &dyn Analytic, abscissa: f64) -> Result<Vec<Complex<f64>>, StabilityError> {
    let count = count_right_of(f, abscissa)?;
    let number = |found: &[Complex<f64>]| found.iter().map(with_conjugate).sum::<usize>();
    let mut found: Vec<Complex<f64>> = Vec::new();
    let top = f.scales().bound(abscissa);
    for refinement in 0..2 {
        let lines = 1 + 2 * refinement;
        for line in 0..lines {
            if number(&found) < count {
                let re = abscissa + (top - abscissa) * (line as f64 / lines as f64).powi(2);
                let near = near_line(f, re, GRID << refinement);
                near.into_iter().filter(|z| z.re > abscissa).for_each(|z| insert(&mut found, z));
            }
        }
    }
    if number(&found) != count {
        // By halving the region, which misses none.
        found.clear();
        isolate(f, (Complex::new(abscissa, -0.01 * top), Complex::new(top, top)), None, 0, &mut found)?;
    }
    if number(&found) != count {
        let residual = count as f64 - number(&found) as f64;
        let what = "search for all roots (some are multiple or too close)";
        return Err(StabilityError::NoConvergence { what, residual });
    }
    found.sort_by(|a, b| b.re.total_cmp(&a.re));
    Ok(found)
}

/// The rightmost zero, if one lies right of `left`.
pub(super) fn rightmost(f: &dyn Analytic, left: f64) -> Result<Option<Complex<f64>>, StabilityError> {
    // From next to the axis ever closer to `left`, until a line has zeros on its right.
    let mut line = threshold(f);
    for _ in 0..12 {
        let found = roots_right_of(f, line)?;
        if let Some(first) = found.first() {
            return Ok(Some(*first));
        }
        line = left + (line - left) * 0.5;
    }
    Ok(None)
}

/// How far right of the axis a zero must lie to count as unstable, 1/s.
pub(super) fn threshold(f: &dyn Analytic) -> f64 {
    1e-6 * f.scales().slowest_rate()
}

/// Adds a root or its conjugate, whichever has Im λ ≥ 0, if it is new.
fn insert(found: &mut Vec<Complex<f64>>, z: Complex<f64>) {
    let z = Complex::new(z.re, z.im.abs());
    if !found.iter().any(|other| (other - z).norm() < SAME * z.norm()) {
        found.push(z);
    }
}

/// Finds the zeros in a rectangle between two corners: halves it until each part holds one, from where Newton's method
/// finds it. `known` is how many there are, if that is known.
fn isolate(
    f: &dyn Analytic,
    (low, high): (Complex<f64>, Complex<f64>),
    known: Option<usize>,
    depth: usize,
    found: &mut Vec<Complex<f64>>,
) -> Result<(), StabilityError> {
    let error = StabilityError::NoConvergence { what: "search for all roots (some are multiple)", residual: low.re };
    let Some(number) = known.or_else(|| count_within(f, low, high)) else { return Err(error) };
    if number == 0 {
        return Ok(());
    }
    let inside = |z: Complex<f64>| z.re > low.re && z.re < high.re && z.im > low.im && z.im < high.im;
    if number == 1
        && let Ok(z) = polish(f, 0.5 * (low + high))
        && inside(z)
    {
        insert(found, z);
        return Ok(());
    }
    if depth == 60 {
        return Err(error);
    }
    let size = high - low;
    let cut = |corner: Complex<f64>, share: f64| {
        if size.re > size.im {
            Complex::new(low.re + share * size.re, corner.im)
        } else {
            Complex::new(corner.re, low.im + share * size.im)
        }
    };
    // Off the middle, and elsewhere if a root lies on the cut.
    for share in [0.47, 0.61, 0.35] {
        let (first_high, second_low) = (cut(high, share), cut(low, share));
        let Some(first) = count_within(f, low, first_high) else { continue };
        if first <= number {
            isolate(f, (low, first_high), Some(first), depth + 1, found)?;
            return isolate(f, (second_low, high), Some(number - first), depth + 1, found);
        }
    }
    Err(error)
}

/// Zeros that Newton's method finds from a line; each may occur more than once.
fn near_line(f: &dyn Analytic, re: f64, points: usize) -> Vec<Complex<f64>> {
    let top = f.scales().bound(re);
    let at = |i: usize| Complex::new(re, top * (i as f64 / points as f64).powi(2));
    let steps: Vec<f64> = (0..=points).map(|i| newton_step(f, at(i)).norm()).collect();
    let shortest = |i: usize| (i == 0 || steps[i] <= steps[i - 1]) && (i == points || steps[i] <= steps[i + 1]);
    let starts = (0..=points).filter(|&i| steps[i].is_finite() && shortest(i));
    starts.filter_map(|i| polish(f, at(i)).ok()).filter(|z| !is_next_to_a_pole(f, *z)).collect()
}

/// Whether a zero of a quotient belongs to a pole next to it.
fn is_next_to_a_pole(f: &dyn Analytic, z: Complex<f64>) -> bool {
    f.divisors().into_iter().any(|divisor| {
        let Ok(pole) = polish(divisor, z) else { return false };
        let distance = (pole - z).norm();
        // Around both; as many zeros as poles make no root.
        let reach = (3.0 * distance).max(1e-6 * z.norm());
        let corner = Complex::new(reach, 1.1 * reach);
        distance < NEIGHBOUR * z.norm() && count_within(f, z - corner, z + corner) == Some(0)
    })
}
