//! Force on the apex that rotates about the vertical.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// Horizontal force of constant norm on the apex that rotates about e3, from e1 towards e2,
/// beginning at t = 0 along e1. It is zero after a number of turns. Such a force brings a shoot
/// near a circular orbit, as in figure 6 of Agostinelli, DeSimone and Noselli (2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Whirl {
    /// Norm of the force, N.
    pub force: f64,
    /// Duration of a turn, s.
    pub period: f64,
    /// Number of turns; positive, not necessarily a whole number.
    pub turns: f64,
}

impl Load for Whirl {
    #[inline]
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

    fn shortest_period(&self, t: f64) -> f64 {
        if self.force != 0.0 && t < self.period * self.turns {
            self.period
        } else {
            f64::INFINITY
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("size of the rotating force", self.force, "N")?;
        ParameterError::positive("period of the rotating force", self.period, "s")?;
        ParameterError::positive("number of turns of the rotating force", self.turns, "")
    }
}
