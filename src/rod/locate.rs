//! Places along a rod, by arc length or by the initial distance from the apex, and the tissue
//! there.

use std::convert::Infallible;
use std::ops::Range;

use super::shape::weighted_jacobian;
use super::{MaterialPoint, Rod};
use crate::numerics::scalar::{bracketed_root, newton};
use crate::reference_element::MAX_POINTS;

/// Rounding of a coordinate in an element.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Distance beyond an end of a rod that is due to rounding of an arc length, relative to the
/// length.
const BEYOND: f64 = 1e-9;

/// Search for places at increasing arc lengths.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    rod: &'a Rod,
    /// Element of the last place, the arc length of its first end (m), and its length (m).
    element: usize,
    start: f64,
    length: f64,
    /// Coefficients of xᵏ⁺¹ in the arc length from its first end to the coordinate x, relative to
    /// its length.
    powers: Option<[f64; MAX_POINTS]>,
}

impl Walk<'_> {
    /// The element at arc length `s` (m), and the coordinate in it. `s` is clamped to [0, ℓ];
    /// `None` for NaN.
    pub fn to(&mut self, s: f64) -> Option<(usize, f64)> {
        if s.is_nan() {
            return None;
        }
        let mut rest = s.max(0.0) - self.start;
        while rest > self.length && self.element + 1 < self.rod.elements() {
            rest -= self.length;
            self.start += self.length;
            self.element += 1;
            (self.length, self.powers) = (self.rod.length_of(self.element), None);
        }
        Some((self.element, self.coordinate(rest)))
    }

    /// The coordinate in [0, 1] at the arc length `s` (m) from the first end of the element.
    fn coordinate(&mut self, s: f64) -> f64 {
        let (length, points) = (self.length, self.rod.element_points(self.element));
        if s >= length {
            return 1.0;
        }
        let lengths = points.iter().map(|point| point.jacobian / length);
        let powers = self
            .powers
            .get_or_insert_with(|| self.rod.reference().integral_powers(lengths));
        let share = s / length;
        let excess = |x: f64| {
            // Horner's rule for the sum over cₖ xᵏ, and for its derivative.
            let (sum, slope) = powers
                .iter()
                .rfold((0.0, 0.0), |(sum, slope), c| (sum * x + c, slope * x + sum));
            (sum * x - share, sum + slope * x)
        };
        newton([0.0, 1.0], share, ROUNDING, excess)
    }
}

impl Rod {
    /// A search from the base.
    pub(crate) fn walk(&self) -> Walk<'_> {
        Walk {
            rod: self,
            element: 0,
            start: 0.0,
            length: self.length_of(0),
            powers: None,
        }
    }

    /// The element at arc length `s` (m), and the coordinate in it. `s` is clamped to [0, ℓ];
    /// `None` for NaN.
    pub(crate) fn locate(&self, s: f64) -> Option<(usize, f64)> {
        self.walk().to(s)
    }

    /// As [`locate`](Self::locate), but `None` also for an arc length beyond the ends by more than
    /// rounding.
    pub(crate) fn locate_on(&self, s: f64) -> Option<(usize, f64)> {
        let (length, beyond) = (self.length(), BEYOND * self.length());
        if (-beyond..=length + beyond).contains(&s) {
            self.locate(s)
        } else {
            None
        }
    }

    /// The arc lengths (m) of the growth zone, from its beginning to the apex. A rod that has not
    /// been made mature is its own growth zone.
    #[must_use]
    pub fn growth_zone(&self) -> Range<f64> {
        let length = self.length();
        let zone: f64 = (self.first_growing..self.elements())
            .rev()
            .map(|e| self.length_of(e))
            .sum();
        if self.first_growing == 0 {
            0.0..length
        } else {
            length - zone..length
        }
    }

    /// The present arc length (m) of the material that was at the arc length `start` (m) at t = 0.
    /// `start` is clamped to the rod; `None` for NaN.
    ///
    /// Between material points the initial distances from the apex are interpolated.
    #[must_use]
    pub fn arc_length_of(&self, start: f64) -> Option<f64> {
        let (e, x) = self.locate_initial(self.initial_length - start)?;
        let below: f64 = (0..e).map(|e| self.length_of(e)).sum();
        Some(below + weighted_jacobian(self.element_points(e), &self.reference().integral_upto(x)))
    }

    /// The element and the coordinate in it of the material that was at a distance `d` (m) from the
    /// apex at t = 0.
    pub(crate) fn locate_initial(&self, d: f64) -> Option<(usize, f64)> {
        if d.is_nan() {
            return None;
        }
        let name = |e: usize, x: f64| self.initial_apex_distance(e, x);
        let e = (0..self.elements())
            .rev()
            .find(|&e| name(e, 0.0) >= d)
            .unwrap_or(0);
        // The initial distance decreases from base to apex.
        let excess = |x: f64| name(e, x) - d;
        if excess(1.0) >= 0.0 {
            return Some((e, 1.0));
        }
        let bracket = [0.0, 1.0].map(|x| (x, excess(x)));
        let Ok([_, x]) = bracketed_root(bracket, f64::EPSILON, |x| Ok::<_, Infallible>(excess(x)));
        Some((e, x))
    }

    /// The material at coordinate `x` of element `e`: polynomials through the points of the
    /// element.
    pub(crate) fn point_within(&self, e: usize, x: f64) -> MaterialPoint {
        let point = MaterialPoint::weighted(self.element_points(e), &self.reference().at_points(x));
        MaterialPoint {
            initial_apex_distance: self.initial_apex_distance(e, x),
            ..point
        }
    }

    /// The distance from the apex at t = 0 of the material at coordinate `x` of element `e`: the
    /// polynomial through the points. In an element with one point it is linear between the points
    /// of the neighbours.
    pub(crate) fn initial_apex_distance(&self, e: usize, x: f64) -> f64 {
        let points = self.element_points(e);
        if let [point] = points {
            let end = |beyond: Option<usize>, at_end: f64| match beyond
                .and_then(|i| self.points.get(i))
            {
                Some(next) => {
                    let share = point.jacobian / (point.jacobian + next.jacobian);
                    point.initial_apex_distance * (1.0 - share) + next.initial_apex_distance * share
                }
                None => at_end,
            };
            let (first, last) = (
                end(e.checked_sub(1), self.initial_length),
                end(Some(e + 1), 0.0),
            );
            let (from, to) = if x < 0.5 {
                (first, 1.0 - 2.0 * x)
            } else {
                (last, 2.0 * x - 1.0)
            };
            return point.initial_apex_distance + (from - point.initial_apex_distance) * to;
        }
        if !self.interpolates_initial_distance(e) {
            // In the last element the ratio to the coordinate's distance from the apex is
            // interpolated: repeated division makes the distances arbitrarily small, and
            // interpolation of the distances would leave an absolute rounding error.
            let ratios = points.iter().zip(&self.reference().points);
            let ratios = ratios.map(|(point, y)| point.initial_apex_distance / (1.0 - y));
            return (1.0 - x)
                * ratios
                    .zip(self.reference().at_points(x))
                    .map(|(ratio, w)| w * ratio)
                    .sum::<f64>();
        }
        points
            .iter()
            .zip(self.reference().at_points(x))
            .map(|(point, w)| w * point.initial_apex_distance)
            .sum()
    }

    /// Whether the distance from the apex at t = 0 is the polynomial through the points of an
    /// element.
    pub(super) fn interpolates_initial_distance(&self, e: usize) -> bool {
        self.order.points() > 1 && !(e + 1 == self.elements() && e >= self.first_growing)
    }
}
