//! The end of the next step.

use super::{FIRST_STEP, IntegrationError, MAX_PARTS, ORDER, ROUNDING, RunOptions};
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::{Model, next_discontinuity};
use crate::scene::{after, before};
use crate::shoot::Shoot;
use crate::state::CLOSE;
use crate::tropism::Declaration;

/// Number of equal steps before a breaking point: interpolation reaches across that many. Behind it there is one less.
pub(super) const EQUAL_STEPS: f64 = (ORDER - 1) as f64;

/// First step over the rise time of a variable. A cubic through four levels that are this close follows an exponential.
const STEP_OVER_RISE: f64 = 0.25;

/// The end of a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::integrator) struct StepEnd {
    /// Time, s.
    pub time: f64,
    /// Whether something has a discontinuity there.
    pub discontinuity: bool,
    /// Whether a delayed variable passes a discontinuity of the past there (breaking point). The path then has a discontinuous second
    /// derivative.
    pub kink: bool,
}

impl StepEnd {
    /// Time at which laws are read at the end of the step, s: before a discontinuity.
    pub fn before(&self) -> f64 {
        if self.discontinuity { before(self.time) } else { self.time }
    }
}

/// Returns whether something has a discontinuity at the start of a run.
pub(super) fn starts_at_discontinuity(shoot: &Shoot<impl Model>) -> Result<bool, ParameterError> {
    let start = shoot.state.time;
    Ok(next_discontinuity(&shoot.model, before(start))? <= after(start))
}

/// Returns the last breaking point up to the present, and the next one, s. At a breaking point a delayed variable passes a discontinuity of
/// the past, and differential growth has a kink. After another delay the kink is smoother by two orders, and is neglected.
///
/// A step ends there, and the steps around it are equal, so that the third-order errors of interpolation across the kink on either side
/// cancel.
fn breaking_points(shoot: &Shoot<impl Model>, laws: &Declaration, size: f64) -> (f64, f64) {
    let (close, delays) = (CLOSE * size, || laws.delays().filter(|delay| *delay > 0.0));
    let times = || shoot.state.history.discontinuities().map(|level| shoot.state.history.time(level));
    let points = || times().flat_map(|time| delays().map(move |delay| time + delay));
    let now = shoot.state.time + close;
    let last = points().filter(|point| *point <= now).fold(f64::NEG_INFINITY, f64::max);
    let next = points().filter(|point| *point > now).fold(f64::INFINITY, f64::min);
    // Merge breaking points closer than the tolerance into the last of them.
    (last, points().filter(|point| *point <= next + close).fold(next, f64::max))
}

/// Returns the shortest time in which a variable, at its rate at a level behind a discontinuity, reaches its stimulus, s.
fn shortest_rise(shoot: &Shoot<impl Model>, laws: &Declaration, level: usize) -> f64 {
    let rises = laws.variables().iter().enumerate().map(|(i, variable)| {
        let (value, rate) = shoot.state.history.largest(level, i);
        // The stimulus is x = y + τ ẏ.
        variable.time_constant + value / rate
    });
    // The rise time of a variable that stays zero is NaN.
    rises.filter(|time| *time > 0.0).fold(f64::INFINITY, f64::min)
}

/// Returns whether differential growth changes within a step behind a breaking point (s), since a variable did a delay earlier. Such a
/// breaking point is treated as a discontinuity. The longest step of all runs that are compared decides, so that a run with shorter steps
/// does not have the larger error.
fn is_sharp(shoot: &Shoot<impl Model>, laws: &Declaration, options: &RunOptions, time: f64) -> bool {
    let (history, close) = (&shoot.state.history, CLOSE * options.step);
    let at = |level: &usize| laws.delays().any(|delay| (history.time(*level) + delay - time).abs() <= close);
    let longest = options.coarsest_step.map_or(options.step, |coarsest| coarsest.max(options.step));
    history.discontinuities().filter(at).any(|level| shortest_rise(shoot, laws, level) < longest)
}

/// Returns the longest step that growth permits, s. The tissue that leaves the zone in one step becomes one element, which must not be
/// longer than the longest element.
///
/// # Errors
/// The step would be divided into more than [`MAX_PARTS`].
fn longest_step(shoot: &Shoot<impl Model>, options: &RunOptions) -> Result<f64, IntegrationError> {
    let &RunOptions { until, step: size, mesh, .. } = options;
    let (t, growth) = (shoot.state.time, shoot.model.growth());
    let zone = growth.zone_length();
    if !(growth.elongates() && zone.is_finite()) {
        return Ok(size);
    }
    // Largest distance of growing tissue from the apex. The zone may be longer than the shoot.
    let rod = &shoot.state.rod;
    let reach = rod.node_distances()[rod.first_growing().min(rod.elements())].min(zone);
    let shortest = size.min(until - t) / MAX_PARTS;
    let mut step = size;
    while step > shortest && reach - growth.flow(zone, t + step, t).0 > mesh.longest_element {
        step *= 0.5;
    }
    // No element may be stretched to more than about twice its length before it can be cut.
    let rate = (growth.apical_speed(reach, t) / reach).max(growth.apical_speed(zone, t) / zone);
    if rate > 0.0 {
        step = step.min(std::f64::consts::LN_2 / rate);
    }
    if step > shortest { Ok(step) } else { Err(IntegrationError::GrowsTooFast { time: t, step: size }) }
}

