//! The boundary of stability to a tolerance: followed on a coarse mesh, and corrected on finer ones.

use nalgebra::{Complex, Vector2};

use super::boundary::{BoundaryPoint, BoundarySettings, DIFFERENCE, places};
use super::follow::Follower;
use super::mesh_error::{ROUNDING, check_finer};
use super::refine_crossings::Crossing;
use super::refinement::Refinement;
use crate::error::ParameterError;
use crate::stability::error::StabilityError;
use crate::stability::spectrum::Linearisation;

/// Number of points from one estimate of the error to the next. Between them the error is smooth: it changes with the
/// parameters, of which a curve of some hundred points covers the whole range.
const SAMPLES: usize = 16;

/// A point of a boundary with an estimate of the error due to its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RefinedPoint {
    /// The point.
    pub point: BoundaryPoint,
    /// Error of the parameters: the shortest vector to the curve, with lengths in fractions of the rectangle's sides, or of the
    /// parameters themselves if there is no rectangle.
    pub parameter_errors: [f64; 2],
    /// Error of the frequency, 1/s.
    pub frequency_error: f64,
    /// Number of elements of the growth zone.
    pub elements: usize,
}

impl BoundaryPoint {
    /// The point with an estimate of the error due to its mesh: the distance from the curve of `finer`, the same family on a
    /// finer mesh. It takes three linearisations of `family` and one of `finer`. Neither parameter may be zero.
    ///
    /// # Errors
    /// Errors of the families, a point that is not on the curve of `family`, a mesh that is not finer, or one without a root near
    /// that of the point.
    pub fn with_error(
        self,
        mut family: impl FnMut(f64, f64) -> Result<Linearisation, StabilityError>,
        finer: impl FnOnce(f64, f64) -> Result<Linearisation, StabilityError>,
    ) -> Result<RefinedPoint, StabilityError> {
        // In units of the parameters themselves.
        let [first, second] = self.parameters;
        for value in [first, second] {
            let ok = value != 0.0 && value.is_finite();
            ParameterError::unless(ok, "parameter of a point of a boundary", value, "finite, and not zero")?;
        }
        let here = Vector2::repeat(1.0);
        let on_curve = Follower::on_axis(&family(first, second)?, here, self.frequency)?;
        let mut beside = on_curve;
        beside.differentiate(DIFFERENCE, &mut |x| family(first * x[0], second * x[1]))?;
        let mut there = Follower { slope: beside.slope, ..on_curve };
        let linear = finer(first, second)?;
        check_finer(on_curve.elements, &linear)?;
        there.change_mesh(on_curve.root, &linear)?;
        // The step from the curve of one mesh to the curve of the other.
        let free = Vector2::repeat(1.0);
        let [from, to] = [Follower { slope: there.slope, ..on_curve }, there].map(|mut place| {
            let step = place.step_to_axis(&free);
            place.end_on_axis(&step);
            place
        });
        let way = to.at - from.at;
        let swing = (to.root.im.abs() - from.root.im.abs()).abs();
        Ok(RefinedPoint {
            point: self,
            parameter_errors: [0, 1].map(|k| way[k].abs().max(ROUNDING) * self.parameters[k].abs()),
            frequency_error: swing.max(ROUNDING * self.frequency),
            elements: on_curve.elements,
        })
    }
}

