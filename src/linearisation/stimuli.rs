//! Stimuli at the material points of the growth zone, and their derivatives at a point.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::sensing::{self, visit_sites};
use crate::shoot::Shoot;
use crate::tropism::{Declaration, Site, TropismLaw};

/// Rotation of a frame for central differences, rad. The truncation error is 1e-9 of a third
/// derivative, and the rounding error 1e-12.
const TURN: f64 = 1e-4;

/// Evaluates the stimuli at all material points of the growth zone of a rod in equilibrium under a
/// force. Calls `visit` with the number of each point, counted from the first of the zone, its site
/// and its stimuli.
pub(crate) fn visit_stimuli(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    force: &InternalForce,
    visit: impl FnMut(usize, &Site, &[f64]),
) {
    let (material, law) = (shoot.model.constitutive(), shoot.model.tropism());
    let laws = Declaration::of(law);
    let mut stimuli = vec![0.0; laws.size().stimuli];
    sensing::visit_stimuli(
        (rod, None),
        (material, law),
        force,
        laws.reads_position(),
        &mut stimuli,
        visit,
    );
}

/// Derivatives of the stimuli at every material point of the growth zone with respect to the strain
/// at the point, and with respect to the rotation of its frame about the directors (1/rad), by
/// central differences.
pub(crate) fn stimulus_derivatives(
    shoot: &Shoot<impl Model>,
    rod: &Rod,
    force: &InternalForce,
) -> (Vec<DMatrix<f64>>, Vec<DMatrix<f64>>) {
    let law = shoot.model.tropism();
    let laws = Declaration::of(law);
    let m = laws.size().stimuli;
    let mut strain = vec![DMatrix::zeros(m, 3); rod.zone().len()];
    let mut turn = strain.clone();
    let sensed = |site: &Site| {
        let mut x = DVector::zeros(m);
        law.sense(site, x.as_mut_slice());
        x
    };
    visit_sites(
        rod,
        shoot.model.constitutive(),
        force,
        laws.reads_position(),
        |i, site| {
            for c in 0..3 {
                let axis = Vector3::ith(c, 1.0);
                // Most stimuli are linear in the strain. For the others a step of a thousandth of
                // 1/radius is small enough.
                let h = 1e-3 / site.section.radius();
                let bent = |sign: f64| {
                    sensed(&Site {
                        strain: site.strain + axis * (sign * h),
                        ..*site
                    })
                };
                strain[i].set_column(c, &((bent(1.0) - bent(-1.0)) / (2.0 * h)));
                let turned = |sign: f64| {
                    let frame = site.frame * UnitQuaternion::from_scaled_axis(axis * (sign * TURN));
                    sensed(&Site { frame, ..*site })
                };
                turn[i].set_column(c, &((turned(1.0) - turned(-1.0)) / (2.0 * TURN)));
            }
        },
    );
    (strain, turn)
}
