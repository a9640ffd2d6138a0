//! Rods that are read: what is not a rod is an error.

use nalgebra::{UnitQuaternion, Vector3};

use super::loss::Loss;
use super::{MaterialPoint, Rod, RodError};
use crate::reference_element::Order;

/// A [`Rod`] before it has been checked.
#[derive(serde::Deserialize)]
pub(super) struct SavedRod {
    order: Order,
    frames: Vec<UnitQuaternion<f64>>,
    rotations: Vec<Vector3<f64>>,
    line_strains: Vec<Vector3<f64>>,
    points: Vec<MaterialPoint>,
    node_distance: Vec<f64>,
    initial_length: f64,
    kept: Vec<bool>,
    first_growing: usize,
    loss: Vec<Loss>,
}

impl TryFrom<SavedRod> for Rod {
    type Error = RodError;

    fn try_from(saved: SavedRod) -> Result<Self, RodError> {
        let rod = Self {
            order: saved.order,
            frames: saved.frames,
            rotations: saved.rotations,
            line_strains: saved.line_strains,
            points: saved.points,
            node_distance: saved.node_distance,
            initial_length: saved.initial_length,
            kept: saved.kept,
            first_growing: saved.first_growing,
            loss: saved.loss,
        };
        rod.check()?;
        Ok(rod)
    }
}
