//! Stimuli at the material points of the growth zone: couple, strain and position in equilibrium.

use nalgebra::{UnitQuaternion, Vector3};

use crate::constitutive::{Constitutive, line_strain_under, strain_near};
use crate::load::InternalForce;
use crate::reference_element::MAX_POINTS;
use crate::rod::{Rod, Tissue};
use crate::tropism::{Site, TropismLaw};

/// Evaluates the stimuli of a tropism law at every material point of the growth zone of a rod in
/// equilibrium. Calls `visit` with the index of each point in the zone, its site and its stimuli,
/// which are written to `stimuli` one point after the other. The other arguments are those of
/// [`visit_sites`].
pub(crate) fn visit_stimuli(
    (rod, shape): (&Rod, Option<&Rod>),
    (material, law): (&impl Constitutive, &impl TropismLaw),
    force: &InternalForce,
    with_position: bool,
    stimuli: &mut [f64],
    mut visit: impl FnMut(usize, &Site, &[f64]),
) {
    let each = |i: usize, site: &Site| {
        // A stimulus that the law does not write is an error, not that of the point before.
        stimuli.fill(f64::NAN);
        law.sense(site, stimuli);
        visit(i, site, stimuli);
    };
    match shape {
        None => visit_sites(rod, material, force, with_position, each),
        Some(shape) => visit_sites_on(shape, rod, material, force, each),
    }
}

/// Calls `visit` with the [`Site`] of each material point of the growth zone and its index in the
/// zone, from the apex towards the base. Positions are NaN unless `with_position`.
///
/// The couple is integrated from the free apex, and the strain follows from it. The strain is of
/// order p + 2, while differentiation of the rotations gives p + 1 and rounding errors in short
/// elements.
pub(crate) fn visit_sites(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    with_position: bool,
    mut visit: impl FnMut(usize, &Site),
) {
    let reference = rod.reference();
    let (p, first, time) = (reference.p, rod.zone().start, force.environment().time);
    let mut end_position = if with_position {
        rod.tip()
    } else {
        Vector3::repeat(f64::NAN)
    };
    let tip = end_position;
    visit_elements(
        rod,
        material,
        force,
        rod.first_growing,
        |e, rates, end_couple| {
            let points = rod.element_points(e);
            for g in (0..p).rev() {
                let (mut couple, mut position) = (*end_couple, end_position);
                for j in 0..p {
                    // The part of the element beyond the point.
                    let beyond = (reference.weights[j] - reference.upto[g][j]) * points[j].jacobian;
                    couple += rates.couples[j] * beyond;
                    if with_position {
                        position -= rates.tangents[j] * beyond;
                    }
                }
                let couple = rates.frames[g].inverse_transform_vector(&couple);
                let cut = &force.cuts()[e * p + g];
                let point = &points[g];
                // The strain from the couple; the differentiated strain is the initial guess for a
                // law that is not linear.
                let near = || rod.strain_at_point(e, g) - point.intrinsic;
                let elastic = strain_near(material, &Tissue::of(point, time), near, &couple);
                let site = Site {
                    environment: *force.environment(),
                    frame: rates.frames[g],
                    strain: point.intrinsic + elastic,
                    couple,
                    arc_length: cut.arc_length,
                    apex_distance: cut.length_beyond,
                    initial_apex_distance: point.initial_apex_distance,
                    section: point.section,
                    position,
                    tip,
                    rod,
                };
                visit(e * p + g - first, &site);
            }
            if with_position {
                for j in 0..p {
                    end_position -= rates.tangents[j] * (reference.weights[j] * points[j].jacobian);
                }
            }
        },
    );
}

