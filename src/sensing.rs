//! What the material points of the growth zone see, in equilibrium.

use nalgebra::{Matrix3, Vector3};

use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::reference_element::MAX_POINTS;
use crate::rod::{Rod, Tissue, centre_line_tangent};
use crate::tropism::Site;

/// Calls `visit` with the number of each material point of the growth zone, counted from the zone's first, and what can
/// be seen there; from the apex towards the base.
///
/// The couple is summed from the free apex, m(s) = ∫ p′ × n beyond s, equation (11), and the strain recovered from it: of
/// order p + 2 where differentiation of the rotations gives p + 1, and free of their rounding in short elements.
pub(crate) fn visit_sites(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    with_position: bool,
    mut visit: impl FnMut(usize, &Site),
) {
    let reference = rod.reference();
    let p = reference.p;
    let first = rod.zone().start;
    let mut end_couple = Vector3::zeros();
    let mut end_position = if with_position { rod.tip() } else { Vector3::repeat(f64::NAN) };
    for e in (rod.first_growing()..rod.elements()).rev() {
        let points = rod.element_points(e);
        let frames: [_; MAX_POINTS] = std::array::from_fn(|g| rod.frame_at_point(e, g.min(p - 1)));
        let mut tangents = [Vector3::zeros(); MAX_POINTS];
        // −m′ = p′ × n.
        let mut couple_rates = [Vector3::zeros(); MAX_POINTS];
        for g in 0..p {
            tangents[g] = frames[g] * centre_line_tangent();
            couple_rates[g] = tangents[g].cross(&force.at_points()[e * p + g]);
        }
        for g in (0..p).rev() {
            let mut couple = end_couple;
            let mut position = end_position;
            for j in 0..p {
                // The part of the element beyond the point.
                let beyond = (reference.weights[j] - reference.upto[g][j]) * points[j].jacobian;
                couple += couple_rates[j] * beyond;
                if with_position {
                    position -= tangents[j] * beyond;
                }
            }
            let couple = frames[g].inverse_transform_vector(&couple);
            let cut = &force.cuts()[e * p + g];
            let site = Site {
                environment: *force.environment(),
                frame: frames[g],
                strain: strain_from_couple(rod, material, force.environment().time, (e, g), &couple),
                couple,
                arc_length: cut.arc_length,
                apex_distance: cut.length_beyond,
                section: points[g].section,
                position,
                rod,
            };
            visit(e * p + g - first, &site);
        }
        for j in 0..p {
            let whole = reference.weights[j] * points[j].jacobian;
            end_couple += couple_rates[j] * whole;
            if with_position {
                end_position -= tangents[j] * whole;
            }
        }
    }
}

/// The strain under which the elastic law answers with the given couple: one Newton step from the differentiated
/// strain, exact for a linear law and of twice its order for others.
fn strain_from_couple(
    rod: &Rod,
    material: &impl Constitutive,
    time: f64,
    (e, g): (usize, usize),
    couple: &Vector3<f64>,
) -> Vector3<f64> {
    let point = &rod.element_points(e)[g];
    let elastic = rod.strain_at_point(e, g) - point.intrinsic;
    let response = material.respond(&Tissue::of(point, time), &elastic);
    let inverse = response.tangent.try_inverse().unwrap_or_else(Matrix3::zeros);
    point.intrinsic + elastic + inverse * (couple - response.couple)
}
