//! Positions at many places, in a time proportional to the number of elements plus the number of places.
//!
//! In an element the tangent is interpolated at eight Gauss points. Its integral is a polynomial in 2x − 1.

use std::sync::OnceLock;

use nalgebra::Vector3;
use simba::simd::{SimdValue, WideF64x4};

use super::Rod;
use crate::numerics::interpolation::lagrange_powers;
use crate::numerics::quadrature::gauss;
use crate::reference_element::{MAX_POINTS, ReferenceElement, interpolated, total};
use crate::so3::{self, Form};

/// Number of Gauss points. In an element that is a quarter of a circle, the error is below that of the chord by four
/// Gauss points.
const STATIONS: usize = 8;

/// A number at four stations, or at four other places in an element.
type AtPlaces = WideF64x4;
const LANES: usize = AtPlaces::LANES;

/// Gauss points of an element at which the tangents are evaluated together.
#[derive(Debug, Clone, Copy)]
struct Stations {
    /// Coordinates in the element.
    x: [f64; LANES],
    /// Weights of the rotations and of the material points of an element for the values at the stations.
    rotations: [AtPlaces; MAX_POINTS],
    points: [AtPlaces; MAX_POINTS],
    /// Coefficients of (2x − 1)ᵏ in the integral from 0 to x of the polynomial that is one at a station and zero at
    /// the others.
    powers: [AtPlaces; STATIONS + 1],
}

/// The stations of an element, computed once for each order.
fn stations(reference: &ReferenceElement) -> &'static [Stations; STATIONS / LANES] {
    static ALL: [OnceLock<[Stations; STATIONS / LANES]>; MAX_POINTS] = [const { OnceLock::new() }; MAX_POINTS];
    ALL[reference.p - 1].get_or_init(|| {
        let places = gauss(STATIONS).0;
        let centred: Vec<f64> = places.iter().map(|x| 2.0 * x - 1.0).collect();
        let powers = |i: usize| {
            let mut powers = [0.0; STATIONS + 1];
            for (k, coefficient) in lagrange_powers::<STATIONS>(&centred, i).into_iter().enumerate() {
                powers[k + 1] = 0.5 * coefficient / (k + 1) as f64;
            }
            // The integral is zero at x = 0, by Horner's rule for 2x − 1 = −1.
            powers[0] = powers[1..].iter().rfold(0.0, |sum, coefficient| coefficient - sum);
            powers
        };
        std::array::from_fn(|group| {
            let each = |value: &dyn Fn(usize) -> f64| AtPlaces::from([0, 1, 2, 3].map(|i| value(group * LANES + i)));
            Stations {
                x: std::array::from_fn(|i| places[group * LANES + i]),
                rotations: std::array::from_fn(|k| each(&|i| reference.at_nodes(places[i])[k])),
                points: std::array::from_fn(|k| each(&|i| reference.at_points(places[i])[k])),
                powers: std::array::from_fn(|k| each(&|i| powers(i)[k])),
            }
        })
    })
}

impl Rod {
    /// The positions of `count` points at equal arc lengths from base to apex, both included (m, fixed frame). A
    /// single point is the base.
    #[must_use]
    pub fn centre_line_at(&self, count: usize) -> Vec<Vector3<f64>> {
        let last = count.saturating_sub(1).max(1);
        let mut positions = Vec::with_capacity(count);
        self.append_positions((0..count).map(|i| i as f64 / last as f64), &mut positions);
        positions
    }

