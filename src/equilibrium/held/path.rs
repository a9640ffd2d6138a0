//! The load path of a search. Holds move in increments from their present places to the requested
//! ones. If a part of the rod could pass an obstacle in a time step, the base and the obstacles
//! also move in increments, from the shape at the start of the step. Increments become shorter,
//! down to a smallest one, until neither the base nor a held frame moves the rod past an obstacle.
//! An increment is halved after a search in which Newton's method and the descents fail, and the one
//! after a success is twice as long, up to the length of the first. It is halved, too, if the rod
//! releases more energy in it than on a branch of equilibria, until the distance of this jump is
//! known. Where a branch of equilibria ends, the rod therefore jumps, or, if the descent to any
//! equilibrium is omitted, approaches the end until the smallest increment fails.

use nalgebra::Vector3;

use super::candidate::Candidate;
use super::continuation::{Origin, Release};
use super::increment::{Before, Motion};
use super::line::{LinePlace, jump_between};
use super::obstacles::{Obstacles, contact_factor, safe_factor};
use super::search::{HeldSearch, Snapshot, project};
use super::settings;
use super::sites::{HeldSite, turn_frames};
use super::trial::Reach;
use crate::equilibrium::{EquilibriumError, Held, IncrementStart};
use crate::rod::Rod;

/// Ratio of the released energy to the predicted one above which a motion is resolved further. It
/// tends to one for a short motion along a branch of equilibria.
const UNEXPLAINED: f64 = 2.0;
/// Shortest increment in which a motion is resolved, relative to the usual one. Before the end of a
/// branch the rod moves as the square root of the rest, so that the distance of the jump is known to
/// about 1 %.
const RESOLVED: f64 = 1e-3;
/// Ratio of the distances of a motion in an increment and in its half above which the distance is
/// that of a jump.
const SAME_DISTANCE: f64 = 0.995;

/// The motion of holds, base and obstacles in a search.
struct LoadPath {
    /// The first and the last target of each site, m.
    targets: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Number of increments.
    number: f64,
    /// Whether the base or a held frame rotates.
    turns: bool,
    /// Whether anything moves.
    moves: bool,
}

/// An increment in which the rod moves farther than along a branch of equilibria.
struct Suspect {
    /// The equilibrium at its end, and the progress there.
    end: Snapshot,
    next: f64,
    /// Distance of the motion, m.
    jump: f64,
}

