//! The iteration for a rod with supports.
//!
//! Each iteration factorises the tangent of the rod with its present reactions, and solves the
//! frictional contact problem of the linear rod for a share of the unbalanced couples and
//! violations whose step is in range. It takes the first of the fractions 1, ½, ¼, … of this step
//! with which the merit or the residual decreases. A step that is much shorter than the one before
//! is accepted without this comparison. A rejected step is repeated with a larger shift of the
//! tangent.

use super::candidate::Candidate;
use super::increment::Before;
use super::law::Status;
use super::line::{COMPARED, displacement};
use super::obstacles::contact_factor;
use super::placement::Misplaced;
use super::search::HeldSearch;
use super::settings::{self, SAME};
use super::sites::HeldSite;
use super::trial::{Attempt, Course, Reach, Step};
use crate::equilibrium::search::SmallSteps;
use crate::equilibrium::{EquilibriumError, Inertia};
use crate::rod::Rod;

/// Largest rotation in a step that may be due to rounding, rad.
const STAGNANT: f64 = 1e-6;
/// Rotation in a step that is always attributed to rounding, rad.
const ROUNDING: f64 = 1e-13;
/// Rotation in a step below which the shape is regarded as constant, rad, and the violation of a
/// condition, relative to the length, that is permitted in this case.
const RESTING: f64 = 1e-9;
/// Largest unbalanced couple that is due to rounding, relative to the largest force times the
/// length.
const BALANCED: f64 = 1e-13;
/// Smallest scaled eigenvalue, and its smallest ratio to the distance from the shape of the
/// tangent, below which the inertia is evaluated again. Eigenvalues change in proportion to the
/// distance. In growing shoots in contact the largest ratio at which an eigenvalue changed its sign
/// was 7.
const CLOSE: (f64, f64) = (1e-6, 20.0);

