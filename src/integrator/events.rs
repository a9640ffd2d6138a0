//! Event location and output times. Both repeat a step with a shorter length.

use std::iter::Peekable;

use super::error::Outcome;
use super::stepper::{check_ahead, check_growth};
use super::undo::undo_on_error;
use super::{IntegrationError, Integrator, Statistics};
use crate::error::{ParameterError, ensure};
use crate::model::Model;
use crate::numerics::scalar::bracketed_root;
use crate::shoot::Shoot;
use crate::state::State;

/// Accuracy of the time of an event, relative to the step in which it occurs: far below any error
/// in time.
const EVENT_TOLERANCE: f64 = 1e-10;

/// See [`Integrator::advance_showing_until`]. Without a condition the shoot advances to the
/// `latest` time.
pub(super) fn advance_showing_until<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    latest: f64,
    times: impl IntoIterator<Item = f64>,
    mut show: impl FnMut(&Shoot<M>),
    mut condition: Option<impl FnMut(&Shoot<M>) -> f64>,
) -> Outcome<Statistics> {
    check_ahead("latest time to advance to", shoot, latest)?;
    undo_on_error(shoot, &mut None, |shoot, _| {
        let located = condition.is_some();
        if !located {
            check_growth(shoot, latest)?;
        }
        let mut evaluate = |shoot: &Shoot<M>| {
            let value = condition
                .as_mut()
                .map_or(-1.0, |condition| condition(shoot));
            IntegrationError::finite(!value.is_nan(), "condition", shoot.time()).map(|()| value)
        };
        // A shoot that was not started, or whose laws were exchanged, has no equilibrium yet.
        let present = shoot.time();
        let mut statistics = advance(integrator, shoot, present)?;
        let mut outputs = Outputs {
            times: times.into_iter().peekable(),
            last: present,
            latest,
        };
        let mut before = shoot.state.clone();
        let mut value = evaluate(shoot)?;
        statistics += outputs.show_passed(integrator, shoot, &before, &mut show)?;
        if value < 0.0 && (located || outputs.times.peek().is_some()) {
            // An integrator that chooses a resolution does so once for the whole time, not for each
            // repeated step.
            statistics += integrator.advance_at_most(shoot, latest, 0)?;
            check_reached(shoot, present, shoot.time() == present)?;
        }
        while value < 0.0 && (located || outputs.times.peek().is_some()) {
            if shoot.time() >= latest {
                return Err(IntegrationError::NotReached {
                    time: shoot.time(),
                    value,
                });
            }
            before.copy_from(&shoot.state);
            let start = (shoot.time(), value);
            let step = step(integrator, shoot, latest)?;
            value = evaluate(shoot)?;
            if value >= 0.0 {
                let end = (shoot.time(), value);
                statistics += locate(
                    integrator,
                    shoot,
                    &before,
                    [start, end],
                    step,
                    &mut evaluate,
                )?;
            } else {
                statistics += step;
            }
            statistics += outputs.show_passed(integrator, shoot, &before, &mut show)?;
        }
        if !located {
            statistics += advance(integrator, shoot, latest)?;
        }
        Ok(statistics)
    })
}

/// Advances the shoot to a time (s). Returns an error if the integrator stops at another time.
fn advance<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    time: f64,
) -> Outcome<Statistics> {
    let statistics = integrator.advance(shoot, time)?;
    check_reached(shoot, time, shoot.time() == time)?;
    Ok(statistics)
}

/// Returns an error unless it is `ok` for a shoot to be at its present time after a call for a
/// `requested` time (s).
fn check_reached(
    shoot: &Shoot<impl Model>,
    requested: f64,
    ok: bool,
) -> Result<(), ParameterError> {
    let name = "time that the integrator reached";
    let error = ParameterError::refused(
        name,
        shoot.time(),
        "the time that was requested from it (s)",
    );
    ensure(
        ok,
        ParameterError {
            needed: Some(requested),
            ..error
        },
    )
}

/// Makes a step towards the `latest` time. Returns an error if it does not advance the shoot, since
/// a run of such steps has no end, or if it passes this time.
fn step<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    latest: f64,
) -> Outcome<Statistics> {
    let before = shoot.time();
    let statistics = integrator.step(shoot, latest)?;
    check_reached(shoot, latest, shoot.time() <= latest)?;
    let (name, length) = ("length of a step of the integrator", shoot.time() - before);
    let requirement = "positive: `Integrator::advance_at_most` must make a step (s)";
    ParameterError::unless(length > 0.0, name, length, requirement)?;
    Ok(statistics)
}

/// Output times that have not passed yet.
struct Outputs<I: Iterator<Item = f64>> {
    times: Peekable<I>,
    /// Last output time, or the time at which the run began, s.
    last: f64,
    /// Latest permitted output time, s.
    latest: f64,
}

impl<I: Iterator<Item = f64>> Outputs<I> {
    /// Passes the shoot to `show` at the output times up to the present. Those before the present
    /// are in the step from the state `before`, which is repeated with a shorter length.
    fn show_passed<M: Model>(
        &mut self,
        integrator: &mut impl Integrator,
        shoot: &mut Shoot<M>,
        before: &State,
        show: &mut impl FnMut(&Shoot<M>),
    ) -> Outcome<Statistics> {
        let mut statistics = Statistics::default();
        let now = shoot.time();
        while let Some(&time) = self.times.peek() {
            let requirement =
                "not before the present or an earlier output time, and not after the end (s)";
            let ok = time >= self.last && time <= self.latest;
            ParameterError::unless(ok, "output time", time, requirement)?;
            if time > now {
                break;
            }
            (self.last, _) = (time, self.times.next());
            if time == now {
                show(shoot);
                continue;
            }
            let after = std::mem::replace(&mut shoot.state, before.clone());
            statistics += advance(integrator, shoot, time)?.as_trial();
            show(shoot);
            shoot.state = after;
        }
        Ok(statistics)
    }
}

/// Advances the shoot to the time in a step at which the condition begins to hold, by steps from
/// the state `before`. The last of these steps counts as a step, and the others as trial steps.
fn locate<M: Model>(
    integrator: &mut impl Integrator,
    shoot: &mut Shoot<M>,
    before: &State,
    [start, end]: [(f64, f64); 2],
    mut last_step: Statistics,
    evaluate: &mut impl FnMut(&Shoot<M>) -> Outcome<f64>,
) -> Outcome<Statistics> {
    let mut trials = Statistics::default();
    // A condition that holds may be zero at many times. The event is the first of them, so zero
    // counts as positive.
    let holds = |value: f64| {
        if value >= 0.0 {
            value.max(f64::MIN_POSITIVE)
        } else {
            value
        }
    };
    let accuracy = EVENT_TOLERANCE * (end.0 - start.0);
    let [_, event] = bracketed_root([start, (end.0, holds(end.1))], accuracy, |time| {
        shoot.state.copy_from(before);
        let step = advance(integrator, shoot, time)?;
        let value = holds(evaluate(shoot)?);
        let discarded = if value > 0.0 {
            std::mem::replace(&mut last_step, step)
        } else {
            step
        };
        trials += discarded.as_trial();
        Ok::<_, IntegrationError>(value)
    })?;
    if shoot.time() != event {
        shoot.state.copy_from(before);
        trials += advance(integrator, shoot, event)?.as_trial();
    }
    trials += last_step;
    Ok(trials)
}
