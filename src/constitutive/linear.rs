//! Linear elasticity of a circular section.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::{Constitutive, ElasticResponse, Tissue};
use crate::error::ParameterError;

/// Equation (10): mj = Kj (uj − uj*) with K1 = K2 = E I, K3 = μ J, I = π r⁴/4, J = 2 I, μ = E / (2 (1 + ν)).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinearElastic {
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio ν, in (−1, 0.5].
    pub poissons_ratio: f64,
}

impl LinearElastic {
    /// The stiffnesses (K1, K2, K3) of a section of the given radius (m), in N m².
    #[must_use]
    pub fn stiffness(&self, radius: f64) -> Vector3<f64> {
        let bending = self.youngs_modulus * PI * radius.powi(4) / 4.0;
        Vector3::new(bending, bending, bending / (1.0 + self.poissons_ratio))
    }

    /// The response with every stiffness multiplied by `factor`.
    pub(super) fn scaled(&self, factor: f64, radius: f64, strain: &Vector3<f64>) -> ElasticResponse {
        let stiffness = self.stiffness(radius) * factor;
        let couple = stiffness.component_mul(strain);
        ElasticResponse { energy: 0.5 * couple.dot(strain), couple, tangent: Matrix3::from_diagonal(&stiffness) }
    }
}

impl Constitutive for LinearElastic {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        self.scaled(1.0, tissue.radius, strain)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("Young's modulus", self.youngs_modulus)?;
        let nu = self.poissons_ratio;
        ParameterError::unless(nu > -1.0 && nu <= 0.5, "Poisson's ratio", nu, "in (−1, 0.5]")
    }
}
