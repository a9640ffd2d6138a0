//! Where the next step ends, and on which side of a discontinuity.

use super::course::Course;
use super::{FIRST_STEP, IntegrationError, MOST_PARTS, ORDER};
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::scene::{after, before};
use crate::shoot::Shoot;
use crate::state::CLOSE;
use crate::tropism::Declaration;

/// So many steps before a breaking point are equal, and so many less one behind it: as many as interpolation reaches across it.
pub(super) const AROUND: f64 = (ORDER - 1) as f64;

/// The first step, over the time in which a variable rises to what it remembers: cubics follow an exponential for so long.
const FRESH: f64 = 0.25;

/// The coarsest of several runs divides an interval that is shorter than its step into this number of steps.
const STEPS_WITHIN: f64 = 2.0;

/// The end of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    /// When, s.
    pub time: f64,
    /// Whether something has a discontinuity there.
    pub discontinuity: bool,
    /// Whether a delay carries one on to there: the path is continuous, its second derivative is not.
    pub kink: bool,
}

impl Stop {
    /// The time at which laws are read at the end of the step, s: before a discontinuity.
    pub fn before(&self) -> f64 {
        if self.discontinuity { before(self.time) } else { self.time }
    }
}

/// Whether something has a discontinuity at the time at which a run starts.
pub(super) fn starts_at_discontinuity(shoot: &Shoot<impl Model>) -> Result<bool, ParameterError> {
    let start = shoot.state.time;
    Ok(shoot.model.next_discontinuity(before(start))? <= after(start))
}

/// When what is read with a delay passes a discontinuity of the past, s: the last time of it up to now, and the next. The growth that
/// is asked for has a kink there. It is smoother by two orders when it is read again, and seen no more.
///
/// A step ends there, and the steps around it are equal: errors of third order that interpolation across the kink makes on one side
/// and on the other cancel then.
fn breaking_points(shoot: &Shoot<impl Model>, laws: &Declaration, size: f64) -> (f64, f64) {
    let (close, delays) = (CLOSE * size, || laws.delays().filter(|delay| *delay > 0.0));
    let times = || shoot.state.history.discontinuities().map(|level| shoot.state.history.time(level));
    let points = || times().flat_map(|time| delays().map(move |delay| time + delay));
    let now = shoot.state.time + close;
    let last = points().filter(|point| *point <= now).fold(f64::NEG_INFINITY, f64::max);
    let next = points().filter(|point| *point > now).fold(f64::INFINITY, f64::min);
    // Of some that are close to each other the latest.
    (last, points().filter(|point| *point <= next + close).fold(next, f64::max))
}

/// The time in which a variable would come at its rate to what it remembers, at a level behind a discontinuity, s: the shortest of any.
fn shortest_rise(shoot: &Shoot<impl Model>, laws: &Declaration, level: usize) -> f64 {
    let rises = laws.variables().iter().enumerate().map(|(i, variable)| {
        let (value, rate) = shoot.state.history.largest(level, i);
        // Of a stimulus x = y + τ ẏ.
        variable.time_constant + value / rate
    });
    // What stays zero never rises.
    rises.filter(|time| *time > 0.0).fold(f64::INFINITY, f64::min)
}

/// Whether what is read with a delay changes within a step behind such a time (s), since a variable did: the growth that is asked for
/// all but jumps. What is sharp for the coarsest of several runs is sharp for all of them. Otherwise a run with shorter steps could have
/// the larger error.
fn is_sharp(shoot: &Shoot<impl Model>, laws: &Declaration, course: &Course, time: f64) -> bool {
    let (history, close) = (&shoot.state.history, CLOSE * course.size);
    let at = |level: &usize| laws.delays().any(|delay| (history.time(*level) + delay - time).abs() <= close);
    let longest = course.size.max(course.coarsest);
    history.discontinuities().filter(at).any(|level| shortest_rise(shoot, laws, level) < longest)
}

