//! The obstacles of a rod, and the places of the rod that are close to them.

use std::convert::Infallible;

use nalgebra::{Matrix3, Vector3};

use super::candidate::Candidate;
use super::law::Gap;
use super::line::{Line, LinePlace};
use super::reduced::Surfaces;
use super::settings;
use crate::numerics::scalar::bracketed_root;
use crate::rod::{Rod, centre_line_tangent, weighted};
use crate::support::{Contact, Obstacle, Patch, Reaction};

/// Number of halvings of an interval between two stations in the search for places close to an
/// obstacle.
const DEPTH: usize = 16;
/// Smallest number of halvings. A minimum that the slopes at the ends of an interval of length h do
/// not show is less than κ h²/8 deep for the curvature κ of the rod, if the obstacle is convex.
const LEAST_DEPTH: usize = 2;
/// Accuracy of the place of a minimum, relative to an element.
const PLACED: f64 = 1e-12;
/// Length of an interval that is not halved further, relative to the radius of curvature of the
/// obstacle or of the surface of equal gap.
const RESOLUTION: f64 = 0.25;

/// The obstacles of a rod at a time. Inside a search, each surface of an obstacle is an obstacle
/// with its own index.
pub(super) struct Obstacles<'a> {
    pub contacts: Vec<Contact<&'a dyn Obstacle>>,
    /// The obstacle of the support to which each surface belongs, and the index of the surface
    /// there.
    names: Vec<(usize, usize)>,
    /// Displacements of the obstacles by the forces on them, m.
    pub yielded: Vec<Vector3<f64>>,
    /// Their displacements per force, m/N.
    pub compliances: Vec<Matrix3<f64>>,
    pub time: f64,
}

impl Surfaces for Obstacles<'_> {
    fn gap(&self, obstacle: usize, place: &Vector3<f64>) -> Gap {
        self.gap_in(obstacle, place, self.time)
    }
}

impl<'a> Obstacles<'a> {
    pub fn new(bodies: Vec<Contact<&'a dyn Obstacle>>, time: f64) -> Self {
        let surfaces = |(body, contact): (usize, Contact<&'a dyn Obstacle>)| {
            (0..contact.obstacle.surfaces()).map(move |surface| (contact, (body, surface)))
        };
        let (contacts, names): (Vec<_>, Vec<_>) =
            bodies.into_iter().enumerate().flat_map(surfaces).unzip();
        let compliances = contacts
            .iter()
            .map(|contact| contact.obstacle.compliance())
            .collect();
        let yielded = vec![Vector3::zeros(); contacts.len()];
        Self {
            contacts,
            names,
            yielded,
            compliances,
            time,
        }
    }

    /// The index of a surface of an obstacle of the support. An earlier equilibrium may have had
    /// more of them.
    pub fn index(&self, obstacle: usize, surface: usize) -> Option<usize> {
        self.names
            .iter()
            .position(|name| *name == (obstacle, surface))
    }

    /// The index of the obstacle of the support to which a surface belongs.
    pub fn name_of(&self, surface: usize) -> usize {
        self.names[surface].0
    }

    /// Replaces the indices of surfaces by those of obstacles of the support and of their surfaces.
    pub fn name(&self, reactions: &mut [Reaction], patches: &mut [Patch]) {
        for at in reactions {
            if let Some(obstacle) = &mut at.obstacle {
                (*obstacle, at.surface) = self.names[*obstacle];
            }
        }
        for at in patches {
            (at.obstacle, at.surface) = self.names[at.obstacle];
        }
    }

    /// Whether two surfaces are parts of one obstacle of the support, which moves as a whole.
    pub fn move_together(&self, a: usize, b: usize) -> bool {
        self.names[a].0 == self.names[b].0
    }

    /// The gap at a place (m) to an obstacle in its displaced position.
    pub fn gap_at(&self, obstacle: usize, place: &Vector3<f64>) -> Gap {
        self.gap(obstacle, &(place - self.yielded[obstacle]))
    }

