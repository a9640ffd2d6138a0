//! The shoot's own weight.

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// Equation (12): n(s) = ρ g ∫ A ds over what lies beyond s, which is q (ℓ − s) ĝ for a uniform section.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Weight {
    /// Density ρ, kg/m³.
    pub density: f64,
}

impl Load for Weight {
    fn force(&self, cut: &Cut, environment: &Environment) -> Vector3<f64> {
        environment.gravity * (self.density * cut.volume_beyond)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("density", self.density)
    }
}
