//! Checks of laws and obstacles: whether what a law returns in one method agrees with what it
//! returns in the others.
//!
//! A wrong sign in a law of your own is not an error of the solvers. A wrong tangent, for example,
//! costs a thousand iterations. Each function of this module evaluates a law at given points, and
//! compares its methods by central differences. The error names the quantity, the component, the
//! place and both numbers of the first contradiction. A test of a law is one line:
//!
//! ```
//! use morphorod::check;
//! use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
//! use morphorod::nalgebra::{Matrix3, Vector3};
//!
//! /// W = K κ³/3 with the norm κ of the elastic strain, and a sign error in the tangent.
//! struct Cubic(f64);
//!
//! impl Constitutive for Cubic {
//!     fn respond(&self, _tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
//!         let norm = strain.norm();
//!         let direction = strain / norm.max(f64::MIN_POSITIVE);
//!         ElasticResponse {
//!             energy: self.0 * norm.powi(3) / 3.0,
//!             couple: strain * (self.0 * norm),
//!             tangent: (Matrix3::identity() - direction * direction.transpose()) * (self.0 * norm),
//!         }
//!     }
//! }
//!
//! let strain = Vector3::new(12.0, -7.0, 5.0);
//! let error = check::elastic_law(&Cubic(1e-9), &Tissue::young(0.5e-3), &[(strain, Vector3::zeros())]).unwrap_err();
//! assert_eq!(error.quantity, check::Quantity::Tangent(0, 0));
//! ```
//!
//! The points should be generic, with different components and none of them zero, and inside the
//! range in which the law is smooth. The functions do not notice what is consistent in itself: the
//! sign of a sensitivity, a stiffness that is ten times too large, or the sign of the rate of a
//! variable that is no declared memory.

mod elastic;
mod error;
mod growth;
mod obstacle;
mod sensed;
mod symmetry;
mod tropism;

pub use elastic::elastic_law;
pub(crate) use error::describe_type;
pub use error::{LawError, Quantity, Where};
pub use growth::growth_law;
pub use obstacle::obstacle;
pub(crate) use obstacle::{BESIDE, Derivatives};
pub use tropism::{perception, response, tropism_law};

use nalgebra::SVector;

/// Strains at which an elastic law is checked, times the length of the rod: generic ones, at which
/// a law is smooth that has other stiffnesses for the opposite strain.
pub(crate) const STRAINS: [[f64; 3]; 2] = [[0.8, -0.5, 0.3], [-3.0, 5.0, 2.0]];
/// Step of the differences, relative to the argument. Their extrapolation has an error of order
/// 1e-12 of a fifth derivative, and one of 1e-13 by rounding.
const STEP: f64 = 1e-3;
/// Relative error of a derivative beyond which it is wrong. A wrong sign or factor exceeds it by
/// far, and the errors of the differences of smooth laws are much smaller.
const WRONG: f64 = 1e-6;
/// Rounding of a value of a law, relative to its size: that of some tens of operations.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Derivative at zero by central differences with the steps h and h/2, extrapolated, and a bound of
/// its error: the difference of both, which is large where the derivative is discontinuous.
fn slope<const N: usize>(
    f: impl Fn(f64) -> SVector<f64, N>,
    h: f64,
) -> (SVector<f64, N>, SVector<f64, N>) {
    let central = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (coarse, fine) = (central(h), central(0.5 * h));
    ((fine * 4.0 - coarse) / 3.0, (fine - coarse).abs())
}