/// Returns the longest step in an interval between two discontinuities or breaking points (s) for which runs that are compared have
/// different steps, s.
///
/// Without this bound a step close behind a discontinuity depends only on the time since then, and the difference of two runs does not
/// contain the error of such steps. An interval that is not longer than rounding has no such bound: its end is the end of the step.
fn longest_to_compare(
    shoot: &Shoot<impl Model>,
    options: &RunOptions,
    interval: f64,
    rise: impl FnOnce() -> f64,
) -> f64 {
    let size = options.step;
    let Some(coarsest) = options.coarsest_step.filter(|_| interval > CLOSE * size) else { return f64::INFINITY };
    let fineness = size / coarsest;
    let since = shoot.state.time - shoot.state.smooth_since;
    // The coarsest run makes two steps in a shorter interval.
    let scale = if interval < coarsest * (1.0 - ROUNDING) { 0.5 * interval } else { coarsest };
    let mut longest = fineness * scale * (since / (2.0 * scale)).sqrt().clamp(FIRST_STEP, 1.0);
    if since < size {
        // A transient that is faster than a step.
        let rise = rise();
        if rise < size {
            longest = longest.min(fineness * since.max(STEP_OVER_RISE * rise));
        }
    }
    longest
}

/// Returns the end of the next step.
pub(super) fn next_step_end(
    shoot: &Shoot<impl Model>,
    laws: &Declaration,
    options: &RunOptions,
) -> Result<StepEnd, IntegrationError> {
    let (t, until, size) = (shoot.state.time, options.until, options.step);
    // Discontinuities within rounding of each other are one.
    let passed = t == shoot.state.smooth_since;
    let discontinuity = next_discontinuity(&shoot.model, if passed { after(t) } else { t })?;
    ParameterError::unless(
        !passed || discontinuity > after(after(t)),
        "discontinuity that a law announces",
        discontinuity,
        "further from the one before it than rounding (s): are there announcements without end?",
    )?;
    // Times that agree up to rounding are one, whatever the unit of time.
    let discontinuity =
        if discontinuity > before(until) && discontinuity < after(until) { until } else { discontinuity };
    let (passed_point, next_point) = breaking_points(shoot, laws, size);
    let is_close = |time: &f64| (time - next_point).abs() <= CLOSE * size;
    let next_point = [discontinuity, until].into_iter().find(is_close).unwrap_or(next_point);
    let target = until.min(discontinuity).min(next_point);
    let since = t - shoot.state.smooth_since;
    let rise = || shortest_rise(shoot, laws, shoot.state.history.levels() - 1);
    let mut first = FIRST_STEP * size;
    if since < first {
        // Variables are interpolated by cubics, which would overshoot one that changes faster than the step.
        first = first.min(STEP_OVER_RISE * rise());
    }
    // Rounding must not turn a full step into two.
    let mut step = if since < size * (1.0 - ROUNDING) { since.max(first) } else { size };
    // A breaking point may lie ahead of the present time by rounding, and counts as passed.
    let interval = discontinuity.min(next_point) - shoot.state.smooth_since.max(passed_point.min(t));
    step = step.min(longest_to_compare(shoot, options, interval, rise));
    step = step.min(longest_step(shoot, options)?);
    let last_step = shoot.state.history.last_step();
    let smooth = shoot.state.smooth_since;
    // Steps behind a breaking point are as long as the last one before it.
    if last_step > 0.0 && passed_point > smooth && t - passed_point < (EQUAL_STEPS - 0.5) * last_step {
        step = step.min(last_step);
    }
    let rest = target - t;
    let time = if rest <= step * (1.0 + ROUNDING) {
        target
    } else if target == next_point && rest < EQUAL_STEPS * step {
        t + rest / (rest / step * (1.0 - ROUNDING)).ceil()
    } else if rest < 2.0 * step {
        // Two equal steps. After a full step and a very short one interpolation would lose digits.
        t + 0.5 * rest
    } else {
        t + step
    };
    ParameterError::unless(time > t, "time step", step, "longer than the rounding of the time (s)")?;
    let kink = time == next_point;
    Ok(StepEnd { time, discontinuity: time == discontinuity || kink && is_sharp(shoot, laws, options, time), kink })
}
