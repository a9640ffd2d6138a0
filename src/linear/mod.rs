//! Laws and stimuli of a shoot in equilibrium, to first order: what [`stability`](crate::stability) and
//! [`cycle`](crate::cycle) have in common.

mod analytic;
mod autonomous;
mod bends;
mod error;
mod steady;
mod stimuli;

pub(crate) use analytic::{AnalyticMatrix, newton, newton_step};
pub(crate) use autonomous::{change_of_causes, check_autonomous, relative};
pub(crate) use bends::{precise_solver, visit_bends};
pub(crate) use error::LawError;
pub(crate) use steady::{SteadyLaws, check_steady};
pub(crate) use stimuli::{stimulus_derivatives, visit_stimuli};
