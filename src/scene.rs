//! Gravity and the base, both of which may change in time.

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::pointers::{forward_methods, forward_pointers};

/// Time and gravity, the arguments of loads and laws that are the same along the whole shoot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Environment {
    /// Time, s.
    pub time: f64,
    /// Acceleration of gravity in the fixed frame, m/s²; it points down. It acts on weight and
    /// statoliths.
    pub gravity: Vector3<f64>,
}

impl Environment {
    /// The unit vector −g/|g| that points up, in the fixed frame; zero without gravity.
    #[must_use]
    #[inline]
    pub fn up(&self) -> Vector3<f64> {
        let g = self.gravity.norm();
        if g > 0.0 {
            -self.gravity / g
        } else {
            Vector3::zeros()
        }
    }
}

/// Gravity and the base as functions of time, for example a clinostat, with time steps of at most
/// 1/20 of a rotation:
///
/// ```
/// use morphorod::Scene;
/// use morphorod::nalgebra::{UnitQuaternion, Vector3};
///
/// /// Rotation of the base about the horizontal axis e1, by its rate in rad/s.
/// struct Clinostat(f64);
///
/// impl Scene for Clinostat {
///     fn gravity(&self, _t: f64) -> Vector3<f64> {
///         Vector3::new(0.0, 0.0, -9.81)
///     }
///     fn base(&self, t: f64) -> UnitQuaternion<f64> {
///         UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.0 * t)
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a scene",
    note = "`Shoot::builder` takes the elastic law, `.growth`, `.tropism`, `.load` and `.scene` take the others",
    note = "scenes implement `morphorod::Scene`: `Still`, `Turned` and `Along` do"
)]
pub trait Scene {
    /// The acceleration of gravity at time `t` (s) in the fixed frame, m/s².
    fn gravity(&self, t: f64) -> Vector3<f64>;

    /// The frame of the clamped base at time `t` (s), which rotates e1, e2, e3 into the directors
    /// d1, d2, d3.
    fn base(&self, t: f64) -> UnitQuaternion<f64>;

    /// The position of the base at time `t` (s) in the fixed frame, m; the origin by default. A
    /// shoot without supports moves along without a change of its shape, since inertia is
    /// neglected. Positions have the rounding of their distance from the origin. Choose the origin
    /// within some tens of lengths of the shoot.
    fn position(&self, _t: f64) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// The first time after `t` (s) at which gravity, frame or position of the base, or a first
    /// derivative of them, is discontinuous; infinite without one. Integrators end a step there and
    /// evaluate the scene a few units of rounding before and after, so the value at the
    /// discontinuity itself does not matter.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }

    /// Time and gravity at time `t` (s).
    fn environment(&self, t: f64) -> Environment {
        Environment {
            time: t,
            gravity: self.gravity(t),
        }
    }
}

forward_pointers!(Scene {
    fn gravity(t: f64) -> Vector3<f64>;
    fn base(t: f64) -> UnitQuaternion<f64>;
    fn position(t: f64) -> Vector3<f64>;
    fn environment(t: f64) -> Environment;
    fn next_discontinuity(t: f64) -> f64;
    fn check() -> Result<(), ParameterError>;
});

/// The earlier of two times of discontinuities; NaN if one of them is NaN.
pub(crate) fn earlier(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}

/// Distance from a discontinuity at which laws are evaluated before and after it, in units of
/// rounding of the time. It makes laws written with `<` and `<=` equivalent, and exceeds the
/// rounding of expressions such as `t − from < duration`.
const MARGIN: f64 = 4.0;

/// A time just before a discontinuity.
pub(crate) fn before(time: f64) -> f64 {
    time - MARGIN * (time.abs().next_up() - time.abs())
}

/// A time just after a discontinuity.
pub(crate) fn after(time: f64) -> f64 {
    -before(-time)
}

/// Constant gravity and a fixed base at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub struct Still {
    /// Acceleration of gravity in the fixed frame, m/s².
    pub gravity: Vector3<f64>,
    /// Frame of the base, which rotates e1, e2, e3 into d1, d2, d3.
    pub base: UnitQuaternion<f64>,
}

impl Still {
    /// Gravity of 9.81 m/s² along −e3, as in the paper of the model, and an upright base: dj = ej.
    pub fn upright() -> Self {
        Self {
            gravity: Vector3::new(0.0, 0.0, -9.81),
            base: UnitQuaternion::identity(),
        }
    }

