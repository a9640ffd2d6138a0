//! The rod and its contacts before an increment.

use nalgebra::Vector3;

use super::sites::Friction;
use super::touch::{Obstacles, place, starts};
use crate::rod::Rod;

/// The rod at the end of the increment before.
pub(super) struct Before<'a> {
    pub rod: &'a Rod,
    /// Tangents ∂p/∂s of its centre line at the material points.
    tangents: Vec<Vector3<f64>>,
    /// Positions of the starts of its elements, m.
    starts: Vec<Vector3<f64>>,
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
    /// Normal force, N.
    pub push: f64,
    /// Friction; `None` without.
    pub friction: Option<Friction>,
}

impl<'a> Before<'a> {
    pub fn new(rod: &'a Rod, time: f64, yielded: Vec<Vector3<f64>>) -> Self {
        let points = rod.order().points();
        let tangent = |(e, g)| rod.frame_at_point(e, g) * rod.line_strain_at_point(e, g);
        let tangents: Vec<_> = (0..rod.points().len()).map(|i| tangent((i / points, i % points))).collect();
        // The slip of a contact at rest is exactly zero, since its place is computed in the same way.
        let starts = starts(rod, &tangents);
        Self { rod, tangents, starts, time, yielded }
    }

    /// The place (m) that material would have if it had moved with an obstacle since then. The material is given by its
    /// distance from the apex at t = 0 (m).
    pub fn anchor(&self, initial_apex_distance: f64, obstacles: &Obstacles, obstacle: usize) -> Vector3<f64> {
        let Some((e, x)) = self.rod.locate_initial(initial_apex_distance) else { return Vector3::repeat(f64::NAN) };
        let position = place(self.rod, &self.tangents, (e, x), 0.0, &self.starts[e]).position;
        let velocity = obstacles.contacts[obstacle].obstacle.velocity(&position, obstacles.time);
        let moved = position + velocity * self.time + obstacles.yielded[obstacle] - self.yielded[obstacle];
        // The projection to the surface removes displacements along the normal before the contact.
        let gap = obstacles.gap(obstacle, &moved);
        moved - gap.normal * gap.value
    }
}
