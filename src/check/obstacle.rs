//! Check of obstacles.

use nalgebra::Vector3;

use super::error::{At, LawError, Quantity, Where};
use super::{STEP, WRONG, slope};
use crate::support::Obstacle;

/// Checks the surfaces of an obstacle at places (m) and a time (s). The places should be outside or near the surface,
/// and farther from its edges than the step of the differences: 1/1000 of the radius of curvature, at most 1 mm.
///
/// The gradient of the distance must be a unit vector, and value, normal and curvature must be derivatives of each
/// other. A function whose gradient is longer or shorter, such as x² + y² − R², is no distance.
/// The velocity is not checked.
///
/// ```
/// use morphorod::check;
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::Cylinder;
///
/// let pole = Cylinder { through: Vector3::x() * 0.02, along: Vector3::z(), radius: 2e-3 };
/// check::obstacle(&pole, &[Vector3::new(0.016, 0.003, 0.01), Vector3::new(0.03, -0.01, 0.04)], 0.0)?;
/// # Ok::<(), check::LawError>(())
/// ```
///
/// # Errors
/// The first quantity that is not finite or contradicts the others. The order for each place and surface is: value,
/// norm of the normal, then each component of the normal with its column of the curvature.
pub fn obstacle<O: Obstacle + ?Sized>(obstacle: &O, places: &[Vector3<f64>], time: f64) -> Result<(), LawError> {
    At::of_points::<O>(places.len())?;
    for place in places {
        for surface in 0..obstacle.surfaces() {
            let at = At::of::<O>(Where::Place { place: *place, surface });
            let here = obstacle.distance_to(surface, place, time);
            at.finite(Quantity::Clearance, here.value)?;
            let norm = here.normal.norm();
            at.equal(Quantity::NormalLength, [norm, 1.0], WRONG, "the norm of the gradient of a distance")?;
            // The radius of curvature of the surface of equal distance is the scale of its changes, at most 1 m.
            let radius = here.curvature.norm().max(1.0).recip();
            for j in 0..3 {
                let moved = |by: f64| obstacle.distance_to(surface, &(place + Vector3::ith(j, by)), time);
                let (expected, error) = slope(|by| nalgebra::Vector1::new(moved(by).value), STEP * radius);
                let requirement = "the derivative of the distance by the place: normals point away from the obstacle";
                let values = [here.normal[j], expected.x];
                at.equal(Quantity::Normal(j), values, WRONG + error.x, requirement)?;
                let (expected, error) = slope(|by| moved(by).normal, STEP * radius);
                for i in 0..3 {
                    at.finite(Quantity::Curvature(i, j), here.curvature[(i, j)])?;
                    let values = [here.curvature[(i, j)], expected[i]];
                    let tolerance = WRONG / radius + error[i];
                    at.equal(Quantity::Curvature(i, j), values, tolerance, "the derivative of the normal")?;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::{Capsule, Cylinder, Distance, HalfSpace, Sphere};

    /// A sphere of 1 cm radius about the origin, with a change of the returned distance.
    struct Changed(fn(Distance) -> Distance);

    impl Obstacle for Changed {
        fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
            self.0(Sphere { centre: Vector3::zeros(), radius: 0.01 }.distance(place, time))
        }
    }

    const PLACE: Vector3<f64> = Vector3::new(0.009, -0.004, 0.006);

    #[test]
    fn obstacles_of_the_crate_pass() {
        let along = Vector3::new(1.0, 0.3, -0.2);
        let ends = [Vector3::zeros(), along * 0.01];
        let all: [&dyn Obstacle; 4] = [
            &Cylinder { through: Vector3::zeros(), along, radius: 1e-3 },
            &Sphere { centre: along * 1e-3, radius: 1e-4 },
            &HalfSpace { through: Vector3::zeros(), normal: along },
            &Capsule { ends, radius: 1e-3 },
        ];
        for (i, body) in all.into_iter().enumerate() {
            assert_eq!(obstacle(body, &[PLACE, PLACE * 5.0], 0.0), Ok(()), "{i}");
        }
    }

    #[test]
    fn wrong_methods_are_named() {
        type Case = (fn(Distance) -> Distance, Quantity);
        let cases: [Case; 5] = [
            (|at| Distance { value: f64::NAN, ..at }, Quantity::Clearance),
            (|at| Distance { value: at.value * 2.0, ..at }, Quantity::Normal(0)),
            (|at| Distance { normal: at.normal * 2.0, ..at }, Quantity::NormalLength),
            (|at| Distance { normal: -at.normal, ..at }, Quantity::Normal(0)),
            (|at| Distance { curvature: -at.curvature, ..at }, Quantity::Curvature(0, 0)),
        ];
        for (change, quantity) in cases {
            let error = obstacle(&Changed(change), &[PLACE], 0.0).unwrap_err();
            assert_eq!(error.quantity, quantity, "{error}");
        }
    }
}
