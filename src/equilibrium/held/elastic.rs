//! Springs and elastic joints: linear ones, and those with a potential of the user.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::equilibrium::joints::ElasticJoint;
use crate::error::ParameterError;
use crate::so3::{Form, s_functions};
use crate::support::{Energy, Potential};

/// Stiffness relative to the largest one of a spring below which the force of the spring is
/// evaluated and is not an unknown. The error of the tangent has this magnitude.
const SOFT: f64 = 1e-12;
/// Step of the differences that check a potential, relative to the length or in rad.
const CHECK_STEP: f64 = 1e-6;
/// Largest relative error of these differences. Their own error is the step over the length on
/// which the stiffness changes.
const CHECK_ERROR: f64 = 1e-3;
/// Rounding of an energy or a gradient, relative to its size.
const CHECK_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The law of a spring or an elastic joint.
#[derive(Clone, Copy)]
pub(super) enum ElasticLaw<'a> {
    /// A linear law: stiffness, and the argument without force.
    Linear(Matrix3<f64>, Vector3<f64>),
    /// The potential of a user.
    User(&'a dyn Potential),
}

/// The laws of the springs and elastic joints of a rod.
#[derive(Default)]
pub(super) struct ElasticLaws<'a> {
    pub springs: Vec<ElasticLaw<'a>>,
    /// Frames without rotation and laws, in the order of the elastic joints of the system.
    pub joints: Vec<(UnitQuaternion<f64>, ElasticLaw<'a>)>,
}

impl ElasticLaw<'_> {
    pub fn energy(&self, x: &Vector3<f64>, time: f64) -> Energy {
        match self {
            Self::User(potential) => potential.energy(x, time),
            Self::Linear(stiffness, rest) => {
                let gradient = stiffness * (x - rest);
                Energy {
                    value: 0.5 * gradient.dot(&(x - rest)),
                    gradient,
                    stiffness: *stiffness,
                }
            }
        }
    }

    /// Returns an error unless the derivatives of a user's potential at x are those of its energy,
    /// to either side along each axis: the stiffness may be discontinuous at x.
    pub fn check(&self, x: &Vector3<f64>, scale: f64, time: f64) -> Result<(), ParameterError> {
        if !matches!(self, Self::User(..)) {
            return Ok(());
        }
        let here = self.energy(x, time);
        let (stiffness, skew) = (
            here.stiffness.norm(),
            (here.stiffness - here.stiffness.transpose()).norm(),
        );
        let sum = here.value + here.gradient.sum() + here.stiffness.sum();
        ParameterError::finite("sum of an energy and its derivatives", sum, "")?;
        ParameterError::unless(
            skew <= 1e-9 * stiffness,
            "asymmetry of the stiffness of a potential",
            skew,
            "zero",
        )?;
        for axis in 0..3 {
            let errors = [1.0, -1.0].map(|side| {
                let moved = x + Vector3::ith(axis, side * CHECK_STEP * scale);
                let (by, there) = (moved - x, self.energy(&moved, time));
                let work = 0.5 * (here.gradient + there.gradient).dot(&by);
                let size = by.norm() * here.gradient.norm().max(there.gradient.norm());
                let rounding = CHECK_ROUNDING * here.value.abs().max(there.value.abs());
                let energy = relative((there.value - here.value - work).abs(), size, rounding);
                let change = there.gradient - here.gradient;
                let expected = (here.stiffness + there.stiffness) * by * 0.5;
                let size = by.norm() * stiffness.max(there.stiffness.norm());
                let rounding = CHECK_ROUNDING * here.gradient.norm().max(there.gradient.norm());
                (energy, relative((change - expected).norm(), size, rounding))
            });
            let [(energy, gradient), (other_energy, other_gradient)] = errors;
            // The comparisons fail for NaN.
            let (name, error) = (
                "relative error of the gradient of a potential",
                energy.min(other_energy),
            );
            let requirement = "zero: the gradient must be that of the energy";
            ParameterError::unless(error <= CHECK_ERROR, name, error, requirement)?;
            let (name, error) = (
                "relative error of the stiffness of a potential",
                gradient.min(other_gradient),
            );
            let requirement = "zero: the stiffness must be the derivative of the gradient";
            ParameterError::unless(error <= CHECK_ERROR, name, error, requirement)?;
        }
        Ok(())
    }
}

/// An error in excess of rounding, relative to a size.
fn relative(error: f64, size: f64, rounding: f64) -> f64 {
    if error <= rounding {
        0.0
    } else {
        (error - rounding) / size
    }
}

/// A spring at a place, in the present configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spring {
    /// Number of its law.
    pub law: usize,
    /// Force on the rod, N. In equilibrium it is minus the gradient.
    pub force: Vector3<f64>,
    /// Energy, J.
    pub energy: f64,
    gradient: Vector3<f64>,
    /// Principal axes and stiffnesses, N/m.
    axes: [(Vector3<f64>, f64); 3],
}

impl Spring {
    pub fn new(law: usize) -> Self {
        let zero = Vector3::zeros();
        Self {
            law,
            force: zero,
            energy: 0.0,
            gradient: zero,
            axes: [(zero, 0.0); 3],
        }
    }

