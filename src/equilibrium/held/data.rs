//! The data of a search for an equilibrium of a rod with supports.

use nalgebra::Vector3;

use super::before::Before;
use super::border::Border;
use super::elastic::Laws;
use super::sites::{HeldFrame, Site};
use super::touch::Obstacles;
use crate::constitutive::Constitutive;
use crate::equilibrium::Equilibrium;
use crate::equilibrium::joints::Joints;
use crate::equilibrium::system::System;
use crate::load::{InternalForce, Load};
use crate::rod::Rod;
use crate::support::{Patch, Reaction};

/// Memory of a search.
#[derive(Debug, Default)]
pub(crate) struct HeldWorkspace {
    pub(super) border: Border,
}

/// A search for an equilibrium of a rod with supports.
pub(in crate::equilibrium) struct HeldSearch<'a, C, L, const P: usize> {
    pub(super) system: &'a mut System,
    pub(super) border: &'a mut Border,
    pub(super) material: &'a C,
    pub(super) load: &'a L,
    pub(super) force: &'a mut InternalForce,
    /// The rod without additional nodes at contacts.
    pub(super) parent: &'a Rod,
    pub(super) obstacles: Obstacles<'a>,
    /// Tangents ∂p/∂s of the centre line at the material points.
    pub(super) tangents: Vec<Vector3<f64>>,
    /// Length over which the rod bends beside a contact, m.
    pub(super) layer: f64,
    /// Whether steps are not blocked by obstacles.
    pub(super) frozen: bool,
    /// Whether elastic foundations are in the place of the obstacles.
    pub(super) softened: bool,
    /// Whether contacts at points stay at their places along the rod.
    pub(super) pinned: bool,
    /// The rod at the end of the increment before, with the time since then (s). Friction depends on the displacement.
    pub(super) before: Before<'a>,
    /// Whether the equilibrium has to be stable.
    pub(super) stable: bool,
    pub(super) tolerance: f64,
    pub(super) length: f64,
    pub(super) sites: Vec<Site>,
    pub(super) frames: Vec<HeldFrame>,
    pub(super) laws: Laws<'a>,
    /// Whether the search ends after its first failure.
    pub(super) quick: bool,
    /// Largest force of a reaction per unit of violated condition: the weight of the conditions in the merit.
    pub(super) weight: f64,
    pub(super) boosts: Vec<(usize, f64)>,
    /// Largest energy so far over the length, N: the magnitude of the reactions on a rod without load.
    pub(super) energy_scale: f64,
    /// Factor by which penetrations and slopes at contacts may be larger after many changes of the contacts.
    pub(super) leniency: f64,
    pub(super) found: Equilibrium,
    /// Number of iterations of the whole search at which the present increment fails.
    pub(super) iteration_limit: usize,
    /// Number of increments in which the holds have moved.
    pub(super) increments: usize,
    /// Number of estimates of the contacts with elastic foundations in the place of the obstacles.
    pub(super) foundations: usize,
}

/// The shape of a rod and its supports, to which the search returns after an attempt that has failed.
#[derive(Clone)]
pub(super) struct Snapshot {
    rod: Rod,
    sites: Vec<Site>,
    frames: Vec<HeldFrame>,
    joints: Joints,
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    pub(super) fn snapshot(&self, rod: &Rod) -> Snapshot {
        let (sites, frames) = (self.sites.clone(), self.frames.clone());
        Snapshot { rod: rod.clone(), sites, frames, joints: self.system.joints.clone() }
    }

    pub(super) fn restore(&mut self, rod: &mut Rod, snapshot: Snapshot) {
        *rod = snapshot.rod;
        (self.sites, self.frames, self.system.joints) = (snapshot.sites, snapshot.frames, snapshot.joints);
        self.renew_force(rod);
        self.locate(rod);
    }

    /// Computes the load of a rod with new elements.
    pub(super) fn renew_force(&mut self, rod: &Rod) {
        let environment = *self.force.environment();
        self.force.update(rod, self.load, &environment);
    }
}

/// The result of a search.
pub(in crate::equilibrium) struct Found {
    pub equilibrium: Equilibrium,
    pub increments: usize,
    pub foundations: usize,
    pub reactions: Vec<Reaction>,
    pub patches: Vec<Patch>,
}
