//! The spectrum of one linearisation.

mod analytic;
mod block;
mod characteristic;
mod count;
mod forced;
mod linearisation;
mod modes;
mod parts;
mod roots;
mod sets;
mod steady_state;
mod transfer;

pub use forced::ForcedResponse;
pub use linearisation::{Linearisation, Unstable};
pub use modes::{Polarisation, Root};
pub(super) use parts::{Found, Part};
pub use steady_state::{SteadyState, SteadyStateSolver};
