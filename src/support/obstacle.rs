//! Obstacles: surfaces that a shoot can touch, by their signed distance.

use nalgebra::{Matrix3, Vector3};

use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// Signed distance of a place from the surface of an obstacle, with its derivatives by the place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Signed distance, m; negative inside the obstacle.
    pub value: f64,
    /// Gradient: the unit normal, which points away from the obstacle.
    pub normal: Vector3<f64>,
    /// Second derivative, 1/m: the curvature of the surface of equal distance, zero along the
    /// normal.
    pub curvature: Matrix3<f64>,
}

impl Distance {
    /// The distance from an obstacle without places.
    pub(super) fn nowhere() -> Self {
        Self {
            value: f64::INFINITY,
            normal: Vector3::z(),
            curvature: Matrix3::zeros(),
        }
    }
}

/// An obstacle, given by its signed distance. Obstacles may move in time.
///
/// An obstacle may consist of several surfaces, such as the sides of a corner. The search for
/// contacts treats each surface by its own distance. This is necessary where the gradient of the
/// distance is discontinuous outside the obstacle: at places with two nearest points. All surfaces
/// move together.
///
/// ```
/// use morphorod::nalgebra::{Matrix3, Vector3};
/// use morphorod::support::{Distance, Obstacle};
///
/// /// A floor that is lowered at a speed in m/s.
/// struct Floor(f64);
///
/// impl Obstacle for Floor {
///     fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
///         Distance { value: place.z + self.0 * time, normal: Vector3::z(), curvature: Matrix3::zeros() }
///     }
/// }
/// ```
pub trait Obstacle {
    /// Signed distance of a place (m, in the fixed frame) at a time (s).
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance;

    /// Number of surfaces, the same at all times; one by default. An obstacle that wraps another
    /// one forwards this, [`distance_to`](Self::distance_to) and [`has_edges`](Self::has_edges).
    fn surfaces(&self) -> usize {
        1
    }

    /// Signed distance of a place (m) from one of the surfaces at a time (s), with the conventions
    /// of [`distance`](Self::distance), which is that of the nearest surface. The index `surface`
    /// is below [`surfaces`](Self::surfaces).
    fn distance_to(&self, _surface: usize, place: &Vector3<f64>, time: f64) -> Distance {
        self.distance(place, time)
    }

    /// Whether the obstacle has sharp edges, at which its surface has no normal; `false` by
    /// default. A contact with such an obstacle needs a positive radius.
    fn has_edges(&self) -> bool {
        false
    }

    /// Displacement of the obstacle per force on it, m/N, symmetric and positive semidefinite;
    /// zero, for a rigid obstacle, by default. An obstacle that yields moves without rotation, as a
    /// pole on springs. The slip of friction is relative to the displaced obstacle. The forces on
    /// all surfaces displace the obstacle as a whole.
    fn compliance(&self) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    /// Velocity of the material of the obstacle at a place (m) at a time (s), m/s. It matters for
    /// friction; zero by default.
    fn velocity(&self, _place: &Vector3<f64>, _time: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

forward_pointers!(Obstacle {
    fn distance(place: &Vector3<f64>, time: f64) -> Distance;
    fn surfaces() -> usize;
    fn distance_to(surface: usize, place: &Vector3<f64>, time: f64) -> Distance;
    fn has_edges() -> bool;
    fn compliance() -> Matrix3<f64>;
    fn velocity(place: &Vector3<f64>, time: f64) -> Vector3<f64>;
    fn check() -> Result<(), ParameterError>;
});

/// A half space: all places on one side of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HalfSpace {
    /// A point of the plane, m.
    pub through: Vector3<f64>,
    /// Normal of the plane, which points out of the half space; of any length.
    pub normal: Vector3<f64>,
}

impl Obstacle for HalfSpace {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let normal = self.normal.normalize();
        Distance {
            value: normal.dot(&(place - self.through)),
            normal,
            curvature: Matrix3::zeros(),
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("point of a half space", self.through.sum(), "m")?;
        ParameterError::positive("norm of the normal of a half space", self.normal.norm(), "")
    }
}

/// An infinitely long circular cylinder, such as a pole.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cylinder {
    /// A point of the axis, m.
    pub through: Vector3<f64>,
    /// Direction of the axis; of any length.
    pub along: Vector3<f64>,
    /// Radius, m.
    pub radius: f64,
}

impl Obstacle for Cylinder {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let along = self.along.normalize();
        let from = place - self.through;
        round(
            &(from - along * along.dot(&from)),
            Matrix3::identity() - along * along.transpose(),
            self.radius,
        )
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("point of the axis of a cylinder", self.through.sum(), "m")?;
        ParameterError::positive("norm of the direction of a cylinder", self.along.norm(), "")?;
        ParameterError::positive("radius of a cylinder", self.radius, "m")
    }
}

/// The distance of a place from a surface of constant radius, given the vector `from` the closest
/// point of the axis and the projection to the directions in which that point does not follow.
pub(super) fn round(from: &Vector3<f64>, across: Matrix3<f64>, radius: f64) -> Distance {
    let norm = from.norm();
    // On the axis every direction is as good. A solver keeps places outside.
    let normal = if norm > 0.0 {
        from / norm
    } else {
        across.column(across.diagonal().imax()).normalize()
    };
    let curvature = (across - normal * normal.transpose()) / norm.max(f64::MIN_POSITIVE.sqrt());
    Distance {
        value: norm - radius,
        normal,
        curvature,
    }
}

/// A sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sphere {
    /// Centre, m.
    pub centre: Vector3<f64>,
    /// Radius, m.
    pub radius: f64,
}

impl Obstacle for Sphere {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        round(&(place - self.centre), Matrix3::identity(), self.radius)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("centre of a sphere", self.centre.sum(), "m")?;
        ParameterError::positive("radius of a sphere", self.radius, "m")
    }
}

/// A capsule: all places within a radius of a straight segment, such as a stick with round ends.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Capsule {
    /// Ends of the segment, m.
    pub ends: [Vector3<f64>; 2],
    /// Radius, m.
    pub radius: f64,
}

impl Obstacle for Capsule {
    fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
        let axis = self.ends[1] - self.ends[0];
        let share = axis.dot(&(place - self.ends[0])) / axis.norm_squared();
        let along = axis.normalize();
        let across = Matrix3::identity() - along * along.transpose();
        match share {
            share if share > 0.0 && share < 1.0 => {
                round(&(place - self.ends[0] - axis * share), across, self.radius)
            }
            share => round(
                &(place - self.ends[usize::from(share >= 1.0)]),
                Matrix3::identity(),
                self.radius,
            ),
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive(
            "length of a capsule's segment",
            (self.ends[1] - self.ends[0]).norm(),
            "m",
        )?;
        ParameterError::positive("radius of a capsule", self.radius, "m")
    }
}
