//! The zeros of an analytic function: found by Newton's method, and checked by counting.

use nalgebra::Complex;

use super::analytic::{Analytic, limited};
use super::count::{Line, count_along, count_right_of, count_within};
use crate::linear::{newton, newton_step};
use crate::stability::error::StabilityError;

/// Largest distance between a zero and a pole that is due to the same waves, relative to |λ|. The test counts zeros and
/// poles around both, so that the value decides only when it is made.
const NEIGHBOUR: f64 = 0.3;
/// Largest relative distance between two approximations of one root: the accuracy of a double root, √1e-16.
const SAME: f64 = 1e-8;
/// Largest number of zeros that are sought from one line: four pairs.
const FEW: usize = 8;
/// Number of points on a line from which Newton's method may start: a dozen for each zero.
const GRID: usize = 12 * FEW;
/// Distance from line to line towards the left, in units of the slowest rate. Over a delay that is the inverse of this rate
/// the function increases by less than a factor of two.
const STRIDE: f64 = 0.5;
/// Distance of the last line from the left end of the search, relative to the distance of the axis, or to the stride if the
/// left end lies right of the axis. It is reached after twelve halvings.
const CLOSEST: f64 = 2.5e-4;
/// Places at which a region is cut: not in the middle, where symmetric problems have roots, and elsewhere if a root lies on
/// the cut.
const CUTS: [f64; 3] = [0.47, 0.61, 0.35];

/// Number of roots that a root with Im λ ≥ 0 represents: two with its conjugate.
pub(super) fn with_conjugate(z: &Complex<f64>) -> usize {
    if z.im > 1e-9 * z.norm() { 2 } else { 1 }
}

/// The step of Newton's method at λ.
fn step_at(f: &dyn Analytic, z: Complex<f64>) -> Complex<f64> {
    newton_step(f.at(z).log_derivative)
}

