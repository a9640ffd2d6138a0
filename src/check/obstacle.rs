//! Check of obstacles.

use nalgebra::Vector3;

use super::WRONG;
use super::error::{At, LawError, Quantity, Where};
use crate::support::{Distance, Obstacle};

/// Step of the differences, relative to the radius of curvature of the surface of equal distance.
/// The trapezoidal rule has an error of order 1e-8 then, and rounding causes one of order 1e-10.
pub(crate) const BESIDE: f64 = 1e-4;

/// Derivatives of a distance along a step, as they follow from the values at its two ends.
pub(crate) struct Derivatives {
    /// Component of the normal along the step.
    pub normal: f64,
    /// Derivative of the normal along the step, 1/m.
    pub bend: Vector3<f64>,
}

impl Derivatives {
    /// The derivatives at a place, by the trapezoidal rule between the distances at the place and
    /// at the end of a step (m).
    pub fn along(step: &Vector3<f64>, here: &Distance, there: &Distance) -> Self {
        let (length, along) = (step.norm(), step.normalize());
        let turn = (there.normal - here.normal) / length;
        let normal = (there.value - here.value) / length - 0.5 * length * turn.dot(&along);
        Self {
            normal,
            bend: turn - (there.curvature - here.curvature) * along * 0.5,
        }
    }

    /// The derivatives along a step (m) or against it: of each quantity the one that is closer to
    /// the returned one, since the curvature may be discontinuous at the place, as where a plane
    /// face ends.
    pub fn to_a_side(
        step: &Vector3<f64>,
        here: &Distance,
        distance: impl Fn(&Vector3<f64>) -> Distance,
    ) -> Self {
        let along = step.normalize();
        let ahead = Self::along(step, here, &distance(step));
        let behind = Self::along(&-step, here, &distance(&-step));
        let behind = Self {
            normal: -behind.normal,
            bend: -behind.bend,
        };
        let error = |side: &Self| (side.normal - here.normal.dot(&along)).abs();
        let bend_error = |side: &Self| (side.bend - here.curvature * along).norm();
        // NaN is kept only if it is the result to both sides.
        let normal = if error(&behind) < error(&ahead) || ahead.normal.is_nan() {
            behind.normal
        } else {
            ahead.normal
        };
        let other = bend_error(&behind) < bend_error(&ahead) || bend_error(&ahead).is_nan();
        Self {
            normal,
            bend: if other { behind.bend } else { ahead.bend },
        }
    }
}

/// Checks the surfaces of an obstacle at places (m) and a time (s). The places should be outside or
/// near the surface. The gradient of the distance must be continuous within a step of the
/// differences, 1/10,000 of the radius of curvature and at most 0.1 mm.
///
/// The gradient of the distance must be a unit vector, and value, normal and curvature must be
/// derivatives of each other. A function whose gradient is longer or shorter, such as x² + y² − R²,
/// is no distance. The velocity is not checked.
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
/// The first quantity that is not finite or contradicts the others. The order for each place and
/// surface is: value, norm of the normal, then each component of the normal with its column of the
/// curvature.
pub fn obstacle<O: Obstacle + ?Sized>(
    obstacle: &O,
    places: &[Vector3<f64>],
    time: f64,
) -> Result<(), LawError> {
    At::of_points::<O>(places.len())?;
    for place in places {
        for surface in 0..obstacle.surfaces() {
            let at = At::of::<O>(Where::Place {
                place: *place,
                surface,
            });
            let moved = |by: &Vector3<f64>| obstacle.distance_to(surface, &(place + by), time);
            let here = moved(&Vector3::zeros());
            at.finite(Quantity::Clearance, here.value)?;
            let norm = here.normal.norm();
            at.equal(
                Quantity::NormalLength,
                [norm, 1.0],
                WRONG,
                "the norm of the gradient of a distance",
            )?;
            // The radius of curvature is the scale of the changes of the distance, at most 1 m.
            let radius = here.curvature.norm().max(1.0).recip();
            for j in 0..3 {
                let expected =
                    Derivatives::to_a_side(&Vector3::ith(j, BESIDE * radius), &here, moved);
                let requirement = "the derivative of the distance by the place: normals point away from the obstacle";
                at.equal(
                    Quantity::Normal(j),
                    [here.normal[j], expected.normal],
                    WRONG,
                    requirement,
                )?;
                for i in 0..3 {
                    let quantity = Quantity::Curvature(i, j);
                    at.finite(quantity, here.curvature[(i, j)])?;
                    let values = [here.curvature[(i, j)], expected.bend[i]];
                    at.equal(
                        quantity,
                        values,
                        WRONG / radius,
                        "the derivative of the normal",
                    )?;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::{Capsule, Cuboid, Cylinder, HalfSpace, Sphere};
    use nalgebra::UnitQuaternion;

    /// A sphere of 1 cm radius about the origin, with a change of the returned distance.
    struct Changed(fn(Distance) -> Distance);

    impl Obstacle for Changed {
        fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
            self.0(
                Sphere {
                    centre: Vector3::zeros(),
                    radius: 0.01,
                }
                .distance(place, time),
            )
        }
    }

    const PLACE: Vector3<f64> = Vector3::new(0.009, -0.004, 0.006);

    #[test]
    fn obstacles_of_the_crate_pass() {
        let along = Vector3::new(1.0, 0.3, -0.2);
        let ends = [Vector3::zeros(), along * 0.01];
        let all: [&dyn Obstacle; 4] = [
            &Cylinder {
                through: Vector3::zeros(),
                along,
                radius: 1e-3,
            },
            &Sphere {
                centre: along * 1e-3,
                radius: 1e-4,
            },
            &HalfSpace {
                through: Vector3::zeros(),
                normal: along,
            },
            &Capsule { ends, radius: 1e-3 },
        ];
        for (i, body) in all.into_iter().enumerate() {
            assert_eq!(obstacle(body, &[PLACE, PLACE * 5.0], 0.0), Ok(()), "{i}");
        }
    }

    #[test]
    fn places_at_which_the_curvature_is_discontinuous_pass() {
        // The edge between the upper face of the box and the cylinder of equal distance about its
        // edge.
        let body = Cuboid {
            centre: Vector3::zeros(),
            frame: UnitQuaternion::identity(),
            half_edges: Vector3::new(0.01, 0.02, 0.03),
        };
        assert_eq!(
            obstacle(&body, &[Vector3::new(0.01, 0.005, 0.034)], 0.0),
            Ok(())
        );
    }

    #[test]
    fn wrong_methods_are_named() {
        type Case = (fn(Distance) -> Distance, Quantity);
        let cases: [Case; 5] = [
            (
                |at| Distance {
                    value: f64::NAN,
                    ..at
                },
                Quantity::Clearance,
            ),
            (
                |at| Distance {
                    value: at.value * 2.0,
                    ..at
                },
                Quantity::Normal(0),
            ),
            (
                |at| Distance {
                    normal: at.normal * 2.0,
                    ..at
                },
                Quantity::NormalLength,
            ),
            (
                |at| Distance {
                    normal: -at.normal,
                    ..at
                },
                Quantity::Normal(0),
            ),
            (
                |at| Distance {
                    curvature: -at.curvature,
                    ..at
                },
                Quantity::Curvature(0, 0),
            ),
        ];
        for (change, quantity) in cases {
            let error = obstacle(&Changed(change), &[PLACE], 0.0).unwrap_err();
            assert_eq!(error.quantity, quantity, "{error}");
        }
    }
}
