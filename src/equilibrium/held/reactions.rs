//! The reactions at an equilibrium. Those of contacts that are longer than a point are forces at
//! their ends, and pressure between.

use nalgebra::Vector3;

use super::law::Status;
use super::response::upto_parts;
use super::search::HeldSearch;
use super::settings::{self, SAME};
use super::sites::{HeldSite, place_of};
use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::lobatto_weights;
use crate::reference_element::MAX_POINTS;
use crate::rod::Rod;
use crate::support::{Reaction, Slip};

/// Force at a point, relative to the force at a station, that is attributed to rounding.
const NONE: f64 = 1e-6;

impl HeldSearch<'_> {
    /// The reactions at the equilibrium, whose obstacles are surfaces.
    pub(super) fn reactions(&self, rod: &Rod) -> Vec<Reaction> {
        let starts = rod.ends();
        let reaction = |(element, x): (usize, f64)| Reaction {
            arc_length: starts[element]
                + upto_parts(rod, element, x)[..rod.order().points()]
                    .iter()
                    .sum::<f64>(),
            initial_apex_distance: rod.initial_apex_distance(element, x),
            force: Vector3::zeros(),
            couple: Vector3::zeros(),
            length: 0.0,
            obstacle: None,
            surface: 0,
            normal: 0.0,
            slip: None,
        };
        let of_site = |site: &HeldSite| Reaction {
            force: site.reaction(),
            ..reaction(site.place())
        };
        let mut all: Vec<Reaction> = self.sites.iter().map(of_site).collect();
        for at in self
            .candidates
            .iter()
            .filter(|at| at.status != Status::Open)
        {
            let rubs = self.obstacles.contacts[at.obstacle].friction > 0.0;
            // A contact at rest may be at the boundary of the cone, where rounding decides about
            // its state.
            let slip = at.slip(&self.obstacles.yielded[at.obstacle]).norm();
            let rests = at.status == Status::Sticking || slip <= settings::ROUNDING * self.length;
            let slip = rubs.then_some(if rests { Slip::Sticks } else { Slip::Slides });
            let contact = Reaction {
                force: at.force,
                obstacle: Some(at.obstacle),
                normal: at.normal(),
                slip,
                ..reaction((at.element, at.x))
            };
            all.push(contact);
        }
        spread(rod, self.obstacles.contacts.len(), &mut all);
        let joints = &self.body.system().joints;
        // The couple of a held frame balances that of the rod.
        let confined = joints
            .confined
            .iter()
            .zip(&joints.held)
            .map(|((node, _), held)| (*node, -held));
        let elastic = joints
            .elastic
            .iter()
            .map(|joint| (joint.node, joint.couple));
        for (node, couple) in confined.chain(elastic) {
            let couple = rod.frames()[node] * couple;
            match self.sites.iter().position(|site| site.node == node) {
                Some(i) => all[i].couple += couple,
                None if node > 0 => all.push(Reaction {
                    couple,
                    ..reaction(place_of(node))
                }),
                None => all.push(Reaction {
                    couple,
                    initial_apex_distance: rod.initial_length,
                    ..reaction((0, 0.0))
                }),
            }
        }
        all
    }
}

/// Divides the reactions at the stations of longer contacts into the pressure, which is gathered
/// with the weights of the stations, and the forces at a point at the ends of a contact, where the
/// rod lifts off. Sets the lengths of gathered reactions. `obstacles` is the number of obstacles.
fn spread(rod: &Rod, obstacles: usize, all: &mut Vec<Reaction>) {
    let p = rod.order().points();
    if p < 3 {
        return;
    }
    let (nodes, weights) = lobatto_weights(p - 1);
    let line = rod.centre_line();
    let margin = SAME * rod.length();
    let find = |all: &[Reaction], obstacle: usize, s: f64| {
        all.iter()
            .position(|at| at.obstacle == Some(obstacle) && (at.arc_length - s).abs() <= margin)
    };
    // The normal force at the first and the last station of an element by the pressure extrapolated
    // from those inside.
    let mut ends: Vec<(usize, f64, f64)> = Vec::new();
    for obstacle in 0..obstacles {
        for e in 0..rod.elements() {
            let (from, length) = (line[e].0, rod.length_of(e));
            let stations: Option<Vec<usize>> = nodes
                .iter()
                .map(|x| find(all, obstacle, from + x * length))
                .collect();
            let Some([first, inside @ .., last]) = stations.as_deref() else {
                continue;
            };
            for (index, x) in [(*first, 0.0), (*last, 1.0)] {
                let values: [f64; MAX_POINTS] = lagrange(&nodes[1..p - 1], x);
                let each = inside.iter().zip(&values).zip(&weights[1..]);
                let normal = each
                    .map(|((i, value), weight)| all[*i].normal * value / weight)
                    .sum::<f64>();
                ends.push((index, weights[0] * length, normal * weights[0]));
            }
            for (k, i) in inside.iter().enumerate() {
                all[*i].length = weights[k + 1] * length;
            }
        }
    }
    let number = all.len();
    for i in 0..number {
        let parts: Vec<_> = ends.iter().filter(|(index, ..)| *index == i).collect();
        let length: f64 = parts.iter().map(|(_, length, _)| length).sum();
        if parts.len() == 2 {
            // Between two elements in contact there is no force at a point.
            all[i].length = length;
        } else if let [(_, _, normal)] = parts[..] {
            // Each part has the direction of the whole reaction. It therefore pushes, and its
            // friction is within the cone.
            let whole = all[i];
            let at_end = if whole.normal > 0.0 {
                (normal / whole.normal).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let part = |factor: f64| Reaction {
                force: whole.force * factor,
                normal: whole.normal * factor,
                ..whole
            };
            // There is no force at a point at an end where the rod does not lift off.
            if 1.0 - at_end <= NONE {
                all[i].length = length;
            } else if at_end > 0.0 {
                all.push(Reaction {
                    length,
                    ..part(at_end)
                });
                all[i] = part(1.0 - at_end);
            }
        }
    }
}