    /// An upper bound of the motion of the surface of an obstacle beside a place (m) until a time
    /// (s), m: the change of the gap, and the rotation of the normal about the centre of curvature.
    pub fn motion(&self, obstacle: usize, place: &Vector3<f64>, time: f64) -> f64 {
        let (before, after) = (
            self.gap_at(obstacle, place),
            self.gap_then(obstacle, place, time),
        );
        let radius = Self::radius(&before);
        let across = if radius.is_finite() {
            radius + before.value.max(0.0)
        } else {
            0.0
        };
        (after.value - before.value).abs() + (after.normal - before.normal).norm() * across
    }

    /// The gap at a place (m) to an obstacle in its displaced position, at another time (s).
    pub fn gap_then(&self, obstacle: usize, place: &Vector3<f64>, time: f64) -> Gap {
        self.gap_in(obstacle, &(place - self.yielded[obstacle]), time)
    }

    /// The gap at a place (m) to an obstacle without its displacement, at a time (s).
    fn gap_in(&self, obstacle: usize, place: &Vector3<f64>, time: f64) -> Gap {
        let contact = &self.contacts[obstacle];
        let distance = contact
            .obstacle
            .distance_to(self.names[obstacle].1, place, time);
        Gap {
            value: distance.value - contact.radius,
            ..distance
        }
    }

    /// The displacements of the obstacles by the opposites of forces on the rod (N), m.
    pub fn displacements(
        &self,
        forces: impl Iterator<Item = (usize, Vector3<f64>)>,
    ) -> Vec<Vector3<f64>> {
        let mut all = vec![Vector3::zeros(); self.contacts.len()];
        for (obstacle, force) in forces {
            for (other, displacement) in all.iter_mut().enumerate() {
                if self.move_together(other, obstacle) {
                    *displacement -= self.compliances[obstacle] * force;
                }
            }
        }
        all
    }

    /// The displacements of the obstacles in an equilibrium with the given reactions, m.
    pub fn displacements_by(&self, reactions: &[Reaction]) -> Vec<Vector3<f64>> {
        let surface = |at: &Reaction| self.index(at.obstacle?, at.surface);
        self.displacements(
            reactions
                .iter()
                .filter_map(|at| Some((surface(at)?, at.force))),
        )
    }

    /// The least radius of curvature of an obstacle at a place, given the gap there, m.
    pub fn radius(gap: &Gap) -> f64 {
        // The principal curvatures a and b follow from a + b and a² + b².
        let (trace, square) = (gap.curvature.trace(), gap.curvature.norm_squared());
        let largest = 0.5 * (trace + (2.0 * square - trace * trace).max(0.0).sqrt());
        if largest > 0.0 {
            (1.0 / largest - gap.value).max(0.0)
        } else {
            f64::INFINITY
        }
    }
}

/// The gap to an obstacle at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub element: usize,
    pub x: f64,
    pub arc_length: f64,
    /// Length of the centre line up to the place, m. A gap changes by at most this length.
    pub path: f64,
    pub gap: f64,
    /// Derivative of the gap along the rod.
    pub slope: f64,
    /// Least radius of curvature of the obstacle, m.
    pub radius: f64,
}

/// The gaps of a rod to one obstacle.
pub(super) struct Gaps<'b, 'a> {
    pub rod: &'b Rod,
    pub line: &'b Line,
    pub obstacles: &'b Obstacles<'a>,
    pub obstacle: usize,
    /// Strains of the centre line at the material points, for slopes along its tangent. An empty
    /// slice gives slopes along d3, the direction in which contacts slide.
    pub strains: &'b [Vector3<f64>],
}

impl Sample {
    /// This place as one of an element that contains it, or begins there.
    fn in_element(self, element: usize) -> Self {
        if self.element == element {
            self
        } else {
            Self {
                element,
                x: 0.0,
                ..self
            }
        }
    }
}