impl HeldSearch<'_> {
    /// Finds an equilibrium for the present targets. If the iteration fails after a motion of
    /// nodes, it continues once from the shape before the last motion. The nodes then stay.
    pub(super) fn find(&mut self, rod: &mut Rod, reach: Reach) -> Result<(), EquilibriumError> {
        let line = if reach == Reach::Newton {
            Vec::new()
        } else {
            rod.centre_line_at(COMPARED)
        };
        let mut course = Course {
            reach,
            line,
            last_turn: f64::INFINITY,
            shift: 0.0,
            next_shift: 0.0,
            lowest: f64::INFINITY,
            saddles: 0,
            small_steps: SmallSteps::default(),
            negative: None,
            bowed: false,
            placements: 0,
            answer: None,
            distance: f64::INFINITY,
            ends: Vec::new(),
        };
        self.apply(rod);
        self.locate(rod);
        let result = self.iterate(rod, &mut course);
        match (result, course.answer.take()) {
            (Err(error), Some(answer)) if error.is_recoverable() => {
                self.restore(rod, &answer);
                (course.last_turn, course.shift, course.next_shift) = (f64::INFINITY, 0.0, 0.0);
                course.placements = settings::PLACEMENTS;
                self.iterate(rod, &mut course)?;
                self.found.error = self.found.error.max(course.distance);
                Ok(())
            }
            (result, _) => result,
        }
    }

    /// Newton's iteration. Nodes move to the contacts when a step has almost reached an equilibrium
    /// on the present nodes.
    fn iterate(&mut self, rod: &mut Rod, course: &mut Course) -> Result<(), EquilibriumError> {
        let mut stalls = 0;
        self.completes = false;
        let usual = self.found.iterations + settings::ITERATIONS;
        let end = if course.reach == Reach::Far {
            self.bound
        } else {
            self.bound.min(usual)
        };
        while self.found.iterations < end {
            self.found.iterations += 1;
            self.drop_candidates();
            self.add_candidates(rod, -settings::ROUNDING * self.length);
            self.apply(rod);
            let step = self.step(rod, course);
            self.completes = false;
            let Some(step) = step? else {
                course.last_turn = f64::INFINITY;
                continue;
            };
            let (turn, shift) = (step.trial.turn, step.trial.linear.factors.shift);
            let stalled = step.removed < 0.5 && turn < 0.05;
            course.small_steps.record(turn, turn < RESTING);
            // Violations remain in directions that were omitted.
            self.completes = turn < RESTING
                && (step.trial.linear.solver.incomplete
                    || self.largest_violation() > settings::ROUNDING * self.length);
            let finished =
                step.removed == 1.0 && shift == 0.0 && self.try_to_finish(rod, course, step)?;
            let farthest = if course.reach == Reach::Near {
                settings::NEAR_MOTION
            } else {
                settings::FAR_MOTION
            };
            if course.is_descent() && displacement(rod, &course.line) > farthest * self.length {
                break;
            }
            if finished {
                return Ok(());
            }
            stalls = if stalled { stalls + 1 } else { 0 };
            if !course.is_descent() && stalls >= 3 {
                break;
            }
            course.last_turn = turn;
            if course.reach == Reach::Far
                && self
                    .obstacles
                    .contacts
                    .iter()
                    .any(|contact| contact.friction > 0.0)
            {
                // In a descent to any equilibrium friction dissipates energy in every step: slip
                // counts from the last one. In a descent nearby it counts from the start of the
                // increment.
                self.before = Before::new(rod, self.obstacles.time, self.obstacles.yielded.clone());
                self.locate(rod);
            }
        }
        Err(self.not_found(course.last_turn))
    }

    /// Tries to finish after a whole Newton step: makes further steps with the same factors as long
    /// as each is much shorter than the one before, moves nodes to the contacts, and evaluates the
    /// inertia. Returns whether the rod is in equilibrium of the requested kind.
    fn try_to_finish(
        &mut self,
        rod: &mut Rod,
        course: &mut Course,
        mut step: Box<Step>,
    ) -> Result<bool, EquilibriumError> {
        let (mut last, mut turn, mut chords) = (course.last_turn, step.trial.turn, 0);
        let most = if self.obstacles.contacts.is_empty() {
            0
        } else {
            settings::CHORDS
        };
        let mut settled = !step.changed && turn < settings::SETTLED_TURN;
        // A contact point that has left its node prevents quadratic convergence, and steps with the
        // same factors may increase its distance. Nodes therefore move at once. Otherwise they move
        // after these steps, since a converged shape gives more accurate ends of segments.
        let left =
            |at: &Candidate| at.follows_gap && at.status != Status::Open && at.x.fract() != 0.0;
        let is_close = settled || turn < settings::PLACING_TURN;
        if is_close && self.candidates.iter().any(left) && self.move_nodes(rod, course) {
            return Ok(false);
        }
        let converged = loop {
            // The ratio of a chord to the step before shows the accuracy of the tangent.
            let distance = if chords == 0 { step.drift } else { turn };
            let converged = turn < settings::SMALL_TURN
                && self.has_converged(rod, (course, &step), (last, distance));
            let enough =
                !self.is_loaded() || self.found.error <= settings::CHORD_ERROR * self.tolerance;
            let ends = converged && enough || turn >= settings::CHORD_TURN || chords == most;
            if ends || !self.chord(rod, &mut step) {
                break converged;
            }
            (last, turn, chords) = (turn, step.trial.turn, chords + 1);
            settled |= !step.changed;
        };
        let is_close = converged || settled || turn < settings::PLACING_TURN;
        if is_close && self.move_nodes(rod, course) || !converged {
            return Ok(false);
        }
        self.find_inertia(rod, &step)?;
        let negative = self.found.inertia.negative;
        if self.stable && negative > 0 {
            // A descent continues from this saddle.
            return if course.is_descent() || !self.is_loaded() {
                Ok(false)
            } else {
                Err(EquilibriumError::Unstable { negative })
            };
        }
        self.found.error = self.found.error.max(self.penetration(rod) / self.length);
        Ok(true)
    }

    /// Moves nodes to the contacts. Returns whether any moved.
    fn move_nodes(&mut self, rod: &mut Rod, course: &mut Course) -> bool {
        if self.obstacles.contacts.is_empty() {
            return false;
        }
        let Some(Misplaced {
            patches,
            distance,
            ends,
        }) = self.misplaced(rod, course)
        else {
            return false;
        };
        course.distance = distance / self.length;
        if course.placements >= settings::PLACEMENTS {
            // An answer on these nodes has this error.
            self.found.error = self.found.error.max(course.distance);
            return false;
        }
        let (answer, line) = (self.snapshot(rod), self.line.clone());
        self.arrange(rod, &patches, &answer.candidates);
        // The shape of a coarse rod depends on its nodes, and a motion of the nodes may move it
        // past a thin pole.
        let passes = |at: &Candidate| {
            let place = answer
                .rod
                .locate(at.arc_length)
                .map(|at| line.place(&answer.rod, at).position);
            let normal = place.map(|place| self.obstacles.gap_at(at.obstacle, &place).normal);
            normal.is_some_and(|normal| contact_factor(&normal, &at.gap.normal) < 1.0)
        };
        if self.candidates.iter().any(passes) {
            self.restore(rod, &answer);
            self.apply(rod);
            self.found.error = self.found.error.max(course.distance);
            course.placements = settings::PLACEMENTS;
            return false;
        }
        course.placements += 1;
        (course.ends, course.answer) = (ends, Some(answer));
        true
    }

    /// Removes open contact points that are far from their obstacle or are no places of least gap,
    /// and merges contact points that have slid to the same place.
    fn drop_candidates(&mut self) {
        let (far, near) = (settings::FAR * self.length, settings::NEAR * self.element);
        let mut kept: Vec<Candidate> = Vec::new();
        for at in std::mem::take(&mut self.candidates) {
            let least = at.gap.value < far && (at.follows_gap || self.end(&at).is_some());
            if at.status == Status::Open && at.point && !least {
                continue;
            }
            let same = |other: &&mut Candidate| {
                let points = at.point && other.point && at.obstacle == other.obstacle;
                points && (at.arc_length - other.arc_length).abs() < near
            };
            match kept.iter_mut().find(same) {
                Some(other) => {
                    let (force, touched) = (other.force + at.force, other.touched || at.touched);
                    if at.force.norm() > other.force.norm() {
                        *other = at;
                    }
                    (other.force, other.touched) = (force, touched);
                }
                None => kept.push(at),
            }
        }
        self.candidates = kept;
    }

    /// Attempts a step with increasing shifts until one is accepted. After a whole step the next
    /// shift is the present one times the ratio of the last two rotations, and smaller at least by
    /// the factor of the settings. If only a part of a step is accepted, the shift is divided by
    /// this part, because the length of a step decreases as 1/shift. The method of Levenberg and
    /// Marquardt with a shift in proportion to the residual converges superlinearly (Yamashita and
    /// Fukushima, *Computing* Suppl. 15, 239–249, 2001). `None` if the rod has moved without a
    /// step.
    fn step(
        &mut self,
        rod: &mut Rod,
        course: &mut Course,
    ) -> Result<Option<Box<Step>>, EquilibriumError> {
        let factor = settings::SHIFT_FACTOR;
        let least = settings::LEAST_SHIFT * self.force_scale();
        let mut shift = if self.is_loaded() && course.next_shift > least {
            course.next_shift
        } else {
            0.0
        };
        // Attempts with a shift may not evaluate the inertia. That of the step before does not
        // belong to this one.
        self.found.inertia = Inertia::default();
        let mut needed = false;
        loop {
            match self.attempt(rod, course, (shift, needed))? {
                Attempt::Accepted(step) => {
                    // In a descent without contact each step begins without a shift. A step without
                    // a shift does not change the shift of the search.
                    if shift > 0.0 || self.is_loaded() || !course.is_descent() {
                        let rotations = if course.last_turn.is_finite() {
                            step.trial.turn / course.last_turn
                        } else {
                            1.0
                        };
                        let whole = step.removed == 1.0;
                        let change = if whole {
                            rotations.min(1.0 / factor)
                        } else {
                            1.0 / step.removed
                        };
                        (course.shift, course.next_shift) = (shift, shift * change);
                    }
                    return Ok(Some(step));
                }
                Attempt::Moved => return Ok(None),
                Attempt::Lost => return Err(self.not_found(course.last_turn)),
                Attempt::Rejected => {}
            }
            let buckling = 1.0 / (self.body.system().compliance() * self.length);
            if !(shift <= settings::LARGEST_SHIFT * self.force_scale().max(buckling)) {
                return Err(self.not_found(course.last_turn));
            }
            needed = true;
            shift = (factor * shift).max(course.shift / factor);
            if shift <= least {
                shift = settings::FIRST_SHIFT * self.force_scale();
            }
        }
    }

    /// The outward direction along the rod if a candidate is at the apex or at a free base, beyond
    /// which a contact does not slide.
    pub(super) fn end(&self, at: &Candidate) -> Option<f64> {
        let at_base =
            self.body.system().joints.free_base.is_some() && at.arc_length <= self.length * SAME;
        if at_base {
            Some(-1.0)
        } else {
            (at.arc_length >= self.length * (1.0 - SAME)).then_some(1.0)
        }
    }

    /// Whether a candidate is in contact.
    pub(super) fn is_loaded(&self) -> bool {
        self.candidates.iter().any(|at| at.status != Status::Open)
    }

    /// Largest displacement of a hold or spring of a rod that stretches, from its place in `sites`,
    /// m. A step may stretch the rod without a rotation.
    pub(super) fn stretch(&self, rod: &Rod, sites: &[HeldSite]) -> f64 {
        if !self.yields(rod) {
            return 0.0;
        }
        let moved = self
            .sites
            .iter()
            .zip(sites)
            .map(|(a, b)| (a.position - b.position).norm());
        moved.fold(0.0, f64::max)
    }

    /// Whether the rod is in equilibrium after a whole Newton step, which followed one with the
    /// rotation `last` (rad). `distance` is that of the tangent from the shape and the reactions
    /// after the step.
    fn has_converged(
        &mut self,
        rod: &Rod,
        (course, step): (&Course, &Step),
        (last, distance): (f64, f64),
    ) -> bool {
        let turn = step.trial.turn;
        let stretching = step.stretch > 1e-8 * self.length;
        // The next error is the product of the step and the distance of the tangent, which contains
        // the reactions.
        let ratio = (turn / last.min(1.0)).max(distance);
        let error = 4.0 * turn * ratio.min(1.0);
        // A new contact is one that the last step has missed.
        let found = self.add_candidates(rod, -settings::ROUNDING * self.length);
        // A contact point is where the gap is least, or at an end of the rod.
        let skew = self.candidates.iter().any(|at| {
            let inside = self
                .end(at)
                .is_none_or(|outward| at.approach().0 * outward > 0.0);
            let skew = at.follows_gap && inside && at.approach().0.abs() > settings::TANGENTIAL;
            at.status != Status::Open && (skew || self.strays(at))
        });
        // Conditions at places that move together are violated by rounding of their differences.
        let violation = self.largest_violation() / self.length;
        // Steps that stagnate show no convergence. The rod rests if they are also shorter than
        // `RESTING`, and rounding causes them if all couples balance up to rounding, or after
        // several steps.
        let stagnates = turn < STAGNANT && (settings::SLOW * turn..STAGNANT).contains(&last);
        let rests = stagnates && turn < RESTING && turn >= settings::SLOW * last;
        let apart = skew
            || found
            || self.floats()
            || !(violation <= if rests { RESTING } else { settings::ROUNDING });
        // Close to a loss of stability rounding rotates the frames in every iteration.
        let balanced =
            self.body.system().unbalanced <= BALANCED * self.body.force().largest() * self.length;
        let rounding = stagnates && balanced || course.small_steps.are_rounding();
        let rounds = rounding && !apart && !stretching;
        // The error in a direction that the step may have left out is not known.
        if step.trial.linear.solver.incomplete {
            return false;
        }
        if !rounds
            && (stretching || apart || step.changed || error > self.tolerance && turn >= ROUNDING)
        {
            return false;
        }
        self.found.error = (if rounds { error.max(turn) } else { error }).max(violation);
        true
    }

    /// Evaluates the inertia at the equilibrium that a step has reached, with the tangent of the
    /// step unless the distance from it matters.
    fn find_inertia(&mut self, rod: &Rod, step: &Step) -> Result<(), EquilibriumError> {
        self.found.inertia = self.inertia_of(&step.trial.linear, false);
        let Inertia {
            negative, margin, ..
        } = self.found.inertia;
        if negative > 0 || !(margin > CLOSE.0.max(CLOSE.1 * step.drift)) {
            let linear = self.linear_rod(rod)?;
            self.found.inertia = self.inertia_of(&linear, true);
        }
        Ok(())
    }
}
