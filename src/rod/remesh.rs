//! Division of elements, and merging of mature elements.

use nalgebra::Vector3;

use super::lengths::Places;
use super::pair::Pair;
use super::shape::weighted_jacobian;
use super::{MaterialPoint, Rod, weighted};
use crate::reference_element::{MAX_POINTS, ReferenceElement};
use crate::so3;

/// Weights of the values at the points of an element for the values at the points of a part of it.
pub(crate) type PartWeights = [[f64; MAX_POINTS]; MAX_POINTS];

/// The weights for the part [from, to].
fn part_weights(reference: &ReferenceElement, from: f64, to: f64) -> PartWeights {
    let places: [_; MAX_POINTS] = std::array::from_fn(|g| reference.points[g.min(reference.p - 1)]);
    places.map(|y| reference.at_points(from + (to - from) * y))
}

/// Largest relative change of the bending of an element under a couple, over the tolerance (rad).
/// In contrast to the loss of intrinsic strain its mean does not vanish, and it displaces all
/// tissue beyond the element. A ten times larger value displaced the tip of a growing shoot by 1e-6
/// m (`docs/decisions.md`).
const COMPLIANCE: f64 = 1e-2;

/// Largest angle lost inside an element, over the tolerance. It may be large because its mean
/// vanishes and its rotation to second order is compensated. The value halves the number of mature
/// elements of a growing shoot at the same error of the tip (`docs/decisions.md`).
const INSIDE: f64 = 20.0;
/// Upper bound of that angle unless the tolerance is larger, rad: the value for the default
/// tolerance.
pub(crate) const LARGEST_INSIDE: f64 = 2e-3;

impl Rod {
    /// Divides an element at its coordinate `x` in (0, 1). Fields are polynomials of degree p − 1
    /// in the element and do not change. Returns the weights of their values for those in both
    /// parts.
    pub(crate) fn split(&mut self, e: usize, x: f64) -> [PartWeights; 2] {
        let reference = self.reference();
        let p = reference.p;
        let old: [MaterialPoint; MAX_POINTS] =
            std::array::from_fn(|g| self.points[e * p + g.min(p - 1)]);
        let growing = e >= self.first_growing;
        let places = growing.then(|| Places::of(self, e));
        // Mature tissue keeps the place at which it left the zone.
        let place = |x: f64| match &places {
            Some(places) => places.at(x),
            None => {
                let before = weighted_jacobian(&old, &reference.integral_upto(x));
                (
                    self.node_distance[e] - before,
                    weighted_jacobian(&old, &reference.at_points(x)),
                )
            }
        };
        let middle_distance = place(x).0;
        let mut new = [old[0]; 2 * MAX_POINTS];
        let parts = [
            part_weights(reference, 0.0, x),
            part_weights(reference, x, 1.0),
        ];
        for (side, (from, to)) in [(0.0, x), (x, 1.0)].into_iter().enumerate() {
            for (g, weights) in parts[side].iter().enumerate().take(p) {
                let at = from + (to - from) * reference.points[g];
                let (apex_distance, jacobian) = place(at);
                let mut point = MaterialPoint::weighted(&old, weights);
                (point.jacobian, point.apex_distance) = (jacobian * (to - from), apex_distance);
                if !self.interpolates_initial_distance(e) {
                    point.initial_apex_distance = self.initial_apex_distance(e, at);
                }
                new[side * p + g] = point;
            }
        }
        if self.yields() {
            let old = &self.line_strains[e * p..(e + 1) * p];
            let new: Vec<_> = parts
                .iter()
                .flat_map(|part| &part[..p])
                .map(|weights| weighted(old, weights))
                .collect();
            self.line_strains.splice(e * p..(e + 1) * p, new);
        }
        let middle = self.frame_within(e, x);
        split_rotations(reference, e, x)(&mut self.rotations);
        self.points
            .splice(e * p..(e + 1) * p, new[..2 * p].iter().copied());
        self.frames.insert(e + 1, middle);
        self.node_distance.insert(e + 1, middle_distance);
        self.kept.insert(e + 1, false);
        let loss = self.loss[e];
        self.loss
            .splice(e..=e, [loss.of_part(x), loss.of_part(1.0 - x)]);
        if growing {
            for e in [e, e + 1] {
                self.set_element_length(e, self.node_distance[e] - self.node_distance[e + 1]);
            }
        } else {
            self.first_growing += 1;
        }
        parts
    }

    /// Divides every element into `parts` that are equal in its coordinate.
    pub(crate) fn cut(&mut self, parts: usize) {
        for e in (0..self.elements()).rev() {
            for part in 1..parts {
                self.split(e + part - 1, 1.0 / (parts + 1 - part) as f64);
            }
        }
    }

