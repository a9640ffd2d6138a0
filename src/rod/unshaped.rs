//! Data of a rod that do not describe its shape.

use nalgebra::{UnitQuaternion, Vector3};

use super::{MaterialPoint, Rod};

/// Copy of all data of a rod that a solver of equilibria must not change: elements, material and base.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unshaped {
    points: Vec<MaterialPoint>,
    node_distance: Vec<f64>,
    kept: Vec<bool>,
    first_growing: usize,
    base: (UnitQuaternion<f64>, Vector3<f64>),
}

impl Unshaped {
    /// Copies the data of a rod into the memory of the last copy, with or without the material points.
    pub fn keep(&mut self, rod: &Rod, points: bool) {
        self.points.clear();
        self.points.extend_from_slice(if points { &rod.points } else { &[] });
        self.node_distance.clone_from(&rod.node_distance);
        self.kept.clone_from(&rod.kept);
        (self.first_growing, self.base) = (rod.first_growing, (rod.frames[0], rod.base_position));
    }

    /// Returns the name of the first data in which a rod differs from the copy.
    pub fn changed(&self, rod: &Rod) -> Option<&'static str> {
        let points = self.points.is_empty() || rod.points == self.points;
        let zone = rod.node_distance == self.node_distance && rod.first_growing == self.first_growing;
        let same = [
            ("the elements", rod.node_distance.len() == self.node_distance.len() && rod.kept == self.kept),
            ("the growth zone", zone),
            ("the material points", points),
            ("the base", (rod.frames[0], rod.base_position) == self.base),
        ];
        same.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
    }
}
