//! Division of a shoot into elements of a given length.

use crate::integrator::ROUNDING;
use crate::integrator::stepper::compliance;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// Merge tolerance at which the loss is only the rounding of the projection, rad.
pub(super) const LOSSLESS: f64 = 1e-11;
/// Number of elements above which elements are not refined for a law that is steep between the material points.
pub(super) const MOST_ELEMENTS: usize = 1000;
/// Ratio of the initial length of an element to the longest element, at which growth halves elements. It is the
/// geometric mean of 1 and 1/2. The divisions in runs with different elements then occur at similar times.
pub(super) const FIRST_LENGTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Returns the length of the longest element of the growth zone, or of a shoot of constant length, m.
pub(super) fn longest_element(state: &State) -> f64 {
    let rod = &state.rod;
    let first = if rod.first_growing < rod.elements() { rod.first_growing } else { 0 };
    (first..rod.elements()).map(|e| rod.length_of(e)).fold(0.0, f64::max)
}

/// Returns the length of the growth zone, or of a shoot of constant length, m.
pub(super) fn size(shoot: &Shoot<impl Model>) -> f64 {
    shoot.resolution * shoot.mesh.longest_element
}

/// Divides every element into equal parts that are not longer than `longest`, m. The first elements of a shoot without
/// a history are shorter. The mature part of such a shoot has at least as many elements as the zone, since its
/// stiffness may vary as steeply.
pub(super) fn cut(shoot: &mut Shoot<impl Model>, mut longest: f64) {
    let mut longest_mature = longest;
    if shoot.state.history.levels() == 0 {
        longest *= FIRST_LENGTH;
        let rod = &shoot.state.rod;
        let mature: f64 = (0..rod.first_growing).map(|e| rod.length_of(e)).sum();
        longest_mature = longest.min(mature * longest / size(shoot));
    }
    let state = &mut shoot.state;
    for e in (0..state.rod.elements()).rev() {
        let longest = if e < state.rod.first_growing { longest_mature } else { longest };
        let parts = (state.rod.length_of(e) / longest * (1.0 - ROUNDING)).ceil();
        cut_into(state, e, parts.max(1.0) as usize);
    }
}

/// Divides an element into parts of equal extent in its coordinate.
pub(super) fn cut_into(state: &mut State, e: usize, parts: usize) {
    for k in 0..parts.saturating_sub(1) {
        state.split(e + k, 1.0 / (parts - k) as f64);
    }
}

/// Merges elements of a shoot without a history where merging has no loss, as in a uniform section.
pub(super) fn merge_lossless(shoot: &mut Shoot<impl Model>) {
    let (model, state) = (&shoot.model, &mut shoot.state);
    let compliance = compliance(model.constitutive(), state.time);
    let mut e = 0;
    while e + 1 < state.rod.elements() {
        let border = e + 1 == state.rod.first_growing;
        if border || state.merge(e, LOSSLESS, &compliance).is_none() {
            e += 1;
        }
    }
}
