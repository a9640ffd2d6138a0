//! Event location and output times. Both repeat a step with a shorter length.

use super::error::Outcome;
use super::stepper::check_ahead;
use super::undo::undo_on_error;
use super::{IntegrationError, Integrator, Statistics};
use crate::error::ParameterError;
use crate::model::Model;
use crate::numerics::scalar::bracketed_root;
use crate::shoot::Shoot;
use crate::state::State;

/// Accuracy of the time of an event, relative to the step in which it occurs: far below any error in time.
const EVENT_TOLERANCE: f64 = 1e-10;

/// See [`Integrator::advance_until`].
pub(super) fn advance_until<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    latest: f64,
    mut condition: impl FnMut(&Shoot<M>) -> f64,
) -> Outcome<Statistics> {
    check_ahead("latest time to advance to", shoot, latest)?;
    undo_on_error(shoot, &mut None, |shoot, _| {
        let mut evaluate = |shoot: &Shoot<M>| {
            let value = condition(shoot);
            let unknown = IntegrationError::NotFinite { what: "condition", time: shoot.time() };
            if value.is_nan() { Err(unknown) } else { Ok(value) }
        };
        // A shoot that was not started, or whose laws were exchanged, has no equilibrium yet.
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

/// Advances the shoot to the time in a step at which the condition begins to hold, by steps from the state
/// `before`. The last of these steps counts as a step, and the others as trial steps.
fn locate<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    before: &State,
    [start, end]: [(f64, f64); 2],
    mut last_step: Statistics,
    evaluate: &mut impl FnMut(&Shoot<M>) -> Outcome<f64>,
) -> Outcome<Statistics> {
    let mut trials = Statistics::default();
    // A condition that holds may be zero at many times. The event is the first of them, so zero counts as positive.
    let holds = |value: f64| if value >= 0.0 { value.max(f64::MIN_POSITIVE) } else { value };
    let accuracy = EVENT_TOLERANCE * (end.0 - start.0);
    let [_, event] = bracketed_root([start, (end.0, holds(end.1))], accuracy, |time| {
        shoot.state.copy_from(before);
        let step = integrator.advance(shoot, time)?;
        let value = holds(evaluate(shoot)?);
        let discarded = if value > 0.0 { std::mem::replace(&mut last_step, step) } else { step };
        trials += discarded.as_trial();
        Ok::<_, IntegrationError>(value)
    })?;
    if shoot.time() != event {
        shoot.state.copy_from(before);
        trials += integrator.advance(shoot, event)?.as_trial();
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
) -> Outcome<Statistics> {
    undo_on_error(shoot, &mut None, |shoot, _| {
        let mut statistics = integrator.advance(shoot, shoot.time())?;
        let (mut before, mut after) = (shoot.state.clone(), shoot.state.clone());
        let mut shown = shoot.time();
        for time in times {
            let requirement = "in order, from the present to the end (s)";
            ParameterError::unless(time >= shown && time <= until, "output time", time, requirement)?;
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
