//! The reactions: their changes in a step, and those at an equilibrium.

use nalgebra::{DVector, Vector3};

use super::border::upto_parts;
use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::friction::NO_SLIP;
use super::sites::Site;
use super::spread::spread;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;
use crate::support::{Reaction, Slip};

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Adds a fraction of the changes of the reactions in a step.
    pub(super) fn add_reactions(&mut self, conditions: &Conditions, changes: &DVector<f64>, fraction: f64) {
        for (role, change) in conditions.roles.iter().zip(changes.iter()) {
            match role {
                Role::Elastic(site, axis) => {
                    if let Some(spring) = &mut self.sites[*site].spring {
                        spring.force += axis * (fraction * change);
                    }
                }
                Role::Stick(site, direction) => {
                    if let Some(friction) = self.sites[*site].touch.as_mut().and_then(|touch| touch.friction.as_mut()) {
                        friction.force += direction * (fraction * change);
                    }
                }
                Role::Fixed(site, direction) => {
                    let site = &mut self.sites[*site];
                    match &mut site.touch {
                        Some(touch) => touch.push += fraction * change,
                        None => site.force += direction * (fraction * change),
                    }
                }
                Role::Turn(..) | Role::Slide(..) | Role::Turning(..) | Role::Boost => {}
            }
        }
    }

    /// The reactions at the equilibrium.
    pub(super) fn reactions(&self, rod: &Rod) -> Vec<Reaction> {
        let starts: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let reaction = |element: usize, x: f64| Reaction {
            arc_length: starts[element] + upto_parts(rod, element, x)[..P].iter().sum::<f64>(),
            initial_apex_distance: rod.initial_apex_distance(element, x),
            force: Vector3::zeros(),
            couple: Vector3::zeros(),
            length: 0.0,
            obstacle: None,
            normal: 0.0,
            slip: None,
        };
        let mut all: Vec<Reaction> = Vec::new();
        for site in &self.sites {
            let force = site.force + site.spring_force();
            let touch = site.touch.as_ref();
            let (obstacle, normal) = (touch.map(|touch| touch.obstacle), touch.map_or(0.0, |touch| touch.push));
            let slip = touch.and_then(|touch| touch.friction).map(|friction| {
                match friction.sticks || friction.slip.norm() <= NO_SLIP * self.length {
                    true => Slip::Sticks,
                    false => Slip::Slides,
                }
            });
            all.push(Reaction { force, obstacle, normal, slip, ..reaction(site.element, site.x) });
        }
        spread(rod, self.obstacles.contacts.len(), &mut all);
        let joints = &self.system.joints;
        let mut couples = Vec::new();
        for ((node, _), held) in joints.confined.iter().zip(&joints.held) {
            // The couple of the support balances that of the rod.
            let couple = rod.frames()[*node] * -held;
            couples.push((*node, couple));
        }
        for joint in &joints.elastic {
            couples.push((joint.node, rod.frames()[joint.node] * joint.couple));
        }
        for (node, couple) in couples {
            let at_node = |site: &Site| site.touch.is_none() && site.element + 1 == node;
            match self.sites.iter().position(at_node) {
                Some(i) => all[i].couple += couple,
                None if node == 0 => {
                    let initial_apex_distance = rod.initial_length();
                    all.push(Reaction { couple, arc_length: 0.0, initial_apex_distance, ..reaction(0, 0.0) });
                }
                None => all.push(Reaction { couple, ..reaction(node - 1, 1.0) }),
            }
        }
        all
    }
}
