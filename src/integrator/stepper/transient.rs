//! Transients of the stimuli after a breaking point.
//!
//! After a discontinuity a variable with the time constant τ contains exp(−t/τ). One delay later
//! the differential growth contains it, and so do the strain and the stimuli. Each step doubles the
//! time since then. If the transient is faster than a step, a cubic through four levels therefore
//! has an error of 8 % of it. The stimuli are interpolated by a cubic and exp(−t/τ), through one
//! more level.

use super::ORDER;
use super::collocation::Levels;
use crate::state::{CLOSE, LEVELS, Nodes, State};
use crate::tropism::Declaration;

/// Number of time constants after which a transient has decayed, to exp(−20) = 2e-9.
const DECAYED: f64 = 20.0;
/// Ratio z of a step to the time constant below which a cubic resolves the transient, with an error
/// of fourth order. The divided differences of a slower transient would magnify rounding by z⁻⁴.
const SLOW: f64 = 0.5;

/// Distance in time, relative to a step, below which only one of two levels is used for the stimuli
/// in the step. Near a snap the stimuli vary with the root of the time, and are located in ever
/// shorter parts of a step. A polynomial through these would be extrapolated over the next long
/// step. In a regular run steps at most double.
const APART: f64 = 0.1;

/// Returns the shortest time constant (s) for which `acts` returns true, among those of the
/// variables whose discontinuity has the last discontinuity as its breaking point, up to a
/// difference of `close` s.
pub fn fastest_transient(
    state: &State,
    laws: &Declaration,
    close: f64,
    acts: impl Fn(f64) -> bool,
) -> Option<f64> {
    let (history, start) = (&state.history, state.smooth_since);
    // The search in the history comes last, since it takes a time proportional to the number of
    // levels.
    let passes = |delay: f64| {
        history
            .discontinuities()
            .any(|k| (history.time(k) + delay - start).abs() <= close)
    };
    let candidates = laws
        .variables()
        .iter()
        .filter(|variable| acts(variable.time_constant));
    let passing = candidates.filter(|variable| variable.delay.is_some_and(passes));
    passing
        .map(|variable| variable.time_constant)
        .reduce(f64::min)
}

/// Returns the levels for the interpolation of stimuli over a step of `size` seconds, with their
/// times (s) and the time constant (s) of the fastest transient that has not decayed at the first
/// of them and that a cubic does not resolve.
pub(super) fn smooth_levels(state: &State, laws: &Declaration, size: f64) -> (Nodes, Levels) {
    let levels = |most: usize, transient: Option<f64>| {
        let nodes = state.history.smooth(most, state.smooth_since, APART * size);
        let time = |node: usize| {
            nodes
                .get(node)
                .map_or(f64::NAN, |level| state.history.time(*level))
        };
        (
            nodes,
            Levels {
                count: nodes.len(),
                times: std::array::from_fn(time),
                transient,
            },
        )
    };
    let all = levels(LEVELS, None);
    // Two levels are the ends of the first step, whose stimuli are linear.
    if all.1.count < 3 {
        return all;
    }
    let [age, next] = [0, 1].map(|node| all.1.times[node] - state.smooth_since);
    // A transient that decays in the first step is negligible.
    let first = if age > 0.0 { 0.0 } else { next };
    let unresolved = |tau: f64| age < DECAYED * tau && size > SLOW * tau && first < tau;
    let transient = fastest_transient(state, laws, CLOSE * size, unresolved);
    levels(if transient.is_some() { LEVELS } else { ORDER }, transient)
}
