//! Newton's method for a minimum of the energy, globalised by a diagonal shift, a bound on the step
//! and a line search. Saddles are left in [`super::saddle`], and steps are corrected in
//! [`super::valley`].

use nalgebra::Vector3;

use super::error::Outcome;
use super::system::System;
use super::unloaded::take_intrinsic_shape;
use super::{Equilibrium, EquilibriumError, Inertia, RodEnergy};
use crate::constitutive::Constitutive;
use crate::rod::{LARGEST_ROTATION, Rod};

/// Largest rotation of a frame in a step, rad. The quadratic model does not hold beyond it.
const LARGEST_TURN: f64 = 1.0;
/// Largest rotation in a step without line search, rad. The change of the energy in it is close to
/// rounding.
const SMALL_TURN: f64 = 1e-4;
/// Negligible rotation in a step, rad. After a Newton step of this size only rounding remains,
/// since Newton's method squares the error. A line search fails and a saddle is reached at steps of
/// this size.
pub(super) const NEGLIGIBLE_TURN: f64 = 1e-7;
/// Number of successive small steps that end the search as rounding, if each is at least half as
/// long as the step before the first of them. At a bifurcation the ratio of successive steps is 2/3,
/// so that two iterations halve a step.
const ROUNDING_STEPS: usize = 4;
/// Largest rotation, rad, in a step that is followed by chord steps, with the same factorisation.
/// Their sizes estimate the error.
const CHORD_TURN: f64 = 0.05;
/// Largest number of successive chord steps: a gradient and its solution cost a quarter of a new
/// tangent.
const CHORDS: i32 = 4;
/// Smallest ratio of the smallest pivot, relative to that without load, to its largest change by
/// the load in a step.
const SAFE_LOAD: f64 = 2.0;
/// Smallest ratio of that relative pivot to the step, 1/rad: the change of the couples is not
/// bounded by the load.
const SAFE: f64 = 10.0;
/// Fraction of the predicted decrease that a step must achieve (Armijo), the usual value.
const DECREASE: f64 = 1e-4;
/// Smallest ratio of the rotation that the couples unbalanced in the initial guess cause to the
/// actual one, for an equilibrium that is its continuation. The ratio tends to one for small
/// rotations, and to zero where a branch ends. At a pitchfork bifurcation it is (x + x²)/2 if the
/// guess has the share x of the amplitude, and the guess is unstable for x < 0.58; a step that
/// begins there with x < 0.3 is a snap.
const CONTINUES: f64 = 0.2;
/// Unbalanced couple over force times length at which couples are balanced to rounding.
const BALANCED: f64 = 1e-14;

/// A search for an equilibrium, with the quantities that an iteration passes to the next one.
pub(super) struct NewtonSearch<'a, C> {
    pub(super) system: &'a mut System,
    pub(super) body: &'a RodEnergy<'a, C>,
    /// Whether the equilibrium has to be stable.
    pub(super) stable: bool,
    /// The largest acceptable error of a frame, rad.
    tolerance: f64,
    /// Length of the rod, m.
    length: f64,
    /// Largest force in the rod, N.
    largest_force: f64,
    /// Shift of the current tangent, N; zero for a tangent that is positive definite without it.
    pub(super) shift: f64,
    /// Whether a quarter of the current shift leaves a negative pivot.
    pub(super) shift_is_needed: bool,
    /// Last shift other than zero, N; zero without one.
    last_shift: f64,
    /// Largest rotation in the current step, rad.
    pub(super) turn: f64,
    /// Whether the current step is longer than half of the previous one.
    pub(super) stagnates: bool,
    /// The last steps below [`SMALL_TURN`] without a shift.
    small_steps: SmallSteps,
    /// Number of saddles that were left.
    pub(super) saddles: usize,
    /// Position of the tip at the first tangent that was not positive definite (m), and the largest
    /// number of negative pivots.
    lost: Option<(Vector3<f64>, usize)>,
    /// Largest rotation in a step since then, rad.
    pub(super) longest_turn: f64,
    /// Whether the rod was corrected towards the floor of a valley after the current step. The
    /// sizes of chord steps do not estimate the error then.
    pub(super) corrected: bool,
    /// Whether the rod was corrected in this search. The stiffness along a valley may change much
    /// in a short step, so that the iteration continues to rounding.
    pub(super) in_valley: bool,
    /// Smallest resistance of a tangent with which the search goes on; negative infinity to leave
    /// unstable shapes.
    pub(super) least_resistance: f64,
    /// Counts, and energy and inertia of the last assembly.
    pub(super) found: Equilibrium,
}

/// The last steps of a search. They are rounding if several small ones do not become shorter.
pub(super) struct SmallSteps {
    /// Step with which the following small steps are compared, rad.
    compared: f64,
    /// Number of successive small steps that are not shorter than half of it.
    number: usize,
}

