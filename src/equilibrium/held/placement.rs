//! Nodes at contacts: the shape of a rod is smooth only between the places at which contact forces
//! act.
//!
//! A contact point is at a node. At the ends of a contact segment the curvature of the rod is that
//! of the obstacle. An end that is misplaced by δ changes the shape by O(δ²), so that the relative
//! curvature g″ at a fixed place depends on it to second order only: −g″/g‴, with the derivative on
//! the free side, is Newton's step for the end. The shape of a coarse rod also depends on its
//! nodes. The distances from the ends may then decrease by a ratio, which [`super::ends`]
//! estimates.

use nalgebra::Vector3;

use super::candidate::Candidate;
use super::ends::End;
use super::law::Status;
use super::line::{Line, LinePlace};
use super::search::HeldSearch;
use super::settings::{self, SAME};
use super::trial::Course;
use crate::rod::Rod;
use crate::support::Patch;

/// Distance of a contact from a node, relative to the element, below which the element is not
/// divided.
const AT_NODE: f64 = 1e-4;
/// Distance over which the derivative of the curvature is estimated, relative to an element.
const DIFFERENCE: f64 = 1e-3;
/// Length of an element, relative to the usual one, up to which its ends are its only stations in a
/// contact segment. Forces between them act as a couple, and change by their own size for gaps of
/// 1e-8 of the length. With 0.07 the ratio of tensions in the example `capstan` has a relative
/// error of 5e-5.
const SHORT: f64 = 0.05;
/// Largest gap inside a contact segment, relative to an element. Until a node is at the end of a
/// segment, stations in contact alternate with small gaps. A gap that is open at as many successive
/// stations as an element has divides the segment.
const TOUCHING: f64 = 1e-4;
/// Motion of an end, relative to the length, below which rounding of the curvature may cause it. It
/// is assumed if an extrapolated motion is more than one half of the one before.
const ROUNDED: f64 = 1e-7;
/// Ratio of the distances from a contact of the nodes that resolve the layer beside it.
const GRADING: f64 = 3.0;

/// Contacts to which nodes have to move.
pub(super) struct Misplaced {
    pub patches: Vec<Patch>,
    /// Largest distance of a node from its place, m.
    pub distance: f64,
    /// The ends of contact segments.
    pub ends: Vec<End>,
}

