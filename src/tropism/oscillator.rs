//! Endogenous oscillator.

use std::f64::consts::TAU;
use std::fmt;

use nalgebra::Vector3;

use super::{Growing, TropismLaw};
use crate::error::ParameterError;

/// Sense of rotation about d3, seen from the apex towards the base, which is from above for an
/// upright shoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Handedness {
    /// From d1 towards d2, as in equation (5).
    #[default]
    Counterclockwise,
    /// From d1 towards −d2.
    Clockwise,
}

impl Handedness {
    /// The sense of a rotation by an angle or of an area with a sign, none if it is zero or NaN.
    pub(crate) fn of(turn: f64) -> Option<Self> {
        let sense = if turn > 0.0 {
            Self::Counterclockwise
        } else {
            Self::Clockwise
        };
        (turn.abs() > 0.0).then_some(sense)
    }
}

impl fmt::Display for Handedness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Counterclockwise => "counterclockwise",
            Self::Clockwise => "clockwise",
        })
    }
}

/// Differential growth with a direction that rotates at a constant rate, equation (5), here with a
/// phase φ:
///
/// ```text
/// r u̇1* = α REGR cos(2πt/τe + φ),   r u̇2* = ±α REGR sin(2πt/τe + φ).
/// ```
///
/// The sign is + for the counterclockwise sense. The law has no variables. In an elliptic section r
/// is the semi-axis along d2 for u1, and that along d1 for u2. Usual values are α = 0 to 0.3, 0.2
/// for the growing shoot, and τe = 20 to 24 min (Agostinelli, DeSimone and Noselli 2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[doc(alias = "circumnutation")]
pub struct Oscillator {
    /// Sensitivity α, without unit.
    pub sensitivity: f64,
    /// Period τe, s.
    pub period: f64,
    /// Phase φ at t = 0, rad.
    pub phase: f64,
    /// Sense of rotation of the gradient.
    pub handedness: Handedness,
}

impl Oscillator {
    /// Counterclockwise oscillator of sensitivity α (without unit) and period τe (s), with phase
    /// zero.
    #[must_use]
    pub fn new(sensitivity: f64, period: f64) -> Self {
        Self {
            sensitivity,
            period,
            phase: 0.0,
            handedness: Handedness::Counterclockwise,
        }
    }
}

impl TropismLaw for Oscillator {
    #[inline]
    fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let (sin, cos) = (TAU * at.time / self.period + self.phase).sin_cos();
        let sin = if self.handedness == Handedness::Counterclockwise {
            sin
        } else {
            -sin
        };
        Vector3::new(cos / at.section.along_d2, sin / at.section.along_d1, 0.0) * self.sensitivity
    }

    fn shortest_period(&self) -> f64 {
        if self.sensitivity == 0.0 {
            f64::INFINITY
        } else {
            self.period
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("sensitivity of the oscillator", self.sensitivity, "")?;
        ParameterError::positive("period of the oscillator", self.period, "s")?;
        ParameterError::finite("phase of the oscillator", self.phase, "rad")
    }
}
