//! An obstacle as an elastic foundation with friction.

use nalgebra::{Matrix3, Vector3};

use crate::support::{Contact, Energy, Obstacle};

/// An obstacle whose surface acts on a place of the rod as a spring.
#[derive(Clone, Copy)]
pub(in crate::equilibrium) struct Foundation<'a> {
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

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::support::Sphere;

    #[test]
    fn derivatives_of_a_foundation_are_those_of_its_energy() {
        let ball = Sphere { centre: Vector3::new(0.1, -0.2, 0.3), radius: 0.5 };
        let contact = Contact { obstacle: &ball as &dyn Obstacle, radius: 0.1, friction: 0.4 };
        let normal = Vector3::new(0.3, 0.2, 0.9).normalize();
        // A place inside the surface, which sticks or slides with the cones below.
        let x = ball.centre + Vector3::new(0.35, 0.1, 0.4);
        for cone in [0.0, 1e-2, 10.0] {
            let anchor = (ball.centre + normal * 0.6, normal);
            let foundation =
                Foundation { contact, yielded: Vector3::new(0.01, 0.0, 0.02), stiffness: 3.0, anchor, cone };
            let here = foundation.energy(&x, 0.0);
            assert!(here.value > 0.0);
            // Central differences have errors of order h² = 1e-10.
            let h = 1e-5;
            for axis in 0..3 {
                let by = Vector3::ith(axis, h);
                let [ahead, behind] = [x + by, x - by].map(|x| foundation.energy(&x, 0.0));
                let slope = (ahead.value - behind.value) / (2.0 * h);
                assert_relative_eq!(slope, here.gradient[axis], epsilon = 1e-9, max_relative = 1e-8);
                let change = (ahead.gradient - behind.gradient) / (2.0 * h);
                assert_relative_eq!(
                    change,
                    here.stiffness.column(axis).into_owned(),
                    epsilon = 1e-8,
                    max_relative = 1e-8
                );
            }
        }
    }
}
