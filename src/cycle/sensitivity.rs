//! Stimuli of the laws, and their derivatives by the intrinsic strain.

use nalgebra::DMatrix;

use super::error::CycleError;
use super::rotated::turned;
use crate::linear::{precise_solver, visit_bends, visit_stimuli};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Environment;
use crate::shoot::Shoot;
use crate::tropism::{Site, TropismLaw};

/// The stimuli of the points of the zone by components 1 and 2 of their intrinsic strain, when the rod at rest has turned by some
/// phases: central differences along the factorised tangent. A row for every point, phase and stimulus.
pub(super) fn stimuli_by_strain(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    environment: &Environment,
    phases: &[f64],
) -> Result<DMatrix<f64>, CycleError> {
    let zone = rod.zone();
    let (m, n) = (shoot.model.tropism().size().stimuli, 2 * zone.len());
    let force = InternalForce::of(rod, shoot.model.load(), environment);
    let mut solver = precise_solver();
    let mut out = DMatrix::zeros(zone.len() * phases.len() * m, n);
    visit_bends(shoot, rod, &force, &mut solver, (0..n).map(|k| (k / 2, k % 2)), |k, weight, moved| {
        for (j, phase) in phases.iter().enumerate() {
            let mut add = |i: usize, _: &Site, x: &[f64]| {
                let rows = out.column_mut(k).data.into_slice_mut()[(i * phases.len() + j) * m..][..m].iter_mut();
                rows.zip(x).for_each(|(sum, x)| *sum += weight * x);
            };
            if *phase == 0.0 {
                visit_stimuli(shoot, moved, &force, &mut add);
            } else {
                visit_stimuli(shoot, &turned(moved, *phase), &force, &mut add);
            }
        }
    })?;
    Ok(out)
}
