//! The return map: a state of a shoot in, the state one period later out, and its derivative.

pub(super) mod grid;
pub(super) mod march;
pub(super) mod state;
pub(super) mod turn;
pub(super) mod variation;