    /// Merges the mature elements `e` and `e` + 1 by L² projection of the fields. They are not
    /// merged if the loss of intrinsic strain or the change of the section or of the `compliance`
    /// exceeds a `limit` (rad), or if the node between them is to be kept. Returns the smallest
    /// limit that permits the merging that was done, and the share of the length that the first
    /// element had.
    ///
    /// The projection preserves the moments 0 … p − 1 of the intrinsic strain. Successive
    /// projections onto larger elements equal one projection onto the largest, so that errors do
    /// not accumulate; the loss is computed exactly. A constant strain compensates its rotation to
    /// second order.
    pub(crate) fn merge(
        &mut self,
        e: usize,
        limit: f64,
        compliance: impl Fn(&MaterialPoint) -> f64,
    ) -> Option<(f64, f64)> {
        let (reference, p) = (self.reference(), self.order.points());
        // Tissue without a finite exit time is merged only with tissue of the same kind.
        let exits = [e, e + 1].map(|e| self.points[e * p].exit_time.is_finite());
        if self.kept[e + 1] || exits[0] != exits[1] {
            return None;
        }
        let pair = Pair::of(self, e);
        let mut new = pair.projected();
        let (loss, turn) = pair.loss([self.loss[e], self.loss[e + 1]], &new);
        let mut needed = 0.0;
        let conditions: [&dyn Fn() -> f64; 3] = [
            &|| {
                if loss.angle() > LARGEST_INSIDE {
                    loss.angle()
                } else {
                    loss.angle() / INSIDE
                }
            },
            &|| pair.change_of_section(&new),
            &|| pair.change_of_compliance(&new, &compliance) / COMPLIANCE,
        ];
        for condition in conditions {
            let least = condition();
            if !(least <= limit) {
                return None;
            }
            needed = least.max(needed);
        }
        let strain = turn / pair.length();
        new.iter_mut().for_each(|point| point.intrinsic += strain);
        let share = pair.share();
        if self.yields() {
            let new = pair.projected_strains(&self.line_strains[e * p..(e + 2) * p]);
            self.line_strains
                .splice(e * p..(e + 2) * p, new[..p].iter().copied());
        }
        self.points
            .splice(e * p..(e + 2) * p, new[..p].iter().copied());
        merge_rotations(reference, e, share)(&mut self.rotations);
        self.frames.remove(e + 1);
        self.node_distance.remove(e + 1);
        self.kept.remove(e + 1);
        self.loss[e] = loss;
        self.loss.remove(e + 1);
        if e < self.first_growing {
            self.first_growing -= 1;
        }
        Some((needed, share))
    }
}

/// Replaces `old` rotation vectors of a list, from index `first` on, by some `number` of others,
/// which are computed from them unless no node is rotated.
fn replace_rotations(
    rotations: &mut Vec<Vector3<f64>>,
    (first, old, number): (usize, usize, usize),
    new: impl Fn(&[Vector3<f64>]) -> [Vector3<f64>; 2 * MAX_POINTS],
) {
    let known = &rotations[first..first + old];
    let straight = known.iter().all(|theta| *theta == Vector3::zeros());
    let new = if straight {
        [Vector3::zeros(); 2 * MAX_POINTS]
    } else {
        new(known)
    };
    rotations.splice(first..first + old, new[..number].iter().copied());
}

/// A function that divides element `e` at `x` in a list of rotation vectors.
pub(crate) fn split_rotations(
    reference: &ReferenceElement,
    e: usize,
    x: f64,
) -> impl Fn(&mut Vec<Vector3<f64>>) {
    let p = reference.p;
    let middle = reference.at_nodes(x);
    let parts = [(0.0, x), (x, 1.0 - x)].map(|(from, share)| {
        std::array::from_fn::<_, MAX_POINTS, _>(|k| {
            reference.at_nodes(from + share * reference.nodes[(k + 1).min(p)])
        })
    });
    move |rotations| {
        replace_rotations(rotations, (e * p, p, 2 * p), |old| {
            let back = so3::exp(&weighted(old, &middle)).inverse();
            let mut new = [Vector3::zeros(); 2 * MAX_POINTS];
            for k in 0..p {
                new[k] = weighted(old, &parts[0][k]);
                new[p + k] = so3::log(&(back * so3::exp(&weighted(old, &parts[1][k]))));
            }
            new
        });
    }
}

/// A function that merges elements `e` and `e` + 1 in a list of rotation vectors. The first one is
/// a `share` of the merged element.
pub(crate) fn merge_rotations(
    reference: &ReferenceElement,
    e: usize,
    share: f64,
) -> impl Fn(&mut Vec<Vector3<f64>>) {
    let p = reference.p;
    let weights: [_; MAX_POINTS] = std::array::from_fn(|k| {
        let x = reference.nodes[(k + 1).min(p)];
        reference.at_nodes(if x <= share {
            x / share
        } else {
            (x - share) / (1.0 - share)
        })
    });
    move |rotations| {
        replace_rotations(rotations, (e * p, 2 * p, p), |old| {
            let (first, second) = old.split_at(p);
            let middle = so3::exp(&first[p - 1]);
            let mut new = [Vector3::zeros(); 2 * MAX_POINTS];
            for k in 0..p {
                new[k] = if reference.nodes[k + 1] <= share {
                    weighted(first, &weights[k])
                } else {
                    so3::log(&(middle * so3::exp(&weighted(second, &weights[k]))))
                };
            }
            new
        });
    }
}
