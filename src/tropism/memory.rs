//! Exponential memory with delay.

use crate::error::ParameterError;

/// Exponential memory with a delay, M in equations (7) and (8):
///
/// ```text
/// M[x](t) = (1/τm) ∫ exp(−(t − τr − τ)/τm) x(τ) dτ, integrated up to τ = t − τr.
/// ```
///
/// It is computed as `M[x](t) = y(t − τr)` with τm ẏ = x − y. The default is τm = τr = 12 min, the
/// value of Agostinelli, DeSimone and Noselli (2021) for gravitropism and proprioception of
/// *Arabidopsis thaliana*.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    /// Memory time τm, s; positive.
    pub time: f64,
    /// Reaction time τr, s, not negative; zero for a response without delay.
    pub delay: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            time: 720.0,
            delay: 720.0,
        }
    }
}

impl Memory {
    /// Rate ẏ = (x − y)/τm of the memory y of a signal x, in the unit of x per second.
    #[must_use]
    pub fn rate(&self, y: f64, x: f64) -> f64 {
        (x - y) / self.time
    }

    /// Checks both times.
    ///
    /// # Errors
    /// The first one that is out of range.
    pub fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("memory time", self.time, "s")?;
        ParameterError::not_negative("reaction time", self.delay, "s")
    }
}
