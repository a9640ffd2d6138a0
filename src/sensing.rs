//! Stimuli at the material points of the growth zone: couple, strain and position in equilibrium.

use nalgebra::Vector3;

use crate::constitutive::{Constitutive, line_strain_under, strain_under};
use crate::load::InternalForce;
use crate::reference_element::MAX_POINTS;
use crate::rod::{Rod, Tissue};
use crate::tropism::{Site, TropismLaw};

/// Evaluates the stimuli of a tropism law at every material point of the growth zone of a rod in equilibrium. Calls
/// `visit` with the index of each point in the zone, its site and its stimuli, which are written to `stimuli` one
/// point after the other. The other arguments are those of [`visit_sites`].
pub(crate) fn visit_stimuli(
    rod: &Rod,
    (material, law): (&impl Constitutive, &impl TropismLaw),
    force: &InternalForce,
    with_position: bool,
    stimuli: &mut [f64],
    mut visit: impl FnMut(usize, &Site, &[f64]),
) {
    visit_sites(rod, material, force, with_position, |i, site| {
        law.sense(site, stimuli);
        visit(i, site, stimuli);
    });
}

/// Calls `visit` with the [`Site`] of each material point of the growth zone and its index in the zone, from
/// the apex towards the base. Positions are NaN unless `with_position`.
///
/// The couple is integrated from the free apex, m(s) = ∫ p′ × n beyond s, equation (11), and the strain follows
/// from it. The strain is of order p + 2, while differentiation of the rotations gives p + 1 and rounding
/// errors in short elements.
pub(crate) fn visit_sites(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    with_position: bool,
    mut visit: impl FnMut(usize, &Site),
) {
    let reference = rod.reference();
    let p = reference.p;
    let (first, time) = (rod.zone().start, force.environment().time);
    let mut end_couple = Vector3::zeros();
    let mut end_position = if with_position { rod.tip() } else { Vector3::repeat(f64::NAN) };
    for e in (rod.first_growing()..rod.elements()).rev() {
        let points = rod.element_points(e);
        let frames: [_; MAX_POINTS] = std::array::from_fn(|g| rod.frame_at_point(e, g.min(p - 1)));
        let mut tangents = [Vector3::zeros(); MAX_POINTS];
        // −m′ = p′ × n.
        let mut couple_rates = [Vector3::zeros(); MAX_POINTS];
        for g in 0..p {
            let force = &force.at_points()[e * p + g];
            tangents[g] = frames[g] * line_strain_under(material, &Tissue::of(&points[g], time), &frames[g], force);
            couple_rates[g] = tangents[g].cross(force);
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
            // The strain from the couple, with the differentiated strain as initial guess.
            let point = &points[g];
            let (tissue, near) = (Tissue::of(point, time), rod.strain_at_point(e, g) - point.intrinsic);
            let site = Site {
                environment: *force.environment(),
                frame: frames[g],
                strain: point.intrinsic + strain_under(material, &tissue, &near, &couple),
                couple,
                arc_length: cut.arc_length,
                apex_distance: cut.length_beyond,
                section: point.section,
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
