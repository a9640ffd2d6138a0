//! Contact with obstacles whose surface is an elastic foundation: an estimate of the contacts and their forces.
//!
//! The energy of the foundation is a function of the shape alone. Newton's iteration with a line search decreases it
//! together with that of the rod, and no decision to keep or release a contact is necessary.

use nalgebra::Vector3;

use super::arrange::nearest;
use super::before::OldTouch;
use super::data::HeldSearch;
use super::elastic::{Law, Spring};
use super::foundation::Foundation;
use super::sites::{Friction, Site};
use super::touch::{Place, all_stations};
use crate::constitutive::Constitutive;
use crate::equilibrium::EquilibriumError;
use crate::load::Load;
use crate::rod::{Rod, Tissue};
use crate::support::Patch;

/// Number of equilibria with friction. The friction cone in each follows from the normal forces in the one before.
const LAGS: usize = 3;

/// A station that is pressed on a foundation.
struct Pressed {
    obstacle: usize,
    /// Index of the station.
    index: usize,
    arc_length: f64,
    /// Normal force, N.
    push: f64,
    /// Tangential force, N, and whether the station sticks.
    friction: (Vector3<f64>, bool),
}

impl<'a, C: Constitutive, L: Load, const P: usize> HeldSearch<'a, C, L, P> {
    /// Finds the equilibrium on elastic foundations in the place of the obstacles, and takes its shape, contacts and
    /// normal forces as initial guess. The rod bends over `width` elements beside a force on the foundations.
    pub(super) fn soften(&mut self, rod: &mut Rod, bound: usize, width: f64) -> Result<(), EquilibriumError> {
        let before = self.present_touches(rod);
        self.arrange_with(rod, &[], &[]);
        self.locate(rod);
        let stations = all_stations(rod, &self.tangents);
        let mut laws = self.foundations(rod, &stations, width * self.length / self.parent.elements() as f64);
        for touch in &before {
            let distance = |i: &usize| (stations[*i].arc_length - touch.arc_length).abs();
            let nearest = (0..stations.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some(i) = nearest {
                let law = &mut laws[touch.obstacle * stations.len() + i];
                law.cone += law.contact.friction * touch.push;
            }
        }
        let rubs = self.obstacles.contacts.iter().any(|contact| contact.friction > 0.0);
        let mut pressed = Vec::new();
        for _ in 0..if rubs { LAGS } else { 1 } {
            pressed = self.press_on(rod, &stations, &laws, bound)?;
            laws.iter_mut().for_each(|law| law.cone = 0.0);
            for at in &pressed {
                let law = &mut laws[at.obstacle * stations.len() + at.index];
                law.cone = law.contact.friction * at.push;
            }
        }
        for at in &pressed {
            let place = &stations[at.index];
            self.sites.push(Site::touching(at.obstacle, (place.element, place.x), at.push, false));
        }
        self.locate(rod);
        self.apply(rod);
        let (patches, touches) = self.patches_of(rod, &pressed, &before);
        self.arrange_with(rod, &patches, &touches);
        self.locate(rod);
        Ok(())
    }

    /// The foundations at each station for each obstacle, without friction. A beam on them bends over a length `decay`
    /// (m) beside a force: the stiffness per length is 4 B/decay⁴ (Hetényi, *Beams on Elastic Foundation*, 1946).
    fn foundations(&self, rod: &Rod, stations: &[Place], decay: f64) -> Vec<Foundation<'a>> {
        let starts = std::iter::once(0.0).chain(stations.iter().map(|place| place.arc_length));
        let stiffnesses: Vec<f64> = (stations.iter().zip(starts))
            .map(|(place, start)| {
                let tissue = Tissue::of(&rod.point_within(place.element, place.x), self.obstacles.time);
                let tangent = self.material.respond(&tissue, &Vector3::zeros()).tangent;
                4.0 * tangent[(0, 0)].min(tangent[(1, 1)]) / decay.powi(4) * (place.arc_length - start)
            })
            .collect();
        let mut laws = Vec::new();
        for (i, contact) in self.obstacles.contacts.iter().enumerate() {
            for (place, &stiffness) in stations.iter().zip(&stiffnesses) {
                let material = rod.initial_apex_distance(place.element, place.x);
                let anchor = match contact.friction {
                    0.0 => Vector3::zeros(),
                    _ => self.before.anchor(material, &self.obstacles, i),
                };
                let (anchor, yielded) = ((anchor, self.obstacles.gap(i, &anchor).normal), self.obstacles.yielded[i]);
                laws.push(Foundation { contact: *contact, yielded, stiffness, anchor, cone: 0.0 });
            }
        }
        laws
    }

