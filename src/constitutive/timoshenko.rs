//! Linear shear and stretch in addition to bending and twist.

use nalgebra::{Matrix3, Vector3};

use super::{Constitutive, ElasticResponse, LineResponse, LinearElastic, Tissue};
use crate::error::ParameterError;

/// A law of bending and twist with shear and stretch added, linear in the force along the
/// directors: n1 = κ G A v1, n2 = κ G A v2, n3 = E A (v3 − 1). A rod with it is Cosserat's; a
/// planar one is Reissner's, and Timoshenko's beam for small deflections.
///
/// The area of the section is constant. The buckling load P of a column satisfies
/// P (1 + P/(κ G A) − P/(E A)) = P_E, with P_E that of
/// Euler; this is Haringx's formula for a column without stretch. A compression of at
/// least E A is an error of the solver:
/// [`EquilibriumError::Crushed`](crate::equilibrium::EquilibriumError::Crushed).
///
/// The moduli are independent of those of the law for bending. For tissue that stiffens in all
/// strains, wrap this law in [`Graded`](super::Graded):
///
/// ```
/// use morphorod::constitutive::{Graded, Lignifying, LinearElastic, Tissue, Timoshenko};
/// use morphorod::Shoot;
///
/// let young = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// let wood = Lignifying { young, mature_modulus: 2e9, time: 518_400.0 };
/// let law = Graded { law: Timoshenko::circular(young), factor: move |tissue: &Tissue| wood.ratio(tissue.age) };
/// let shoot = Shoot::builder(law).length(0.05).radius(5e-4).build()?;
/// # let _ = shoot;
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
///
/// S. P. Timoshenko, *On the correction for shear of the differential equation for transverse
/// vibrations of prismatic bars*, Phil. Mag. 41, 744–746 (1921); E. Reissner, *On one-dimensional
/// finite-strain beam theory: the plane problem*, Z. angew. Math. Phys. 23, 795–804 (1972).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Timoshenko<C> {
    /// Law of bending and twist.
    pub law: C,
    /// Young's modulus E for stretch, Pa; positive, infinite without stretch.
    pub youngs_modulus: f64,
    /// Shear modulus G, Pa; positive, infinite without shear.
    pub shear_modulus: f64,
    /// Shear factor κ of the section; in (0, 1] for a solid homogeneous section.
    pub shear_factor: f64,
}

impl Timoshenko<LinearElastic> {
    /// The law with the moduli of linear tissue, G = E/(2 (1 + ν)), and the shear factor of a
    /// circular section, κ = 6 (1 + ν)/(7 + 6 ν).
    ///
    /// G. R. Cowper, *The shear coefficient in Timoshenko's beam theory*, J. Appl. Mech. 33,
    /// 335–340 (1966).
    #[must_use]
    pub fn circular(law: LinearElastic) -> Self {
        let LinearElastic {
            youngs_modulus,
            poissons_ratio: nu,
        } = law;
        let shear_factor = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu);
        Self {
            law,
            youngs_modulus,
            shear_modulus: youngs_modulus / (2.0 * (1.0 + nu)),
            shear_factor,
        }
    }
}

impl<C: Constitutive> Constitutive for Timoshenko<C> {
    #[inline]
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        self.law.respond(tissue, strain)
    }

    #[inline]
    fn line_response(&self, tissue: &Tissue, force: &Vector3<f64>) -> Option<LineResponse> {
        let area = tissue.section.area();
        let (shear, stretch) = (
            self.shear_factor * self.shear_modulus * area,
            self.youngs_modulus * area,
        );
        let compliance = Vector3::new(1.0 / shear, 1.0 / shear, 1.0 / stretch);
        let change = compliance.component_mul(force);
        Some(LineResponse {
            strain: Vector3::z() + change,
            energy: 0.5 * change.dot(force),
            compliance: Matrix3::from_diagonal(&compliance),
        })
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.law.check()?;
        let (stretch, shear) = (self.youngs_modulus, self.shear_modulus);
        ParameterError::unless(
            stretch > 0.0,
            "Young's modulus of stretch",
            stretch,
            "positive (Pa)",
        )?;
        ParameterError::unless(shear > 0.0, "shear modulus", shear, "positive (Pa)")?;
        ParameterError::positive("shear factor", self.shear_factor, "")
    }
}
