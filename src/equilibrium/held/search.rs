//! The Newton iteration for a rod with supports.

use super::conditions::{Conditions, Role};
use super::contact_step::ContactStep;
use super::data::HeldSearch;
use super::dense::NEUTRAL;
use super::response::{ACCEPTED, RESTORED};
use super::sites::Site;
use super::touch::is_deep;
use super::yielding::forces;
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::equilibrium::system::Configuration;
use crate::load::Load;
use crate::rod::Rod;

/// Largest rotation of a frame in a Newton step that is shortened to `LARGEST_TURN`, rad. For a longer one the
/// tangent is almost singular, and is shifted.
const LONGEST_STEP: f64 = 10.0;
/// Largest shift of the tangent, relative to the force in the rod or that of buckling. Forces far from equilibrium may leave the bordered
/// matrix indefinite at any shift.
const LARGEST_SHIFT: f64 = 1e12;
/// Rotation in a step below which the energy is not compared, rad: its change is close to rounding.
const SMALL_TURN: f64 = 1e-4;
/// Rotation in a step below which the steps are expected to converge, rad.
const CLOSE_TURN: f64 = 0.02;
/// Fraction of the predicted decrease that a step must achieve (Armijo), the usual value.
const DECREASE: f64 = 1e-4;
/// Number of saddles that are left.
const SADDLES: usize = 4;
/// Bound on the change of an eigenvalue of the scaled matrix of the reactions by a step, relative to the rotation and
/// to the change of a reaction times its flexibility over the length.
const OUTDATED: f64 = 10.0;
/// Eigenvalue of the scaled matrix of the reactions below which the inertia is evaluated at the equilibrium.
const CLOSE: f64 = 1e-3;
/// Largest rotation in a step that may be due to rounding, rad.
const STAGNANT: f64 = 1e-6;
/// Largest unbalanced couple that is due to rounding, relative to the largest force times the length.
const BALANCED: f64 = 1e-13;

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Newton's iteration for the present targets.
    pub(super) fn find(&mut self, rod: &mut Rod, bound: usize) -> Result<(), EquilibriumError> {
        let (mut last_shift, mut saddles, mut last, mut bowed) = (0.0, 0, f64::INFINITY, false);
        if self.obstacles.yields() {
            self.locate(rod);
            self.obstacles.pull(self.obstacles.sums(forces(&self.sites)));
        }
        for _ in 0..bound.min(self.last.saturating_sub(self.found.iterations)) {
            self.found.iterations += 1;
            self.apply(rod);
            self.locate(rod);
            self.settle_apex(rod);
            self.merge_sites(rod);
            for touch in self.sites.iter_mut().filter_map(|site| site.touch.as_mut()) {
                // Where the gap is not least along the rod, the contact does not slide.
                touch.floats &= touch.approach.1 > 0.0;
            }
            self.apply(rod);
            let mut shift = 0.0;
            let ContactStep { energy, conditions, dense, changes, fraction, .. } = loop {
                let step = self.step_with_contacts(rod, shift)?;
                if shift == 0.0 {
                    self.found.inertia = step.inertia;
                }
                let straight = !bowed && self.is_straight(&step.conditions);
                let far = self.system.largest_turn() > LONGEST_STEP && !straight;
                if !self.stable || step.inertia.negative == 0 && !far {
                    break step;
                }
                let buckling = 1.0 / (self.system.compliance() * self.length);
                if shift > LARGEST_SHIFT * self.force_scale().max(buckling) {
                    return Err(self.not_found(self.system.largest_turn()));
                }
                shift = if shift > 0.0 {
                    4.0 * shift
                } else if last_shift > 0.0 {
                    last_shift / 16.0
                } else {
                    0.1 * self.force_scale()
                };
            };
            if shift > 0.0 {
                last_shift = shift;
            }
            if !bowed && self.is_straight(&conditions) {
                bowed = true;
                let missing = conditions.residuals.iter().map(|x| x.abs()).fold(0.0, f64::max) / self.length;
                self.bow(rod, 2.0 * missing.sqrt());
                continue;
            }
            let apply = |site: &Site| (site.force + site.spring_force(), (site.element, site.x));
            let applied: Vec<_> = self.sites.iter().map(apply).collect();
            let value = self.potential(rod, energy, &applied);
            self.found.energy = value;
            let violation = self.violation();
            let turn = self.system.largest_turn();
            if !turn.is_finite() {
                return Err(EquilibriumError::NotFinite { what: "Newton step" });
            }
            if shift == 0.0 && turn < STAGNANT && self.is_at_rest(violation, &conditions) {
                // A step would only change the forces by rounding, which contacts that stick add up over increments.
                self.found.error = turn;
                return Ok(());
            }
            if shift > 0.0 && turn < 1e-7 && turn > 0.25 * last || shift > 0.0 && turn < 1e-10 {
                // A saddle of the energy: the softest direction leads away from it.
                if saddles == SADDLES {
                    return Err(EquilibriumError::Unstable { negative: self.found.inertia.negative });
                }
                self.leave_saddle(rod, &conditions, &dense, saddles);
                saddles += 1;
                last = f64::INFINITY;
                continue;
            }
            let slope = self.slope(&applied, &conditions, &changes);
            // Reactions far from the equilibrium may be much larger than those in it.
            self.weight = (0.25 * self.weight).max(2.0 * self.largest_reaction(&conditions, &changes));
            let predicted = slope - self.weight * violation;
            let merit = value + self.weight * violation;
            let mut from = Configuration::default();
            from.keep(rod);
            let step = (self.system.turns.clone(), self.system.steps.clone());
            let (forces, forces_step) = (self.obstacles.forces.clone(), self.obstacles.step.clone());
            // Close to the equilibrium a step that is much shorter than the last one needs no line search. The merit
            // does not decrease there if the elements resolve a contact poorly.
            let converges = shift == 0.0 && turn < CLOSE_TURN && (turn < 0.25 * last || predicted > 0.0);
            let mut fraction = fraction;
            loop {
                self.system.start.keep(rod);
                self.advance(rod, fraction);
                if turn >= SMALL_TURN {
                    let mut stepped = Configuration::default();
                    stepped.keep(rod);
                    let stepped_forces = self.obstacles.forces.clone();
                    if !self.restore_conditions(rod, &conditions, &dense) {
                        stepped.restore(rod);
                        self.obstacles.pull(stepped_forces);
                    }
                }
                let energy = self.system.evaluate::<P>(rod, self.material, self.force);
                self.found.evaluations += 1;
                self.locate(rod);
                let value = self.potential(rod, energy, &applied);
                let trial = value + self.weight * self.violation();
                let slack = 1e-12 * (merit.abs() + self.force_scale() * self.length);
                let falls = trial <= merit + DECREASE * fraction * predicted + slack;
                if trial.is_finite() && (falls || turn < SMALL_TURN || converges || !self.stable || self.has_friction())
                {
                    self.found.energy = value;
                    break;
                }
                from.restore(rod);
                (self.system.turns, self.system.steps) = step.clone();
                self.obstacles.pull(forces.clone());
                self.obstacles.step.clone_from(&forces_step);
                if fraction * turn < 1e-9 {
                    return Err(self.not_found(turn));
                }
                fraction *= 0.5;
            }
            self.add_reactions(&conditions, &changes, fraction);
            if self.softened && is_deep(rod, &self.tangents, &self.obstacles) {
                return Err(self.contacts_not_found(0.0));
            }
            if self.regulate_friction(rod, turn) {
                last = f64::INFINITY;
                continue;
            }
            // The inertia is that before the step, whose effect on an eigenvalue must not change its sign.
            let held = |role: &Role| matches!(role, Role::Fixed(site, _) if self.sites[*site].touch.is_none());
            let each = conditions.roles.iter().zip(changes.iter().zip(&self.border.sizes));
            let each = each.filter(|(role, _)| held(role)).map(|(_, (change, size))| (change * size).abs());
            let changed = each.fold(0.0, f64::max) / self.length;
            let least = dense.eigenvalues.iter().map(|value| value.abs()).fold(f64::INFINITY, f64::min);
            let mut outdated = least > NEUTRAL && least < OUTDATED * (changed + turn);
            // The energy is that before the step, which may stretch the rod without a rotation.
            let stretches = (0..changes.len()).map(|i| (changes[i] * self.border.yields[(i, i)]).abs());
            let stretching = stretches.fold(0.0, f64::max) > ACCEPTED * self.length;
            outdated |= stretching;
            if fraction == 1.0 && shift == 0.0 && turn < 1e-4 {
                // The next error is the square of the step.
                let ratio = (turn / last.min(1.0)).max(turn);
                let error = 4.0 * turn * ratio.min(1.0);
                // The places of a rod that stretches depend on the reactions.
                self.apply(rod);
                self.locate(rod);
                let apart = self.violation() > RESTORED * self.length;
                // Close to a loss of stability rounding rotates the frames in every iteration.
                let rounds = turn < STAGNANT
                    && !apart
                    && !stretching
                    && (0.25 * turn..STAGNANT).contains(&last)
                    && self.system.unbalanced <= BALANCED * self.force.largest() * self.length;
                if (error <= self.tolerance || turn < 1e-13) && !outdated && !apart || rounds {
                    self.found.error = if rounds { error.max(turn) } else { error };
                    if least < CLOSE || last.is_infinite() || self.found.inertia.negative > 0 {
                        // A step that is small for the shape may change the sign of an eigenvalue close to zero, and
                        // the reactions of a first iteration are those of the initial guess.
                        let (_, pivots) = self.factorise(rod, 0.0)?;
                        self.found.inertia = self.close(rod, pivots)?.0;
                    }
                    if !self.stable || self.found.inertia.negative == 0 {
                        self.locate(rod);
                        self.apply(rod);
                        return Ok(());
                    }
                }
            }
            last = turn;
        }
        Err(self.not_found(last))
    }

    /// Whether the rod with contacts that stick is balanced up to rounding, with the given violation of the conditions (m).
    fn is_at_rest(&self, violation: f64, conditions: &Conditions) -> bool {
        let moved = conditions.residuals.iter().any(|residual| residual.abs() > RESTORED * self.length);
        let sticks = |site: &Site| site.touch.and_then(|touch| touch.friction).is_some_and(|friction| friction.sticks);
        self.sites.iter().any(sticks)
            && !moved
            && violation <= RESTORED * self.length
            && self.system.unbalanced <= BALANCED * self.force.largest() * self.length
            && (!self.stable || self.found.inertia.negative == 0)
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
