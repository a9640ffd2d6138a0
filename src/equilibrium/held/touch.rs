//! Contact of a rod with obstacles: gaps, and the places at which steps are blocked.

use nalgebra::{Matrix3, Vector3};

use super::border::{scaled_parts, upto_parts};
use super::sites::Gap;
use crate::reference_element::MAX_POINTS;
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
/// Largest penetration between stations within `BESIDE` of a contact, relative to the length, that is attributed to the
/// discretisation: the gap beside a longer contact is proportional to the third power of the distance from its end.
const RESOLVED: f64 = 1e-10;
/// Smallest number of parts in which an interval between two stations is searched for a place in contact.
const PARTS: f64 = 8.0;
/// Distance of the places in this search, relative to the radius of curvature of the obstacle.
const RESOLUTION: f64 = 0.25;
/// Smallest distance of these places, relative to that of the stations.
const FINEST: f64 = 1.0 / 65_536.0;

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

/// The stations of a rod with their positions for given tangents of the centre line.
pub(super) fn all_stations(rod: &Rod, tangents: &[Vector3<f64>]) -> Vec<Place> {
    let stations = &rod.reference().stations;
    let mut all = Vec::with_capacity(rod.elements() * stations.len());
    let (mut start, mut from) = (0.0, Vector3::zeros());
    for e in 0..rod.elements() {
        for (x, weights) in stations {
            all.push(weighted_place(rod, tangents, ((e, *x), scaled_parts(rod, e, weights)), start, &from));
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
    weighted_place(rod, tangents, ((element, x), upto_parts(rod, element, x)), start, from)
}

/// As `place`, with the weights (m) of the integral from the start of the element.
fn weighted_place(
    rod: &Rod,
    tangents: &[Vector3<f64>],
    ((element, x), parts): ((usize, f64), [f64; MAX_POINTS]),
    start: f64,
    from: &Vector3<f64>,
) -> Place {
    let p = rod.order().points();
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
    sampling: &Sampling,
    touches: &[(usize, f64)],
    (length, clear): (f64, f64),
) -> Vec<Penetration> {
    let margin = SAME * length;
    let mut found: Vec<Penetration> = Vec::new();
    for obstacle in 0..sampling.obstacles.contacts.len() {
        let own: Vec<f64> = touches.iter().filter(|(other, _)| *other == obstacle).map(|(_, s)| *s).collect();
        let mut run: Option<(Penetration, f64)> = None;
        for interval in sampling.intervals(obstacle) {
            let Interval { element, before, after, .. } = interval;
            let (from, s) = (before.arc_length, after.arc_length);
            let touched = own.iter().any(|t| *t > from - margin && *t < s + margin);
            let inside = if touched { None } else { sampling.least(obstacle, &interval) };
            let inside = inside.filter(|least| {
                let beside = own.iter().any(|t| (t - least.arc_length).abs() < BESIDE * length);
                let clear = if beside { clear.max(RESOLVED) } else { clear };
                least.gap < before.gap.min(after.gap) && least.gap < -clear * length
            });
            let active = own.iter().any(|t| {
                let distance = (t - s).abs();
                distance <= margin || distance < BESIDE * length && after.gap > -DIFFERENT * distance
            });
            let outside = after.gap >= -clear * length || active;
            let end = (!outside).then_some(after);
            for Sample { x, gap, .. } in inside.into_iter().chain(end) {
                let place = (element, x);
                let start = Penetration { obstacle, stations: Vec::new(), deepest: place, between: (from, s) };
                let (penetration, least) = run.get_or_insert((start, gap));
                if gap < *least {
                    (penetration.deepest, *least) = (place, gap);
                }
            }
            if !outside {
                run.iter_mut().for_each(|(penetration, _)| penetration.stations.push((element, after.x)));
            } else if let Some((mut penetration, _)) = run.take() {
                penetration.between.1 = s;
                found.push(penetration);
            }
        }
        if let Some((mut penetration, _)) = run.take() {
            penetration.between.1 = f64::INFINITY;
            found.push(penetration);
        }
    }
    found
}

/// The gap to an obstacle at a place of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    x: f64,
    arc_length: f64,
    gap: f64,
    /// Radius of curvature of the obstacle, with that of the rod, m; infinite for a plane.
    radius: f64,
}

/// The part of an element between two successive stations, or between its start and its first station.
struct Interval {
    element: usize,
    /// The start of the element.
    start: Place,
    before: Sample,
    after: Sample,
}

/// The obstacles and a rod whose centre line has given tangents, with its stations.
pub(super) struct Sampling<'b, 'a> {
    rod: &'b Rod,
    tangents: &'b [Vector3<f64>],
    obstacles: &'b Obstacles<'a>,
    pub stations: Vec<Place>,
}

impl<'b, 'a> Sampling<'b, 'a> {
    pub fn new(rod: &'b Rod, tangents: &'b [Vector3<f64>], obstacles: &'b Obstacles<'a>) -> Self {
        Self { rod, tangents, obstacles, stations: all_stations(rod, tangents) }
    }

    /// The gap at a place to an obstacle.
    fn at(&self, obstacle: usize, place: &Place) -> Sample {
        let gap = self.obstacles.gap(obstacle, &place.position);
        // The principal curvatures a and b follow from a + b and a² + b².
        let (trace, square) = (gap.curvature.trace(), gap.curvature.norm_squared());
        let largest = 0.5 * (trace + (2.0 * square - trace * trace).max(0.0).sqrt());
        let radius = if largest > 0.0 { (1.0 / largest - gap.value).max(0.0) } else { f64::INFINITY };
        Sample { x: place.x, arc_length: place.arc_length, gap: gap.value, radius }
    }

    /// The intervals between the stations, of which the first begins at the base.
    fn intervals(&self, obstacle: usize) -> impl Iterator<Item = Interval> {
        let mut start = Place { element: 0, x: 0.0, arc_length: 0.0, position: Vector3::zeros() };
        let mut before = self.at(obstacle, &start);
        self.stations.iter().map(move |station| {
            let after = self.at(obstacle, station);
            let interval = Interval { element: station.element, start, before, after };
            before = after;
            if station.x >= 1.0 {
                (before.x, start) = (0.0, *station);
            }
            interval
        })
    }

    /// The least gap at places inside an interval. A gap changes by at most the arc length. Parts are left out where it
    /// is at least half the smaller one at their ends.
    fn least(&self, obstacle: usize, interval: &Interval) -> Option<Sample> {
        let Interval { element, start, before: from, after: to } = interval;
        let spacing = to.arc_length - from.arc_length;
        let finest = (spacing / PARTS).min(RESOLUTION * from.radius.min(to.radius)).max(FINEST * spacing);
        let (mut parts, mut least) = (vec![[*from, *to]], None::<Sample>);
        while let Some([from, to]) = parts.pop() {
            let size = to.arc_length - from.arc_length;
            if size <= finest || !(from.gap.max(to.gap) < size) {
                continue;
            }
            let at = (*element, 0.5 * (from.x + to.x));
            let middle = place(self.rod, self.tangents, at, start.arc_length, &start.position);
            let middle = self.at(obstacle, &middle);
            if least.is_none_or(|least| middle.gap < least.gap) {
                least = Some(middle);
            }
            parts.extend([[from, middle], [middle, to]]);
        }
        least
    }
}

/// The place with the least gap to an obstacle in each interval up to a station, which belongs to it.
fn closest(sampling: &Sampling, obstacle: usize) -> impl Iterator<Item = Sample> {
    sampling.intervals(obstacle).map(move |interval| {
        let inside = sampling.least(obstacle, &interval).filter(|least| least.gap < interval.after.gap);
        inside.unwrap_or(interval.after)
    })
}

/// Bounds on the displacement in a step: for each obstacle and each station, and the part of the rod before it, the
/// largest displacement that does not approach the obstacle by more than half the gap or a part of its radius, m.
pub(super) fn approaches(sampling: &Sampling) -> Vec<Vec<f64>> {
    let bound = |at: Sample| (0.5 * at.gap).max(LARGEST_APPROACH * (at.radius + at.gap.max(0.0)));
    let bounds = |obstacle| closest(sampling, obstacle).map(bound).collect();
    (0..sampling.obstacles.contacts.len()).map(bounds).collect()
}

/// Whether the rod penetrates an obstacle by more than half its radius, beyond which it may leave it on the other side.
pub(super) fn is_deep(sampling: &Sampling) -> bool {
    let deep = |obstacle| closest(sampling, obstacle).any(|at| at.gap < -0.5 * at.radius);
    (0..sampling.obstacles.contacts.len()).any(deep)
}

/// The largest share of a displacement of the stations that is within the bounds of `approaches`.
pub(super) fn largest_share(bounds: &[Vec<f64>], from: &[Place], to: &[Place]) -> f64 {
    let moved: Vec<f64> = from.iter().zip(to).map(|(from, to)| (to.position - from.position).norm()).collect();
    let mut share = 1.0_f64;
    for i in 0..moved.len() {
        let moved = moved[i].max(moved[i.saturating_sub(1)]);
        for allowed in bounds.iter().map(|bounds| bounds[i]) {
            if moved > allowed {
                share = share.min(allowed / moved);
            }
        }
    }
    share
}
