//! A rod without load takes its intrinsic shape, u = u*: nothing to solve for.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Equilibrium, EquilibriumError, EquilibriumSolver};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::reference_element::MAX_POINTS;
use crate::rod::{Rod, weighted};
use crate::so3::{self, Form};

/// The solver of an unloaded scene: the frames follow from the intrinsic strain, element by element from the base.
///
/// θ' = Jr(θ)⁻¹ u* is collocated at the Gauss points, which is the minimum of the same discrete energy that
/// [`NewtonSolver`](super::NewtonSolver) minimises. No matrix, no factorisation, no memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unloaded;

impl EquilibriumSolver for Unloaded {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        _material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        force.check(rod)?;
        let force = force.largest().max(force.at_base().norm());
        if force != 0.0 {
            return Err(EquilibriumError::Loaded { force });
        }
        let mut outcome = Equilibrium::default();
        // Every element is computed before any is written, so that an error leaves the rod as it was.
        let mut rotations = Vec::with_capacity(rod.rotations.len());
        for e in 0..rod.elements() {
            let (of_element, iterations, error) = integrate(rod, e)?;
            rotations.extend_from_slice(&of_element[..rod.order.points()]);
            outcome.iterations = outcome.iterations.max(iterations);
            outcome.error += error;
        }
        rod.rotations.copy_from_slice(&rotations);
        // Without force there is neither shear nor stretch.
        rod.line_strains.clear();
        rod.chain_frames();
        Ok(outcome)
    }
}

/// Gives the rod the shape u = u*, without memory of its own: an error leaves a part of it so.
pub(super) fn take_intrinsic_shape(rod: &mut Rod) -> Result<(), EquilibriumError> {
    let p = rod.order.points();
    for e in 0..rod.elements() {
        let (of_element, ..) = integrate(rod, e)?;
        rod.rotations[e * p..(e + 1) * p].copy_from_slice(&of_element[..p]);
    }
    rod.chain_frames();
    Ok(())
}

/// Refuses a rod whose intrinsic strain turns it by π or more within one element.
pub(super) fn check_turns(rod: &Rod) -> Result<(), ParameterError> {
    (0..rod.elements()).try_for_each(|e| match integrate(rod, e) {
        Err(EquilibriumError::Parameter(error)) => Err(error),
        _ => Ok(()),
    })
}

/// Picard's iteration for the rotation vectors of an element's nodes; also the number of sweeps and the last change.
fn integrate(rod: &Rod, e: usize) -> Result<([Vector3<f64>; MAX_POINTS], usize, f64), EquilibriumError> {
    /// Each sweep shrinks the error by about |u*| h / 2; sixty reach rounding for every element that resolves its bend.
    const SWEEPS: usize = 60;
    let reference = rod.reference();
    let points = rod.element_points(e);
    let mut theta = [Vector3::zeros(); MAX_POINTS];
    let mut change = f64::INFINITY;
    for sweep in 1..=SWEEPS {
        let mut rates = [Vector3::zeros(); MAX_POINTS];
        for (g, point) in points.iter().enumerate() {
            let at = weighted(&theta[..reference.p], &reference.shape[g]);
            let inverse = Form::inverse_right_jacobian(&so3::s_functions(at.norm_squared()));
            rates[g] = inverse.apply(&at, &point.intrinsic) * point.jacobian;
        }
        let before = theta;
        change = 0.0;
        for k in 0..reference.p {
            theta[k] = weighted(&rates[..reference.p], &reference.integral_upto(reference.nodes[k + 1]));
            change = f64::max(change, (theta[k] - before[k]).norm());
        }
        let size =
            rates[..reference.p].iter().map(Vector3::norm).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a });
        if !size.is_finite() {
            return Err(EquilibriumError::NotFinite { what: "intrinsic strain" });
        }
        // Beyond half a turn the rotation vector is not the one that the frames have.
        let turn = theta[..reference.p].iter().map(Vector3::norm).fold(0.0, f64::max);
        ParameterError::unless(turn < PI, "turn within one element", turn, "below π (rad): take more elements")?;
        if change <= 4.0 * f64::EPSILON * size {
            return Ok((theta, sweep, change));
        }
    }
    Err(EquilibriumError::NoConvergence { iterations: SWEEPS, step: change, residual: 0.0, force: 0.0 })
}
