//! Evaluation of the candidates on a shape, and the search for new ones.

use nalgebra::Vector3;

use super::candidate::Candidate;
use super::law::Status;
use super::line::{Line, Place};
use super::obstacles::Gaps;
use super::search::HeldSearch;
use super::settings::{SAME, SETTINGS};
use crate::rod::Rod;

impl HeldSearch<'_> {
    /// Evaluates the sites and candidates on the shape of a rod.
    pub(super) fn locate(&mut self, rod: &Rod) {
        let time = self.obstacles.time;
        self.line = Line::new(rod, self.body.tangents(rod));
        let forces = self.candidates.iter().map(|at| (at.obstacle, at.force));
        self.obstacles.yielded = self.obstacles.displacements(forces);
        for site in &mut self.sites {
            site.position = self.line.place(rod, (site.element, site.x)).position;
            if let Some(spring) = &mut site.spring {
                spring.locate(&self.laws, &site.position, time);
            }
        }
        for at in &mut self.candidates {
            let stiffness = self.body.stiffness(&rod.point_within(at.element, at.x));
            at.flexibility = at.force.norm() / stiffness[(0, 0)].min(stiffness[(1, 1)]);
            let place = self.line.place(rod, (at.element, at.x));
            (at.arc_length, at.position) = (place.arc_length, place.position);
            at.gap = self.obstacles.gap_at(at.obstacle, &at.position);
            let frame = rod.frame_within(at.element, at.x);
            at.tangent = frame * Vector3::z();
            at.bend = frame * rod.strain_within(at.element, at.x).cross(&Vector3::z());
            at.slides = at.point && at.approach().1 > SETTINGS.flat / self.length;
            if self.obstacles.contacts[at.obstacle].friction > 0.0 {
                let material = rod.initial_apex_distance(at.element, at.x);
                at.anchor = self.before.anchor(material, (&self.obstacles, at.obstacle));
            }
        }
    }

    /// Adds candidates where the gap is less than `bound` (m), at the last evaluated tangents: at its local minima, and
    /// at all stations beside a contact that penetrate. Returns whether there is a new one.
    pub(super) fn add_candidates(&mut self, rod: &Rod, bound: f64) -> bool {
        if self.obstacles.contacts.is_empty() {
            return false;
        }
        let mut new = Vec::new();
        for obstacle in 0..self.obstacles.contacts.len() {
            let gaps = Gaps { rod, line: &self.line, obstacles: &self.obstacles, obstacle };
            let own: Vec<&Candidate> = self.candidates.iter().filter(|at| at.obstacle == obstacle).collect();
            new.extend(self.penetrating(&gaps, &own, bound));
        }
        let near = SETTINGS.near * self.length / self.parent.elements() as f64;
        let mut changed = false;
        let free = self.body.system().joints.free_base.is_some();
        // A base that is not free does not move.
        for (at, s) in new.into_iter().filter(|(_, s)| free || *s > SETTINGS.spacing * near) {
            let close = |own: &&mut Candidate| {
                own.obstacle == at.obstacle && own.point && at.point && (own.arc_length - s).abs() < near
            };
            changed = true;
            match self.candidates.iter_mut().find(close) {
                // Elements do not resolve two minima that are so close.
                Some(own) if own.slides || own.status == Status::Open => {
                    (own.element, own.x, own.arc_length) = (at.element, at.x, s);
                }
                // Beside a contact point that is flat the rod lies on the obstacle.
                Some(own) => {
                    own.point = false;
                    self.candidates.push(Candidate { arc_length: s, point: false, ..at });
                }
                None => self.candidates.push(Candidate { arc_length: s, ..at }),
            }
        }
        changed
    }

    /// New candidates for one obstacle.
    fn penetrating(&self, gaps: &Gaps, own: &[&Candidate], bound: f64) -> Vec<(Candidate, f64)> {
        let margin = SAME * self.length;
        let close = SETTINGS.near * self.length / self.parent.elements() as f64;
        let same = SETTINGS.spacing * self.length / self.parent.elements() as f64;
        let mut new = Vec::new();
        let within =
            |at: &Candidate, from: f64, to: f64| at.arc_length >= from - margin && at.arc_length <= to + margin;
        let free = self.body.system().joints.free_base.is_some();
        let places = &self.line.places;
        let gap = |place: &Place| self.obstacles.gap_at(gaps.obstacle, &place.position).value;
        let values: Vec<f64> = places.iter().map(gap).collect();
        if let [base, next, ..] = &places[..]
            && free
            && values[0] < bound
        {
            let base = gaps.at(base);
            let near = || own.iter().filter(|at| within(at, 0.0, next.arc_length));
            let level = base.gap + SETTINGS.rounding * self.length;
            let known = |at: &&&Candidate| {
                at.arc_length <= if at.slides { close } else { same } || at.slides && at.gap.value <= level
            };
            let beside = bound < 0.0 && near().any(|at| !at.point || at.status != Status::Open);
            if near().find(known).is_none() && (base.slope >= 0.0 || beside) {
                new.push((Candidate::at(gaps.obstacle, (0, 0.0), !beside), 0.0));
            }
        }
        for (i, ends) in places.windows(2).enumerate() {
            // A gap changes by at most the length of the centre line.
            if !(values[i] + values[i + 1] - (ends[1].path - ends[0].path) < 2.0 * bound) {
                continue;
            }
            let ends = [&ends[0], &ends[1]].map(|place| gaps.at(place));
            let [from, to] = &ends;
            // A contact point that slides belongs to the minimum beside it, and the end of a contact segment is moved
            // to its place later.
            let covered = own.iter().any(|at| {
                let reach = if at.slides { 0.0 } else { close };
                let beside = within(at, from.arc_length - reach, to.arc_length + reach);
                beside && (at.slides || !at.point && at.status != Status::Open)
            });
            let flat = to.slope - from.slope < SETTINGS.flat / self.length * (to.arc_length - from.arc_length);
            if !covered && let Some(least) = gaps.least(from, to, bound) {
                if !flat || bound > 0.0 {
                    new.push((Candidate::at(gaps.obstacle, (least.element, least.x), true), least.arc_length));
                } else {
                    // The rod lies on the obstacle here.
                    for end in ends.iter().filter(|end| free || end.arc_length > margin) {
                        let place =
                            if end.x == 0.0 && end.element > 0 { (end.element - 1, 1.0) } else { (end.element, end.x) };
                        let known = own.iter().any(|at| (at.arc_length - end.arc_length).abs() <= margin)
                            || new.iter().any(|(_, s): &(Candidate, f64)| (s - end.arc_length).abs() <= margin);
                        if !known {
                            new.push((Candidate::at(gaps.obstacle, place, false), end.arc_length));
                        }
                    }
                    continue;
                }
            }
            let next = places.get(i + 2).map_or(to.arc_length, |next| next.arc_length);
            let near = || own.iter().filter(|at| within(at, from.arc_length, next));
            let known = near().any(|at| {
                let level = at.gap.value - SETTINGS.rounding * self.length;
                let distance = (at.arc_length - to.arc_length).abs();
                distance <= if at.slides { close } else { same } || at.slides && to.gap >= level
            });
            if known || !(to.gap < bound) {
                continue;
            }
            let apex = i + 2 == places.len() && to.slope <= 0.0;
            // Beside a contact that penetrates at the next station, the contact is a segment.
            let beside = bound < 0.0 && near().any(|at| !at.slides && (!at.point || at.status != Status::Open));
            if apex || beside {
                new.push((
                    Candidate::at(gaps.obstacle, (places[i + 1].element, places[i + 1].x), !beside),
                    to.arc_length,
                ));
            }
        }
        new
    }
}
