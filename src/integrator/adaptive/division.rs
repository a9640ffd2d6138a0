//! Division of a shoot into elements of a given length.

use crate::integrator::ROUNDING;
use crate::integrator::stepper::compliance;
use crate::model::Model;
use crate::rod::Rod;
use crate::shoot::Shoot;
use crate::state::State;
use crate::support::Support;

/// Merge tolerance at which the loss is only the rounding of the projection, rad.
pub(super) const LOSSLESS: f64 = 1e-11;
/// Number of elements above which elements are not refined for a law that is steep between the
/// material points.
pub(super) const MOST_ELEMENTS: usize = 1000;
/// Ratio of the initial length of an element to the longest element, at which growth halves
/// elements. It is the geometric mean of 1 and 1/2, so that runs with different elements divide
/// them after similar growth.
pub(super) const FIRST_LENGTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Returns the length of the longest element of the growth zone, or of a shoot of constant length,
/// m.
pub(super) fn longest_element(state: &State) -> f64 {
    let rod = &state.rod;
    (first_in_zone(rod)..rod.elements())
        .map(|e| rod.length_of(e))
        .fold(0.0, f64::max)
}

/// Returns the first element of the growth zone, or of a shoot of constant length.
pub(super) fn first_in_zone(rod: &Rod) -> usize {
    if rod.first_growing < rod.elements() {
        rod.first_growing
    } else {
        0
    }
}

/// Returns the length of the growth zone, or of a shoot of constant length, m.
pub(super) fn size(shoot: &Shoot<impl Model>) -> f64 {
    shoot.resolution * shoot.mesh.longest_element
}

/// Returns the longest element of a plan whose first mesh has at least a `number` of elements in the
/// growth zone, or in a shoot of constant length, m. With a support the first mesh is not coarser
/// than that of the shoot, since on a coarse mesh the search may follow another branch of
/// equilibria, or fail.
pub(super) fn first_length(shoot: &Shoot<impl Model>, number: f64) -> f64 {
    let number = if shoot.model.support().is_absent() {
        number
    } else {
        number.max(shoot.resolution)
    };
    size(shoot) / (FIRST_LENGTH * number)
}

/// Divides every element of a shoot without a history into equal parts such that the first elements
/// are shorter than `longest`, m. The mature part has at least as many elements as the zone, since
/// its stiffness may vary as steeply.
pub(super) fn cut(shoot: &mut Shoot<impl Model>, longest: f64) {
    let longest = FIRST_LENGTH * longest;
    let rod = &shoot.state.rod;
    let mature: f64 = (0..rod.first_growing).map(|e| rod.length_of(e)).sum();
    let longest_mature = longest.min(mature * longest / size(shoot));
    cut_each(&mut shoot.state, |rod, e| {
        let longest = if e < rod.first_growing {
            longest_mature
        } else {
            longest
        };
        cut_to(rod, e, longest)
    });
}

/// Returns the number of equal parts of an element that are not longer than `longest`, m.
pub(super) fn cut_to(rod: &Rod, e: usize, longest: f64) -> usize {
    (rod.length_of(e) / longest * (1.0 - ROUNDING)).ceil() as usize
}

/// Divides every element into a number of parts of equal extent in its coordinate.
pub(super) fn cut_each(state: &mut State, parts: impl Fn(&Rod, usize) -> usize) {
    // Backwards, the indices of the elements that follow do not change.
    for e in (0..state.rod.elements()).rev() {
        let parts = parts(&state.rod, e);
        cut_into(state, e, parts);
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
