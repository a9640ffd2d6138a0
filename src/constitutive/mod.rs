//! How tissue resists bending and twist: elastic laws with an energy.

mod graded;
mod lignifying;
mod linear;

pub use graded::Graded;
pub use lignifying::Lignifying;
pub use linear::LinearElastic;

use nalgebra::{Matrix3, Vector3};

use crate::error::ParameterError;
use crate::pointers::forward_pointers;
pub use crate::rod::Tissue;

/// The answer of an elastic law to a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticResponse {
    /// Elastic energy per unit length, J/m.
    pub energy: f64,
    /// Its gradient: the couple (bending about d1 and d2, twisting about d3), components along the directors, N m.
    pub couple: Vector3<f64>,
    /// Its second derivative, symmetric, N m².
    pub tangent: Matrix3<f64>,
}

/// A hyperelastic law: the couple is the gradient of an energy density, which the equilibrium minimises.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an elastic law",
    note = "elastic laws go to `Shoot::builder`, growth laws to `.growth`, tropisms to `.tropism`, loads to `.load`, scenes to `.scene`",
    note = "elastic laws implement `morphorod::constitutive::Constitutive`, as `LinearElastic` does"
)]
pub trait Constitutive {
    /// The response to the elastic strain u − u* (1/m, components along the directors), equations (9) and (10).
    ///
    /// The energy must be zero at zero strain and the tangent must be the exact derivative of the couple, or Newton's
    /// method loses its quadratic convergence.
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse;

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// The elastic strain under which a law answers with the given couple: one Newton step from a strain near it, exact for a linear law
/// and of twice its order for others.
pub(crate) fn strain_under(
    law: &impl Constitutive,
    tissue: &Tissue,
    near: &Vector3<f64>,
    couple: &Vector3<f64>,
) -> Vector3<f64> {
    let response = law.respond(tissue, near);
    let inverse = response.tangent.try_inverse().unwrap_or_else(Matrix3::zeros);
    near + inverse * (couple - response.couple)
}

forward_pointers!(Constitutive {
    fn respond(tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse;
    fn check() -> Result<(), ParameterError>;
});
