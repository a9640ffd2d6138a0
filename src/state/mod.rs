//! Everything that the future of a shoot depends on, as one plain value.

mod error;
mod history;
mod history_function;
mod plan;
mod predictor;
#[cfg(feature = "serde")]
mod saved;

use std::fmt;

pub use error::StateError;
pub(crate) use history::{History, Nodes, Reading, Spare};
pub use history_function::{EmptyHistory, GivenHistory, HistoryFunction, SteadyHistory};
pub(crate) use plan::Plan;
pub(crate) use predictor::{Predictor, intrinsic_moments};
#[cfg(feature = "serde")]
pub(crate) use saved::{FORMAT, check_format};

use crate::rod::{MaterialPoint, Rod, part_weights};

/// Levels and equilibria closer to each other than this fraction of a step are as one for what is interpolated: stimuli are known to
/// 1e-11 or better, and extrapolating their difference over a step magnifies that by the inverse.
pub(crate) const CLOSE: f64 = 1e-3;

/// The state of a shoot: material points with their intrinsic strains, frames, the laws' variables and their history,
/// and time.
///
/// A plain value: clone it, compare it, keep it, give it back with [`Shoot::restore`](crate::Shoot::restore). A run that
/// goes on from a restored state repeats the original bit by bit.
///
/// With the feature `serde` a state is written with the number of its format, and checked when it is read: what is damaged,
/// or of another format, is an error.
#[derive(Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "saved::Saved", try_from = "saved::Saved"))]
pub struct State {
    pub(crate) time: f64,
    pub(crate) rod: Rod,
    pub(crate) predictor: Predictor,
    pub(crate) history: History,
    /// When the run began or passed a discontinuity: no interpolation in time reaches back across it.
    pub(crate) smooth_since: f64,
    /// Whether the laws were exchanged at the present time: an integrator has yet to pass that discontinuity.
    pub(crate) changed: bool,
    /// The pair of mature elements that was last tried to be merged.
    pub(crate) merge_next: usize,
    /// The resolution that `Adaptive` has chosen last. `Adaptive` alone creates and uses it.
    pub(crate) plan: Option<Plan>,
}

/// A summary: the whole is thousands of numbers.
impl fmt::Debug for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (variables, stimuli) = self.history.size();
        f.debug_struct("State")
            .field("time", &self.time)
            .field("length", &self.rod.length())
            .field("tip", &self.rod.tip().as_slice())
            .field("elements", &self.rod.elements())
            .field("variables", &variables)
            .field("stimuli", &stimuli)
            .field("levels", &self.history.levels())
            .finish_non_exhaustive()
    }
}

impl State {
    /// A shoot at rest at t = 0 that no integrator has started yet.
    pub(crate) fn new(rod: Rod) -> Self {
        Self {
            time: 0.0,
            rod,
            predictor: Predictor::default(),
            history: History::default(),
            smooth_since: 0.0,
            changed: false,
            merge_next: 0,
            plan: None,
        }
    }

    /// Becomes equal to `source` without new allocations, if there is room.
    pub(crate) fn copy_from(&mut self, source: &Self) {
        (self.time, self.smooth_since, self.changed) = (source.time, source.smooth_since, source.changed);
        (self.merge_next, self.plan) = (source.merge_next, source.plan);
        self.rod.copy_from(&source.rod);
        self.predictor.copy_from(&source.predictor);
        self.history.copy_from(&source.history);
    }

    /// Becomes a state that no integrator has started, with the shape that it has.
    pub(crate) fn forget(&mut self) {
        (self.predictor, self.history) = (Predictor::default(), History::default());
        (self.smooth_since, self.changed, self.plan) = (self.time, false, None);
    }

    /// The resolution that `Adaptive` has chosen, unless another integrator has advanced the shoot since.
    pub(crate) fn plan(&self) -> Option<Plan> {
        self.plan.filter(|plan| plan.reached == self.time)
    }

    /// Refuses a state whose parts do not belong together, or hold numbers that no state has.
    pub(crate) fn check(&self) -> Result<(), StateError> {
        StateError::unless(self.time.is_finite(), "time", self.time, "finite (s)")?;
        // Only the state of a run has this time.
        let since = self.smooth_since;
        StateError::unless(
            since <= self.time && since.is_finite(),
            "start of the run",
            since,
            "not in the future (s)",
        )?;
        self.rod.check()?;
        let (what, pair) = ("number of the pair that was last tried to be merged", self.merge_next);
        StateError::unless(pair < self.rod.elements(), what, pair as f64, "that of an element")?;
        self.plan.map_or(Ok(()), |plan| plan.check())?;
        let started = self.history.levels() > 0;
        self.predictor.check(self.rod.rotations().len(), self.time, started)?;
        self.history.check(self.rod.zone().len(), self.time, since)
    }

    /// Refuses a state whose history is of other laws than those with so many variables and stimuli.
    pub(crate) fn check_laws(&self, own: (usize, usize)) -> Result<(), StateError> {
        let ((variables, stimuli), (own_variables, own_stimuli)) = (self.history.size(), own);
        if self.history.levels() == 0 || self.history.size() == own {
            return Ok(());
        }
        Err(StateError::Laws { variables, stimuli, own_variables, own_stimuli })
    }

    /// Refuses a rod that is not shorter than `longest`, m.
    pub(crate) fn check_length(&self, longest: f64) -> Result<(), StateError> {
        let length = self.rod.length();
        StateError::unless(
            length < longest,
            "length of the rod",
            length,
            "less than a million of the shoot's elements (m)",
        )
    }

    /// Time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The rod: its material points and its shape.
    #[must_use]
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// The variables that the tropism laws keep at a material point of the growth zone, by the point's index among all
    /// points of the rod; nothing for a mature point, or before an integrator has started.
    #[must_use]
    pub fn variables(&self, point: usize) -> Option<&[f64]> {
        self.history.present(point.checked_sub(self.rod.zone().start)?)
    }

    /// Cuts an element at its coordinate `x`, with everything that lives on it now and in the past.
    pub(crate) fn split(&mut self, e: usize, x: f64) {
        let reference = self.rod.reference();
        self.predictor.split(&self.rod, e, x);
        if e >= self.rod.first_growing() {
            let parts = [part_weights(reference, 0.0, x), part_weights(reference, x, 1.0)];
            self.history.split((e - self.rod.first_growing()) * reference.p, reference.p, [&parts[0], &parts[1]]);
        }
        self.rod.split(e, x);
    }

    /// Makes two mature elements one if that loses no more than `tolerance` (rad), and returns the smallest tolerance that permits it.
    pub(crate) fn merge(
        &mut self,
        e: usize,
        tolerance: f64,
        compliance: impl Fn(&MaterialPoint) -> f64,
    ) -> Option<f64> {
        let first = self.rod.element_length(e);
        let share = first / (first + self.rod.element_length(e + 1));
        let needed = self.rod.merge(e, tolerance, compliance)?;
        self.predictor.merge(&self.rod, e, share);
        Some(needed)
    }

    /// Takes the first `elements` growing elements out of the growth zone. Returns their material points, whose exit
    /// times must be set to less than infinity.
    pub(crate) fn mature(&mut self, elements: usize) -> &mut [MaterialPoint] {
        self.history.drain(elements * self.rod.order().points());
        self.rod.mature(elements)
    }
}