    /// An upright base rotated by `angle` (rad) about e2, so that its tangent d3 leans towards +e1.
    /// At π/2 the base is horizontal: d1 = −e3, d2 = e2, d3 = e1.
    pub fn tilted(angle: f64) -> Self {
        Self {
            base: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle),
            ..Self::upright()
        }
    }

    /// An upright base without gravity.
    pub fn weightless() -> Self {
        Self {
            gravity: Vector3::zeros(),
            base: UnitQuaternion::identity(),
        }
    }
}

impl Scene for Still {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        self.gravity
    }

    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        self.base
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("gravity", self.gravity.sum(), "m/s²")?;
        ParameterError::finite("tilt or frame of the base", self.base.coords.sum(), "")?;
        ParameterError::unit(
            "norm of the base frame's quaternion",
            self.base.coords.norm(),
        )
    }
}

/// A scene whose base is rotated during an interval of time: a pot that is laid on its side and put
/// up again.
///
/// ```
/// use morphorod::{Scene, Turned};
/// // A tilt of half a radian, from one hour to one and a half.
/// let pot = Turned::tilted(0.5, 3600.0, 5400.0);
/// assert_eq!(pot.base(3000.0).angle(), 0.0);
/// assert!((pot.base(4000.0).angle() - 0.5).abs() < 1e-15);
/// assert_eq!((pot.next_discontinuity(0.0), pot.next_discontinuity(3600.0)), (3600.0, 5400.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[doc(alias = "clinostat")]
pub struct Turned<S = Still> {
    /// The scene outside the interval.
    pub scene: S,
    /// Rotation in the fixed frame that follows the frame of the base in `scene`: for `from` ≤ t <
    /// `until` the base is `turn` · `scene.base(t)`. Gravity is that of `scene`.
    pub turn: UnitQuaternion<f64>,
    /// Start of the interval, s; finite.
    pub from: f64,
    /// End of the interval, s, at which the base has returned; later than `from`, may be infinite.
    pub until: f64,
}

impl Turned {
    /// An upright base that leans towards +e1 by `angle` (rad), as in [`Still::tilted`], between
    /// two times (s).
    #[must_use]
    pub fn tilted(angle: f64, from: f64, until: f64) -> Self {
        Self {
            scene: Still::upright(),
            turn: Still::tilted(angle).base,
            from,
            until,
        }
    }
}

impl<S: Scene> Scene for Turned<S> {
    forward_methods!(self, Scene of self.scene =>
        fn gravity(t: f64) -> Vector3<f64>;
        fn position(t: f64) -> Vector3<f64>;
    );

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        let base = self.scene.base(t);
        if t >= self.from && t < self.until {
            self.turn * base
        } else {
            base
        }
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let ahead = [self.from, self.until].into_iter().filter(|time| *time > t);
        ahead.fold(self.scene.next_discontinuity(t), earlier)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.scene.check()?;
        ParameterError::finite("rotation of the base", self.turn.coords.sum(), "")?;
        ParameterError::finite("`from` of a turned base", self.from, "s")?;
        let (name, until) = ("`until` of a turned base", self.until);
        ParameterError::unless(until > self.from, name, until, "later than `from` (s)")
    }
}

/// A scene whose base moves along a path: a pot that is carried, or that is not on the axis of a
/// turntable.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::{Along, Scene, Still};
/// // The base moves towards +e1 by 1 mm in an hour.
/// let pot = Along { scene: Still::upright(), path: |t: f64| Vector3::x() * (1e-3 * t / 3600.0) };
/// assert_eq!(pot.position(7200.0), Vector3::x() * 2e-3);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along<P, S = Still> {
    /// Gravity and the frame of the base.
    pub scene: S,
    /// Displacement of the base in the fixed frame, m, as a function of time (s), which is added to
    /// the position in `scene`. The function and its first derivative must be continuous; a path
    /// with kinks needs a [`Scene`] that announces them.
    pub path: P,
}

impl<P: Fn(f64) -> Vector3<f64>, S: Scene> Scene for Along<P, S> {
    forward_methods!(self, Scene of self.scene =>
        fn gravity(t: f64) -> Vector3<f64>;
        fn base(t: f64) -> UnitQuaternion<f64>;
        fn next_discontinuity(t: f64) -> f64;
    );

    fn position(&self, t: f64) -> Vector3<f64> {
        self.scene.position(t) + (self.path)(t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.scene.check()?;
        ParameterError::finite(
            "position of the base at t = 0",
            self.position(0.0).sum(),
            "m",
        )
    }
}
