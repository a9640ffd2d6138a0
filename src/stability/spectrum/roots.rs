//! The zeros of an analytic function: found by Newton's method, and checked by counting.

use nalgebra::Complex;

use super::analytic::{Analytic, limited};
use super::count::{CountedLine, count_along, count_within};
use crate::error::ensure;
use crate::linearisation::{Outcome, StabilityError, newton, newton_step};
use crate::numerics::scalar::sort_by_value;

/// Places at which a region is cut, in fractions of its side: not in the middle, where symmetric
/// problems have roots. The next place is tried if a root lies on the cut.
const CUTS: [f64; 3] = [0.47, 0.61, 0.35];

/// Number of roots that a root with Im λ ≥ 0 represents: two with its conjugate.
pub(super) fn with_conjugate(z: &Complex<f64>) -> usize {
    if z.im > 1e-9 * z.norm() { 2 } else { 1 }
}

/// Smallest real part of an unstable zero, 1/s.
pub(super) fn threshold(f: &dyn Analytic) -> f64 {
    1e-6 * f.characteristic().slowest_rate()
}

/// The zero that Newton's method finds near `start`.
pub(super) fn zero_near(f: &dyn Analytic, start: Complex<f64>) -> Outcome<Complex<f64>> {
    let smallest = f.characteristic().smallest_modulus();
    // The accuracy is the rounding error of the quotient of determinants.
    let found = newton(
        start,
        1e-13,
        |z| z.norm().max(smallest),
        |z| newton_step(f.at(z).log_derivative),
    );
    found.map_err(|residual| StabilityError::NoConvergence {
        what: "characteristic root",
        residual,
    })
}

/// All zeros with Re λ > `abscissa` and Im λ ≥ 0, rightmost first.
///
/// # Errors
/// Errors of the count, zeros that are not found, or too much work.
pub(super) fn roots_right_of(f: &dyn Analytic, abscissa: f64) -> Outcome<Vec<Complex<f64>>> {
    limited(f, |f| find(f, &count_along(f, abscissa)?))
}

/// The zeros right of a line, rightmost first. If Newton's method does not find all of them from
/// the line, the region is divided by counts.
fn find(f: &dyn Analytic, line: &CountedLine) -> Outcome<Vec<Complex<f64>>> {
    let CountedLine {
        abscissa, number, ..
    } = *line;
    let mut found = near_line(f, line);
    if multiplicity(&found) != number {
        found.clear();
        let top = f.characteristic().bound(abscissa);
        isolate(
            f,
            (Complex::new(abscissa, -0.01 * top), Complex::new(top, top)),
            None,
            0,
            &mut found,
        )?;
    }
    let residual = number as f64 - multiplicity(&found) as f64;
    let what = "search for all roots (some are multiple or too close)";
    ensure(
        residual == 0.0,
        StabilityError::NoConvergence { what, residual },
    )?;
    sort_by_value(&mut found, |z| -z.re);
    Ok(found)
}

/// Number of zeros that those with Im λ ≥ 0 represent.
fn multiplicity(found: &[Complex<f64>]) -> usize {
    found.iter().map(with_conjugate).sum()
}

/// The zeros right of a line that Newton's method finds from the samples of the count with the
/// shortest steps.
fn near_line(f: &dyn Analytic, line: &CountedLine) -> Vec<Complex<f64>> {
    let mut found = Vec::new();
    if line.number == 0 {
        return found;
    }
    let step = |i: usize| line.steps.get(i).map_or(f64::INFINITY, |(_, step)| *step);
    for (i, (w, _)) in line.steps.iter().enumerate() {
        let shortest =
            step(i).is_finite() && step(i) <= step(i.wrapping_sub(1)) && step(i) <= step(i + 1);
        if shortest
            && let Ok(z) = zero_near(f, Complex::new(line.abscissa, *w))
            && z.re > line.abscissa
            && !is_next_to_a_pole(f, z, line.abscissa)
        {
            insert(&mut found, z, f64::EPSILON.sqrt());
        }
    }
    found
}

/// The rightmost zero, if one lies right of `left`. `guess` is an approximation of it, such as the
/// rightmost zero of a similar function.
///
/// # Errors
/// Errors of the counts, zeros that are not found, or too much work.
pub(super) fn rightmost(
    f: &dyn Analytic,
    left: f64,
    guess: Option<Complex<f64>>,
) -> Outcome<Option<Complex<f64>>> {
    limited(f, |f| {
        if let Some(z) = guess.and_then(|z| zero_near(f, z).ok())
            && z.re > left
            && matches!(
                count_along(f, z.re + threshold(f)),
                Ok(CountedLine { number: 0, .. })
            )
        {
            return Ok(Some(Complex::new(z.re, z.im.abs())));
        }
        let Some((mut line, mut clear)) = first_line(f, left)? else {
            return Ok(None);
        };
        // The line is moved right until it has at most four pairs of zeros on its right, which
        // Newton's method finds from it.
        while clear - line.abscissa > threshold(f) {
            if line.number <= 8 {
                let found = near_line(f, &line);
                if multiplicity(&found) == line.number {
                    return Ok(found
                        .into_iter()
                        .reduce(|a, b| if b.re > a.re { b } else { a }));
                }
            }
            let places = CUTS.map(|share| line.abscissa + share * (clear - line.abscissa));
            match places.into_iter().find_map(|re| count_along(f, re).ok()) {
                Some(CountedLine {
                    abscissa,
                    number: 0,
                    ..
                }) => clear = abscissa,
                Some(closer) => line = closer,
                None => break,
            }
        }
        Ok(find(f, &line)?.first().copied())
    })
}

