//! The boundary of stability in two parameters, by continuation.

use nalgebra::{Complex, Vector2};

use super::characteristic::Part;
use super::{Linearisation, StabilityError};
use crate::error::ParameterError;

/// A point of a boundary: a root iω on the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// The two parameters.
    pub parameters: [f64; 2],
    /// The angular frequency, 1/s.
    pub frequency: f64,
}

/// Follows the crossing of the axis from `start` through the rectangle between `low` and `high`, for at most `points`
/// points, in steps of `step` of the rectangle's sides, around folds too. `direction` says which way to set out: the
/// parameters' change in fractions of the sides. `family` makes the shoot of two parameters' values stationary and
/// linearises it; `start` is a point on the curve, as found by [`onset`](super::onset()) or
/// [`crossings`](super::crossings()) in one of the parameters, or near it: on another mesh, say. The curve begins with
/// the point next to it.
///
/// The root that is on the axis at the start is followed, whether others are further right or not: only the lowest of all
/// these curves is the boundary of stability. It ends on the rectangle's side, when it comes back to its start, or where the
/// shoot buckles.
///
/// # Errors
/// What `family` reports, or a root that is lost at the smallest step.
pub fn boundary(
    mut family: impl FnMut(f64, f64) -> Result<Linearisation, StabilityError>,
    start: BoundaryPoint,
    direction: [f64; 2],
    [low, high]: [[f64; 2]; 2],
    step: f64,
    points: usize,
) -> Result<Vec<BoundaryPoint>, StabilityError> {
    ParameterError::positive("step of the continuation", step)?;
    let sides = Vector2::new(high[0] - low[0], high[1] - low[1]);
    ParameterError::positive("width of the rectangle", sides[0])?;
    ParameterError::positive("height of the rectangle", sides[1])?;
    let mut tangent = Vector2::from(direction);
    ParameterError::positive("length of the direction", tangent.norm())?;
    for k in 0..2 {
        let inside = (low[k]..=high[k]).contains(&start.parameters[k]);
        ParameterError::unless(inside, "start of the boundary", start.parameters[k], "inside the rectangle")?;
    }
    let linear = family(start.parameters[0], start.parameters[1])?;
    let (part, root) = on_axis(&linear, start.frequency)?;
    let rate = root.im.abs().max(1e-3 * linear.slowest_rate());
    // The root in fractions of the first frequency, at parameters in fractions of the sides.
    let mut track = |x: &Vector2<f64>, guess: Complex<f64>| {
        let linear = family(low[0] + sides[0] * x[0], low[1] + sides[1] * x[1])?;
        let root = linear.polish(guess * rate, part)? / rate;
        // A root that jumps is another one.
        let jump = (root - guess).norm();
        let lost = StabilityError::NoConvergence { what: "boundary of stability (its root is lost)", residual: jump };
        if jump < JUMP * guess.norm().max(1.0) { Ok(root) } else { Err(lost) }
    };
    let first =
        Place { x: (Vector2::from(start.parameters) - Vector2::from(low)).component_div(&sides), root: root / rate };
    let slope = differences(&mut track, &first)?;
    let (first, slope) = correct(&mut track, first, slope)?;
    let mut curve = vec![first];
    let mut gradient = Some(slope);
    let mut size = step;
    while curve.len() < points {
        let here = curve[curve.len() - 1];
        // The gradient of the root: by differences at first and after a failure, then kept up to date by what is
        // computed anyway.
        let fresh = gradient.is_none();
        let slope: Gradient = match gradient {
            Some(slope) => slope,
            None => differences(&mut track, &here)?,
        };
        let across = slope.map(|z| z.re);
        if !(across.norm() > 0.0) {
            return Err(StabilityError::NoConvergence { what: "direction of the boundary", residual: across.norm() });
        }
        let mut along = Vector2::new(-across[1], across[0]).normalize();
        if along.dot(&tangent) < 0.0 {
            along = -along;
        }
        match correct(&mut track, extrapolate(&curve, along, size), slope) {
            Ok((next, slope)) if (next.x - here.x).norm() < 2.0 * size => {
                tangent = (next.x - here.x).normalize();
                gradient = Some(slope);
                curve.push(next);
                size = (1.5 * size).min(step);
            }
            outcome => {
                gradient = None;
                if fresh {
                    size *= 0.5;
                }
                if size < 1e-4 * step {
                    match outcome {
                        // The curve runs into buckling, where no shoot is upright.
                        Err(StabilityError::MechanicallyUnstable { .. }) => break,
                        Err(error) => return Err(error),
                        Ok((next, _)) => {
                            let residual = (next.x - here.x).norm();
                            return Err(StabilityError::NoConvergence { what: "boundary of stability", residual });
                        }
                    }
                }
                continue;
            }
        }
        let last = curve[curve.len() - 1];
        if let Some((k, side)) = leaves(&here.x, &last.x) {
            curve.pop();
            if let Ok(end) = end_on_side(&mut track, here, last, k, side) {
                curve.push(end);
            }
            break;
        }
        // Back at the start: one of the points next to it is within half a step.
        if curve.len() > 8 && (last.x - curve[0].x).norm() < 0.6 * (last.x - here.x).norm() {
            break;
        }
    }
    let point = |place: &Place| {
        let parameters = [0, 1].map(|k| low[k] + sides[k] * place.x[k]);
        BoundaryPoint { parameters, frequency: rate * place.root.im.abs() }
    };
    Ok(curve.iter().map(point).collect())
}

/// A root may move by this share of itself, or of the first one, from where it is expected.
const JUMP: f64 = 0.1;
/// Step of the differences, in fractions of the sides: rounding of the root is 1e-12 of it, and two digits of the slope do.
const DIFFERENCE: f64 = 1e-6;
/// How close to the curve a point is, in fractions of the sides.
const CLOSE: f64 = 1e-9;

