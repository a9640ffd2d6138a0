//! Frames of a rod whose rotation is confined or elastic, and a base that rotates.

use nalgebra::{Matrix3, Vector3};

use super::tangent::Tangent;

/// An elastic joint in the present configuration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ElasticJoint {
    pub node: usize,
    /// Couple on the rod, along the directors, N m.
    pub couple: Vector3<f64>,
    /// Second derivative of the energy by a rotation of the frame, along the directors, N m;
    /// symmetric.
    pub stiffness: Matrix3<f64>,
}

/// A base whose position is unknown. A spring, whose force is zero at the start of each step, makes
/// the tangent regular.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FreeBase {
    /// Length of the rod, m. Displacements relative to it count as rotations in the size of a step.
    pub length: f64,
    /// Displacement of the base in a step that only contacts limit, m.
    pub reach: f64,
    /// Stiffness of the spring, N/m.
    pub stiffness: f64,
    /// Least share of the spring, and of the increases of pivots, that remains in a step.
    pub least: f64,
    /// Whether the spring is removed from the step completely. Holds and springs must then prevent
    /// all rigid motions.
    pub exact: bool,
}

/// Joints of a rod at the ends of its elements. By default there are none, and the base is clamped.
#[derive(Debug, Default, Clone)]
pub(super) struct Joints {
    /// Whether the frame of the base is unknown.
    pub base_rotates: bool,
    /// The base if its position is unknown, too.
    pub free_base: Option<FreeBase>,
    /// Frames with confined rotations: node, and the projection to the free directions along the
    /// directors.
    pub confined: Vec<(usize, Matrix3<f64>)>,
    pub elastic: Vec<ElasticJoint>,
    /// Unbalanced couples in the confined directions at the last balance, along the directors, N m.
    pub held: Vec<Vector3<f64>>,
}

impl Joints {
    /// The first node whose frame is unknown.
    pub fn first_free(&self) -> usize {
        usize::from(!self.base_rotates)
    }

    /// Adds the elastic joints to a tangent and confines its rotations.
    pub fn apply(&self, tangent: &mut Tangent) {
        for joint in self
            .elastic
            .iter()
            .filter(|joint| joint.node >= self.first_free())
        {
            tangent.add_diagonal(joint.node - self.first_free(), &joint.stiffness);
        }
        for (node, projection) in &self.confined {
            if *node >= self.first_free() {
                tangent.project(node - self.first_free(), projection);
            }
        }
    }

    /// Adds the couples of the elastic joints to the unbalanced couples on the frames, and removes
    /// the confined directions, whose couples are kept.
    pub fn release(&mut self, couples: &mut [Vector3<f64>]) {
        for joint in &self.elastic {
            couples[joint.node] += joint.couple;
        }
        if !self.base_rotates {
            couples
                .iter_mut()
                .take(1)
                .for_each(|couple| *couple = Vector3::zeros());
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
            couples
                .iter_mut()
                .take(1)
                .for_each(|couple| *couple = Vector3::zeros());
        }
        for (node, projection) in &self.confined {
            couples[*node] = projection * couples[*node];
        }
    }

    /// Moves the joints to other nodes.
    pub fn move_nodes(&mut self, moved: impl Fn(usize) -> usize) {
        self.confined
            .iter_mut()
            .for_each(|(node, _)| *node = moved(*node));
        self.elastic
            .iter_mut()
            .for_each(|joint| joint.node = moved(joint.node));
    }

    /// Number of confined directions among the unknowns.
    pub fn confined_directions(&self) -> usize {
        self.confined
            .iter()
            .map(|(_, projection)| (3.0 - projection.trace()).round() as usize)
            .sum()
    }
}
