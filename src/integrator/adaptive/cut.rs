//! The elements of a shoot made as coarse or as fine as a tolerance asks for.

use crate::integrator::mesh::compliance;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// Elements are joined again before a run if that changes nothing by more than this: rounding alone, of what is projected.
pub(super) const LOSSLESS: f64 = 1e-11;
/// What exceeds a whole number of elements by rounding alone does not make another one.
const ROUNDING: f64 = 1e-9;

/// The longest element of the shoot, of those in the growth zone if it elongates, m.
pub(super) fn longest_element(state: &State) -> f64 {
    let rod = &state.rod;
    let first = if rod.first_growing() < rod.elements() { rod.first_growing() } else { 0 };
    (first..rod.elements()).map(|e| rod.element_length(e)).fold(0.0, f64::max)
}

/// Elements in the growth zone, or in a shoot of constant length, of the first trial.
const FIRST_ELEMENTS: f64 = 3.0;

/// What a shoot is divided into elements of: the growth zone, or a shoot of constant length, m.
fn size(shoot: &Shoot<impl Model>) -> f64 {
    shoot.resolution * shoot.mesh.longest_element
}

/// Lays the first elements of a shoot that no integrator has started.
pub(super) fn cut_first(shoot: &mut Shoot<impl Model>) {
    cut(shoot, size(shoot) / (FIRST_LENGTH * FIRST_ELEMENTS));
}

/// Elements that growth cuts in halves when they are longest begin at this part of that, in the middle of what follows: so runs with
/// shorter elements are like each other, cut for cut.
pub(super) const FIRST_LENGTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Cuts every element into equal parts that are not longer than `longest`, m. Elements of a shoot that no integrator has started
/// are joined before, where nothing is lost by that: a uniform section has no need of them. Its mature part is then cut into as many
/// parts as the zone, however short it is: it may stiffen as steeply.
pub(super) fn cut(shoot: &mut Shoot<impl Model>, mut longest: f64) {
    let mut longest_mature = longest;
    if shoot.state.history.levels() == 0 {
        join(shoot);
        longest *= FIRST_LENGTH;
        let rod = &shoot.state.rod;
        let mature: f64 = (0..rod.first_growing()).map(|e| rod.element_length(e)).sum();
        longest_mature = longest.min(mature * longest / size(shoot));
    }
    let state = &mut shoot.state;
    for e in (0..state.rod.elements()).rev() {
        let longest = if e < state.rod.first_growing() { longest_mature } else { longest };
        let parts = (state.rod.element_length(e) / longest * (1.0 - ROUNDING)).ceil();
        cut_into(state, e, parts.max(1.0) as usize);
    }
}

/// Cuts an element into so many parts of equal extent in its coordinate.
pub(super) fn cut_into(state: &mut State, e: usize, parts: usize) {
    for k in 0..parts.saturating_sub(1) {
        state.split(e + k, 1.0 / (parts - k) as f64);
    }
}

fn join(shoot: &mut Shoot<impl Model>) {
    let (model, state) = (&shoot.model, &mut shoot.state);
    let compliance = compliance(model.constitutive(), state.time);
    let mut e = 0;
    while e + 1 < state.rod.elements() {
        let border = e + 1 == state.rod.first_growing();
        if border || state.merge(e, LOSSLESS, &compliance).is_none() {
            e += 1;
        }
    }
}
