//! Rods rotated about the tangent of the clamped base: Q → R Q Rᵀ.

use nalgebra::{UnitQuaternion, Vector3};

use crate::rod::Rod;

/// The rod rotated by an angle (rad) about the tangent of its base, counterclockwise as seen from above the apex.
/// The base is unchanged; components 1 and 2 along the directors rotate as pairs.
pub(super) fn rotated(rod: &Rod, angle: f64) -> Rod {
    let along_directors = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let base = rod.frames()[0];
    let in_space = base * along_directors * base.inverse();
    let mut out = rod.clone();
    let (frames, rotations) = out.shape_mut();
    frames.iter_mut().for_each(|frame| *frame = in_space * *frame * along_directors.inverse());
    let rotate = |vector: &mut Vector3<f64>| *vector = along_directors * *vector;
    rotations.iter_mut().for_each(rotate);
    out.line_strains_mut().iter_mut().for_each(rotate);
    out.points_mut().iter_mut().for_each(|point| point.intrinsic = along_directors * point.intrinsic);
    // Removes the rounding error of the clamped base.
    out.shape_mut().0[0] = base;
    out
}

/// Distance of the tip from the axis, the line along the tangent of a base with the given frame, m.
pub(super) fn excursion(rod: &Rod, base: &UnitQuaternion<f64>) -> f64 {
    let (tip, axis) = (rod.tip() - rod.base_position(), base * Vector3::z());
    (tip - axis * axis.dot(&tip)).norm()
}