impl HeldSearch<'_> {
    /// The contacts of the present shape, if nodes are not at them or stations are not those of
    /// contact segments.
    pub(super) fn misplaced(&mut self, rod: &Rod, course: &Course) -> Option<Misplaced> {
        let touching = TOUCHING * self.element;
        let mut patches = self.patches(rod, touching);
        let (moved, ends) = self.move_ends(rod, &mut patches, &course.ends);
        let nodes = rod.ends();
        let off = |s: f64| {
            nodes
                .iter()
                .map(|node| (node - s).abs())
                .fold(f64::INFINITY, f64::min)
        };
        let reach = AT_NODE * self.element;
        let apart = patches
            .iter()
            .flat_map(|patch| [off(patch.from), off(patch.to)])
            .fold(0.0, f64::max);
        let apart = if apart <= 2.0 * reach { 0.0 } else { apart };
        let largest = moved.max(apart);
        self.layer = self.bending_length(rod, self.forces());
        // Contacts that have opened keep their nodes.
        let opened = self
            .candidates
            .iter()
            .filter(|at| at.touched && at.follows_gap && at.status == Status::Open);
        let kept = opened.map(|at| Patch {
            obstacle: at.obstacle,
            surface: 0,
            from: at.arc_length,
            to: at.arc_length,
        });
        patches.extend(kept);
        // A candidate has the wrong kind if it is a point inside a contact segment, or a station
        // that is alone in its contact.
        let differs = |at: &Candidate| {
            patches
                .iter()
                .filter(|patch| patch.obstacle == at.obstacle)
                .any(|patch| {
                    let inside = patch.from < at.arc_length && at.arc_length < patch.to;
                    let alone = patch.from == patch.to
                        && (at.arc_length - patch.from).abs() <= SAME * self.length;
                    at.point && inside || !at.point && at.status != Status::Open && alone
                })
        };
        let extrapolated =
            course.placements > 2 && course.ends.iter().any(|end| end.before.is_some());
        let small =
            largest < ROUNDED * self.length && largest > 0.5 * course.distance * self.length;
        let rounds = extrapolated && small;
        let misplaced = largest > settings::PLACED * self.length && !rounds;
        let moves = misplaced || self.candidates.iter().any(differs);
        if rounds && !moves {
            self.found.error = self.found.error.max(largest / self.length);
        }
        moves.then_some(Misplaced {
            patches,
            distance: largest,
            ends,
        })
    }

    /// The contacts, in order of obstacle and arc length. Neighbouring stations in contact are one
    /// segment; the gap between them is at most `touching` (m).
    pub(super) fn patches(&self, rod: &Rod, touching: f64) -> Vec<Patch> {
        let mut loaded: Vec<&Candidate> = self
            .candidates
            .iter()
            .filter(|at| at.status != Status::Open)
            .collect();
        loaded.sort_by(|a, b| {
            a.obstacle
                .cmp(&b.obstacle)
                .then(a.arc_length.total_cmp(&b.arc_length))
        });
        let stations = self.line.stations();
        let margin = SAME * self.length;
        let near = settings::NEAR * self.element;
        let open = |obstacle: usize, from: f64, to: f64| {
            // Stations close to a contact may be no candidates. They do not show whether a gap
            // extends over an element.
            let resolved =
                |place: &&LinePlace| place.arc_length > from + near && place.arc_length < to - near;
            let inside = |s: f64| s > from + margin && s < to - margin;
            let candidates = self
                .candidates
                .iter()
                .filter(|at| at.obstacle == obstacle && at.status == Status::Open);
            let wide = touching.max(margin);
            let between = stations.iter().filter(|place| inside(place.arc_length));
            between.clone().filter(resolved).count() >= rod.order().points()
                || candidates
                    .clone()
                    .any(|at| inside(at.arc_length) && at.gap.value > wide)
                || between
                    .clone()
                    .any(|place| self.obstacles.gap_at(obstacle, &place.position).value > wide)
        };
        let together = |a: &&Candidate, b: &&Candidate| {
            // Two places of least gap are two contacts.
            let points = a.follows_gap && b.follows_gap;
            a.obstacle == b.obstacle && !points && !open(a.obstacle, a.arc_length, b.arc_length)
        };
        let first = stations.first().map_or(0.0, |place| place.arc_length);
        let patch = |members: &[&Candidate]| {
            let (at, last) = (members.first()?, members.last()?);
            let mut patch = Patch {
                obstacle: at.obstacle,
                surface: 0,
                from: at.arc_length,
                to: last.arc_length,
            };
            // Two neighbouring stations bear the force of a contact point between them.
            if let [a, b] = members
                && a.approach().1 > 0.0
                && b.approach().1 > 0.0
            {
                let (p, q) = (a.normal().max(0.0), b.normal().max(0.0));
                patch.from = if p + q > 0.0 {
                    (patch.from * p + patch.to * q) / (p + q)
                } else {
                    patch.from
                };
                patch.to = patch.from;
            }
            // A contact along the first element may begin at the base.
            let at_base = patch.to > patch.from && patch.from <= first + margin;
            if at_base
                && self
                    .obstacles
                    .gap_at(patch.obstacle, &rod.base_position())
                    .value
                    <= margin
            {
                patch.from = 0.0;
            }
            Some(patch)
        };
        loaded.chunk_by(together).filter_map(patch).collect()
    }

    /// Moves the ends of contact segments towards the places at which the relative curvature
    /// vanishes, extrapolated from the placements `before`. Returns the largest distance of an end
    /// from a node, m, and the ends.
    fn move_ends(&self, rod: &Rod, patches: &mut [Patch], before: &[End]) -> (f64, Vec<End>) {
        let (mut largest, mut ends) = (0.0_f64, Vec::new());
        let element = self.element;
        let inside = |s: f64| s > SAME * self.length && s < self.length * (1.0 - SAME);
        for patch in patches.iter_mut().filter(|patch| patch.to > patch.from) {
            let obstacle = patch.obstacle;
            let Patch { from, to, .. } = patch;
            // `outward` is the direction along the rod from the contact to its free side.
            for (place, outward) in [(&mut *from, -1.0), (&mut *to, 1.0)] {
                let end = *place;
                if !inside(end) {
                    continue;
                }
                let delta = outward * DIFFERENCE * element;
                let bend = self.relative_bend(rod, obstacle, end);
                let slope = (self.relative_bend(rod, obstacle, end + delta) - bend) / delta;
                let longest = settings::PLACING_MOTION * element;
                // The relative curvature increases beyond the end; otherwise the end moves by the
                // largest step.
                let by = if slope * outward > 0.0 {
                    -bend / slope
                } else {
                    outward * -bend.signum() * f64::INFINITY
                };
                let by = by.clamp(-longest, longest);
                let next = End::after(before, (obstacle, outward, end + by), longest);
                // A node that is at the end already may bear no force, so that the contact seems to
                // end before it.
                let nodes = self
                    .candidates
                    .iter()
                    .filter(|at| at.obstacle == obstacle && at.x.fract() == 0.0);
                let apart = (next.node - end).abs();
                largest = largest.max(
                    nodes
                        .map(|at| (at.arc_length - next.node).abs())
                        .fold(apart, f64::min),
                );
                *place = next.node;
                ends.push(next);
            }
            (*from, *to) = (from.max(0.0), to.min(self.length));
            if *from >= *to {
                let middle = 0.5 * (*from + *to);
                (*from, *to) = (middle, middle);
            }
        }
        (largest, ends)
    }

    /// Second derivative of the gap along the rod at an arc length (m), 1/m, from the couple at the
    /// place.
    fn relative_bend(&self, rod: &Rod, obstacle: usize, s: f64) -> f64 {
        let Some((e, x)) = rod.locate(s) else {
            return f64::NAN;
        };
        let p = rod.order().points();
        let gap = self
            .obstacles
            .gap_at(obstacle, &self.line.place(rod, (e, x)).position);
        let (frame, point) = (rod.frame_within(e, x), rod.point_within(e, x));
        // The couple at the place, integrated from the apex.
        let mut couple: Vector3<f64> = self.couples_beyond(rod, e, x);
        let forces = self.body.force().at_points();
        let reference = rod.reference();
        // The place bears the part of its own element that is beyond it.
        let upto = if x < 1.0 {
            reference.integral_upto(x)
        } else {
            reference.within(x)
        };
        for i in e * p..rod.points().len() {
            let beyond = reference.weights[i % p] - if i < (e + 1) * p { upto[i % p] } else { 0.0 };
            couple += self.line.tangents[i].cross(&forces[i]) * (beyond * rod.points()[i].jacobian);
        }
        let near = rod.strain_within(e, x) - point.intrinsic;
        let local = frame.inverse_transform_vector(&couple);
        let strain = point.intrinsic + self.body.strain_under(&point, &near, &local);
        let tangent = frame * Vector3::z();
        let bend = frame * strain.cross(&Vector3::z());
        gap.normal.dot(&bend) + tangent.dot(&(gap.curvature * tangent))
    }

    /// The couples of held frames beyond a place, N m.
    fn couples_beyond(&self, rod: &Rod, e: usize, x: f64) -> Vector3<f64> {
        let joints = &self.body.system().joints;
        let each = joints.confined.iter().zip(&joints.held);
        let beyond = each.filter(|((node, _), _)| *node > e + usize::from(x >= 1.0));
        beyond
            .map(|((node, _), held)| rod.frames()[*node] * -held)
            .sum()
    }

    /// The arc lengths (m) of the nodes that contacts add: their ends, and places beside them that
    /// resolve the layer in which the rod bends from the obstacle.
    fn cuts(&self, patches: &[Patch]) -> Vec<f64> {
        let mut cuts = Vec::new();
        let longest = self.element;
        for patch in patches {
            cuts.extend([patch.from, patch.to]);
            let mut distance = self.layer.max(SAME * self.length);
            while distance < 0.7 * longest {
                cuts.extend([patch.from - distance, patch.to + distance]);
                distance *= GRADING;
            }
        }
        cuts.retain(|s| *s >= 0.0 && *s <= self.length);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| *a - *b <= SAME * self.length);
        cuts
    }

    /// The length √(B/n) over which the rod bends beside a contact, m, for the largest force n (N)
    /// between given reactions, each with its place along the rod in any unit. The length is
    /// rounded to a power of two, so that the nodes do not move with each change of the force.
    pub(super) fn bending_length(&self, rod: &Rod, mut reactions: Vec<(f64, Vector3<f64>)>) -> f64 {
        reactions.sort_by(|a, b| a.0.total_cmp(&b.0));
        let bending = rod
            .points()
            .iter()
            .map(|point| self.body.stiffness(point))
            .map(|k| k[(0, 0)].min(k[(1, 1)]));
        let mut force = self.body.force().load_at_base()
            + reactions
                .iter()
                .map(|(_, force)| force)
                .sum::<Vector3<f64>>();
        let mut largest = force.norm();
        for (_, reaction) in &reactions {
            force -= reaction;
            largest = largest.max(force.norm());
        }
        let length = (bending.fold(f64::INFINITY, f64::min) / largest).sqrt();
        length.log2().round().exp2()
    }

    /// The forces of all sites and candidates, N, each with its place along the rod in elements.
    fn forces(&self) -> Vec<(f64, Vector3<f64>)> {
        let sites = self
            .sites
            .iter()
            .map(|site| (site.node as f64, site.reaction()));
        let candidates = self
            .candidates
            .iter()
            .map(|at| (at.element as f64 + at.x, at.force));
        sites.chain(candidates).collect()
    }

    /// Gives the rod nodes at the ends of patches, and candidates at contact points and at all
    /// stations of contact segments. Each of `old` gives its force to the nearest candidate, or
    /// divides it between two stations.
    pub(super) fn arrange(&mut self, rod: &mut Rod, patches: &[Patch], old: &[Candidate]) {
        let source = rod.clone();
        let nodes = source.ends();
        *rod = self.parent.with_nodes(&self.cuts(patches), AT_NODE);
        rod.sample_shape(&source);
        let new = rod.ends();
        let margin = SAME * self.length;
        // Holds are at ends of elements of the parent, which are ends of elements of each rod.
        let moved = |node: usize| {
            new.iter()
                .position(|s| (s - nodes[node]).abs() <= margin)
                .unwrap_or(node)
        };
        self.sites
            .iter_mut()
            .for_each(|site| site.node = moved(site.node));
        self.frames
            .iter_mut()
            .for_each(|frame| frame.node = moved(frame.node));
        self.body.system_mut().joints.move_nodes(moved);
        self.body.renew_load(rod);
        // Only the arc lengths of its stations are used.
        let line = Line::new(rod, &[]);
        self.candidates.clear();
        for patch in patches {
            self.candidates
                .extend(self.stations_of(rod, patch, line.stations()));
        }
        transfer(old, &mut self.candidates);
        self.apply(rod);
        self.locate(rod);
    }

    /// Adds candidates where a rod with a free base lies on an obstacle before the search.
    pub(super) fn lay(&mut self, rod: &mut Rod) {
        if self.body.system().joints.free_base.is_none() || !self.candidates.is_empty() {
            return;
        }
        let places = &self.line.places;
        let mut patches: Vec<Patch> = Vec::new();
        for obstacle in 0..self.obstacles.contacts.len() {
            let touches = |at: &LinePlace| {
                self.obstacles.gap_at(obstacle, &at.position).value.abs() <= SAME * self.length
            };
            patches.extend(
                places
                    .chunk_by(|a, b| touches(a) && touches(b))
                    .filter_map(|run| {
                        let [first, .., last] = run else { return None };
                        Some(Patch {
                            obstacle,
                            surface: 0,
                            from: first.arc_length,
                            to: last.arc_length,
                        })
                    }),
            );
        }
        if !patches.is_empty() {
            self.arrange(rod, &patches, &[]);
            // The tangent without the forces of these contacts does not show whether the rod is
            // stable.
            self.candidates
                .iter_mut()
                .for_each(|at| at.status = Status::Sticking);
        }
    }

    /// The candidates of a contact: a point, or the ends and all stations of a segment.
    fn stations_of(&self, rod: &Rod, patch: &Patch, stations: &[LinePlace]) -> Vec<Candidate> {
        let margin = SAME * self.length;
        let point = patch.from == patch.to;
        let new = |s: f64, at| Candidate::at(patch.obstacle, s, at, point);
        let mut ends = vec![patch.from, patch.to];
        ends.dedup();
        // A base that is not free does not move.
        ends.retain(|s| *s > margin || self.body.system().joints.free_base.is_some());
        let mut candidates: Vec<Candidate> = ends
            .iter()
            .filter_map(|s| Some(new(*s, at_node(rod, *s, margin)?)))
            .collect();
        let inside = stations.iter().filter(|place| {
            let own = rod.length_of(place.element);
            let within = !point && place.arc_length > patch.from && place.arc_length < patch.to;
            let bears = place.x == 1.0 || own > SHORT * self.element;
            within
                && bears
                && ends
                    .iter()
                    .all(|s| (place.arc_length - s).abs() > settings::NEAR * own)
        });
        candidates.extend(inside.map(|place| new(place.arc_length, (place.element, place.x))));
        candidates.sort_by(|a, b| a.arc_length.total_cmp(&b.arc_length));
        candidates
    }
}

