//! The rod and its contacts before an increment.

use nalgebra::Vector3;

use super::touch::Obstacles;
use crate::rod::Rod;

/// The rod at the end of the increment before.
pub(super) struct Before<'a> {
    pub rod: &'a Rod,
    /// Positions of the ends of its elements, m.
    nodes: Vec<Vector3<f64>>,
    /// Time since the end of that increment, s.
    time: f64,
    /// Displacements of the obstacles by the forces on them, m.
    yielded: Vec<Vector3<f64>>,
}

/// A contact of an earlier equilibrium.
#[derive(Debug, Clone, Copy)]
pub(super) struct OldTouch {
    pub obstacle: usize,
    pub arc_length: f64,
    pub push: f64,
    pub force: Vector3<f64>,
    /// Whether it slid in the increment before.
    pub slid: bool,
}

impl<'a> Before<'a> {
    pub fn new(rod: &'a Rod, time: f64, yielded: Vec<Vector3<f64>>) -> Self {
        Self { rod, nodes: rod.centre_line().into_iter().map(|(_, position)| position).collect(), time, yielded }
    }

    /// The place that material would have if it had moved with an obstacle since the end of the increment before, m.
    /// The material is given by its distance from the apex at t = 0 (m).
    pub fn anchor(&self, initial_apex_distance: f64, obstacles: &Obstacles, obstacle: usize) -> Vector3<f64> {
        let Some((e, x)) = self.rod.locate_initial(initial_apex_distance) else { return Vector3::repeat(f64::NAN) };
        let position = self.nodes[e] + self.rod.chord(e, x);
        let velocity = obstacles.contacts[obstacle].obstacle.velocity(&position, obstacles.time);
        let moved = position + velocity * self.time + obstacles.yielded[obstacle] - self.yielded[obstacle];
        // The projection to the surface removes displacements along the normal before the contact.
        let gap = obstacles.gap(obstacle, &moved);
        moved - gap.normal * gap.value
    }
}
