//! Coulomb friction in increments: stick, slip, and the change between them.

use nalgebra::Vector3;

use super::search::HeldSearch;
use super::sites::Friction;
use super::touch::Obstacles;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;

/// Excess of the tangential force over the friction cone that is attributed to rounding, relative to the cone.
const CONE: f64 = 1e-12;

/// Largest slip that is attributed to rounding, relative to the length.
const NO_SLIP: f64 = 1e-12;

/// The rod at the end of the increment before.
pub(super) struct Before<'a> {
    rod: &'a Rod,
    /// Positions of the ends of its elements, m.
    nodes: Vec<Vector3<f64>>,
    /// Time since then, s.
    time: f64,
}

/// A contact of an earlier equilibrium.
#[derive(Debug, Clone, Copy)]
pub(super) struct OldTouch {
    pub obstacle: usize,
    pub arc_length: f64,
    pub push: f64,
    pub force: Vector3<f64>,
}

impl<'a> Before<'a> {
    pub fn new(rod: &'a Rod, time: f64) -> Self {
        Self { rod, nodes: rod.centre_line().into_iter().map(|(_, position)| position).collect(), time }
    }

    /// Where material would be if it had moved with an obstacle since then, m. The material is given by its distance
    /// from the apex at t = 0 (m).
    pub fn anchor(&self, initial_apex_distance: f64, obstacles: &Obstacles, obstacle: usize) -> Vector3<f64> {
        let Some((e, x)) = self.rod.locate_initial(initial_apex_distance) else { return Vector3::repeat(f64::NAN) };
        let position = self.nodes[e] + self.rod.chord(e, x);
        let velocity = obstacles.contacts[obstacle].obstacle.velocity(&position, obstacles.time);
        position + velocity * self.time
    }
}

impl Friction {
    /// Friction of a new contact, without force. It slides in the direction of its displacement.
    pub fn new(coefficient: f64) -> Self {
        let zero = Vector3::zeros();
        Self { coefficient, sticks: false, force: zero, earlier: zero, anchor: zero, slip: zero, direction: zero }
    }

    /// Updates the slip and the forces for a displacement (m) since the increment before and the normal force (N).
    pub fn locate(&mut self, normal: &Vector3<f64>, displacement: &Vector3<f64>, push: f64) {
        let tangential = |v: &Vector3<f64>| v - normal * normal.dot(v);
        self.slip = tangential(displacement);
        self.earlier = tangential(&self.earlier);
        if self.sticks {
            self.force = tangential(&self.force);
            return;
        }
        if self.direction == Vector3::zeros() {
            self.direction = self.slip;
        }
        match tangential(&self.direction).try_normalize(f64::MIN_POSITIVE) {
            Some(direction) => self.direction = direction,
            None => self.sticks = true,
        }
        self.force = self.direction * (-self.coefficient * push.max(0.0));
    }
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    pub(super) fn has_friction(&self) -> bool {
        self.sites.iter().any(|site| site.touch.is_some_and(|touch| touch.friction.is_some()))
    }

    /// Lets contacts slip whose force would exceed the friction cone after the given changes of their normal and
    /// tangential forces. Returns whether there is one.
    pub(super) fn slip_beyond_cone(&mut self, changes: &[(usize, f64, Vector3<f64>)]) -> bool {
        let mut changed = false;
        for (site, push, force) in changes {
            let Some(touch) = &mut self.sites[*site].touch else { continue };
            let (push, Some(friction)) = (touch.push + push, &mut touch.friction) else { continue };
            let force = friction.force + force;
            if friction.sticks && force.norm() > friction.coefficient * push.max(0.0) * (1.0 + CONE) {
                friction.sticks = false;
                friction.direction = -force.normalize();
                friction.force = friction.direction * (-friction.coefficient * touch.push.max(0.0));
                self.sites[*site].force = touch.gap.normal * touch.push + friction.force;
                changed = true;
            }
        }
        changed
    }

    /// Lets contacts slip whose force exceeds the friction cone, and stick where the slip turns back. Returns whether
    /// one has changed.
    pub(super) fn regulate_friction(&mut self, rod: &Rod) -> bool {
        if !self.has_friction() {
            return false;
        }
        self.locate(rod);
        let mut changed = false;
        let length = self.length;
        for site in &mut self.sites {
            let Some(touch) = &mut site.touch else { continue };
            let (push, Some(friction)) = (touch.push, &mut touch.friction) else { continue };
            if friction.sticks {
                let (force, cone) = (friction.force.norm(), friction.coefficient * push.max(0.0));
                if force > cone * (1.0 + CONE) {
                    friction.sticks = false;
                    friction.direction = -friction.force / force;
                    friction.force = friction.direction * -cone;
                    changed = true;
                }
            } else if friction.slip.dot(&friction.direction) < -NO_SLIP * length {
                friction.sticks = true;
                changed = true;
            } else if friction.slip.norm() > NO_SLIP * length {
                // Without a slip the direction remains that of the force.
                friction.direction = friction.slip.normalize();
            }
        }
        changed
    }
}
