//! First-order changes of the laws and stimuli of a shoot in equilibrium, for
//! [`stability`](crate::stability) and [`cycle`](crate::cycle).

mod analytic;
mod autonomous;
mod bends;
mod error;
mod statics;
mod steady;
mod stimuli;
mod support;

pub(crate) use analytic::{AnalyticMatrix, eigenvalues, newton, newton_step};
pub(crate) use autonomous::{change_of_base, change_of_causes, check_autonomous};
pub(crate) use bends::{precise_solver, visit_bends};
pub(crate) use error::MOST_RESOLVED_ELEMENTS;
pub(crate) use error::Outcome;
pub use error::StabilityError;
pub(crate) use statics::equilibrate;
pub(crate) use steady::{SteadyLaws, check_steady};
pub(crate) use stimuli::{stimulus_derivatives, visit_stimuli};
pub(crate) use support::rigid_conditions;