    /// Evaluates the law at the present position (m) and time (s).
    pub fn locate(&mut self, laws: &ElasticLaws, position: &Vector3<f64>, time: f64) {
        let Energy {
            value,
            gradient,
            stiffness,
        } = laws.springs[self.law].energy(position, time);
        (self.energy, self.gradient) = (value, gradient);
        // The eigenvalues of a matrix that is not finite are not found.
        self.axes = if stiffness.iter().all(|value| value.is_finite()) {
            let eigen = stiffness.symmetric_eigen();
            std::array::from_fn(|i| {
                (
                    eigen.eigenvectors.column(i).into_owned(),
                    eigen.eigenvalues[i],
                )
            })
        } else {
            std::array::from_fn(|i| (Vector3::ith(i, 1.0), f64::NAN))
        };
        let largest = self
            .axes
            .iter()
            .map(|(_, stiffness)| stiffness.abs())
            .fold(0.0, f64::max);
        for (along, stiffness) in &mut self.axes {
            if stiffness.abs() <= SOFT * largest {
                *stiffness = 0.0;
                self.force -= *along * along.dot(&(self.force + self.gradient));
            }
        }
    }

    /// Sets the force to that of the law at the position of the last evaluation.
    pub fn relax(&mut self) {
        self.force = -self.gradient;
    }

    /// The axes with a stiffness: direction, stiffness κ (N/m), and the violation of the law along
    /// it, ±(f + ∂U)/√|κ| with the sign of κ.
    pub fn stiff(&self) -> impl Iterator<Item = (Vector3<f64>, f64, f64)> + '_ {
        let excess = self.force + self.gradient;
        let stiff = self.axes.iter().filter(|(_, stiffness)| *stiffness != 0.0);
        stiff.map(move |(d, k)| (*d, *k, d.dot(&excess) * k.signum() / k.abs().sqrt()))
    }
}

/// Couple and stiffness of an elastic joint in a rotation φ of its frame, R exp(φ). The rotation
/// vector changes by dθ = Jr⁻¹ φ.
pub(super) fn elastic_joint(node: usize, turn: &Vector3<f64>, energy: &Energy) -> ElasticJoint {
    let inverse = Form::inverse_right_jacobian(&s_functions(turn.norm_squared()));
    let (matrix, transpose) = (inverse.matrix(turn), inverse.transpose());
    // The derivative of Jr⁻ᵀ ∂U/∂θ. Only its symmetric part is a second derivative of the energy.
    let derivative = (transpose.jacobian(turn, &energy.gradient)
        + matrix.transpose() * energy.stiffness)
        * matrix;
    let stiffness = (derivative + derivative.transpose()) * 0.5;
    ElasticJoint {
        node,
        couple: -transpose.apply(turn, &energy.gradient),
        stiffness,
    }
}

#[cfg(test)]
mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    use super::*;
    use crate::so3;

    #[test]
    fn derivatives_of_an_elastic_joint_are_those_of_its_energy() {
        let frame = so3::exp(&Vector3::new(0.3, -1.1, 0.7));
        // A potential without symmetry, U = a · θ + ½ θ · K θ + (b · θ)³.
        let (a, b) = (Vector3::new(0.2, -0.5, 0.3), Vector3::new(0.4, 0.1, -0.3));
        let k = Matrix3::new(1.0, 0.2, 0.0, 0.2, 2.0, -0.4, 0.0, -0.4, -0.5);
        let energy =
            |turn: &Vector3<f64>| a.dot(turn) + 0.5 * turn.dot(&(k * turn)) + b.dot(turn).powi(3);
        let turn = so3::log(&frame);
        let gradient = a + k * turn + b * (3.0 * b.dot(&turn).powi(2));
        let stiffness = k + b * b.transpose() * (6.0 * b.dot(&turn));
        let joint = elastic_joint(
            0,
            &turn,
            &Energy {
                value: energy(&turn),
                gradient,
                stiffness,
            },
        );
        let along =
            |axis: &Vector3<f64>, h: f64| energy(&so3::log(&(frame * so3::exp(&(axis * h)))));
        for axis in [
            Vector3::new(1.0, 0.0, 0.0),
            Vector3::new(0.6, -0.8, 0.0),
            Vector3::new(0.48, 0.6, 0.64),
        ] {
            // Central differences. Their errors are of order h² = 1e-8. The energy is of order one,
            // and the rounding of its second difference is 4e-16/h² = 4e-8.
            let h = 1e-4;
            let (ahead, here, behind) = (along(&axis, h), along(&axis, 0.0), along(&axis, -h));
            let slope = (ahead - behind) / (2.0 * h);
            assert_relative_eq!(
                slope,
                -joint.couple.dot(&axis),
                epsilon = 0.0,
                max_relative = 1e-7
            );
            let bend = (ahead - 2.0 * here + behind) / (h * h);
            assert_abs_diff_eq!(bend, axis.dot(&(joint.stiffness * axis)), epsilon = 2e-7);
        }
    }
}
