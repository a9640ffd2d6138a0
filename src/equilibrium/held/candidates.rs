//! Evaluation of the candidates on a shape, and the search for new ones.

use nalgebra::Vector3;

use super::candidate::Candidate;
use super::law::Status;
use super::line::Line;
use super::obstacles::{Gaps, Sample};
use super::search::HeldSearch;
use super::settings::{self, SAME};
use crate::rod::Rod;

/// Smallest distance of a candidate from a base that is not free, relative to an element. Closer to
/// the base the compliance is almost zero.
const NEAREST: f64 = 2e-3;

impl HeldSearch<'_> {
    /// Evaluates the sites and candidates on the shape of a rod.
    pub(super) fn locate(&mut self, rod: &Rod) {
        let time = self.obstacles.time;
        self.line = self.line_of(rod);
        let forces = self.candidates.iter().map(|at| (at.obstacle, at.force));
        self.obstacles.yielded = self.obstacles.displacements(forces);
        for site in &mut self.sites {
            site.position = self.line.place(rod, site.place()).position;
            if let Some(spring) = &mut site.spring {
                spring.locate(&self.laws, &site.position, time);
            }
        }
        let reach = self.element;
        for at in &mut self.candidates {
            let stiffness = self.body.stiffness(&rod.point_within(at.element, at.x));
            at.flexibility = at.force.norm() / stiffness[(0, 0)].min(stiffness[(1, 1)]);
            let place = self.line.place(rod, (at.element, at.x));
            (at.arc_length, at.position) = (place.arc_length, place.position);
            at.gap = self.obstacles.gap_at(at.obstacle, &at.position);
            let frame = rod.frame_within(at.element, at.x);
            at.tangent = frame * Vector3::z();
            at.bend = frame * rod.strain_within(at.element, at.x).cross(&Vector3::z());
            // At an edge inside an obstacle the gap has a kink, and the derivatives do not show the
            // place of least gap.
            let (slope, bend) = at.approach();
            at.follows_gap =
                at.point && bend > settings::FLAT / self.length && slope.abs() <= bend * reach;
            if self.obstacles.contacts[at.obstacle].friction > 0.0 {
                let material = rod.initial_apex_distance(at.element, at.x);
                at.anchor = self.before.anchor(material, (&self.obstacles, at.obstacle));
            }
        }
    }

    /// The centre line of a rod under its present forces.
    pub(super) fn line_of(&self, rod: &Rod) -> Line {
        Line::new(rod, &self.body.strain_line(rod))
    }

    /// Whether the centre line of a rod has shear or stretch.
    pub(super) fn yields(&self, rod: &Rod) -> bool {
        self.body.line_compliance(rod, 0, 0).is_some()
    }

    /// Adds candidates where the gap is less than `bound` (m), on the last evaluated centre line:
    /// at its local minima, and at all stations beside a contact that penetrate. Returns whether a
    /// candidate was added, moved or changed to a station, and evaluates all candidates then.
    pub(super) fn add_candidates(&mut self, rod: &Rod, bound: f64) -> bool {
        let mut new = Vec::new();
        for obstacle in 0..self.obstacles.contacts.len() {
            let gaps = Gaps {
                rod,
                line: &self.line,
                obstacles: &self.obstacles,
                obstacle,
                strains: &[],
            };
            let own: Vec<&Candidate> = self
                .candidates
                .iter()
                .filter(|at| at.obstacle == obstacle)
                .collect();
            let values = gaps.at_stations();
            new.extend(self.minima(&gaps, &own, &values, bound));
            new.extend(self.penetrating(&gaps, &own, &values, bound));
        }
        let element = self.element;
        let near = settings::NEAR * element;
        let base = self.first_place();
        let mut changed = false;
        for at in new.into_iter().filter(|at| at.arc_length >= base) {
            let s = at.arc_length;
            // Contact points that stray, and open ones that slide, move to the new place.
            let leaves =
                |own: &Candidate| self.strays(own) || own.follows_gap && own.status == Status::Open;
            let close = |own: &Candidate| {
                let (same, distance) = (own.obstacle == at.obstacle, (own.arc_length - s).abs());
                same && own.point
                    && at.point
                    && (distance < near || distance < element && leaves(own))
            };
            // The forces of two stations that are close to each other are undetermined.
            let known =
                |own: &Candidate| own.obstacle == at.obstacle && (own.arc_length - s).abs() <= near;
            if !at.point && self.candidates.iter().any(known) {
                continue;
            }
            changed = true;
            let Some(i) = self.candidates.iter().position(close) else {
                self.candidates.push(at);
                continue;
            };
            let own = &self.candidates[i];
            // A contact point that follows the least gap, is open or strays moves to the new
            // minimum. Elements do not resolve two minima that are so close.
            if own.follows_gap || own.status == Status::Open || self.strays(own) {
                let own = &mut self.candidates[i];
                (own.element, own.x, own.arc_length) = (at.element, at.x, s);
            } else {
                // Beside a contact point that is flat the rod lies on the obstacle.
                self.candidates[i].point = false;
                self.candidates.push(Candidate { point: false, ..at });
            }
        }
        if changed {
            self.locate(rod);
        }
        changed
    }

    /// Whether a contact point inside the rod is no place of least gap, since the rod is steep
    /// there, and does not slide to one.
    pub(super) fn strays(&self, at: &Candidate) -> bool {
        let inside =
            at.arc_length > self.length * SAME && at.arc_length < self.length * (1.0 - SAME);
        at.point && !at.follows_gap && inside && at.approach().0.abs() > settings::STEEP
    }

    /// The smallest arc length of a candidate, m. A base that is not free does not move.
    fn first_place(&self) -> f64 {
        let free = self.body.system().joints.free_base.is_some();
        if free { 0.0 } else { NEAREST * self.element }
    }

    /// The largest penetration at the base, at the stations and at the local minima of all gaps, m:
    /// also at minima that the elements do not resolve.
    pub(super) fn penetration(&self, rod: &Rod) -> f64 {
        let strains = self.body.strain_line(rod);
        let each = (0..self.obstacles.contacts.len()).flat_map(|obstacle| {
            let gaps = Gaps {
                rod,
                line: &self.line,
                obstacles: &self.obstacles,
                obstacle,
                strains: &strains,
            };
            let values = gaps.at_stations();
            let minima = |[from, to]: [Sample; 2]| gaps.minima(&from, &to, 0.0);
            let inner = gaps
                .intervals(&values, 0.0)
                .flat_map(minima)
                .map(|least| -least.gap);
            inner
                .chain(values.iter().map(|gap| -gap))
                .collect::<Vec<f64>>()
        });
        each.fold(0.0, f64::max)
    }

    /// New candidates at the local minima of the gap to an obstacle, which has the given values at
    /// all stations. In an interval in which the rod lies on the obstacle they are its ends.
    fn minima(
        &self,
        gaps: &Gaps,
        own: &[&Candidate],
        values: &[f64],
        bound: f64,
    ) -> Vec<Candidate> {
        let mut new = Vec::new();
        for ends in gaps.intervals(values, bound) {
            let [from, to] = &ends;
            let flat = to.slope - from.slope
                < settings::FLAT / self.length * (to.arc_length - from.arc_length);
            for least in gaps.minima(from, to, bound) {
                if own.iter().any(|at| self.represents(at, &least, [from, to])) {
                    continue;
                }
                if !flat || bound > 0.0 {
                    new.push(Candidate::at(
                        gaps.obstacle,
                        least.arc_length,
                        (least.element, least.x),
                        true,
                    ));
                    continue;
                }
                for end in ends
                    .iter()
                    .filter(|end| end.arc_length >= self.first_place())
                {
                    new.push(Candidate::at(
                        gaps.obstacle,
                        end.arc_length,
                        (end.element, end.x),
                        false,
                    ));
                }
            }
        }
        new
    }

    /// New candidates at stations that penetrate an obstacle: ends of the rod where the gap
    /// decreases outwards, and stations next to a part of the rod that follows the obstacle.
    fn penetrating(
        &self,
        gaps: &Gaps,
        own: &[&Candidate],
        values: &[f64],
        bound: f64,
    ) -> Vec<Candidate> {
        let (margin, element) = (SAME * self.length, self.element);
        let close = settings::NEAR * element;
        let places = &self.line.places;
        let mut new = Vec::new();
        for (i, place) in places
            .iter()
            .enumerate()
            .filter(|(i, _)| values[*i] < bound)
        {
            let (before, next) = (
                &places[i.saturating_sub(1)],
                places.get(i + 1).unwrap_or(place),
            );
            let within = before.arc_length - margin..=next.arc_length + margin;
            let near = || own.iter().filter(|at| within.contains(&at.arc_length));
            let level = values[i] + settings::ROUNDING * self.length;
            let known = near().any(|at| {
                let distance = (at.arc_length - place.arc_length).abs();
                distance <= close && !self.strays(at) || at.follows_gap && at.gap.value <= level
            });
            if known {
                continue;
            }
            let slope = gaps.at(place).slope;
            let end = i == 0 && slope >= 0.0 || i + 1 == places.len() && slope <= 0.0;
            // Beside a contact that penetrates at the next station, the contact is a segment.
            let beside = bound < 0.0 && near().any(|at| Self::follows(at));
            if end || beside {
                new.push(Candidate::at(
                    gaps.obstacle,
                    place.arc_length,
                    (place.element, place.x),
                    !beside,
                ));
            }
        }
        new
    }

    /// Whether a candidate is in contact at a place where the rod follows the obstacle.
    fn follows(at: &Candidate) -> bool {
        !at.follows_gap
            && (!at.point || at.status != Status::Open)
            && at.approach().0.abs() <= settings::STEEP
    }

    /// Whether a candidate represents a local minimum of the gap between two neighbouring stations:
    /// the candidate moves to it, or the rod follows the obstacle there.
    fn represents(&self, at: &Candidate, least: &Sample, [from, to]: [&Sample; 2]) -> bool {
        let close = settings::NEAR * self.element;
        let by = least.arc_length - at.arc_length;
        if at.follows_gap {
            let inside = at.arc_length >= from.arc_length && at.arc_length <= to.arc_length;
            let towards = by.abs() <= close || inside && at.approach().0 * by < 0.0;
            // An open contact does not stay beside a place that penetrates the obstacle.
            let open = at.status == Status::Open && least.gap < 0.0;
            return towards
                && !(open && at.gap.value > least.gap + settings::ROUNDING * self.length);
        }
        let beside =
            at.arc_length >= from.arc_length - close && at.arc_length <= to.arc_length + close;
        // A parabola that begins with the slope m is deepest at the distance d by m d/2. A
        // penetration by a larger part of the radius has its own candidate, since the rod could
        // pass to the other side.
        let depth =
            (0.5 * settings::STEEP * by.abs().max(close)).min(settings::APPROACH * least.radius);
        let shallow = -least.gap <= depth;
        beside && shallow && !at.point && Self::follows(at) && at.status != Status::Open
    }
}
