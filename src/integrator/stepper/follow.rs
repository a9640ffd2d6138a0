//! Recording of the grid of a run, and steps on a recorded grid.

use super::grid::{Anchor, GridStep, GridUse};
use super::step_end::{StepEnd, breaking_points, next_discontinuity_after, next_step_end};
use super::{IntegrationError, Outcome, RunOptions, Stepper};
use crate::error::ParameterError;
use crate::model::Model;
use crate::shoot::Shoot;

impl Stepper {
    /// Returns the end of the next step: that of the recorded grid, or a new one, which may be
    /// recorded.
    pub(super) fn choose_step_end(
        &mut self,
        shoot: &Shoot<impl Model>,
        options: &RunOptions,
    ) -> Outcome<StepEnd> {
        if matches!(self.grid, GridUse::Free) {
            return next_step_end(shoot, &self.laws, options);
        }
        let (name, requirement) = (
            "support of a run with a recorded grid",
            "one without obstacles, if the laws have stimuli",
        );
        ParameterError::unless(!self.locates_contacts(shoot), name, f64::NAN, requirement)?;
        let from = shoot.state.time;
        if let Some(step) = self.grid.next(from)? {
            return self.followed(shoot, options, step);
        }
        let end = next_step_end(shoot, &self.laws, options)?;
        let anchor = self.anchor(shoot, options, end.target);
        self.grid.push(GridStep {
            from,
            end,
            anchor,
            ..GridStep::default()
        });
        Ok(end)
    }

    /// Returns what is at the target (s) of a step. The end of the call has precedence: it is the
    /// same in each run.
    fn anchor(&self, shoot: &Shoot<impl Model>, options: &RunOptions, target: f64) -> Anchor {
        if target == options.until {
            return Anchor::Until;
        }
        let found =
            breaking_points(&shoot.state.history, &self.laws).find(|(time, _)| *time == target);
        found.map_or(Anchor::Discontinuity, |(_, indices)| {
            Anchor::BreakingPoint(indices)
        })
    }

    /// Returns the end of a recorded step in a run with other parameters. Between the start of the
    /// step and its target the time is stretched in proportion.
    fn followed(
        &self,
        shoot: &Shoot<impl Model>,
        options: &RunOptions,
        step: &GridStep,
    ) -> Outcome<StepEnd> {
        let from = shoot.state.time;
        let refused = |problem| IntegrationError::Grid {
            time: from,
            problem,
        };
        let target = match step.anchor {
            Anchor::Until => options.until,
            Anchor::Discontinuity => next_discontinuity_after(shoot, from)?,
            Anchor::BreakingPoint(indices) => {
                let point = breaking_points(&shoot.state.history, &self.laws)
                    .find(|(_, other)| *other == indices);
                point
                    .ok_or(refused("a discontinuity of it does not occur"))?
                    .0
            }
        };
        let end = step.end;
        let time = if end.time == end.target {
            target
        } else {
            let share = (end.time - step.from) / (end.target - step.from);
            // If the parameters are those of the recorded run, both differences are zero, and the
            // times are equal.
            end.time + (from - step.from) * (1.0 - share) + (target - end.target) * share
        };
        if !(time > from && time <= options.until) {
            return Err(refused(
                "breaking points, discontinuities and ends of calls are in another order",
            ));
        }
        Ok(StepEnd {
            time,
            target,
            ..end
        })
    }
}
