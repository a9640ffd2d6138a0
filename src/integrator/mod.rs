//! Integration of a shoot in time.
//!
//! `stepper` makes the steps, [`MethodOfSteps`] uses steps of a given length, and [`Adaptive`] chooses them.

mod adaptive;
mod error;
mod events;
mod method_of_steps;
mod simulation;
mod statistics;
mod stepper;
mod undo;

pub use crate::state::{EmptyHistory, GivenHistory, HistoryFunction, SteadyHistory};
pub use adaptive::Adaptive;
pub use error::IntegrationError;
pub use method_of_steps::MethodOfSteps;
pub use simulation::Simulation;
pub use statistics::Statistics;

use crate::model::Model;
use crate::shoot::Shoot;

/// Order in time. Stimuli are interpolated through this number of levels, the variables are collocated at this number of points, and
/// between levels they are cubic. Three levels would give a third order, five still the fourth of the cubic.
const ORDER: usize = 4;

/// First step after a discontinuity over a full step. The following steps double the time since then. The stimuli of the first step are
/// interpolated through two levels only: an error of third order, in a step 64 times shorter.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// Largest number of parts of a step for which growth permits only short ones. Each part leaves an element behind.
const MAX_PARTS: f64 = 1024.0;

/// Largest number of halvings of an interval: 2⁻⁴⁰ = 1e-12 of it is near the rounding of times.
const MAX_HALVINGS: usize = 40;

/// Relative difference of times, lengths and norms that is attributed to rounding: the square root of the rounding error, about.
const ROUNDING: f64 = 1e-9;

/// A method that integrates a shoot in time. After an error the shoot is as it was before the call.
pub trait Integrator {
    /// Finds the equilibrium of a shoot at its present time and gives its laws a history. The other methods do this with
    /// [`EmptyHistory`] if it was not done before. A second call begins a new history.
    ///
    /// # Errors
    /// See [`IntegrationError`].
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError>;

    /// Advances the shoot to time `until` (s). Steps end at every discontinuity that its laws announce. Laws are read a few
    /// units of rounding before and after a discontinuity, never at it. At the time of a discontinuity the shoot has the shape after it.
    ///
    /// # Errors
    /// See [`IntegrationError`].
    fn advance(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Result<Statistics, IntegrationError> {
        self.advance_at_most(shoot, until, usize::MAX)
    }

    /// Advances the shoot towards time `until` (s), by at most `max_steps` steps.
    ///
    /// # Errors
    /// See [`IntegrationError`].
    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError>;

    /// Makes one of the steps by which [`advance`](Self::advance) reaches time `until` (s), to observe the shoot after every step. There is
    /// no step if the shoot is at that time already.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// let mut integrator = MethodOfSteps::new(600.0);
    /// while shoot.time() < 7200.0 {
    ///     integrator.step(&mut shoot, 7200.0)?;
    ///     println!("{} s: {:?}", shoot.time(), shoot.tip());
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// See [`IntegrationError`].
    fn step(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Result<Statistics, IntegrationError> {
        self.advance_at_most(shoot, until, 1)
    }

    /// Advances the shoot until a condition first holds (event location), at the latest until the time `latest` (s). The condition is a
    /// function of the shoot that is negative before and zero or positive from then on. It is evaluated after every step. If its sign has
    /// changed in a step, the time of that is found by shorter steps. It should be continuous there. **An event that begins and
    /// ends within one step is not detected:** use a condition whose sign stays, such as a component that passes through zero, or
    /// steps that are short compared with the event. [`Adaptive`] chooses its steps for the whole time until `latest` beforehand: a
    /// `latest` soon after the event costs least.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// // Until it is 6 cm long, within ten days.
    /// MethodOfSteps::new(600.0).advance_until(&mut shoot, 864e3, |shoot| shoot.rod().length() - 0.06)?;
    /// assert!((shoot.time() - 72e3 * f64::ln(6.0 / 5.0)).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// A shoot that no longer moves: `|shoot| 1e-9 - shoot.steering_rate()`, in rad/s.
    ///
    /// # Errors
    /// [`NotReached`](IntegrationError::NotReached) if the condition does not hold by then, and all others. To keep the shape that was
    /// reached, write a loop over [`step`](Self::step) instead.
    fn advance_until<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        latest: f64,
        condition: impl FnMut(&Shoot<M>) -> f64,
    ) -> Result<Statistics, IntegrationError>
    where
        Self: Sized,
    {
        events::advance_until(self, shoot, latest, condition)
    }

    /// Advances the shoot to time `until` (s), and shows it at given output times on the way, in increasing order. The output times do not
    /// change the steps of [`MethodOfSteps`]. An output time between two steps costs one further equilibrium, and does not count as a
    /// step.
    ///
    /// ```
    /// # use morphorod::{Shoot, constitutive::LinearElastic, growth::UniformGrowth};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.07, time: 72e3 }).build()?;
    /// let minutes = (0..=60).map(|minute| 60.0 * f64::from(minute));
    /// let mut path = Vec::new();
    /// MethodOfSteps::new(600.0).advance_showing(&mut shoot, 3600.0, minutes, |shoot| path.push(shoot.tip()))?;
    /// assert_eq!(path.len(), 61);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// An output time that is before the one before it, before the present, or after `until`, and all others.
    fn advance_showing<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        until: f64,
        times: impl IntoIterator<Item = f64>,
        show: impl FnMut(&Shoot<M>),
    ) -> Result<Statistics, IntegrationError>
    where
        Self: Sized,
    {
        events::advance_showing(self, shoot, until, times, show)
    }
}
