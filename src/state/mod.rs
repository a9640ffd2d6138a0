//! State of a shoot: all data on which its future depends, as one value.

mod contact;
mod error;
mod history;
mod history_function;
mod plan;
mod predictor;
#[cfg(feature = "serde")]
mod saved;

use std::fmt;

use nalgebra::Vector3;

pub(crate) use contact::ContactState;
pub use error::StateError;
pub(crate) use history::{History, LEVELS, Nodes, ORDER, Reading, Spare};
pub use history_function::{ConstantHistory, HistoryFunction};
pub(crate) use plan::Plan;
pub(crate) use predictor::{Moments, Predictor, intrinsic_moments};
#[cfg(feature = "serde")]
pub(crate) use saved::check_format;

use crate::error::ParameterError;
use crate::rod::{MaterialPoint, Rod};
use crate::scene::after;
use crate::support::Support;

/// Number of the format of serialised states. It must be increased whenever the serialised data
/// change.
pub(crate) const FORMAT: u32 = 15;

/// Distance in time, relative to a step, below which only one of two levels or equilibria is used
/// for interpolation. Stimuli are accurate to 1e-11 or better. Extrapolation of their difference
/// over a step magnifies this error by the inverse of the distance.
pub(crate) const CLOSE: f64 = 1e-3;

/// State of a shoot: time, material points with their intrinsic strains, frames, and the history of
/// the laws' variables.
///
/// It is a plain value, which can be cloned, compared, stored, and restored with
/// [`Shoot::restore`](crate::Shoot::restore). A run from a restored state repeats the original run
/// bit by bit.
///
/// With the feature `serde` a state is serialised with the number of its format. Deserialisation
/// returns an error for damaged data and for data of another format.
#[derive(Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(remote = "Self"))]
pub struct State {
    #[cfg(feature = "serde")]
    #[serde(deserialize_with = "saved::read_format")]
    format: u32,
    pub(crate) time: f64,
    pub(crate) rod: Rod,
    pub(crate) predictor: Predictor,
    pub(crate) history: History,
    /// Time at which the run began, or of the last discontinuity, s. Interpolation in time uses no
    /// level from before it.
    pub(crate) smooth_since: f64,
    /// Gravity in the last equilibrium, m/s²: with the base of the rod, the part of the scene by
    /// which a state is recognised.
    pub(crate) gravity: Vector3<f64>,
    /// Whether the laws were exchanged at the present time. The next call of an integrator passes
    /// this discontinuity.
    pub(crate) changed: bool,
    /// Index of the first of the two mature elements whose merger was tried last.
    pub(crate) merge_next: usize,
    /// Resolution that `Adaptive` has chosen last. No other integrator uses it.
    pub(crate) plan: Option<Plan>,
    /// Contacts, the shape with their nodes, and the rates of contacts and reactions.
    pub(crate) contact: ContactState,
}

/// Prints a summary, since a state has thousands of numbers.
impl fmt::Debug for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (variables, stimuli) = self.history.size();
        f.debug_struct("State")
            .field("time", &self.time)
            .field("length", &self.rod.length())
            .field("tip", &self.shape().tip().as_slice())
            .field("elements", &self.rod.elements())
            .field("variables", &variables)
            .field("stimuli", &stimuli)
            .field("levels", &self.history.levels())
            .finish_non_exhaustive()
    }
}

impl State {
    /// State at t = 0 of a rod that no integrator has started.
    pub(crate) fn new(rod: Rod) -> Self {
        Self {
            #[cfg(feature = "serde")]
            format: FORMAT,
            time: 0.0,
            rod,
            predictor: Predictor::default(),
            history: History::default(),
            smooth_since: 0.0,
            gravity: Vector3::zeros(),
            changed: false,
            merge_next: 0,
            plan: None,
            contact: ContactState::default(),
        }
    }

    /// Copies `source` without new allocations if the capacity suffices.
    pub(crate) fn copy_from(&mut self, source: &Self) {
        (self.time, self.smooth_since, self.changed) =
            (source.time, source.smooth_since, source.changed);
        (self.gravity, self.merge_next, self.plan) =
            (source.gravity, source.merge_next, source.plan);
        self.rod.copy_from(&source.rod);
        self.predictor.copy_from(&source.predictor);
        self.history.copy_from(&source.history);
        // A copy of the empty state without a support allocates nothing.
        self.contact.clone_from(&source.contact);
    }

    /// Removes reactions and contacts.
    fn release(&mut self) {
        self.contact = ContactState::default();
        self.rod.reactions.clear();
    }

    /// Removes reactions and contacts if there is no support, since the equilibrium of a free rod
    /// does not update the contacts.
    pub(crate) fn release_if_absent(&mut self, support: &impl Support) {
        if support.is_absent() {
            self.release();
        }
    }

