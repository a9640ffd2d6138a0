//! The rod at the start of an increment, from which friction counts slip.

use nalgebra::{UnitQuaternion, Vector3};

use super::line::Line;
use super::obstacles::Obstacles;
use super::reduced::Surfaces;
use crate::rod::Rod;

/// The rod at the start of an increment.
#[derive(Clone)]
pub(super) struct Before {
    pub rod: Rod,
    /// Its centre line.
    line: Line,
    /// Time since then, s.
    pub time: f64,
    /// Displacements of the obstacles by the forces on them, m.
    yielded: Vec<Vector3<f64>>,
}

impl Before {
    pub fn new(rod: &Rod, time: f64, yielded: Vec<Vector3<f64>>) -> Self {
        let points = rod.order().points();
        let tangent = |(e, g): (usize, usize)| {
            let frame: UnitQuaternion<f64> = rod.frame_at_point(e, g);
            frame * rod.line_strain_at_point(e, g)
        };
        let tangents = (0..rod.points().len()).map(|i| tangent((i / points, i % points))).collect();
        // The slip of a contact at rest is exactly zero, since its place is computed in the same way.
        let line = Line::new(rod, tangents);
        Self { rod: rod.clone(), line, time, yielded }
    }

    /// The place (m) that material would have if it had moved with an obstacle since then, and the tangent of the rod.
    /// The material is given by its distance from the apex at t = 0 (m).
    fn place(&self, material: f64, obstacles: &Obstacles, obstacle: usize) -> (Vector3<f64>, Vector3<f64>) {
        let Some((e, x)) = self.rod.locate_initial(material) else {
            return (Vector3::repeat(f64::NAN), Vector3::zeros());
        };
        let position = self.line.place(&self.rod, (e, x)).position;
        let velocity = obstacles.contacts[obstacle].obstacle.velocity(&position, obstacles.time);
        let moved = position + velocity * self.time - self.yielded[obstacle];
        (moved, self.rod.frame_within(e, x) * Vector3::z())
    }

    /// The place without slip (m) of material on the surface of an obstacle, and its derivative along the rod.
    pub fn anchor(&self, material: f64, (obstacles, obstacle): (&Obstacles, usize)) -> (Vector3<f64>, Vector3<f64>) {
        let (place, tangent) = self.place(material, obstacles, obstacle);
        // The projection to the surface removes displacements along the normal.
        let gap = obstacles.gap(obstacle, &place);
        (place - gap.normal * gap.value, tangent - gap.normal * gap.normal.dot(&tangent))
    }
}
