//! Sweeps over single contacts, for contact problems on which Newton's method fails.

use nalgebra::{Matrix3, Vector3};

use super::local::one_contact;
use super::reduced::{Contact, Evaluated, Reduced};
use super::sites::across;

/// Number of sweeps.
const SWEEPS: usize = 60;

impl Reduced<'_> {
    /// Sweeps over the contacts, each of which is solved exactly for the present forces of the others and the present
    /// normals.
    pub(super) fn sweep(&self, contacts: &mut [Contact]) {
        let coordinates = self.coordinates(contacts);
        let start: Vec<Vector3<f64>> = contacts.iter().map(|contact| contact.force).collect();
        let all: Vec<Evaluated> = contacts.iter().map(|contact| self.evaluate(contact, &coordinates)).collect();
        let own = |i: usize, j: usize| -> Matrix3<f64> {
            self.compliance.fixed_view::<3, 3>(contacts[i].first, contacts[j].first).into_owned()
        };
        let frames: Vec<Matrix3<f64>> = all
            .iter()
            .map(|at| {
                let normal = at.gap.normal;
                let side = across(&normal);
                Matrix3::from_columns(&[normal, side[0], side[1]])
            })
            .collect();
        let places: Vec<Vector3<f64>> = contacts.iter().map(|contact| Self::place(contact, &coordinates).0).collect();
        let mut forces = start.clone();
        for _ in 0..SWEEPS {
            let mut change = 0.0_f64;
            for i in 0..forces.len() {
                let mut moved = Vector3::zeros();
                for j in 0..forces.len() {
                    let from = if i == j { Vector3::zeros() } else { forces[j] };
                    if from != start[j] {
                        moved += own(i, j) * (from - start[j]);
                    }
                }
                let displacement = places[i] + moved - contacts[i].anchor.0 - contacts[i].anchor.1 * contacts[i].shift;
                let mut relative = frames[i].tr_mul(&displacement);
                relative[0] = all[i].gap.value + all[i].gap.normal.dot(&moved);
                let compliance = frames[i].transpose() * own(i, i) * frames[i];
                let force = frames[i] * one_contact(&compliance, &relative, contacts[i].friction);
                change = change.max((force - forces[i]).norm());
                forces[i] = force;
            }
            let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
            if change <= 1e-9 * largest {
                break;
            }
        }
        contacts.iter_mut().zip(&forces).for_each(|(contact, force)| contact.force = *force);
    }
}
