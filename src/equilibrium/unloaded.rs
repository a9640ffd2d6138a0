//! Equilibrium of a rod without load: the visible strain is the intrinsic strain, u = u*.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Equilibrium, EquilibriumError, EquilibriumSolver};
use crate::constitutive::Constitutive;
use crate::error::ParameterError;
use crate::load::InternalForce;
use crate::numerics::scalar::largest;
use crate::reference_element::MAX_POINTS;
use crate::rod::{Rod, weighted};
use crate::so3::{self, Form};

/// The solver for rods without load: the frames are integrated from the intrinsic strain, element
/// by element from the base.
///
/// θ' = Jr(θ)⁻¹ u* is collocated at the Gauss points, which is the minimum of the same discrete
/// energy that [`NewtonSolver`](super::NewtonSolver) minimises. It needs neither a matrix nor
/// workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unloaded;

impl EquilibriumSolver for Unloaded {
    fn is_trusted(&self) -> bool {
        true
    }

    /// Gives the rod the shape u = u*. Of the returned [`Equilibrium`] only `iterations`, the
    /// largest number of an element, and `error` are computed; the energy and the other counts are
    /// zero.
    ///
    /// # Errors
    /// [`Parameter`](EquilibriumError::Parameter) for a force that is not zero,
    /// [`Folded`](EquilibriumError::Folded) for an element that would rotate by π or more,
    /// [`NotFinite`](EquilibriumError::NotFinite) for an intrinsic strain that is not finite, and
    /// [`NoConvergence`](EquilibriumError::NoConvergence) for an element that does not resolve its
    /// bending.
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        _material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        force.check(rod)?;
        let force = force.largest().max(force.at_base().norm());
        ParameterError::unless(
            force == 0.0,
            "force in a rod that is solved as unloaded",
            force,
            "zero (N)",
        )?;
        let rotations = rod.rotations.clone();
        let found = take_intrinsic_shape(rod).inspect_err(|_| rod.rotations = rotations)?;
        // A rod without force has neither shear nor stretch.
        rod.line_strains.clear();
        rod.reactions.clear();
        Ok(found)
    }
}

/// Gives the rod the shape u = u*, without allocation. After an error its rotations have changed,
/// but its frames have not.
pub(super) fn take_intrinsic_shape(rod: &mut Rod) -> Result<Equilibrium, EquilibriumError> {
    let (p, mut found) = (rod.order().points(), Equilibrium::default());
    for e in 0..rod.elements() {
        let (rotations, iterations, error) = integrate(rod, e)?;
        rod.rotations[e * p..(e + 1) * p].copy_from_slice(&rotations[..p]);
        found.iterations = found.iterations.max(iterations);
        found.error += error;
    }
    rod.chain_frames();
    Ok(found)
}

/// Returns an error for an intrinsic strain that rotates an element by π or more.
pub(super) fn check_turns(rod: &Rod) -> Result<(), EquilibriumError> {
    (0..rod.elements()).try_for_each(|e| match integrate(rod, e) {
        Err(error @ EquilibriumError::Folded { .. }) => Err(error),
        _ => Ok(()),
    })
}

/// Picard iteration for the rotation vectors of the nodes of an element. Returns the number of
/// sweeps and the last change as well.
fn integrate(
    rod: &Rod,
    e: usize,
) -> Result<([Vector3<f64>; MAX_POINTS], usize, f64), EquilibriumError> {
    // Each sweep multiplies the error by about |u*| h/2, less than one half in an element that
    // resolves its bending: it gains a binary digit.
    let sweeps = f64::MANTISSA_DIGITS as usize;
    let reference = rod.reference();
    let points = rod.element_points(e);
    let mut theta = [Vector3::zeros(); MAX_POINTS];
    let mut change = f64::INFINITY;
    for sweep in 1..=sweeps {
        let mut rates = [Vector3::zeros(); MAX_POINTS];
        for (g, point) in points.iter().enumerate() {
            let at = weighted(&theta[..reference.p], &reference.shape[g]);
            let inverse = Form::inverse_right_jacobian(&so3::s_functions(at.norm_squared()));
            rates[g] = inverse.apply(&at, &point.intrinsic) * point.jacobian;
        }
        let before = theta;
        change = 0.0;
        for k in 0..reference.p {
            theta[k] = weighted(
                &rates[..reference.p],
                &reference.integral_upto(reference.nodes[k + 1]),
            );
            change = f64::max(change, (theta[k] - before[k]).norm());
        }
        let size = largest(rates[..reference.p].iter().map(Vector3::norm));
        EquilibriumError::finite(size.is_finite(), "intrinsic strain")?;
        // Rotation vectors longer than π do not have the logarithms of their frames.
        let turn = theta[..reference.p]
            .iter()
            .map(Vector3::norm)
            .fold(0.0, f64::max);
        if !(turn < PI) {
            return Err(EquilibriumError::Folded {
                element: e,
                intrinsic: rod.intrinsic_turn(e),
            });
        }
        if change <= 4.0 * f64::EPSILON * size {
            return Ok((theta, sweep, change));
        }
    }
    let (iterations, step) = (sweeps, change);
    Err(EquilibriumError::NoConvergence {
        iterations,
        step,
        residual: 0.0,
        force: 0.0,
        contact: None,
    })
}
