//! The intrinsic strain that merging loses, as the angle error of a frame inside the element.
//!
//! An element keeps the projection Pf of the strain f onto polynomials of degree p − 1. The lost
//! angle at a place is F = ∫ (f − Pf) ds from the element's first end. It vanishes at both ends and
//! has no moments of degree 0 … p − 2, however often elements have been merged. The lost angle of
//! the ripple that an oscillator leaves therefore does not accumulate over many waves. The rotation
//! of second order, ½ ∫ F × dF, accumulates: for a ripple that rotates it is a twist. Derivation:
//! `docs/method.md`, "Merging".

use std::sync::OnceLock;

use nalgebra::Vector3;

use super::weighted;
use crate::numerics::quadrature::{legendre, legendre_sequence, rule};
use crate::reference_element::{MAX_POINTS, ReferenceElement};

/// The angle F that is lost in an element, by its mean square and the only moments that further
/// merging needs. The element's coordinate x in [0, 1] goes with arc length.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct MergingLoss {
    /// ∫ |F|² dx, rad².
    pub mean_square: f64,
    /// ∫ F Pk(2x − 1) dx for k = p − 1 and p, with Pk the Legendre polynomials, rad.
    pub moments: [Vector3<f64>; 2],
}

/// One of two elements that are merged.
pub(crate) struct MergedPart<'a> {
    pub loss: &'a MergingLoss,
    /// Length, m.
    pub length: f64,
    /// Intrinsic strain of the element minus that of the merged one, at the element's Gauss points,
    /// 1/m.
    pub difference: [Vector3<f64>; MAX_POINTS],
}

/// Place in an element at which the integrals of a loss are evaluated.
#[derive(Debug, Clone, Copy, Default)]
struct IntegrationPoint {
    x: f64,
    /// Weight of the quadrature.
    weight: f64,
    /// Weights of the Gauss points in an integral up to the place, and in the value there.
    upto: [f64; MAX_POINTS],
    at: [f64; MAX_POINTS],
    /// (2k + 1) Pk(2x − 1) for k = p − 1 and p.
    coefficients: [f64; 2],
}

/// The Gauss points of the integrals in an element, computed once for each order.
fn places(reference: &ReferenceElement) -> &'static [IntegrationPoint; 8] {
    static PLACES: [OnceLock<[IntegrationPoint; 8]>; MAX_POINTS] =
        [const { OnceLock::new() }; MAX_POINTS];
    PLACES[reference.p - 1].get_or_init(|| {
        let (points, weights) = rule::<8>();
        std::array::from_fn(|i| {
            let x = points[i];
            let coefficient = |k: usize| (2 * k + 1) as f64 * legendre(k, 2.0 * x - 1.0).0;
            IntegrationPoint {
                x,
                weight: weights[i],
                upto: reference.integral_upto(x),
                at: reference.at_points(x),
                coefficients: [reference.p - 1, reference.p].map(coefficient),
            }
        })
    })
}

impl MergingLoss {
    /// The loss in the element that is merged from two, and the decrease of its rotation to second
    /// order, a rotation vector (rad).
    pub fn merged(reference: &ReferenceElement, parts: [MergedPart; 2]) -> (Self, Vector3<f64>) {
        let total = parts[0].length + parts[1].length;
        let (mut merged, mut turn) = (Self::default(), Vector3::zeros());
        // G = ∫ (P₁f − P₂f) ds from the first end of the merged element, at the first end of the
        // part.
        let (mut before, mut from) = (Vector3::zeros(), 0.0);
        let whole = reference.within(1.0);
        for MergedPart {
            loss,
            length,
            difference,
        } in parts
        {
            let share = length / total;
            merged.mean_square += share * loss.mean_square;
            let sum = |weights: &[f64; MAX_POINTS]| weighted(&difference, weights);
            for IntegrationPoint {
                x,
                weight,
                upto,
                at,
                coefficients,
            } in places(reference)
            {
                let (g, w) = (before + sum(upto) * length, weight * share);
                merged.mean_square += w * g.norm_squared();
                // ½ ∫ F × dF grows by ∫ F₁ × dG + ½ ∫ G × dG. Only the moment of degree p − 1
                // of F₁ contributes.
                turn += (loss.moments[0] * coefficients[0] + g * 0.5).cross(&sum(at)) * (w * total);
                // F has these moments and no lower one: ∫ F · G dx is that of their coefficients.
                let f = loss.moments[0] * coefficients[0] + loss.moments[1] * coefficients[1];
                merged.mean_square += 2.0 * w * f.dot(&g);
                // The merged element's polynomials over F, by their coefficients in the part's, and
                // over G.
                let polynomials =
                    legendre_sequence(2.0 * (from + share * x) - 1.0).skip(reference.p - 1);
                for (moment, polynomial) in merged.moments.iter_mut().zip(polynomials) {
                    *moment += (f + g) * (w * polynomial);
                }
            }
            (before, from) = (before + sum(&whole) * length, from + share);
        }
        // Rounding of a difference.
        merged.mean_square = merged.mean_square.max(0.0);
        (merged, turn)
    }

