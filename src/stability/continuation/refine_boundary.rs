//! The boundary of stability to a tolerance: followed on a coarse mesh, and corrected on finer
//! ones.

use nalgebra::{Complex, Vector2};

use super::boundary::{BoundarySettings, places};
use super::crossing::Crossing;
use super::follow::Follower;
use super::mesh_error::Estimated;
use super::refinement::Refinement;
use crate::linearisation::{Outcome, StabilityError};
use crate::stability::spectrum::Linearisation;

/// Number of points from one estimate of the error to the next. Between them the error is smooth:
/// it changes with the parameters, of which a curve of some hundred points covers the whole range.
const SAMPLES: usize = 16;

/// A family of linearisations with two parameters on meshes with a number of elements.
type MeshFamily<'a> = dyn FnMut(&Vector2<f64>, usize) -> Result<Linearisation, StabilityError> + 'a;

impl Refinement {
    /// Follows a boundary as [`boundary`](super::boundary()) does, to the tolerance. Errors are
    /// relative to the value of the parameter or frequency. If the range of a parameter contains
    /// zero, they are relative to its larger end. `family` takes the two parameters and the number
    /// of elements.
    ///
    /// The curve is followed on the first mesh on which this succeeds, which determines its ends
    /// and the distances of its points. At every sixteenth point the mesh is refined until the
    /// estimate meets the tolerance. The points between two of these are corrected on the finer of
    /// the two meshes; their error is the larger of the two estimates.
    ///
    /// # Errors
    /// Errors of [`boundary`](super::boundary()), a tolerance below 1e-9 or a range of meshes that
    /// is too small, or [`ToleranceNotMet`](StabilityError::ToleranceNotMet).
    pub fn boundary(
        &self,
        mut family: impl FnMut(f64, f64, usize) -> Result<Linearisation, StabilityError>,
        settings: &BoundarySettings,
    ) -> Result<Vec<Crossing<2>>, StabilityError> {
        self.check()?;
        let mut at = |x: &Vector2<f64>, n: usize| {
            let [first, second] = settings.parameters(x);
            family(first, second, n)
        };
        // The error of this curve is not estimated, so that the first result is accepted.
        let (first, coarse) = self.converge(|n, _: Option<(usize, Vec<Follower<2>>)>| {
            Ok(((n, places(&mut |x| at(x, n), settings)?), Some(0.0)))
        })?;
        let refine = Self { first, ..*self };
        let (mut last, mut mesh) = refine.sample(&coarse[0], settings, &mut at)?;
        let mut points = vec![settings.point(last.place).estimated(&last.error)];
        for part in (0..coarse.len() - 1).step_by(SAMPLES) {
            let end = (part + SAMPLES).min(coarse.len() - 1);
            let (next, next_mesh) = refine.sample(&coarse[end], settings, &mut at)?;
            let (finer, error) = (mesh.max(next_mesh), last.error.larger(&next.error));
            // The changes from the coarse curve at the last two points are extrapolated.
            let change =
                |from: &Follower<2>, to: &Follower<2>| (to.at - from.at, to.root - from.root);
            let mut changes = [change(&coarse[part], &last.place); 2];
            for place in &coarse[part + 1..end] {
                let [(at_before, root_before), (at_last, root_last)] = changes;
                let expected = (at_last * 2.0 - at_before, root_last * 2.0 - root_before);
                match refine.correct(place, expected, finer, settings, &mut at) {
                    // Near buckling, a point of the coarse curve may be mechanically unstable on a
                    // finer mesh.
                    Err(StabilityError::MechanicallyUnstable { .. }) => {}
                    corrected => {
                        let corrected = corrected?;
                        changes = [changes[1], change(place, &corrected)];
                        points.push(settings.point(corrected).estimated(&error));
                    }
                }
            }
            points.push(settings.point(next.place).estimated(&next.error));
            (last, mesh) = (next, next_mesh);
        }
        Ok(points)
    }

    /// A point of a coarse curve on the first mesh that meets the tolerance, and the number of
    /// elements of this mesh.
    fn sample(
        &self,
        place: &Follower<2>,
        settings: &BoundarySettings,
        family: &mut MeshFamily,
    ) -> Outcome<(Estimated<2>, usize)> {
        let sizes = settings.sizes(place);
        self.converge(|n, coarser: Option<(Estimated<2>, usize)>| {
            let (mut point, mesh) = coarser.unwrap_or((Estimated::new(*place), self.first));
            if n == self.first {
                return Ok(((point, mesh), None));
            }
            let before = point.place;
            let error = point.refine(&free(place), &sizes, self.close(sizes.min()), &mut |x| {
                family(x, n)
            })?;
            // The mesh before may be fine enough.
            if error.relative <= self.tolerance {
                return Ok((
                    (
                        Estimated {
                            error,
                            ..Estimated::new(before)
                        },
                        mesh,
                    ),
                    Some(error.relative),
                ));
            }
            Ok(((point, n), Some(point.error.relative)))
        })
    }

    /// A point of a coarse curve on another mesh, with the expected changes of parameters and root.
    fn correct(
        &self,
        place: &Follower<2>,
        (parameters, root): (Vector2<f64>, Complex<f64>),
        mesh: usize,
        settings: &BoundarySettings,
        family: &mut MeshFamily,
    ) -> Outcome<Follower<2>> {
        let mut there = *place;
        if mesh == self.first {
            return Ok(there);
        }
        there.at += parameters;
        there.change_mesh(place.root + root, &family(&there.at, mesh)?)?;
        let (free, close) = (free(place), self.close(settings.sizes(place).min()));
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

/// The parameters that a correction may change: all except one on a side of the rectangle, where
/// the curve ends.
fn free(place: &Follower<2>) -> Vector2<f64> {
    place
        .at
        .map(|x| if x == 0.0 || x == 1.0 { 0.0 } else { 1.0 })
}
