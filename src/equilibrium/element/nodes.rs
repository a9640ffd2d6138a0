//! Derivatives of the energy of an element by rotations of the frames at its nodes.
//!
//! The unknowns of an element are rotation vectors relative to its first frame. Rotations R → R
//! exp(φ̂) of the frames at node k and at the first end change the rotation vector of the node by
//! δθ = A φk − Aᵀ φ0, with A = Jr⁻¹(θ).

use nalgebra::{Matrix3, Vector3};

use super::{ElementData, ElementSystem, chain_slopes, symmetric_part};
use crate::reference_element::MAX_POINTS;
use crate::so3::{Form, s_functions};

/// The form A at a rotation vector.
fn chain(theta: &Vector3<f64>) -> Form {
    Form::inverse_right_jacobian(&s_functions(theta.norm_squared()))
}

/// Second derivatives of the energy of an element by the rotations of its nodes, N m: the block of
/// rows k and columns l ≥ k, and below it zero. Node 0 is the first end.
pub(in crate::equilibrium) type NodeBlocks = [[Matrix3<f64>; MAX_POINTS + 1]; MAX_POINTS + 1];

impl ElementSystem {
    /// Adds the derivatives of the energy by the rotations of the nodes 0 … p, at the last
    /// evaluation, to `sums`.
    pub fn add_node_gradient<const P: usize>(&self, data: &ElementData, sums: &mut [Vector3<f64>]) {
        sums[0] += self.gradient[P];
        for (k, theta) in data.rotations.iter().enumerate() {
            let a = chain(theta).matrix(theta);
            sums[k + 1] += a.tr_mul(&self.gradient[k]);
            sums[0] -= a * self.gradient[k];
        }
    }

    /// The second derivatives of the energy by the rotations of the nodes, at the last evaluation
    /// with a Hessian that was not condensed.
    pub fn node_hessian<const P: usize>(&self, data: &ElementData) -> NodeBlocks {
        let block = |k: usize, l: usize| match k.cmp(&l) {
            std::cmp::Ordering::Less => self.hessian.block(3 * k, 3 * l),
            std::cmp::Ordering::Equal => self.hessian.diagonal_block(3 * k),
            std::cmp::Ordering::Greater => self.hessian.block(3 * l, 3 * k).transpose(),
        };
        let chains: [Form; P] = std::array::from_fn(|k| chain(&data.rotations[k]));
        let a: [Matrix3<f64>; P] = std::array::from_fn(|k| chains[k].matrix(&data.rotations[k]));
        let mut found = [[Matrix3::zeros(); MAX_POINTS + 1]; MAX_POINTS + 1];
        found[0][0] = block(P, P);
        for k in 0..P {
            let [b, c] = chain_slopes(&chains[k], &data.rotations[k], &self.gradient[k]);
            // Derivatives by the rotation vector of node k and the rotation of the first frame.
            let mut mixed = block(k, P);
            for l in 0..P {
                let theta = block(k, l);
                mixed -= theta * a[l].transpose();
                if l >= k {
                    found[k + 1][l + 1] = a[k].transpose() * theta * a[l];
                }
            }
            found[k + 1][k + 1] = symmetric_part(&(found[k + 1][k + 1] + b * a[k]));
            found[0][k + 1] = (a[k].transpose() * mixed - b * a[k].transpose()).transpose();
            found[0][0] += c * a[k].transpose() - a[k] * mixed - (a[k] * block(k, P)).transpose();
        }
        found[0][0] = symmetric_part(&found[0][0]);
        found
    }
}
