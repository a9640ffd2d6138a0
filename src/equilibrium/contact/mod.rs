//! Equilibria of rods in contact, by a contact problem in each iteration.
//!
//! An iteration factorises the tangent of the rod with the present contact forces as dead loads. The response of this
//! linear rod at its [candidates](candidate), the places that may touch an obstacle, is a small matrix. On it the
//! complete problem of unilateral contact with Coulomb friction is solved ([`reduced`]), with the exact shapes of the
//! obstacles. No set of contacts is guessed: which contacts are open, stick or slide is part of the solution. The
//! step is
//! as long as the linear rod holds ([`attempt`]). Nodes of the rod follow the contacts ([`placement`]).
//!
//! [`super::held`] searches first. This method finds the equilibria that it does not find.

mod attempt;
mod before;
mod candidate;
mod candidates;
mod inertia;
mod law;
mod linear;
mod linearise;
mod local;
mod mechanics;
mod merit;
mod newton;
mod obstacles;
mod path;
mod placement;
mod reactions;
mod reduced;
mod response;
mod saddle;
mod search;
mod settings;
mod step;
mod sweeps;
mod trial;

pub(super) use mechanics::body_of;
pub(super) use search::{ContactSearch, Found};
