//! Contact of a rod with obstacles: gaps, and the places at which steps are blocked.

use nalgebra::{Matrix3, Vector3};

use super::border::upto_parts;
use super::sites::Gap;
use crate::numerics::quadrature::lobatto;
use crate::rod::Rod;
use crate::support::{Contact, Obstacle};

/// Distance of two places that are one, relative to the length.
pub(super) const SAME: f64 = 1e-9;
/// Largest penetration that is attributed to rounding, relative to the length.
pub(super) const CLEAR: f64 = 1e-12;
/// Largest displacement towards a round obstacle in a step, relative to its radius of curvature.
const LARGEST_APPROACH: f64 = 0.25;
/// Largest distance of a station from a contact, relative to the length, at which the difference `DIFFERENT` between
/// the slopes of the centre line and of the frame is not taken for a penetration.
const BESIDE: f64 = 1e-4;
/// See `BESIDE`. The contact obtains a node of its own later, where there is no difference.
const DIFFERENT: f64 = 1e-3;
/// Number of parts in which an interval between two stations is searched for a place in contact.
const PARTS: usize = 8;

/// The obstacles of a rod at a time.
pub(super) struct Obstacles<'a> {
    pub contacts: Vec<Contact<&'a dyn Obstacle>>,
    /// Forces of the obstacles on the rod by whose opposites they are displaced, N. In equilibrium they are those of
    /// the contacts.
    pub forces: Vec<Vector3<f64>>,
    /// Their change in a Newton step, N.
    pub step: Vec<Vector3<f64>>,
    /// Displacements of the obstacles, m.
    pub yielded: Vec<Vector3<f64>>,
    /// Their displacements per force, m/N.
    pub compliances: Vec<Matrix3<f64>>,
    pub time: f64,
}

impl Obstacles<'_> {
    /// The gap at a place (m) to an obstacle.
    pub fn gap(&self, obstacle: usize, place: &Vector3<f64>) -> Gap {
        let contact = &self.contacts[obstacle];
        let distance = contact.obstacle.distance(&(place - self.yielded[obstacle]), self.time);
        Gap { value: distance.value - contact.radius, normal: distance.normal, curvature: distance.curvature }
    }
}

/// A place of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub element: usize,
    pub x: f64,
    pub arc_length: f64,
    pub position: Vector3<f64>,
}

/// The coordinates of the stations of an element with p points, except its start: they carry the reactions of a
/// distributed contact. There is one fewer than rotations, so that bending energy determines the shape.
pub(super) fn stations(p: usize) -> Vec<f64> {
    if p < 2 { vec![1.0] } else { lobatto(p - 1)[1..].to_vec() }
}

/// The stations of a rod with their positions for given tangents of the centre line.
pub(super) fn all_stations(rod: &Rod, tangents: &[Vector3<f64>]) -> Vec<Place> {
    let coordinates = stations(rod.order().points());
    let mut all = Vec::with_capacity(rod.elements() * coordinates.len());
    let (mut start, mut from) = (0.0, Vector3::zeros());
    for e in 0..rod.elements() {
        for &x in &coordinates {
            all.push(place(rod, tangents, (e, x), start, &from));
        }
        let Some(last) = all.last() else { continue };
        (start, from) = (last.arc_length, last.position);
    }
    all
}

/// The positions of the starts of all elements and of the apex, m.
pub(super) fn starts(rod: &Rod, tangents: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut starts = vec![Vector3::zeros()];
    for e in 0..rod.elements() {
        starts.push(place(rod, tangents, (e, 1.0), 0.0, &starts[e]).position);
    }
    starts
}

/// The place at coordinate `x` of an element, given the arc length (m) and the position (m) of its start.
pub(super) fn place(
    rod: &Rod,
    tangents: &[Vector3<f64>],
    (element, x): (usize, f64),
    start: f64,
    from: &Vector3<f64>,
) -> Place {
    let p = rod.order().points();
    let parts = upto_parts(rod, element, x);
    let arc_length = start + parts[..p].iter().sum::<f64>();
    let tangents = &tangents[element * p..(element + 1) * p];
    let position = tangents.iter().zip(parts).fold(*from, |sum, (tangent, part)| sum + tangent * part);
    Place { element, x, arc_length, position }
}

