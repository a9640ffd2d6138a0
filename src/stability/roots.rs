//! The zeros of an analytic function: found by Newton's method, checked by counting.

use nalgebra::Complex;

use super::analytic::Analytic;
use super::count::{Line, count_along, count_right_of, count_within};
use super::effort::limited;
use super::error::StabilityError;

/// A pole further from a zero than this share of it has nothing to do with it.
const NEIGHBOUR: f64 = 0.3;
/// Points on a line from which Newton's method may start.
const GRID: usize = 96;
/// Roots closer than this share of themselves are one.
const SAME: f64 = 1e-8;
/// So many zeros are found at once: four pairs.
const FEW: usize = 8;
/// From line to line towards the left, in units of the slowest rate: over a delay that is this rate's inverse, the function grows
/// by less than two.
const STRIDE: f64 = 0.5;
/// Distance of the last line from the left end of the search, as a share of that of the axis; of the stride if the left end is right
/// of the axis.
const CLOSEST: f64 = 2.5e-4;

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
/// # Errors
/// Those of a count, zeros that are not found, or too much work.
pub(super) fn roots_right_of(f: &dyn Analytic, abscissa: f64) -> Result<Vec<Complex<f64>>, StabilityError> {
    limited(f, |f| find(f, &count_along(f, abscissa)?))
}

/// The zeros right of a line.
///
/// Newton's method is started where its step is shortest along lines in the region; counting says whether that has found
/// them all. The first line is that of the count; others are drawn if it does not do, and then the region is halved.
fn find(f: &dyn Analytic, line: &Line) -> Result<Vec<Complex<f64>>, StabilityError> {
    let mut found = near_line(f, line);
    let Line { abscissa, number, .. } = *line;
    let top = f.scales().bound(abscissa);
    for share in [0.0, 1.0 / 9.0, 4.0 / 9.0] {
        if multiplicity(&found) < number {
            newton_from(f, line, abscissa + (top - abscissa) * share, None, &mut found);
        }
    }
    if multiplicity(&found) != number {
        // By halving the region, which misses none.
        found.clear();
        isolate(f, (Complex::new(abscissa, -0.01 * top), Complex::new(top, top)), None, 0, &mut found)?;
    }
    if multiplicity(&found) != number {
        let residual = number as f64 - multiplicity(&found) as f64;
        let what = "search for all roots (some are multiple or too close)";
        return Err(StabilityError::NoConvergence { what, residual });
    }
    found.sort_by(|a, b| b.re.total_cmp(&a.re));
    Ok(found)
}

/// How many zeros some with Im λ ≥ 0 stand for.
fn multiplicity(found: &[Complex<f64>]) -> usize {
    found.iter().map(with_conjugate).sum()
}

/// The zeros right of a line that Newton's method finds from its own samples.
fn near_line(f: &dyn Analytic, line: &Line) -> Vec<Complex<f64>> {
    let mut found = Vec::new();
    if line.number > 0 {
        newton_from(f, line, line.abscissa, Some(&line.steps), &mut found);
    }
    found
}

/// Adds the zeros right of a line that Newton's method finds from another, where its steps are known or made.
fn newton_from(f: &dyn Analytic, line: &Line, re: f64, steps: Option<&[(f64, f64)]>, found: &mut Vec<Complex<f64>>) {
    let made = if steps.is_some() { Vec::new() } else { grid(f, re) };
    for w in starts(steps.unwrap_or(&made)) {
        if let Ok(z) = polish(f, Complex::new(re, w))
            && z.re > line.abscissa
            && is_new(found, z)
            && !is_next_to_a_pole(f, z, line.abscissa)
        {
            insert(found, z);
        }
    }
}

