//! Error of the intrinsic strain where a law jumps or is steep inside an element.
//!
//! A law is evaluated at the material points. Two meshes may miss a narrow peak alike, or have their points alike on
//! the sides of a jump, so that their difference is small by accident. The rates of the intrinsic strain at more places
//! show it.

use nalgebra::Vector3;

use super::division::cut_into;
use super::hidden_turns::SMOOTH;
use crate::growth::GrowthLaw;
use crate::integrator::IntegrationError;
use crate::integrator::error::Outcome;
use crate::model::Model;
use crate::rod::weighted;
use crate::shoot::Shoot;
use crate::state::State;

/// Name of the gradients in errors.
const GRADIENT: &str = "growth gradient between two material points";
/// Ends of the parts of an element in which the rates are evaluated. A peak that is narrower than a part may be missed.
/// The short parts show a jump beside a node.
const ENDS: [f64; 7] = [0.0, 1e-3, 0.25, 0.5, 0.75, 1.0 - 1e-3, 1.0];
const PARTS: usize = ENDS.len() - 1;
/// Length of an element, relative to the shoot, from which on a strain that it hides is steep.
const SHORT: f64 = 1.0 / 256.0;
/// Largest number of times that elements are halved. The distance of a jump from a node is then 1e-9 elements.
const HALVINGS: usize = 30;

/// Displacement of the centre line by the intrinsic strain that a mesh does not show.
pub(super) struct HiddenStrain {
    /// Possible displacement in the time of a run, relative to the length.
    pub error: f64,
    /// Distances from the apex at t = 0 (m) of further nodes about steep places, with which it is small enough there.
    pub nodes: Vec<f64>,
}

impl HiddenStrain {
    /// The hidden strain by the present rates over a time (s), with the nodes for a largest displacement `enough`.
    /// Tissue that elongates moves past the places of a law, so that it has no such nodes.
    ///
    /// # Errors
    /// [`NotFinite`](IntegrationError::NotFinite) for a law that is not finite between the material points.
    pub fn of(shoot: &mut Shoot<impl Model>, duration: f64, enough: f64) -> Outcome<Self> {
        let mut hidden = displacements(shoot, duration);
        let mut found = Self { error: hidden.iter().sum(), nodes: Vec::new() };
        if !found.error.is_finite() {
            return Err(IntegrationError::NotFinite { what: GRADIENT, time: shoot.time() });
        }
        if shoot.model().growth().elongates() || found.error <= enough {
            return Ok(found);
        }
        let state = shoot.state.clone();
        // The ends and the middle of each divided element, and whether it is short.
        let (mut divided, short) = (Vec::new(), SHORT * state.rod.length());
        for _ in 0..HALVINGS {
            let share = 0.5 * enough / hidden.len() as f64;
            for e in (0..hidden.len()).rev().filter(|e| hidden[*e] > share) {
                let ends = [0.0, 0.5, 1.0].map(|x| shoot.rod().initial_apex_distance(e, x));
                divided.push((ends, shoot.rod().length_of(e) <= short));
                cut_into(&mut shoot.state, e, 2);
            }
            hidden = displacements(shoot, duration);
            // The elements of the next run may be others.
            if hidden.iter().sum::<f64>() <= 0.5 * enough {
                break;
            }
        }
        // Other elements are resolved by shorter elements, whose difference shows all of their errors.
        let steep = |from: f64, to: f64| divided.iter().any(|([_, at, _], steep)| *steep && (to..=from).contains(at));
        found.nodes.extend(divided.iter().filter(|([from, _, to], _)| steep(*from, *to)).map(|([_, at, _], _)| at));
        shoot.state = state;
        Ok(found)
    }
}

/// The displacements that each element may hide, relative to the length; zero outside the zone. A place that moves with
/// the apex acts in an element until the tissue has passed it.
fn displacements(shoot: &mut Shoot<impl Model>, duration: f64) -> Vec<f64> {
    let coarse = shoot.intrinsic_rates();
    let state: State = shoot.state.clone();
    let first = state.rod.first_growing;
    for e in (first..state.rod.elements()).rev() {
        for part in (1..PARTS).rev() {
            shoot.state.split(e, ENDS[part] / ENDS[part + 1]);
        }
    }
    let fine = shoot.intrinsic_rates();
    let divided = std::mem::replace(&mut shoot.state, state).rod;
    let (rod, growth, time) = (shoot.rod(), shoot.model().growth(), shoot.time());
    let (p, reference) = (rod.order().points(), rod.reference());
    let mut hidden = vec![0.0; rod.elements()];
    let mut beyond = 0.0;
    let each = coarse.chunks(p).zip(fine.chunks(PARTS * p)).zip(divided.points()[divided.zone()].chunks(PARTS * p));
    for (k, ((own, fine), points)) in each.enumerate().rev() {
        // `missing` is the rate minus the polynomial through the rates at the material points. It turns and displaces
        // the rod beyond.
        let (mut turn, mut way) = (Vector3::zeros(), Vector3::<f64>::zeros());
        let (mut size, mut farthest, mut largest, mut departure) = (0.0, 0.0_f64, 0.0_f64, 0.0_f64);
        for (i, (rate, point)) in fine.iter().zip(points).enumerate() {
            let [from, to] = [ENDS[i / p], ENDS[i / p + 1]];
            let x = from + (to - from) * reference.points[i % p];
            let missing = rate - weighted(own, &reference.at_points(x));
            let length = reference.weights[i % p] * point.jacobian;
            way += (turn + missing * (0.5 * length)) * length;
            turn += missing * length;
            farthest = farthest.max(way.norm());
            size += missing.norm() * length;
            largest = largest.max(rate.norm());
            departure = departure.max(missing.norm());
        }
        let (e, length) = (first + k, rod.length_of(first + k));
        beyond += length;
        let speed = growth.apical_speed(rod.element_points(e)[p / 2].apex_distance, time);
        let acts = if growth.elongates() { duration.min(length / speed.abs()) } else { duration };
        let moved = |way: f64| way * acts / rod.length();
        let smooth = turn.norm() * (beyond - length) + farthest;
        hidden[e] += moved(if departure > SMOOTH * largest { size * beyond } else { smooth });
    }
    hidden
}