impl Gaps<'_, '_> {
    pub fn at(&self, place: &LinePlace) -> Sample {
        let gap = self.obstacles.gap_at(self.obstacle, &place.position);
        let LinePlace {
            element,
            x,
            arc_length,
            path,
            ..
        } = *place;
        let p = self.rod.order().points();
        let strains = self.strains.get(element * p..(element + 1) * p);
        let at_place = |strains: &[_]| weighted(strains, &self.rod.reference().at_points(x));
        let tangent =
            self.rod.frame_within(element, x) * strains.map_or_else(centre_line_tangent, at_place);
        let (radius, slope) = (Obstacles::radius(&gap), gap.normal.dot(&tangent));
        Sample {
            element,
            x,
            arc_length,
            path,
            gap: gap.value,
            slope,
            radius,
        }
    }

    fn within(&self, element: usize, x: f64) -> Sample {
        self.at(&self.line.place(self.rod, (element, x)))
    }

    /// The gap at the base and at all stations, m.
    pub fn at_stations(&self) -> Vec<f64> {
        self.line
            .places
            .iter()
            .map(|place| self.obstacles.gap_at(self.obstacle, &place.position).value)
            .collect()
    }

    /// The intervals between two neighbouring stations in which the gap may be less than `bound`
    /// (m), given its values at all stations.
    pub fn intervals(&self, values: &[f64], bound: f64) -> impl Iterator<Item = [Sample; 2]> {
        // A gap changes by at most the length of the centre line.
        let low = move |(values, ends): &(&[f64], &[LinePlace])| {
            values[0] + values[1] - (ends[1].path - ends[0].path) < 2.0 * bound
        };
        let all = values
            .windows(2)
            .zip(self.line.places.windows(2))
            .filter(low);
        all.map(|(_, ends)| [&ends[0], &ends[1]].map(|place| self.at(place)))
    }

    /// The local minima of the gap below `bound` (m) inside an interval between two neighbouring
    /// stations. A minimum may be a kink of the gap, where the nearest face of an obstacle changes.
    pub fn minima(&self, from: &Sample, to: &Sample, bound: f64) -> Vec<Sample> {
        let from = from.in_element(to.element);
        // The gap to a convex obstacle varies at the scale of the radius of the surface of equal
        // gap.
        let scale = |at: &Sample| at.radius + at.gap.max(0.0);
        let finest = RESOLUTION * scale(&from).min(scale(to));
        let (mut parts, mut minima) = (vec![(from, *to, 0)], Vec::new());
        while let Some((from, to, depth)) = parts.pop() {
            let size = to.path - from.path;
            if !(from.gap + to.gap - size < 2.0 * bound) {
                continue;
            }
            if depth < LEAST_DEPTH || size > finest && depth < DEPTH {
                let middle = self.within(to.element, 0.5 * (from.x + to.x));
                parts.extend([(middle, to, depth + 1), (from, middle, depth + 1)]);
            } else if from.slope < 0.0 && to.slope >= 0.0 {
                minima.extend(Some(self.minimum(&from, &to)).filter(|at| at.gap < bound));
            }
        }
        minima
    }

    /// A lower bound of the gap inside an interval between two neighbouring places. Intervals are
    /// halved until the bound is half of the gap at an end, or until they are short relative to the
    /// radius of the obstacle.
    pub fn lowest(&self, from: &Sample, to: &Sample, depth: usize) -> f64 {
        let from = from.in_element(to.element);
        let size = to.path - from.path;
        let bound = 0.5 * (from.gap + to.gap - size);
        let finest = RESOLUTION * from.radius.min(to.radius);
        if bound >= 0.5 * from.gap.min(to.gap) || size <= finest || depth == DEPTH {
            return bound;
        }
        let middle = self.within(to.element, 0.5 * (from.x + to.x));
        self.lowest(&from, &middle, depth + 1)
            .min(self.lowest(&middle, to, depth + 1))
    }

