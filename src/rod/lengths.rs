//! Lengths of elements, and places of the tissue in growing ones. The ends of elements and the
//! points move by the growth law; the lengths per coordinate at the points follow from them.

use super::Rod;
use super::locate::ROUNDING;
use super::shape::weighted_jacobian;
use crate::numerics::scalar::newton;
use crate::reference_element::MAX_POINTS;

/// Largest ratio of the lengths per coordinate in a growing element; above it the element is
/// divided. Up to this ratio the polynomial through the values at the points is positive: for
/// values between 1 and 2 it is at least 1.5 − Λ/2, and the Lebesgue constant Λ of four Gauss
/// points is below 2.9.
pub(crate) const UNEVEN: f64 = 2.0;

/// Largest number of interpolation conditions: both ends, and the points with their slopes.
const MAX_TERMS: usize = 2 * MAX_POINTS + 2;

/// Places of the tissue of a growing element: the Hermite polynomial of degree 2p + 1 through the
/// distances of its ends and points from the apex, with the lengths per coordinate as slopes. It
/// has the order 2p in the parts of a divided element.
pub(super) struct Places {
    /// Distance of the first end from the apex, and length of the element, m.
    first: f64,
    length: f64,
    /// Number of terms of the Newton form of the share of the length minus the coordinate; its
    /// nodes; its divided differences.
    terms: usize,
    nodes: [f64; MAX_TERMS],
    differences: [f64; MAX_TERMS],
}

impl Places {
    /// The places in a growing element.
    pub fn of(rod: &Rod, e: usize) -> Self {
        let (first, last) = (rod.node_distance[e], rod.node_distance[e + 1]);
        let (length, terms) = (first - last, 2 * rod.order.points() + 2);
        let (mut nodes, mut differences, mut slopes) =
            ([1.0; MAX_TERMS], [0.0; MAX_TERMS], [0.0; MAX_TERMS]);
        nodes[0] = 0.0;
        for (g, (point, x)) in rod
            .element_points(e)
            .iter()
            .zip(&rod.reference().points)
            .enumerate()
        {
            for i in [2 * g + 1, 2 * g + 2] {
                nodes[i] = *x;
                differences[i] = (first - point.apex_distance) / length - x;
                slopes[i] = point.jacobian / length - 1.0;
            }
        }
        for k in 1..terms {
            for i in (k..terms).rev() {
                let gap = nodes[i] - nodes[i - k];
                differences[i] = if gap == 0.0 {
                    slopes[i]
                } else {
                    (differences[i] - differences[i - 1]) / gap
                };
            }
        }
        Self {
            first,
            length,
            terms,
            nodes,
            differences,
        }
    }

    /// The share of the length before the coordinate `x`, and its slope.
    fn share(&self, x: f64) -> (f64, f64) {
        let (mut value, mut slope) = (0.0, 0.0);
        for i in (0..self.terms).rev() {
            slope = slope * (x - self.nodes[i]) + value;
            value = value * (x - self.nodes[i]) + self.differences[i];
        }
        (x + value, 1.0 + slope)
    }

    /// The distance from the apex (m) at the coordinate `x`, and the length per coordinate there
    /// (m).
    pub fn at(&self, x: f64) -> (f64, f64) {
        let (share, slope) = self.share(x);
        (self.first - self.length * share, self.length * slope)
    }

    /// The coordinate before which the given part of the length lies.
    pub fn coordinate(&self, part: f64) -> f64 {
        let excess = |x: f64| {
            let (share, slope) = self.share(x);
            (share - part, slope)
        };
        newton([0.0, 1.0], part, ROUNDING, excess)
    }
}

impl Rod {
    /// Scales the lengths per coordinate of an element to a given length, m. Returns the factor.
    pub(crate) fn set_element_length(&mut self, e: usize, length: f64) -> f64 {
        let (factor, p) = (length / self.length_of(e), self.order.points());
        for point in &mut self.points[e * p..(e + 1) * p] {
            point.jacobian *= factor;
        }
        factor
    }

    /// Ratio of the largest to the smallest length per coordinate at the points of an element.
    pub(crate) fn jacobian_ratio(&self, e: usize) -> f64 {
        ratio(self.element_points(e).iter().map(|point| point.jacobian))
    }

    /// Ratio of the largest to the smallest length per coordinate of a growing element, at its
    /// points and between them and its ends.
    pub(crate) fn unevenness(&self, e: usize) -> f64 {
        let (points, nodes) = (self.element_points(e), &self.reference().points);
        let ends = (0.0, self.node_distance[e]);
        let places = nodes
            .iter()
            .copied()
            .zip(points.iter().map(|point| point.apex_distance));
        let places = places.chain([(1.0, self.node_distance[e + 1])]);
        let between = places.scan(ends, |before, (x, distance)| {
            let (x0, distance0) = std::mem::replace(before, (x, distance));
            Some((distance0 - distance) / (x - x0))
        });
        ratio(between.chain(points.iter().map(|point| point.jacobian)))
    }

    /// Smallest length per coordinate in an element, m: at its points, and for uneven elements on
    /// the polynomial through them.
    pub(crate) fn least_jacobian(&self, e: usize) -> f64 {
        let points = self.element_points(e);
        let least = points
            .iter()
            .map(|point| point.jacobian)
            .fold(f64::INFINITY, f64::min);
        if self.jacobian_ratio(e) <= UNEVEN {
            return least;
        }
        let parts = 8;
        let at = |i: u32| {
            weighted_jacobian(
                points,
                &self.reference().at_points(f64::from(i) / f64::from(parts)),
            )
        };
        (0..=parts).map(at).fold(least, f64::min)
    }

    /// The coordinate in element `e` of the growing zone of the point at the given distance from
    /// the apex, which must lie inside.
    pub(crate) fn coordinate_at_distance(&self, e: usize, sigma: f64) -> f64 {
        let places = Places::of(self, e);
        places.coordinate((places.first - sigma) / places.length)
    }

    /// The coordinate that divides a growing element into two of equal length.
    pub(crate) fn halfway(&self, e: usize) -> f64 {
        Places::of(self, e).coordinate(0.5)
    }
}

/// Ratio of the largest to the smallest of some numbers; infinite unless all are positive.
fn ratio(numbers: impl Iterator<Item = f64>) -> f64 {
    let (least, largest) = numbers.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    if least > 0.0 {
        largest / least
    } else {
        f64::INFINITY
    }
}
