//! Weight of the shoot.

use std::fmt;

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::rod::Tissue;
use crate::scene::Environment;

/// Weight, equation (12): n(s) = ρ g ∫ A ds over the part beyond s, which is q (ℓ − s) ĝ for a
/// uniform section.
///
/// The default density is 1000 kg/m³, that of water (Agostinelli, DeSimone and Noselli 2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Weight {
    /// Density ρ, kg/m³; zero for no weight.
    pub density: f64,
}

impl Default for Weight {
    fn default() -> Self {
        Self { density: 1000.0 }
    }
}

impl Weight {
    /// q ℓ³/(E I) at which a slender upright shoot of length ℓ, weight q per length and bending
    /// stiffness E I begins to buckle under its own weight: (9/4) j², with j = 1.866350858873895
    /// the first zero of the Bessel function J₋₁⸝₃. It holds for a uniform section without shear
    /// and stretch.
    ///
    /// A. G. Greenhill, *Determination of the greatest height consistent with stability that a
    /// vertical pole or mast can be made*, Proc. Camb. Phil. Soc. 4, 65–73 (1881).
    #[doc(alias("Greenhill", "self-buckling", "critical length"))]
    pub const GREENHILL: f64 = 7.837_347_438_943_484;
}

impl Load for Weight {
    #[inline]
    fn force(&self, cut: &Cut, environment: &Environment) -> Vector3<f64> {
        environment.gravity * (self.density * cut.volume_beyond)
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative("density", self.density, "kg/m³")
    }
}

/// Weight of a shoot with varying density: n(s) = g ∫ ρ A ds over the part beyond s.
///
/// ```
/// use morphorod::constitutive::Tissue;
/// use morphorod::load::GradedWeight;
/// // The density is doubled at the tip. The increase decays over 1 cm of the shoot at t = 0.
/// let weight = GradedWeight(|tissue: &Tissue| 1000.0 * (1.0 + (-tissue.initial_apex_distance / 0.01).exp()));
/// # let _ = weight;
/// ```
#[derive(Clone, Copy)]
pub struct GradedWeight<F>(
    /// Density ρ (kg/m³) as a function of the tissue at a point.
    pub F,
);

impl<F> fmt::Debug for GradedWeight<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("GradedWeight(..)")
    }
}

impl<F: Fn(&Tissue) -> f64> Load for GradedWeight<F> {
    #[inline]
    fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }

    #[inline]
    fn per_length(&self, tissue: &Tissue, environment: &Environment) -> Vector3<f64> {
        environment.gravity * ((self.0)(tissue) * tissue.section.area())
    }
}
