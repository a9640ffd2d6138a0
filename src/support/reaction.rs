//! Reactions of supports.

use nalgebra::Vector3;

/// Whether the shoot slides over an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Slip {
    /// The place has not moved relative to the obstacle in the last increment. Its friction may
    /// still be at the limit.
    Sticks,
    /// The place has moved over the obstacle in the last increment.
    Slides,
}

/// Force and couple of a support on a shoot at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Reaction {
    /// Arc length s of the place from the base, m.
    pub arc_length: f64,
    /// Distance of the place from the apex at t = 0, m, which identifies it.
    pub initial_apex_distance: f64,
    /// Force on the shoot in the fixed frame, N.
    pub force: Vector3<f64>,
    /// Couple on the shoot in the fixed frame, N m.
    pub couple: Vector3<f64>,
    /// Length of the shoot over which a distributed force is gathered at the place, m; zero for a
    /// force at a point.
    pub length: f64,
    /// Index of the obstacle among those of the support; `None` for a hold.
    pub obstacle: Option<usize>,
    /// Index of the touched surface among those of the obstacle; zero for a hold and for an
    /// obstacle of one surface.
    pub surface: usize,
    /// Normal part of the force, N; zero for a hold.
    pub normal: f64,
    /// Whether the place slides over the obstacle; `None` without friction and for a hold.
    pub slip: Option<Slip>,
}

/// A part of a rod in contact with an obstacle, by arc lengths (m). A contact at a point has equal
/// ends.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Patch {
    /// Index of the obstacle among those of the support. Inside a search, index of the surface
    /// among all surfaces.
    pub obstacle: usize,
    /// Index of the surface among those of the obstacle.
    pub surface: usize,
    pub from: f64,
    pub to: f64,
}