/// The first line towards the left that has zeros on its right, and the abscissa of the last one
/// that had none. None if no line right of `left` has zeros on its right.
///
/// The number of zeros increases towards the left as exp(|Re λ| d), d the longest delay, and
/// without bound next to the essential spectrum. The lines therefore begin at the axis and approach
/// `left` in short strides. If `left` lies right of the axis, each line halves the distance between
/// `left` and the bound of the zeros.
fn first_line(f: &dyn Analytic, left: f64) -> Outcome<Option<(CountedLine, f64)>> {
    let axis = threshold(f);
    // Over a delay that is the inverse of the slowest rate the function increases by less than a
    // factor of two in a stride.
    let stride = 0.5 * f.characteristic().slowest_rate();
    let mut clear = f.characteristic().bound(axis.max(left));
    let (mut next, longest, scale) = if left < axis {
        (axis, stride, axis - left)
    } else {
        (0.5 * (clear + left), f64::INFINITY, stride)
    };
    while next > left {
        let line = count_along(f, next)?;
        if line.number > 0 {
            return Ok(Some((line, clear)));
        }
        clear = next;
        // Twelve halvings of the scale.
        if clear - left < 2.5e-4 * scale {
            break;
        }
        next = clear - longest.min(0.5 * (clear - left));
    }
    Ok(None)
}

/// Adds a root or its conjugate, whichever has Im λ ≥ 0, unless it is known up to a relative
/// difference. Two approximations of a double root differ by the square root of rounding.
pub(super) fn insert(found: &mut Vec<Complex<f64>>, z: Complex<f64>, difference: f64) {
    let z = Complex::new(z.re, z.im.abs());
    if !found
        .iter()
        .any(|other| (other - z).norm() < difference * z.norm())
    {
        found.push(z);
    }
}

/// Finds the zeros in a rectangle between two corners. It is divided until each part contains one
/// zero, which Newton's method finds from the centre. `known` is the number of zeros in it, if that
/// was counted before.
fn isolate(
    f: &dyn Analytic,
    (low, high): (Complex<f64>, Complex<f64>),
    known: Option<usize>,
    depth: usize,
    found: &mut Vec<Complex<f64>>,
) -> Outcome {
    let error = StabilityError::NoConvergence {
        what: "search for all roots (some are multiple)",
        residual: low.re,
    };
    let Some(number) = known.or_else(|| count_within(f, low, high)) else {
        return Err(error);
    };
    if number == 0 {
        return Ok(());
    }
    let inside =
        |z: Complex<f64>| z.re > low.re && z.re < high.re && z.im > low.im && z.im < high.im;
    if number == 1
        && let Ok(z) = zero_near(f, 0.5 * (low + high))
        && inside(z)
    {
        insert(found, z, f64::EPSILON.sqrt());
        return Ok(());
    }
    if depth == 60 {
        return Err(error);
    }
    let size = high - low;
    let cut = |corner: Complex<f64>, share: f64| {
        let at = low + size * share;
        if size.re > size.im {
            Complex::new(at.re, corner.im)
        } else {
            Complex::new(corner.re, at.im)
        }
    };
    for share in CUTS {
        let (first_high, second_low) = (cut(high, share), cut(low, share));
        let Some(first) = count_within(f, low, first_high) else {
            continue;
        };
        if first <= number {
            isolate(f, (low, first_high), Some(first), depth + 1, found)?;
            return isolate(
                f,
                (second_low, high),
                Some(number - first),
                depth + 1,
                found,
            );
        }
    }
    Err(error)
}

/// Whether a zero of a quotient is cancelled by a pole next to it that lies right of the line, too.
/// Poles left of the line do not enter the count.
fn is_next_to_a_pole(f: &dyn Analytic, z: Complex<f64>, abscissa: f64) -> bool {
    f.divisors().into_iter().any(|divisor| {
        // There is no pole near if the first step is long.
        if newton_step(divisor.at(z).log_derivative).norm() > z.norm() {
            return false;
        }
        let Ok(pole) = zero_near(divisor, z) else {
            return false;
        };
        let distance = (pole - z).norm();
        // Equal numbers of zeros and poles in a rectangle around both are not a root. A zero and a
        // pole due to the same waves are close to each other, so that other pairs are not counted.
        let reach = (3.0 * distance).max(1e-6 * z.norm());
        let corner = Complex::new(reach, 1.1 * reach);
        distance < 0.3 * z.norm()
            && pole.re > abscissa
            && count_within(f, z - corner, z + corner) == Some(0)
    })
}
