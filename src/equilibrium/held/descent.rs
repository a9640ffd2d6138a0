//! The line search of the Newton iteration with supports.

use nalgebra::Vector3;

use super::contact_step::ContactStep;
use super::data::HeldSearch;
use super::sites::Site;
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::equilibrium::system::Configuration;
use crate::load::Load;
use crate::rod::Rod;

/// Rotation in a step below which the energy is not compared, rad: its change is close to rounding.
pub(super) const SMALL_TURN: f64 = 1e-4;
/// Ratio of the rotations in two successive steps above which Newton's method does not converge quadratically.
pub(super) const SLOW: f64 = 0.25;
/// Rotation in a step below which the steps are expected to converge, rad.
const CLOSE_TURN: f64 = 0.02;
/// Rotation in a shortened step below which the line search fails, rad.
const SHORTEST: f64 = 1e-9;
/// Fraction of the predicted decrease that a step must achieve (Armijo), the usual value.
const DECREASE: f64 = 1e-4;
/// Increase of the merit that is attributed to rounding, relative to the merit and to the force times the length.
const SLACK: f64 = 1e-12;

/// The terms of the merit before a step: the energy, plus a weight times the violation of the conditions.
pub(super) struct Merit {
    /// Energy of the rod with its supports, J.
    pub energy: f64,
    /// Sum of the violated distances, m.
    pub violation: f64,
    /// Forces of the supports (N) with their places. Their work is not part of the energy.
    applied: Vec<(Vector3<f64>, (usize, f64))>,
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// The merit at the last evaluation, in which the rod with its loads had the given energy (J).
    pub(super) fn merit(&mut self, rod: &Rod, energy: f64) -> Merit {
        let apply = |site: &Site| (site.force + site.spring_force(), (site.element, site.x));
        let applied: Vec<_> = self.sites.iter().map(apply).collect();
        Merit { energy: self.potential(rod, energy, &applied), violation: self.violation(), applied }
    }

    /// Takes the fraction of a step with which the merit decreases, and returns it. `last` is the rotation in the last
    /// step, rad.
    pub(super) fn descend(
        &mut self,
        rod: &mut Rod,
        step: &ContactStep,
        merit: &Merit,
        (shifted, last): (bool, f64),
    ) -> Result<f64, EquilibriumError> {
        let turn = self.system.largest_turn();
        let slope = self.slope(&merit.applied, &step.conditions, &step.changes);
        // Reactions far from the equilibrium may be much larger than those in it.
        self.weight = (0.25 * self.weight).max(2.0 * self.largest_reaction(&step.conditions, &step.changes));
        let predicted = slope - self.weight * merit.violation;
        let value = merit.energy + self.weight * merit.violation;
        // Close to the equilibrium a step that is much shorter than the last one needs no line search. The merit does
        // not decrease there if the elements resolve a contact poorly.
        let converges = !shifted && turn < CLOSE_TURN && (turn < SLOW * last || predicted > 0.0);
        let unchecked = turn < SMALL_TURN || converges || !self.stable || self.has_friction();
        let mut from = Configuration::default();
        from.keep(rod);
        let whole = (self.system.turns.clone(), self.system.steps.clone());
        let (forces, forces_step) = (self.obstacles.forces.clone(), self.obstacles.step.clone());
        let mut fraction = step.fraction;
        loop {
            self.system.start.keep(rod);
            self.advance(rod, fraction);
            if turn >= SMALL_TURN {
                self.return_to_conditions(rod, step);
            }
            let energy = self.system.evaluate::<P>(rod, self.material, self.force);
            self.found.evaluations += 1;
            self.locate(rod);
            let energy = self.potential(rod, energy, &merit.applied);
            let trial = energy + self.weight * self.violation();
            let slack = SLACK * (value.abs() + self.force_scale() * self.length);
            let falls = trial <= value + DECREASE * fraction * predicted + slack;
            if trial.is_finite() && (falls || unchecked) {
                self.found.energy = energy;
                return Ok(fraction);
            }
            from.restore(rod);
            (self.system.turns, self.system.steps) = whole.clone();
            self.obstacles.pull(forces.clone());
            self.obstacles.step.clone_from(&forces_step);
            if fraction * turn < SHORTEST {
                return Err(self.not_found(turn));
            }
            fraction *= 0.5;
        }
    }

    /// Moves the rod back to the conditions after a step. If this fails, or a contact turns to the other side of its
    /// obstacle, the rod stays where it is.
    fn return_to_conditions(&mut self, rod: &mut Rod, step: &ContactStep) {
        let mut stepped = Configuration::default();
        stepped.keep(rod);
        let forces = self.obstacles.forces.clone();
        let normals = |sites: &[Site]| sites.iter().filter_map(|site| Some(site.touch?.gap.normal)).collect::<Vec<_>>();
        let before = normals(&self.sites);
        let restored = self.restore_conditions(rod, &step.conditions, &step.dense);
        let turned = before.iter().zip(normals(&self.sites)).any(|(before, after)| before.dot(&after) < 0.0);
        if !restored || turned {
            stepped.restore(rod);
            self.obstacles.pull(forces);
        }
    }
}
