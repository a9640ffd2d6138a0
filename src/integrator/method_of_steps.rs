//! The method of steps for delay differential equations, with corrections for steps longer than the
//! shortest delay.

use super::error::Outcome;
use super::stepper::{GridUse, MAX_CORRECTIONS, Run, RunOptions};
use super::undo::undo_on_error;
use super::{Grid, HistoryFunction, Integrator, Statistics, TimeStepper};
use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
use crate::model::Model;
use crate::shoot::Shoot;

/// Integrator of fourth order in time with a fixed longest step, for laws with any delay.
///
/// A step that is not longer than the shortest delay depends only on the past. It is explicit: the
/// intrinsic strain at its end is a quadrature, one equilibrium determines the shape, and the laws'
/// variables are integrated with the stimuli of the last four equilibria, interpolated in time.
///
/// A longer step, or a step of laws without delay, is implicit. It is solved by fixed-point
/// iteration: the step is repeated with the variables at its end until an angle changes by less
/// than [`tolerance`](Self::tolerance). The iteration contracts by about the step times the fastest
/// rate of response. Each correction costs one equilibrium. [`guide::method`](crate::guide::method)
/// describes the method and its order of accuracy.
#[derive(Debug, Clone)]
pub struct MethodOfSteps<E = NewtonSolver> {
    /// Longest step, s.
    pub step: f64,
    /// Largest change of an angle in the last correction of an implicit step, rad; positive, 1e-8
    /// by default.
    pub tolerance: f64,
    /// Largest number of corrections of an implicit step.
    pub max_corrections: usize,
    /// Largest number of times in a call that a step is repeated with half its length after a
    /// recoverable error; zero by default. [`Statistics::retries`] counts these repetitions.
    pub retries: usize,
    /// Largest [`work`](Statistics::work) of a call, without limit by default. It is checked after
    /// every equilibrium, and [`NewtonSolver::max_iterations`] limits the work of one.
    /// [`advance_until`](Integrator::advance_until) and the methods with output times call the
    /// integrator once for each step, and the limit holds for each of these calls.
    pub max_work: usize,
    /// Solver of the equilibria.
    pub solver: E,
    /// The steps, with the memory that successive calls reuse; `..MethodOfSteps::new(step)` sets
    /// it.
    pub workspace: TimeStepper,
}

impl MethodOfSteps<NewtonSolver> {
    /// An integrator with steps of `step` seconds, and Newton's method with a tolerance of 1e-8 rad
    /// for the equilibria. This tolerance is well below the error in time of usual steps. The step
    /// must be positive; `advance` returns an error otherwise.
    #[must_use]
    pub fn new(step: f64) -> Self {
        Self::with_solver(step, NewtonSolver::with_tolerance(1e-8))
    }
}

impl<E> MethodOfSteps<E> {
    /// An integrator with steps of `step` seconds, which must be positive, and a given solver of
    /// the equilibria. At most 30 corrections of a step reduce their change of angles to 1e-8 rad.
    #[must_use]
    pub fn with_solver(step: f64, solver: E) -> Self {
        let workspace = TimeStepper::default();
        let (max_corrections, max_work) = (MAX_CORRECTIONS, usize::MAX);
        Self {
            step,
            tolerance: 1e-8,
            max_corrections,
            retries: 0,
            max_work,
            solver,
            workspace,
        }
    }

    /// Records the grid of the following calls, until [`take_grid`](Self::take_grid).
    ///
    /// The grid consists of the ends of all steps and the changes of the elements. A call returns
    /// an error for a shoot that may touch obstacles and whose laws have stimuli, since its steps
    /// end where contacts change.
    pub fn record(&mut self) {
        self.workspace.stepper.grid = GridUse::Record(Grid::default());
    }

    /// Follows a recorded grid in the following calls, until [`take_grid`](Self::take_grid).
    ///
    /// The calls have to be those of the recorded run, for a shoot that differs from the recorded
    /// one by its parameters. With equal parameters both runs are equal bit by bit. Breaking points
    /// and discontinuities move with the parameters, and the steps before them are stretched. A
    /// call returns [`Grid`](super::IntegrationError::Grid) if a recorded step or division of an
    /// element is impossible with the other parameters.
    pub fn follow(&mut self, grid: Grid) {
        self.workspace.stepper.grid = GridUse::Follow(grid, 0);
    }

    /// Ends recording or following, and returns the grid; an empty one if neither took place.
    pub fn take_grid(&mut self) -> Grid {
        match std::mem::take(&mut self.workspace.stepper.grid) {
            GridUse::Free => Grid::default(),
            GridUse::Record(grid) | GridUse::Follow(grid, _) => grid,
        }
    }
}

impl<E: EquilibriumSolver> Integrator for MethodOfSteps<E> {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Outcome<Statistics> {
        let Self {
            solver, workspace, ..
        } = self;
        workspace.start(shoot, solver, history)
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Outcome<Statistics> {
        let options = RunOptions {
            until,
            step: self.step,
            max_steps,
            max_work: self.max_work,
            retries: self.retries,
            tolerance: self.tolerance,
            max_corrections: self.max_corrections,
            mesh: shoot.mesh,
            coarsest_step: None,
            known: None,
        };
        let Self {
            solver,
            workspace:
                TimeStepper {
                    stepper,
                    before_call,
                    ..
                },
            ..
        } = self;
        let position = stepper.grid.position();
        undo_on_error(shoot, before_call, |shoot, _| {
            Run {
                stepper,
                shoot,
                solver,
            }
            .advance(options, |_, _| ())
        })
        .inspect_err(|_| self.workspace.stepper.grid.rewind(position))
    }
}
