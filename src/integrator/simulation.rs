//! Shoots with different laws as one type.

use super::error::Outcome;
use super::{Integrator, Statistics};
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::{State, StateError};

/// A shoot with its integrator, independent of the types of its laws. The pair `(shoot,
/// integrator)` implements it. The trait is object safe: shoots with different laws can be elements
/// of one list.
///
/// ```
/// use morphorod::Shoot;
/// use morphorod::constitutive::LinearElastic;
/// use morphorod::growth::UniformGrowth;
/// use morphorod::integrator::{MethodOfSteps, Simulation};
/// use morphorod::load::Weight;
///
/// let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
/// let bare = Shoot::builder(tissue).length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.03, time: 72e3 });
/// let heavy = bare.clone().load(Weight { density: 1000.0 });
/// let mut all: Vec<Box<dyn Simulation + Send>> = vec![
///     Box::new((bare.build()?, MethodOfSteps::new(300.0))),
///     Box::new((heavy.build()?, MethodOfSteps::new(300.0))),
/// ];
/// for simulation in &mut all {
///     simulation.advance(3600.0)?;
///     println!("{:?}", simulation.state().rod().tip());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Simulation {
    /// Advances the shoot to time `until` (s), as [`Integrator::advance`].
    ///
    /// # Errors
    /// The errors of [`Integrator::advance`]. The state is then the one before the call.
    fn advance(&mut self, until: f64) -> Outcome<Statistics>;

    /// Makes one step towards time `until` (s), as [`Integrator::step`].
    ///
    /// # Errors
    /// The errors of [`Integrator::advance`]. The state is then the one before the call.
    fn step(&mut self, until: f64) -> Outcome<Statistics>;

    /// Returns the state of the shoot.
    fn state(&self) -> &State;

    /// Restores a state, as [`Shoot::restore`].
    ///
    /// # Errors
    /// The errors of [`Shoot::restore`]: the state is damaged or belongs to other laws. The shoot
    /// keeps its state then.
    fn restore(&mut self, state: &State) -> Result<(), StateError>;
}

impl<M: Model, I: Integrator> Simulation for (Shoot<M>, I) {
    fn advance(&mut self, until: f64) -> Outcome<Statistics> {
        self.1.advance(&mut self.0, until)
    }

    fn step(&mut self, until: f64) -> Outcome<Statistics> {
        self.1.step(&mut self.0, until)
    }

    fn state(&self) -> &State {
        self.0.state()
    }

    fn restore(&mut self, state: &State) -> Result<(), StateError> {
        self.0.restore(state)
    }
}
