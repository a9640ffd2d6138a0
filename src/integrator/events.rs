//! Event location and output times. Both repeat a step with a shorter length.

use super::stepper::check_ahead;
use super::undo::undo_on_error;
use super::{IntegrationError, Integrator, Statistics};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// Error of the time of an event over the step in which it occurs: far below any error in time.
const EVENT_TOLERANCE: f64 = 1e-10;

/// See [`Integrator::advance_until`].
pub(super) fn advance_until<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    latest: f64,
    mut condition: impl FnMut(&Shoot<M>) -> f64,
) -> Result<Statistics, IntegrationError> {
    check_ahead("latest time to advance to", shoot, latest)?;
    undo_on_error(shoot, &mut None, |shoot, _| {
        let mut evaluate = |shoot: &Shoot<M>| {
            let value = condition(shoot);
            let unknown = IntegrationError::NotFinite { what: "condition", time: shoot.time() };
            if value.is_nan() { Err(unknown) } else { Ok(value) }
        };
        // Finds the equilibrium of a shoot that was not started, or whose laws were exchanged.
        let mut statistics = integrator.advance(shoot, shoot.time())?;
        let mut before = shoot.state.clone();
        let mut value = evaluate(shoot)?;
        while value < 0.0 {
            if shoot.time() >= latest {
                return Err(IntegrationError::NotReached { time: shoot.time(), value });
            }
            before.copy_from(&shoot.state);
            let start = (shoot.time(), value);
            let step = integrator.step(shoot, latest)?;
            value = evaluate(shoot)?;
            if value >= 0.0 {
                let end = (shoot.time(), value);
                statistics += locate(integrator, shoot, &before, [start, end], step, &mut evaluate)?;
            } else {
                statistics += step;
            }
        }
        Ok(statistics)
    })
}

/// Advances the shoot to the time in a step at which the condition begins to hold, by steps from the state `before`: regula falsi with the
/// Illinois modification, and bisection if that is slow. The last step counts as a step, and the others as trial steps.
fn locate<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    before: &State,
    [mut low, mut high]: [(f64, f64); 2],
    mut last_step: Statistics,
    evaluate: &mut impl FnMut(&Shoot<M>) -> Result<f64, IntegrationError>,
) -> Result<Statistics, IntegrationError> {
    let mut trials = Statistics::default();
    let smallest = (EVENT_TOLERANCE * (high.0 - low.0)).max(16.0 * f64::EPSILON * high.0.abs());
    let (mut at, mut last) = (high.0, None);
    // Width of the bracket two trials ago. If regula falsi has not reduced it to a quarter since, it is bisected.
    let mut widths = [f64::INFINITY; 2];
    while high.0 - low.0 > smallest {
        let width = high.0 - low.0;
        let (secant, middle) = (low.0 - low.1 * width / (high.1 - low.1), 0.5 * (low.0 + high.0));
        let guess = if secant.is_finite() && width < 0.25 * widths[0] { secant } else { middle };
        widths = if guess == middle { [f64::INFINITY; 2] } else { [widths[1], width] };
        // A guess at an end is moved inside, so that the bracket closes there.
        at = guess.clamp(low.0 + 0.5 * smallest, high.0 - 0.5 * smallest);
        shoot.state.copy_from(before);
        let step = integrator.advance(shoot, at)?;
        let value = evaluate(shoot)?;
        let holds = value >= 0.0;
        let stays = if last == Some(holds) { 0.5 } else { 1.0 };
        if holds {
            trials += std::mem::replace(&mut last_step, step).as_trial();
            (high, low.1) = ((at, value), stays * low.1);
        } else {
            trials += step.as_trial();
            (low, high.1) = ((at, value), stays * high.1);
        }
        last = Some(holds);
    }
    if at != high.0 {
        shoot.state.copy_from(before);
        trials += integrator.advance(shoot, high.0)?.as_trial();
    }
    trials += last_step;
    Ok(trials)
}

/// See [`Integrator::advance_showing`].
pub(super) fn advance_showing<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    until: f64,
    times: impl IntoIterator<Item = f64>,
    mut show: impl FnMut(&Shoot<M>),
) -> Result<Statistics, IntegrationError> {
    undo_on_error(shoot, &mut None, |shoot, _| {
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
