//! Tissue that stiffens after it has left the growth zone.

use nalgebra::Vector3;

use super::{Constitutive, ElasticResponse, LinearElastic, Tissue};
use crate::error::ParameterError;

/// Equation (13): E = E0 in the growth zone, afterwards E1 − (E1 − E0) exp(−age/τℓ); the torsional stiffness in
/// the same ratio.
///
/// Usual values: E0 = 10 MPa, E1 = 200 E0, τℓ = 6 d (Agostinelli, DeSimone and Noselli 2021).
///
/// Stiffening happens at fixed intrinsic strain, so a loaded shoot springs back a little as it lignifies.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lignifying {
    /// The young tissue, E0.
    pub young: LinearElastic,
    /// Young's modulus of mature tissue E1, Pa.
    pub mature_modulus: f64,
    /// Lignification time τℓ, s.
    pub time: f64,
}

impl Lignifying {
    /// E(age)/E0; `age` in s.
    #[must_use]
    pub fn ratio(&self, age: f64) -> f64 {
        if age <= 0.0 {
            return 1.0;
        }
        // 1 + (E1/E0 − 1)(1 − exp(−age/τℓ)), with exp_m1 so that young tissue loses no digits.
        1.0 - (self.mature_modulus / self.young.youngs_modulus - 1.0) * (-age / self.time).exp_m1()
    }
}

impl Constitutive for Lignifying {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        self.young.scaled(self.ratio(tissue.age), tissue.section, strain)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.young.check()?;
        ParameterError::positive("Young's modulus of mature tissue", self.mature_modulus)?;
        ParameterError::positive("lignification time", self.time)
    }
}
