//! Forces on the apex, n(ℓ) in equation (11).

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// Force on the apex as a smooth function of time, in the fixed frame. The closure or function
/// takes the time in s and returns N.
///
/// ```
/// use morphorod::load::ApicalForce;
/// use morphorod::nalgebra::Vector3;
/// let pull = ApicalForce(|_t: f64| Vector3::new(0.0, 0.0, 1e-5));
/// # let _ = pull;
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ApicalForce<F>(
    /// Force (N) as a function of time (s).
    pub F,
);

impl<F: Fn(f64) -> Vector3<f64>> Load for ApicalForce<F> {
    #[inline]
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        (self.0)(environment.time)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("apical force at t = 0", (self.0)(0.0).sum(), "N")
    }
}

/// Force on the apex that increases and decreases as half a sine from `start` to `start +
/// duration`, and is zero before and after.
///
/// Its time derivative is discontinuous at both times.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pulse {
    /// Largest force, in the fixed frame, N.
    pub peak: Vector3<f64>,
    /// Start, s.
    pub start: f64,
    /// Duration, s; positive.
    pub duration: f64,
}

impl Load for Pulse {
    #[inline]
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        let phase = (environment.time - self.start) / self.duration;
        if (0.0..=1.0).contains(&phase) {
            self.peak * (PI * phase).sin()
        } else {
            Vector3::zeros()
        }
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let mut ends = [self.start, self.start + self.duration].into_iter();
        let next = ends.find(|time| *time > t && self.peak != Vector3::zeros());
        next.unwrap_or(f64::INFINITY)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("peak of the apical pulse", self.peak.sum(), "N")?;
        ParameterError::finite("start of the apical pulse", self.start, "s")?;
        ParameterError::positive("duration of the apical pulse", self.duration, "s")
    }
}
