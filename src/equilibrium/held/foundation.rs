//! An obstacle as an elastic foundation with friction.

use nalgebra::{Matrix3, Vector3};

use crate::support::{Contact, Energy, Obstacle};

/// An obstacle whose surface acts on a place of the rod as a spring.
#[derive(Clone, Copy)]
pub(super) struct Foundation<'a> {
    pub contact: Contact<&'a dyn Obstacle>,
    /// Displacement of the obstacle, m.
    pub yielded: Vector3<f64>,
    /// Force per penetration and per slip of a place that sticks, N/m.
    pub stiffness: f64,
    /// The place without slip, m, and the normal of the obstacle there, across which slips are measured.
    pub anchor: (Vector3<f64>, Vector3<f64>),
    /// Largest tangential force, N.
    pub cone: f64,
}

impl Foundation<'_> {
    /// The energy at a place x (m): that of the penetration, and the work of friction with a given largest force.
    pub fn energy(&self, x: &Vector3<f64>, time: f64) -> Energy {
        let distance = self.contact.obstacle.distance(&(x - self.yielded), time);
        let gap = (distance.value - self.contact.radius).min(0.0);
        let (k, normal) = (self.stiffness, distance.normal);
        let (mut value, mut gradient) = (0.5 * k * gap * gap, normal * (k * gap));
        let mut stiffness = Matrix3::zeros();
        if gap < 0.0 {
            stiffness += (normal * normal.transpose() + distance.curvature * gap) * k;
        }
        if self.cone > 0.0 {
            let (anchor, normal) = self.anchor;
            let tangential = Matrix3::identity() - normal * normal.transpose();
            let slip = tangential * (x - anchor);
            let (size, along) = (slip.norm(), slip.try_normalize(f64::MIN_POSITIVE).unwrap_or_default());
            if k * size <= self.cone {
                value += 0.5 * k * size * size;
                gradient += slip * k;
                stiffness += tangential * k;
            } else {
                value += self.cone * (size - 0.5 * self.cone / k);
                gradient += along * self.cone;
                stiffness += (tangential - along * along.transpose()) * (self.cone / size);
            }
        }
        Energy { value, gradient, stiffness }
    }
}
