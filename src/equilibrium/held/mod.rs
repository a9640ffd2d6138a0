//! Equilibria of rods with supports.
//!
//! The reactions are unknowns beside the rotations. The tangent of the rotations keeps its block tridiagonal form; each
//! direction in which a support acts adds a row and a column to its border.

mod arrange;
mod before;
mod border;
mod checks;
mod conditions;
mod contact;
mod contact_step;
mod correct;
mod data;
mod dense;
mod descent;
pub(super) mod elastic;
mod energy;
pub(super) mod foundation;
mod friction;
mod nearby;
mod patches;
mod path;
mod reactions;
mod response;
mod saddle;
mod search;
pub(super) mod sites;
mod soft;
pub(super) mod spread;
mod touch;
mod yielding;

pub(super) use data::{Found, HeldSearch, HeldWorkspace};
