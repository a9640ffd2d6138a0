//! The boundary of stability in two parameters, by continuation.

use nalgebra::{Complex, Matrix3, Vector2, Vector3};

use super::count::Part;
use super::onset::leading;
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
/// linearises it; `start` must lie on the boundary, as found by [`onset`](super::onset()) in one of the parameters.
///
/// The curve ends where it leaves the rectangle or comes back to its start.
///
/// # Errors
/// What `family` reports, or a corrector that fails at the smallest step.
pub fn boundary(
    mut family: impl FnMut(f64, f64) -> Result<Linearisation, StabilityError>,
    start: [f64; 2],
    direction: [f64; 2],
    [low, high]: [[f64; 2]; 2],
    step: f64,
    points: usize,
) -> Result<Vec<BoundaryPoint>, StabilityError> {
    ParameterError::positive("step of the continuation", step)?;
    let sides = [high[0] - low[0], high[1] - low[1]];
    ParameterError::positive("width of the rectangle", sides[0])?;
    ParameterError::positive("height of the rectangle", sides[1])?;
    let linear = family(start[0], start[1])?;
    let (part, root) = leading_on_axis(&linear)?;
    let rate = root.im.abs().max(1e-3 * linear.slowest_rate());
    // Unknowns in fractions: of the sides, and of the first frequency.
    let unscale = |x: &Vector3<f64>| ([low[0] + sides[0] * x[0], low[1] + sides[1] * x[1]], rate * x[2]);
    // The Newton step of the root at iω is its distance from there: a residual with a scale of its own.
    let mut residual = |x: &Vector3<f64>| -> Result<(Vector2<f64>, Linearisation), StabilityError> {
        let ([p, q], w) = unscale(x);
        let linear = family(p, q)?;
        let distance = linear.newton_step(Complex::new(0.0, w), part) / rate;
        Ok((Vector2::new(distance.re, distance.im), linear))
    };
    let mut x = Vector3::new((start[0] - low[0]) / sides[0], (start[1] - low[1]) / sides[1], root.im.abs() / rate);
    let mut tangent = Vector3::new(direction[0], direction[1], 0.0);
    ParameterError::positive("length of the direction", tangent.norm())?;
    let mut curve = vec![BoundaryPoint { parameters: start, frequency: root.im.abs() }];
    let origin = x;
    let mut size = step;
    while curve.len() < points {
        // Rows of the Jacobian: the two residuals by the three unknowns, then the direction.
        let (r, _) = residual(&x)?;
        let mut jacobian = Matrix3::zeros();
        for k in 0..3 {
            let h = 1e-6;
            let mut moved = x;
            moved[k] += h;
            let slope = (residual(&moved)?.0 - r) / h;
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
        for _ in 0..12 {
            let Ok((r, _)) = residual(&next) else { break };
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

/// The part of the spectrum with a root on the axis.
fn leading_on_axis(linear: &Linearisation) -> Result<(Part, Complex<f64>), StabilityError> {
    let (part, root) = leading(linear)?;
    let off = root.re.abs() / linear.slowest_rate();
    if off < 1e-3 {
        Ok((part, root))
    } else {
        Err(StabilityError::NoConvergence {
            what: "start of the boundary (its root is off the axis)",
            residual: root.re,
        })
    }
}
