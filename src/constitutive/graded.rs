//! Stiffness that varies along the shoot.

use std::fmt;

use super::{Constitutive, ElasticResponse, LineResponse, Tissue};
use crate::error::ParameterError;
use nalgebra::Vector3;

/// An elastic law multiplied by a function of the tissue: energy, couple, tangent, and the
/// stiffness against shear and stretch.
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
///
/// A helical spring of tapering wire hangs at one end and is pulled at the other:
///
/// ```
/// use morphorod::constitutive::{Graded, LinearElastic, Tissue};
/// use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
/// use morphorod::load::{ApicalForce, Weight};
/// use morphorod::nalgebra::{UnitQuaternion, Vector3};
/// use morphorod::rod::Rod;
/// use morphorod::{Order, Scene, Section, Still};
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let (radius, b, turns, elements) = (0.02_f64, 0.01 / std::f64::consts::TAU, 6.0, 60);
///     let square = radius * radius + b * b;
///     let length = turns * std::f64::consts::TAU * square.sqrt();
///     let strain = Vector3::new(radius / square, 0.0, b / square);
///     // Rotated about e2, so that the axis points down.
///     let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), f64::atan2(strain.x, -strain.z));
///     let wire = move |s: f64| Section::ellipse(0.6e-3 - 0.2e-3 * s / length, 0.5e-3);
///     let mut spring = Rod::straight(&Rod::equal_nodes(length, elements), wire, base, Order::Eight)?;
///     spring.set_intrinsic(|_| strain);
///
///     let steel = LinearElastic { youngs_modulus: 200e9, poissons_ratio: 0.3 };
///     // Tempered towards the end.
///     let softer = |tissue: &Tissue| 1.0 - 0.2 * (-tissue.initial_apex_distance / 0.1).exp();
///     let tempered = Graded { law: steel, factor: softer };
///     let environment = Still::upright().environment(0.0);
///     for force in [0.0, 0.1, 0.2] {
///         let load = (Weight { density: 7850.0 }, ApicalForce(move |_t: f64| Vector3::new(0.0, 0.0, -force)));
///         let found = NewtonSolver::default().solve(&mut spring, &tempered, &load, &environment)?;
///         println!("{force} N: the end {:.2} mm below, {} iterations", -1e3 * spring.tip().z, found.iterations);
///     }
///     assert!(spring.tip().z < -0.06 && spring.tip().z > -0.08, "{}", spring.tip().z);
///     Ok(())
/// }
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
        f.debug_struct("Graded")
            .field("law", &self.law)
            .finish_non_exhaustive()
    }
}

impl<C: Constitutive, F: Fn(&Tissue) -> f64> Constitutive for Graded<C, F> {
    #[inline]
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let (factor, law) = ((self.factor)(tissue), self.law.respond(tissue, strain));
        ElasticResponse {
            energy: law.energy * factor,
            couple: law.couple * factor,
            tangent: law.tangent * factor,
        }
    }

    #[inline]
    fn line_response(&self, tissue: &Tissue, force: &Vector3<f64>) -> Option<LineResponse> {
        // The strain depends on force over stiffness.
        let factor = (self.factor)(tissue);
        let law = self.law.line_response(tissue, &(force / factor))?;
        Some(LineResponse {
            energy: law.energy * factor,
            compliance: law.compliance / factor,
            ..law
        })
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.law.check()
    }
}
