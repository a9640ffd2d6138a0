//! The boundary of stability in two parameters, by continuation.

use nalgebra::{Complex, Vector2};

use super::crossing::Crossing;
use super::follow::{Follower, LinearFamily};
use super::mesh_error::{ACCURACY, size};
use crate::error::{ParameterError, ensure};
use crate::linearisation::{Outcome, StabilityError};
use crate::numerics::interpolation::lagrange;
use crate::stability::spectrum::Linearisation;

/// Start, direction, region and step of the continuation of a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundarySettings {
    /// Parameters of a point on the curve, as found by [`onset`](super::onset()) or
    /// [`crossings`](super::crossings()) in one of them, or of a point near the curve, such as that
    /// of another mesh. It must lie inside the rectangle.
    pub start: [f64; 2],
    /// Angular frequency ω of the root iω at the start, rad/s; zero for a root λ = 0. The root
    /// nearest to iω is followed.
    pub frequency: f64,
    /// Initial direction: a change of the parameters, in fractions of the rectangle's sides, of any
    /// length.
    pub direction: [f64; 2],
    /// Least values of the parameters: a corner of the rectangle, outside which the curve is not
    /// followed.
    pub low: [f64; 2],
    /// Largest values of the parameters.
    pub high: [f64; 2],
    /// Largest distance of neighbouring points, in fractions of the rectangle's sides; positive and
    /// at most 1. It is halved where a point is not found.
    pub step: f64,
    /// Largest number of points. The first point is always returned.
    pub points: usize,
}

impl BoundarySettings {
    fn check(&self) -> Result<(), ParameterError> {
        let ok = self.step > 0.0 && self.step <= 1.0;
        ParameterError::unless(
            ok,
            "step of the continuation",
            self.step,
            "positive and at most 1",
        )?;
        let sides = self.sides();
        ParameterError::positive("width of the rectangle", sides[0], "")?;
        ParameterError::positive("height of the rectangle", sides[1], "")?;
        ParameterError::positive(
            "length of the direction",
            Vector2::from(self.direction).norm(),
            "",
        )?;
        ParameterError::not_negative("frequency of the start", self.frequency, "rad/s")?;
        for (k, &parameter) in self.start.iter().enumerate() {
            let inside = (self.low[k]..=self.high[k]).contains(&parameter);
            ParameterError::unless(
                inside,
                "start of the boundary",
                parameter,
                "inside the rectangle",
            )?;
        }
        Ok(())
    }

    fn sides(&self) -> Vector2<f64> {
        Vector2::from(self.high) - Vector2::from(self.low)
    }

    /// Parameters from fractions of the sides.
    pub(super) fn parameters(&self, at: &Vector2<f64>) -> [f64; 2] {
        (Vector2::from(self.low) + self.sides().component_mul(at)).into()
    }

    /// Sizes to which errors of the parameters at a place are relative, in fractions of the sides:
    /// the parameters, or the larger end of a side that contains zero.
    pub(super) fn sizes(&self, place: &Follower<2>) -> Vector2<f64> {
        let at = self.parameters(&place.at);
        let sizes = [0, 1].map(|k| size(at[k], self.low[k], self.high[k]));
        Vector2::from(sizes).component_div(&self.sides())
    }

    pub(super) fn point(&self, place: Follower<2>) -> Crossing<2> {
        Crossing::new(place, self.low.into(), self.sides())
    }
}

/// Follows a crossing of the axis from a start through a rectangle of two parameters, also around
/// folds. `family` returns the linearisation about the steady state at values of the two
/// parameters. The curve begins with the point next to the start.
///
/// The root that is on the axis at the start is followed, even if others are further right: only
/// the lowest of all these curves is the boundary of stability. The curve ends on a side of the
/// rectangle, at its start if it is closed, or where the shoot buckles.
///
/// # Errors
/// Settings out of range, errors of `family`, or a root that is lost at the smallest step.
pub fn boundary(
    mut family: impl FnMut(f64, f64) -> Result<Linearisation, StabilityError>,
    settings: &BoundarySettings,
) -> Result<Vec<Crossing<2>>, StabilityError> {
    let mut at = |x: &Vector2<f64>| {
        let [first, second] = settings.parameters(x);
        family(first, second)
    };
    Ok(places(&mut at, settings)?
        .into_iter()
        .map(|place| settings.point(place))
        .collect())
}

