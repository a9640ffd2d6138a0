//! Boxes as obstacles.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::obstacle::round;
use super::{Distance, Obstacle};
use crate::error::ParameterError;

/// A box.
///
/// Places at the same distance from a convex body form a surface that is round at its edges and
/// corners. A shoot of radius r therefore bends over an edge as over a cylinder of radius r. A
/// contact of radius zero is an error, since an edge has no normal.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cuboid {
    /// Centre, in the fixed frame with the base at the origin, m.
    pub centre: Vector3<f64>,
    /// Rotation of the directions of the edges from e1, e2, e3 of the fixed frame.
    pub frame: UnitQuaternion<f64>,
    /// Half the lengths of the edges, m.
    pub half_edges: Vector3<f64>,
}

impl Obstacle for Cuboid {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let own = self.frame.inverse() * (place - self.centre);
        let beyond = own.abs() - self.half_edges;
        let sides = own.map(f64::signum);
        let local = if beyond.iter().any(|excess| *excess > 0.0) {
            // The nearest point of the box does not follow the place in these directions.
            let across =
                Matrix3::from_diagonal(&beyond.map(|excess| f64::from(u8::from(excess > 0.0))));
            round(
                &beyond.sup(&Vector3::zeros()).component_mul(&sides),
                across,
                0.0,
            )
        } else {
            let (axis, value) = beyond.argmax();
            let normal = Vector3::ith(axis, sides[axis]);
            Distance {
                value,
                normal,
                curvature: Matrix3::zeros(),
            }
        };
        let turn = self.frame.to_rotation_matrix();
        let curvature = turn * local.curvature * turn.inverse();
        Distance {
            value: local.value,
            normal: turn * local.normal,
            curvature,
        }
    }

    fn has_edges(&self) -> bool {
        true
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("centre of a box", self.centre.sum(), "m")?;
        ParameterError::unit(
            "norm of the quaternion of the frame of a box",
            self.frame.coords.norm(),
        )?;
        self.half_edges
            .iter()
            .try_for_each(|half| ParameterError::positive("half an edge of a box", *half, "m"))
    }
}