impl Default for SmallSteps {
    fn default() -> Self {
        Self {
            compared: f64::INFINITY,
            number: 0,
        }
    }
}

impl SmallSteps {
    /// Records the largest rotation in a step, rad.
    pub fn record(&mut self, turn: f64, is_small: bool) {
        if !is_small || turn < 0.5 * self.compared {
            (self.compared, self.number) = (turn, 0);
        } else {
            self.number += 1;
        }
    }

    pub fn are_rounding(&self) -> bool {
        self.number >= ROUNDING_STEPS
    }
}

impl<'a, C: Constitutive> NewtonSearch<'a, C> {
    pub fn new(
        system: &'a mut System,
        rod: &Rod,
        body: &'a RodEnergy<'a, C>,
        stable: bool,
        tolerance: f64,
    ) -> Self {
        Self {
            system,
            body,
            stable,
            tolerance,
            length: rod.length(),
            largest_force: body.force.largest(),
            shift: 0.0,
            shift_is_needed: false,
            last_shift: 0.0,
            turn: f64::INFINITY,
            stagnates: false,
            small_steps: SmallSteps::default(),
            saddles: 0,
            lost: None,
            longest_turn: 0.0,
            corrected: false,
            in_valley: false,
            least_resistance: f64::NEG_INFINITY,
            found: Equilibrium::default(),
        }
    }

    /// Moves the rod to an equilibrium in at most `bound` Newton iterations: tangent, step, line
    /// search, chord steps.
    pub fn run(mut self, rod: &mut Rod, bound: usize) -> Outcome<Equilibrium> {
        let (mut first, mut guessed) = (true, self.guess_on_coarse_mesh(rod));
        for iteration in 1..=bound {
            self.found.iterations = iteration;
            let step = self.find_tangent(rod).and_then(|()| self.find_step());
            // The search starts again from the straight shape if the guess is not close to an
            // equilibrium.
            if std::mem::take(&mut guessed) && !(step.is_ok() && self.is_close()) {
                self.system.initial.restore(rod);
                (self.turn, self.last_shift, self.lost) = (f64::INFINITY, 0.0, None);
                continue;
            }
            step?;
            if std::mem::take(&mut first) && self.is_far(rod) && self.moves_to_intrinsic_shape(rod)
            {
                continue;
            }
            if self.is_at_saddle() {
                self.leave_saddle(rod)?;
                continue;
            }
            if self.is_balanced_to_rounding() {
                self.found.error = self.turn;
                return Ok(self.finish(rod));
            }
            let fraction = self.search_line(rod)?;
            if fraction == 1.0 && self.shift == 0.0 && self.turn < CHORD_TURN && !self.corrected {
                let error = self.follow_chords(rod);
                if self.accepts(rod, error)? {
                    return Ok(self.finish(rod));
                }
            }
        }
        Err(self.not_found())
    }

    /// The error of a search without convergence.
    fn not_found(&mut self) -> EquilibriumError {
        self.system.balance();
        let (step, residual, force) = (self.turn, self.system.unbalanced, self.largest_force);
        EquilibriumError::NoConvergence {
            iterations: self.found.iterations,
            step,
            residual,
            force,
            contact: None,
        }
    }

    /// The result of the search, with the displacement of the tip since stability was lost.
    fn finish(&mut self, rod: &mut Rod) -> Equilibrium {
        let lost = self
            .lost
            .filter(|(_, negative)| !self.is_neutral(*negative));
        let lost = if lost.is_some() && self.continues_from_guess(rod) {
            None
        } else {
            lost
        };
        let jump = lost.map(|(tip, _)| (rod.tip() - tip).norm());
        Equilibrium {
            jump,
            resistance: self.system.resistance,
            ..self.found
        }
    }

    /// Whether the equilibrium has a neutral direction for each of the `negative` pivots that
    /// occurred close to it. The energy of a buckled shoot on an upright base does not depend on
    /// rotations about the vertical. Before couples are balanced it changes a little in that
    /// direction, without a loss of stability.
    fn is_neutral(&self, negative: usize) -> bool {
        negative <= self.found.inertia.neutral && self.longest_turn < LARGEST_TURN
    }

    /// Whether the equilibrium is the continuation of the initial guess, although the search passed
    /// an unstable shape: the couples that are unbalanced in the guess cause most of the rotation
    /// from there to the equilibrium, with the stiffness in the equilibrium. Where a branch of
    /// equilibria ends, the couples are small and the rotation is not. In a soft direction both are
    /// small, as for a buckled shoot on a base that is almost upright.
    fn continues_from_guess(&mut self, rod: &mut Rod) -> bool {
        self.system.start.keep(rod);
        self.system.initial.restore(rod);
        self.evaluate(rod);
        self.system.balance();
        self.system.tangent.fix_neutral();
        self.system.solve();
        let predicted = self.system.largest_turn();
        let (guess, end) = (&self.system.initial, &self.system.start);
        let rotation = guess.largest_turn_to(end);
        end.restore(rod);
        predicted > CONTINUES * rotation
    }

