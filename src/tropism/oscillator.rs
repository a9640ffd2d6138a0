//! The endogenous oscillator.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Growing, TropismLaw};
use crate::error::ParameterError;

/// The way in which something turns about d3, an oscillator's gradient or the tip of a shoot, seen from the apex towards the base:
/// from above, on an upright shoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Handedness {
    /// From d1 towards d2, as equation (5) is printed.
    #[default]
    Counterclockwise,
    /// From d1 towards −d2.
    Clockwise,
}

/// Equation (5): r u̇1* = α REGR cos(2πt/τe + φ), r u̇2* = ±α REGR sin(2πt/τe + φ).
///
/// Usual values: α = 0 (none) to 0.3, 0.2 for the growing shoot; τe = 20 to 24 min (Agostinelli, DeSimone and Noselli 2021).
///
/// It depends on time alone: no variables, no memory, no delay. In an elliptic section r is the semi-axis across which growth
/// differs: along d2 for u1, along d1 for u2.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Oscillator {
    /// Sensitivity α.
    pub sensitivity: f64,
    /// Period τe, s.
    pub period: f64,
    /// Phase φ at t = 0, rad.
    pub phase: f64,
    /// Which way it turns.
    pub handedness: Handedness,
}

impl Oscillator {
    /// An oscillator that turns counterclockwise and starts at phase zero.
    #[must_use]
    pub fn new(sensitivity: f64, period: f64) -> Self {
        Self { sensitivity, period, phase: 0.0, handedness: Handedness::Counterclockwise }
    }
}

impl TropismLaw for Oscillator {
    fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let (sin, cos) = (TAU * at.time / self.period + self.phase).sin_cos();
        let sin = if self.handedness == Handedness::Counterclockwise { sin } else { -sin };
        Vector3::new(cos / at.section.along_d2, sin / at.section.along_d1, 0.0) * self.sensitivity
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("sensitivity of the oscillator", self.sensitivity)?;
        ParameterError::positive("period of the oscillator", self.period)?;
        ParameterError::finite("phase of the oscillator", self.phase)
    }
}