/// The zero that Newton's method finds near `start`.
pub(super) fn zero_near(f: &dyn Analytic, start: Complex<f64>) -> Result<Complex<f64>, StabilityError> {
    let smallest = f.scales().smallest_modulus();
    // The accuracy is the rounding error of the quotient of determinants.
    let found = newton(start, 1e-13, |z| z.norm().max(smallest), |z| step_at(f, z));
    found.map_err(|residual| StabilityError::NoConvergence { what: "characteristic root", residual })
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
/// them all. The first line is that of the count. If the zeros found from it are too few, others are tried, and then the
/// region is divided.
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
        // Dividing the region by counts misses none.
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

/// Number of zeros that those with Im λ ≥ 0 represent.
fn multiplicity(found: &[Complex<f64>]) -> usize {
    found.iter().map(with_conjugate).sum()
}

/// The zeros right of a line that Newton's method finds from the samples of its count.
fn near_line(f: &dyn Analytic, line: &Line) -> Vec<Complex<f64>> {
    let mut found = Vec::new();
    if line.number > 0 {
        newton_from(f, line, line.abscissa, Some(&line.steps), &mut found);
    }
    found
}

/// Adds the zeros right of a line that Newton's method finds from places on another line, at `re`. `steps` are its known
/// steps there.
fn newton_from(f: &dyn Analytic, line: &Line, re: f64, steps: Option<&[(f64, f64)]>, found: &mut Vec<Complex<f64>>) {
    let made = if steps.is_some() { Vec::new() } else { grid(f, re) };
    for w in starts(steps.unwrap_or(&made)) {
        if let Ok(z) = zero_near(f, Complex::new(re, w))
            && z.re > line.abscissa
            && is_new(found, z)
            && !is_next_to_a_pole(f, z, line.abscissa)
        {
            insert(found, z);
        }
    }
}

/// The rightmost zero, if one lies right of `left`. `guess` is an approximation of it, as the rightmost zero of a similar
/// function is.
///
/// # Errors
/// Those of a count, zeros that are not found, or too much work.
pub(super) fn rightmost(
    f: &dyn Analytic,
    left: f64,
    guess: Option<Complex<f64>>,
) -> Result<Option<Complex<f64>>, StabilityError> {
    limited(f, |f| {
        if let Some(z) = guess.and_then(|z| zero_near(f, z).ok())
            && z.re > left
            && matches!(count_right_of(f, z.re + threshold(f)), Ok(0))
        {
            return Ok(Some(Complex::new(z.re, z.im.abs())));
        }
        let Some((mut line, mut clear)) = first_line(f, left)? else { return Ok(None) };
        // The line moves right until few zeros are left, which Newton's method finds from the line.
        while clear - line.abscissa > threshold(f) {
            if line.number <= FEW {
                let mut found = near_line(f, &line);
                if multiplicity(&found) == line.number {
                    found.sort_by(|a, b| b.re.total_cmp(&a.re));
                    return Ok(found.first().copied());
                }
            }
            let places = CUTS.map(|share| line.abscissa + share * (clear - line.abscissa));
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
/// The number of zeros increases towards the left as exp(|Re λ| d), d the longest delay, and without bound next to the
/// essential spectrum. The lines therefore begin at the axis and approach `left` in short strides. If `left` lies right of
/// the axis, each line halves the distance between `left` and the bound of the zeros.
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

/// Smallest real part of an unstable zero, 1/s.
pub(super) fn threshold(f: &dyn Analytic) -> f64 {
    1e-6 * f.scales().slowest_rate()
}

/// Adds a root or its conjugate, whichever has Im λ ≥ 0, unless it is known.
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

/// Finds the zeros in a rectangle between two corners. It is divided until each part contains one zero, which Newton's method
/// finds from the centre. `known` is the number of zeros, if that is known.
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
        && let Ok(z) = zero_near(f, 0.5 * (low + high))
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
    for share in CUTS {
        let (first_high, second_low) = (cut(high, share), cut(low, share));
        let Some(first) = count_within(f, low, first_high) else { continue };
        if first <= number {
            isolate(f, (low, first_high), Some(first), depth + 1, found)?;
            return isolate(f, (second_low, high), Some(number - first), depth + 1, found);
        }
    }
    Err(error)
}

/// The lengths of the steps of Newton's method at points of a line, denser towards the real axis.
fn grid(f: &dyn Analytic, re: f64) -> Vec<(f64, f64)> {
    let top = f.scales().bound(re);
    let points = (0..=GRID).map(|i| top * (i as f64 / GRID as f64).powi(2));
    points.map(|w| (w, step_at(f, Complex::new(re, w)).norm())).collect()
}

/// Places at which the steps along a line are shortest.
fn starts(steps: &[(f64, f64)]) -> impl Iterator<Item = f64> {
    let at = |i: usize| steps.get(i).map_or(f64::INFINITY, |(_, step)| *step);
    let shortest = move |i: &usize| at(*i).is_finite() && at(*i) <= at(i.wrapping_sub(1)) && at(*i) <= at(i + 1);
    (0..steps.len()).filter(shortest).map(|i| steps[i].0)
}

/// Whether a zero of a quotient is cancelled by a pole next to it that lies right of the line, too. Poles left of the line do
/// not enter the count.
fn is_next_to_a_pole(f: &dyn Analytic, z: Complex<f64>, abscissa: f64) -> bool {
    f.divisors().into_iter().any(|divisor| {
        // There is no pole near if the first step is long.
        if step_at(divisor, z).norm() > z.norm() {
            return false;
        }
        let Ok(pole) = zero_near(divisor, z) else { return false };
        let distance = (pole - z).norm();
        // A rectangle around both; equal numbers of zeros and poles are no root.
        let reach = (3.0 * distance).max(1e-6 * z.norm());
        let corner = Complex::new(reach, 1.1 * reach);
        distance < NEIGHBOUR * z.norm() && pole.re > abscissa && count_within(f, z - corner, z + corner) == Some(0)
    })
}
