//! Integration of a shoot in time.
//!
//! `stepper` makes the steps, and [`TimeStepper`] is its public interface. [`MethodOfSteps`] uses
//! steps of a given length, and [`Adaptive`] chooses them.

mod adaptive;
mod error;
mod events;
mod method_of_steps;
mod simulation;
mod statistics;
mod stepper;
mod time_stepper;
mod undo;

pub use crate::state::{ConstantHistory, HistoryFunction};
pub use adaptive::{Adaptive, AdaptiveWorkspace};
pub use error::IntegrationError;
pub use method_of_steps::MethodOfSteps;
pub use simulation::Simulation;
pub use statistics::Statistics;
pub use stepper::{Grid, PointStep, TimeStep};
pub use time_stepper::TimeStepper;

use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::ORDER;
use error::Outcome;

/// Ratio of the first step after a discontinuity to a full step. The following steps double the
/// time since the discontinuity. The stimuli of the first step are interpolated through two levels
/// only. This is an error of third order in a step that is 64 times shorter.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// Largest number of halvings of an interval: 2⁻⁴⁰ = 1e-12 of it is near the rounding of times.
const MAX_HALVINGS: usize = 40;

/// Relative difference of times, lengths and norms that is attributed to rounding: about the square
/// root of the machine precision.
const ROUNDING: f64 = 1e-9;

/// A method that integrates a shoot in time. After an error the state of the shoot is the one
/// before the call.
pub trait Integrator: Sized {
    /// Solves the equilibrium of a shoot at its present time, and sets the history of its laws. The
    /// other methods do this with [`ConstantHistory::Empty`] for a shoot that was never started. A
    /// second call begins a new history.
    ///
    /// # Errors
    /// - [`Parameter`](IntegrationError::Parameter): a setting is out of range, or the rates of a
    ///   declared memory are not those of a memory.
    /// - [`Equilibrium`](IntegrationError::Equilibrium): the equilibrium was not found.
    /// - [`NotFinite`](IntegrationError::NotFinite): a law, the scene or the history returned NaN
    ///   or infinity.
    /// - [`ToleranceNotMet`](IntegrationError::ToleranceNotMet): [`Adaptive`] would need too many
    ///   elements.
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Outcome<Statistics>;

    /// Advances the shoot to time `until` (s). Steps end at every discontinuity that the laws
    /// announce, and where a contact begins or ends. Laws are evaluated a few units of rounding
    /// before and after a discontinuity, never at it. At the time of a discontinuity the shoot has
    /// the shape after it.
    ///
    /// # Errors
    /// The errors of [`start`](Self::start), and:
    /// - [`Parameter`](IntegrationError::Parameter): `until` is in the past, or the history does
    ///   not fit the laws.
    /// - [`NotConverged`](IntegrationError::NotConverged),
    ///   [`Variables`](IntegrationError::Variables),
    ///   [`GrowsTooFast`](IntegrationError::GrowsTooFast), [`Uneven`](IntegrationError::Uneven),
    ///   [`BaseTurns`](IntegrationError::BaseTurns): the step is too long.
    /// - [`GrowsTooFar`](IntegrationError::GrowsTooFar): the shoot would grow by more than 1000
    ///   growth zones.
    /// - [`ToleranceNotMet`](IntegrationError::ToleranceNotMet): [`Adaptive`] would exceed its
    ///   limit of work.
    /// - [`WorkLimit`](IntegrationError::WorkLimit): the limit of work that a setting of the
    ///   integrator gives.
    /// - [`NotSlender`](IntegrationError::NotSlender): the response of the laws diverges.
    fn advance(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Outcome<Statistics> {
        self.advance_at_most(shoot, until, usize::MAX)
    }

    /// Advances the shoot towards time `until` (s), by at most `max_steps` steps. A call with zero
    /// steps starts a shoot that was not started, and may choose a resolution; it does not change
    /// the time. Enough steps set the time to exactly `until`, and no step passes it.
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance).
    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Outcome<Statistics>;

