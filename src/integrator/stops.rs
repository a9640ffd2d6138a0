//! Runs that stop at a condition, and runs that are seen at given times: both by taking shorter steps from where one began.

use super::course::check_ahead;
use super::{IntegrationError, Integrator, Statistics};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// The time of a stop is known to this fraction of the step in which it lies: below any error in time by far.
const SHARPNESS: f64 = 1e-10;

/// Runs `work` on the shoot and the state that it has; if it fails, puts the shoot back as it was.
pub(super) fn guarded<M: Model>(
    shoot: &mut Shoot<M>,
    work: impl FnOnce(&mut Shoot<M>, &State) -> Result<Statistics, IntegrationError>,
) -> Result<Statistics, IntegrationError> {
    let backup = shoot.state.clone();
    let answer = work(shoot, &backup);
    if answer.is_err() {
        shoot.state = backup;
    }
    answer
}

/// See [`Integrator::advance_until`].
pub(super) fn advance_until<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    latest: f64,
    mut condition: impl FnMut(&Shoot<M>) -> f64,
) -> Result<Statistics, IntegrationError> {
    check_ahead("latest time to advance to", shoot, latest)?;
    guarded(shoot, |shoot, _| {
        let mut ask = |shoot: &Shoot<M>| {
            let value = condition(shoot);
            let unknown = IntegrationError::NotFinite { what: "condition", time: shoot.time() };
            if value.is_nan() { Err(unknown) } else { Ok(value) }
        };
        // To the present time: a shoot that was not started, or whose laws were exchanged, comes to rest first.
        let mut statistics = integrator.advance(shoot, shoot.time())?;
        let mut before = shoot.state.clone();
        let mut value = ask(shoot)?;
        while value < 0.0 {
            if shoot.time() >= latest {
                return Err(IntegrationError::NotReached { time: shoot.time(), value });
            }
            before.copy_from(&shoot.state);
            let start = (shoot.time(), value);
            let step = integrator.step(shoot, latest)?;
            value = ask(shoot)?;
            if value >= 0.0 {
                let end = (shoot.time(), value);
                statistics += find(integrator, shoot, &before, [start, end], step, &mut ask)?;
            } else {
                statistics += step;
            }
        }
        Ok(statistics)
    })
}

/// Finds where in a step the condition begins to hold, and takes the shoot there: regula falsi, with the weight of an end that
/// stays halved (Illinois), and halving where that is slow, by steps from the state `before`. Of the steps, the last counts as one,
/// and the others as looks.
fn find<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    before: &State,
    [mut low, mut high]: [(f64, f64); 2],
    mut last_step: Statistics,
    ask: &mut impl FnMut(&Shoot<M>) -> Result<f64, IntegrationError>,
) -> Result<Statistics, IntegrationError> {
    let mut looks = Statistics::default();
    let smallest = (SHARPNESS * (high.0 - low.0)).max(16.0 * f64::EPSILON * high.0.abs());
    let (mut at, mut last) = (high.0, None);
    // The width of the bracket two trials ago, which regula falsi has to have quartered since; else it is halved.
    let mut widths = [f64::INFINITY; 2];
    while high.0 - low.0 > smallest {
        let width = high.0 - low.0;
        let (secant, middle) = (low.0 - low.1 * width / (high.1 - low.1), 0.5 * (low.0 + high.0));
        let guess = if secant.is_finite() && width < 0.25 * widths[0] { secant } else { middle };
        widths = if guess == middle { [f64::INFINITY; 2] } else { [widths[1], width] };
        // A little off an end that it falls on, so that the bracket closes there.
        at = guess.clamp(low.0 + 0.5 * smallest, high.0 - 0.5 * smallest);
        shoot.state.copy_from(before);
        let step = integrator.advance(shoot, at)?;
        let value = ask(shoot)?;
        let holds = value >= 0.0;
        let stays = if last == Some(holds) { 0.5 } else { 1.0 };
        if holds {
            looks += std::mem::replace(&mut last_step, step).as_trial();
            (high, low.1) = ((at, value), stays * low.1);
        } else {
            looks += step.as_trial();
            (low, high.1) = ((at, value), stays * high.1);
        }
        last = Some(holds);
    }
    if at != high.0 {
        shoot.state.copy_from(before);
        looks += integrator.advance(shoot, high.0)?.as_trial();
    }
    looks += last_step;
    Ok(looks)
}

/// See [`Integrator::advance_showing`].
pub(super) fn advance_showing<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    until: f64,
    times: impl IntoIterator<Item = f64>,
    mut show: impl FnMut(&Shoot<M>),
) -> Result<Statistics, IntegrationError> {
    guarded(shoot, |shoot, _| {
        let mut statistics = integrator.advance(shoot, shoot.time())?;
        let (mut before, mut after) = (shoot.state.clone(), shoot.state.clone());
        let mut shown = shoot.time();
        for time in times {
            let ok = time >= shown && time <= until;
            ParameterError::unless(
                ok,
                "time at which to show the shoot",
                time,
                "in order, from the present to the end (s)",
            )?;
            shown = time;
            while shoot.time() < time {
                before.copy_from(&shoot.state);
                statistics += integrator.step(shoot, until)?;
            }
            if shoot.time() == time {
                show(shoot);
            } else {
                after.copy_from(&shoot.state);
                shoot.state.copy_from(&before);
                statistics += integrator.advance(shoot, time)?.as_trial();
                show(shoot);
                shoot.state.copy_from(&after);
            }
        }
        statistics += integrator.advance(shoot, until)?;
        Ok(statistics)
    })
}
