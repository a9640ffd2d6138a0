//! Roots along parameters: onset, crossings and boundaries of stability, and their mesh refinement.

mod boundary;
mod follow;
mod mesh_error;
mod onset;
mod refine_boundary;
mod refine_crossings;
mod refinement;

pub use boundary::{BoundaryPoint, BoundarySettings, boundary};
pub use onset::{Onset, crossings, onset};
pub use refine_boundary::RefinedPoint;
pub use refinement::Refinement;
