//! Elastic laws with an energy: bending, twist, shear and stretch.

mod graded;
mod lignifying;
mod linear;
mod timoshenko;

pub use graded::Graded;
pub use lignifying::Lignifying;
pub use linear::LinearElastic;
pub use timoshenko::Timoshenko;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::pointers::forward_pointers;
use crate::rod::centre_line_tangent;
pub use crate::rod::tissue::Tissue;

/// Response of an elastic law to a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticResponse {
    /// Elastic energy per unit length, J/m.
    pub energy: f64,
    /// Gradient of the energy: the couple m (bending about d1 and d2, twist about d3), components
    /// along the directors, N m.
    pub couple: Vector3<f64>,
    /// Second derivative of the energy, symmetric, N m².
    pub tangent: Matrix3<f64>,
}

/// Response of the centre line to the force in the rod: shear and stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineResponse {
    /// Strain v of the centre line, ∂p/∂s along the directors: shear v1 and v2, stretch v3; (0, 0,
    /// 1) without force.
    pub strain: Vector3<f64>,
    /// Elastic energy Φ(v) per unit of unstretched length, J/m; zero without force.
    pub energy: f64,
    /// Derivative of v with respect to the force along the directors, symmetric and positive
    /// semidefinite, 1/N.
    pub compliance: Matrix3<f64>,
}

/// A hyperelastic law: the couple is the gradient of an energy density, which the equilibrium
/// minimises.
///
/// Tissue that stiffens with strain and hardens with age ([chapter](crate::guide::own_laws)):
///
/// ```
/// use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
/// use morphorod::nalgebra::{Matrix3, Vector3};
///
/// struct StrainStiffening {
///     /// E0, Pa.
///     youngs_modulus: f64,
///     /// κ0, 1/m.
///     curvature: f64,
///     /// τh, s.
///     hardening: f64,
/// }
///
/// impl Constitutive for StrainStiffening {
///     fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
///         let modulus = self.youngs_modulus * (1.0 + tissue.age / self.hardening);
///         let b = modulus * std::f64::consts::PI * tissue.section.radius().powi(4) / 4.0;
///         let c = 2.0 / 3.0 * b;
///         let bend = Vector3::new(strain.x, strain.y, 0.0);
///         let ratio = bend.norm_squared() / self.curvature.powi(2);
///         ElasticResponse {
///             energy: 0.5 * b * bend.norm_squared() * (1.0 + 0.5 * ratio) + 0.5 * c * strain.z.powi(2),
///             couple: bend * (b * (1.0 + ratio)) + Vector3::z() * (c * strain.z),
///             tangent: Matrix3::from_diagonal(&Vector3::new(b * (1.0 + ratio), b * (1.0 + ratio), c))
///                 + bend * bend.transpose() * (2.0 * b / self.curvature.powi(2)),
///         }
///     }
/// }
///
/// let law = StrainStiffening { youngs_modulus: 1e7, curvature: 20.0, hardening: 14400.0 };
/// let mut tissue = Tissue::young(0.5e-3);
/// tissue.age = 3600.0;
/// // A strain, and a force, which has no effect on a law without shear and stretch.
/// let point = (Vector3::new(12.0, -7.0, 5.0), Vector3::zeros());
/// assert_eq!(morphorod::check::elastic_law(&law, &tissue, &[point]), Ok(()));
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an elastic law",
    note = "`Shoot::builder` takes the elastic law, `.growth`, `.tropism`, `.load` and `.scene` take the others",
    note = "elastic laws implement `morphorod::constitutive::Constitutive`, as `LinearElastic` does"
)]
pub trait Constitutive {
    /// The response to the elastic strain u − u* (1/m, components along the directors), equations
    /// (9) and (10).
    ///
    /// Energy and couple must be zero at zero strain. The tangent must be the exact derivative of
    /// the couple, since Newton's method does not converge quadratically otherwise.
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse;

    /// The response of the centre line to a force (N, components along the directors), which is the
    /// gradient of the energy, ∂Φ/∂v. `None`, the default, for a law without shear and stretch.
    ///
    /// A law returns `None` at all places and forces, or at none of them. The derivation is in
    /// [`guide::method`](crate::guide::method), "Shear and stretch".
    #[inline]
    fn line_response(&self, _tissue: &Tissue, _force: &Vector3<f64>) -> Option<LineResponse> {
        None
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// Relative residual of the couple that is attributed to rounding: that of some tens of operations.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The elastic strain at which a law returns the given couple, by one Newton step from zero. It is
/// exact for a linear law; for others it is one Newton step from the strain `near`, which doubles
/// the order of accuracy.
#[inline]
pub(crate) fn strain_near(
    law: &impl Constitutive,
    tissue: &Tissue,
    near: impl FnOnce() -> Vector3<f64>,
    couple: &Vector3<f64>,
) -> Vector3<f64> {
    let from = |strain: &Vector3<f64>| {
        let response = law.respond(tissue, strain);
        let inverse = response
            .tangent
            .try_inverse()
            .unwrap_or_else(Matrix3::zeros);
        strain + inverse * (couple - response.couple)
    };
    let strain = from(&Vector3::zeros());
    let residual = law.respond(tissue, &strain).couple - couple;
    if residual.norm_squared() <= ROUNDING * ROUNDING * couple.norm_squared() {
        strain
    } else {
        from(&near())
    }
}

/// The derivative ∂p/∂s of the centre line at a place with the given frame and force (N, fixed
/// frame), components along the directors.
#[inline]
pub(crate) fn line_strain_under(
    law: &impl Constitutive,
    tissue: &Tissue,
    frame: &UnitQuaternion<f64>,
    force: &Vector3<f64>,
) -> Vector3<f64> {
    let response = law.line_response(tissue, &frame.inverse_transform_vector(force));
    response.map_or(centre_line_tangent(), |response| response.strain)
}

forward_pointers!(Constitutive {
    fn respond(tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse;
    fn line_response(tissue: &Tissue, force: &Vector3<f64>) -> Option<LineResponse>;
    fn check() -> Result<(), ParameterError>;
});
