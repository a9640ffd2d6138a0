#![forbid(unsafe_code)]
//! morphorod
mod basis;
pub mod constitutive;
pub mod equilibrium;
mod error;
pub mod load;
pub mod quadrature;
pub mod rod;
mod scene;
pub mod so3;
pub use basis::Order;
pub use error::ParameterError;
pub use scene::{Moment, Scene, Still};
