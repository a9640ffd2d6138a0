//! The first guess of an equilibrium, extrapolated from the last ones.

use crate::quadrature::lagrange;
use crate::state::{EARLIER, State};

/// Keeps the present rotations as the latest equilibrium and extrapolates them to `time`.
pub(super) fn extrapolate(state: &mut State, time: f64) {
    let known = state.known;
    let mut times = [state.time; EARLIER + 1];
    for (to, earlier) in times[1..].iter_mut().zip(&state.earlier) {
        *to = earlier.time;
    }
    let mut weights = [0.0; EARLIER + 1];
    lagrange(&times[..=known], time, &mut weights[..=known]);
    for i in 0..state.rod.rotations.len() {
        let present = state.rod.rotations[i];
        let mut guess = present * weights[0];
        for (earlier, weight) in state.earlier[..known].iter().zip(&weights[1..]) {
            guess += earlier.rotations[i] * *weight;
        }
        state.rod.rotations[i] = guess;
        // The oldest is no longer needed: the present takes its place.
        if let Some(last) = state.earlier.last_mut() {
            last.rotations[i] = present;
        }
    }
    if let Some(last) = state.earlier.last_mut() {
        last.time = state.time;
    }
    state.earlier.rotate_right(1);
    state.known = (known + 1).min(state.earlier.len());
    state.rod.chain_frames();
}
