//! Coulomb friction in increments: stick, slip, and the change between them.

use nalgebra::Vector3;

use super::data::HeldSearch;
use super::sites::Friction;
use crate::constitutive::Constitutive;
use crate::load::Load;
use crate::rod::Rod;

/// Excess of the tangential force over the friction cone that is attributed to rounding, relative to the cone.
const CONE: f64 = 1e-12;

/// Largest slip that is attributed to rounding, relative to the length.
pub(super) const NO_SLIP: f64 = 1e-12;
/// Largest rotation in a step, rad, after which contacts change between stick and slip. After a larger one the forces
/// are those of a rod that is far from equilibrium.
const SETTLED: f64 = 1e-3;

impl Friction {
    /// Friction of a new contact, which slides in the direction of its displacement unless it has an earlier force.
    pub fn new(coefficient: f64) -> Self {
        let zero = Vector3::zeros();
        Self { coefficient, sticks: false, force: zero, earlier: zero, slid: false, slip: zero, direction: zero }
    }

    /// The tangential force of the contact if it sticks, for a compliance `stickiness` (m/N), N.
    pub fn trial(&self, stickiness: f64) -> Vector3<f64> {
        self.earlier - self.slip / stickiness
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
            // The first guess is that a contact sticks or slides as at the end of the increment before.
            let earlier = self.earlier.norm();
            if earlier > 0.0 && !self.slid {
                (self.sticks, self.force) = (true, self.earlier);
                return;
            }
            self.direction = if earlier > 0.0 { -self.earlier } else { self.slip };
        }
        match tangential(&self.direction).try_normalize(f64::MIN_POSITIVE) {
            Some(direction) => self.direction = direction,
            None => self.sticks = true,
        }
        self.force = self.direction * (-self.coefficient * push);
    }

    /// Lets the contact slide in a direction with a normal force `push` (N).
    fn slide(&mut self, direction: Vector3<f64>, push: f64) {
        self.sticks = false;
        self.direction = direction;
        self.force = direction * (-self.coefficient * push);
    }

    /// Lets a contact that sticks with a normal force `push` (N) slip against its force, if this exceeds the friction
    /// cone and the rod has `settled`. Returns whether it slips now.
    fn slips_beyond_cone(&mut self, push: f64, settled: bool) -> bool {
        let (force, cone) = (self.force.norm(), self.coefficient * push.max(0.0));
        let slips = force > cone * (1.0 + CONE) && settled;
        if slips {
            self.slide(-self.force / force, push);
        }
        slips
    }

    /// Lets a contact that slides with a normal force `push` (N) follow the direction of its trial force, or stick if
    /// this force is inside the friction cone and the rod has `settled`. Returns whether it sticks now.
    fn follows_slip(&mut self, push: f64, stickiness: f64, settled: bool) -> bool {
        let trial = self.trial(stickiness);
        let beyond = -trial.dot(&self.direction) >= self.coefficient * push.max(0.0);
        self.sticks = !beyond && settled;
        if beyond && let Some(direction) = (-trial).try_normalize(f64::MIN_POSITIVE) {
            self.direction = direction;
        }
        self.sticks
    }
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Whether a contact of the rod has friction.
    pub(super) fn has_friction(&self) -> bool {
        self.sites.iter().any(|site| site.touch.is_some_and(|touch| touch.friction.is_some()))
    }

    /// Lets a contact that sticks slip instead of pulling, after the given changes of its normal and tangential forces.
    /// Returns whether it did.
    pub(super) fn slips_instead(&mut self, site: usize, changes: &[(usize, f64, Vector3<f64>)]) -> bool {
        let Some(touch) = &mut self.sites[site].touch else { return false };
        let Some(friction) = touch.friction.as_mut().filter(|friction| friction.sticks) else { return false };
        let change = changes.iter().find(|(at, ..)| *at == site).map_or(Vector3::zeros(), |(.., force)| *force);
        let Some(direction) = (-(friction.force + change)).try_normalize(f64::MIN_POSITIVE) else { return false };
        friction.slide(direction, touch.push);
        self.sites[site].force = touch.gap.normal * touch.push + friction.force;
        true
    }

    /// Lets contacts slip whose force exceeds the friction cone, and lets contacts stick whose trial force is inside
    /// it, after a step with a largest rotation `turn` (rad). Returns whether one has changed.
    pub(super) fn regulate_friction(&mut self, rod: &Rod, turn: f64) -> bool {
        if !self.has_friction() {
            return false;
        }
        self.locate(rod);
        let mut changed = false;
        let (stickiness, settled) = (self.stickiness(), turn < SETTLED);
        for touch in self.sites.iter_mut().filter_map(|site| site.touch.as_mut()) {
            let (push, Some(friction)) = (touch.push, &mut touch.friction) else { continue };
            changed |= if friction.sticks {
                friction.slips_beyond_cone(push, settled)
            } else {
                friction.follows_slip(push, stickiness, settled)
            };
        }
        changed
    }
}
