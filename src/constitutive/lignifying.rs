//! Tissue that stiffens with age after it has left the growth zone.

use nalgebra::Vector3;

use super::{Constitutive, ElasticResponse, LinearElastic, Tissue};
use crate::error::ParameterError;

/// Lignifying tissue, equation (13): E = E0 in the growth zone, and E = E1 − (E1 − E0) exp(−age/τℓ)
/// outside. The torsional stiffness is proportional to E.
///
/// Usual values: E0 = 10 MPa, E1 = 200 E0, τℓ = 6 d (Agostinelli, DeSimone and Noselli 2021).
///
/// The intrinsic strain does not change with E, so the elastic strain of a loaded shoot decreases
/// as it lignifies.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lignifying {
    /// Elastic law of young tissue, with E0.
    pub young: LinearElastic,
    /// Young's modulus E1 of mature tissue, Pa; at least that of young tissue.
    pub mature_modulus: f64,
    /// Lignification time τℓ, s.
    pub time: f64,
}

impl Lignifying {
    /// The ratio E(age)/E0; `age` in s.
    #[must_use]
    #[inline]
    pub fn ratio(&self, age: f64) -> f64 {
        if age <= 0.0 {
            return 1.0;
        }
        // 1 + (E1/E0 − 1)(1 − exp(−age/τℓ)), with exp_m1 to avoid cancellation in young tissue.
        1.0 - (self.mature_modulus / self.young.youngs_modulus - 1.0) * (-age / self.time).exp_m1()
    }
}

impl Constitutive for Lignifying {
    #[inline]
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        self.young
            .scaled(self.ratio(tissue.age), tissue.section, strain)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.young.check()?;
        let (name, modulus) = ("Young's modulus of mature tissue", self.mature_modulus);
        ParameterError::positive(name, modulus, "Pa")?;
        let ok = modulus >= self.young.youngs_modulus;
        ParameterError::unless(ok, name, modulus, "at least that of young tissue (Pa)")?;
        ParameterError::positive("lignification time", self.time, "s")
    }
}
