//! A force on the apex that turns about the vertical.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// A horizontal apical force of constant size that turns about e3, from e1 towards e2, from t = 0 on, and ends after
/// some turns. It brings a shoot near a circular orbit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Whirl {
    /// Size of the force, N.
    pub force: f64,
    /// Time of one turn, s.
    pub period: f64,
    /// Number of turns; the force is dropped after them.
    pub turns: f64,
}

impl Load for Whirl {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        if !(0.0..=self.period * self.turns).contains(&environment.time) {
            return Vector3::zeros();
        }
        let (sin, cos) = (TAU * environment.time / self.period).sin_cos();
        Vector3::new(cos, sin, 0.0) * self.force
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        let end = self.period * self.turns;
        if t < end { end } else { f64::INFINITY }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("size of the turning force", self.force)?;
        ParameterError::positive("period of the turning force", self.period)?;
        ParameterError::positive("number of turns of the turning force", self.turns)
    }
}
