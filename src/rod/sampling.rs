//! Positions at many places, in a time proportional to the number of elements plus the number of
//! places.
//!
//! A place inside an element is the Gauss rule from its start, as for a single place. Places of the
//! same element are evaluated together: their rotations, strains and lengths are polynomials in the
//! coordinate x of the element. With single places, small scenes by `Adaptive` took twice as long.

use std::array::from_fn;
use std::ops::{AddAssign, Mul};

use nalgebra::{UnitQuaternion, Vector3};
use simba::simd::{SimdValue, WideF64x4};

use super::{Rod, centre_line_tangent};
use crate::reference_element::{MAX_POINTS, ReferenceElement};
use crate::so3::{self, Form};

/// A number at four places in an element.
type AtPlaces = WideF64x4;
const LANES: usize = AtPlaces::LANES;

/// An element as polynomials in its coordinate, by the coefficients of x⁰, x¹, ….
struct Polynomials<'a> {
    reference: &'a ReferenceElement,
    frame: UnitQuaternion<f64>,
    rotation: [Vector3<f64>; MAX_POINTS + 1],
    jacobian: [f64; MAX_POINTS],
    strain: [Vector3<f64>; MAX_POINTS],
    /// Number of coefficients of the strain, which is constant without shear and stretch.
    strains: usize,
}

impl Polynomials<'_> {
    /// Vectors from the first end of the element to its coordinates `xs`, in the fixed frame, m.
    fn chords(&self, xs: [f64; LANES]) -> [Vector3<f64>; LANES] {
        let (x, p) = (AtPlaces::from(xs), self.reference.p);
        let mut sum = Vector3::repeat(AtPlaces::ZERO);
        for (point, weight) in self.reference.points.iter().zip(&self.reference.weights) {
            let at = x * AtPlaces::splat(*point);
            let value = |of: &[Vector3<f64>]| -> Vector3<AtPlaces> {
                of.iter().rfold(Vector3::repeat(AtPlaces::ZERO), |sum, c| {
                    sum * at + c.map(AtPlaces::splat)
                })
            };
            let (theta, strain) = (
                value(&self.rotation[..=p]),
                value(&self.strain[..self.strains]),
            );
            let jacobian = self.jacobian[..p]
                .iter()
                .rfold(AtPlaces::ZERO, |sum, c| sum * at + AtPlaces::splat(*c));
            let tangent = Form::exp(&so3::s_functions(theta.dot(&theta))).apply(&theta, &strain);
            sum += tangent * (jacobian * AtPlaces::splat(*weight));
        }
        let [x1, x2, x3]: [[f64; LANES]; 3] =
            [(sum.x * x).into(), (sum.y * x).into(), (sum.z * x).into()];
        from_fn(|i| self.frame * Vector3::new(x1[i], x2[i], x3[i]))
    }
}

impl Rod {
    /// The positions of `count` points at equal arc lengths from base to apex, both included (m,
    /// fixed frame). A single point is the base. They are those of [`at`](Self::at), up to
    /// rounding.
    #[must_use]
    pub fn centre_line_at(&self, count: usize) -> Vec<Vector3<f64>> {
        let last = count.saturating_sub(1).max(1);
        let mut positions = Vec::with_capacity(count);
        self.append_positions((0..count).map(|i| i as f64 / last as f64), &mut positions);
        positions
    }

    /// Appends the positions at the given increasing arc lengths, relative to the length (m, fixed
    /// frame). A rod whose length is NaN has no positions.
    pub(crate) fn append_positions(
        &self,
        shares: impl Iterator<Item = f64>,
        positions: &mut Vec<Vector3<f64>>,
    ) {
        let (line, length, mut walk) = (self.centre_line(), self.length(), self.walk());
        let mut places = shares
            .filter_map(|share| walk.to(length * share))
            .peekable();
        let mut element: Option<(usize, Polynomials)> = None;
        while let Some((e, x)) = places.next() {
            let (_, polynomials) = match element.take_if(|(other, _)| *other == e) {
                Some(same) => element.insert(same),
                None => element.insert((e, self.polynomials(e))),
            };
            let (mut xs, mut count) = ([x; LANES], 1);
            while count < LANES
                && let Some((_, x)) = places.next_if(|place| place.0 == e)
            {
                (xs[count], count) = (x, count + 1);
            }
            let chords = polynomials.chords(xs);
            positions.extend(xs[..count].iter().zip(chords).map(|(x, chord)| match x {
                0.0 => line[e].1,
                1.0 => line[e + 1].1,
                _ => line[e].1 + chord,
            }));
        }
    }