    /// A bound for a part that is a `share` of the element.
    pub fn of_part(&self, share: f64) -> Self {
        Self {
            mean_square: self.mean_square / share,
            moments: self.moments,
        }
    }

    /// The root of the mean square, rad.
    pub fn angle(&self) -> f64 {
        self.mean_square.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference_element::Order;
    use crate::rod::Rod;
    use nalgebra::UnitQuaternion;

    /// An aperiodic strain, 1/m.
    fn strain(s: f64) -> Vector3<f64> {
        Vector3::new(
            (70.0 * s).sin(),
            (31.0 * s + 1.0).cos() + 3.0 * s,
            2.0 * s * s,
        )
    }

    /// Magnitude of the strain for which the rotation of second order is negligible.
    const SMALL: f64 = 1e-6;

    #[test]
    fn loss_after_many_merges_is_that_of_the_integrated_angle() {
        for order in Order::ALL {
            let nodes = [0.0, 0.1, 0.13, 0.2, 0.31, 0.37, 0.5, 0.6];
            let mut rod =
                Rod::straight(&nodes, |_| 1e-3, UnitQuaternion::identity(), order).unwrap();
            rod.set_mature(0.0);
            rod.set_intrinsic(|point| strain(0.6 - point.apex_distance) * SMALL);
            let fine = rod.clone();
            // The merging order is irregular: from the middle, then to both sides.
            for e in [3, 2, 3, 0, 1, 0] {
                assert!(rod.merge(e, f64::INFINITY, |_| 1.0).is_some());
            }
            assert_eq!(rod.elements(), 1);
            // F = ∫ (f − Pf) ds by brute force, with f the strain before merging.
            let at = |rod: &Rod, s: f64| {
                let (e, x) = rod.locate(s).unwrap();
                let each = rod
                    .element_points(e)
                    .iter()
                    .zip(rod.reference().at_points(x));
                each.fold(Vector3::zeros(), |sum, (point, w)| {
                    sum + point.intrinsic * w
                })
            };
            let (mut angle, mut square, steps) = (Vector3::zeros(), 0.0, 60_000);
            let h = 0.6 / f64::from(steps);
            for i in 0..steps {
                let s = h * (f64::from(i) + 0.5);
                let rate = (at(&fine, s) - at(&rod, s)) * h;
                square += (angle + rate * 0.5).norm_squared() / f64::from(steps);
                angle += rate;
            }
            // The midpoint rule over 60,000 steps, across jumps of the strain.
            assert!(
                angle.norm() < 1e-6 * SMALL,
                "{order:?}: it vanishes at the end, {angle}"
            );
            let found = rod.loss[0].mean_square;
            assert!(
                (found / square - 1.0).abs() < 1e-4,
                "{order:?}: {found:e} for {square:e}"
            );
        }
    }

    /// The rotation of the last frame of a rod without load relative to the first, by the midpoint
    /// rule.
    fn turn(rod: &Rod) -> UnitQuaternion<f64> {
        let (steps, length) = (60_000, rod.length());
        let h = length / f64::from(steps);
        (0..steps).fold(UnitQuaternion::identity(), |frame, i| {
            let (e, x) = rod.locate(h * (f64::from(i) + 0.5)).unwrap();
            let each = rod
                .element_points(e)
                .iter()
                .zip(rod.reference().at_points(x));
            frame
                * crate::so3::exp(&each.fold(Vector3::zeros(), |sum, (point, w)| {
                    sum + point.intrinsic * (w * h)
                }))
        })
    }

    #[test]
    fn merging_a_rotating_ripple_preserves_its_twist() {
        // Eight periods of a rotating curvature a k, d1 to d2: an angle a is lost everywhere, ½ ∫ F
        // × dF = ½ a² k ℓ of twist with it.
        let (length, waves) = (0.1, 8.0);
        let k = waves * std::f64::consts::TAU / length;
        let off = |a: f64| {
            let nodes: Vec<f64> = (0..=64).map(|i| length * f64::from(i) / 64.0).collect();
            let mut rod =
                Rod::straight(&nodes, |_| 1e-3, UnitQuaternion::identity(), Order::Eight).unwrap();
            rod.set_mature(0.0);
            rod.set_intrinsic(|point| {
                let phase = k * (length - point.apex_distance);
                Vector3::new(phase.cos(), phase.sin(), 0.0) * (a * k)
            });
            let before = turn(&rod);
            // Merging proceeds from the base, as when tissue matures.
            while rod.elements() > 1 {
                assert!(rod.merge(0, f64::INFINITY, |_| 1.0).is_some());
            }
            assert!((rod.loss[0].angle() / a - 1.0).abs() < 0.3);
            (before.inverse() * turn(&rod)).angle()
        };
        let [coarse, fine] =
            [0.02, 0.01].map(|a| (off(a), 0.5 * a * a * waves * std::f64::consts::TAU));
        // The error of the rotation would be that twist without the correction. The remaining error
        // is due to the part of the ripple that the element keeps, which is a thirtieth here.
        assert!(
            coarse.0 < 0.05 * coarse.1 && fine.0 < 0.05 * fine.1,
            "{coarse:?} {fine:?}"
        );
    }
}
