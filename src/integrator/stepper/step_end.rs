//! Choice of the end of the next step.

use super::transient::fastest_transient;
use super::{FIRST_STEP, IntegrationError, ORDER, Outcome, ROUNDING, RunOptions};
use crate::error::ParameterError;
use crate::growth::{GrowthLaw, NOT_SHRINKING};
use crate::integrator::error::MAX_PARTS;
use crate::model::{Model, next_discontinuity};
use crate::scene::{after, before};
use crate::shoot::{Mesh, Shoot};
use crate::state::{CLOSE, History, State};
use crate::tropism::Declaration;

/// Number of equal steps before a breaking point: the number of steps over which stimuli are
/// interpolated. After it there is one step fewer.
pub(super) const EQUAL_STEPS: f64 = (ORDER - 1) as f64;

/// Ratio of the first step to the rise time of a variable. A cubic through four levels with this
/// distance resolves an exponential.
const STEP_OVER_RISE: f64 = 0.25;

/// Largest generation of a sharp breaking point. [`sharp_generation`] gives the reason.
const SHARP_GENERATIONS: u8 = 2;

/// Smallest ratio of the first step after a breaking point, which resolves a transient, to the
/// usual one. The effect of a transient is proportional to its time constant, and that of a faster
/// one is below the error of the other steps.
const SHORTEST: f64 = 0.25;

/// End of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::integrator) struct StepEnd {
    /// Time, s.
    pub time: f64,
    /// Whether a law or the scene has a discontinuity there, or a contact begins or ends.
    pub discontinuity: bool,
    /// Whether the time is a breaking point. The second derivative of the positions is
    /// discontinuous there.
    pub kink: bool,
    /// Number of delays through which a discontinuity of a law or the scene has caused the one
    /// there; zero for this discontinuity itself.
    pub generation: u8,
    /// Whether a contact begins or ends there.
    pub contact_change: bool,
    /// Next time that steps must not pass, s.
    pub target: f64,
}

impl StepEnd {
    /// The end of a step at `time` (s) on the way to the time `target` (s), without a discontinuity
    /// or a kink.
    pub fn smooth(time: f64, target: f64) -> Self {
        Self {
            time,
            target,
            ..Self::default()
        }
    }

    /// Time at which the laws are evaluated at the end of the step, s: before a discontinuity.
    pub fn before(&self) -> f64 {
        if self.discontinuity {
            before(self.time)
        } else {
            self.time
        }
    }
}

/// Breaking points of the discontinuities in the history, s: their times plus the delays of the
/// laws. Each has the index of the discontinuity, counted from the last one backwards, and that of
/// the delay.
pub(super) fn breaking_points(
    history: &History,
    laws: &Declaration,
) -> impl Iterator<Item = (f64, [usize; 2])> {
    history
        .discontinuities()
        .rev()
        .enumerate()
        .flat_map(move |(discontinuity, level)| {
            let delays = laws.delays().enumerate().filter(|(_, delay)| *delay > 0.0);
            delays.map(move |(delay, value)| (history.time(level) + value, [discontinuity, delay]))
        })
}

/// Returns the last breaking point up to the present, and the next one, s. The rate of differential
/// growth has a kink at a breaking point. After another delay the kink is smoother by two orders,
/// and is neglected.
///
/// A step ends at a breaking point, and the steps around it are equal. The errors of interpolation
/// across the kink, of third order, then cancel.
fn points_beside(state: &State, laws: &Declaration, size: f64) -> (f64, f64) {
    let (close, points) = (CLOSE * size, || {
        breaking_points(&state.history, laws).map(|(time, _)| time)
    });
    let now = state.time + close;
    let last = points()
        .filter(|point| *point <= now)
        .fold(f64::NEG_INFINITY, f64::max);
    let next = points()
        .filter(|point| *point > now)
        .fold(f64::INFINITY, f64::min);
    // Merge breaking points closer than `CLOSE` times the step into the last of them.
    (
        last,
        points()
            .filter(|point| *point <= next + close)
            .fold(next, f64::max),
    )
}

/// Returns the rise time of a variable, s: the time in which it would reach its stimulus at its
/// rate at a level, which is the one after a discontinuity. It is infinite for a variable that
/// stays zero.
fn rise(history: &History, laws: &Declaration, level: usize, variable: usize) -> f64 {
    let (value, rate) = history.largest(level, variable);
    // The stimulus is x = y + τ ẏ.
    let time = laws.variables()[variable].time_constant + value / rate;
    if time > 0.0 { time } else { f64::INFINITY }
}

