//! Frames, strains and positions of the centre line, computed from the rotations and the strain of
//! the centre line.

use nalgebra::{UnitQuaternion, Vector3};

use super::{MaterialPoint, Rod};
use crate::numerics::interpolation::lagrange_derivatives;
use crate::reference_element::{ChordPoint, MAX_POINTS};
use crate::so3::{self, Form};

impl Rod {
    /// The frame at coordinate `x` in [0, 1] of an element.
    pub(crate) fn frame_within(&self, element: usize, x: f64) -> UnitQuaternion<f64> {
        self.frames[element]
            * so3::exp(&weighted(
                self.element_rotations(element),
                &self.reference().at_nodes(x),
            ))
    }

    /// The frame at Gauss point `g` of an element.
    pub(crate) fn frame_at_point(&self, element: usize, g: usize) -> UnitQuaternion<f64> {
        self.frames[element]
            * so3::exp(&weighted(
                self.element_rotations(element),
                &self.reference().shape[g],
            ))
    }

    /// The frame at the apex.
    #[must_use]
    pub fn apex_frame(&self) -> UnitQuaternion<f64> {
        self.frames[self.elements()]
    }

    /// The visible strain u at Gauss point `g` of an element by differentiation of the rotations,
    /// of order p + 1: components along the directors, 1/m. `None` for an element or a point out of
    /// range.
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
        let jacobian = weighted_jacobian(self.element_points(element), &reference.at_points(x));
        self.differentiated(element, &reference.at_nodes(x), &slope, jacobian)
    }

    /// The strain at a place, given the values `shape` and derivatives `slope` of the nodal
    /// polynomials there.
    fn differentiated(
        &self,
        element: usize,
        shape: &[f64; MAX_POINTS],
        slope: &[f64; MAX_POINTS],
        jacobian: f64,
    ) -> Vector3<f64> {
        let rotations = self.element_rotations(element);
        let (theta, slope) = (
            weighted(rotations, shape),
            weighted(rotations, slope) / jacobian,
        );
        Form::right_jacobian(&so3::s_functions(theta.norm_squared())).apply(&theta, &slope)
    }

    /// The strain v of the centre line at Gauss point `g` of an element in the last equilibrium,
    /// with shear v1 and v2 and stretch v3: ∂p/∂s = v1 d1 + v2 d2 + v3 d3. It is (0, 0, 1) without
    /// shear and stretch. `None` for an element or a point out of range.
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
    pub(crate) fn line_strain_at_point(&self, element: usize, g: usize) -> Vector3<f64> {
        self.line_strains
            .get(element * self.order.points() + g)
            .copied()
            .unwrap_or_else(centre_line_tangent)
    }

    /// The length of the centre line, ∫ |v| ds, m; equal to that of the rod without shear and
    /// stretch.
    #[must_use]
    pub fn centre_line_length(&self) -> f64 {
        self.length() + self.integral(self.line_strains.iter().map(|v| v.norm() - 1.0))
    }

    /// The vector from the first end of an element to its coordinate `x`, in the fixed frame, m.
    pub(crate) fn chord(&self, element: usize, x: f64) -> Vector3<f64> {
        let reference = self.reference();
        let points = (0..reference.p).map(|k| reference.chord_point(k, x));
        let strains = self
            .line_strains
            .get(element * reference.p..(element + 1) * reference.p)
            .unwrap_or_default();
        self.chord_through(
            element,
            (
                &self.frames[element],
                self.element_rotations(element),
                strains,
            ),
            points,
        )
    }

    /// As [`chord`](Self::chord), for another shape of the element and given the points of the
    /// Gauss rule. The shape is the first frame, the rotations, and the strains of the centre line,
    /// which are empty without shear and stretch.
    pub(crate) fn chord_through(
        &self,
        element: usize,
        (frame, rotations, strains): (&UnitQuaternion<f64>, &[Vector3<f64>], &[Vector3<f64>]),
        points: impl Iterator<Item = ChordPoint>,
    ) -> Vector3<f64> {
        let material = self.element_points(element);
        let part = |at: ChordPoint| {
            let strain = if strains.is_empty() {
                centre_line_tangent()
            } else {
                weighted(strains, &at.points)
            };
            let length = at.weight * weighted_jacobian(material, &at.points);
            so3::exp(&weighted(rotations, &at.nodes)) * strain * length
        };
        frame * points.map(part).sum::<Vector3<f64>>()
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

    /// The vector between the ends of an element with a given strain of the centre line at each
    /// Gauss point.
    #[inline]
    fn chord_along(
        &self,
        element: usize,
        line_strain: impl Fn(usize) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let reference = self.reference();
        let rotations = self.element_rotations(element);
        let mut sum = Vector3::zeros();
        for (g, point) in self.element_points(element).iter().enumerate() {
            let tangent = so3::exp(&weighted(rotations, &reference.shape[g])) * line_strain(g);
            sum += tangent * (reference.weights[g] * point.jacobian);
        }
        self.frames[element] * sum
    }

    /// The position of the apex in the fixed frame, m.
    #[must_use]
    pub fn tip(&self) -> Vector3<f64> {
        self.base_position
            + (0..self.elements())
                .map(|e| self.whole_chord(e))
                .sum::<Vector3<f64>>()
    }

    /// The arc length (m) and the position (m, fixed frame) of the ends of all elements.
    #[must_use]
    pub fn centre_line(&self) -> Vec<(f64, Vector3<f64>)> {
        let mut line = Vec::with_capacity(self.elements() + 1);
        let (mut s, mut position) = (0.0, self.base_position);
        line.push((s, position));
        for e in 0..self.elements() {
            s += self.length_of(e);
            position += self.whole_chord(e);
            line.push((s, position));
        }
        line
    }

    /// The position (m, fixed frame) and the frame at arc length `s` (m). `None` for NaN and for a
    /// place beyond the ends; up to rounding it is at the end.
    ///
    /// Each call integrates from the base. [`centre_line_at`](Self::centre_line_at) integrates once
    /// for many places.
    #[must_use]
    pub fn at(&self, s: f64) -> Option<(Vector3<f64>, UnitQuaternion<f64>)> {
        let (element, x) = self.locate_on(s)?;
        let start: Vector3<f64> = (0..element).map(|e| self.whole_chord(e)).sum();
        Some((
            self.base_position + (start + self.chord(element, x)),
            self.frame_within(element, x),
        ))
    }
}

/// Σ weights · vectors.
#[inline]
pub(crate) fn weighted<const N: usize>(
    vectors: &[Vector3<f64>],
    weights: &[f64; N],
) -> Vector3<f64> {
    vectors
        .iter()
        .zip(weights)
        .fold(Vector3::zeros(), |sum, (v, w)| sum + v * *w)
}

/// Σ weights · length per coordinate, m.
#[inline]
pub(crate) fn weighted_jacobian(points: &[MaterialPoint], weights: &[f64]) -> f64 {
    points
        .iter()
        .zip(weights)
        .map(|(point, w)| w * point.jacobian)
        .sum()
}

/// The tangent ∂p/∂s of a centre line without shear and stretch, components along the directors:
/// d3.
#[inline]
pub(crate) fn centre_line_tangent() -> Vector3<f64> {
    Vector3::z()
}