    pub(super) fn assemble(&mut self, rod: &Rod) -> Outcome<(f64, Inertia)> {
        self.found.factorisations += 1;
        self.system.assemble(rod, self.body, self.shift)
    }

    /// Evaluates the energy and its gradient without a tangent. Returns the energy, J.
    pub(super) fn evaluate(&mut self, rod: &Rod) -> f64 {
        self.found.evaluations += 1;
        self.system.evaluate(rod, self.body)
    }

    /// Magnitude of the force in the rod, N: without load the strain energy per length.
    fn force_scale(&self) -> f64 {
        self.largest_force
            .max(self.found.energy.abs() / self.length)
            .max(f64::MIN_POSITIVE)
    }

    /// Assembles and factorises the tangent. For a stable equilibrium the shift is increased until
    /// no pivot is negative.
    fn find_tangent(&mut self, rod: &Rod) -> Outcome {
        (self.shift, self.shift_is_needed) = (0.0, false);
        let mut negative = None;
        loop {
            (self.found.energy, self.found.inertia) = self.assemble(rod)?;
            if self.system.resistance < self.least_resistance {
                return Err(EquilibriumError::Unstable {
                    negative: self.found.inertia.negative,
                });
            }
            // The first assembly has no shift.
            negative.get_or_insert(self.found.inertia.negative);
            if !self.stable || self.found.inertia.negative == 0 {
                break;
            }
            self.shift_is_needed = self.shift > 0.0;
            self.shift = if self.shift_is_needed {
                4.0 * self.shift
            } else if self.last_shift > 0.0 {
                self.last_shift / 16.0
            } else {
                // A shift of the magnitude of the force makes the energy of a rod in tension
                // convex.
                0.1 * self.force_scale()
            };
            EquilibriumError::finite(self.shift.is_finite(), "tangent")?;
        }
        if self.shift > 0.0 {
            self.last_shift = self.shift;
            let (_, most) = self.lost.get_or_insert_with(|| (rod.tip(), 0));
            *most = negative.unwrap_or(0).max(*most);
        }
        Ok(())
    }

    /// Solves for the Newton step, and records its size.
    fn find_step(&mut self) -> Outcome {
        self.system.tangent.release_unbalanced();
        self.system.solve();
        let last = std::mem::replace(&mut self.turn, self.system.largest_turn());
        self.stagnates = !(self.turn < 0.5 * last);
        let is_small = self.shift == 0.0 && self.turn < SMALL_TURN;
        self.small_steps.record(self.turn, is_small);
        if self.lost.is_some() {
            self.longest_turn = self.longest_turn.max(self.turn);
        }
        EquilibriumError::finite(self.turn.is_finite(), "Newton step")
    }

    /// Whether an equilibrium is within the reach of the quadratic model.
    fn is_close(&self) -> bool {
        self.shift == 0.0 && self.turn < LARGEST_TURN
    }

    /// Whether the initial guess is a straight rod far from a minimum, where the tangent is not
    /// positive definite or the step too long. A bent initial guess selects a branch and is kept.
    fn is_far(&self, rod: &Rod) -> bool {
        self.stable
            && !self.is_close()
            && rod.rotations.iter().all(|theta| *theta == Vector3::zeros())
    }

    /// Gives the rod its shape without load if the energy of that shape is lower: far from a
    /// minimum it is the better initial guess.
    fn moves_to_intrinsic_shape(&mut self, rod: &mut Rod) -> bool {
        self.system.start.keep(rod);
        if take_intrinsic_shape(rod).is_ok() {
            let trial = self.evaluate(rod);
            if trial < self.found.energy {
                return true;
            }
        }
        self.system.start.restore(rod);
        false
    }

    /// Whether only rounding is left: couples balance to rounding of the largest one, or several
    /// small steps have not become shorter. In an almost neutral direction rounding still causes a
    /// step, whose size is reported as the error.
    fn is_balanced_to_rounding(&self) -> bool {
        let balanced = self.shift == 0.0
            && self.stagnates
            && self.turn < CHORD_TURN
            && self.has_only_rounding();
        balanced || self.small_steps.are_rounding()
    }

    /// Whether the unbalanced couples are rounding of the largest.
    pub(super) fn has_only_rounding(&self) -> bool {
        self.system.unbalanced <= BALANCED * self.force_scale() * self.length
    }

