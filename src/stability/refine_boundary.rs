//! The boundary of stability to a tolerance: followed on a coarse mesh, corrected on meshes that are fine enough.

use std::cell::Cell;

use nalgebra::{Complex, Vector2};

use super::boundary::{BoundaryPoint, BoundarySettings, DIFFERENCE, places};
use super::error::StabilityError;
use super::follow::Follower;
use super::linearisation::Linearisation;
use super::mesh_error::{Convergence, ROUNDING, check_finer};
use super::refine::{MeshError, Reached, Refinement};
use crate::error::ParameterError;

/// At every so many points the error is estimated; in between it is smooth.
const SAMPLES: usize = 16;
/// Broyden's derivatives are good to a tenth: a step leaves less than this share of itself.
const SLOPE: f64 = 0.1;

/// A point of a boundary with the error that its mesh makes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RefinedPoint {
    /// The point.
    pub point: BoundaryPoint,
    /// By how much the mesh puts the parameters off, estimated: the shortest way to the curve, where lengths are measured
    /// in fractions of the rectangle's sides, or of the parameters themselves if there is none.
    pub parameter_errors: [f64; 2],
    /// The same for the frequency, 1/s.
    pub frequency_error: f64,
    /// Elements of the growth zone on the mesh that it was found on.
    pub elements: usize,
}

impl BoundaryPoint {
    /// The same with the error of the mesh, estimated: the way to where `finer`, the same family on a finer mesh, has the
    /// curve. That takes three linear problems of `family` and one of `finer`. Neither parameter may be zero.
    ///
    /// # Errors
    /// What the families report, a point that is not on the curve of `family`, a mesh that is no finer, or one on which the
    /// root is not next to where it was.
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
        // From where the curve is on the one mesh to where it is on the other.
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

/// A boundary on meshes that are fine enough.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefinedBoundary {
    /// Its points, in order.
    pub points: Vec<RefinedPoint>,
    /// Linearisations that it took.
    pub linearisations: usize,
}

/// A point on a mesh of so many elements that is fine enough, with its error there.
struct Checked {
    place: Follower<2>,
    error: MeshError<2>,
    mesh: usize,
}

impl Refinement {
    /// As [`boundary`](super::boundary()), to the tolerance, which each parameter and the frequency meet, relative to
    /// themselves; a parameter whose range holds zero relative to the larger end of that. `family` takes the two parameters
    /// and the number of elements.
    ///
    /// The curve is followed on the first mesh on which that succeeds, and has its ends and the distance of its points from
    /// there. At every sixteenth point meshes are refined until the estimate meets the tolerance; the points in between are
    /// corrected on the finer mesh of these two, and have the larger one of their errors.
    ///
    /// # Errors
    /// Those of [`boundary`](super::boundary()), a tolerance that is not positive or below 1e-9, or
    /// [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn boundary(
        &self,
        mut family: impl FnMut(f64, f64, usize) -> Result<Linearisation, StabilityError>,
        settings: &BoundarySettings,
    ) -> Result<RefinedBoundary, StabilityError> {
        self.check()?;
        let count = Cell::new(0);
        let mut at = |first: f64, second: f64, n: usize| {
            count.set(count.get() + 1);
            family(first, second, n)
        };
        let (mut found, mut reached) = (None, Reached::default());
        for n in self.meshes() {
            let places = places(|first, second| at(first, second, n), settings);
            found = reached.unless_lost(places)?.map(|places| (n, places));
            if found.is_some() {
                break;
            }
        }
        let (first, coarse) = found.ok_or_else(|| reached.not_met(self.tolerance))?;
        let refine = Self { first, ..*self };
        let mut at = |x: &Vector2<f64>, n: usize| {
            let [first, second] = settings.parameters(x);
            at(first, second, n)
        };
        let mut last = refine.sample(&coarse[0], settings, &mut at)?;
        let mut points = vec![last.point(settings)];
        for part in (0..coarse.len() - 1).step_by(SAMPLES) {
            let end = (part + SAMPLES).min(coarse.len() - 1);
            let next = refine.sample(&coarse[end], settings, &mut at)?;
            let (mesh, error) = (last.mesh.max(next.mesh), last.error.larger(&next.error));
            // How far the curve is from the coarse one at the last two points.
            let mut way = [Way::between(&coarse[part], &last.place); 2];
            for place in &coarse[part + 1..end] {
                let expected = way[1].beyond(&way[0]);
                let corrected = refine.correct(place, &expected, mesh, settings, &mut at);
                // Next to buckling a coarse curve may be on the wrong side of it.
                let Some(corrected) = unless_buckled(corrected)? else { continue };
                way = [way[1], Way::between(place, &corrected)];
                points.push(Checked { place: corrected, error, mesh }.point(settings));
            }
            points.push(next.point(settings));
            last = next;
        }
        Ok(RefinedBoundary { points, linearisations: count.get() })
    }

    /// A point of a coarse curve on the first mesh that meets the tolerance.
    fn sample(
        &self,
        place: &Follower<2>,
        settings: &BoundarySettings,
        family: &mut impl FnMut(&Vector2<f64>, usize) -> Result<Linearisation, StabilityError>,
    ) -> Result<Checked, StabilityError> {
        let (mut there, mut last, mut convergence) = (*place, self.first, Convergence::default());
        let mut reached = Reached::default();
        let sizes = settings.sizes(place);
        for n in self.meshes().skip(1) {
            let before = there;
            let errors = self.go_finer(&mut there, &mut convergence, &free(place), &sizes, &mut |x| family(x, n))?;
            for (place, error, mesh) in [(before, errors[0], last), (there, errors[1], n)] {
                if error.relative <= self.tolerance {
                    return Ok(Checked { place, error, mesh });
                }
            }
            reached.at(n, errors[1].relative);
            last = n;
        }
        Err(reached.not_met(self.tolerance))
    }

    /// A point of a coarse curve on another mesh, whose curve is expected so far from it.
    fn correct(
        &self,
        place: &Follower<2>,
        expected: &Way,
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
        if step.norm() * SLOPE < close {
            there.end_on_axis(&step);
        } else {
            there.correct(&free, close, &mut |x| family(x, mesh))?;
        }
        Ok(there)
    }
}

/// The way from a point on one curve to that on another.
#[derive(Clone, Copy)]
struct Way {
    parameters: Vector2<f64>,
    root: Complex<f64>,
}

impl Way {
    fn between(from: &Follower<2>, to: &Follower<2>) -> Self {
        Self { parameters: to.at - from.at, root: to.root - from.root }
    }

    /// The next way, if the last was this one and the one before `other`.
    fn beyond(&self, other: &Self) -> Self {
        Self { parameters: self.parameters * 2.0 - other.parameters, root: self.root * 2.0 - other.root }
    }
}

impl Checked {
    fn point(&self, settings: &BoundarySettings) -> RefinedPoint {
        RefinedPoint {
            point: settings.point(&self.place),
            parameter_errors: self.error.parameters.component_mul(&settings.sides()).into(),
            frequency_error: self.error.frequency,
            elements: self.place.elements,
        }
    }
}

/// The parameters that a correction may change: all but those on a side of the rectangle, where the curve ends.
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
