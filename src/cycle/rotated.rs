//! Rods rotated about the tangent of the clamped base: Q → R Q Rᵀ.

use nalgebra::{UnitQuaternion, Vector3};

use crate::rod::Rod;

/// The rod rotated by an angle (rad) about the tangent of its base, counterclockwise as seen from
/// above the apex. The base is unchanged; components 1 and 2 along the directors rotate as pairs.
pub(super) fn rotated(rod: &Rod, angle: f64) -> Rod {
    let along_directors = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let base = rod.frames()[0];
    let in_space = base * along_directors * base.inverse();
    let mut out = rod.with_turned_directors(&along_directors.inverse());
    out.frames
        .iter_mut()
        .for_each(|frame| *frame = in_space * *frame);
    // Removes the rounding error of the clamped base.
    out.frames[0] = base;
    out
}

/// Distance of the tip from the axis, the line along the tangent of a base with the given frame, m.
pub(super) fn excursion(rod: &Rod, base: &UnitQuaternion<f64>) -> f64 {
    let (tip, axis) = (rod.tip() - rod.base_position(), base * Vector3::z());
    (tip - axis * axis.dot(&tip)).norm()
}
