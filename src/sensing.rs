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
    (rod, shape): (&Rod, Option<&Rod>),
    (material, law): (&impl Constitutive, &impl TropismLaw),
    force: &InternalForce,
    with_position: bool,
    stimuli: &mut [f64],
    mut visit: impl FnMut(usize, &Site, &[f64]),
) {
    let each = |i: usize, site: &Site| {
        law.sense(site, stimuli);
        visit(i, site, stimuli);
    };
    match shape {
        None => visit_sites(rod, material, force, with_position, each),
        Some(shape) => visit_sites_on(shape, rod, material, force, each),
    }
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
    let couple_at = |node: usize| {
        let at_node = force.couples().iter().filter(move |(at, _)| *at == node);
        at_node.fold(Vector3::zeros(), |sum: Vector3<f64>, (_, couple)| sum + couple)
    };
    let mut end_couple = couple_at(rod.elements());
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
        end_couple += couple_at(e);
    }
}

/// Calls `visit` as [`visit_sites`] for the points of the growth zone of `rod`, whose shape has further nodes at
/// contacts: `shape`, with the force in it.
pub(crate) fn visit_sites_on(
    shape: &Rod,
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    mut visit: impl FnMut(usize, &Site),
) {
    let reference = shape.reference();
    let (p, time) = (reference.p, force.environment().time);
    let (couples, line) = (couples_at_nodes(shape, material, force), shape.centre_line());
    let length = shape.length();
    let mut starts = vec![0.0; rod.elements() + 1];
    for e in 0..rod.elements() {
        starts[e + 1] = starts[e] + rod.length_of(e);
    }
    let first = rod.zone().start;
    for i in rod.zone().rev() {
        let (parent, point) = (i / p, &rod.points()[i]);
        let upto = rod.element_points(parent).iter().zip(&reference.upto[i % p]);
        let s = starts[parent] + upto.map(|(point, w)| w * point.jacobian).sum::<f64>();
        let Some((e, x)) = shape.locate(s) else { continue };
        let (frame, tissue) = (shape.frame_within(e, x), Tissue::of(point, time));
        let upto = reference.integral_upto(x);
        let mut couple = couples[e + 1];
        for g in 0..p {
            let (at, n) = (&shape.points()[e * p + g], &force.at_points()[e * p + g]);
            let here = shape.frame_at_point(e, g);
            let tangent = here * line_strain_under(material, &Tissue::of(at, time), &here, n);
            couple += tangent.cross(n) * ((reference.weights[g] - upto[g]) * at.jacobian);
        }
        let couple = frame.inverse_transform_vector(&couple);
        let near = shape.strain_within(e, x) - point.intrinsic;
        let site = Site {
            environment: *force.environment(),
            frame,
            strain: point.intrinsic + strain_under(material, &tissue, &near, &couple),
            couple,
            arc_length: s,
            apex_distance: length - s,
            section: point.section,
            position: line[e].1 + shape.chord(e, x),
            rod: shape,
        };
        visit(i - first, &site);
    }
}

/// The couple just below the first end of every element, and at the apex, in the fixed frame, N m.
fn couples_at_nodes(rod: &Rod, material: &impl Constitutive, force: &InternalForce) -> Vec<Vector3<f64>> {
    let (p, time) = (rod.order().points(), force.environment().time);
    let mut couples = vec![Vector3::zeros(); rod.elements() + 1];
    for e in (0..=rod.elements()).rev() {
        if e < rod.elements() {
            couples[e] = couples[e + 1];
            for g in 0..p {
                let (point, n) = (&rod.points()[e * p + g], &force.at_points()[e * p + g]);
                let frame = rod.frame_at_point(e, g);
                let tangent = frame * line_strain_under(material, &Tissue::of(point, time), &frame, n);
                couples[e] += tangent.cross(n) * (rod.reference().weights[g] * point.jacobian);
            }
        }
        for (node, couple) in force.couples() {
            if *node == e {
                couples[e] += couple;
            }
        }
    }
    couples
}