    /// Drops the history, so that no integrator has started this state. Keeps the rod and its
    /// frames.
    pub(crate) fn forget(&mut self) {
        (self.predictor, self.history) = (Predictor::default(), History::default());
        self.release();
        (self.smooth_since, self.changed, self.plan) = (self.time, false, None);
    }

    /// Returns an error if a number of the state is invalid, or if its parts do not fit each other.
    pub(crate) fn check(&self) -> Result<(), StateError> {
        ParameterError::finite("time of the state", self.time, "s")?;
        let since = self.smooth_since;
        let ok = since.is_finite() && since <= self.time;
        ParameterError::unless(
            ok,
            "start of the run or last discontinuity",
            since,
            "not in the future (s)",
        )?;
        ParameterError::finite("gravity of the state", self.gravity.sum(), "m/s²")?;
        self.rod.check()?;
        let (name, pair) = (
            "index of the pair whose merger was tried last",
            self.merge_next,
        );
        ParameterError::unless(
            pair < self.rod.elements(),
            name,
            pair as f64,
            "that of an element",
        )?;
        self.plan.map_or(Ok(()), |plan| plan.check())?;
        self.contact.check(&self.rod)?;
        self.predictor.check(
            self.rod.rotations.len(),
            self.time,
            self.history.levels() > 0,
        )?;
        Ok(self
            .history
            .check(self.rod.zone().len(), self.time, since)?)
    }

    /// Returns an error unless the history, if there is one, has the numbers of variables and
    /// stimuli of the laws.
    pub(crate) fn check_laws(&self, expected: (usize, usize)) -> Result<(), StateError> {
        let found = self.history.size();
        let ok = self.history.levels() == 0 || found == expected;
        if ok {
            Ok(())
        } else {
            Err(StateError::Laws { found, expected })
        }
    }

    /// Returns an error unless the history covers the longest delay of the laws, s.
    pub(crate) fn check_reach(&self, longest_delay: f64) -> Result<(), ParameterError> {
        let reach = self
            .history
            .oldest()
            .map_or(0.0, |oldest| self.time - oldest);
        let ok = longest_delay <= reach * (1.0 + 1e-9);
        let requirement = "at most the time that the shoot's history covers (s); `with_model_restarted` drops the history";
        ParameterError::unless(ok, "longest delay of the laws", longest_delay, requirement)
    }

    /// Returns an error unless the rod is shorter than `longest`, m.
    pub(crate) fn check_length(&self, longest: f64) -> Result<(), ParameterError> {
        let (length, requirement) = (
            self.rod.length(),
            "less than a million of the shoot's elements (m)",
        );
        ParameterError::unless(length < longest, "length of the rod", length, requirement)
    }

    /// The time at which laws and scene are evaluated for the present shape, s: after a
    /// discontinuity at the present.
    pub(crate) fn time_of_laws(&self) -> f64 {
        if self.time == self.smooth_since {
            after(self.time)
        } else {
            self.time
        }
    }

    /// The rod in its shape, with additional nodes where contacts begin and end.
    pub(crate) fn shape(&self) -> &Rod {
        self.contact.shape.as_ref().unwrap_or(&self.rod)
    }

    /// Time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Rod: material points and shape. In contact with an obstacle its shape is sampled at its
    /// nodes; [`Shoot::rod`](crate::Shoot::rod) is exact.
    #[must_use]
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// Variables of the tropism laws at a material point of the growth zone. `point` is the index
    /// among all points of the rod. `None` for a mature point, or before an integrator has started.
    #[must_use]
    pub fn variables(&self, point: usize) -> Option<&[f64]> {
        self.history
            .present(point.checked_sub(self.rod.zone().start)?)
    }

    /// Divides an element at its coordinate `x`, with its history and its earlier equilibria.
    pub(crate) fn split(&mut self, e: usize, x: f64) {
        let (growing, p) = (
            e.checked_sub(self.rod.first_growing),
            self.rod.order().points(),
        );
        self.predictor.split(&self.rod, e, x);
        let parts = self.rod.split(e, x);
        if let Some(growing) = growing {
            self.history.split(growing * p, p, &parts);
        }
    }

    /// Merges the mature elements `e` and `e` + 1 if the loss is at most `limit` (rad), and returns
    /// the smallest limit that permits it.
    pub(crate) fn merge(
        &mut self,
        e: usize,
        limit: f64,
        compliance: impl Fn(&MaterialPoint) -> f64,
    ) -> Option<f64> {
        let (needed, share) = self.rod.merge(e, limit, compliance)?;
        self.predictor.merge(&self.rod, e, share);
        Some(needed)
    }

    /// Takes the first `elements` growing elements out of the growth zone. Returns their material
    /// points, whose exit times must be set to less than infinity.
    pub(crate) fn mature(&mut self, elements: usize) -> &mut [MaterialPoint] {
        self.history.drain(elements * self.rod.order().points());
        self.rod.mature(elements)
    }
}
