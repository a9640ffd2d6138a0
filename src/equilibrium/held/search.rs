//! The Newton iteration for a rod with supports.

use super::conditions::{Conditions, Role};
use super::contact_step::ContactStep;
use super::data::HeldSearch;
use super::dense::NEUTRAL;
use super::descent::{SLOW, SMALL_TURN};
use super::response::{ACCEPTED, RESTORED};
use super::sites::Site;
use super::yielding::forces;
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::Rod;

/// Largest rotation of a frame in a Newton step that is shortened to `LARGEST_TURN`, rad. For a longer one the
/// tangent is almost singular, and is shifted.
const LONGEST_STEP: f64 = 10.0;
/// Largest shift of the tangent, relative to the force in the rod or to that at which the rod buckles. Forces far from
/// equilibrium may leave the bordered matrix indefinite at any shift.
const LARGEST_SHIFT: f64 = 1e12;
/// First shift of the tangent, relative to the force in the rod.
const FIRST_SHIFT: f64 = 0.1;
/// Number of saddles that are left.
const SADDLES: usize = 4;
/// Rotation in a step below which slow convergence with a shifted tangent is that to a saddle of the energy, rad.
const SLOW_AT_SADDLE: f64 = 1e-7;
/// Rotation in a step below which a shifted tangent is at a saddle of the energy, rad.
const AT_SADDLE: f64 = 1e-10;
/// Bound on the change of an eigenvalue of the scaled matrix of the reactions by a step, relative to the rotation and
/// to the change of a reaction times its flexibility over the length.
const OUTDATED: f64 = 10.0;
/// Eigenvalue of the scaled matrix of the reactions below which the inertia is evaluated at the equilibrium.
const CLOSE: f64 = 1e-3;
/// Largest rotation in a step that may be due to rounding, rad.
const STAGNANT: f64 = 1e-6;
/// Rotation in a step that is always due to rounding, rad.
const ROUNDING: f64 = 1e-13;
/// Largest unbalanced couple that is due to rounding, relative to the largest force times the length.
const BALANCED: f64 = 1e-13;

