//! What came before the start of a run: the history function of the delay equations, on [−delay, 0].

use crate::pointers::forward_pointers;
use crate::tropism::{Site, TropismLaw};

/// The laws' variables before the start of a run, at every material point.
pub trait HistoryFunction {
    /// Whether the variables were the same at all times before 0.
    fn is_constant(&self) -> bool;

    /// Writes the variables of `law` at time `t` ≤ 0 (s) before the start, at a place as it is in the first equilibrium,
    /// where the law senses `stimuli`.
    fn variables(&self, law: &impl TropismLaw, t: f64, site: &Site, stimuli: &[f64], variables: &mut [f64]);
}

forward_pointers!(HistoryFunction {
    fn is_constant() -> bool;
    fn variables(law: &impl TropismLaw, t: f64, site: &Site, stimuli: &[f64], variables: &mut [f64]);
});

/// The default history: memories empty before the start, statoliths settled in the first equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EmptyHistory;

impl HistoryFunction for EmptyHistory {
    fn is_constant(&self) -> bool {
        true
    }

    fn variables(&self, law: &impl TropismLaw, _t: f64, _site: &Site, stimuli: &[f64], variables: &mut [f64]) {
        law.at_rest(stimuli, variables);
    }
}

/// A steady history: the stimuli of the first equilibrium have lasted for ever.
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

/// A history given as a smooth function of place and of the time since the start (s, from minus the longest delay to 0), which writes the
/// variables of the laws in the order of the tuple.
#[derive(Debug, Clone, Copy)]
pub struct GivenHistory<F>(
    /// Writes the variables at a time and a place.
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
