//! Frames, strains and positions at any place, computed from the rotations and the strain of the centre line.

use std::convert::Infallible;
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};

use super::{MaterialPoint, Rod};
use crate::numerics::interpolation::lagrange_derivatives;
use crate::numerics::scalar::{bracketed_root, newton};
use crate::reference_element::MAX_POINTS;
use crate::section::Section;
use crate::so3::{self, Form};

/// Rounding of a coordinate in an element.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

impl Rod {
    /// The rotation vector at coordinate `x` in [0, 1] of an element, relative to the frame at its first end.
    pub(crate) fn rotation_at(&self, element: usize, x: f64) -> Vector3<f64> {
        let weights = self.reference().at_nodes(x);
        weighted(self.element_rotations(element), &weights)
    }

    /// The frame at coordinate `x` in [0, 1] of an element; `None` for an element or a coordinate out of range.
    #[must_use]
    pub fn frame(&self, element: usize, x: f64) -> Option<UnitQuaternion<f64>> {
        (element < self.elements() && (0.0..=1.0).contains(&x)).then(|| self.frame_within(element, x))
    }

    /// The frame at coordinate `x` of an existing element.
    pub(crate) fn frame_within(&self, element: usize, x: f64) -> UnitQuaternion<f64> {
        self.frames[element] * so3::exp(&self.rotation_at(element, x))
    }

    /// The frame at Gauss point `g` of an element.
    pub(crate) fn frame_at_point(&self, element: usize, g: usize) -> UnitQuaternion<f64> {
        self.frames[element] * so3::exp(&weighted(self.element_rotations(element), &self.reference().shape[g]))
    }

    /// The frame at the apex.
    #[must_use]
    pub fn apex_frame(&self) -> UnitQuaternion<f64> {
        self.frames[self.elements()]
    }

    /// The visible strain u at Gauss point `g` of an element by differentiation of the rotations, of order p + 1:
    /// components along the directors, 1/m. `None` for an element or a point out of range.
    #[must_use]
    pub fn strain(&self, element: usize, g: usize) -> Option<Vector3<f64>> {
        let exists = element < self.elements() && g < self.order().points();
        exists.then(|| self.strain_at_point(element, g))
    }

    /// The visible strain at an existing point.
    pub(crate) fn strain_at_point(&self, element: usize, g: usize) -> Vector3<f64> {
        let reference = self.reference();
        let jacobian = self.element_points(element)[g].jacobian;
        self.differentiated(element, &reference.shape[g], &reference.slope[g], jacobian)
    }

    /// The visible strain at coordinate `x` of an element.
    pub(crate) fn strain_within(&self, element: usize, x: f64) -> Vector3<f64> {
        let reference = self.reference();
        let slopes = lagrange_derivatives(&reference.nodes, x);
        let mut slope = [0.0; MAX_POINTS];
        slope[..reference.p].copy_from_slice(&slopes[1..]);
        let jacobian = self.interpolate(element, x, |point| point.jacobian);
        self.differentiated(element, &reference.at_nodes(x), &slope, jacobian)
    }

    /// The strain at the place where the polynomials of the nodes have the values `shape` and the derivatives `slope`.
    fn differentiated(
        &self,
        element: usize,
        shape: &[f64; MAX_POINTS],
        slope: &[f64; MAX_POINTS],
        jacobian: f64,
    ) -> Vector3<f64> {
        let rotations = self.element_rotations(element);
        let (theta, slope) = (weighted(rotations, shape), weighted(rotations, slope) / jacobian);
        Form::right_jacobian(&so3::s_functions(theta.norm_squared())).apply(&theta, &slope)
    }

    /// The strain v of the centre line at Gauss point `g` of an element in the last equilibrium: ∂p/∂s = v1 d1 + v2 d2
    /// + v3 d3, with shear v1 and v2 and stretch v3 (1 without stretch). `None` for an element or a point out of range.
    #[must_use]
    pub fn line_strain(&self, element: usize, g: usize) -> Option<Vector3<f64>> {
        let exists = element < self.elements() && g < self.order().points();
        exists.then(|| self.line_strain_at_point(element, g))
    }

    /// Whether the centre line has shear and stretch.
    pub(crate) fn yields(&self) -> bool {
        !self.line_strains.is_empty()
    }

    /// The strain of the centre line at an existing point.
    fn line_strain_at_point(&self, element: usize, g: usize) -> Vector3<f64> {
        self.line_strains.get(element * self.order.points() + g).copied().unwrap_or_else(centre_line_tangent)
    }

    /// The strain of the centre line at coordinate `x` of an element: the polynomial through its points.
    fn line_strain_within(&self, element: usize, x: f64) -> Vector3<f64> {
        let p = self.order.points();
        let strains = self.line_strains.get(element * p..(element + 1) * p);
        strains.map_or_else(centre_line_tangent, |strains| weighted(strains, &self.reference().at_points(x)))
    }