/// The longest step up to a size that growth allows, s: tissue that leaves the zone in one step becomes one element, which must not be
/// longer than others are.
///
/// # Errors
/// A size of which that is less than a thousandth: every part of it leaves an element behind.
fn longest_step(
    shoot: &Shoot<impl Model>,
    &Course { until, size, mesh, .. }: &Course,
) -> Result<f64, IntegrationError> {
    let (t, growth) = (shoot.state.time, shoot.model.growth());
    let zone = growth.zone_length();
    if !(growth.elongates() && zone.is_finite()) {
        return Ok(size);
    }
    // No tissue is further from the apex than this: of a zone that is longer than the shoot none leaves.
    let rod = &shoot.state.rod;
    let reach = rod.node_distances()[rod.first_growing().min(rod.elements())].min(zone);
    let shortest = size.min(until - t) / MOST_PARTS;
    let mut step = size;
    while step > shortest && reach - growth.flow(zone, t + step, t).0 > mesh.longest_element {
        step *= 0.5;
    }
    // No element is stretched to much more than twice its length before it can be cut.
    let rate = (growth.apical_speed(reach, t) / reach).max(growth.apical_speed(zone, t) / zone);
    if rate > 0.0 {
        step = step.min(std::f64::consts::LN_2 / rate);
    }
    if step > shortest { Ok(step) } else { Err(IntegrationError::GrowsTooFast { time: t, step: size }) }
}

/// The longest step in an interval between two discontinuities or breaking points (s) by which runs that are compared differ, s.
///
/// Without it a step close behind a discontinuity depends only on the time since then. The difference of two runs would not contain
/// the error of such steps.
///
/// An interval that is not longer than rounding has no such bound: its end is the end of the step.
fn longest_to_compare(shoot: &Shoot<impl Model>, course: &Course, interval: f64, rise: impl FnOnce() -> f64) -> f64 {
    let &Course { size, coarsest, .. } = course;
    if coarsest == 0.0 || interval <= CLOSE * size {
        return f64::INFINITY;
    }
    let fineness = size / coarsest;
    let since = shoot.state.time - shoot.state.smooth_since;
    let scale = if interval < coarsest * (1.0 - 1e-9) { interval / STEPS_WITHIN } else { coarsest };
    let mut longest = fineness * scale * (since / (2.0 * scale)).sqrt().clamp(FIRST_STEP, 1.0);
    if since < size {
        // A transient that is faster than a step.
        let rise = rise();
        if rise < size {
            longest = longest.min(fineness * since.max(FRESH * rise));
        }
    }
    longest
}

/// The end of the next step of a course: no more tissue than makes an element of the longest kind leaves the zone in it.
pub(super) fn next_stop(
    shoot: &Shoot<impl Model>,
    laws: &Declaration,
    course: &Course,
) -> Result<Stop, IntegrationError> {
    let (t, until, size) = (shoot.state.time, course.until, course.size);
    // A discontinuity that has been passed is the same as another one within rounding of it.
    let passed = t == shoot.state.smooth_since;
    let discontinuity = shoot.model.next_discontinuity(if passed { after(t) } else { t })?;
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
    let mut first = FIRST_STEP * size;
    let mut known_rise = None;
    if since < first {
        // Variables are read by cubics, which would swing far beyond what one comes to that changes all at once.
        let rise = shortest_rise(shoot, laws, shoot.state.history.levels() - 1);
        first = first.min(FRESH * rise);
        known_rise = Some(rise);
    }
    // Rounding must not turn a full step into two.
    let mut step = if since < size * (1.0 - 1e-9) { since.max(first) } else { size };
    // A breaking point may lie ahead of the present time by rounding, and counts as passed.
    let interval = discontinuity.min(next_point) - shoot.state.smooth_since.max(passed_point.min(t));
    let rise = || known_rise.unwrap_or_else(|| shortest_rise(shoot, laws, shoot.state.history.levels() - 1));
    step = step.min(longest_to_compare(shoot, course, interval, rise));
    step = step.min(longest_step(shoot, course)?);
    let last_step = shoot.state.history.last_step();
    let smooth = shoot.state.smooth_since;
    // There was a step since a discontinuity.
    if last_step > 0.0 && passed_point > smooth && t - passed_point < (AROUND - 0.5) * last_step {
        step = step.min(last_step);
    }
    let rest = target - t;
    let time = if rest <= step * (1.0 + 1e-9) {
        target
    } else if target == next_point && rest < AROUND * step {
        t + rest / (rest / step * (1.0 - 1e-9)).ceil()
    } else if rest < 2.0 * step {
        // Two equal steps rather than one and a remnant, beside which interpolation would lose digits.
        t + 0.5 * rest
    } else {
        t + step
    };
    ParameterError::unless(time > t, "time step", step, "longer than the rounding of the time (s)")?;
    let kink = time == next_point;
    Ok(Stop { time, discontinuity: time == discontinuity || kink && is_sharp(shoot, laws, course, time), kink })
}
