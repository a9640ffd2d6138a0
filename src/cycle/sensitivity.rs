//! What the laws sense, by the intrinsic strain.

use nalgebra::DMatrix;

use super::error::CycleError;
use super::turned::turned;
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Environment;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::stability::precise_solver;
use crate::tropism::{Declaration, TropismLaw};

/// Step of the central differences by the strain: the turn of the frames beyond a point, rad. They err by 1e-9.
const ANGLE: f64 = 3e-5;

/// Calls `visit` with the number of every point of the zone and its stimuli, on a rod at rest under a force. The force does not
/// depend on the shape.
pub(super) fn look(shoot: &Shoot<impl Model>, rod: &Rod, force: &InternalForce, mut visit: impl FnMut(usize, &[f64])) {
    let law = shoot.model.tropism();
    let laws = Declaration::of(law);
    let mut stimuli = vec![0.0; laws.size().stimuli];
    visit_sites(rod, shoot.model.constitutive(), force, laws.reads_position(), |i, site| {
        law.sense(site, &mut stimuli);
        visit(i, &stimuli);
    });
}

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
    let mut tangent = solver.linearise(rod, shoot.model.constitutive(), &force)?;
    let mut out = DMatrix::zeros(zone.len() * phases.len() * m, n);
    let (p, mut moved) = (rod.order().points(), rod.clone());
    for k in 0..n {
        let at = zone.start + k / 2;
        let step = ANGLE / (rod.reference().weights[at % p] * rod.points()[at].jacobian);
        for sign in [1.0, -1.0] {
            moved.clone_from(rod);
            moved.points[at].intrinsic[k % 2] += sign * step;
            tangent.follow(&mut moved);
            for (j, phase) in phases.iter().enumerate() {
                let mut add = |i: usize, x: &[f64]| {
                    let first = (i * phases.len() + j) * m;
                    let rows = &mut out.column_mut(k).data.into_slice_mut()[first..first + m];
                    rows.iter_mut().zip(x).for_each(|(sum, x)| *sum += sign * x / (2.0 * step));
                };
                if *phase == 0.0 {
                    look(shoot, &moved, &force, &mut add);
                } else {
                    look(shoot, &turned(&moved, *phase), &force, &mut add);
                }
            }
        }
    }
    Ok(out)
}
