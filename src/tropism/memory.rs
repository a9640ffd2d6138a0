//! The memory with delay through which a stimulus acts.

use crate::error::ParameterError;

/// `M[x](t) = (1/τm) ∫ exp(−(t − τr − τ)/τm) x(τ) dτ` up to t − τr: an exponential memory, read with a delay.
///
/// Usual values: τm = τr = 12 min, for gravitropism and proprioception alike (Agostinelli, DeSimone and Noselli 2021).
///
/// The same without the integral: τm ẏ = x − y and `M[x](t) = y(t − τr)`. The filter comes first, the delay after.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    /// Memory time τm, s.
    pub time: f64,
    /// Reaction time τr, s; zero for a response without delay.
    pub delay: f64,
}

impl Memory {
    /// The rate ẏ = (x − y)/τm.
    #[must_use]
    pub fn rate(&self, y: f64, x: f64) -> f64 {
        (x - y) / self.time
    }

    /// Refuses times that make no sense.
    ///
    /// # Errors
    /// The first such time.
    pub fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("memory time", self.time)?;
        ParameterError::not_negative("reaction time", self.delay)
    }
}
