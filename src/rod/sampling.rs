//! Positions at many places, in a time proportional to the number of elements plus the number of places.
//!
//! In an element the tangent is interpolated at eight Gauss points. Its integral is a polynomial in 2x − 1.

use std::sync::OnceLock;

use nalgebra::Vector3;

use super::Rod;
use super::shape::{weighted, weighted_jacobian};
use crate::numerics::interpolation::lagrange_powers;
use crate::numerics::quadrature::gauss;
use crate::reference_element::{MAX_POINTS, ReferenceElement};
use crate::so3;

/// Number of Gauss points. In an element that is a quarter of a circle, the error is below that of the chord by four
/// Gauss points.
const STATIONS: usize = 8;

/// Gauss point at which the tangent is evaluated.
#[derive(Debug, Clone, Copy, Default)]
struct Station {
    /// Coordinate in the element.
    x: f64,
    /// Weights of the rotations and of the material points of an element for the values at the station.
    rotations: [f64; MAX_POINTS],
    points: [f64; MAX_POINTS],
    /// Coefficients of (2x − 1)ᵏ in the integral from 0 to x of the polynomial that is one at this station and zero at
    /// the others.
    powers: [f64; STATIONS + 1],
}

/// The stations of an element, computed once for each order.
fn stations(reference: &ReferenceElement) -> &'static [Station; STATIONS] {
    static ALL: [OnceLock<[Station; STATIONS]>; MAX_POINTS] = [const { OnceLock::new() }; MAX_POINTS];
    ALL[reference.p - 1].get_or_init(|| {
        let places = gauss(STATIONS).0;
        let centred: Vec<f64> = places.iter().map(|x| 2.0 * x - 1.0).collect();
        std::array::from_fn(|i| {
            let x = places[i];
            let mut powers = [0.0; STATIONS + 1];
            for (k, coefficient) in lagrange_powers(&centred, i).into_iter().enumerate() {
                powers[k + 1] = 0.5 * coefficient / (k + 1) as f64;
            }
            // The integral is zero at x = 0, by Horner's rule for 2x − 1 = −1.
            powers[0] = powers[1..].iter().rfold(0.0, |sum, coefficient| coefficient - sum);
            Station { x, rotations: reference.at_nodes(x), points: reference.at_points(x), powers }
        })
    })
}

impl Rod {
    /// The positions of `count` points at equal arc lengths from base to apex, both included (m, fixed frame, base at
    /// the origin). A single point is the base.
    #[must_use]
    pub fn centre_line_at(&self, count: usize) -> Vec<Vector3<f64>> {
        let last = count.saturating_sub(1).max(1);
        self.positions_at((0..count).map(|i| i as f64 / last as f64))
    }

    /// Positions at the given increasing arc lengths, relative to the length (m, fixed frame, base at the origin).
    pub(crate) fn positions_at(&self, shares: impl ExactSizeIterator<Item = f64>) -> Vec<Vector3<f64>> {
        let (line, length, mut walk) = (self.centre_line(), self.length(), self.walk());
        // The element of the last place, and the polynomial in it.
        let mut last = (usize::MAX, [Vector3::zeros(); STATIONS + 1]);
        let mut positions = Vec::with_capacity(shares.len());
        let at = |share: f64| match share {
            0.0 => Some(Vector3::zeros()),
            1.0 => line.last().map(|(_, tip)| *tip),
            _ => {
                let (e, x) = walk.to(length * share)?;
                if last.0 != e {
                    last = (e, self.chord_powers(e));
                }
                let t = 2.0 * x - 1.0;
                Some(line[e].1 + last.1.iter().rfold(Vector3::zeros(), |sum, coefficient| sum * t + coefficient))
            }
        };
        positions.extend(shares.filter_map(at));
        positions
    }

    /// Coefficients of (2x − 1)ᵏ in the vector from the first end of an element to the coordinate x, in the fixed
    /// frame, m.
    fn chord_powers(&self, element: usize) -> [Vector3<f64>; STATIONS + 1] {
        let mut sums = [Vector3::zeros(); STATIONS + 1];
        for Station { x, rotations, points, powers } in stations(self.reference()) {
            let rotation = so3::exp(&weighted(self.element_rotations(element), rotations));
            let jacobian = weighted_jacobian(self.element_points(element), points);
            let tangent = rotation * self.line_strain_within(element, *x) * jacobian;
            sums.iter_mut().zip(powers).for_each(|(sum, power)| *sum += tangent * *power);
        }
        let frame = self.frames[element];
        sums.map(|sum| frame * sum)
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
