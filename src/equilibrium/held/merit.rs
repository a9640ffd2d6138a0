//! Merit and residual, which decide whether a step is accepted.
//!
//! The merit is the energy, plus the violated distances times a weight of at least twice the
//! largest reaction, plus the work of friction. A fraction of a step is accepted if it decreases
//! the merit or the residual sufficiently.

use super::search::HeldSearch;
use super::settings;
use super::trial::{Merit, Start, Trial};
use crate::rod::Rod;

impl HeldSearch<'_> {
    /// The merit at the last evaluation, in which the rod with its loads had the given energy (J).
    pub(super) fn merit(&mut self, rod: &Rod, energy: f64) -> Merit {
        let force = self.force_scale();
        let energy = self.potential(rod, energy);
        let mut residual = self.body.system().unbalanced / (force * self.length);
        let mut friction = 0.0;
        for at in &self.candidates {
            let (gap, push) = (at.gap.value / self.length, at.normal() / force);
            residual = residual.max(gap.min(push).abs());
            let coefficient = self.obstacles.contacts[at.obstacle].friction;
            if coefficient > 0.0 {
                let slip = at.slip(&self.obstacles.yielded[at.obstacle]);
                friction += coefficient * at.normal().max(0.0) * slip.norm();
                let tangential = (at.force - at.gap.normal * at.normal()) / force;
                let trial = tangential - slip / self.length;
                let radius = coefficient * push.max(0.0);
                let within = if trial.norm() <= radius {
                    trial
                } else {
                    trial * (radius / trial.norm())
                };
                residual = residual.max((tangential - within).norm());
            }
        }
        residual = self.hold_violations().fold(residual, |residual, distance| {
            residual.max(distance / self.length)
        });
        Merit {
            energy,
            violation: self.violation(),
            friction,
            residual,
        }
    }

    /// Change of an energy (J) that is attributed to rounding, J.
    pub(super) fn rounding_of(&self, energy: f64) -> f64 {
        1e-12 * (energy.abs() + self.force_scale() * self.length)
    }

    /// Takes the largest fraction of a step with which the merit or the residual decreases, and
    /// returns it; `None` if none of those tried does.
    pub(super) fn descend(
        &mut self,
        rod: &mut Rod,
        (start, trial): (&Start, &Trial),
        unchecked: bool,
        last_turn: f64,
    ) -> Option<f64> {
        let (mut fraction, slope) = (
            1.0,
            self.body.system().slope() - start.base_force.dot(&self.body.system().base_motion),
        );
        let forces = trial.contacts.iter().map(|contact| contact.force.norm());
        let links = self.sites.iter().map(|site| site.force.norm());
        self.weight = (0.25 * self.weight).max(2.0 * forces.chain(links).fold(0.0, f64::max));
        let value =
            |merit: &Merit, weight: f64| merit.energy + weight * merit.violation + merit.friction;
        let before = value(&start.merit, self.weight);
        let slack = self.rounding_of(before);
        // A step that is not much shorter than the last one may have started beside the floor of a
        // valley.
        let stagnates = trial.turn >= 0.5 * last_turn;
        let in_valley = self.may_follow_valley() && !unchecked;
        for halving in 0..=settings::HALVINGS {
            if halving > 0 {
                fraction *= 0.5;
                self.move_by(rod, start, trial, fraction);
            }
            let predicted = (slope - self.weight * start.merit.violation).min(0.0);
            let bound = before + settings::DECREASE * fraction * predicted + slack;
            let mut reached = self.reached(rod);
            let mut falls = value(&reached, self.weight) <= bound;
            if in_valley && (!falls || fraction < 1.0 || stagnates) {
                self.reach_floor(rod, &trial.linear, fraction * trial.turn);
                let floor = self.reached(rod);
                if value(&floor, self.weight) <= bound.min(value(&reached, self.weight)) {
                    (reached, falls) = (floor, true);
                } else {
                    self.move_by(rod, start, trial, fraction);
                    self.balance(rod);
                }
            }
            let after = value(&reached, self.weight);
            let converges = reached.residual
                < start.merit.residual * (1.0 - settings::RESIDUAL_DECREASE * fraction);
            if after.is_finite() && (falls || converges || unchecked) {
                self.found.energy = reached.energy;
                return Some(fraction);
            }
            if fraction * trial.turn < 1e-9 {
                break;
            }
        }
        None
    }

    /// The merit of the present shape.
    fn reached(&mut self, rod: &Rod) -> Merit {
        let energy = self.balance(rod);
        self.merit(rod, energy)
    }
}
