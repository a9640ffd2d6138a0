//! What the material points of the growth zone see.

use nalgebra::{Matrix3, Vector3};

use crate::basis::MAX_POINTS;
use crate::constitutive::Constitutive;
use crate::equilibrium::tissue;
use crate::load::{Cut, Load};
use crate::rod::Rod;
use crate::scene::Moment;
use crate::tropism::Site;

/// Calls `visit` with the number of each material point of the growth zone, counted from the zone's first, and what can
/// be seen there; from the apex towards the base.
///
/// The couple is summed from the free apex, m(s) = ∫ d3 × n beyond s, and the strain recovered from it: of order p + 2
/// where differentiation of the rotations gives p + 1, and free of their rounding in short elements.
pub(crate) fn visit_sites<C: Constitutive, L: Load>(
    rod: &Rod,
    material: &C,
    load: &L,
    moment: &Moment,
    needs_position: bool,
    mut visit: impl FnMut(usize, &Site),
) {
    let basis = rod.basis();
    let p = basis.p;
    let total = rod.length();
    let (mut length, mut volume) = (0.0, 0.0);
    let mut end_couple = Vector3::zeros();
    let mut end_position = if needs_position { rod.tip() } else { Vector3::zeros() };
    for e in (rod.first_growing()..rod.elements()).rev() {
        let points = rod.element_points(e);
        let area = |j: usize| std::f64::consts::PI * points[j].radius * points[j].radius;
        // Weights of the part of the element beyond each point, and of the whole.
        let beyond = |g: usize, j: usize| (basis.weights[j] - basis.upto[g][j]) * points[j].jacobian;
        let whole = |j: usize| basis.weights[j] * points[j].jacobian;
        let frames: [_; MAX_POINTS] = std::array::from_fn(|g| rod.frame_at_point(e, g.min(p - 1)));
        let mut lengths = [length; MAX_POINTS];
        let mut moments = [Vector3::zeros(); MAX_POINTS];
        for g in 0..p {
            let mut cut_volume = volume;
            for j in 0..p {
                lengths[g] += beyond(g, j);
                cut_volume += beyond(g, j) * area(j);
            }
            let cut = Cut { arc_length: total - lengths[g], length_beyond: lengths[g], volume_beyond: cut_volume };
            moments[g] = (frames[g] * Vector3::z()).cross(&load.force(&cut, moment));
        }
        for g in (0..p).rev() {
            let mut couple = end_couple;
            let mut position = end_position;
            for j in 0..p {
                couple += moments[j] * beyond(g, j);
                if needs_position {
                    position -= (frames[j] * Vector3::z()) * beyond(g, j);
                }
            }
            let couple = frames[g].inverse_transform_vector(&couple);
            let site = Site {
                moment: *moment,
                frame: frames[g],
                strain: strain_from_couple(rod, material, moment.time, (e, g), &couple),
                couple,
                arc_length: total - lengths[g],
                apex_distance: lengths[g],
                radius: points[g].radius,
                position,
                rod,
            };
            visit((e - rod.first_growing()) * p + g, &site);
        }
        for j in 0..p {
            length += whole(j);
            volume += whole(j) * area(j);
            end_couple += moments[j] * whole(j);
            if needs_position {
                end_position -= (frames[j] * Vector3::z()) * whole(j);
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
    let elastic = rod.strain(e, g) - point.intrinsic;
    let response = material.respond(&tissue(point, time), &elastic);
    let inverse = response.tangent.try_inverse().unwrap_or_else(Matrix3::zeros);
    point.intrinsic + elastic + inverse * (couple - response.couple)
}