impl Refinement {
    /// As [`boundary`](super::boundary()), to the tolerance. The errors of each parameter and of the frequency are relative to
    /// their values, that of a parameter whose range contains zero to the larger end of the range. `family` takes the two
    /// parameters and the number of elements.
    ///
    /// The curve is followed on the first mesh on which this succeeds, which determines its ends and the distances of its points.
    /// At every sixteenth point the mesh is refined until the estimate meets the tolerance. The points between two of these are
    /// corrected on the finer mesh of both, and have the larger one of their errors.
    ///
    /// # Errors
    /// Those of [`boundary`](super::boundary()), a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn boundary(
        &self,
        mut family: impl FnMut(f64, f64, usize) -> Result<Linearisation, StabilityError>,
        settings: &BoundarySettings,
    ) -> Result<Vec<RefinedPoint>, StabilityError> {
        self.check()?;
        let (first, coarse) = self.converge(|n, _: Option<(usize, Vec<Follower<2>>)>| {
            // The error of this curve is not estimated, so that the first answer is taken.
            Ok(((n, places(|first, second| family(first, second, n), settings)?), Some(0.0)))
        })?;
        let refine = Self { first, ..*self };
        let mut at = |x: &Vector2<f64>, n: usize| {
            let [first, second] = settings.parameters(x);
            family(first, second, n)
        };
        let (mut last, mut mesh) = refine.sample(&coarse[0], settings, &mut at)?;
        let mut points = vec![refined_point(&last, settings)];
        for part in (0..coarse.len() - 1).step_by(SAMPLES) {
            let end = (part + SAMPLES).min(coarse.len() - 1);
            let (next, next_mesh) = refine.sample(&coarse[end], settings, &mut at)?;
            let (finer, error) = (mesh.max(next_mesh), last.error.larger(&next.error));
            // Changes from the coarse curve at the last two points.
            let mut changes = [Change::between(&coarse[part], &last.place); 2];
            for place in &coarse[part + 1..end] {
                let expected = changes[1].extrapolate(&changes[0]);
                let corrected = refine.correct(place, &expected, finer, settings, &mut at);
                // Next to buckling a point of the coarse curve may be beyond it on a finer mesh.
                let Some(corrected) = unless_buckled(corrected)? else { continue };
                changes = [changes[1], Change::between(place, &corrected)];
                points.push(refined_point(&Crossing { error, ..Crossing::new(corrected) }, settings));
            }
            points.push(refined_point(&next, settings));
            (last, mesh) = (next, next_mesh);
        }
        Ok(points)
    }

    /// A point of a coarse curve on the first mesh that meets the tolerance, and the number of elements of this mesh.
    fn sample(
        &self,
        place: &Follower<2>,
        settings: &BoundarySettings,
        family: &mut impl FnMut(&Vector2<f64>, usize) -> Result<Linearisation, StabilityError>,
    ) -> Result<(Crossing<2>, usize), StabilityError> {
        let sizes = settings.sizes(place);
        self.converge(|n, coarser: Option<(Crossing<2>, usize)>| {
            let (mut crossing, mesh) = coarser.unwrap_or((Crossing::new(*place), self.first));
            if n == self.first {
                return Ok(((crossing, mesh), None));
            }
            let before = crossing.place;
            let error = self.go_finer(&mut crossing, &free(place), &sizes, &mut |x| family(x, n))?;
            // The mesh before may be fine enough.
            if error.relative <= self.tolerance {
                return Ok(((Crossing { error, ..Crossing::new(before) }, mesh), Some(error.relative)));
            }
            let estimate = crossing.error.relative;
            Ok(((crossing, n), Some(estimate)))
        })
    }

    /// A point of a coarse curve on another mesh, with the expected change.
    fn correct(
        &self,
        place: &Follower<2>,
        expected: &Change,
        mesh: usize,
        settings: &BoundarySettings,
        family: &mut impl FnMut(&Vector2<f64>, usize) -> Result<Linearisation, StabilityError>,
    ) -> Result<Follower<2>, StabilityError> {
        let mut there = *place;
        if mesh == self.first {
            return Ok(there);
        }
        there.at += expected.parameters;
        there.change_mesh(place.root + expected.root, &family(&there.at, mesh)?)?;
        let (free, close) = (free(place), self.close(&settings.sizes(place)));
        let step = there.step_to_axis(&free);
        // The relative error of Broyden's derivatives is a tenth, and so is that of a step.
        if step.norm() * 0.1 < close {
            there.end_on_axis(&step);
        } else {
            there.correct(&free, close, &mut |x| family(x, mesh))?;
        }
        Ok(there)
    }
}

/// The change from a point on one curve to the corresponding point on another.
#[derive(Clone, Copy)]
struct Change {
    parameters: Vector2<f64>,
    root: Complex<f64>,
}

impl Change {
    fn between(from: &Follower<2>, to: &Follower<2>) -> Self {
        Self { parameters: to.at - from.at, root: to.root - from.root }
    }

    /// The next change by linear extrapolation from the one before and this one.
    fn extrapolate(&self, before: &Self) -> Self {
        Self { parameters: self.parameters * 2.0 - before.parameters, root: self.root * 2.0 - before.root }
    }
}

fn refined_point(crossing: &Crossing<2>, settings: &BoundarySettings) -> RefinedPoint {
    RefinedPoint {
        point: settings.point(&crossing.place),
        parameter_errors: crossing.error.parameters.component_mul(&settings.sides()).into(),
        frequency_error: crossing.error.frequency,
        elements: crossing.place.elements,
    }
}

/// The parameters that a correction may change: all except one on a side of the rectangle, where the curve ends.
fn free(place: &Follower<2>) -> Vector2<f64> {
    place.at.map(|x| if x == 0.0 || x == 1.0 { 0.0 } else { 1.0 })
}

/// None where the shoot buckles.
fn unless_buckled<T>(answer: Result<T, StabilityError>) -> Result<Option<T>, StabilityError> {
    match answer {
        Err(StabilityError::MechanicallyUnstable { .. }) => Ok(None),
        other => other.map(Some),
    }
}
