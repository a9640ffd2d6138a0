//! The history function of the delay equations, on [−delay, 0].

use crate::tropism::{Site, TropismLaw};

/// The laws' variables before the start of a run, at every material point.
pub trait HistoryFunction {
    /// Returns whether the variables were constant before 0.
    fn is_constant(&self) -> bool;

    /// Writes the variables of `law` at time `t` ≤ 0 (s), at a place in the first equilibrium, where the law senses `stimuli`.
    fn variables(&self, law: &impl TropismLaw, t: f64, site: &Site, stimuli: &[f64], variables: &mut [f64]);
}

/// The default history: memories are zero before the start, and statoliths are settled in the first equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EmptyHistory;

impl HistoryFunction for EmptyHistory {
    fn is_constant(&self) -> bool {
        true
    }

    fn variables(&self, law: &impl TropismLaw, _t: f64, _site: &Site, stimuli: &[f64], variables: &mut [f64]) {
        law.initial(stimuli, variables);
    }
}

/// A steady history: the stimuli were those of the first equilibrium at all times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SteadyHistory;

impl HistoryFunction for SteadyHistory {
    fn is_constant(&self) -> bool {
        true
    }

    fn variables(&self, law: &impl TropismLaw, _t: f64, _site: &Site, stimuli: &[f64], variables: &mut [f64]) {
        law.steady(stimuli, variables);
    }
}

/// A history given by a smooth function of the time (s, from minus the longest delay to 0) and the place. It writes the variables of the
/// laws in the order of the tuple.
#[derive(Debug, Clone, Copy)]
pub struct GivenHistory<F>(
    /// Function that writes the variables.
    pub F,
);

impl<F: Fn(f64, &Site, &mut [f64])> HistoryFunction for GivenHistory<F> {
    fn is_constant(&self) -> bool {
        false
    }

    fn variables(&self, _law: &impl TropismLaw, t: f64, site: &Site, _stimuli: &[f64], variables: &mut [f64]) {
        (self.0)(t, site, variables);
    }
}