    /// The length of the centre line, ∫ |v| ds, m; equal to that of the rod without shear and stretch.
    #[must_use]
    pub fn centre_line_length(&self) -> f64 {
        let weights = self.reference().weights.iter().cycle();
        let excess = self.line_strains.iter().zip(&self.points).zip(weights);
        self.length() + excess.map(|((v, point), w)| w * point.jacobian * (v.norm() - 1.0)).sum::<f64>()
    }

    /// The vector from the first end of an element to its coordinate `x`, in the fixed frame, m.
    pub(crate) fn chord(&self, element: usize, x: f64) -> Vector3<f64> {
        let reference = self.reference();
        let mut sum = Vector3::zeros();
        for (y, w) in reference.points.iter().zip(&reference.weights) {
            let at = x * y;
            let jacobian = weighted_jacobian(self.element_points(element), &reference.at_points(at));
            sum += so3::exp(&self.rotation_at(element, at)) * self.line_strain_within(element, at) * (w * x * jacobian);
        }
        self.frames[element] * sum
    }

    /// The vector from one end of an element to the other, in the fixed frame, m.
    fn whole_chord(&self, element: usize) -> Vector3<f64> {
        // The constant tangent is faster without shear and stretch.
        if self.yields() {
            self.chord_along(element, |g| self.line_strain_at_point(element, g))
        } else {
            self.chord_along(element, |_| centre_line_tangent())
        }
    }

    /// The vector between the ends of an element with a given strain of the centre line at each Gauss point.
    #[inline]
    fn chord_along(&self, element: usize, line_strain: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        let reference = self.reference();
        let rotations = self.element_rotations(element);
        let mut sum = Vector3::zeros();
        for (g, point) in self.element_points(element).iter().enumerate() {
            let tangent = so3::exp(&weighted(rotations, &reference.shape[g])) * line_strain(g);
            sum += tangent * (reference.weights[g] * point.jacobian);
        }
        self.frames[element] * sum
    }

    /// The position of the apex, the base being the origin, in the fixed frame, m.
    #[must_use]
    pub fn tip(&self) -> Vector3<f64> {
        (0..self.elements()).map(|e| self.whole_chord(e)).sum()
    }

    /// The arc length (m) and the position (m, fixed frame, base at the origin) of the ends of all elements.
    #[must_use]
    pub fn centre_line(&self) -> Vec<(f64, Vector3<f64>)> {
        let mut line = Vec::with_capacity(self.elements() + 1);
        let (mut s, mut position) = (0.0, Vector3::zeros());
        line.push((s, position));
        for e in 0..self.elements() {
            s += self.element_length(e);
            position += self.whole_chord(e);
            line.push((s, position));
        }
        line
    }

    /// The positions of `count` points equally spaced from base to apex, both included (m, fixed frame, base at the
    /// origin). One point is the base; none is an empty list.
    #[must_use]
    pub fn centre_line_at(&self, count: usize) -> Vec<Vector3<f64>> {
        let line = self.centre_line();
        let length = self.length();
        let last = count.saturating_sub(1).max(1);
        let place = |i: usize| {
            let (element, x) = self.locate_number(length * i as f64 / last as f64);
            line[element].1 + self.chord(element, x)
        };
        (0..count).map(place).collect()
    }

    /// The element at arc length `s` (m), and the coordinate in it. `s` is clamped to [0, ℓ]; `None` for NaN.
    #[must_use]
    pub fn locate(&self, s: f64) -> Option<(usize, f64)> {
        (!s.is_nan()).then(|| self.locate_number(s))
    }

    /// The element and the coordinate in it at an arc length `s` (m) that is not NaN.
    fn locate_number(&self, s: f64) -> (usize, f64) {
        let mut rest = s.max(0.0);
        let mut element = 0;
        let mut length = self.element_length(element);
        while rest > length && element + 1 < self.elements() {
            rest -= length;
            element += 1;
            length = self.element_length(element);
        }
        (element, self.coordinate_at_length(element, rest, length))
    }

    /// The coordinate in [0, 1] of an element of the given `length` (m) at the arc length `s` (m) from its first end.
    pub(super) fn coordinate_at_length(&self, element: usize, s: f64, length: f64) -> f64 {
        let (reference, points) = (self.reference(), self.element_points(element));
        let excess = |x: f64| {
            let before = weighted_jacobian(points, &reference.integral_upto(x));
            ((before - s) / length, weighted_jacobian(points, &reference.at_points(x)) / length)
        };
        newton([0.0, 1.0], s / length, ROUNDING, excess)
    }

    /// The arc lengths (m) of the growth zone, from its beginning to the apex. A rod that has not been made mature is
    /// its own growth zone.
    #[must_use]
    pub fn growth_zone(&self) -> Range<f64> {
        let length = self.length();
        let zone: f64 = (self.first_growing..self.elements()).rev().map(|e| self.element_length(e)).sum();
        if self.first_growing == 0 { 0.0..length } else { length - zone..length }
    }