    /// The minimum of the gap between two places of an element with slopes of opposite signs.
    fn minimum(&self, from: &Sample, to: &Sample) -> Sample {
        let at = |x: f64| self.within(to.element, x);
        let bracket = [from, to].map(|sample| (sample.x, sample.slope));
        let Ok(ends) = bracketed_root(bracket, PLACED, |x| Ok::<_, Infallible>(at(x).slope));
        // At a kink the slope has no zero, and the ends of the bracket are on both sides.
        let [a, b] = ends.map(at);
        if a.gap <= b.gap { a } else { b }
    }
}

/// The factor by which a motion of the base and the stations may be longer, so that no part of the
/// rod moves by more than a part of the sum of its gap to an obstacle and the radius of the
/// obstacle. `moved` is the length of the motion of a place relative to an obstacle, m. Parts
/// beside one of the given contacts, up to the next maxima of the gap, are left out: the contact
/// represents them.
pub(super) fn safe_factor<'c>(
    obstacles: &Obstacles,
    contacts: impl Iterator<Item = &'c Candidate> + Clone,
    (rod, line): (&Rod, &Line),
    moved: impl Fn(usize, usize) -> f64,
) -> f64 {
    let places = &line.places;
    let (mut factor, last) = (f64::INFINITY, places.len() - 1);
    for obstacle in 0..obstacles.contacts.len() {
        let at = |place: &LinePlace| {
            let gap = obstacles.gap_at(obstacle, &place.position);
            (gap.value, Obstacles::radius(&gap))
        };
        let gaps: Vec<(f64, f64)> = places.iter().map(at).collect();
        let moved: Vec<f64> = (0..=last).map(|i| moved(obstacle, i)).collect();
        let mut known = vec![false; last];
        for candidate in contacts.clone().filter(|at| at.obstacle == obstacle) {
            let after = places[1..]
                .iter()
                .position(|place| place.arc_length >= candidate.arc_length);
            let here = after.unwrap_or(last - 1);
            let ahead = (here..last).take_while(|i| *i == here || gaps[i + 1].0 >= gaps[*i].0);
            let behind = (0..=here)
                .rev()
                .take_while(|i| *i == here || gaps[*i].0 >= gaps[i + 1].0);
            ahead.chain(behind).for_each(|i| known[i] = true);
        }
        for i in (0..last).filter(|i| !known[*i]) {
            let (way, radius) = (moved[i].max(moved[i + 1]), gaps[i].1.min(gaps[i + 1].1));
            let allowed = |least: f64| settings::APPROACH * (radius + least.max(0.0));
            let size = places[i + 1].path - places[i].path;
            let mut least = 0.5 * (gaps[i].0 + gaps[i + 1].0 - size);
            if allowed(least) < factor * way {
                let search = Gaps {
                    rod,
                    line,
                    obstacles,
                    obstacle,
                    strains: &[],
                };
                least = search.lowest(&search.at(&places[i]), &search.at(&places[i + 1]), 0);
            }
            factor = factor.min(allowed(least) / way);
        }
    }
    factor
}

/// The factor by which a motion of an open candidate by a length (m) may be longer, so that it does
/// not pass its obstacle, given the gap before.
pub(super) fn opening_factor(before: &Gap, moved: f64) -> f64 {
    (before.value.max(0.0) + settings::APPROACH * Obstacles::radius(before)) / moved
}

/// The factor by which a motion of a contact may be longer, so that it does not pass to the other
/// side of its obstacle, given the normals before and after. It is infinite if the normal rotates
/// by at most `LARGEST_TURN`.
pub(super) fn contact_factor(before: &Vector3<f64>, after: &Vector3<f64>) -> f64 {
    let turned = before.angle(after);
    if turned > settings::LARGEST_TURN {
        settings::LARGEST_TURN / turned
    } else {
        f64::INFINITY
    }
}
