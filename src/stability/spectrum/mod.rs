//! The spectrum of one linearisation.

mod analytic;
mod block;
mod characteristic;
mod count;
mod linearisation;
mod motion;
mod parts;
mod roots;
mod sets;
mod steady_state;
mod transfer;

pub use linearisation::Linearisation;
pub use motion::{ForcedResponse, Root};
pub(super) use parts::{PartRoot, SpectrumPart};
pub use steady_state::solve_steady_state;
