//! The boundary of stability in two parameters, by continuation.

use nalgebra::{Complex, Matrix3, Vector2, Vector3};

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
/// linearises it; `start` must lie on the curve, as found by [`onset`](super::onset()) or
/// [`crossings`](super::crossings()) in one of the parameters.
///
/// The root that is on the axis at the start is followed, whether others are further right or not: only the lowest of all
/// these curves is the boundary of stability. It ends where it leaves the rectangle or comes back to its start.
///
/// # Errors
/// What `family` reports, or a corrector that fails at the smallest step.
pub fn boundary(
    mut family: impl FnMut(f64, f64) -> Result<Linearisation, StabilityError>,
    start: BoundaryPoint,
    direction: [f64; 2],
    [low, high]: [[f64; 2]; 2],
    step: f64,
    points: usize,
) -> Result<Vec<BoundaryPoint>, StabilityError> {
    ParameterError::positive("step of the continuation", step)?;
    let sides = [high[0] - low[0], high[1] - low[1]];
    ParameterError::positive("width of the rectangle", sides[0])?;
    ParameterError::positive("height of the rectangle", sides[1])?;
    let linear = family(start.parameters[0], start.parameters[1])?;
    let (part, root) = on_axis(&linear, start.frequency)?;
    let rate = root.im.abs().max(1e-3 * linear.slowest_rate());
    let start = start.parameters;
    // Unknowns in fractions: of the sides, and of the first frequency.
    let unscale = |x: &Vector3<f64>| ([low[0] + sides[0] * x[0], low[1] + sides[1] * x[1]], rate * x[2]);
    // The Newton step of the root at iω is its distance from there: a residual with a scale of its own.
    let distance = |linear: &Linearisation, x: &Vector3<f64>| {
        let distance = linear.newton_step(Complex::new(0.0, rate * x[2]), part) / rate;
        Vector2::new(distance.re, distance.im)
    };
    let mut linearise = |x: &Vector3<f64>| {
        let ([p, q], _) = unscale(x);
        family(p, q)
    };
    let mut linear = linear;
    let mut x = Vector3::new((start[0] - low[0]) / sides[0], (start[1] - low[1]) / sides[1], root.im.abs() / rate);
    let mut tangent = Vector3::new(direction[0], direction[1], 0.0);
    ParameterError::positive("length of the direction", tangent.norm())?;
    let mut curve = vec![BoundaryPoint { parameters: start, frequency: root.im.abs() }];
    let origin = x;
    let mut size = step;
    while curve.len() < points {
        // Rows of the Jacobian: the two residuals by the three unknowns, then the direction.
        let r = distance(&linear, &x);
        let mut jacobian = Matrix3::zeros();
        for k in 0..3 {
            let h = 1e-6;
            let mut moved = x;
            moved[k] += h;
            // The frequency alone does not change the shoot.
            let there = if k < 2 { distance(&linearise(&moved)?, &moved) } else { distance(&linear, &moved) };
            let slope = (there - r) / h;
            jacobian[(0, k)] = slope[0];
            jacobian[(1, k)] = slope[1];
        }
        let rows = [jacobian.row(0).transpose(), jacobian.row(1).transpose()];
        let mut along = rows[0].cross(&rows[1]);
        let length = along.norm();
        if !(length > 0.0) {
            return Err(StabilityError::NoConvergence { what: "direction of the boundary", residual: length });
        }
        along /= length;
        if along.dot(&tangent) < 0.0 {
            along = -along;
        }
        jacobian.set_row(2, &along.transpose());
        let Some(inverse) = jacobian.try_inverse() else {
            return Err(StabilityError::NoConvergence { what: "direction of the boundary", residual: length });
        };
        // Corrector: chord iterations with the Jacobian of the step's start, in the plane across the direction.
        let mut last = f64::INFINITY;
        let mut next = x + along * size;
        let mut settled = false;
        let mut latest = None;
        for _ in 0..12 {
            let Ok(there) = linearise(&next) else { break };
            let r = distance(&there, &next);
            latest = Some(there);
            let correction = inverse * Vector3::new(r[0], r[1], 0.0);
            next -= correction;
            last = correction.norm();
            if last < 1e-9 {
                settled = true;
                break;
            }
            if !(last < 2.0 * size) {
                break;
            }
        }
        if !settled {
            size *= 0.5;
            if size < 1e-4 * step {
                return Err(StabilityError::NoConvergence { what: "boundary of stability", residual: last });
            }
            continue;
        }
        if let Some(there) = latest {
            linear = there;
        }
        tangent = (next - x).normalize();
        x = next;
        size = (1.5 * size).min(step);
        let (parameters, frequency) = unscale(&x);
        let inside = (0..2).all(|k| parameters[k] >= low[k] && parameters[k] <= high[k]);
        if !inside {
            break;
        }
        curve.push(BoundaryPoint { parameters, frequency });
        if curve.len() > 8 && (x - origin).norm() < 0.5 * step {
            break;
        }
    }
    Ok(curve)
}

/// The part of the spectrum with a root on the axis at a frequency, and the root.
fn on_axis(linear: &Linearisation, frequency: f64) -> Result<(Part, Complex<f64>), StabilityError> {
    let start = Complex::new(0.0, frequency);
    let essential = (0..linear.local_blocks.len()).map(Part::Essential);
    let blocks = linear.distinct_blocks().into_iter().map(|(block, _)| Part::Block(block));
    let roots = essential.chain(blocks).filter_map(|part| Some((part, linear.polish(start, part).ok()?)));
    let nearest = roots.min_by(|a, b| (a.1 - start).norm().total_cmp(&(b.1 - start).norm()));
    match nearest {
        Some((part, root)) if (root - start).norm() < 1e-3 * linear.slowest_rate() => Ok((part, root)),
        other => Err(StabilityError::NoConvergence {
            what: "start of the boundary (its root is off the axis)",
            residual: other.map_or(f64::NAN, |(_, root)| root.re),
        }),
    }
}
