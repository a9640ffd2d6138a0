//! Derivatives of the stimuli of the laws by the intrinsic strain.

use nalgebra::DMatrix;

use super::error::Outcome;
use super::rotated::rotated;
use crate::linearisation::{visit_bends, visit_stimuli};
use crate::load::InternalForce;
use crate::model::{Model, TropismLaw};
use crate::rod::Rod;
use crate::shoot::Shoot;

/// Largest relative effect of the truncation and rounding errors of differences of equilibria on
/// symmetries: on the multiplier 1 of a rotation, on the root 0 of a rotating wave, and on the
/// direction of a planar orbit.
pub(super) const ASYMMETRY: f64 = 1e-6;

/// Derivatives of the stimuli by components 1 and 2 of the intrinsic strain of the points of the
/// zone, when the rod in equilibrium under a force is rotated by some phases (rad): central
/// differences along the factorised tangent. The rows are points, phases and stimuli. Phases other
/// than zero are for a shoot without support.
pub(super) fn stimuli_by_strain(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    force: &InternalForce,
    phases: &[f64],
) -> Outcome<DMatrix<f64>> {
    let zone = rod.zone();
    let (m, n) = (shoot.model.tropism().size().stimuli, 2 * zone.len());
    let statics = (shoot.model.load(), shoot.model.support());
    let mut out = DMatrix::zeros(zone.len() * phases.len() * m, n);
    visit_bends(
        shoot,
        rod,
        statics,
        force,
        (0..n).map(|k| (k / 2, k % 2)),
        |k, weight, bent, force| {
            for (j, phase) in phases.iter().enumerate() {
                let turned = (*phase != 0.0).then(|| rotated(bent, *phase));
                visit_stimuli(shoot, turned.as_ref().unwrap_or(bent), force, |i, _, x| {
                    let rows = out.column_mut(k).data.into_slice_mut()
                        [(i * phases.len() + j) * m..][..m]
                        .iter_mut();
                    rows.zip(x).for_each(|(sum, x)| *sum += weight * x);
                });
            }
        },
    )?;
    Ok(out)
}