    /// The present arc length (m) of the material that was at the arc length `start` (m) at t = 0. `start` is clamped
    /// to the rod; `None` for NaN.
    ///
    /// Between material points the initial distances from the apex are interpolated.
    #[must_use]
    pub fn arc_length_of(&self, start: f64) -> Option<f64> {
        let (e, x) = self.locate_initial(self.initial_length - start)?;
        let below: f64 = (0..e).map(|e| self.element_length(e)).sum();
        Some(below + weighted_jacobian(self.element_points(e), &self.reference().integral_upto(x)))
    }

    /// The element and the coordinate in it of the material that was at a distance `d` (m) from the apex at t = 0.
    pub(crate) fn locate_initial(&self, d: f64) -> Option<(usize, f64)> {
        if d.is_nan() {
            return None;
        }
        let name = |e: usize, x: f64| self.initial_apex_distance(e, x);
        let e = (0..self.elements()).rev().find(|&e| name(e, 0.0) >= d).unwrap_or(0);
        // The initial distance decreases from base to apex.
        let excess = |x: f64| name(e, x) - d;
        if excess(1.0) >= 0.0 {
            return Some((e, 1.0));
        }
        let bracket = [0.0, 1.0].map(|x| (x, excess(x)));
        let Ok([_, x]) = bracketed_root(bracket, f64::EPSILON, |x| Ok::<_, Infallible>(excess(x)));
        Some((e, x))
    }

    /// The value at coordinate `x` of the polynomial through a quantity at the points of element `e`.
    pub(crate) fn interpolate(&self, e: usize, x: f64, f: impl Fn(&MaterialPoint) -> f64) -> f64 {
        let weights = self.reference().at_points(x);
        self.element_points(e).iter().zip(weights).map(|(point, w)| w * f(point)).sum()
    }

    /// The section at coordinate `x` of element `e`.
    pub(crate) fn section_within(&self, e: usize, x: f64) -> Section {
        let axis = |f: fn(&MaterialPoint) -> f64| self.interpolate(e, x, f);
        Section::ellipse(axis(|point| point.section.along_d1), axis(|point| point.section.along_d2))
    }

    /// The distance from the apex at t = 0 of the material at coordinate `x` of element `e`: the polynomial through the
    /// points. In an element with one point it is linear between the points of the neighbours.
    pub(crate) fn initial_apex_distance(&self, e: usize, x: f64) -> f64 {
        let points = self.element_points(e);
        if let [point] = points {
            let end = |beyond: Option<usize>, at_end: f64| match beyond.and_then(|i| self.points.get(i)) {
                Some(next) => {
                    let share = point.jacobian / (point.jacobian + next.jacobian);
                    point.initial_apex_distance * (1.0 - share) + next.initial_apex_distance * share
                }
                None => at_end,
            };
            let (first, last) = (end(e.checked_sub(1), self.initial_length), end(Some(e + 1), 0.0));
            let (from, to) = if x < 0.5 { (first, 1.0 - 2.0 * x) } else { (last, 2.0 * x - 1.0) };
            return point.initial_apex_distance + (from - point.initial_apex_distance) * to;
        }
        if e + 1 == self.elements() && e >= self.first_growing {
            return self.initial_distance_at_apex(x);
        }
        self.interpolate(e, x, |point| point.initial_apex_distance)
    }

    /// The distance from the apex at t = 0 in the last element. Its ratio to the coordinate's distance from the apex is
    /// interpolated: repeated division makes the distances arbitrarily small, and interpolation of the distances would
    /// leave an absolute rounding error.
    fn initial_distance_at_apex(&self, x: f64) -> f64 {
        let reference = self.reference();
        let ratio = self.element_points(self.elements() - 1).iter().zip(&reference.points);
        let each = ratio.map(|(point, y)| point.initial_apex_distance / (1.0 - y)).zip(reference.at_points(x));
        (1.0 - x) * each.map(|(ratio, w)| w * ratio).sum::<f64>()
    }

    /// The position (m, fixed frame, base at the origin) and the frame at arc length `s` (m). `s` is clamped to [0, ℓ];
    /// `None` for NaN.
    #[must_use]
    pub fn at(&self, s: f64) -> Option<(Vector3<f64>, UnitQuaternion<f64>)> {
        let (element, x) = self.locate(s)?;
        let start: Vector3<f64> = (0..element).map(|e| self.whole_chord(e)).sum();
        Some((start + self.chord(element, x), self.frame_within(element, x)))
    }
}

/// Σ weights · vectors.
#[inline]
pub(crate) fn weighted(vectors: &[Vector3<f64>], weights: &[f64; MAX_POINTS]) -> Vector3<f64> {
    vectors.iter().zip(weights).fold(Vector3::zeros(), |sum, (v, w)| sum + v * *w)
}

/// Σ weights · length per coordinate, m.
pub(super) fn weighted_jacobian(points: &[MaterialPoint], weights: &[f64]) -> f64 {
    points.iter().zip(weights).map(|(point, w)| w * point.jacobian).sum()
}

/// The tangent ∂p/∂s of a centre line without shear and stretch, components along the directors: d3.
#[inline]
pub(crate) fn centre_line_tangent() -> Vector3<f64> {
    Vector3::z()
}
