//! The reference element: the material is at Gauss points, the rotations are at Gauss–Lobatto
//! nodes.

use std::sync::OnceLock;

use nalgebra::Vector3;
use simba::simd::{SimdValue, WideF64x4};

use crate::numerics::interpolation::{
    lagrange_denominator, lagrange_derivatives, lagrange_over, lagrange_powers,
};
use crate::numerics::quadrature::{gauss, lobatto};

/// The largest number of Gauss points in an element.
pub(crate) const MAX_POINTS: usize = 4;

/// A number at each Gauss point of an element, with lanes for the largest number of points.
pub(crate) type AtPoints = WideF64x4;

/// Order of accuracy of the shape: with p Gauss points in an element of length h, the error of the
/// tip is O(h²ᵖ).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// One Gauss point in an element.
    Two,
    /// Two Gauss points in an element.
    Four,
    /// Three Gauss points in an element.
    Six,
    /// Four Gauss points in an element. The run time is within a factor of two of the best order
    /// for a wide range of accuracies.
    #[default]
    Eight,
}

impl Order {
    /// All orders, lowest first.
    pub const ALL: [Self; 4] = [Self::Two, Self::Four, Self::Six, Self::Eight];

    /// The number p of Gauss points in an element.
    #[must_use]
    pub fn points(self) -> usize {
        self as usize + 1
    }

    /// The exponent 2p of the element length in the error of the tip.
    #[must_use]
    pub fn exponent(self) -> usize {
        2 * self.points()
    }
}

/// Quadrature and interpolation in an element of a given order, on [0, 1].
#[derive(Debug, Default)]
pub(crate) struct ReferenceElement {
    /// Number of Gauss points p; the rotations have p + 1 nodes, the first with rotation zero.
    pub p: usize,
    /// Gauss points.
    pub points: Vec<f64>,
    /// Weights of the Gauss points.
    pub weights: Vec<f64>,
    /// Lobatto nodes, p + 1 of them.
    pub nodes: Vec<f64>,
    /// Denominators of the Lagrange polynomials of the Gauss points and of the nodes.
    denominators: (Vec<f64>, Vec<f64>),
    /// `shape[g][k]`: the polynomial of node k + 1 at Gauss point g.
    pub shape: [[f64; MAX_POINTS]; MAX_POINTS],
    /// `slope[g][k]`: the derivative of that polynomial.
    pub slope: [[f64; MAX_POINTS]; MAX_POINTS],
    /// The columns of `shape`; zero in lanes without a point, as in the next two fields.
    pub shape_at_points: [AtPoints; MAX_POINTS],
    /// The columns of `slope`.
    pub slope_at_points: [AtPoints; MAX_POINTS],
    /// The weights of the Gauss points.
    pub weights_at_points: AtPoints,
    /// `upto[g][j]`: ∫ from 0 to Gauss point g of the polynomial through the Gauss points that is
    /// one at point j.
    pub upto: [[f64; MAX_POINTS]; MAX_POINTS],
    /// `point_powers[j][k]`: coefficient of xᵏ in the polynomial through the Gauss points that is
    /// one at point j.
    pub point_powers: [[f64; MAX_POINTS]; MAX_POINTS],
    /// `node_powers[j][k]`: coefficient of xᵏ in the polynomial of node j + 1.
    pub node_powers: [[f64; MAX_POINTS + 1]; MAX_POINTS],
    /// `integrals[j][k]`: coefficient of xᵏ⁺¹ in the integral from 0 to x of the polynomial through
    /// the Gauss points that is one at point j.
    integrals: [[f64; MAX_POINTS]; MAX_POINTS],
    /// Stations, at which a distributed contact acts. There is one fewer than rotations, so that
    /// bending energy determines the shape.
    pub stations: Vec<Station>,
}

/// A station of an element.
#[derive(Debug)]
pub(crate) struct Station {
    pub x: f64,
    /// The weights of [`within`](ReferenceElement::within).
    pub upto: [f64; MAX_POINTS],
    /// The points of the Gauss rule from the start of the element to the station.
    pub chord: Vec<ChordPoint>,
}

/// A point of the Gauss rule from the start of an element to a place inside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChordPoint {
    /// Weight in the element coordinate.
    pub weight: f64,
    /// The values of the polynomials through the Gauss points of the element.
    pub points: [f64; MAX_POINTS],
    /// The values of the polynomials of the nodes 1 … p.
    pub nodes: [f64; MAX_POINTS],
}