    /// Appends the positions at the given increasing arc lengths, relative to the length (m, fixed frame). A rod
    /// whose length is NaN has no positions.
    pub(crate) fn append_positions(&self, shares: impl Iterator<Item = f64>, positions: &mut Vec<Vector3<f64>>) {
        let (line, length, mut walk) = (self.centre_line(), self.length(), self.walk());
        let mut places = shares.filter_map(|share| walk.to(length * share)).peekable();
        let mut powers = (usize::MAX, [Vector3::zeros(); STATIONS + 1]);
        while let Some((e, x)) = places.next() {
            if e != powers.0 {
                powers = (e, self.chord_powers(e));
            }
            // Places in the same element are evaluated together.
            let (mut xs, mut count) = ([x; LANES], 1);
            while count < LANES
                && let Some((_, x)) = places.next_if(|place| place.0 == e)
            {
                (xs[count], count) = (x, count + 1);
            }
            let t = AtPlaces::from(xs.map(|x| 2.0 * x - 1.0));
            let zero = Vector3::repeat(AtPlaces::ZERO);
            let chords = powers.1.iter().rfold(zero, |sum, power| sum * t + power.map(AtPlaces::splat));
            let [x1, x2, x3]: [[f64; LANES]; 3] = [chords.x.into(), chords.y.into(), chords.z.into()];
            positions.extend(xs[..count].iter().enumerate().map(|(i, x)| match x {
                0.0 => line[e].1,
                1.0 => line[e + 1].1,
                _ => line[e].1 + Vector3::new(x1[i], x2[i], x3[i]),
            }));
        }
    }

    /// Coefficients of (2x − 1)ᵏ in the vector from the first end of an element to the coordinate x, in the fixed
    /// frame, m.
    fn chord_powers(&self, element: usize) -> [Vector3<f64>; STATIONS + 1] {
        let (rotations, points) = (self.element_rotations(element), self.element_points(element));
        let mut sums = [Vector3::repeat(AtPlaces::ZERO); STATIONS + 1];
        for stations in stations(self.reference()) {
            let theta = interpolated(rotations, &stations.rotations);
            let each = points.iter().zip(&stations.points);
            let jacobian = each.fold(AtPlaces::ZERO, |sum, (point, w)| sum + AtPlaces::splat(point.jacobian) * *w);
            let strains = stations.x.map(|x| self.line_strain_within(element, x));
            let strain = Vector3::from_fn(|i, _| AtPlaces::from(strains.map(|strain| strain[i])));
            let tangent = Form::exp(&so3::s_functions(theta.dot(&theta))).apply(&theta, &strain) * jacobian;
            sums.iter_mut().zip(&stations.powers).for_each(|(sum, power)| *sum += tangent * *power);
        }
        let frame = self.frames[element].to_rotation_matrix();
        sums.map(|sum| frame * sum.map(total))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::reference_element::Order;

    /// A quarter turn of a rod of 1 m. Its rotations are linear in arc length, which elements of all orders represent.
    fn arc(elements: usize, order: Order) -> Rod {
        let mut rod = Rod::uniform(1.0, 1e-3, UnitQuaternion::identity(), elements, order).unwrap();
        let turn = Vector3::y() * (FRAC_PI_2 / elements as f64);
        let nodes = rod.reference().nodes[1..].to_vec();
        rod.rotations = nodes.iter().cycle().take(elements * nodes.len()).map(|x| turn * *x).collect();
        rod.chain_frames();
        rod
    }

    /// The place on the circle at an arc length, m.
    fn on_circle(s: f64) -> Vector3<f64> {
        let (sin, cos) = (FRAC_PI_2 * s).sin_cos();
        Vector3::new(1.0 - cos, 0.0, sin) / FRAC_PI_2
    }

    #[test]
    fn places_in_an_element_are_on_the_circle() {
        for order in Order::ALL {
            let line = arc(1, order).centre_line_at(31);
            // The apex has the error of the quadrature of the order.
            for (i, position) in line.iter().enumerate().take(30) {
                let error = (position - on_circle(i as f64 / 30.0)).norm();
                // The first neglected term is at most the spherical Bessel function j₈(π/4) = 4.2e-9.
                assert!(error < 4.3e-9, "{order:?}, place {i}: {error:e}");
            }
        }
    }

    #[test]
    fn places_in_several_elements_have_the_error_of_the_nodes() {
        for order in Order::ALL {
            let rod = arc(7, order);
            let nodes = rod.centre_line().into_iter().map(|(s, p)| (p - on_circle(s)).norm()).fold(0.0, f64::max);
            for (i, position) in rod.centre_line_at(31).iter().enumerate() {
                let error = (position - on_circle(i as f64 / 30.0)).norm();
                // The neglected terms are below rounding.
                assert!(error < 1e-14 + nodes, "{order:?}, place {i}: {error:e} and {nodes:e}");
            }
        }
    }
}
