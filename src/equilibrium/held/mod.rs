//! Equilibria of rods with supports: holds, springs, elastic joints, and contacts with obstacles.
//!
//! An iteration factorises the tangent of the rod with the present contact forces as dead loads. The response of this
//! linear rod at its [candidates](candidate), the places that may touch an obstacle, is a small matrix. On it the
//! complete problem of unilateral contact with Coulomb friction is solved ([`reduced`]), with the exact shapes of the
//! obstacles. No set of contacts is guessed: which contacts are open, stick or slide is part of the solution. The step
//! is as long as the linear rod holds ([`attempt`]). Nodes of the rod follow the contacts ([`placement`]).

mod attempt;
mod before;
mod candidate;
mod candidates;
mod checks;
mod elastic;
mod ends;
mod inertia;
mod law;
mod line;
mod linear;
mod linearise;
mod mechanics;
mod merit;
mod motion;
mod nearby;
mod newton;
mod obstacles;
mod path;
mod placement;
mod press;
mod reactions;
mod reduced;
mod response;
mod saddle;
mod search;
mod settings;
mod sites;
mod solve;
mod spread;
mod step;
mod trial;

pub(super) use mechanics::body_of;
pub(super) use search::{Found, HeldSearch};
