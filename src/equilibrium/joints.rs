//! Frames of a rod whose rotation is confined or elastic, and a base that rotates.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::tangent::Tangent;
use crate::rod::Rod;
use crate::so3::{self, Form, s_functions};

/// Joints of a rod at the ends of its elements.
#[derive(Debug, Default, Clone)]
pub(super) struct Joints {
    /// Whether the frame of the base is unknown.
    pub base_rotates: bool,
    /// Frames with confined rotations: node, and the projection to the free directions along the directors.
    pub confined: Vec<(usize, Matrix3<f64>)>,
    /// Elastic joints: node, frame without couple, stiffness (N m/rad).
    pub elastic: Vec<(usize, UnitQuaternion<f64>, f64)>,
    /// Couples of the elastic joints on the rod, along the directors, N m.
    pub couples: Vec<Vector3<f64>>,
    /// Unbalanced couples in the confined directions at the last balance, along the directors, N m.
    pub held: Vec<Vector3<f64>>,
}

impl Joints {
    /// The first node whose frame is unknown.
    pub fn first_free(&self) -> usize {
        usize::from(!self.base_rotates)
    }

    /// Removes all joints; the base is clamped then.
    pub fn clear(&mut self) {
        self.base_rotates = false;
        self.confined.clear();
        self.elastic.clear();
        self.couples.clear();
        self.held.clear();
    }

    /// Energy (J) of the elastic joints at the frames of a rod. Their couples are kept for [`release`](Self::release).
    pub fn stretch(&mut self, rod: &Rod) -> f64 {
        let mut energy = 0.0;
        self.couples.clear();
        for (node, frame, stiffness) in &self.elastic {
            let turn = so3::log(&(frame.inverse() * rod.frames()[*node]));
            energy += 0.5 * stiffness * turn.norm_squared();
            // The gradient by a rotation of the frame is Jr⁻ᵀ θ = θ, since θ is an eigenvector.
            self.couples.push(-turn * *stiffness);
        }
        energy
    }

    /// Adds the elastic joints to a tangent and confines its rotations.
    pub fn apply(&self, tangent: &mut Tangent, rod: &Rod) {
        for (node, frame, stiffness) in &self.elastic {
            let turn = so3::log(&(frame.inverse() * rod.frames()[*node]));
            let inverse = Form::inverse_right_jacobian(&s_functions(turn.norm_squared()));
            // The derivative of θ by a rotation is Jr⁻¹.
            let block = inverse.matrix(&turn) * *stiffness;
            if *node >= self.first_free() {
                tangent.add_diagonal(node - self.first_free(), &((block + block.transpose()) * 0.5));
            }
        }
        for (node, projection) in &self.confined {
            if *node >= self.first_free() {
                tangent.project(node - self.first_free(), projection);
            }
        }
    }

    /// Adds the couples of the elastic joints to the unbalanced couples on the frames, and removes the confined
    /// directions, whose couples are kept.
    pub fn release(&mut self, couples: &mut [Vector3<f64>]) {
        for ((node, ..), couple) in self.elastic.iter().zip(&self.couples) {
            couples[*node] += couple;
        }
        if !self.base_rotates {
            couples.iter_mut().take(1).for_each(|couple| *couple = Vector3::zeros());
        }
        self.held.clear();
        for (node, projection) in &self.confined {
            let free = projection * couples[*node];
            self.held.push(couples[*node] - free);
            couples[*node] = free;
        }
    }

    /// Removes the confined directions of a vector of couples.
    pub fn confine(&self, couples: &mut [Vector3<f64>]) {
        if !self.base_rotates {
            couples.iter_mut().take(1).for_each(|couple| *couple = Vector3::zeros());
        }
        for (node, projection) in &self.confined {
            couples[*node] = projection * couples[*node];
        }
    }

    /// The nodes with joints.
    pub fn nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.confined.iter().map(|(node, _)| *node).chain(self.elastic.iter().map(|(node, ..)| *node))
    }

    /// Replaces the nodes, in the same order.
    pub fn set_nodes(&mut self, nodes: impl Iterator<Item = usize>) {
        let own = self.confined.iter_mut().map(|(node, _)| node).chain(self.elastic.iter_mut().map(|(node, ..)| node));
        own.zip(nodes).for_each(|(own, node)| *own = node);
    }

    /// Number of confined directions among the unknowns.
    pub fn confined_directions(&self) -> usize {
        self.confined.iter().map(|(_, projection)| (3.0 - projection.trace()).round() as usize).sum()
    }
}
