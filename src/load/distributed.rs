//! Force per unit length.

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// Constant force per unit of unstretched length, in the fixed frame, f in equation (11).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Distributed(
    /// Force per unit length, N/m.
    pub Vector3<f64>,
);

impl Load for Distributed {
    #[inline]
    fn force(&self, cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        self.0 * cut.length_beyond
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("distributed load", self.0.sum(), "N/m")
    }
}
