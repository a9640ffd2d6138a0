//! Times at which contacts begin and end. A step in which this happens is divided by bisection, and
//! ends there.

use super::{FIRST_STEP, Outcome, Run, RunOptions, StepEnd, Stepper};
use crate::equilibrium::EquilibriumSolver;
use crate::integrator::Statistics;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;
use crate::support::{Patch, Support};

/// Number of levels of the history within the time of a full step from which on changes are not
/// located. It bounds the cost of contacts that begin and end in ever shorter intervals. A change
/// adds at most about forty levels.
const MOST_LEVELS: usize = 128;

/// Largest number of times in a step at which no equilibrium was found next to the one before. A
/// shoot that creeps on an obstacle may snap again after a time as short as the accuracy of the
/// location, and a shoot that is almost neutral may seem to snap. The rest of the step is then one
/// part.
const MOST_SNAPS: usize = 4;

impl Stepper {
    /// Returns whether changes of contact affect the order in time: the shoot may touch obstacles,
    /// and its laws have stimuli, which have kinks and jumps at these times.
    pub(super) fn locates_contacts(&self, shoot: &Shoot<impl Model>) -> bool {
        self.laws.size().stimuli > 0 && !shoot.model.support().contacts().is_empty()
    }
}

impl<M: Model, E: EquilibriumSolver> Run<'_, M, E> {
    /// Makes a step from the state `start`, and returns its end. If a contact begins or ends, the
    /// step ends there, and passes the change as a discontinuity.
    ///
    /// Bisection divides the step, since the shape may jump. The parts before the change are steps
    /// of the run. Each begins with the shape at the end of the part before, since the equilibrium
    /// next to a loss of stability is found only from a close initial guess.
    pub(super) fn step_with_contacts(
        &mut self,
        start: &State,
        end: StepEnd,
        options: &RunOptions,
    ) -> Outcome<StepEnd> {
        let before = self.stepper.statistics;
        // Too many levels of the history are within the time of a full step.
        let older = start.history.levels().checked_sub(MOST_LEVELS);
        let crowded =
            older.is_some_and(|level| start.history.time(level) > start.time - options.step);
        let fails = match self.change_in((start, end), options, crowded) {
            Ok(changes) if crowded || !changes => return Ok(end),
            Err(error) if crowded || !error.is_recoverable() => return Err(error),
            result => result.is_err(),
        };
        self.undo(start, before);
        // The change is located up to this time. Its error then equals that of the first step after
        // it: third order in a step that is 64 times shorter, since the stimuli of this step are
        // linear. With friction a step is of first order. A snap is located to second order, to
        // 0.03 s in a step of 120 s, which is shorter than the snap. Times that differ by rounding
        // are not divided.
        let rubs = self
            .shoot
            .model
            .support()
            .contacts()
            .iter()
            .any(|contact| contact.friction > 0.0);
        let order = |snap: bool| if rubs { 1 } else { 3 - i32::from(snap) };
        let rounding = 16.0 * f64::EPSILON * end.time.abs();
        let accuracy = |snap: bool| (FIRST_STEP.powi(order(snap)) * options.step).max(rounding);
        let mut shortest = accuracy(fails);
        // The contacts up to the state `last` are those at the start. They differ at the later time
        // `high` if `known`, and no equilibrium was found shortly before `high` if `skips`. A trial
        // that `passes` ends at `high`, and a change in it is a discontinuity. `located` counts
        // these trials.
        let (mut last, mut counts) = (start.clone(), before);
        let (mut high, mut known, mut skips, mut located) = (end.time, true, false, 0);
        loop {
            let width = high - last.time;
            if located >= MOST_SNAPS {
                (high, known, skips) = (end.time, false, true);
            }
            let passes = skips || width <= shortest;
            located += usize::from(passes);
            let time = if passes || !known {
                high
            } else {
                last.time + 0.5 * width
            };
            let part = if time == end.time {
                end
            } else {
                StepEnd::smooth(time, end.target)
            };
            let changes = self.change_in((start, part), options, passes);
            // A divided step counts as one.
            self.stepper.statistics.steps = before.steps + 1;
            match changes {
                Ok(false) if time == end.time => return Ok(end),
                Ok(false) => {
                    last.copy_from(&self.shoot.state);
                    (counts, skips) = (self.stepper.statistics, false);
                    if time == high {
                        // With the closer initial guess the contacts do not change by `high`; the
                        // search continues later.
                        (high, known) = (end.time.min(high + 2.0 * width), false);
                    }
                }
                Ok(true) if passes => {
                    self.stepper.statistics.contact_changes += 1;
                    return Ok(StepEnd {
                        discontinuity: true,
                        contact_change: true,
                        ..part
                    });
                }
                Err(error) if !error.is_recoverable() || passes && time == end.time => {
                    return Err(error);
                }
                changes => {
                    shortest = accuracy(changes.is_err());
                    self.undo(&last, counts);
                    // Next to a loss of stability the solver may fail. These times are passed with
                    // the change.
                    (high, known) = if passes {
                        (end.time.min(high + 2.0 * width), false)
                    } else {
                        (time, true)
                    };
                    skips = passes;
                }
            }
        }
    }

    /// Makes a step, and returns whether the contacts at its end differ from those in the state
    /// `start`. If the step `passes` a change, it treats the change as a discontinuity.
    fn change_in(
        &mut self,
        (start, end): (&State, StepEnd),
        options: &RunOptions,
        passes: bool,
    ) -> Outcome<bool> {
        self.stepper.omits_descent = !passes;
        let step = self.step(end, options);
        self.stepper.omits_descent = false;
        step?;
        let surface = |patch: &Patch| (patch.obstacle, patch.surface);
        // The patches are in the order of the surfaces. Contacts that merge or divide are no
        // changes.
        let touched = |state: &State| {
            let mut surfaces: Vec<_> = state.contact.patches.iter().map(surface).collect();
            surfaces.dedup();
            surfaces
        };
        let changes = touched(start) != touched(&self.shoot.state);
        if changes && passes && !end.discontinuity {
            self.pass_discontinuity(0)?;
        }
        Ok(changes)
    }

    /// Restores a state of the shoot and its counts, except those of costs.
    fn undo(&mut self, state: &State, counts: Statistics) {
        self.shoot.state.copy_from(state);
        self.stepper.statistics = self.stepper.statistics.undone_since(counts);
        self.stepper.statistics.contact_trials += 1;
    }
}