/// A part of a rod that penetrates an obstacle: the stations in it, and the place where it does most.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Penetration {
    pub obstacle: usize,
    pub stations: Vec<(usize, f64)>,
    pub deepest: (usize, f64),
    /// Arc lengths of the places before and after the part, m.
    pub between: (f64, f64),
}

/// The parts of a rod that penetrate obstacles at stations, or between two of them. `touches` are the obstacles and
/// arc lengths (m) of contacts; places next to them are left out between stations. Penetrations up to `clear`,
/// relative to the length, are attributed to rounding.
pub(super) fn penetrations(
    rod: &Rod,
    tangents: &[Vector3<f64>],
    obstacles: &Obstacles,
    touches: &[(usize, f64)],
    (length, clear): (f64, f64),
) -> Vec<Penetration> {
    let all = all_stations(rod, tangents);
    let mut found: Vec<Penetration> = Vec::new();
    for obstacle in 0..obstacles.contacts.len() {
        let own: Vec<f64> = touches.iter().filter(|(other, _)| *other == obstacle).map(|(_, s)| *s).collect();
        let margin = 1e-9 * length;
        let mut before = (0.0, obstacles.gap(obstacle, &Vector3::zeros()).value);
        let mut start = (0.0, Vector3::zeros());
        let mut run: Option<(Penetration, f64)> = None;
        let mut from = 0.0;
        for station in &all {
            let (s, at) = (station.arc_length, (station.element, station.x));
            let gap = obstacles.gap(obstacle, &station.position).value;
            let touched = own.iter().any(|t| *t > before.0 - margin && *t < s + margin);
            // Between two stations the gap changes by at most the arc length.
            let inside = if !touched && before.1 + gap < s - before.0 {
                let places = (1..PARTS).map(|k| {
                    let x = from + (station.x - from) * k as f64 / PARTS as f64;
                    let place = place(rod, tangents, (station.element, x), start.0, &start.1);
                    (obstacles.gap(obstacle, &place.position).value, x)
                });
                let least = places.min_by(|a, b| a.0.total_cmp(&b.0));
                least.filter(|(least, _)| *least < before.1.min(gap) && *least < -clear * length)
            } else {
                None
            };
            let active = own.iter().any(|t| {
                let distance = (t - s).abs();
                distance <= margin || distance < BESIDE * length && gap > -DIFFERENT * distance
            });
            let outside = gap >= -clear * length || active;
            if let Some((gap, x)) = inside {
                let place = (station.element, x);
                let start = Penetration { obstacle, stations: Vec::new(), deepest: place, between: (before.0, s) };
                let (penetration, least) = run.get_or_insert((start, gap));
                if gap < *least {
                    (penetration.deepest, *least) = (place, gap);
                }
            }
            if outside {
                if let Some((mut penetration, _)) = run.take() {
                    penetration.between.1 = s;
                    found.push(penetration);
                }
            } else {
                let start = Penetration { obstacle, stations: Vec::new(), deepest: at, between: (before.0, s) };
                let (penetration, least) = run.get_or_insert((start, gap));
                penetration.stations.push(at);
                if gap < *least {
                    (penetration.deepest, *least) = (at, gap);
                }
            }
            before = (s, gap);
            from = if station.x >= 1.0 { 0.0 } else { station.x };
            if station.x >= 1.0 {
                start = (s, station.position);
            }
        }
        if let Some((mut penetration, _)) = run.take() {
            penetration.between.1 = f64::INFINITY;
            found.push(penetration);
        }
    }
    found
}

/// The largest share of a displacement of the stations that does not approach a round obstacle by more than the gap or
/// a part of its radius.
pub(super) fn largest_share(obstacles: &Obstacles, from: &[Place], to: &[Place]) -> f64 {
    let mut share = 1.0_f64;
    for (from, to) in from.iter().zip(to) {
        let moved = (to.position - from.position).norm();
        for obstacle in 0..obstacles.contacts.len() {
            let gap = obstacles.gap(obstacle, &from.position);
            let allowed = gap.value.max(LARGEST_APPROACH / gap.curvature.norm());
            if moved > allowed {
                share = share.min(allowed / moved);
            }
        }
    }
    share
}
