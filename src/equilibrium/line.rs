//! Shear and stretch of the centre line, which the frames determine: values, and contribution to
//! the tangent.

use nalgebra::{Matrix3, Vector3};

use super::EquilibriumError;
use crate::constitutive::{Constitutive, line_strain_under};
use crate::load::InternalForce;
use crate::reference_element::AtPoints;
use crate::rod::{Rod, Tissue};
use crate::so3::Form;

/// The strains of the centre line at the frames of a rod; none for a law without shear and stretch.
/// They replace the content of `strains`, whose memory is reused.
pub(super) fn strain_line(
    mut strains: Vec<Vector3<f64>>,
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
) -> Vec<Vector3<f64>> {
    strains.clear();
    let (time, p) = (force.environment().time, rod.order().points());
    let yields = |tissue: &Tissue| material.line_response(tissue, &Vector3::zeros()).is_some();
    if !rod
        .points()
        .first()
        .is_some_and(|point| yields(&Tissue::of(point, time)))
    {
        return strains;
    }
    let strain = |(i, (point, force)): (usize, (_, _))| {
        line_strain_under(
            material,
            &Tissue::of(point, time),
            &rod.frame_at_point(i / p, i % p),
            force,
        )
    };
    strains.extend(
        rod.points()
            .iter()
            .zip(force.at_points())
            .enumerate()
            .map(strain),
    );
    strains
}

/// Returns an error for a rod that is compressed to length zero at some place.
pub(super) fn check_line(
    strains: &[Vector3<f64>],
    force: &InternalForce,
) -> Result<(), EquilibriumError> {
    for (v, cut) in strains.iter().zip(force.cuts()) {
        EquilibriumError::finite(v.norm_squared().is_finite(), "strain of the centre line")?;
        if v.z <= 0.0 {
            return Err(EquilibriumError::Crushed {
                stretch: v.z,
                arc_length: cut.arc_length,
            });
        }
    }
    Ok(())
}

/// Returns the parts by which shear and stretch decrease the second derivatives of the energy at a
/// point, ∂Fᵀ C ∂F, with the force along the directors F = exp(θ̂)ᵀ N and the compliance C: by θ
/// twice, by θ and the rotation φ of the element, and by φ twice. `compliance` is C times the
/// weights of the points, `force` is N.
#[inline]
pub(super) fn line_yields(
    compliance: &Matrix3<AtPoints>,
    exp: &Form<AtPoints>,
    theta: &Vector3<AtPoints>,
    force: &Vector3<AtPoints>,
) -> [Matrix3<AtPoints>; 3] {
    let by_theta = exp.transpose().jacobian(theta, force);
    // A rotation φ of the first frame changes N to N + N × φ.
    let by_turn = exp.matrix(theta).transpose() * force.cross_matrix();
    let (theta_line, turn_line) = (compliance * by_theta, compliance * by_turn);
    let by_theta_t = by_theta.transpose();
    [
        by_theta_t * theta_line,
        by_theta_t * turn_line,
        by_turn.transpose() * turn_line,
    ]
}

/// Laws for the unit tests of an element.
#[cfg(test)]
pub(super) mod samples {
    use super::*;
    use crate::constitutive::{ElasticResponse, LineResponse, LinearElastic};

    pub const BENDING: LinearElastic = LinearElastic {
        youngs_modulus: 4.0,
        poissons_ratio: 0.3,
    };

    /// Law with shear and stretch, v = e3 + C F + c |F|² F with a full matrix C.
    pub struct Yielding;

    impl Constitutive for Yielding {
        fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
            BENDING.respond(tissue, strain)
        }

        fn line_response(&self, _: &Tissue, force: &Vector3<f64>) -> Option<LineResponse> {
            let (linear, cubic) = (
                Matrix3::new(0.4, 0.1, -0.2, 0.1, 0.6, 0.05, -0.2, 0.05, 0.3),
                0.2,
            );
            let square = force.norm_squared();
            let strain = Vector3::z() + linear * force + force * (cubic * square);
            // F · v − Ψ, with Ψ = F · e3 + ½ F · C F + ¼ c |F|⁴ of which v is the gradient.
            let energy = 0.5 * force.dot(&(linear * force)) + 0.75 * cubic * square * square;
            let radial = force * force.transpose() * (2.0 * cubic);
            Some(LineResponse {
                strain,
                energy,
                compliance: linear + Matrix3::identity() * (cubic * square) + radial,
            })
        }
    }
}
