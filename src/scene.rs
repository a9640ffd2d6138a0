//! Where the shoot stands: the vector of gravity and the clamped base, both of which may move in time.

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// What surrounds the whole shoot at one time, as loads and laws see it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Environment {
    /// Time, s.
    pub time: f64,
    /// The acceleration of gravity in the fixed frame, m/s²; it points down. Weight and statoliths read the same vector.
    pub gravity: Vector3<f64>,
}

impl Environment {
    /// The unit vector that points up, −ĝ, or zero where there is no gravity.
    #[must_use]
    pub fn up(&self) -> Vector3<f64> {
        let g = self.gravity.norm();
        if g > 0.0 { -self.gravity / g } else { Vector3::zeros() }
    }
}

/// Gravity and the base as functions of time. A clinostat or a pot that is tilted is a scene:
///
/// ```
/// use morphorod::Scene;
/// use morphorod::nalgebra::{UnitQuaternion, Vector3};
///
/// /// A horizontal axis, e1, about which the base turns at a rate in rad/s.
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
    note = "elastic laws go to `Shoot::builder`, growth laws to `.growth`, tropisms to `.tropism`, loads to `.load`, scenes to `.scene`",
    note = "scenes implement `morphorod::Scene`: `Still` and `Turned` do"
)]
pub trait Scene {
    /// The acceleration of gravity at time `t` (s) in the fixed frame, m/s².
    fn gravity(&self, t: f64) -> Vector3<f64>;

    /// The frame of the clamped base at time `t` (s): it turns e1, e2, e3 into the directors d1, d2, d3.
    fn base(&self, t: f64) -> UnitQuaternion<f64>;

    /// The first time after `t` (s) at which gravity or base, or their slopes, have a discontinuity; infinite if there is
    /// none. Integrators step onto it, and read the scene a few units of rounding before and after it: whether it turns for
    /// `t > from` or `t >= from` makes no difference.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }

    /// The instant at time `t`.
    fn environment(&self, t: f64) -> Environment {
        Environment { time: t, gravity: self.gravity(t) }
    }
}

forward_pointers!(Scene {
    fn gravity(t: f64) -> Vector3<f64>;
    fn base(t: f64) -> UnitQuaternion<f64>;
    fn environment(t: f64) -> Environment;
    fn next_discontinuity(t: f64) -> f64;
    fn check() -> Result<(), ParameterError>;
});

/// The earlier of two times at which discontinuities are announced; not a number if one of them is not.
pub(crate) fn earlier(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}

/// Laws are read so many units of rounding of the time before and after a discontinuity, never at it: whether they are
/// written with `<` or `<=` makes no difference then, nor the rounding of `t − from < duration`.
const MARGIN: f64 = 4.0;

/// A time just before a discontinuity.
pub(crate) fn before(time: f64) -> f64 {
    time - MARGIN * rounding(time)
}

/// A time just after a discontinuity.
pub(crate) fn after(time: f64) -> f64 {
    time + MARGIN * rounding(time)
}

/// The distance to the next number.
fn rounding(time: f64) -> f64 {
    time.abs().next_up() - time.abs()
}

/// Gravity and base that do not change.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Still {
    /// The acceleration of gravity in the fixed frame, m/s².
    pub gravity: Vector3<f64>,
    /// The frame of the base: it turns e1, e2, e3 into d1, d2, d3.
    pub base: UnitQuaternion<f64>,
}

impl Still {
    /// Standard gravity of the model's source, 9.81 m/s² along −e3, and an upright base: dj = ej.
    #[must_use]
    pub fn upright() -> Self {
        Self { gravity: Vector3::new(0.0, 0.0, -9.81), base: UnitQuaternion::identity() }
    }

    /// The base turned by `angle` (rad) from upright about e2, so that its tangent d3 leans towards +e1.
    /// At π/2 the base is horizontal: d1 = −e3, d2 = e2, d3 = e1.
    #[must_use]
    pub fn tilted(angle: f64) -> Self {
        Self { base: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle), ..Self::upright() }
    }

    /// An upright base without gravity.
    #[must_use]
    pub fn weightless() -> Self {
        Self { gravity: Vector3::zeros(), base: UnitQuaternion::identity() }
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
        ParameterError::finite("gravity", self.gravity.sum())?;
        ParameterError::finite("base frame", self.base.coords.sum())?;
        let norm = self.base.coords.norm();
        ParameterError::unless((norm - 1.0).abs() < 1e-9, "norm of the base frame's quaternion", norm, "1")
    }
}

/// A scene whose base is turned for a while: a pot that is laid on its side and put up again.
///
/// ```
/// use morphorod::{Scene, Turned};
/// let pot = Turned::tilted(0.5, 3600.0, 5400.0); // by half a radian, from one hour to one and a half
/// assert_eq!(pot.base(3000.0).angle(), 0.0);
/// assert!((pot.base(4000.0).angle() - 0.5).abs() < 1e-15);
/// assert_eq!((pot.next_discontinuity(0.0), pot.next_discontinuity(3600.0)), (3600.0, 5400.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Turned<S = Still> {
    /// The scene, as it is at other times.
    pub scene: S,
    /// The turn of the base, in the fixed frame.
    pub turn: UnitQuaternion<f64>,
    /// When it is turned, s.
    pub from: f64,
    /// When it is turned back, s; infinite if never.
    pub until: f64,
}

impl Turned {
    /// An upright base that leans towards +e1 by `angle` (rad), as [`Still::tilted`], from one time (s) until another.
    #[must_use]
    pub fn tilted(angle: f64, from: f64, until: f64) -> Self {
        Self { scene: Still::upright(), turn: Still::tilted(angle).base, from, until }
    }
}

impl<S: Scene> Scene for Turned<S> {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        self.scene.gravity(t)
    }

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        let base = self.scene.base(t);
        if t >= self.from && t < self.until { self.turn * base } else { base }
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let ahead = [self.from, self.until].into_iter().filter(|time| *time > t);
        ahead.fold(self.scene.next_discontinuity(t), earlier)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.scene.check()?;
        ParameterError::finite("turn of the base", self.turn.coords.sum())?;
        ParameterError::finite("`from` of a turned base", self.from)?;
        let (name, until) = ("`until` of a turned base", self.until);
        ParameterError::unless(until > self.from, name, until, "later than `from` (s)")
    }
}