    /// Makes one of the steps by which [`advance`](Self::advance) reaches time `until` (s), so that
    /// the shoot can be observed after every step. No step is made if the shoot is at that time
    /// already.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
    /// # let mut shoot = parameters.shoot().build()?;
    /// let mut integrator = MethodOfSteps::new(600.0);
    /// while shoot.time() < 7200.0 {
    ///     integrator.step(&mut shoot, 7200.0)?;
    ///     println!("{} s: {:?}", shoot.time(), shoot.tip());
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance).
    fn step(&mut self, shoot: &mut Shoot<impl Model>, until: f64) -> Outcome<Statistics> {
        self.advance_at_most(shoot, until, 1)
    }

    /// Advances the shoot until a condition first holds (event location), at the latest until the
    /// time `latest` (s).
    ///
    /// The condition is a function of the shoot that is negative before the event, and zero or
    /// positive from then on. It is evaluated after every step. If its sign has changed in a step,
    /// shorter steps locate the time of the change. The function should be continuous there. **An
    /// event that begins and ends within one step is not detected:** use a condition whose sign
    /// stays, such as a component that passes through zero, or steps that are short compared with
    /// the event. [`Adaptive`] chooses its steps for the whole time until `latest` beforehand: a
    /// `latest` soon after the event costs least.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
    /// # let mut shoot = parameters.shoot().build()?;
    /// // Until it is 6 cm long, within ten days.
    /// MethodOfSteps::new(600.0).advance_until(&mut shoot, 864e3, |shoot| shoot.rod().length() - 0.06)?;
    /// assert!((shoot.time() - 72e3 * f64::ln(6.0 / 5.0)).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// The condition for a shoot that no longer moves is `|shoot| 1e-9 - shoot.steering_rate()`, in
    /// rad/s.
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance), [`Parameter`](IntegrationError::Parameter) for an
    /// integrator that does not reach a requested time or passes it,
    /// [`NotFinite`](IntegrationError::NotFinite) for a condition that is NaN, and
    /// [`NotReached`](IntegrationError::NotReached) if the condition does not hold by the time
    /// `latest`. To keep the shape at that time, write a loop over [`step`](Self::step) instead.
    fn advance_until<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        latest: f64,
        condition: impl FnMut(&Shoot<M>) -> f64,
    ) -> Outcome<Statistics> {
        self.advance_showing_until(shoot, latest, [], |_| {}, condition)
    }

    /// Advances the shoot to time `until` (s), and passes it to `show` at given output times on the
    /// way, in increasing order. The output times do not change the steps of [`MethodOfSteps`]. An
    /// output time between two steps costs one further equilibrium, and does not count as a step.
    ///
    /// ```
    /// # use morphorod::ShootParameters;
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
    /// # let mut shoot = parameters.shoot().build()?;
    /// let minutes = (0..=60).map(|minute| 60.0 * f64::from(minute));
    /// let mut path = Vec::new();
    /// MethodOfSteps::new(600.0).advance_showing(&mut shoot, 3600.0, minutes, |shoot| path.push(shoot.tip()))?;
    /// assert_eq!(path.len(), 61);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance), and [`Parameter`](IntegrationError::Parameter) for
    /// an output time that is before the present or an earlier output time, or after `until`, and
    /// for an integrator that does not reach a requested time or passes it. Calls of `show` before
    /// an error are not undone.
    fn advance_showing<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        until: f64,
        times: impl IntoIterator<Item = f64>,
        show: impl FnMut(&Shoot<M>),
    ) -> Outcome<Statistics> {
        let condition = None::<fn(&Shoot<M>) -> f64>;
        events::advance_showing_until(self, shoot, until, times, show, condition)
    }

    /// Advances the shoot until a condition first holds, as [`advance_until`](Self::advance_until),
    /// and passes it to `show` at output times on the way, as
    /// [`advance_showing`](Self::advance_showing). Output times after the event have no effect.
    ///
    /// ```
    /// # use morphorod::{Shoot, ShootParameters};
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # let parameters = ShootParameters { length: 0.05, growth_time: 72e3, ..Default::default() };
    /// # let mut shoot = parameters.shoot().build()?;
    /// let hours = (0..240).map(|hour| 3600.0 * f64::from(hour));
    /// let mut lengths = Vec::new();
    /// let record = |shoot: &Shoot<_>| lengths.push(shoot.rod().length());
    /// MethodOfSteps::new(600.0)
    ///     .advance_showing_until(&mut shoot, 864e3, hours, record, |shoot| shoot.rod().length() - 0.06)?;
    /// assert_eq!(lengths.len(), 4); // 6 cm are reached after 3.6 h
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of both methods.
    fn advance_showing_until<M: Model>(
        &mut self,
        shoot: &mut Shoot<M>,
        latest: f64,
        times: impl IntoIterator<Item = f64>,
        show: impl FnMut(&Shoot<M>),
        condition: impl FnMut(&Shoot<M>) -> f64,
    ) -> Outcome<Statistics> {
        events::advance_showing_until(self, shoot, latest, times, show, Some(condition))
    }
}