/// Calls `visit` as [`visit_sites`] for the points of the growth zone of `rod`, whose shape has
/// further nodes at contacts: `shape`, with the force in it.
pub(crate) fn visit_sites_on(
    shape: &Rod,
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    mut visit: impl FnMut(usize, &Site),
) {
    let reference = shape.reference();
    let (p, first, time) = (reference.p, rod.zone().start, force.environment().time);
    let (line, length) = (shape.centre_line(), shape.length());
    let starts = rod.ends();
    let arc_length = |i: usize| {
        let upto = rod.element_points(i / p).iter().zip(&reference.upto[i % p]);
        starts[i / p] + upto.map(|(point, w)| w * point.jacobian).sum::<f64>()
    };
    let each = rod.zone().rev().map(|i| (i, arc_length(i)));
    let places: Vec<_> = each
        .filter_map(|(i, s)| Some((i, s, shape.locate(s)?)))
        .collect();
    let from = places.last().map_or(shape.elements(), |(.., (e, _))| *e);
    visit_elements(shape, material, force, from, |e, rates, end_couple| {
        for &(i, s, (_, x)) in places.iter().filter(|(.., (element, _))| *element == e) {
            let (point, frame, upto) = (
                &rod.points()[i],
                shape.frame_within(e, x),
                reference.integral_upto(x),
            );
            let mut couple = *end_couple;
            for (j, at) in shape.element_points(e).iter().enumerate() {
                couple += rates.couples[j] * ((reference.weights[j] - upto[j]) * at.jacobian);
            }
            let couple = frame.inverse_transform_vector(&couple);
            let near = || shape.strain_within(e, x) - point.intrinsic;
            let elastic = strain_near(material, &Tissue::of(point, time), near, &couple);
            let site = Site {
                environment: *force.environment(),
                frame,
                strain: point.intrinsic + elastic,
                couple,
                arc_length: s,
                apex_distance: length - s,
                initial_apex_distance: point.initial_apex_distance,
                section: point.section,
                position: line[e].1 + shape.chord(e, x),
                tip: line[shape.elements()].1,
                rod: shape,
            };
            visit(i - first, &site);
        }
    });
}

/// Values at the material points of an element: frames, tangents p′ of the centre line, and rates
/// −m′ = p′ × n of the couple in the fixed frame, N.
struct Rates {
    frames: [UnitQuaternion<f64>; MAX_POINTS],
    tangents: [Vector3<f64>; MAX_POINTS],
    couples: [Vector3<f64>; MAX_POINTS],
}

impl Rates {
    /// Computes the values in an element. The function is not inlined, so that it is compiled once
    /// for each elastic law, and not for each visitor.
    #[inline(never)]
    fn of(rod: &Rod, material: &impl Constitutive, force: &InternalForce, e: usize) -> Self {
        let (points, p, time) = (
            rod.element_points(e),
            rod.reference().p,
            force.environment().time,
        );
        let frames = std::array::from_fn(|g| rod.frame_at_point(e, g.min(p - 1)));
        let (mut tangents, mut couples) = (
            [Vector3::zeros(); MAX_POINTS],
            [Vector3::zeros(); MAX_POINTS],
        );
        for g in 0..p {
            let force = &force.at_points()[e * p + g];
            tangents[g] = frames[g]
                * line_strain_under(material, &Tissue::of(&points[g], time), &frames[g], force);
            couples[g] = tangents[g].cross(force);
        }
        Self {
            frames,
            tangents,
            couples,
        }
    }
}

/// Calls `visit` with the index of each element from the apex down to the element `from`, with its
/// [`Rates`], and with the couple just below its last end in the fixed frame, N m. The couple is
/// m(s) = ∫ p′ × n beyond s, equation (11), plus the couples of the supports there.
fn visit_elements(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    from: usize,
    mut visit: impl FnMut(usize, &Rates, &Vector3<f64>),
) {
    let reference = rod.reference();
    let mut couple: Vector3<f64> = force.couples_at(rod.elements()).sum();
    for e in (from..rod.elements()).rev() {
        let rates = Rates::of(rod, material, force, e);
        visit(e, &rates, &couple);
        for (j, point) in rod.element_points(e).iter().enumerate() {
            couple += rates.couples[j] * (reference.weights[j] * point.jacobian);
        }
        couple += force.couples_at(e).sum::<Vector3<f64>>();
    }
}