    /// Moves the rod by a fraction of the step with which the energy decreases sufficiently,
    /// possibly after corrections. Returns the fraction.
    fn search_line(&mut self, rod: &mut Rod) -> Outcome<f64> {
        let mut fraction = (LARGEST_TURN / self.turn).min(1.0);
        let slope = self.system.slope();
        let energy = self.found.energy;
        // Rounding of the energy.
        let slack = 64.0 * f64::EPSILON * energy.abs();
        let longest = largest_rotation(rod).0.max(LARGEST_ROTATION);
        self.system.start.keep(rod);
        loop {
            self.system.advance(rod, fraction);
            let trial = self.evaluate(rod);
            let tiny = self.turn < SMALL_TURN;
            let bound = energy + DECREASE * fraction * slope + slack;
            let falls = trial <= bound;
            let (rotation, node) = largest_rotation(rod);
            let folds = self.stable && rotation > longest;
            if trial.is_finite() && !folds && (falls || tiny || !self.stable) {
                self.found.energy = trial;
                // A step that is not much shorter than the last one may have started beside the
                // floor of a valley.
                let beside = self.stable
                    && self.stagnates
                    && (NEGLIGIBLE_TURN..CHORD_TURN).contains(&self.turn);
                self.corrected = beside && self.correct(rod, fraction, trial + slack, longest);
                self.in_valley |= self.corrected;
                return Ok(fraction);
            }
            if trial.is_finite()
                && !folds
                && let Some(energy) = self.reach_floor(rod, fraction, bound, longest)
            {
                (self.found.energy, self.corrected, self.in_valley) = (energy, true, true);
                return Ok(fraction);
            }
            self.system.start.restore(rod);
            if fraction * self.turn < NEGLIGIBLE_TURN {
                let element = node / rod.order().points();
                return Err(match folds {
                    true => EquilibriumError::Folded {
                        element,
                        intrinsic: rod.intrinsic_turn(element),
                    },
                    false => self.not_found(),
                });
            }
            fraction *= 0.5;
        }
    }

    /// Chord steps, with the existing factorisation and the gradient at the new frames, while they
    /// become shorter. Returns the estimate of the remaining error from their sizes, rad.
    fn follow_chords(&mut self, rod: &mut Rod) -> f64 {
        let (mut last, mut more) = (self.turn, CHORDS);
        loop {
            more -= 1;
            self.system.balance();
            self.system.solve();
            let rest = self.system.largest_turn();
            if !(rest < 0.5 * last) {
                return last.max(rest);
            }
            self.system.start.keep(rod);
            self.system.advance(rod, 1.0);
            // The error decreases by the same ratio again, or by the change of the tangent with the
            // rotation.
            let ratio = (rest / last).max(self.turn);
            let error = 4.0 * rest * ratio;
            if error <= self.tolerance
                || !self.is_safe()
                || error * ratio.powi(more) > self.tolerance
            {
                return error;
            }
            self.found.energy = self.evaluate(rod);
            last = rest;
        }
    }

    /// Whether no pivot can have changed its sign in the last step: the smallest pivot exceeds the
    /// largest change of the tangent. Relative to the elastic tangent, rotations φ change the
    /// tangent by |n| ℓ² φ/K at most: by (2/π)² of that in the work of the force along the rod, and
    /// by 2/π in its couples.
    fn is_safe(&self) -> bool {
        // The third derivative of ½ n · C n by rotations is at most 4 |C| |n|², that of n · d3 is
        // at most |n|.
        let force = self.largest_force * (1.0 + 4.0 * self.system.yielding());
        let load = force * self.length * self.system.compliance();
        self.stable && self.system.resistance > (SAFE_LOAD * load).max(SAFE) * self.turn
    }

    /// Whether the frames are an equilibrium of the requested kind within the tolerance, given
    /// their error (rad).
    fn accepts(&mut self, rod: &Rod, error: f64) -> Outcome<bool> {
        // If the inertia may have changed, the iteration continues to rounding, and the tangent is
        // assembled there.
        let safe = self.is_safe();
        if !(error <= self.tolerance && (safe && !self.in_valley || self.turn < NEGLIGIBLE_TURN)) {
            return Ok(false);
        }
        self.found.error = error;
        if !safe {
            self.found.inertia = self.assemble(rod)?.1;
        }
        Ok(self.system.tangent.unbalanced.is_empty()
            && (!self.stable || self.found.inertia.negative == 0))
    }
}

/// The longest rotation vector within an element, rad, and its index.
pub(super) fn largest_rotation(rod: &Rod) -> (f64, usize) {
    let squares = rod.rotations.iter().map(Vector3::norm_squared).zip(0..);
    let (square, index) = squares.fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a });
    (square.sqrt(), index)
}