/// Returns the generation of the discontinuity at a breaking point at `time` (s) if it is sharp:
/// differential growth changes within a step after it, since a variable did so a delay earlier. A
/// sharp breaking point is treated as a discontinuity. The criterion uses the longest step of all
/// compared runs, so that the error of a run with shorter steps is not larger.
///
/// Differential growth jumps at the first generation, which gives the shape and a fast variable a
/// kink. At the second generation it has a kink. It is smooth enough at the third one, which is an
/// ordinary breaking point.
fn sharp_generation(
    history: &History,
    laws: &Declaration,
    options: &RunOptions,
    time: f64,
) -> Option<u8> {
    let close = CLOSE * options.step;
    let longest = options
        .coarsest_step
        .map_or(options.step, |coarsest| coarsest.max(options.step));
    let acts = |level: usize, delay: f64| (history.time(level) + delay - time).abs() <= close;
    let is_sharp = |level: usize, i: usize| {
        laws.variables()[i]
            .delay
            .is_some_and(|delay| acts(level, delay))
            && rise(history, laws, level, i) < longest
    };
    let causes = history
        .discontinuities()
        .filter(|level| (0..laws.variables().len()).any(|i| is_sharp(*level, i)));
    let generations = causes
        .map(|level| history.generation(level))
        .filter(|generation| *generation < SHARP_GENERATIONS);
    generations.min().map(|generation| generation + 1)
}

/// Returns the longest step up to `size` that growth permits on the way to the time `until`, s. The
/// tissue that leaves the zone in one step becomes one element, which must not exceed the longest
/// element.
///
/// # Errors
/// A zone that shrinks, and a step that would be divided into more than [`MAX_PARTS`].
pub(crate) fn permitted_step(
    shoot: &Shoot<impl Model>,
    [size, until]: [f64; 2],
    mesh: &Mesh,
) -> Outcome<f64> {
    let (t, growth) = (shoot.state.time, shoot.model.growth());
    let zone = growth.zone_length();
    if !(growth.elongates() && zone.is_finite()) {
        return Ok(size);
    }
    // Largest distance of growing tissue from the apex, since the zone may be longer than the
    // shoot.
    let rod = &shoot.state.rod;
    let reach = rod.node_distance[rod.first_growing.min(rod.elements())].min(zone);
    let shortest = size.min(until - t) / MAX_PARTS;
    let mut step = size;
    while step > shortest && reach - growth.flow(zone, t + step, t).0 > mesh.longest_element {
        step *= 0.5;
    }
    // An element may stretch to about twice its length before it is divided.
    let mean = growth.apical_speed(zone, t) / zone;
    let rate = (growth.apical_speed(reach, t) / reach).max(mean);
    // NaN is an error of the motion of points.
    ParameterError::unless(
        !(mean * size < -ROUNDING),
        "mean growth rate of the zone",
        mean,
        NOT_SHRINKING,
    )?;
    if rate > 0.0 {
        step = step.min(std::f64::consts::LN_2 / rate);
    }
    if step > shortest {
        Ok(step)
    } else {
        Err(IntegrationError::GrowsTooFast {
            time: t,
            step: size,
        })
    }
}

/// Returns a bound on the step (s) in runs that `Adaptive` compares. `interval` is the time between
/// two discontinuities or breaking points, s.
///
/// Without this bound, the steps after a discontinuity would be the same in all these runs, and
/// their difference would not show the error. An interval as short as rounding has no bound, and is
/// one step.
fn longest_to_compare(
    state: &State,
    options: &RunOptions,
    interval: f64,
    rise: impl FnOnce() -> f64,
) -> f64 {
    let size = options.step;
    let Some(coarsest) = options.coarsest_step.filter(|_| interval > CLOSE * size) else {
        return f64::INFINITY;
    };
    let fineness = size / coarsest;
    let since = state.time - state.smooth_since;
    // The coarsest run makes two steps in an interval that is shorter than its longest step.
    let scale = if interval < coarsest * (1.0 - ROUNDING) {
        0.5 * interval
    } else {
        coarsest
    };
    // Steps proportional to the root of the time since the discontinuity grow linearly with their
    // number. The coarsest run reaches its full step with step number ORDER, at ORDER / 2 of this
    // step.
    let ramp = 0.5 * ORDER as f64 * scale;
    let mut longest = fineness * scale * (since / ramp).sqrt().clamp(FIRST_STEP, 1.0);
    if since < size {
        // Resolve a transient that is faster than a step.
        let rise = rise();
        if rise < size {
            longest = longest.min(fineness * since.max(STEP_OVER_RISE * rise));
        }
    }
    longest
}

