//! Error of the intrinsic strain where a law jumps or is steep inside an element.
//!
//! A law is evaluated at the material points. Two meshes may both miss a narrow peak, or have
//! points at the same places beside a jump, so that their difference is small by accident. The
//! rates of the intrinsic strain at more places show it.

use nalgebra::Vector3;

use super::division::{MOST_ELEMENTS, cut_into};
use super::hidden_turns::SMOOTH;
use crate::integrator::IntegrationError;
use crate::integrator::error::Outcome;
use crate::model::{GrowthLaw, Model};
use crate::rod::weighted;
use crate::shoot::Shoot;

/// Name of a gradient that is not finite, in errors.
const GRADIENT: &str = "growth gradient between two material points";
/// Ends of the parts of an element in which the rates are evaluated. A peak that is narrower than a
/// part may be missed. The short parts show a jump beside a node.
const ENDS: [f64; 7] = [0.0, 1e-3, 0.25, 0.5, 0.75, 1.0 - 1e-3, 1.0];
/// Largest length of an element, relative to the shoot, whose hidden strain counts as steep.
const SHORT: f64 = 1.0 / 256.0;
/// Largest number of times that elements are halved. The distance of a jump from a node is then
/// 1e-9 elements.
const HALVINGS: usize = 30;

/// Returns the possible displacement of the centre line by the intrinsic strain that the elements
/// of a shoot hide, relative to the length: by the present rates over a time (s).
///
/// It is too small for a law that jumps at a material point of a shoot that elongates, and for one
/// that is steep at earlier times only.
///
/// # Errors
/// [`NotFinite`](IntegrationError::NotFinite) for a law that is not finite between the material
/// points.
pub(super) fn hidden_strain(shoot: &Shoot<impl Model>, duration: f64) -> Outcome<f64> {
    let sum: f64 = displacements(shoot, duration).iter().sum();
    if sum.is_finite() {
        Ok(sum)
    } else {
        Err(IntegrationError::NotFinite {
            what: GRADIENT,
            time: shoot.time(),
        })
    }
}

/// Returns the distances from the apex at t = 0 (m) of additional nodes about steep places, with
/// which the hidden displacement is at most half of `enough`. A shoot that elongates has none,
/// since its tissue moves relative to a law. A law that needs too many has none either.
pub(super) fn nodes_at_steep_places(
    shoot: &mut Shoot<impl Model>,
    duration: f64,
    enough: f64,
) -> Vec<f64> {
    if shoot.model().growth().elongates() {
        return Vec::new();
    }
    let (state, mut hidden) = (shoot.state.clone(), displacements(shoot, duration));
    // The ends and the middle of each divided element, and whether it is short.
    let (mut divided, short) = (Vec::new(), SHORT * state.rod.length());
    for _ in 0..HALVINGS {
        // A half of the permitted displacement is reserved for the elements of the next run, which
        // may differ.
        let share = 0.5 * enough / hidden.len() as f64;
        for e in (0..hidden.len()).rev().filter(|e| hidden[*e] > share) {
            let rod = &shoot.state.rod;
            divided.push((
                [0.0, 0.5, 1.0].map(|x| rod.initial_apex_distance(e, x)),
                rod.length_of(e) <= short,
            ));
            cut_into(&mut shoot.state, e, 2);
        }
        hidden = displacements(shoot, duration);
        if hidden.len() > MOST_ELEMENTS {
            divided.clear();
            break;
        }
        if hidden.iter().sum::<f64>() <= 0.5 * enough {
            break;
        }
    }
    shoot.state = state;
    // Elsewhere the next runs have shorter elements, and their difference shows the error.
    let steep = |from: f64, to: f64| {
        divided
            .iter()
            .any(|([_, at, _], short)| *short && (to..=from).contains(at))
    };
    divided
        .iter()
        .filter(|([from, _, to], _)| steep(*from, *to))
        .map(|([_, at, _], _)| *at)
        .collect()
}

/// Returns a bound of the displacement by strain that the points of each element do not show,
/// relative to the length; zero outside the zone. A place that moves with the apex acts in an
/// element until the tissue has passed it.
fn displacements(shoot: &Shoot<impl Model>, duration: f64) -> Vec<f64> {
    // Laws act at the points of the state. The rod in equilibrium has further nodes at contacts.
    let (rod, growth, time) = (&shoot.state.rod, shoot.model().growth(), shoot.time());
    let (p, reference, first) = (rod.order().points(), rod.reference(), rod.first_growing);
    // The places in an element with their weights in an integral.
    let part = |ends: &[f64]| {
        let (from, size) = (ends[0], ends[1] - ends[0]);
        let each = reference.points.iter().zip(&reference.weights);
        each.map(move |(x, weight)| (from + size * x, size * weight))
            .collect::<Vec<_>>()
    };
    let places: Vec<(f64, f64)> = ENDS.windows(2).flat_map(part).collect();
    let weights: Vec<_> = places
        .iter()
        .map(|(x, _)| reference.at_points(*x))
        .collect();
    let coordinates: Vec<f64> = places.iter().map(|(x, _)| *x).collect();
    let (coarse, fine) = (
        shoot.intrinsic_rates(),
        shoot.intrinsic_rates_within(&coordinates),
    );
    let mut hidden = vec![0.0; rod.elements()];
    let mut beyond = 0.0;
    for (k, (own, fine)) in coarse
        .chunks(p)
        .zip(fine.chunks(places.len()))
        .enumerate()
        .rev()
    {
        let (e, length) = (first + k, rod.length_of(first + k));
        let points = rod.element_points(e);
        // `missing` is the rate minus the polynomial through the rates at the material points. It
        // turns and displaces the rod beyond.
        let (mut turn, mut way) = (Vector3::zeros(), Vector3::<f64>::zeros());
        let (mut size, mut farthest, mut largest, mut departure) = (0.0, 0.0_f64, 0.0_f64, 0.0_f64);
        for ((rate, (_, weight)), values) in fine.iter().zip(&places).zip(&weights) {
            let missing = rate - weighted(own, values);
            let jacobian: f64 = points
                .iter()
                .zip(values)
                .map(|(point, value)| point.jacobian * value)
                .sum();
            let length = weight * jacobian;
            way += (turn + missing * (0.5 * length)) * length;
            turn += missing * length;
            farthest = farthest.max(way.norm());
            size += missing.norm() * length;
            largest = largest.max(rate.norm());
            departure = departure.max(missing.norm());
        }
        beyond += length;
        let speed = growth.apical_speed(points[p / 2].apex_distance, time);
        let acts = if growth.elongates() {
            duration.min(length / speed.abs())
        } else {
            duration
        };
        let moved = |way: f64| way * acts / rod.length();
        let smooth = turn.norm() * (beyond - length) + farthest;
        hidden[e] += moved(if departure > SMOOTH * largest {
            size * beyond
        } else {
            smooth
        });
    }
    hidden
}
