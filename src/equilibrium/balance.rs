//! Check of the shape that a solver of equilibria returns.

use nalgebra::Vector3;

use super::error::Outcome;
use super::{EquilibriumError, EquilibriumSolver, LARGEST_TOLERANCE, NewtonSolver, RodEnergy};
use crate::constitutive::Constitutive;
use crate::load::InternalForce;
use crate::rod::{Rod, Tissue};

/// Returns an error unless a free rod is in equilibrium under a force, up to [`LARGEST_TOLERANCE`]
/// or up to the error that its solver has `reported` (rad) if this is larger.
///
/// The rotation that the unbalanced couples cause by the bending stiffness alone is an estimate
/// that costs one evaluation of the energy. It is too large for a rod under tension. Therefore
/// Newton's method decides if it is large.
pub(crate) fn check_balance(
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    reported: f64,
) -> Outcome {
    let permitted = reported.max(LARGEST_TOLERANCE);
    if estimate(rod, material, force)? <= permitted {
        return Ok(());
    }
    let (mut exact, mut solver) = (
        rod.clone(),
        NewtonSolver {
            stable_only: false,
            ..NewtonSolver::default()
        },
    );
    if solver.equilibrate(&mut exact, material, force).is_err() {
        // There is no equilibrium to compare with.
        return Ok(());
    }
    let turns = rod
        .node_frames()
        .into_iter()
        .zip(exact.node_frames())
        .map(|(a, b)| a.angle_to(&b));
    let rotation = turns.fold(0.0, f64::max);
    if rotation > permitted {
        Err(EquilibriumError::Unbalanced { rotation, reported })
    } else {
        Ok(())
    }
}

/// The rotation of the apex that the unbalanced couples cause by the stiffness of the rod, rad: an
/// upper bound.
fn estimate(rod: &Rod, material: &impl Constitutive, force: &InternalForce) -> Outcome<f64> {
    let (_, couples) = RodEnergy::new(material, force).couples(rod)?;
    let (frames, p, time) = (
        rod.node_frames(),
        rod.order().points(),
        force.environment().time,
    );
    let (mut beyond, mut rotation) = (Vector3::zeros(), 0.0);
    for e in (0..rod.elements()).rev() {
        let tissue = Tissue::of(&rod.element_points(e)[0], time);
        let compliance = material
            .respond(&tissue, &Vector3::zeros())
            .tangent
            .diagonal()
            .min()
            .recip();
        for (k, ends) in rod.reference().nodes.windows(2).enumerate().rev() {
            // The couple on the part beyond the interval bends it.
            let node = e * p + k + 1;
            beyond += frames[node] * couples[node];
            rotation += beyond.norm() * (ends[1] - ends[0]) * rod.length_of(e) * compliance;
        }
    }
    Ok(rotation)
}
