//! The reactions at an equilibrium.

use nalgebra::Vector3;

use super::law::Status;
use super::response::upto_parts;
use super::search::HeldSearch;
use super::settings::SETTINGS;
use super::sites::Site;
use super::spread::spread;
use crate::rod::Rod;
use crate::support::{Reaction, Slip};

impl HeldSearch<'_> {
    /// The reactions at the equilibrium, whose obstacles are surfaces.
    pub(super) fn reactions(&self, rod: &Rod) -> Vec<Reaction> {
        let starts: Vec<f64> = rod.centre_line().iter().map(|(s, _)| *s).collect();
        let reaction = |element: usize, x: f64| Reaction {
            arc_length: starts[element] + upto_parts(rod, element, x)[..rod.order().points()].iter().sum::<f64>(),
            initial_apex_distance: rod.initial_apex_distance(element, x),
            force: Vector3::zeros(),
            couple: Vector3::zeros(),
            length: 0.0,
            obstacle: None,
            surface: 0,
            normal: 0.0,
            slip: None,
        };
        let mut all: Vec<Reaction> = Vec::new();
        for site in &self.sites {
            all.push(Reaction { force: site.reaction(), ..reaction(site.element, site.x) });
        }
        for at in self.candidates.iter().filter(|at| at.status != Status::Open) {
            let rubs = self.obstacles.contacts[at.obstacle].friction > 0.0;
            // A contact at rest may be at the boundary of the cone, where rounding decides about its state.
            let slip = at.slip(&self.obstacles.yielded[at.obstacle]).norm();
            let rests = at.status == Status::Sticking || slip <= SETTINGS.rounding * self.length;
            let slip = rubs.then_some(if rests { Slip::Sticks } else { Slip::Slides });
            let contact = Reaction {
                force: at.force,
                obstacle: Some(at.obstacle),
                normal: at.normal(),
                slip,
                ..reaction(at.element, at.x)
            };
            all.push(contact);
        }
        spread(rod, self.obstacles.contacts.len(), &mut all);
        let joints = &self.body.system().joints;
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
            let at_node = |site: &Site| site.node() == node;
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