impl ReferenceElement {
    /// The reference element of an order, computed once.
    #[inline]
    pub fn of(order: Order) -> &'static Self {
        static ELEMENTS: [OnceLock<ReferenceElement>; MAX_POINTS] =
            [const { OnceLock::new() }; MAX_POINTS];
        ELEMENTS[order.points() - 1].get_or_init(|| Self::new(order.points()))
    }

    fn new(p: usize) -> Self {
        let (points, weights) = gauss(p);
        let nodes = lobatto(p);
        let denominators =
            |of: &[f64]| (0..of.len()).map(|k| lagrange_denominator(of, k)).collect();
        let mut reference = Self {
            p,
            denominators: (denominators(&points), denominators(&nodes)),
            nodes,
            points,
            weights,
            ..Self::default()
        };
        for g in 0..p {
            let x = reference.points[g];
            let slopes = lagrange_derivatives(&reference.nodes, x);
            reference.shape[g] = reference.at_nodes(x);
            reference.slope[g][..p].copy_from_slice(&slopes[1..=p]);
            reference.upto[g] = reference.integral_upto(x);
        }
        for k in 0..p {
            reference.shape_at_points[k] = AtPoints::from(reference.shape.map(|values| values[k]));
            reference.slope_at_points[k] = AtPoints::from(reference.slope.map(|values| values[k]));
        }
        let weight = |g: usize| reference.weights.get(g).copied().unwrap_or(0.0);
        reference.weights_at_points = AtPoints::from(std::array::from_fn(weight));
        for j in 0..p {
            reference.point_powers[j] = lagrange_powers(&reference.points, j);
            reference.node_powers[j] = lagrange_powers(&reference.nodes, j + 1);
            for k in 0..p {
                reference.integrals[j][k] = reference.point_powers[j][k] / (k + 1) as f64;
            }
        }
        let stations = if p < 2 {
            vec![1.0]
        } else {
            lobatto(p - 1)[1..].to_vec()
        };
        let chord = |x: f64| (0..p).map(|k| reference.chord_point(k, x)).collect();
        let station = |x: f64| Station {
            x,
            upto: reference.within(x),
            chord: chord(x),
        };
        reference.stations = stations.into_iter().map(station).collect();
        reference
    }

    /// The values at `x` of the polynomials through the Gauss points.
    pub fn at_points(&self, x: f64) -> [f64; MAX_POINTS] {
        let mut values = [0.0; MAX_POINTS];
        lagrange_over(&self.denominators.0, &self.points, x, &mut values);
        values
    }

    /// The values at `x` of the polynomials of the nodes 1 … p.
    pub fn at_nodes(&self, x: f64) -> [f64; MAX_POINTS] {
        let mut values = [0.0; MAX_POINTS + 1];
        lagrange_over(&self.denominators.1, &self.nodes, x, &mut values);
        std::array::from_fn(|k| values[k + 1])
    }

    /// Point k of the Gauss rule from the start of the element to `x`.
    pub fn chord_point(&self, k: usize, x: f64) -> ChordPoint {
        let at = x * self.points[k];
        ChordPoint {
            weight: x * self.weights[k],
            points: self.at_points(at),
            nodes: self.at_nodes(at),
        }
    }

    /// The weights of `integral_upto` for `x` up to 1, by powers of x. At 1 they are exactly those
    /// of the Gauss points.
    pub fn within(&self, x: f64) -> [f64; MAX_POINTS] {
        let mut weights = [0.0; MAX_POINTS];
        if x < 1.0 {
            for (weight, powers) in weights.iter_mut().zip(&self.integrals) {
                *weight = x * powers.iter().rfold(0.0, |sum, factor| sum * x + factor);
            }
        } else {
            weights[..self.p].copy_from_slice(&self.weights);
        }
        weights
    }

    /// Coefficients of xᵏ⁺¹ in the integral from 0 to x of the polynomial through values at the
    /// Gauss points.
    pub fn integral_powers(&self, values: impl Iterator<Item = f64>) -> [f64; MAX_POINTS] {
        values
            .zip(&self.integrals)
            .fold([0.0; MAX_POINTS], |sum, (value, powers)| {
                std::array::from_fn(|k| sum[k] + value * powers[k])
            })
    }

    /// Weights that integrate a polynomial through the Gauss points from 0 to `x`.
    pub fn integral_upto(&self, x: f64) -> [f64; MAX_POINTS] {
        // The Gauss rule is exact for the integrated polynomials, which have degree p − 1.
        let mut out = [0.0; MAX_POINTS];
        for (y, w) in self.points.iter().zip(&self.weights) {
            let values = self.at_points(x * y);
            for j in 0..self.p {
                out[j] += w * x * values[j];
            }
        }
        out
    }
}

/// The polynomial through vectors at the nodes 1 … p, given the values of the nodal polynomials at
/// the points.
#[inline]
pub(crate) fn interpolated(vectors: &[Vector3<f64>], shape: &[AtPoints]) -> Vector3<AtPoints> {
    let each = vectors.iter().zip(shape);
    each.fold(Vector3::zeros(), |sum, (vector, shape)| {
        sum + vector.map(AtPoints::splat) * *shape
    })
}

/// The sum over the points.
#[inline]
pub(crate) fn total(values: AtPoints) -> f64 {
    let [a, b, c, d] = values.into_arr();
    (a + c) + (b + d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn integrals_by_powers_are_those_by_quadrature() {
        for order in Order::ALL {
            let reference = ReferenceElement::of(order);
            for x in [0.0, 0.1, 0.37, 0.5, 0.99] {
                // The coefficients are of the order of ten, and the error is rounding.
                for (power, quadrature) in
                    reference.within(x).iter().zip(reference.integral_upto(x))
                {
                    assert_abs_diff_eq!(*power, quadrature, epsilon = 1e-14);
                }
            }
            assert_eq!(reference.within(1.0)[..reference.p], reference.weights[..]);
        }
    }
}
