//! Roots along parameters: onset, crossings and boundaries of stability, and their mesh refinement.

mod boundary;
mod crossing;
mod follow;
mod mesh_error;
mod onset;
mod refine_boundary;
mod refinement;

pub use boundary::{BoundarySettings, boundary};
pub use crossing::Crossing;
pub use onset::{crossings, onset};
pub use refinement::Refinement;
