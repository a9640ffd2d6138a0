//! Candidates: parts of a rod that may touch an obstacle in a step.

use nalgebra::{Matrix3, Vector3};

use super::law::{Gap, Status};

/// A candidate with its force.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    pub obstacle: usize,
    pub element: usize,
    pub x: f64,
    /// Whether the candidate is a contact point, which is where the gap is least. Otherwise it is a
    /// station of a contact segment.
    pub point: bool,
    /// Whether the place of the candidate moves along the rod so that the gap stays least.
    pub follows_gap: bool,
    /// Third derivative of the gap along the rod by the force on it, 1/m²: the force over the
    /// bending stiffness.
    pub flexibility: f64,
    /// Whether the candidate has been in contact during the search. Its node then remains, since a
    /// contact may exist on a rod with the node and not on one without it.
    pub touched: bool,
    /// Force on the rod, N.
    pub force: Vector3<f64>,
    pub status: Status,
    /// Arc length, m.
    pub arc_length: f64,
    /// Position, m.
    pub position: Vector3<f64>,
    pub gap: Gap,
    /// Director d3, the tangent of a rod without shear, and its derivative along the rod, 1/m.
    pub tangent: Vector3<f64>,
    pub bend: Vector3<f64>,
    /// The place without slip, m, and its derivative along the rod.
    pub anchor: (Vector3<f64>, Vector3<f64>),
}

/// Largest penetration at candidates, m.
pub(super) fn deepest(candidates: &[Candidate]) -> f64 {
    candidates
        .iter()
        .map(|at| -at.gap.value)
        .fold(0.0, f64::max)
}

impl Candidate {
    /// A candidate without force at an arc length (m).
    pub fn at(obstacle: usize, arc_length: f64, (element, x): (usize, f64), point: bool) -> Self {
        let zero = Vector3::zeros();
        let gap = Gap {
            value: 0.0,
            normal: zero,
            curvature: Matrix3::zeros(),
        };
        Self {
            obstacle,
            element,
            x,
            point,
            follows_gap: false,
            flexibility: 0.0,
            touched: false,
            force: zero,
            status: Status::Open,
            arc_length,
            position: zero,
            gap,
            tangent: zero,
            bend: zero,
            anchor: (zero, zero),
        }
    }

    /// Normal force, N.
    pub fn normal(&self) -> f64 {
        self.gap.normal.dot(&self.force)
    }

    /// First (1) and second (1/m) derivative of the gap along the rod.
    pub fn approach(&self) -> (f64, f64) {
        let Gap {
            normal, curvature, ..
        } = &self.gap;
        let bend = normal.dot(&self.bend) + self.tangent.dot(&(curvature * self.tangent));
        (normal.dot(&self.tangent), bend)
    }

    /// Tangential displacement since the start of the increment, m.
    pub fn slip(&self, yielded: &Vector3<f64>) -> Vector3<f64> {
        let moved = self.position - yielded - self.anchor.0;
        moved - self.gap.normal * self.gap.normal.dot(&moved)
    }
}