impl HeldSearch<'_> {
    /// Finds the equilibrium. Returns an error for laws of supports that are invalid where the
    /// search ends.
    pub fn run(mut self, mut shape: Rod, bound: usize) -> Result<Held, EquilibriumError> {
        let rod = &mut shape;
        let moved = self.follow(rod, bound);
        if moved
            .as_ref()
            .err()
            .is_none_or(EquilibriumError::is_recoverable)
        {
            self.check_end(rod)?;
        }
        moved.map_err(|error| self.with_cause(error))?;
        if !self.frames.is_empty() {
            // The last step may change reactions that do not affect the shape.
            self.balance(rod);
        }
        let (mut reactions, mut patches) = (self.reactions(rod), self.patches(rod, 0.0));
        self.obstacles.name(&mut reactions, &mut patches);
        Ok(Held {
            equilibrium: self.found,
            increments: self.increments,
            reactions,
            patches,
            rod: shape,
        })
    }

    /// Finds the equilibrium, and compares it with that at the start of a time step. If it does not
    /// continue that one, holds, base and obstacles move from there in increments.
    fn follow(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let Some((start, origin)) = self.origin(rod) else {
            let balanced = !self.parent.reactions().is_empty();
            return self.move_holds(rod, bound, balanced);
        };
        // An extrapolation may add turns of twist. It is used if its merit is smaller.
        if self.obstacles.contacts.is_empty() {
            let [guess, last] = [self.merit_in_place(rod)?, self.merit_in_place(&start)?];
            if !(guess < last - self.rounding_of(last)) {
                *rod = start;
                self.apply(rod);
                return self.move_holds(rod, bound, true);
            }
            self.apply(rod);
        }
        let guess = self.snapshot(rod);
        let motion = self.motion.clone();
        self.move_holds(rod, bound, false)?;
        if !self.stable {
            return Ok(());
        }
        let released = self.release(rod, &origin)?;
        if !self.is_unexplained(&released) {
            return Ok(());
        }
        let end = self.snapshot(rod);
        let found = self.found;
        let jump = jump_between(&origin.rod, rod);
        self.restore(rod, &guess);
        (*rod, self.motion, self.returns) = (start, motion, true);
        self.guess_forces(&origin.reactions);
        match self.move_holds(rod, bound, true) {
            Err(error) if error.is_recoverable() => {
                self.restore(rod, &end);
                self.found = found;
                self.report(jump);
                Ok(())
            }
            result => result,
        }
    }

    /// The energy (J) and the weighted violations of a shape after a rotation of the held frames to
    /// their places.
    fn merit_in_place(&mut self, shape: &Rod) -> Result<f64, EquilibriumError> {
        let mut shape = shape.clone();
        self.turn_held(&mut shape, 1.0);
        self.apply(&shape);
        self.locate(&shape);
        let (energy, _) = self.body.condense(&shape, 0.0)?;
        let merit = self.merit(&shape, energy);
        let largest = self.sites.iter().map(|site| site.force.norm());
        let weight = 2.0 * largest.fold(0.0, f64::max);
        Ok(merit.energy + weight * merit.violation)
    }

    /// The rod at the start of a time step on its present nodes, and the equilibrium there with the
    /// base and the held frames at the end of the step; `None` for a rod without past.
    fn origin(&mut self, rod: &Rod) -> Option<(Rod, Origin)> {
        let (mut shape, reactions) = match (self.last, self.start) {
            (Some(last), _) if last.len() == rod.rotations.len() => {
                let mut shape = rod.clone();
                shape.rotations.copy_from_slice(last);
                shape.chain_frames();
                (shape, self.parent.reactions())
            }
            (_, Some(start)) => {
                let mut shape = rod.clone();
                shape.sample_shape(&start.rod);
                if let Some(motion) = &self.motion {
                    motion.carry(&mut shape, 0.0, 1.0);
                }
                (shape, &start.reactions[..])
            }
            _ => return None,
        };
        let reactions = reactions.to_vec();
        let start = shape.clone();
        self.turn_held(&mut shape, 1.0);
        let origin = Origin {
            rod: shape,
            reactions,
        };
        Some((start, origin))
    }

    /// Reports a jump over a distance (m), unless the rod stays near its earlier shape.
    fn report(&mut self, jump: f64) {
        if jump <= settings::NEAR_MOTION * self.length {
            return;
        }
        self.found.jump = Some(self.found.jump.map_or(jump, |last| last.max(jump)));
    }

    /// Whether the rod releases more energy than a motion along a branch of equilibria.
    fn is_unexplained(&self, released: &Release) -> bool {
        let rounding = self.rounding_of(self.found.energy);
        released.actual > UNEXPLAINED * released.predicted.max(rounding)
    }

    /// Moves the holds from their present places to the requested ones in increments, each of which
    /// ends in equilibrium after at most `bound` iterations. The progress on the load path
    /// determines the targets of the holds. If the rod could pass an obstacle in the time step, it
    /// also determines the base and the time of the obstacles. An increment that begins in
    /// equilibrium and does not continue it is halved, down to a smallest one, and is a jump then.
    /// The first one begins in equilibrium if the rod is in equilibrium with the reactions that it
    /// has.
    fn move_holds(
        &mut self,
        rod: &mut Rod,
        bound: usize,
        mut balanced: bool,
    ) -> Result<(), EquilibriumError> {
        self.locate(rod);
        self.check_reach(rod)?;
        self.check_obstacles()?;
        self.check_start(rod)?;
        self.lay(rod);
        let moves_base = self.rewind(rod);
        let path = self.load_path(rod);
        let mut done = 0.0;
        let largest = 1.0 / path.number;
        let mut increment = largest;
        let resolved = RESOLVED * largest;
        let mut suspect: Option<Suspect> = None;
        while done < 1.0 {
            let next = if done + increment > 1.0 - 1e-9 {
                1.0
            } else {
                done + increment
            };
            let checked = moves_base || path.turns && !self.obstacles.contacts.is_empty();
            let next = if checked {
                self.safe_end(rod, done, next)
            } else {
                next
            };
            let before = self.snapshot(rod);
            self.carry(rod, next);
            for (site, (start, goal)) in self.sites.iter_mut().zip(&path.targets) {
                site.target = start + (goal - start) * next;
            }
            self.turn_held(rod, (next - done) / (1.0 - done));
            self.increments += 1;
            self.bound = self.found.iterations.saturating_add(bound);
            let smallest = !path.moves
                || increment <= settings::SMALLEST_INCREMENT
                || done + increment <= done;
            let origin = (balanced && self.stable).then(|| Origin {
                rod: rod.clone(),
                reactions: if done == 0.0 {
                    self.parent.reactions().to_vec()
                } else {
                    self.reactions(rod)
                },
            });
            let released = match (self.settle(rod), &origin) {
                (Ok(()), Some(origin)) => self.release(rod, origin),
                (result, _) => result.map(|()| Release::default()),
            };
            match released {
                Ok(released) => {
                    if self.is_unexplained(&released) {
                        let jump = jump_between(&before.rod, rod);
                        let known = suspect
                            .as_ref()
                            .is_some_and(|last| jump >= SAME_DISTANCE * last.jump);
                        // In contact, friction would depend on the halves of an increment.
                        let resolves = path.moves && (self.returns || !self.is_loaded());
                        if resolves && !known && increment > resolved {
                            let end = self.snapshot(rod);
                            suspect = Some(Suspect { end, next, jump });
                            self.restore(rod, &before);
                            increment = 0.5 * increment.min(next - done);
                            continue;
                        }
                        self.report(jump);
                    }
                    suspect = suspect.filter(|suspect| suspect.next > next);
                    (done, balanced) = (next, true);
                    increment = largest.min(2.0 * increment);
                    if moves_base {
                        // Slip counts from the end of this increment. If only holds move, it counts
                        // from the start of the time step.
                        self.before =
                            Before::new(rod, self.obstacles.time, self.obstacles.yielded.clone());
                    }
                }
                Err(error) if error.is_recoverable() => match suspect.take() {
                    // A part of a jump may have no equilibrium that the search finds.
                    Some(Suspect { end, next, jump }) => {
                        self.restore(rod, &end);
                        self.report(jump);
                        (done, balanced) = (next, true);
                        increment = largest;
                    }
                    None if smallest => return Err(error),
                    None => {
                        self.restore(rod, &before);
                        increment = 0.5 * increment.min(next - done);
                    }
                },
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// The load path from the present places to the requested ones.
    fn load_path(&self, rod: &Rod) -> LoadPath {
        let start =
            |site: &HeldSite| site.target + project(&site.fixed, &(site.position - site.target));
        let targets: Vec<_> = self
            .sites
            .iter()
            .map(|site| (start(site), site.target))
            .collect();
        let distances = targets.iter().map(|(start, goal)| (goal - start).norm());
        let far = distances.fold(0.0, f64::max) / self.length;
        let frames = self.frames.iter().map(|frame| frame.missing(rod).norm());
        let turned = frames.fold(0.0, f64::max);
        let (turn, way) = self.motion.as_ref().map(Motion::size).unwrap_or_default();
        let far = far.max(way / self.length);
        let turned = turned.max(turn);
        let number = (far / settings::INCREMENT_MOTION)
            .max(turned / settings::INCREMENT_TURN)
            .ceil()
            .max(1.0);
        LoadPath {
            targets,
            number,
            turns: turned > 0.0,
            moves: number > 1.0 || far > 0.0 || turned > 0.0 || self.obstacles_move(),
        }
    }

    /// Returns to the shape, the base and the time at the start of the increment if a part of the
    /// rod could pass an obstacle from there to the initial guess, or if the search resolves a
    /// jump. Returns whether it does.
    fn rewind(&mut self, rod: &mut Rod) -> bool {
        let Some(IncrementStart {
            reactions, patches, ..
        }) = self.start.filter(|_| self.returns || self.could_pass(rod))
        else {
            // Base and obstacles stay where they are at the end of the increment.
            self.motion = None;
            return false;
        };
        self.set_progress(0.0);
        if !self.guess_contacts(rod, (reactions, patches)) {
            // The present candidates are those of the end of the increment.
            self.candidates.clear();
        }
        rod.sample_shape(&self.before.rod);
        self.turn_hinge(1.0, 0.0);
        self.locate(rod);
        true
    }

    /// Whether the rod touches no obstacle in a shape, and no part of it could pass one on the way
    /// there from the start of the increment.
    pub fn stays_clear(&mut self, shape: &Rod) -> Result<bool, EquilibriumError> {
        self.locate(shape);
        self.check_obstacles()?;
        self.check_start(shape)?;
        Ok(
            !self.add_candidates(shape, -settings::ROUNDING * self.length)
                && !self.could_pass(shape),
        )
    }

    /// Whether a part of the rod could pass an obstacle on the way from the start of the increment
    /// to a shape.
    fn could_pass(&mut self, shape: &Rod) -> bool {
        let Some(time) = self.motion.as_ref().map(|motion| motion.time(1.0)) else {
            return false;
        };
        let mut start = shape.clone();
        start.sample_shape(&self.before.rod);
        self.set_progress(0.0);
        let largest = self.safe_motion_factor(&start, shape, time);
        self.set_progress(1.0);
        largest < 1.0
    }

    /// The progress on the load path, at most `next`, up to which no part of the rod can pass an
    /// obstacle. The present one is `done`.
    fn safe_end(&mut self, rod: &Rod, done: f64, mut next: f64) -> f64 {
        while next - done > settings::SMALLEST_INCREMENT {
            let mut moved = rod.clone();
            self.carry(&mut moved, next);
            self.turn_held(&mut moved, (next - done) / (1.0 - done));
            let time = self.obstacles.time;
            self.turn_hinge(next, done);
            self.set_progress(done);
            let factor = self.safe_motion_factor(rod, &moved, time);
            if factor >= 1.0 {
                break;
            }
            next = done + (next - done) * factor.clamp(0.1, 0.9);
        }
        next
    }

    /// The factor by which a motion of the rod from its present shape to another one, and of the
    /// obstacles to a time (s), may be longer, so that no part of the rod passes an obstacle. The
    /// rods have the same nodes.
    fn safe_motion_factor(&self, from: &Rod, to: &Rod, time: f64) -> f64 {
        let [a, b] = [from, to].map(|rod| self.line_of(rod));
        let moved = |obstacle: usize, from: &Vector3<f64>, to: &Vector3<f64>| {
            (to - from).norm() + self.obstacles.motion(obstacle, from, time)
        };
        let before = |at: &Candidate| {
            let gap = self
                .obstacles
                .gap_at(at.obstacle, &a.place(from, (at.element, at.x)).position);
            let tangent = from.frame_within(at.element, at.x) * Vector3::z();
            Candidate {
                gap,
                tangent,
                ..at.clone()
            }
        };
        let contacts: Vec<Candidate> = self
            .candidates
            .iter()
            .map(before)
            .filter(|at| self.is_contact(at))
            .collect();
        let mut factor = safe_factor(
            &self.obstacles,
            contacts.iter(),
            (from, &a),
            |obstacle, i| moved(obstacle, &a.places[i].position, &b.places[i].position),
        );
        for at in &contacts {
            let after = self.obstacles.gap_then(
                at.obstacle,
                &b.place(to, (at.element, at.x)).position,
                time,
            );
            factor = factor.min(contact_factor(&at.gap.normal, &after.normal));
            // The next search removes a penetration by a part of the radius.
            let deepest = settings::APPROACH * Obstacles::radius(&at.gap);
            if after.value < -deepest {
                factor = factor.min(deepest / -after.value);
            }
        }
        factor
    }

    /// Whether an obstacle moves until the end of the increment.
    fn obstacles_move(&self) -> bool {
        let Some(motion) = &self.motion else {
            return false;
        };
        let moves = |i: usize, place: &LinePlace| {
            self.obstacles.motion(i, &place.position, motion.time(1.0)) > 0.0
        };
        self.line
            .places
            .iter()
            .any(|place| (0..self.obstacles.contacts.len()).any(|i| moves(i, place)))
    }

    /// Sets the progress on the load path, and the time of the obstacles.
    pub(super) fn set_progress(&mut self, progress: f64) {
        if let Some(motion) = &mut self.motion {
            motion.progress = progress;
            self.obstacles.time = motion.time(progress);
        }
    }

    /// Moves rod, base and obstacles rigidly to the progress `next` on the load path.
    fn carry(&mut self, rod: &mut Rod, next: f64) {
        let Some(motion) = self.motion.clone().filter(|motion| motion.progress != next) else {
            return;
        };
        motion.carry(rod, motion.progress, next);
        self.turn_hinge(motion.progress, next);
        self.set_progress(next);
    }

    /// Rotates the axis of a hinge at the base from one value of the progress to another.
    fn turn_hinge(&mut self, from: f64, to: f64) {
        if let (Some(motion), Some(hinge)) = (&self.motion, self.frames.first_mut())
            && motion.hinged
        {
            hinge.frame = motion.turn(from, to) * hinge.frame;
        }
    }

    /// Finds the equilibrium of an increment: by Newton's method, by a descent to an equilibrium
    /// next to the initial guess, or by a descent to any. In a descent the tangent is positive on
    /// the permitted directions.
    fn settle(&mut self, rod: &mut Rod) -> Result<(), EquilibriumError> {
        let guess = self.snapshot(rod);
        let descends = !self.obstacles.contacts.is_empty() || !self.stable;
        match self.find(rod, Reach::Newton) {
            Err(error) if descends && error.is_recoverable() => {}
            result => return result,
        }
        match self.find_stable(rod, &guess, Reach::Near) {
            Err(error) if !self.omits_descent && error.is_recoverable() => {}
            result => return result,
        }
        self.find_stable(rod, &guess, Reach::Far)?;
        self.found.jump = Some(jump_between(&guess.rod, rod));
        Ok(())
    }

    /// Finds a stable equilibrium from a guess, also in a search that accepts unstable ones.
    fn find_stable(
        &mut self,
        rod: &mut Rod,
        guess: &Snapshot,
        reach: Reach,
    ) -> Result<(), EquilibriumError> {
        self.restore(rod, guess);
        let stable = std::mem::replace(&mut self.stable, true);
        let result = self.find(rod, reach);
        self.stable = stable;
        result
    }

    /// Rotates the held frames by a fraction of the rotations that they lack.
    fn turn_held(&self, rod: &mut Rod, fraction: f64) {
        for i in 0..self.frames.len() {
            let turn = self.frames[i].missing(rod) * fraction;
            if turn.norm() > 0.0 {
                let at = self.frames[i].node;
                let from = if i > 0 { self.frames[i - 1].node } else { 0 };
                turn_frames(
                    rod,
                    &turn,
                    from,
                    at,
                    self.frames.get(i + 1).map(|next| next.node),
                );
            }
        }
    }
}