/// A point of the curve, parameters in fractions of the rectangle's sides and the root in fractions of the first.
#[derive(Debug, Clone, Copy)]
struct Place {
    x: Vector2<f64>,
    root: Complex<f64>,
}

/// The derivatives of the root by the two parameters.
type Gradient = Vector2<Complex<f64>>;

/// The next point by the polynomial through the last ones, at most four, in chord length; the tangent if there is but one.
fn extrapolate(curve: &[Place], along: Vector2<f64>, size: f64) -> Place {
    let last = &curve[curve.len().saturating_sub(4)..];
    if let [only] = last {
        return Place { x: only.x + along * size, root: only.root };
    }
    let mut at = vec![0.0];
    for pair in last.windows(2) {
        at.push(at[at.len() - 1] + (pair[1].x - pair[0].x).norm());
    }
    let next = at[at.len() - 1] + size;
    let mut sum = Place { x: Vector2::zeros(), root: Complex::ZERO };
    for (i, place) in last.iter().enumerate() {
        let others = (0..last.len()).filter(|&j| j != i);
        let weight: f64 = others.map(|j| (next - at[j]) / (at[i] - at[j])).product();
        sum.x += place.x * weight;
        sum.root += place.root * weight;
    }
    sum
}

/// The gradient of the root at a place, by differences.
fn differences(
    track: &mut impl FnMut(&Vector2<f64>, Complex<f64>) -> Result<Complex<f64>, StabilityError>,
    at: &Place,
) -> Result<Gradient, StabilityError> {
    let mut slope = Gradient::zeros();
    for k in 0..2 {
        let mut moved = at.x;
        moved[k] += DIFFERENCE;
        slope[k] = (track(&moved, at.root)? - at.root) / DIFFERENCE;
    }
    Ok(slope)
}

/// Brings a point to the curve across it; also the gradient of the root, mended by what was found on the way (Broyden).
fn correct(
    track: &mut impl FnMut(&Vector2<f64>, Complex<f64>) -> Result<Complex<f64>, StabilityError>,
    from: Place,
    mut slope: Gradient,
) -> Result<(Place, Gradient), StabilityError> {
    let mut at = Place { x: from.x, root: track(&from.x, from.root)? };
    let mut last = f64::INFINITY;
    for _ in 0..8 {
        let across = slope.map(|z| z.re);
        let step = -across * (at.root.re / across.norm_squared());
        let size = step.norm();
        let expected = at.root + slope.dot(&step.map(Complex::from));
        // What a step leaves is as much smaller as it is smaller than the one before.
        let left = if last.is_finite() { size * (size / last) } else { size };
        if left < CLOSE {
            return Ok((Place { x: at.x + step, root: Complex::new(0.0, expected.im) }, slope));
        }
        if !(size < 0.5 * last) {
            break;
        }
        let next = at.x + step;
        let root = track(&next, expected)?;
        slope += step.map(Complex::from) * ((root - expected) / step.norm_squared());
        at = Place { x: next, root };
        last = size;
    }
    Err(StabilityError::NoConvergence { what: "boundary of stability", residual: last })
}

/// The side of the unit square that a segment from the inside crosses first: the coordinate and its value.
fn leaves(from: &Vector2<f64>, to: &Vector2<f64>) -> Option<(usize, f64)> {
    let crossing = |k: usize, side: f64| (side - from[k]) / (to[k] - from[k]);
    let outside = (0..2).filter_map(|k| match to[k] {
        x if x < 0.0 => Some((k, 0.0)),
        x if x > 1.0 => Some((k, 1.0)),
        _ => None,
    });
    outside.min_by(|a, b| crossing(a.0, a.1).total_cmp(&crossing(b.0, b.1)))
}

/// The point of the curve on a side, by the secant along it.
fn end_on_side(
    track: &mut impl FnMut(&Vector2<f64>, Complex<f64>) -> Result<Complex<f64>, StabilityError>,
    inside: Place,
    outside: Place,
    k: usize,
    side: f64,
) -> Result<Place, StabilityError> {
    let share = (side - inside.x[k]) / (outside.x[k] - inside.x[k]);
    let mut x = inside.x + (outside.x - inside.x) * share;
    let mut root = inside.root + (outside.root - inside.root) * share;
    x[k] = side;
    let mut before: Option<(f64, f64)> = None;
    for _ in 0..12 {
        root = track(&x, root)?;
        let step = match before {
            None => DIFFERENCE,
            Some((y, re)) => -root.re * (x[1 - k] - y) / (root.re - re),
        };
        before = Some((x[1 - k], root.re));
        x[1 - k] += step;
        if step.abs() < CLOSE {
            return Ok(Place { x, root: Complex::new(0.0, root.im) });
        }
    }
    Err(StabilityError::NoConvergence { what: "end of the boundary", residual: root.re })
}

/// The part of the spectrum with a root next to a frequency on the axis, and the root.
fn on_axis(linear: &Linearisation, frequency: f64) -> Result<(Part, Complex<f64>), StabilityError> {
    let start = Complex::new(0.0, frequency);
    let roots = linear.parts().filter_map(|part| Some((part, linear.polish(start, part).ok()?)));
    let nearest = roots.min_by(|a, b| (a.1 - start).norm().total_cmp(&(b.1 - start).norm()));
    match nearest {
        Some((part, root)) if (root - start).norm() < JUMP * frequency.max(linear.slowest_rate()) => Ok((part, root)),
        other => Err(StabilityError::NoConvergence {
            what: "start of the boundary (its root is off the axis)",
            residual: other.map_or(f64::NAN, |(_, root)| root.re),
        }),
    }
}