/// The place at an arc length (m): the last end of an element if it is within a margin (m).
fn at_node(rod: &Rod, s: f64, margin: f64) -> Option<(usize, f64)> {
    let (e, x) = rod.locate(s)?;
    let length = rod.length_of(e);
    if x * length <= margin && e > 0 {
        Some((e - 1, 1.0))
    } else if (1.0 - x) * length <= margin {
        Some((e, 1.0))
    } else {
        Some((e, x))
    }
}

/// Transfers forces and states of earlier candidates to new ones. The force between two stations of
/// a contact segment is divided between them, so that resultant and couple remain.
fn transfer(old: &[Candidate], new: &mut [Candidate]) {
    for from in old {
        let distance = |at: &Candidate| at.arc_length - from.arc_length;
        let own = (0..new.len()).filter(|i| new[*i].obstacle == from.obstacle);
        let nearest = own.min_by(|a, b| {
            distance(&new[*a])
                .abs()
                .total_cmp(&distance(&new[*b]).abs())
        });
        let Some(nearest) = nearest else { continue };
        let first = distance(&new[nearest]);
        // The stations of a segment are in order, and its neighbour on the other side follows or
        // precedes.
        let beside = if first > 0.0 {
            nearest.checked_sub(1)
        } else {
            Some(nearest + 1)
        };
        let across = |i: &usize| {
            let same = new
                .get(*i)
                .is_some_and(|at| at.obstacle == from.obstacle && !at.point);
            same && distance(&new[*i]) * first < 0.0 && !new[nearest].point
        };
        let beside = beside.filter(across);
        let part = beside.map_or(0.0, |i| first / (first - distance(&new[i])));
        for (i, part) in std::iter::once((nearest, 1.0 - part)).chain(beside.map(|i| (i, part))) {
            let at = &mut new[i];
            at.force += from.force * part;
            at.touched |= from.touched;
            if part > 0.0 && (at.status == Status::Open || from.status == Status::Sticking) {
                at.status = from.status;
            }
        }
    }
}
