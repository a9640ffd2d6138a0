//! Linear elasticity.

use nalgebra::{Matrix3, Vector3};

use super::{Constitutive, ElasticResponse, Tissue};
use crate::error::ParameterError;
use crate::section::Section;

/// Linear elasticity, equation (10): mj = Kj (uj − uj*) with K1 = E I1, K2 = E I2, K3 = μ J and μ =
/// E/(2 (1 + ν)). For a circle, I1 = I2 = π r⁴/4 and J = 2 I1; for an ellipse, see [`Section`].
///
/// Usual values: E = 10 MPa and ν = 0.5 for young tissue of *Arabidopsis thaliana*, 2 GPa for
/// mature tissue, with a radius of 0.5 mm (Agostinelli, DeSimone and Noselli 2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinearElastic {
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio ν, in (−1, 0.5].
    pub poissons_ratio: f64,
}

impl LinearElastic {
    /// The stiffnesses (K1, K2, K3) of a section, or of a circle of the given radius (m), in N m².
    #[must_use]
    #[inline]
    pub fn stiffness(&self, section: impl Into<Section>) -> Vector3<f64> {
        let section = section.into();
        let [first, second] = section.second_moments();
        let torsion = section.torsion_constant() / (2.0 * (1.0 + self.poissons_ratio));
        Vector3::new(first, second, torsion) * self.youngs_modulus
    }

    /// The response with every stiffness multiplied by `factor`.
    #[inline]
    pub(super) fn scaled(
        &self,
        factor: f64,
        section: Section,
        strain: &Vector3<f64>,
    ) -> ElasticResponse {
        let stiffness = self.stiffness(section) * factor;
        let couple = stiffness.component_mul(strain);
        ElasticResponse {
            energy: 0.5 * couple.dot(strain),
            couple,
            tangent: Matrix3::from_diagonal(&stiffness),
        }
    }
}

impl Constitutive for LinearElastic {
    #[inline]
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        self.scaled(1.0, tissue.section, strain)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("Young's modulus", self.youngs_modulus, "Pa")?;
        let nu = self.poissons_ratio;
        ParameterError::unless(
            nu > -1.0 && nu <= 0.5,
            "Poisson's ratio",
            nu,
            "above −1 and at most 0.5",
        )
    }
}
