//! Adaptation of the elements to growth: division of stretched elements and at the boundary of the
//! growth zone, and merging of mature elements.

use nalgebra::Vector3;

use super::grid::{Change, GridStep};
use super::{IntegrationError, Outcome, ROUNDING, Statistics};
use crate::constitutive::Constitutive;
use crate::growth::GrowthLaw;
use crate::rod::{MaterialPoint, Tissue, UNEVEN};
use crate::shoot::Mesh;
use crate::state::State;

/// Prepares the elements for a step from time `from` to time `to` (s), and returns the number of
/// growing elements that leave the zone in it.
///
/// The material place that will be on the boundary at the end of the step becomes a node at its
/// start, when all fields are still smooth there. The boundary is then on a node at the end of
/// every step, and the kinks of the intrinsic strain and of the stiffness at the boundary are never
/// inside an element.
pub(super) fn adapt(
    state: &mut State,
    (growth, constitutive): (&impl GrowthLaw, &impl Constitutive),
    mesh: &Mesh,
    [from, to]: [f64; 2],
    (statistics, mut recorded): (&mut Statistics, Option<&mut GridStep>),
) -> usize {
    if !growth.elongates() {
        return 0;
    }
    let mut note = |change| {
        recorded
            .iter_mut()
            .for_each(|step| step.changes.push(change))
    };
    merge_mature(state, constitutive, mesh, statistics, &mut note);
    let mut e = state.rod.first_growing;
    while e < state.rod.elements() {
        let length = state.rod.length_of(e);
        let long = length > mesh.longest_element * (1.0 + ROUNDING);
        let uneven = length > mesh.longest_element * ROUNDING && state.rod.unevenness(e) > UNEVEN;
        if long || uneven {
            state.split(e, state.rod.halfway(e));
            statistics.splits += 1;
            note(Change::Halve(e));
        } else {
            e += 1;
        }
    }
    let boundary = growth.flow(growth.zone_length(), to, from).0;
    let first = state.rod.first_growing;
    for e in first..state.rod.elements() {
        let (a, b) = (state.rod.node_distance[e], state.rod.node_distance[e + 1]);
        // A boundary that differs from a node by rounding is on the node.
        let margin = ROUNDING * (a - b);
        if boundary >= a - margin {
            return e - first;
        }
        if boundary > b + margin {
            let x = state.rod.coordinate_at_distance(e, boundary);
            // The ends of elements and the lengths inside them agree up to the resolution of the
            // mesh, so the part may be empty.
            if x <= ROUNDING {
                return e - first;
            }
            if x < 1.0 - ROUNDING {
                state.split(e, x);
                statistics.splits += 1;
                note(Change::Cut(e));
            }
            return e + 1 - first;
        }
    }
    state.rod.elements() - first
}

/// Makes the changes of elements of a recorded step, and returns the number of growing elements
/// that leave the zone.
pub(super) fn follow(
    state: &mut State,
    (growth, constitutive): (&impl GrowthLaw, &impl Constitutive),
    [from, to]: [f64; 2],
    step: &GridStep,
    statistics: &mut Statistics,
) -> Outcome<usize> {
    let refuse = |problem| {
        Err(IntegrationError::Grid {
            time: from,
            problem,
        })
    };
    for &change in &step.changes {
        let (Change::Merge(e) | Change::Halve(e) | Change::Cut(e)) = change;
        let merges = matches!(change, Change::Merge(_));
        if e + usize::from(merges) >= state.rod.elements() {
            return refuse("an element that it changes does not exist");
        }
        let x = match change {
            Change::Merge(e) => {
                let merged = state.merge(e, f64::INFINITY, compliance(constitutive, state.time));
                let Some(needed) = merged else {
                    return refuse("elements that it merges cannot be merged");
                };
                statistics.merges += 1;
                statistics.merge_loss = statistics.merge_loss.max(needed);
                continue;
            }
            Change::Halve(e) => state.rod.halfway(e),
            Change::Cut(e) => {
                let boundary = growth.flow(growth.zone_length(), to, from).0;
                let x = state.rod.coordinate_at_distance(e, boundary);
                if !(x > ROUNDING && x < 1.0 - ROUNDING) {
                    return refuse("the boundary of the growth zone is in another element");
                }
                x
            }
        };
        state.split(e, x);
        statistics.splits += 1;
    }
    state.merge_next = step.merge_next;
    Ok(step.leaving)
}

/// Returns a function for the bending compliance of a material point at a time (s), up to a factor.
/// Merging preserves the compliance.
pub(in crate::integrator) fn compliance(
    constitutive: &impl Constitutive,
    time: f64,
) -> impl Fn(&MaterialPoint) -> f64 {
    move |point| {
        let tangent = constitutive
            .respond(&Tissue::of(point, time), &Vector3::zeros())
            .tangent;
        1.0 / (tangent[(0, 0)] + tangent[(1, 1)])
    }
}

/// Tries to merge the youngest pair of mature elements, and one other pair, the next one in each
/// step. A pair that could not be merged when it left the zone may be merged after it has
/// stiffened.
fn merge_mature(
    state: &mut State,
    constitutive: &impl Constitutive,
    mesh: &Mesh,
    statistics: &mut Statistics,
    note: &mut impl FnMut(Change),
) {
    if mesh.merge_tolerance == 0.0 {
        return;
    }
    let compliance = compliance(constitutive, state.time);
    let mut attempt = |state: &mut State, e: usize| {
        let length = state.rod.length_of(e) + state.rod.length_of(e + 1);
        if length <= mesh.longest_element
            && let Some(needed) = state.merge(e, mesh.merge_tolerance, &compliance)
        {
            statistics.merges += 1;
            statistics.merge_loss = statistics.merge_loss.max(needed);
            note(Change::Merge(e));
        }
    };
    let k = state.rod.first_growing;
    if k >= 2 {
        attempt(state, k - 2);
    }
    let k = state.rod.first_growing;
    if k >= 3 {
        state.merge_next = (state.merge_next + 1) % (k - 2);
        let e = state.merge_next;
        attempt(state, e);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::growth::UniformGrowth;
    use crate::shoot::Shoot;

    /// Two neighbours of seven mature elements are half as long as the others. Only they may be
    /// merged, since the sum of any other pair exceeds the longest element.
    #[test]
    fn every_pair_of_mature_elements_is_tried_in_turn() {
        let law = LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        };
        for pair in 0..5 {
            let mut nodes = vec![0.0];
            for e in 0..8 {
                let length = if e == pair || e == pair + 1 {
                    0.005
                } else {
                    0.01
                };
                nodes.push(nodes[e] + length);
            }
            let growth = UniformGrowth {
                zone_length: 0.01,
                time: 72e3,
            };
            let mut shoot = Shoot::builder(law)
                .length(nodes[8])
                .radius(5e-4)
                .nodes(&nodes)
                .growth(growth)
                .build()
                .unwrap();
            assert_eq!(shoot.rod().first_growing, 7);
            shoot.mesh.longest_element = 0.012;
            // Nodes that the user has given are never removed, unless they are released.
            shoot.state.rod.kept.fill(false);
            let mut statistics = Statistics::default();
            for _ in 0..5 {
                merge_mature(
                    &mut shoot.state,
                    &law,
                    &shoot.mesh,
                    &mut statistics,
                    &mut |_| (),
                );
            }
            assert_eq!(
                (statistics.merges, shoot.rod().elements()),
                (1, 7),
                "pair {pair}"
            );
        }
    }
}
