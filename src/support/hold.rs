//! Holds and springs at material places.

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use super::Support;
use crate::error::ParameterError;
use crate::so3;

/// Condition on the position of a material place, in the fixed frame, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Position {
    /// No condition.
    #[default]
    Free,
    /// The place is at a point.
    At(Vector3<f64>),
    /// The place is on a straight line, along which it slides without friction.
    OnLine {
        /// A point of the line, m.
        through: Vector3<f64>,
        /// Unit vector along the line.
        along: Unit<Vector3<f64>>,
    },
    /// The place is on a plane, in which it slides without friction.
    OnPlane {
        /// A point of the plane, m.
        through: Vector3<f64>,
        /// Unit vector normal to the plane.
        normal: Unit<Vector3<f64>>,
    },
    /// A linear spring between the place and an anchor. The force on the shoot is −K (p − anchor).
    Spring {
        /// Position without force, m.
        anchor: Vector3<f64>,
        /// Stiffness K, symmetric and positive semidefinite, N/m: `Matrix3::identity() * k` in all
        /// directions, or `k * n * n.transpose()` along the unit vector n.
        stiffness: Matrix3<f64>,
    },
}

/// Condition on the frame of a material place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Orientation {
    /// No condition.
    #[default]
    Free,
    /// The frame is given. It rotates e1, e2, e3 into d1, d2, d3.
    Held(UnitQuaternion<f64>),
    /// The frame is a given one, up to a rotation about an axis without friction. The axis is that
    /// of a hinge, or d3 for a socket in which the shoot twists freely.
    Hinge {
        /// The frame before the rotation.
        frame: UnitQuaternion<f64>,
        /// The axis, a unit vector along the directors.
        axis: Unit<Vector3<f64>>,
    },
    /// An elastic joint. The couple on the shoot along the directors is −K θ for the rotation
    /// vector θ from the given frame to that of the place.
    Spring {
        /// The frame without couple.
        frame: UnitQuaternion<f64>,
        /// Stiffness K about all axes, N m/rad.
        stiffness: f64,
    },
}

/// Conditions on position and frame of a material place.
///
/// The place is given by its distance from the apex at t = 0 and moves with the tissue. The builder
/// of a shoot puts a node there, as for a [`PointForce`](crate::load::PointForce); a rod that is
/// built otherwise needs such a node.
///
/// When a hold moves, its place follows on the straight line from its present position, and its
/// frame by the shortest rotation.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::Hold;
///
/// // A prop under the apex, at the height of the base: the apex slides in the horizontal plane.
/// let prop = Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis());
/// # let _ = prop;
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub struct Hold {
    /// Distance of the place from the apex at t = 0, m; zero for the apex.
    pub initial_apex_distance: f64,
    /// Condition on the position.
    pub position: Position,
    /// Condition on the frame.
    pub orientation: Orientation,
}

impl Hold {
    /// A hold of the apex, without conditions yet.
    pub fn apex() -> Self {
        Self::default()
    }

    /// A hold of the place at a distance from the apex at t = 0 (m), without conditions yet.
    pub fn place(initial_apex_distance: f64) -> Self {
        Self {
            initial_apex_distance,
            ..Self::default()
        }
    }

    /// Holds the place at a point (m).
    pub fn at(self, point: Vector3<f64>) -> Self {
        Self {
            position: Position::At(point),
            ..self
        }
    }

    /// Guides the place along a line through a point (m).
    pub fn on_line(self, through: Vector3<f64>, along: Unit<Vector3<f64>>) -> Self {
        Self {
            position: Position::OnLine { through, along },
            ..self
        }
    }

    /// Guides the place in a plane through a point (m).
    pub fn on_plane(self, through: Vector3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        Self {
            position: Position::OnPlane { through, normal },
            ..self
        }
    }

    /// Connects the place to an anchor (m) by a spring of the given stiffness (N/m).
    ///
    /// A tie to a stake prevents the oscillations of a shoot:
    ///
    /// ```
    /// use morphorod::ShootParameters;
    /// use morphorod::nalgebra::{Matrix3, Vector3};
    /// use morphorod::stability::Linearisation;
    /// use morphorod::support::Hold;
    ///
    /// let length = 0.067;
    /// let tied = |stiffness: f64| {
    ///     let tie = Hold::apex().spring(Vector3::z() * length, Matrix3::identity() * stiffness);
    ///     let parameters = ShootParameters { length, growth_time: 72e3, ..Default::default() };
    ///     let shoot = parameters.reduced().elements(4).support(tie).build()?;
    ///     Linearisation::about(&shoot)?.unstable()
    /// };
    /// assert_eq!(tied(1e-5)?, 4, "a pair of roots in each of two planes");
    /// assert_eq!(tied(1e-3)?, 0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn spring(self, anchor: Vector3<f64>, stiffness: Matrix3<f64>) -> Self {
        Self {
            position: Position::Spring { anchor, stiffness },
            ..self
        }
    }

    /// Holds the frame.
    pub fn held(self, frame: UnitQuaternion<f64>) -> Self {
        Self {
            orientation: Orientation::Held(frame),
            ..self
        }
    }

    /// Holds the frame up to a rotation about an axis along the directors.
    pub fn hinged(self, frame: UnitQuaternion<f64>, axis: Unit<Vector3<f64>>) -> Self {
        Self {
            orientation: Orientation::Hinge { frame, axis },
            ..self
        }
    }

    /// Holds the frame by an elastic joint of the given stiffness (N m/rad).
    pub fn elastic_joint(self, frame: UnitQuaternion<f64>, stiffness: f64) -> Self {
        Self {
            orientation: Orientation::Spring { frame, stiffness },
            ..self
        }
    }
}