    /// Finds the equilibrium on foundations. Returns the stations with a penetration.
    fn press_on(
        &mut self,
        rod: &mut Rod,
        stations: &[Place],
        foundations: &[Foundation<'a>],
        bound: usize,
    ) -> Result<Vec<Pressed>, EquilibriumError> {
        let (holds, laws) = (self.sites.len(), self.laws.springs.len());
        for (place, foundation) in stations.iter().cycle().zip(foundations) {
            self.sites.push(Site::at((place.element, place.x), Some(Spring::new(self.laws.springs.len()))));
            self.laws.springs.push(Law::Foundation(*foundation));
        }
        (self.frozen, self.softened) = (true, true);
        let result = self.find(rod, bound);
        (self.frozen, self.softened) = (false, false);
        let sites = self.sites.split_off(holds);
        self.laws.springs.truncate(laws);
        result?;
        let mut pressed = Vec::new();
        for (i, (site, law)) in sites.iter().zip(foundations).enumerate() {
            let (obstacle, index) = (i / stations.len(), i % stations.len());
            let normal = self.obstacles.gap(obstacle, &site.position).normal;
            let force = site.spring_force();
            let push = normal.dot(&force);
            if push > 0.0 {
                let tangential = force - normal * push;
                let friction = (tangential, tangential.norm() < law.cone);
                pressed.push(Pressed { obstacle, index, arc_length: stations[index].arc_length, push, friction });
            }
        }
        Ok(pressed)
    }

    /// The contacts of pressed stations: neighbours are one contact, which is at a point unless the rod has at least
    /// the curvature of the obstacle there. `before` are the contacts of the initial guess.
    fn patches_of(&self, rod: &Rod, pressed: &[Pressed], before: &[OldTouch]) -> (Vec<Patch>, Vec<OldTouch>) {
        let (mut patches, mut touches) = (Vec::new(), Vec::new());
        for run in pressed.chunk_by(|a, b| a.obstacle == b.obstacle && a.index + 1 == b.index) {
            let obstacle = run[0].obstacle;
            let mut touch = |arc_length, push, (force, sticks): (Vector3<f64>, bool)| {
                let coefficient = self.obstacles.contacts[obstacle].friction;
                let earlier = nearest(before.iter(), obstacle, arc_length).and_then(|at| at.friction);
                let direction = -force.try_normalize(f64::MIN_POSITIVE).unwrap_or_default();
                let friction = earlier.unwrap_or_else(|| Friction::new(coefficient));
                let friction = (coefficient > 0.0).then_some(Friction { sticks, direction, ..friction });
                touches.push(OldTouch { obstacle, arc_length, push, friction });
            };
            let sum: f64 = run.iter().map(|at| at.push).sum();
            let centre = run.iter().map(|at| at.arc_length * at.push / sum).sum::<f64>();
            if run.len() < 3 || self.approach(rod, obstacle, centre).1 > 0.0 {
                let force = run.iter().map(|at| at.friction.0).sum();
                touch(centre, sum, (force, run.iter().any(|at| at.friction.1)));
                patches.push(Patch { obstacle, from: centre, to: centre });
            } else {
                run.iter().for_each(|at| touch(at.arc_length, at.push, at.friction));
                patches.push(Patch { obstacle, from: run[0].arc_length, to: run[run.len() - 1].arc_length });
            }
        }
        (patches, touches)
    }
}
