//! The return map, which maps a state of a shoot to the state one period later, and its derivative,
//! the monodromy operator.

mod grid;
mod growth_zone;
mod monodromy;
mod phase_state;
mod polynomials;
mod return_map;
mod rotation;

pub(super) use grid::{TimeGrid, kept};
pub(super) use growth_zone::{ROUNDING, check_gradients, driven_points};
pub(super) use monodromy::Monodromy;
pub(super) use phase_state::{PhaseState, bends};
pub(super) use polynomials::{Polynomials, carried};
pub(super) use return_map::{CONVERGED, PASSES, PRECISE, ReturnMap, Stage, Trajectory};
pub(super) use rotation::StateRotation;
