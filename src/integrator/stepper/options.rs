//! Options of a run.

use crate::equilibrium::Equilibrium;
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::{Mesh, Shoot};

/// Default of the largest number of corrections of a step. A contraction by two in each correction gains 2⁻³⁰ =
/// 1e-9. With a slower contraction the step is too long.
pub(in crate::integrator) const MAX_CORRECTIONS: usize = 30;

/// Largest number of steps up to the end of a call. The shortest steps take some microseconds, so that more of them
/// take hours: the unit of the step or of the end is wrong.
const MOST_STEPS: f64 = 1e9;

/// End, step size and settings of a run.
#[derive(Debug, Clone, Copy)]
pub(in crate::integrator) struct RunOptions {
    /// End of the run, s.
    pub until: f64,
    /// Longest step, s.
    pub step: f64,
    /// Largest number of steps.
    pub max_steps: usize,
    /// Largest [`work`](super::Statistics::work).
    pub max_work: usize,
    /// Largest number of times that a step is repeated with half its length after a recoverable error.
    pub retries: usize,
    /// Largest change of an angle in the last correction of a step, rad.
    pub tolerance: f64,
    /// Largest number of corrections of a step.
    pub max_corrections: usize,
    /// Longest element and merge tolerance.
    pub mesh: Mesh,
    /// Longest step of the coarsest of several compared runs, s. Steps in short intervals and fast transients
    /// are reduced in proportion to `step` over this length, so that all steps of these runs differ.
    pub coarsest_step: Option<f64>,
    /// Equilibrium at the start of the run, if the shoot without a history is already in equilibrium.
    pub known: Option<Equilibrium>,
}

impl RunOptions {
    /// Returns an error unless the settings are valid and the end of the run is not in the past of the shoot.
    pub fn check(&self, shoot: &Shoot<impl Model>) -> Result<(), ParameterError> {
        ParameterError::positive("time step", self.step, "s")?;
        ParameterError::positive("tolerance of the corrections", self.tolerance, "rad")?;
        check_ahead("time to advance to", shoot, self.until)?;
        // Each step has work.
        let steps = ((self.until - shoot.time()) / self.step).min(self.max_steps.min(self.max_work) as f64);
        let requirement = "such that a call has at most 1e9 steps up to its end (s)";
        ParameterError::unless(steps <= MOST_STEPS, "time step", self.step, requirement)
    }
}

/// Returns an error unless `until` (s) is finite and not in the past of the shoot.
pub(in crate::integrator) fn check_ahead(
    name: &'static str,
    shoot: &Shoot<impl Model>,
    until: f64,
) -> Result<(), ParameterError> {
    let ahead = until >= shoot.time() && until.is_finite();
    ParameterError::unless(ahead, name, until, "finite and not in the past (s)")
}
