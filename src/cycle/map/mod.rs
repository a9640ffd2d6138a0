//! The return map, which maps a state of a shoot to the state one period later, and its derivative, the monodromy
//! operator.

pub(super) mod grid;
pub(super) mod growth_zone;
pub(super) mod monodromy;
pub(super) mod past;
pub(super) mod phase_state;
pub(super) mod polynomials;
pub(super) mod return_map;
pub(super) mod rotation;