impl Support for Hold {
    fn holds(&self, _time: f64) -> Vec<Hold> {
        vec![*self]
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative(
            "distance of a held place from the apex",
            self.initial_apex_distance,
            "m",
        )?;
        match self.position {
            Position::Free => {}
            Position::At(point) => ParameterError::finite("held position", point.sum(), "m")?,
            Position::OnLine { through, along } => {
                ParameterError::finite("point of a guiding line", through.sum(), "m")?;
                ParameterError::unit("norm of the direction of a guiding line", along.norm())?;
            }
            Position::OnPlane { through, normal } => {
                ParameterError::finite("point of a guiding plane", through.sum(), "m")?;
                ParameterError::unit("norm of the normal of a guiding plane", normal.norm())?;
            }
            Position::Spring { anchor, stiffness } => {
                ParameterError::finite("anchor of a spring", anchor.sum(), "m")?;
                ParameterError::finite("stiffness of a spring", stiffness.sum(), "N/m")?;
                let (name, skew) = (
                    "asymmetry of the stiffness of a spring",
                    (stiffness - stiffness.transpose()).norm(),
                );
                ParameterError::unless(skew <= 1e-12 * stiffness.norm(), name, skew, "zero (N/m)")?;
                let least = stiffness.symmetric_eigenvalues().min();
                let (name, requirement) = ("least stiffness of a spring", "zero or positive (N/m)");
                ParameterError::unless(
                    least >= -1e-12 * stiffness.norm(),
                    name,
                    least,
                    requirement,
                )?;
            }
        }
        match self.orientation {
            Orientation::Free => Ok(()),
            Orientation::Held(frame) => check_frame(&frame),
            Orientation::Hinge { frame, axis } => {
                check_frame(&frame)?;
                ParameterError::unit("norm of the axis of a hinge", axis.norm())
            }
            Orientation::Spring { frame, stiffness } => {
                check_frame(&frame)?;
                ParameterError::not_negative("stiffness of an elastic joint", stiffness, "N m/rad")
            }
        }
    }
}

pub(super) fn check_frame(frame: &UnitQuaternion<f64>) -> Result<(), ParameterError> {
    ParameterError::unit(
        "norm of the quaternion of a held frame",
        frame.coords.norm(),
    )
}

/// A hold that moves: a function of time (s). The function must be continuous.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{Hold, Moving};
///
/// // The apex is lifted by 1 mm in an hour.
/// let lift = Moving(|t: f64| Hold::apex().on_plane(Vector3::z() * (1e-3 * t / 3600.0), Vector3::z_axis()));
/// # let _ = lift;
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Moving<F>(
    /// The hold as a function of time (s).
    pub F,
);

impl<F: Fn(f64) -> Hold> Support for Moving<F> {
    fn holds(&self, time: f64) -> Vec<Hold> {
        vec![(self.0)(time)]
    }

    fn check(&self) -> Result<(), ParameterError> {
        (self.0)(0.0).check()
    }
}

/// The frame closest to `present` that a rotation of `frame` about an axis along its directors
/// gives.
pub(crate) fn closest_about(
    axis: &Vector3<f64>,
    frame: &UnitQuaternion<f64>,
    present: &UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    let turn = frame.inverse() * present;
    let angle = 2.0 * f64::atan2(turn.vector().dot(axis), turn.w);
    frame * so3::exp(&(axis * angle))
}

/// The joint of the base. Without one the base is clamped.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Joint {
    /// The base remains at its position and rotates freely. A scene whose base rotates later has no
    /// effect on it.
    Ball,
    /// The base remains at its position and rotates freely about an axis, a unit vector along the
    /// directors. At angle zero it has the frame of the scene, so that the axis follows a scene
    /// whose base rotates. For a rod without scene, it is the present frame of the rod's base.
    Hinge(Unit<Vector3<f64>>),
    /// The base moves and rotates freely, like any other part of the rod: only holds, springs and
    /// contacts bear the rod. Holds of positions and springs may act at the base. The base starts
    /// where the initial shape of the rod has it; a scene whose base moves or rotates later has no
    /// effect. A motion that nothing resists and no force causes does not occur. The energy of an
    /// equilibrium then includes the work of the load from the origin to the base.
    Free,
}

impl Support for Joint {
    fn base(&self) -> Option<Joint> {
        Some(*self)
    }

    fn check(&self) -> Result<(), ParameterError> {
        match self {
            Self::Ball | Self::Free => Ok(()),
            Self::Hinge(axis) => {
                ParameterError::unit("norm of the axis of the base's hinge", axis.norm())
            }
        }
    }
}
