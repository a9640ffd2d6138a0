//! Stiffness that varies along the shoot.

use std::fmt;

use super::{Constitutive, ElasticResponse, LineResponse, Tissue};
use crate::error::ParameterError;
use nalgebra::Vector3;

/// An elastic law multiplied by a function of the tissue: energy, couple, tangent, and the stiffness against
/// shear and stretch.
///
/// ```
/// use morphorod::Shoot;
/// use morphorod::constitutive::{Graded, LinearElastic, Tissue};
///
/// // A shoot of 10 cm that is three times as stiff at its base as at its tip.
/// let law = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// let graded = Graded { law, factor: |tissue: &Tissue| 1.0 + 20.0 * tissue.initial_apex_distance };
/// let shoot = Shoot::builder(graded).length(0.1).radius(5e-4).build()?;
/// # let _ = shoot;
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
#[derive(Clone, Copy)]
pub struct Graded<C, F> {
    /// The elastic law.
    pub law: C,
    /// Factor of the stiffness as a function of the tissue; positive and finite.
    pub factor: F,
}

impl<C: fmt::Debug, F> fmt::Debug for Graded<C, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Graded").field("law", &self.law).finish_non_exhaustive()
    }
}

impl<C: Constitutive, F: Fn(&Tissue) -> f64> Constitutive for Graded<C, F> {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let (factor, law) = ((self.factor)(tissue), self.law.respond(tissue, strain));
        ElasticResponse { energy: law.energy * factor, couple: law.couple * factor, tangent: law.tangent * factor }
    }

    #[inline]
    fn line_response(&self, tissue: &Tissue, force: &Vector3<f64>) -> Option<LineResponse> {
        // The strain depends on force over stiffness.
        let factor = (self.factor)(tissue);
        let law = self.law.line_response(tissue, &(force / factor))?;
        Some(LineResponse { energy: law.energy * factor, compliance: law.compliance / factor, ..law })
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.law.check()
    }
}
