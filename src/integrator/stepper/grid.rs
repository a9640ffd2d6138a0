//! Grid of a run: the ends of its steps and the changes of its elements, which another run can
//! follow.
//!
//! The number of steps and the elements depend on the parameters of a shoot by decisions, so that
//! the computed shape is discontinuous in the parameters. On the grid of one run it is smooth.
//! Differences of such runs are derivatives of the computed shape.

use super::{IntegrationError, Outcome, StepEnd};

/// Steps and changes of elements of a run of [`MethodOfSteps`](crate::integrator::MethodOfSteps),
/// in the order in which they were made.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grid {
    steps: Vec<GridStep>,
}

impl Grid {
    /// Number of steps.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps.len()
    }
}

/// A recorded step.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::integrator) struct GridStep {
    /// Start of the step, s.
    pub from: f64,
    /// End of the step.
    pub end: StepEnd,
    /// What is at the target of the step.
    pub anchor: Anchor,
    /// Changes of the elements at the start of the step, in their order.
    pub changes: Vec<Change>,
    /// Number of growing elements that leave the zone.
    pub leaving: usize,
    /// Index of the first of the two mature elements whose merger was tried last.
    pub merge_next: usize,
}

/// A time that steps must not pass. It depends on the parameters, and the steps before it move with
/// it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::integrator) enum Anchor {
    /// The end of the call of the integrator.
    #[default]
    Until,
    /// The next discontinuity of a law or the scene.
    Discontinuity,
    /// A breaking point: a discontinuity, counted from the last one backwards, and the index of a
    /// delay.
    BreakingPoint([usize; 2]),
}

/// A change of elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::integrator) enum Change {
    /// The mature element of this index is merged with the next one.
    Merge(usize),
    /// The element of this index is halved.
    Halve(usize),
    /// The element of this index is divided at the boundary that the growth zone will have at the
    /// end of the step.
    Cut(usize),
}

/// Use of grids by a stepper.
#[derive(Debug, Clone, Default)]
pub(in crate::integrator) enum GridUse {
    /// Steps and elements are chosen.
    #[default]
    Free,
    /// They are chosen and recorded.
    Record(Grid),
    /// They are those of a recorded run, from the step of the given index on.
    Follow(Grid, usize),
}

impl GridUse {
    /// Returns the number of steps that were recorded or followed.
    pub fn position(&self) -> usize {
        match self {
            Self::Free => 0,
            Self::Record(grid) => grid.steps.len(),
            Self::Follow(_, next) => *next,
        }
    }

    /// Returns to an earlier position.
    pub fn rewind(&mut self, position: usize) {
        match self {
            Self::Free => {}
            Self::Record(grid) => grid.steps.truncate(position),
            Self::Follow(_, next) => *next = position,
        }
    }

    /// Adds a step, whose changes of elements follow.
    pub fn push(&mut self, step: GridStep) {
        if let Self::Record(grid) = self {
            grid.steps.push(step);
        }
    }

    /// The step that is being recorded.
    pub fn recorded(&mut self) -> Option<&mut GridStep> {
        match self {
            Self::Record(grid) => grid.steps.last_mut(),
            _ => None,
        }
    }

    /// The next step to follow, at a time (s).
    pub fn next(&self, time: f64) -> Outcome<Option<&GridStep>> {
        let Self::Follow(grid, next) = self else {
            return Ok(None);
        };
        let problem = "it has no further step";
        grid.steps
            .get(*next)
            .map(Some)
            .ok_or(IntegrationError::Grid { time, problem })
    }

    /// The step that is being followed, at a time (s).
    pub fn take_next(&mut self) -> Option<GridStep> {
        let Self::Follow(grid, next) = self else {
            return None;
        };
        *next += 1;
        grid.steps.get(*next - 1).cloned()
    }
}
