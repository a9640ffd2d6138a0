#![forbid(unsafe_code)]
//! morphorod
mod basis;
pub mod constitutive;
pub mod equilibrium;
mod error;
pub mod growth;
pub mod integrator;
pub mod load;
pub mod quadrature;
pub mod rod;
mod scene;
mod shoot;
pub mod so3;
mod state;
pub mod tropism;
pub use basis::Order;
pub use error::ParameterError;
pub use scene::{Moment, Scene, Still};
pub use shoot::{Mesh, Shoot, ShootBuilder};
pub use state::State;
