//! A Newton step with the contacts that it keeps, gains and loses.

use nalgebra::DVector;

use super::conditions::{Conditions, Role};
use super::data::HeldSearch;
use super::dense::Dense;
use super::touch::{Penetration, approaches, largest_share};
use crate::constitutive::Constitutive;
use crate::equilibrium::system::Configuration;
use crate::equilibrium::{EquilibriumError, Inertia};
use crate::load::Load;
use crate::rod::Rod;

/// Largest rotation of a frame in a step, rad.
const LARGEST_TURN: f64 = 0.5;
/// Largest number of changes of the contacts in a step.
const CONTACT_CHANGES: usize = 60;

/// Distance of two places that are one, in elements.
const SAME_PLACE: f64 = 1e-6;

/// A step with the contacts that it keeps and gains.
pub(super) struct ContactStep {
    /// Energy of the rod before the step, J.
    pub energy: f64,
    pub inertia: Inertia,
    pub conditions: Conditions,
    pub dense: Dense,
    pub changes: DVector<f64>,
    /// The fraction of the step that is safe.
    pub fraction: f64,
}

impl<C: Constitutive, L: Load, const P: usize> HeldSearch<'_, C, L, P> {
    /// Solves for the step with the contacts that it keeps, gains and loses, and for the fraction of it that is safe.
    pub(super) fn step_with_contacts(&mut self, rod: &mut Rod, shift: f64) -> Result<ContactStep, EquilibriumError> {
        let (mut energy, mut pivots) = self.factorise(rod, shift)?;
        let (mut earlier, mut cycles) = (Vec::new(), false);
        for _ in 0..CONTACT_CHANGES {
            let (inertia, conditions, dense) = self.close(rod, pivots)?;
            let changes = self.step(&conditions, &dense);
            let turn = self.system.largest_turn();
            let mut fraction = f64::min(1.0, LARGEST_TURN / turn);
            if !self.approaches() || !turn.is_finite() {
                if !self.obstacles.contacts.is_empty() && turn.is_finite() {
                    fraction *= self.safe_share(rod, fraction).0;
                }
                return Ok(ContactStep { energy, inertia, conditions, dense, changes, fraction });
            }
            // Contacts that would pull are lost.
            let mut pulling: Vec<usize> = Vec::new();
            for (role, by) in conditions.roles.iter().zip(changes.iter()) {
                if let Role::Fixed(site, _) = role
                    && let Some(touch) = self.sites[*site].touch
                    && touch.push + by < 0.0
                {
                    pulling.push(*site);
                }
            }
            let sticking = conditions.sticking(&changes);
            let number = pulling.len();
            pulling.retain(|site| !self.slips_instead(*site, &sticking));
            if pulling.len() < number {
                self.apply(rod);
                (energy, pivots) = self.factorise(rod, shift)?;
                continue;
            }
            if !pulling.is_empty() {
                pulling.sort_unstable();
                let mut loaded = false;
                for site in pulling.iter().rev() {
                    loaded |= self.sites.remove(*site).touch.is_some_and(|touch| touch.push != 0.0);
                }
                if loaded {
                    self.apply(rod);
                    (energy, pivots) = self.factorise(rod, shift)?;
                }
                continue;
            }
            let (share, penetrations) = self.safe_share(rod, fraction);
            fraction *= share;
            // The same contacts may be lost and found in turn, since the rod does not follow the linear step exactly.
            // Then contacts are only lost, and the next step finds those that are missing.
            let places: Vec<f64> = self.sites.iter().map(|site| site.element as f64 + site.x).collect();
            let same = |other: &Vec<f64>| {
                other.len() == places.len() && other.iter().zip(&places).all(|(a, b)| (a - b).abs() < SAME_PLACE)
            };
            cycles |= earlier.iter().any(same);
            earlier.push(places);
            if cycles || !self.touch(rod, &penetrations, false) {
                return Ok(ContactStep { energy, inertia, conditions, dense, changes, fraction });
            }
            self.locate(rod);
            self.merge_sites(rod);
        }
        Err(self.contacts_not_found(0.0))
    }

    /// The share of a fraction of the step that is within the bounds on the approach to obstacles, and the places at
    /// which the rod penetrates them after it.
    fn safe_share(&mut self, rod: &mut Rod, fraction: f64) -> (f64, Vec<Penetration>) {
        let mut from = Configuration::default();
        from.keep(rod);
        let forces = self.obstacles.forces.clone();
        let before = self.sampling(rod);
        let (bounds, before) = (approaches(&before), before.stations);
        self.system.start.keep(rod);
        self.advance(rod, fraction);
        self.locate(rod);
        let mut after = self.sampling(rod);
        let share = largest_share(&bounds, &before, &after.stations);
        if share < 1.0 {
            from.restore(rod);
            self.obstacles.pull(forces.clone());
            self.advance(rod, fraction * share);
            self.locate(rod);
            after = self.sampling(rod);
        }
        let penetrations = self.penetrations(&after, rod);
        from.restore(rod);
        self.obstacles.pull(forces);
        self.locate(rod);
        (share, penetrations)
    }
}