/// The rightmost zero, if one lies right of `left`. `guess` is where it may be: that of a function which differs little.
///
/// # Errors
/// Those of a count, zeros that are not found, or too much work.
pub(super) fn rightmost(
    f: &dyn Analytic,
    left: f64,
    guess: Option<Complex<f64>>,
) -> Result<Option<Complex<f64>>, StabilityError> {
    limited(f, |f| {
        if let Some(z) = guess.and_then(|z| polish(f, z).ok())
            && z.re > left
            && matches!(count_right_of(f, z.re + threshold(f)), Ok(0))
        {
            return Ok(Some(Complex::new(z.re, z.im.abs())));
        }
        let Some((mut line, mut clear)) = first_line(f, left)? else { return Ok(None) };
        // Back until there are few, which Newton's method finds from the line.
        while clear - line.abscissa > threshold(f) {
            if line.number <= FEW {
                let mut found = near_line(f, &line);
                if multiplicity(&found) == line.number {
                    found.sort_by(|a, b| b.re.total_cmp(&a.re));
                    return Ok(found.first().copied());
                }
            }
            // Off the middle, and elsewhere if a root lies there.
            let places = [0.47, 0.61, 0.35].map(|share| line.abscissa + share * (clear - line.abscissa));
            match places.into_iter().find_map(|re| count_along(f, re).ok()) {
                Some(Line { abscissa, number: 0, .. }) => clear = abscissa,
                Some(closer) => line = closer,
                None => break,
            }
        }
        Ok(find(f, &line)?.first().copied())
    })
}

/// The first line towards the left that has zeros on its right, and the last one that had none. None if no line right of `left`
/// has.
///
/// Ever more zeros lie ever further left: exp(|Re λ| d) of them, d the longest delay, and without bound next to the essential
/// spectrum. The lines therefore begin at the axis and move left in short strides, ever closer to `left`. If `left` lies right
/// of the axis, each line halves the distance between `left` and the bound of the zeros.
fn first_line(f: &dyn Analytic, left: f64) -> Result<Option<(Line, f64)>, StabilityError> {
    let axis = threshold(f);
    let stride = STRIDE * f.scales().slowest_rate();
    let mut clear = f.scales().bound(axis.max(left));
    let (mut next, longest, closest) = if left < axis {
        (axis, stride, CLOSEST * (axis - left))
    } else {
        (0.5 * (clear + left), f64::INFINITY, CLOSEST * stride)
    };
    while next > left {
        let line = count_along(f, next)?;
        if line.number > 0 {
            return Ok(Some((line, clear)));
        }
        clear = next;
        if clear - left < closest {
            break;
        }
        next = clear - longest.min(0.5 * (clear - left));
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
    if is_new(found, z) {
        found.push(z);
    }
}

fn is_new(found: &[Complex<f64>], z: Complex<f64>) -> bool {
    let z = Complex::new(z.re, z.im.abs());
    !found.iter().any(|other| (other - z).norm() < SAME * z.norm())
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

/// The steps of Newton's method at points of a line, denser towards the real axis.
fn grid(f: &dyn Analytic, re: f64) -> Vec<(f64, f64)> {
    let top = f.scales().bound(re);
    let points = (0..=GRID).map(|i| top * (i as f64 / GRID as f64).powi(2));
    points.map(|w| (w, newton_step(f, Complex::new(re, w)).norm())).collect()
}

/// Where the steps along a line are shortest.
fn starts(steps: &[(f64, f64)]) -> impl Iterator<Item = f64> {
    let at = |i: usize| steps.get(i).map_or(f64::INFINITY, |(_, step)| *step);
    let shortest = move |i: &usize| at(*i).is_finite() && at(*i) <= at(i.wrapping_sub(1)) && at(*i) <= at(i + 1);
    (0..steps.len()).filter(shortest).map(|i| steps[i].0)
}

/// Whether a zero of a quotient belongs to a pole next to it, right of the line as well: what lies left of it was not counted.
fn is_next_to_a_pole(f: &dyn Analytic, z: Complex<f64>, abscissa: f64) -> bool {
    f.divisors().into_iter().any(|divisor| {
        // Where even the first step is a long one there is none.
        if newton_step(divisor, z).norm() > z.norm() {
            return false;
        }
        let Ok(pole) = polish(divisor, z) else { return false };
        let distance = (pole - z).norm();
        // Around both; as many zeros as poles make no root.
        let reach = (3.0 * distance).max(1e-6 * z.norm());
        let corner = Complex::new(reach, 1.1 * reach);
        distance < NEIGHBOUR * z.norm() && pole.re > abscissa && count_within(f, z - corner, z + corner) == Some(0)
    })
}
