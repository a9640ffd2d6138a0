//! Estimation of the parameters of a shoot from its tracked tip or centre lines.
//!
//! A [`Family`] is a function from parameters to a shoot. A [`Series`] is data. [`Fit::run`] searches the parameters
//! for which the simulated shoot is closest to the data, and returns [`Estimates`] with their confidence.

mod confidence;
mod error;
mod estimate;
mod family;
mod parallel;
mod parameter;
mod problem;
mod residuals;
mod search;
mod series;
mod settings;
mod starts;

pub use error::FitError;
pub use estimate::{Estimate, Estimates, Verdict, WeakDirection};
pub use family::Family;
pub use parameter::Parameter;
pub use search::Loss;
pub use series::{Series, View};
pub use settings::Fit;
