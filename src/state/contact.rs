//! The part of the state that a support adds besides the reactions of the rod: contacts, and the
//! shape with nodes.

use nalgebra::Vector3;

use super::{CLOSE, StateError};
use crate::error::ParameterError;
use crate::rod::Rod;
use crate::support::{Patch, Reaction};

/// Smallest motion of a contact along the rod that is extrapolated, relative to the largest arc
/// length of a reaction.
const LEAST_MOTION: f64 = 1e-6;

/// Contacts of a shoot with obstacles. Empty without a support.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ContactState {
    /// The rod with additional nodes where contacts begin and end; `None` for a rod without such
    /// nodes.
    pub shape: Option<Rod>,
    pub patches: Vec<Patch>,
    /// Time of the patches and of the reactions, s.
    pub time: f64,
    /// Time of the patches and reactions before, from which the rates follow, s.
    pub earlier: f64,
    /// Rates of the ends of the patches, m/s; empty if the contacts have changed.
    pub end_rates: Vec<[f64; 2]>,
    /// Rates of the places (m/s) and forces (N/s) of the reactions; empty if the contacts have
    /// changed or one of them is a segment.
    pub force_rates: Vec<(f64, Vector3<f64>)>,
}

impl ContactState {
    /// Reactions and patches extrapolated to a time (s), as initial guess. They do not pass the
    /// base. Rates over a much shorter time contain the errors of two equilibria, and are not used.
    pub fn predicted(&self, reactions: &[Reaction], time: f64) -> (Vec<Reaction>, Vec<Patch>) {
        let (mut reactions, mut patches, after) =
            (reactions.to_vec(), self.patches.clone(), time - self.time);
        if self.time - self.earlier < CLOSE * after {
            return (reactions, patches);
        }
        for (patch, rate) in patches.iter_mut().zip(&self.end_rates) {
            let from = (patch.from + rate[0] * after).max(0.0);
            (patch.from, patch.to) = (from, (patch.to + rate[1] * after).max(from));
        }
        for (at, (slide, force)) in reactions.iter_mut().zip(&self.force_rates) {
            at.arc_length = (at.arc_length + slide * after).max(0.0);
            at.force += force * after;
        }
        (reactions, patches)
    }

    /// Drops the rates.
    pub fn forget(&mut self) {
        self.end_rates.clear();
        self.force_rates.clear();
    }

    /// Takes the patches at a time (s), with the reactions before and then.
    pub fn take(&mut self, patches: Vec<Patch>, [before, now]: [&[Reaction]; 2], time: f64) {
        let after = time - self.time;
        let surface = |patch: &Patch| (patch.obstacle, patch.surface, patch.from == patch.to);
        let place = |at: &Reaction| (at.obstacle, at.surface);
        let same = self
            .patches
            .iter()
            .map(surface)
            .eq(patches.iter().map(surface))
            && before.iter().map(place).eq(now.iter().map(place));
        // A search that is repeated at the same time keeps the rates.
        if after > 0.0 || !same {
            self.earlier = self.time;
            self.forget();
            if same {
                // Shorter motions are not extrapolated, so that a rod at rest stays at rest.
                let length = now.iter().map(|at| at.arc_length).fold(0.0, f64::max);
                let rate = |from: f64, to: f64| {
                    if (to - from).abs() > LEAST_MOTION * length {
                        (to - from) / after
                    } else {
                        0.0
                    }
                };
                let each = self.patches.iter().zip(&patches);
                self.end_rates
                    .extend(each.map(|(a, b)| [rate(a.from, b.from), rate(a.to, b.to)]));
                // The distribution of the force in a segment may depend on the initial guess.
                if patches.iter().all(|patch| patch.from == patch.to) {
                    let each = before.iter().zip(now);
                    self.force_rates.extend(each.map(|(a, b)| {
                        (
                            rate(a.arc_length, b.arc_length),
                            (b.force - a.force) / after,
                        )
                    }));
                }
            }
        }
        (self.patches, self.time) = (patches, time);
    }

    /// Takes the elements of the shape whose tissue has left the growth zone out of its zone, as
    /// those of the rod.
    pub fn mature(&mut self) {
        if let Some(shape) = &mut self.shape {
            let elements = shape.points()[shape.zone()].chunks(shape.order().points());
            let left = elements
                .take_while(|element| element[0].exit_time < f64::INFINITY)
                .count();
            let _ = shape.mature(left);
        }
    }

    /// Returns an error if a number is invalid or the shape is not one of `rod`.
    pub fn check(&self, rod: &Rod) -> Result<(), StateError> {
        if let Some(shape) = &self.shape {
            shape.check()?;
            let (name, excess) = (
                "length of the shape in excess of the rod",
                shape.length() - rod.length(),
            );
            ParameterError::unless(
                excess.abs() <= 1e-9 * rod.length(),
                name,
                excess,
                "zero (m)",
            )?;
        }
        let sum = self.patches.iter().map(|patch| patch.from + patch.to).sum();
        ParameterError::finite("sum of the places of contacts", sum, "m")?;
        let forces = self
            .force_rates
            .iter()
            .map(|(slide, force)| slide + force.sum());
        let rates = self
            .end_rates
            .iter()
            .flatten()
            .copied()
            .chain(forces)
            .sum::<f64>();
        Ok(ParameterError::finite(
            "sum of the rates of contacts",
            rates + self.time + self.earlier,
            "",
        )?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_is_not_extrapolated_from_a_much_shorter_time() {
        let force = |normal: f64| {
            vec![Reaction {
                arc_length: 0.04,
                initial_apex_distance: 0.0,
                force: Vector3::x() * normal,
                couple: Vector3::zeros(),
                length: 0.0,
                obstacle: Some(0),
                surface: 0,
                normal,
                slip: None,
            }]
        };
        let patches = || {
            vec![Patch {
                obstacle: 0,
                surface: 0,
                from: 0.04,
                to: 0.04,
            }]
        };
        let predicted = |times: [f64; 2]| {
            let (mut contact, forces) = (ContactState::default(), [1e-6, 1.0001e-6].map(force));
            contact.take(patches(), [&[], &forces[0]], times[0]);
            contact.take(patches(), [&forces[0], &forces[1]], times[1]);
            contact.predicted(&forces[1], times[1] + 1.0).0[0].force.x
        };
        // The two equilibria differ by their errors, and by growth.
        assert_eq!(predicted([10.0 - 1e-11, 10.0]), 1.0001e-6);
        assert!((predicted([9.5, 10.0]) - 1.0003e-6).abs() < 1e-18);
    }
}
