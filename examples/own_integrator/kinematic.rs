//! An integrator without equilibria, for shoots without weight: growth and differential growth determine the shape.

use morphorod::ParameterError;
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver};
use morphorod::integrator::{HistoryFunction, IntegrationError, Integrator, Statistics, TimeStepper};
use morphorod::load::InternalForce;
use morphorod::rod::Rod;
use morphorod::{Model, Shoot};
use nalgebra::UnitQuaternion;

/// The shape whose strain is the intrinsic one, for rods of order two: each element rotates by its intrinsic strain
/// times its length. It takes the place of a solver, but solves nothing.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics;

impl EquilibriumSolver for Kinematics {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        _material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        let points = rod.order().points();
        ParameterError::unless(points == 1, "number of points in an element", points as f64, "one (order two)")?;
        ParameterError::unless(force.largest() == 0.0, "force in the rod", force.largest(), "zero (N)")?;
        let mut frames = vec![rod.frames()[0]];
        for (point, element) in rod.points().iter().zip(0..) {
            let turn = point.intrinsic * rod.element_length(element).unwrap_or(0.0);
            let frame = frames[element] * UnitQuaternion::from_scaled_axis(turn);
            frames.push(UnitQuaternion::new_normalize(frame.into_inner()));
        }
        rod.set_shape(&frames, &[])?;
        Ok(Equilibrium::default())
    }
}

/// The midpoint rule for the intrinsic strain, without equilibria.
pub struct Kinematic {
    /// Longest step, s.
    pub step: f64,
    pub parts: TimeStepper,
}

impl Kinematic {
    pub fn new(step: f64) -> Self {
        Self { step, parts: TimeStepper::default() }
    }
}

impl Integrator for Kinematic {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.parts.start(shoot, &mut Kinematics, history)
    }

    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let Self { step, parts } = self;
        parts.undo_on_error(shoot, |parts, shoot| {
            let mut cost = parts.resume(shoot, &mut Kinematics)?;
            while shoot.time() < until && cost.steps < max_steps {
                let end = parts.next_end(shoot, *step, until)?;
                let mut shape = Kinematics;
                let mut step = parts.begin(shoot, &mut shape, end)?;
                let mut changes = Vec::new();
                for point in step.points() {
                    let [from, to] = step.growing(point).unwrap_or(step.times());
                    changes.push(step.strain_rate(point, 0.5 * (from + to))? * (to - from));
                }
                step.set_strain(&changes)?;
                let _ = step.equilibrate()?;
                step.sense()?;
                step.integrate_variables()?;
                cost += step.finish()?;
            }
            Ok(cost)
        })
    }
}
