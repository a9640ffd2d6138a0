//! The return map: a state of a shoot in, the state one period later out, and its derivative.

pub(super) mod grid;
pub(super) mod monodromy;
pub(super) mod phase_state;
pub(super) mod return_map;
pub(super) mod rotation;
