//! Forces on the apex.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// A force on the apex, in the fixed frame, as a smooth function of time (s): any closure or function that gives newtons.
///
/// ```
/// use morphorod::load::ApicalForce;
/// use morphorod::nalgebra::Vector3;
/// let pull = ApicalForce(|_t: f64| Vector3::new(0.0, 0.0, 1e-5));
/// # let _ = pull;
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ApicalForce<F>(
    /// The force in N as a function of time in s.
    pub F,
);

impl<F: Fn(f64) -> Vector3<f64>> Load for ApicalForce<F> {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        (self.0)(environment.time)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("apical force at t = 0", (self.0)(0.0).sum())
    }
}

/// A force on the apex that swells and fades once: a half sine, zero before `start` and after `start + duration`.
///
/// The slope jumps at both ends, and an integrator steps onto them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pulse {
    /// The force at its peak, in the fixed frame, N.
    pub peak: Vector3<f64>,
    /// When it begins, s.
    pub start: f64,
    /// How long it lasts, s.
    pub duration: f64,
}

impl Load for Pulse {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        let phase = (environment.time - self.start) / self.duration;
        if (0.0..=1.0).contains(&phase) { self.peak * (PI * phase).sin() } else { Vector3::zeros() }
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let end = self.start + self.duration;
        if t < self.start {
            self.start
        } else if t < end {
            end
        } else {
            f64::INFINITY
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("peak of the apical pulse", self.peak.sum())?;
        ParameterError::finite("start of the apical pulse", self.start)?;
        ParameterError::positive("duration of the apical pulse", self.duration)
    }
}