/// The points of a boundary. Their parameters, and those of the family, are measured from the lower
/// corner in fractions of the rectangle's sides.
pub(super) fn places(
    family: &mut LinearFamily<2>,
    settings: &BoundarySettings,
) -> Outcome<Vec<Follower<2>>> {
    settings.check()?;
    let from = (Vector2::from(settings.start) - Vector2::from(settings.low))
        .component_div(&settings.sides());
    let mut start = Follower::on_axis(&family(&from)?, from, settings.frequency)?;
    start.differentiate(family)?;
    start.correct(&Vector2::repeat(1.0), ACCURACY, family)?;
    let forwards = tangent(&start, 1.0)?.dot(&Vector2::from(settings.direction)) >= 0.0;
    let side = if forwards { 1.0 } else { -1.0 };
    let mut curve = Curve {
        family,
        places: vec![start],
        side,
        largest: settings.step,
        step: settings.step,
    };
    while curve.places.len() < settings.points {
        match curve.extend() {
            Ok(true) => {}
            // The curve has ended, or the shoot buckles at the next point.
            Ok(false) | Err(StabilityError::MechanicallyUnstable { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(curve.places)
}

/// A curve, with parameters in fractions of the rectangle's sides.
struct Curve<'a, 'b> {
    family: &'a mut LinearFamily<'b, 2>,
    /// Its points, at least one.
    places: Vec<Follower<2>>,
    /// The side on which the growth rate increases: 1 if it lies to the right of the direction in
    /// which the curve is followed, −1 if it lies to the left. It is the same along the whole
    /// curve.
    side: f64,
    /// The largest distance of neighbouring points.
    largest: f64,
    /// The present distance of neighbouring points.
    step: f64,
}

impl Curve<'_, '_> {
    /// Adds a point. Returns false if it is the last one.
    fn extend(&mut self) -> Outcome<bool> {
        let mut here = self.places[self.places.len() - 1];
        // The derivatives are corrected in every step, and computed by differences after a failure.
        let mut fresh = false;
        let next = loop {
            match self.attempt(&here) {
                Ok(next) => break next,
                Err(error) if fresh => {
                    self.step *= 0.5;
                    ensure(self.step >= 1e-4 * self.largest, error)?;
                }
                Err(_) => {
                    let mut beside = here;
                    beside.differentiate(self.family)?;
                    here.slope = beside.slope;
                    fresh = true;
                }
            }
        };
        self.step = (1.5 * self.step).min(self.largest);
        let moved = next.at - here.at;
        if let Some((k, side)) = leaves(&here.at, &next.at) {
            let end = self.end_on_side(&here, &next, k, side);
            self.places.extend(end.ok());
            return Ok(false);
        }
        // The curve is closed if this step passes its start in the direction in which the curve has
        // left it.
        let start = self.places[0].at - here.at;
        let along = start.dot(&moved) / moved.norm_squared();
        let passes =
            along > 0.0 && along <= 1.0 && (start - moved * along).norm() < 0.5 * moved.norm();
        let closed = self.places.len() > 2
            && passes
            && moved.dot(&tangent(&self.places[0], self.side)?) > 0.0;
        self.places.push(next);
        Ok(!closed)
    }

    /// The next point at the present distance.
    ///
    /// # Errors
    /// Errors of the family, or a point that is not ahead on the curve.
    fn attempt(&mut self, here: &Follower<2>) -> Outcome<Follower<2>> {
        let along = tangent(here, self.side)?;
        let (to, expected) = self.extrapolate(along);
        let mut next = *here;
        next.advance(to, expected, &(self.family)(&to)?)?;
        next.correct(&Vector2::repeat(1.0), ACCURACY, self.family)?;
        let moved = next.at - here.at;
        let length = moved.norm();
        // The angle between the step and the tangent at either end is at most 60°. It is larger
        // than 90° if the step crosses a sharp end of the curve. Along a circle, steps of a third
        // of the circumference have 60°.
        let ahead = along
            .dot(&moved)
            .min(tangent(&next, self.side)?.dot(&moved))
            >= 0.5 * length;
        let far = StabilityError::NoConvergence {
            what: "boundary of stability",
            residual: length,
        };
        if ahead && length < 2.0 * self.step {
            Ok(next)
        } else {
            Err(far)
        }
    }

    /// The next point by the polynomial through the last four points in chord length, or by the
    /// tangent if there is only one point.
    fn extrapolate(&self, along: Vector2<f64>) -> (Vector2<f64>, Complex<f64>) {
        let last = &self.places[self.places.len().saturating_sub(4)..];
        if let [only] = last {
            return (only.at + along * self.step, only.root);
        }
        let mut chords = vec![0.0];
        for pair in last.windows(2) {
            chords.push(chords[chords.len() - 1] + (pair[1].at - pair[0].at).norm());
        }
        let weights: [f64; 4] = lagrange(&chords, chords[chords.len() - 1] + self.step);
        let weighted = || last.iter().zip(weights);
        let at = weighted().map(|(place, weight)| place.at * weight).sum();
        let root = weighted().map(|(place, weight)| place.root * weight).sum();
        (at, root)
    }

    /// The point between two others at which a coordinate has the value of a side.
    fn end_on_side(
        &mut self,
        inside: &Follower<2>,
        outside: &Follower<2>,
        k: usize,
        side: f64,
    ) -> Outcome<Follower<2>> {
        let share = (side - inside.at[k]) / (outside.at[k] - inside.at[k]);
        let mut to = inside.at + (outside.at - inside.at) * share;
        to[k] = side;
        let mut end = *outside;
        end.advance(
            to,
            inside.root + (outside.root - inside.root) * share,
            &(self.family)(&to)?,
        )?;
        end.correct(&Vector2::ith(1 - k, 1.0), ACCURACY, self.family)?;
        Ok(end)
    }
}

/// The unit tangent of the curve at a point: the gradient of the growth rate, rotated by a right
/// angle to the left for the side 1, and to the right for the side −1.
fn tangent(place: &Follower<2>, side: f64) -> Outcome<Vector2<f64>> {
    let across = place.slope.map(|z| z.re);
    let what = "direction of the boundary";
    let undefined = StabilityError::NoConvergence {
        what,
        residual: across.norm(),
    };
    (Vector2::new(-across[1], across[0]) * side)
        .try_normalize(0.0)
        .ok_or(undefined)
}

/// The side of the unit square that a segment from the inside crosses first: the coordinate and its
/// value.
fn leaves(from: &Vector2<f64>, to: &Vector2<f64>) -> Option<(usize, f64)> {
    let crossing = |k: usize, side: f64| (side - from[k]) / (to[k] - from[k]);
    let outside = (0..2)
        .map(|k| (k, to[k].clamp(0.0, 1.0)))
        .filter(|&(k, side)| to[k] != side);
    outside.min_by(|a, b| crossing(a.0, a.1).total_cmp(&crossing(b.0, b.1)))
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::stability::continuation::follow::samples::{circle, is_lost, with_root};

    /// Parameters in [−2, 2]², from (1, 0) upwards.
    fn settings(step: f64) -> BoundarySettings {
        BoundarySettings {
            start: [1.0, 0.0],
            frequency: 2.5,
            direction: [0.0, 1.0],
            low: [-2.0; 2],
            high: [2.0; 2],
            step,
            points: 400,
        }
    }

    /// Distances of neighbouring points, in fractions of the rectangle's sides.
    fn distances(points: &[Crossing<2>]) -> Vec<f64> {
        let place = |point: &Crossing<2>| Vector2::from(point.parameters) / 4.0;
        points
            .windows(2)
            .map(|pair| (place(&pair[1]) - place(&pair[0])).norm())
            .collect()
    }

    #[test]
    fn a_boundary_is_followed_along_a_circle_back_to_its_start() {
        let points = boundary(|p, q| Ok(with_root(circle([p, q]))), &settings(0.05)).unwrap();
        for point in &points {
            let [p, q] = point.parameters;
            // Points are corrected to 1e-9 of a side of four.
            assert_abs_diff_eq!(p.hypot(q), 1.0, epsilon = 4e-9);
            assert_abs_diff_eq!(point.frequency, 2.0 + 0.5 * p, epsilon = 4e-9);
        }
        // The circumference is π/2 in units of the sides: 32 steps of 0.05 pass the start.
        assert!((32..=34).contains(&points.len()), "{}", points.len());
        let (first, last) = (&points[0].parameters, &points[points.len() - 1].parameters);
        assert!(
            (Vector2::from(*last) - Vector2::from(*first)).norm() < 0.2,
            "{last:?}"
        );
        assert!(
            distances(&points)
                .iter()
                .all(|distance| (0.04..0.06).contains(distance))
        );
    }

    #[test]
    fn the_step_along_a_boundary_is_halved_where_its_curvature_is_large() {
        // An ellipse with semi-axes of 1/4 and 1/16 of the sides: its radius of curvature is 1/64
        // at the sharp ends.
        let ellipse = |p: f64, q: f64| Complex::new(p * p + 16.0 * q * q - 1.0, 2.0 + 0.5 * p);
        let points = boundary(|p, q| Ok(with_root(ellipse(p, q))), &settings(0.03)).unwrap();
        for pair in points.windows(2) {
            let [p, q] = pair[1].parameters;
            // Points are corrected to 1e-9 of a side of four, and the gradient is at most 8.
            assert_abs_diff_eq!(p * p + 16.0 * q * q, 1.0, epsilon = 32e-9);
            // The direction is never reversed.
            let [before, after] = [pair[0], pair[1]]
                .map(|point| (4.0 * point.parameters[1]).atan2(point.parameters[0]));
            assert!(
                (after - before).rem_euclid(std::f64::consts::TAU) < 0.7,
                "{pair:?}"
            );
        }
        let distances = distances(&points);
        let at_end = |k: &usize| points[*k].parameters[0] < -0.95;
        let shortest = (0..distances.len())
            .filter(at_end)
            .map(|k| distances[k])
            .fold(f64::INFINITY, f64::min);
        let longest = distances.iter().copied().fold(0.0, f64::max);
        assert!(shortest < 0.016 && longest > 0.029, "{shortest} {longest}");
        assert!(
            points.iter().any(|point| point.parameters[1] < -0.24),
            "the curve passes the sharp end"
        );
    }

    #[test]
    fn a_boundary_is_followed_around_a_sharp_end_without_reversal() {
        // An ellipse with semi-axes of 1/4 and 1/40 of the sides. Its radius of curvature is 1/400
        // at the sharp ends, one of which is the start.
        let ellipse = |p: f64, q: f64| Complex::new(p * p + 100.0 * q * q - 1.0, 2.0 + 0.5 * p);
        let angle = |point: &Crossing<2>| (10.0 * point.parameters[1]).atan2(point.parameters[0]);
        for direction in [[0.0, 1.0], [0.0, -1.0]] {
            let from = BoundarySettings {
                direction,
                ..settings(0.02)
            };
            let points = boundary(|p, q| Ok(with_root(ellipse(p, q))), &from).unwrap();
            let turns = points.windows(2).map(|pair| {
                let turn = direction[1] * (angle(&pair[1]) - angle(&pair[0]));
                if turn < -std::f64::consts::PI {
                    turn + std::f64::consts::TAU
                } else {
                    turn
                }
            });
            let turns: Vec<f64> = turns.collect();
            // The parametric angle increases in every step. A chord that makes angles of at most
            // 60° with the tangents at its ends spans less than a right angle of it.
            assert!(
                turns.iter().all(|turn| *turn > 0.0 && *turn < 1.6),
                "{direction:?}: {turns:?}"
            );
            // The last step passes the start, which is next to the first point.
            let sum: f64 = turns.iter().sum();
            let round = std::f64::consts::TAU;
            assert!(
                sum > round - 0.01 && sum < round + turns[turns.len() - 1],
                "{direction:?}: {sum}"
            );
        }
    }

    #[test]
    fn a_lost_root_is_an_error_and_buckling_the_end_of_a_boundary() {
        // The frequency of the root doubles at p = 1/2.
        let jump = |p: f64, q: f64| {
            let root = circle([p, q]);
            with_root(if p < 0.5 {
                Complex::new(root.re, 2.0 * root.im)
            } else {
                root
            })
        };
        assert!(is_lost(&boundary(|p, q| Ok(jump(p, q)), &settings(0.05))));
        let buckles = |p: f64, q: f64| {
            let buckled = StabilityError::MechanicallyUnstable { negative: 1 };
            if p < 0.5 {
                Err(buckled)
            } else {
                Ok(with_root(circle([p, q])))
            }
        };
        let points = boundary(buckles, &settings(0.05)).unwrap();
        let last = points[points.len() - 1].parameters[0];
        assert!(
            (0.5..0.7).contains(&last),
            "the last point lies before the end: {last}"
        );
    }

    #[test]
    fn a_boundary_ends_exactly_on_the_side_of_the_rectangle() {
        let low = [0.3, -2.0];
        let points = boundary(
            |p, q| Ok(with_root(circle([p, q]))),
            &BoundarySettings {
                low,
                ..settings(0.05)
            },
        )
        .unwrap();
        let [p, q] = points[points.len() - 1].parameters;
        assert_eq!(p, 0.3);
        assert_abs_diff_eq!(q, (1.0 - 0.09_f64).sqrt(), epsilon = 4e-9);
    }
}