/// What an iteration needs to know of those before it.
struct Course {
    /// Largest rotation in the last step, rad; infinite if the next step does not continue it.
    last: f64,
    /// Shift of the last tangent that needed one, N.
    shift: f64,
    /// Number of saddles that were left.
    saddles: usize,
    /// Whether a straight rod was bent.
    bowed: bool,
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Newton's iteration for the present targets.
    pub(super) fn find(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let mut course = Course { last: f64::INFINITY, shift: 0.0, saddles: 0, bowed: false };
        if self.obstacles.yields() {
            self.locate(rod);
            self.obstacles.pull(self.obstacles.sums(forces(&self.sites)));
        }
        let mut deep = None;
        for _ in 0..bound.min(self.iteration_limit.saturating_sub(self.found.iterations)) {
            self.found.iterations += 1;
            self.place_contacts(rod);
            let deep = *deep.get_or_insert_with(|| self.is_deep(rod));
            let (step, shift) = self.shifted_step(rod, &mut course)?;
            if !course.bowed && self.is_straight(&step.conditions) {
                course.bowed = true;
                let missing = step.conditions.residuals.iter().map(|x| x.abs()).fold(0.0, f64::max) / self.length;
                self.bow(rod, 2.0 * missing.sqrt());
                continue;
            }
            let merit = self.merit(rod, step.energy);
            self.found.energy = merit.energy;
            let turn = self.system.largest_turn();
            if !turn.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "Newton step" });
            }
            if shift == 0.0 && turn < STAGNANT && self.is_at_rest(merit.violation, &step.conditions) {
                // A step would only change the forces by rounding, which contacts that stick add up over increments.
                self.found.error = turn;
                return Ok(());
            }
            if shift > 0.0 && (turn < SLOW_AT_SADDLE && turn > SLOW * course.last || turn < AT_SADDLE) {
                if course.saddles == SADDLES {
                    return Err(EquilibriumError::Unstable { negative: self.found.inertia.negative });
                }
                self.leave_saddle(rod, &step.conditions, &step.dense, course.saddles);
                course.saddles += 1;
                course.last = f64::INFINITY;
                continue;
            }
            let fraction = self.descend(rod, &step, &merit, (shift > 0.0, course.last))?;
            self.add_reactions(&step.conditions, &step.changes, fraction);
            if !deep && self.is_deep(rod) {
                return Err(self.contacts_not_found(0.0));
            }
            if self.regulate_friction(rod, turn) {
                course.last = f64::INFINITY;
                continue;
            }
            if fraction == 1.0
                && shift == 0.0
                && turn < SMALL_TURN
                && self.has_converged(rod, &step, turn, course.last)?
            {
                self.locate(rod);
                self.apply(rod);
                return Ok(());
            }
            course.last = turn;
        }
        Err(self.not_found(course.last))
    }

    /// Evaluates the supports on the present shape, and merges contacts that have slid to the same place.
    fn place_contacts(&mut self, rod: &Rod) {
        self.apply(rod);
        self.locate(rod);
        self.settle_apex(rod);
        self.merge_sites(rod);
        for touch in self.sites.iter_mut().filter_map(|site| site.touch.as_mut()) {
            // A contact at which the gap is not a minimum along the rod stays at its place.
            touch.floats &= touch.approach.1 > 0.0;
        }
        self.apply(rod);
    }

    /// Solves for a step in which the energy decreases: the tangent is shifted until it has no negative direction that
    /// the supports permit. Returns the step and the shift (N).
    fn shifted_step(&mut self, rod: &mut Rod, course: &mut Course) -> Result<(ContactStep, f64), EquilibriumError> {
        let mut shift = 0.0;
        loop {
            let step = self.step_with_contacts(rod, shift)?;
            if shift == 0.0 {
                self.found.inertia = step.inertia;
            }
            let straight = !course.bowed && self.is_straight(&step.conditions);
            let far = self.system.largest_turn() > LONGEST_STEP && !straight;
            if !self.stable || step.inertia.negative == 0 && !far {
                if shift > 0.0 {
                    course.shift = shift;
                }
                return Ok((step, shift));
            }
            let buckling = 1.0 / (self.system.compliance() * self.length);
            if shift > LARGEST_SHIFT * self.force_scale().max(buckling) {
                return Err(self.not_found(self.system.largest_turn()));
            }
            shift = if shift > 0.0 {
                4.0 * shift
            } else if course.shift > 0.0 {
                course.shift / 16.0
            } else {
                FIRST_SHIFT * self.force_scale()
            };
        }
    }

    /// Whether the rod is in equilibrium after a whole Newton step with the rotation `turn` (rad), which followed one
    /// with the rotation `last` (rad).
    fn has_converged(&mut self, rod: &Rod, step: &ContactStep, turn: f64, last: f64) -> Result<bool, EquilibriumError> {
        // The energy is that before the step, which may stretch the rod without a rotation.
        let stretches = step.changes.iter().enumerate().map(|(i, change)| (change * self.border.yields[(i, i)]).abs());
        let stretching = stretches.fold(0.0, f64::max) > ACCEPTED * self.length;
        let least = step.dense.eigenvalues.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min);
        let outdated = stretching || self.is_inertia_outdated(step, turn, least);
        // The next error is the square of the step.
        let ratio = (turn / last.min(1.0)).max(turn);
        let error = 4.0 * turn * ratio.min(1.0);
        // The places of a rod that stretches depend on the reactions.
        self.apply(rod);
        self.locate(rod);
        let apart = self.violation() > RESTORED * self.length;
        // Close to a loss of stability rounding rotates the frames in every iteration.
        let rounds =
            turn < STAGNANT && !apart && !stretching && (SLOW * turn..STAGNANT).contains(&last) && self.is_balanced();
        if !rounds && (outdated || apart || error > self.tolerance && turn >= ROUNDING) {
            return Ok(false);
        }
        self.found.error = if rounds { error.max(turn) } else { error };
        if least < CLOSE || last.is_infinite() || self.found.inertia.negative > 0 {
            // A step that is small for the shape may change the sign of an eigenvalue close to zero, and the reactions
            // of a first iteration are those of the initial guess.
            let (_, pivots) = self.factorise(rod, 0.0)?;
            self.found.inertia = self.close(rod, pivots)?.0;
        }
        Ok(!self.stable || self.found.inertia.negative == 0)
    }

    /// Whether a step with the rotation `turn` (rad) may have changed the inertia, which is that before the step, given
    /// the least eigenvalue of the scaled matrix of the reactions.
    fn is_inertia_outdated(&self, step: &ContactStep, turn: f64, least: f64) -> bool {
        let held = |role: &Role| matches!(role, Role::Fixed(site, _) if self.sites[*site].touch.is_none());
        let each = step.conditions.roles.iter().zip(step.changes.iter().zip(&self.border.sizes));
        let each = each.filter(|(role, _)| held(role)).map(|(_, (change, size))| (change * size).abs());
        let changed = each.fold(0.0, f64::max) / self.length;
        least > NEUTRAL && least < OUTDATED * (changed + turn)
    }

    /// Whether the rod with contacts that stick is in equilibrium up to rounding, given the violation of the conditions
    /// (m).
    fn is_at_rest(&self, violation: f64, conditions: &Conditions) -> bool {
        let moved = conditions.residuals.iter().any(|residual| residual.abs() > RESTORED * self.length);
        let sticks = |site: &Site| site.touch.and_then(|touch| touch.friction).is_some_and(|friction| friction.sticks);
        self.sites.iter().any(sticks)
            && !moved
            && violation <= RESTORED * self.length
            && self.is_balanced()
            && (!self.stable || self.found.inertia.negative == 0)
    }

    /// Whether the unbalanced couples are due to rounding.
    fn is_balanced(&self) -> bool {
        self.system.unbalanced <= BALANCED * self.force.largest() * self.length
    }

    /// The error of a search that did not converge, with the size of its last step (rad).
    pub(super) fn not_found(&self, step: f64) -> EquilibriumError {
        EquilibriumError::NoConvergence {
            iterations: self.found.iterations,
            step,
            residual: self.system.unbalanced,
            force: self.force.largest(),
        }
    }
}