/// Returns the next discontinuity of a law or the scene after the present `t` (s). One at the
/// present may have been passed.
pub(super) fn next_discontinuity_after(
    shoot: &Shoot<impl Model>,
    t: f64,
) -> Result<f64, ParameterError> {
    next_discontinuity(
        &shoot.model,
        if t == shoot.state.smooth_since {
            after(t)
        } else {
            t
        },
    )
}

/// Returns the next discontinuity of a law or the scene on the way to the time `until` (s). One
/// that differs from it by rounding is there.
pub(crate) fn next_discontinuity_ahead(
    shoot: &Shoot<impl Model>,
    until: f64,
) -> Result<f64, ParameterError> {
    let t = shoot.state.time;
    let discontinuity = next_discontinuity_after(shoot, t)?;
    // Discontinuities that differ by rounding count as one.
    let ok = t != shoot.state.smooth_since || discontinuity > after(after(t));
    let requirement = "later than the one before by more than rounding (s): does the law announce times without end?";
    ParameterError::unless(
        ok,
        "discontinuity that a law announces",
        discontinuity,
        requirement,
    )?;
    Ok(
        if discontinuity > before(until) && discontinuity < after(until) {
            until
        } else {
            discontinuity
        },
    )
}

/// Returns the end of the next step. The first target is the end of the run, a discontinuity or a
/// breaking point, which a step does not pass. The length is the requested one, which these bounds
/// reduce: steps that double after a discontinuity, steps that must differ in compared runs, growth
/// in a step, and the step before a breaking point. The rest up to the target is then divided into
/// equal steps.
pub(super) fn next_step_end(
    shoot: &Shoot<impl Model>,
    laws: &Declaration,
    options: &RunOptions,
) -> Outcome<StepEnd> {
    let (state, history) = (&shoot.state, &shoot.state.history);
    let (t, smooth, until, size) = (state.time, state.smooth_since, options.until, options.step);
    let discontinuity = next_discontinuity_ahead(shoot, until)?;
    let (passed_point, next_point) = points_beside(state, laws, size);
    let is_close = |time: &f64| (time - next_point).abs() <= CLOSE * size;
    let next_point = [discontinuity, until]
        .into_iter()
        .find(is_close)
        .unwrap_or(next_point);
    let target = until.min(discontinuity).min(next_point);
    let (since, last) = (t - smooth, history.levels() - 1);
    let rise = || {
        (0..laws.variables().len())
            .map(|i| rise(history, laws, last, i))
            .fold(f64::INFINITY, f64::min)
    };
    let mut first = FIRST_STEP * size;
    if since < first {
        // The cubic interpolation of a variable that changes faster than the step would overshoot.
        first = first.min(STEP_OVER_RISE * rise());
        let resolves = |tau: f64| (SHORTEST * first..first).contains(&(STEP_OVER_RISE * tau));
        if let Some(tau) = fastest_transient(state, laws, CLOSE * size, resolves) {
            // Steps that double the elapsed time end with a full one, at a multiple of it after the
            // discontinuity.
            first = size * 0.5_f64.powf((size / (STEP_OVER_RISE * tau)).log2().ceil());
        }
    }
    // Rounding must not turn a full step into two.
    let mut step = if since < size * (1.0 - ROUNDING) {
        since.max(first)
    } else {
        size
    };
    // The passed breaking point may be later than the present by rounding.
    let interval = discontinuity.min(next_point) - smooth.max(passed_point.min(t));
    step = step.min(longest_to_compare(state, options, interval, rise));
    step = step.min(permitted_step(shoot, [size, until], &options.mesh)?);
    let last_step = history.last_step();
    // Steps after a breaking point are as long as the last one before it.
    if last_step > 0.0
        && passed_point > smooth
        && t - passed_point < (EQUAL_STEPS - 0.5) * last_step
    {
        step = step.min(last_step);
    }
    let rest = target - t;
    let time = if rest <= step * (1.0 + ROUNDING) {
        target
    } else if target == next_point && rest < EQUAL_STEPS * step {
        t + rest / (rest / step * (1.0 - ROUNDING)).ceil()
    } else if rest < 2.0 * step {
        // Two equal steps, since interpolation through a full step and a very short one would lose
        // digits.
        t + 0.5 * rest
    } else {
        t + step
    };
    let requirement =
        "longer than the rounding of the time (s): a step, a delay or a memory time is too short";
    ParameterError::unless(time > t, "time step", step, requirement)?;
    let kink = time == next_point;
    let sharp = if kink && time != discontinuity {
        sharp_generation(history, laws, options, time)
    } else {
        None
    };
    let (generation, discontinuity) =
        (sharp.unwrap_or(0), sharp.is_some() || time == discontinuity);
    Ok(StepEnd {
        discontinuity,
        kink,
        generation,
        ..StepEnd::smooth(time, target)
    })
}
