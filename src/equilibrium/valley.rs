//! Steps along a valley of the energy.
//!
//! A buckled shoot on an upright base has almost the same energy in every vertical plane, and only
//! a weak intrinsic curvature selects one of them. These shapes are the floor of a valley: they
//! have the least energy across it. Newton's step δ = −K⁻¹ g₀ is a tangent of the floor, with the
//! gradient g₀ and the tangent K with its shift. A long step leaves the floor. After a fraction f
//! of the step, corrections c lead back to it. They are perpendicular to δ in the rotations of the
//! frames:
//!
//! ```text
//! K c = μ δ − (g − (1 − f) g₀),   δ · c = 0,
//! ```
//!
//! with the gradient g at the present shape. The multiplier μ follows from K⁻¹ δ. For a quadratic
//! energy c is zero.

use nalgebra::Vector3;

use super::search::{NewtonSearch, largest_rotation};
use crate::constitutive::Constitutive;
use crate::rod::Rod;

/// Largest number of corrections. After steps of 0.01 rad each correction is about 1e-2 of the one
/// before, so that the last one is rounding.
pub(super) const CORRECTIONS: usize = 6;

/// The sum of the scalar products of rotations.
pub(super) fn product(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl<C: Constitutive> NewtonSearch<'_, C> {
    /// Corrects the rod after an accepted fraction of a step. If the corrections fail, the rod is
    /// at this fraction of the step again. Returns whether they succeeded.
    pub(super) fn correct(
        &mut self,
        rod: &mut Rod,
        fraction: f64,
        bound: f64,
        longest: f64,
    ) -> bool {
        let floor = self.reach_floor(rod, fraction, bound, longest);
        self.found.energy = floor.unwrap_or_else(|| {
            self.system.advance(rod, fraction);
            self.evaluate(rod)
        });
        floor.is_some()
    }

    /// Corrects the rod, which is at a fraction of the current step, towards the floor of the
    /// valley, until a correction is not shorter than half of the one before. Returns the energy
    /// (J) if it is at most `bound` and no rotation in an element exceeds `longest` (rad).
    /// Otherwise the rod has to be reset. The current step does not change.
    pub(super) fn reach_floor(
        &mut self,
        rod: &mut Rod,
        fraction: f64,
        bound: f64,
        longest: f64,
    ) -> Option<f64> {
        let step = (self.system.turns.clone(), self.system.steps.clone());
        let gradient: Vec<_> = self
            .system
            .elements
            .iter()
            .map(|element| element.condensed)
            .collect();
        let start = std::mem::take(&mut self.system.start);
        // The multiplier needs K⁻¹ δ for the rotations δ of the step, which are the right-hand side
        // here.
        self.system.couples.clone_from(&step.0);
        self.system.solve();
        let by_step = self.system.turns.clone();
        let (remains, mut last, mut floor) = (1.0 - fraction, fraction * self.turn, None);
        for _ in 0..CORRECTIONS {
            self.system.balance();
            self.system.solve();
            let turns = &mut self.system.turns;
            turns
                .iter_mut()
                .zip(&step.0)
                .for_each(|(turn, whole)| *turn -= whole * remains);
            let multiplier = product(&step.0, turns) / product(&step.0, &by_step);
            turns
                .iter_mut()
                .zip(&by_step)
                .for_each(|(turn, by_step)| *turn -= by_step * multiplier);
            for (element, before) in self.system.elements.iter_mut().zip(&gradient) {
                element.subtract(before, remains);
            }
            self.system.recover();
            let turn = self.system.largest_turn();
            if !(turn < 0.5 * last) {
                break;
            }
            last = turn;
            self.system.start.keep(rod);
            self.system.advance(rod, 1.0);
            let energy = self.evaluate(rod);
            floor = (energy.is_finite() && energy <= bound && largest_rotation(rod).0 <= longest)
                .then_some(energy);
        }
        for (element, before) in self.system.elements.iter_mut().zip(gradient) {
            element.condensed = before;
        }
        self.system.start = start;
        (self.system.turns, self.system.steps) = step;
        floor
    }
}
