//! An integrator without equilibria, for shoots without weight. The solver [`Unloaded`] integrates
//! the shape from the intrinsic strain.

use morphorod::equilibrium::Unloaded;
use morphorod::integrator::{
    HistoryFunction, IntegrationError, Integrator, Statistics, TimeStepper,
};
use morphorod::{Model, Shoot};

use super::heun::midpoint;

/// The midpoint rule for the intrinsic strain, without equilibria.
pub struct Kinematic {
    /// Longest step, s.
    pub step: f64,
    pub parts: TimeStepper,
}

impl Kinematic {
    pub fn new(step: f64) -> Self {
        Self {
            step,
            parts: TimeStepper::default(),
        }
    }
}

impl Integrator for Kinematic {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.parts.start(shoot, &mut Unloaded, history)
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let Self { step, parts } = self;
        parts.undo_on_error(shoot, |parts, shoot| {
            let mut cost = parts.prepare(shoot, &mut Unloaded, until)?;
            while shoot.time() < until && cost.steps < max_steps {
                let end = parts.next_end(shoot, *step, until)?;
                let mut shape = Unloaded;
                let mut step = parts.begin(shoot, &mut shape, end)?;
                midpoint(&mut step)?;
                let _ = step.equilibrate()?;
                step.sense()?;
                step.integrate_variables()?;
                cost += step.finish()?;
            }
            Ok(cost)
        })
    }
}
