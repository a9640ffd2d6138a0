//! Options of a run.

use crate::equilibrium::{Equilibrium, check_tolerance};
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, zone_elongation};
use crate::integrator::IntegrationError;
use crate::integrator::error::{MAX_ZONES, Outcome};
use crate::model::{Load, Model, TropismLaw, next_discontinuity};
use crate::scene::after;
use crate::shoot::{Mesh, Shoot};

/// Default of the largest number of corrections of a step. A contraction by two in each correction
/// gains 2⁻³⁰ = 1e-9. With a slower contraction the step is too long.
pub(in crate::integrator) const MAX_CORRECTIONS: usize = 30;

/// Largest number of steps up to the end of a call. The shortest steps take some microseconds, so
/// that more of them take hours: the unit of the step or of the end is wrong.
const MOST_STEPS: f64 = 1e9;

/// Number of intervals in time on which the growth of a call is integrated.
const GROWTH_PIECES: u32 = 64;

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
    /// Largest number of times that a step is repeated with half its length after a recoverable
    /// error.
    pub retries: usize,
    /// Largest change of an angle in the last correction of a step, rad.
    pub tolerance: f64,
    /// Largest number of corrections of a step.
    pub max_corrections: usize,
    /// Longest element and merge tolerance.
    pub mesh: Mesh,
    /// Longest step of the coarsest of several compared runs, s. Steps in short intervals and fast
    /// transients are reduced in proportion to `step` over this length, so that all steps of these
    /// runs differ.
    pub coarsest_step: Option<f64>,
    /// Equilibrium at the start of the run, if the shoot without a history is already in
    /// equilibrium.
    pub known: Option<Equilibrium>,
}

impl RunOptions {
    /// Returns an error unless the settings are valid and the end of the run is not in the past of
    /// the shoot.
    pub fn check(&self, shoot: &Shoot<impl Model>) -> Result<(), ParameterError> {
        ParameterError::positive("time step", self.step, "s")?;
        check_tolerance("tolerance of the corrections", self.tolerance)?;
        check_ahead("time to advance to", shoot, self.until)?;
        // Each step has work.
        let steps =
            ((self.until - shoot.time()) / self.step).min(self.max_steps.min(self.max_work) as f64);
        let requirement = "such that a call has at most 1e9 steps up to its end (s)";
        ParameterError::unless(steps <= MOST_STEPS, "time step", self.step, requirement)?;
        if self.max_steps == usize::MAX {
            check_discontinuities(shoot, self.until)?;
        }
        let (step, period) = (
            self.step.min(self.until - shoot.time()),
            shortest_period(shoot)?,
        );
        let requirement =
            "or more, twice the time step: take shorter steps, which show the period (s)";
        // `Adaptive` limits its first step, and compares runs with different steps.
        let ok = self.coarsest_step.is_some() || step <= 0.5 * period;
        ParameterError::unless(ok, PERIOD, period, requirement).map_err(|error| ParameterError {
            needed: Some(2.0 * step),
            ..error
        })
    }
}

/// Name of the shortest period in errors.
const PERIOD: &str = "shortest period of the laws";

/// Returns the shortest period that the tropism or the load declares, s.
///
/// # Errors
/// A period that is not positive.
pub(crate) fn shortest_period(shoot: &Shoot<impl Model>) -> Result<f64, ParameterError> {
    let periods = [
        shoot.model().tropism().shortest_period(),
        shoot.model().load().shortest_period(shoot.time()),
    ];
    for period in periods {
        ParameterError::unless(
            period > 0.0,
            PERIOD,
            period,
            "positive, and infinite if they have none (s)",
        )?;
    }
    Ok(periods[0].min(periods[1]))
}

/// Number of discontinuities that are examined at the start of a call. Fewer may be close to each
/// other by chance.
const EXAMINED: usize = 100;

/// Returns an error if the number of steps to the time `until` (s) exceeds [`MOST_STEPS`], since
/// steps end at all discontinuities that the laws announce.
fn check_discontinuities(shoot: &Shoot<impl Model>, until: f64) -> Result<(), ParameterError> {
    let (now, shortest) = (shoot.time(), (until - shoot.time()) / MOST_STEPS);
    let mut time = now;
    for number in 1..=EXAMINED {
        time = next_discontinuity(shoot.model(), after(time))?;
        if time - now >= number as f64 * shortest {
            return Ok(());
        }
    }
    let (name, interval) = (
        "time between discontinuities that a law announces",
        (time - now) / EXAMINED as f64,
    );
    let requirement =
        "such that a call has at most 1e9 of them (s): does the law announce times without end?";
    Err(ParameterError::refused(name, interval, requirement))
}

/// Returns an error if a shoot grows by more than [`MAX_ZONES`] up to the time `until` (s). The
/// growth is integrated only if the present rate suggests it.
pub(crate) fn check_growth(shoot: &Shoot<impl Model>, until: f64) -> Outcome {
    let (growth, from) = (shoot.model().growth(), shoot.time());
    let zone = growth.zone_length();
    if !(growth.elongates()
        && growth.apical_speed(zone, after(from)) * (until - from) > MAX_ZONES * zone)
    {
        return Ok(());
    }
    let zones = zone_elongation(growth, from, until, GROWTH_PIECES) / zone;
    if zones > MAX_ZONES {
        Err(IntegrationError::GrowsTooFar { from, until, zones })
    } else {
        Ok(())
    }
}

/// Returns an error unless `until` (s) is finite and not in the past of the shoot.
pub(crate) fn check_ahead(
    name: &'static str,
    shoot: &Shoot<impl Model>,
    until: f64,
) -> Result<(), ParameterError> {
    let ahead = until >= shoot.time() && until.is_finite();
    ParameterError::unless(ahead, name, until, "finite and not in the past (s)")
}