    /// An element as polynomials.
    fn polynomials(&self, element: usize) -> Polynomials<'_> {
        let reference = self.reference();
        let p = reference.p;
        let mut strain = [Vector3::zeros(); MAX_POINTS];
        let strains = match self.line_strains.get(element * p..(element + 1) * p) {
            Some(own) => {
                combine(own.iter().copied(), &reference.point_powers, &mut strain);
                p
            }
            None => {
                strain[0] = centre_line_tangent();
                1
            }
        };
        let (mut rotation, mut jacobian) = ([Vector3::zeros(); MAX_POINTS + 1], [0.0; MAX_POINTS]);
        combine(
            self.element_rotations(element).iter().copied(),
            &reference.node_powers,
            &mut rotation,
        );
        combine(
            self.element_points(element)
                .iter()
                .map(|point| point.jacobian),
            &reference.point_powers,
            &mut jacobian,
        );
        Polynomials {
            reference,
            frame: self.frames[element],
            rotation,
            jacobian,
            strain,
            strains,
        }
    }
}

/// Adds the polynomials with given values at the places of a basis.
fn combine<T: Copy + AddAssign + Mul<f64, Output = T>, const N: usize>(
    values: impl Iterator<Item = T>,
    basis: &[[f64; N]],
    to: &mut [T; N],
) {
    for (value, powers) in values.zip(basis) {
        to.iter_mut()
            .zip(powers)
            .for_each(|(to, power)| *to += value * *power);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::reference_element::Order;

    /// A quarter turn of a rod of 1 m. Its rotations are linear in arc length, which elements of
    /// all orders represent.
    fn arc(elements: usize, order: Order) -> Rod {
        let mut rod = Rod::uniform(1.0, 1e-3, UnitQuaternion::identity(), elements, order).unwrap();
        let turn = Vector3::y() * (FRAC_PI_2 / elements as f64);
        let nodes = rod.reference().nodes[1..].to_vec();
        rod.rotations = nodes
            .iter()
            .cycle()
            .take(elements * nodes.len())
            .map(|x| turn * *x)
            .collect();
        rod.chain_frames();
        rod
    }

    /// The place on the circle at an arc length, m.
    fn on_circle(s: f64) -> Vector3<f64> {
        let (sin, cos) = (FRAC_PI_2 * s).sin_cos();
        Vector3::new(1.0 - cos, 0.0, sin) / FRAC_PI_2
    }

    #[test]
    fn positions_are_those_of_single_places() {
        for (order, yields) in Order::ALL
            .into_iter()
            .flat_map(|order| [(order, false), (order, true)])
        {
            let mut rod = arc(3, order);
            let points = if yields { rod.points().len() } else { 0 };
            rod.line_strains = (0..points)
                .map(|i| Vector3::new(0.1, -0.02 * i as f64, 1.0 + 0.01 * i as f64))
                .collect();
            for (i, position) in rod.centre_line_at(31).iter().enumerate() {
                let (place, _) = rod.at(i as f64 / 30.0).unwrap();
                // Rounding of sums of three chords.
                assert!(
                    (position - place).norm() < 1e-15,
                    "{order:?}, {yields}, place {i}"
                );
            }
        }
    }

    /// The part of the line inside an element ends at the next node.
    #[test]
    fn line_is_continuous_at_nodes() {
        for order in Order::ALL {
            let (near, mut places) = (1e-9, Vec::new());
            arc(2, order).append_positions([0.5 - near, 0.5 + near].into_iter(), &mut places);
            let [before, after] = [places[0], places[1]];
            // The length of the tangent inside an element has the error of the order, a tenth at
            // order two.
            assert!((after - before).norm() < 2.2 * near, "{order:?}");
        }
    }

    #[test]
    fn places_in_several_elements_have_the_error_of_the_nodes() {
        for order in Order::ALL {
            let rod = arc(7, order);
            let nodes = rod
                .centre_line()
                .into_iter()
                .map(|(s, p)| (p - on_circle(s)).norm())
                .fold(0.0, f64::max);
            for (i, position) in rod.centre_line_at(31).iter().enumerate() {
                let error = (position - on_circle(i as f64 / 30.0)).norm();
                // Gauss rules over parts of an element are more accurate than those over whole
                // elements.
                assert!(
                    error < 1e-14 + nodes,
                    "{order:?}, place {i}: {error:e} and {nodes:e}"
                );
            }
        }
    }
}
