//! Where a run goes, and by which steps.

use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::{Mesh, Shoot};

/// A step whose corrections need more is too long.
pub(super) const CORRECTIONS: usize = 30;

/// How often and how closely a step is repeated with what it led to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    /// Largest change of an angle that ends the repetition, rad.
    pub tolerance: f64,
    /// Bound on the repetitions.
    pub most: usize,
}

/// An interval of time, and how many growing elements leave the zone in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub from: f64,
    pub to: f64,
    pub leaving: usize,
    /// From when to when growth is read, s: after a discontinuity at the start, and before one at the end.
    pub growth: [f64; 2],
}

/// Where a run goes: to a time, in steps of at most a size, in so many of them at most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// s.
    pub until: f64,
    /// s.
    pub size: f64,
    pub most_steps: usize,
    /// How often a step that failed may be tried again with half its length.
    pub retries: usize,
    pub correction: Option<Correction>,
    /// How fine the elements are kept on the way.
    pub mesh: Mesh,
    /// The step of the coarsest of several runs that are compared, s; zero for a run alone. Short intervals and fast transients
    /// are divided more finely in the proportion of `size` to it, so that these runs differ everywhere.
    pub coarsest: f64,
}

/// Refuses a time to go to that lies in the past of a shoot, or nowhere.
pub(super) fn check_ahead(name: &'static str, shoot: &Shoot<impl Model>, until: f64) -> Result<(), ParameterError> {
    let ahead = until >= shoot.time() && until.is_finite();
    ParameterError::unless(ahead, name, until, "finite and not in the past (s)")
}
