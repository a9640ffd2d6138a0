//! Steps of the rod with its reactions: start, contact problem of the linear rod, motion, and
//! corrections.

use nalgebra::{DVector, Vector3};

use super::candidate::Candidate;
use super::law::Status;
use super::line::moved;
use super::linear::Linear;
use super::obstacles::{Obstacles, contact_factor, opening_factor, safe_factor};
use super::reduced::{LinearContact, Reduced};
use super::search::HeldSearch;
use super::settings;
use super::trial::{Start, Step, Trial};
use crate::equilibrium::system::Configuration;
use crate::rod::Rod;

impl HeldSearch<'_> {
    /// The start of a step: shape, reactions, unbalanced couples and merit. The rod with its loads
    /// had the given energy (J) at the last evaluation.
    pub(super) fn start(&mut self, rod: &Rod, energy: f64) -> Start {
        let mut shape = Configuration::default();
        shape.keep(rod);
        let merit = self.merit(rod, energy);
        self.found.energy = merit.energy;
        let system = self.body.system();
        Start {
            shape,
            sites: self.sites.clone(),
            candidates: self.candidates.clone(),
            line: self.line.clone(),
            couples: system.couples.clone(),
            base_force: system.base_force,
            merit,
            condensed: system
                .elements
                .iter()
                .map(|element| element.condensed)
                .collect(),
        }
    }

    /// Moves the rod back to the start of a step, and gives reactions and unbalanced couples their
    /// values there.
    pub(super) fn return_to(&mut self, rod: &mut Rod, start: &Start) {
        start.shape.restore(rod);
        self.sites.clone_from(&start.sites);
        self.candidates.clone_from(&start.candidates);
        self.apply(rod);
        self.locate(rod);
        self.set_couples(start, 1.0);
    }

    /// Sets the unbalanced couples of the system to a part of those at the start of a step.
    fn set_couples(&mut self, start: &Start, part: f64) {
        let system = self.body.system_mut();
        system.couples.clone_from(&start.couples);
        system.couples.iter_mut().for_each(|couple| *couple *= part);
        system.base_force = start.base_force * part;
        for (element, condensed) in system.elements.iter_mut().zip(&start.condensed) {
            element.condensed = condensed.map(|group| group.map(|value| value * part));
        }
    }

    /// The contacts of the linear rod, and the contact problem without their forces, for the share
    /// and the offset of a trial.
    fn problem<'b>(&'b self, trial: &'b Trial, start: &Start) -> (Vec<LinearContact>, Reduced<'b>) {
        let linear = &trial.linear;
        let moved = linear.free_candidates(&trial.offset);
        let mut present = DVector::zeros(linear.size);
        let yielded = self
            .obstacles
            .displacements(start.candidates.iter().map(|at| (at.obstacle, at.force)));
        let each = start.candidates.iter().enumerate().map(|(i, at)| {
            let first = linear.response.first(self.sites.len() + i) - linear.first;
            let place = at.position - yielded[at.obstacle];
            present.fixed_rows_mut::<3>(first).copy_from(&place);
            let range = at.follows_gap.then(|| {
                present
                    .fixed_rows_mut::<3>(first + 3)
                    .copy_from(&at.tangent);
                // Within this distance the force does not change the curvature by more than half of
                // the relative one.
                let resolved = (0.5 * at.approach().1 / at.flexibility).max(0.02 * self.element);
                let reach = (0.5 * self.element)
                    .min(1.0 / at.gap.curvature.norm())
                    .min(resolved);
                // Two candidates do not slide to the same place.
                let blocks = |other: &&Candidate| {
                    let loaded = other.status != Status::Open || at.status == Status::Open;
                    other.obstacle == at.obstacle && loaded
                };
                let others = start.candidates.iter().filter(blocks);
                let halves = others.map(|other| 0.5 * (other.arc_length - at.arc_length));
                let (back, ahead) = (
                    at.arc_length.min(reach),
                    (self.length - at.arc_length).max(0.0).min(reach),
                );
                let from = halves
                    .clone()
                    .filter(|half| *half < 0.0)
                    .fold(-back, f64::max);
                [
                    from,
                    halves.filter(|half| *half > 0.0).fold(ahead, f64::min),
                ]
            });
            LinearContact {
                obstacle: at.obstacle,
                friction: self.obstacles.contacts[at.obstacle].friction,
                force: at.force,
                travel: 0.0,
                range,
                bend: at.bend,
                curve: at.approach().1,
                turn_by_couple: if at.follows_gap {
                    let by_couple = linear.compliance.fixed_view::<3, 3>(first + 3, first + 3);
                    at.gap.normal.dot(&(by_couple * at.gap.normal)).max(0.0)
                } else {
                    0.0
                },
                clearance: at.gap.value.min(0.0) * (1.0 - linear.share),
                anchor: (
                    at.anchor.0 + at.slip(&yielded[at.obstacle]) * (1.0 - linear.share),
                    at.anchor.1,
                ),
                first,
                rigid: self.rigid_compliance(linear, first),
                k: 0.0,
                status: at.status,
            }
        });
        let contacts: Vec<LinearContact> = each.collect();
        let mut problem = Reduced {
            surfaces: &self.obstacles,
            compliance: &linear.compliance,
            free: &present + moved,
            present: DVector::zeros(linear.size),
            start: present,
            scale: self.force_scale(),
        };
        problem.present = problem.reactions(&contacts);
        (contacts, problem)
    }

    /// The compliance of a candidate, given its first coordinate in the contact problem, by
    /// displacements of the whole rod, m/N. It is zero unless the base is free. The spring at the
    /// base and the increases of pivots bound these displacements.
    fn rigid_compliance(&self, linear: &Linear, first: usize) -> f64 {
        let Some(base) = &self.body.system().joints.free_base else {
            return 0.0;
        };
        let at = linear.first + first;
        let whole = linear.compliance.fixed_view::<3, 3>(first, first).trace();
        let bent = linear
            .response
            .compliance
            .fixed_view::<3, 3>(at, at)
            .trace()
            - 3.0 / base.stiffness;
        // The base itself does not bend away. It yields at least as a part of the length of an
        // element.
        let stiff = 3.0 * self.length / (self.body.system().compliance() * self.element.powi(3));
        let least = 1.0 / stiff.max(self.force_scale() / self.element);
        (whole / 3.0 - (bent / 3.0).max(least)).max(0.0)
    }

    /// Solves the contact problem of a trial for its present share, and then the step of the rod
    /// under the solved forces, which the system contains afterwards. The initial guess is the
    /// present forces, or those of `guess`, whose changes are multiplied by a factor. If the
    /// contact problem is not solved, the contacts are those of the initial guess.
    pub(super) fn solve_trial(
        &mut self,
        trial: &mut Trial,
        start: &Start,
        guess: Option<(&[LinearContact], f64)>,
    ) {
        let (mut contacts, problem) = self.problem(trial, start);
        if let Some((guess, factor)) = guess {
            for (contact, guess) in contacts.iter_mut().zip(guess) {
                contact.force += (guess.force - contact.force) * factor;
                contact.travel = guess.travel * factor;
                if let Some([from, to]) = contact.range {
                    contact.travel = contact.travel.clamp(from, to);
                }
            }
        }
        // An unstable equilibrium is sought from a shape that is close to it.
        let near = guess.is_some() || !self.stable;
        let solution = problem.solve(&contacts, near);
        let solved = solution.is_some();
        self.take_contacts(trial, start, solution.unwrap_or(contacts));
        trial.solved = solved;
    }

    /// Sets the step of a trial, which is that of the system afterwards, to the step with solved
    /// contacts.
    pub(super) fn take_contacts(
        &mut self,
        trial: &mut Trial,
        start: &Start,
        contacts: Vec<LinearContact>,
    ) {
        let linear = &trial.linear;
        let changes = Self::changes(linear, start, &contacts);
        trial.links = linear.links_by(&trial.offset, &changes);
        let all = linear.reactions(&changes, &trial.links);
        self.set_couples(start, linear.share);
        linear.response.load(self.body.system_mut(), &all);
        self.body.system_mut().solve();
        (trial.contacts, trial.solved) = (contacts, true);
        trial.turn = self.body.system().largest_turn();
    }

    /// The changes of the reactions of contacts since the start of a step.
    fn changes(linear: &Linear, start: &Start, contacts: &[LinearContact]) -> DVector<f64> {
        let [mut before, mut after] = [0, 1].map(|_| DVector::zeros(linear.size));
        for (contact, from) in contacts.iter().zip(&start.candidates) {
            contact.load(&mut after);
            LinearContact {
                force: from.force,
                travel: 0.0,
                ..*contact
            }
            .load(&mut before);
        }
        after - before
    }

    /// Moves rod and reactions from the start by a fraction of a step.
    pub(super) fn move_by(&mut self, rod: &mut Rod, start: &Start, trial: &Trial, fraction: f64) {
        start.shape.restore(rod);
        self.body.system_mut().start.keep(rod);
        self.body.system().advance(rod, fraction);
        self.sites.clone_from(&start.sites);
        self.add_links(&trial.linear.roles, &trial.links, fraction);
        for ((at, from), contact) in self
            .candidates
            .iter_mut()
            .zip(&start.candidates)
            .zip(&trial.contacts)
        {
            at.force = from.force + (contact.force - from.force) * fraction;
            at.status = contact.status;
            at.touched |= at.status != Status::Open;
            (at.element, at.x) = (from.element, from.x);
            if contact.travel != 0.0 {
                (at.element, at.x) = moved(rod, (from.element, from.x), contact.travel * fraction);
            }
        }
        self.apply(rod);
        self.locate(rod);
    }

    /// The factor, possibly above one, by which the motion from the start of a step may be longer
    /// so that no part of the rod approaches an obstacle too far, and no contact passes to its
    /// other side. It is infinite without obstacles.
    pub(super) fn safe_step_factor(&self, rod: &Rod, start: &Start) -> f64 {
        let before = &start.line;
        let moved = |_, i: usize| (self.line.places[i].position - before.places[i].position).norm();
        let contacts = start.candidates.iter().filter(|at| self.is_contact(at));
        let mut factor = safe_factor(&self.obstacles, contacts, (rod, before), moved);
        for (from, to) in start.candidates.iter().zip(&self.candidates) {
            // Contacts are compared at their new places along the rod, and open candidates at their
            // old ones.
            let opens = to.status == Status::Open;
            let at = if opens { from } else { to };
            let places =
                [before, &self.line].map(|line| line.place(rod, (at.element, at.x)).position);
            let [old, new] = places.map(|place| self.obstacles.gap_at(at.obstacle, &place));
            let moved = (places[1] - places[0]).norm();
            factor = factor.min(if opens {
                opening_factor(&old, moved)
            } else {
                contact_factor(&old.normal, &new.normal)
            });
        }
        factor
    }

    /// Whether a candidate, at its last evaluation, was loaded, close to its obstacle and not steep
    /// against it, so that it represents the rod beside it. A contact of an initial guess may be
    /// far from its obstacle.
    pub(super) fn is_contact(&self, at: &Candidate) -> bool {
        let slope = at.approach().0;
        let least = slope.abs() <= settings::LARGEST_TURN
            || self.end(at).is_some_and(|outward| slope * outward <= 0.0);
        let reach =
            settings::APPROACH * Obstacles::radius(&at.gap) + settings::PERMITTED * self.length;
        at.status != Status::Open && least && at.gap.value <= reach
    }

    /// Corrects a step of any share, without a line search, for the difference between the linear
    /// rod and the rod. The existing factors serve as long as each correction halves the difference
    /// and the rotation does not double. Without obstacles, corrections that do not converge are
    /// undone, since a fraction of the step would violate the conditions to first order.
    pub(super) fn correct(&mut self, rod: &mut Rod, start: &Start, trial: &mut Trial) {
        let turn = trial.turn;
        let mut last = f64::INFINITY;
        let mut remaining = 0.0;
        for _ in 0..settings::CORRECTIONS {
            let (difference, largest) = self.mismatch(start, trial);
            remaining = largest;
            if largest <= settings::ROUNDING * self.length || !(largest < 0.5 * last) {
                break;
            }
            last = largest;
            let (offset, known) = (trial.offset.clone(), trial.contacts.clone());
            trial.offset += difference;
            self.solve_trial(trial, start, Some((&known, 1.0)));
            let grows = !trial.solved || !(trial.turn <= 2.0 * turn + 1e-9);
            if grows {
                // The contact problem may have other solutions.
                trial.offset = offset;
                self.take_contacts(trial, start, known);
            }
            self.move_by(rod, start, trial, 1.0);
            if grows {
                break;
            }
        }
        trial.offset.fill(0.0);
        if remaining > settings::PERMITTED * self.length && self.may_follow_valley() {
            self.take_contacts(trial, start, Vec::new());
            self.move_by(rod, start, trial, 1.0);
        }
        // The rotation before the corrections is the size of the step.
        trial.turn = turn;
    }

    /// Takes a further step with the factors of the last one, from the present shape, if
    /// coordinates and conditions are unchanged, the step is shorter than half of the last one, and
    /// the rod passes no obstacle. Otherwise the shape does not change. Returns whether the step
    /// was taken.
    pub(super) fn chord(&mut self, rod: &mut Rod, step: &mut Step) -> bool {
        let energy = self.balance(rod);
        let (start, last) = (self.start(rod, energy), step.trial.turn);
        let trial = &mut step.trial;
        let residuals = self.residuals(&trial.linear.roles);
        // The factors are not reused if the coordinates or the conditions have changed: for a new
        // candidate, for one that no longer follows the least gap, and for other axes of a spring.
        let following: Vec<bool> = self.candidates.iter().map(|at| at.follows_gap).collect();
        let same = trial
            .linear
            .response
            .with_tangents()
            .skip(self.sites.len())
            .eq(following);
        if !same || residuals.len() != trial.linear.residuals.len() {
            return false;
        }
        trial.linear.residuals.copy_from_slice(&residuals);
        trial.linear.free = trial.linear.response.free(self.body.system_mut());
        self.solve_trial(trial, &start, None);
        let shorter = trial.solved && trial.turn < 0.5 * last;
        if shorter {
            self.move_by(rod, &start, trial, 1.0);
        }
        if !(shorter && self.safe_step_factor(rod, &start) >= 1.0) {
            self.return_to(rod, &start);
            return false;
        }
        step.drift = step.drift + trial.turn + self.reaction_change(&start);
        (step.stretch, step.changed) = (self.stretch(rod, &start.sites), self.has_changed(&start));
        true
    }

    /// Whether the state of a contact differs from that at the start of a step.
    pub(super) fn has_changed(&self, start: &Start) -> bool {
        start
            .candidates
            .iter()
            .zip(&self.candidates)
            .any(|(a, b)| a.status != b.status)
    }

    /// Largest change of a reaction since the start of a step, relative to the largest reaction.
    pub(super) fn reaction_change(&self, start: &Start) -> f64 {
        let sites = self
            .sites
            .iter()
            .zip(&start.sites)
            .map(|(a, b)| (a.reaction(), b.reaction()));
        let candidates = self
            .candidates
            .iter()
            .zip(&start.candidates)
            .map(|(a, b)| (a.force, b.force));
        let (largest, change) =
            sites
                .chain(candidates)
                .fold((0.0_f64, 0.0_f64), |(largest, change), (a, b)| {
                    (
                        largest.max(a.norm()).max(b.norm()),
                        change.max((a - b).norm()),
                    )
                });
        if change > 0.0 { change / largest } else { 0.0 }
    }

    /// The coordinates of the rod after a whole step minus those of the trial, and the largest
    /// difference of a place at which a reaction acts, m.
    fn mismatch(&self, start: &Start, trial: &Trial) -> (DVector<f64>, f64) {
        let Trial {
            linear,
            offset,
            contacts,
            links,
            ..
        } = trial;
        let (_, problem) = self.problem(trial, start);
        let coordinates = problem.coordinates(contacts);
        let mut difference = DVector::zeros(linear.response.size());
        let mut largest = 0.0_f64;
        for ((contact, at), i) in contacts.iter().zip(&self.candidates).zip(0..) {
            let (place, tangent) = Reduced::place(contact, &coordinates);
            let by = at.position - self.obstacles.yielded[at.obstacle] - place;
            let first = linear.response.first(self.sites.len() + i);
            difference.fixed_rows_mut::<3>(first).copy_from(&by);
            if contact.range.is_some() {
                difference
                    .fixed_rows_mut::<3>(first + 3)
                    .copy_from(&(at.tangent - tangent));
            }
            if contact.status != Status::Open {
                largest = largest.max(by.norm());
            }
        }
        let changes = Self::changes(linear, start, contacts);
        let moved = linear.displacements(&linear.reactions(&changes, links)) + offset;
        for (i, (site, from)) in self.sites.iter().zip(&start.sites).enumerate() {
            let linear_place: Vector3<f64> = moved.fixed_rows::<3>(3 * i).into_owned();
            let by = site.position - from.position - linear_place;
            difference.fixed_rows_mut::<3>(3 * i).copy_from(&by);
            largest = largest.max(by.norm());
        }
        (difference, largest)
    }
}
