//! Recording of the grid of a run, and steps on a recorded grid.

use super::step_end::{StepEnd, next_discontinuity_after, next_step_end};
use super::{IntegrationError, Outcome, RunOptions, Stepper};
use crate::error::ParameterError;
use crate::integrator::grid::{Anchor, GridStep, GridUse};
use crate::model::Model;
use crate::shoot::Shoot;

impl Stepper {
    /// Returns the end of the next step: that of the recorded grid, or a new one, which may be recorded.
    pub(super) fn choose_step_end(&mut self, shoot: &Shoot<impl Model>, options: &RunOptions) -> Outcome<StepEnd> {
        if matches!(self.grid, GridUse::Free) {
            return next_step_end(shoot, &self.laws, options);
        }
        let (name, requirement) = ("support of a run with a recorded grid", "one without obstacles and friction");
        ParameterError::unless(!self.locates_contacts(shoot), name, f64::NAN, requirement)?;
        let from = shoot.state.time;
        if let Some(step) = self.grid.next(from)? {
            return self.followed(shoot, options, step);
        }
        let end = next_step_end(shoot, &self.laws, options)?;
        let StepEnd { time: to, discontinuity, kink, generation, target, .. } = end;
        let anchor = self.anchor(shoot, options, target);
        self.grid.push(GridStep { from, to, discontinuity, kink, generation, target, anchor, ..GridStep::default() });
        Ok(end)
    }

    /// Returns what is at the target (s) of a step. The end of the call has precedence: it is the same in each run.
    fn anchor(&self, shoot: &Shoot<impl Model>, options: &RunOptions, target: f64) -> Anchor {
        if target == options.until {
            return Anchor::Until;
        }
        let mut points = self.breaking_points(shoot);
        let found = points.find(|(time, _)| *time == target);
        found.map_or(Anchor::Discontinuity, |(_, anchor)| anchor)
    }

    /// Breaking points of the discontinuities in the history, s.
    fn breaking_points(&self, shoot: &Shoot<impl Model>) -> impl Iterator<Item = (f64, Anchor)> {
        let history = &shoot.state.history;
        let mut times: Vec<f64> = history.discontinuities().map(|level| history.time(level)).collect();
        times.reverse();
        let delays: Vec<f64> = self.laws.delays().collect();
        times.into_iter().enumerate().flat_map(move |(discontinuity, time)| {
            let point = |(delay, value): (usize, &f64)| (time + value, Anchor::BreakingPoint { discontinuity, delay });
            delays.iter().enumerate().map(point).collect::<Vec<_>>()
        })
    }

    /// Returns the end of a recorded step in a run with other parameters. Between the start of the step and its
    /// target the time is stretched in proportion.
    fn followed(&self, shoot: &Shoot<impl Model>, options: &RunOptions, step: &GridStep) -> Outcome<StepEnd> {
        let from = shoot.state.time;
        let refuse = |problem| Err(IntegrationError::Grid { time: from, problem });
        let target = match step.anchor {
            Anchor::Until => options.until,
            Anchor::Discontinuity => next_discontinuity_after(shoot, from)?,
            anchor => match self.breaking_points(shoot).find(|(_, other)| *other == anchor) {
                Some((time, _)) => time,
                None => return refuse("a discontinuity of it does not occur"),
            },
        };
        let time = if step.to == step.target {
            target
        } else {
            let share = (step.to - step.from) / (step.target - step.from);
            // If the parameters are those of the recorded run, both differences are zero, and the times are equal.
            step.to + (from - step.from) * (1.0 - share) + (target - step.target) * share
        };
        if !(time > from && time <= options.until) {
            return refuse("breaking points, discontinuities and ends of calls are in another order");
        }
        let &GridStep { discontinuity, kink, generation, .. } = step;
        Ok(StepEnd { discontinuity, kink, generation, ..StepEnd::smooth(time, target) })
    }
}
