//! Where the next step ends, and on which side of a discontinuity.

use super::FIRST_STEP;
use crate::error::ParameterError;
use crate::growth::GrowthLaw;
use crate::model::Model;
use crate::scene::{after, before};
use crate::shoot::Shoot;

/// The end of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    /// When, s.
    pub time: f64,
    /// Whether something has a discontinuity there.
    pub discontinuity: bool,
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

/// The end of the next step of at most `size` (s) on the way to time `until`.
pub(super) fn next_stop(shoot: &Shoot<impl Model>, until: f64, size: f64) -> Result<Stop, ParameterError> {
    let (t, growth) = (shoot.state.time, shoot.model.growth());
    // A discontinuity that has been passed is the same as another one within rounding of it.
    let passed = t == shoot.state.smooth_since;
    let discontinuity = shoot.model.next_discontinuity(if passed { after(t) } else { t })?;
    ParameterError::unless(
        !passed || discontinuity > after(after(t)),
        "discontinuity that a law announces",
        discontinuity,
        "further from the one before it than rounding (s): are there announcements without end?",
    )?;
    let target = until.min(discontinuity);
    let since = t - shoot.state.smooth_since;
    // Rounding must not turn a full step into two.
    let mut step = if since < size * (1.0 - 1e-9) { since.max(FIRST_STEP * size) } else { size };
    // Tissue that leaves the zone in one step becomes one element, which must not be longer than others are.
    let zone = growth.zone_length();
    if growth.elongates() && zone.is_finite() {
        // No tissue is further from the apex than this: of a zone that is longer than the shoot none leaves.
        let rod = &shoot.state.rod;
        let reach = rod.node_distance[rod.first_growing().min(rod.elements())].min(zone);
        while reach - growth.flow(zone, t + step, t).0 > shoot.mesh.longest_element {
            step *= 0.5;
        }
        // No element is stretched to much more than twice its length before it can be cut.
        let rate = (growth.apical_speed(reach, t) / reach).max(growth.apical_speed(zone, t) / zone);
        if rate > 0.0 {
            step = step.min(std::f64::consts::LN_2 / rate);
        }
    }
    let rest = target - t;
    let time = if rest <= step * (1.0 + 1e-9) {
        target
    } else if rest < 2.0 * step {
        // Two equal steps rather than one and a remnant, beside which interpolation would lose digits.
        t + 0.5 * rest
    } else {
        t + step
    };
    ParameterError::unless(time > t, "time step", step, "longer than the rounding of the time (s)")?;
    Ok(Stop { time, discontinuity: time == discontinuity })
}
