//! A shoot that is rotated about the vertical as a whole, its base clamped: Q → R Q Rᵀ.

use nalgebra::{UnitQuaternion, Vector3};

use crate::rod::Rod;

/// The rod rotated by an angle (rad) about the tangent of its base, counterclockwise as seen from its apex. The base stays: components
/// 1 and 2 along the directors rotate as pairs.
pub(super) fn turned(rod: &Rod, angle: f64) -> Rod {
    let along_directors = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let base = rod.frames[0];
    let in_space = base * along_directors * base.inverse();
    let mut out = rod.clone();
    out.frames.iter_mut().for_each(|frame| *frame = in_space * *frame * along_directors.inverse());
    let vectors = out.rotations.iter_mut().chain(&mut out.line_strains);
    vectors.for_each(|vector| *vector = along_directors * *vector);
    out.points.iter_mut().for_each(|point| point.intrinsic = along_directors * point.intrinsic);
    // The clamped base is exactly the same.
    out.frames[0] = base;
    out
}

/// Gives a rod the shape of another as the initial guess of its equilibrium. Lengths may differ; with other elements it keeps its own.
pub(super) fn take_shape(rod: &mut Rod, of: &Rod) {
    let sizes = |rod: &Rod| (rod.frames.len(), rod.rotations.len(), rod.line_strains.len());
    if sizes(rod) == sizes(of) {
        rod.frames.clone_from(&of.frames);
        rod.rotations.clone_from(&of.rotations);
        rod.line_strains.clone_from(&of.line_strains);
    }
}
