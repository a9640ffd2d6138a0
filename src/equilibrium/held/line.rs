//! The centre line of a rod.

use nalgebra::{UnitQuaternion, Vector3};

use super::response::upto_parts;
use crate::reference_element::{ChordPoint, Station};
use crate::rod::Rod;

/// A place of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LinePlace {
    pub element: usize,
    pub x: f64,
    pub arc_length: f64,
    /// Length of the centre line up to the place, m: the arc length unless the rod stretches.
    pub path: f64,
    pub position: Vector3<f64>,
}

/// The centre line of a rod.
#[derive(Debug, Clone, Default)]
pub(super) struct Line {
    /// Tangents ∂p/∂s at the material points.
    pub tangents: Vec<Vector3<f64>>,
    /// The base and the stations of all elements, from base to apex. The last station of an element
    /// is its end.
    pub places: Vec<LinePlace>,
    /// Number of stations in an element.
    stations: usize,
    /// Frames at the ends of elements and rotations of a rod without shear and stretch; empty
    /// otherwise.
    shape: (Vec<UnitQuaternion<f64>>, Vec<Vector3<f64>>),
}

impl Line {
    /// The line of a rod with given strains of the centre line at the material points, none without
    /// shear and stretch. A place inside an element is then the integral of d3 by the Gauss rule
    /// from the start of the element, so that the tangent is d3 up to the order of the element. For
    /// a rod that shears or stretches, it is the integral of the polynomial through the tangents at
    /// these points.
    pub fn new(rod: &Rod, strains: &[Vector3<f64>]) -> Self {
        let p = rod.order().points();
        let strain = |i: usize| strains.get(i).copied().unwrap_or_else(Vector3::z);
        let tangents = (0..rod.points().len())
            .map(|i| rod.frame_at_point(i / p, i % p) * strain(i))
            .collect();
        let stations = &rod.reference().stations;
        let base = LinePlace {
            element: 0,
            x: 0.0,
            arc_length: 0.0,
            path: 0.0,
            position: rod.base_position(),
        };
        let mut places = Vec::with_capacity(1 + rod.elements() * stations.len());
        places.push(base);
        let shape = if !strains.is_empty() {
            Default::default()
        } else {
            (rod.frames().to_vec(), rod.rotations.clone())
        };
        let mut line = Self {
            tangents,
            places,
            stations: stations.len(),
            shape,
        };
        for e in 0..rod.elements() {
            for Station { x, upto, chord } in stations {
                let mut parts = *upto;
                parts
                    .iter_mut()
                    .zip(rod.element_points(e))
                    .for_each(|(part, point)| *part *= point.jacobian);
                let place = line.within(rod, (e, *x), &parts, chord.iter().copied());
                line.places.push(place);
            }
        }
        line
    }

    /// The place at coordinate `x` of an element.
    pub fn place(&self, rod: &Rod, (element, x): (usize, f64)) -> LinePlace {
        let reference = rod.reference();
        let chord = (0..reference.p).map(|k| reference.chord_point(k, x));
        self.within(rod, (element, x), &upto_parts(rod, element, x), chord)
    }

    /// The place at coordinate `x` of an element, given the weights (m) of the integral up to there
    /// and the points of the Gauss rule for the chord.
    fn within(
        &self,
        rod: &Rod,
        (element, x): (usize, f64),
        parts: &[f64],
        chord: impl Iterator<Item = ChordPoint>,
    ) -> LinePlace {
        let p = rod.order().points();
        let mut place = LinePlace {
            element,
            x,
            ..self.places[element * self.stations]
        };
        for (tangent, part) in self.tangents[element * p..(element + 1) * p]
            .iter()
            .zip(parts)
        {
            place.position += tangent * *part;
            place.path += tangent.norm() * part;
            place.arc_length += part;
        }
        let (frames, rotations) = &self.shape;
        if let Some(frame) = frames.get(element)
            && x < 1.0
        {
            let shape = (frame, &rotations[element * p..(element + 1) * p], &[][..]);
            place.position = self.places[element * self.stations].position
                + rod.chord_through(element, shape, chord);
        }
        place
    }

    /// The stations of all elements, from base to apex.
    pub fn stations(&self) -> &[LinePlace] {
        &self.places[1..]
    }
}

/// Number of equidistant places, from base to apex, at which the displacement of a rod is measured.
/// The tip alone does not suffice, since it may be held. Shapes with fewer than eight waves are
/// resolved.
pub(super) const COMPARED: usize = 17;

/// The largest displacement (m) of the centre line of a rod from the given places of another shape,
/// which are those of `centre_line_at`.
pub(super) fn displacement(rod: &Rod, from: &[Vector3<f64>]) -> f64 {
    let moved = rod
        .centre_line_at(from.len())
        .into_iter()
        .zip(from)
        .map(|(a, b)| (a - b).norm());
    moved.fold(0.0, f64::max)
}

/// The displacement by a jump from a shape to another one, m.
pub(in crate::equilibrium) fn jump_between(from: &Rod, to: &Rod) -> f64 {
    displacement(to, &from.centre_line_at(COMPARED))
}

/// The place at a length (m) from another one, at most in the elements next to it.
pub(super) fn moved(rod: &Rod, (mut element, x): (usize, f64), by: f64) -> (usize, f64) {
    let length = |e: usize| rod.length_of(e);
    let mut rest = x * length(element) + by;
    while rest < 0.0 && element > 0 {
        element -= 1;
        rest += length(element);
    }
    while rest > length(element) && element + 1 < rod.elements() {
        rest -= length(element);
        element += 1;
    }
    (element, (rest / length(element)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::constitutive::LinearElastic;
    use crate::equilibrium::{EquilibriumSolver, NewtonSolver};
    use crate::reference_element::Order;
    use crate::scene::{Scene, Still};

    /// The largest angle (rad) between d3 and the tangent inside an element that rotates by a given
    /// angle, rad.
    fn deviation(order: Order, angle: f64, yields: bool) -> f64 {
        let still = Still::weightless();
        let mut rod = Rod::uniform(1.0, 1e-3, still.base, 1, order).unwrap();
        rod.set_intrinsic(|_| Vector3::new(angle, 0.0, 0.3 * angle));
        let tissue = LinearElastic {
            youngs_modulus: 1e7,
            poissons_ratio: 0.5,
        };
        let _ = NewtonSolver::default()
            .solve(&mut rod, &tissue, &(), &still.environment(0.0))
            .unwrap();
        let line = Line::new(
            &rod,
            &vec![Vector3::z(); if yields { order.points() } else { 0 }],
        );
        // The error of the central differences is (angle h)²/6 < 1e-9, and that of rounding is
        // 1e-13.
        let h = 1e-4;
        let at = |x: f64| line.place(&rod, (0, x)).position;
        let angles = (1..100).map(|i| {
            let x = 0.01 * f64::from(i);
            ((at(x + h) - at(x - h)) / (2.0 * h) - rod.frame_within(0, x) * Vector3::z()).norm()
        });
        angles.fold(0.0, f64::max)
    }

    #[test]
    fn tangent_inside_an_element_is_d3_up_to_the_order_of_the_element() {
        for order in Order::ALL {
            let observed =
                |yields| (deviation(order, 2.0, yields) / deviation(order, 1.0, yields)).log2();
            // Angles of 1 and 2 rad are not small: the observed orders are 2.0, 4.0, 6.0 and 7.6.
            let (exact, polynomial) = (observed(false), observed(true));
            assert!(
                (exact - order.exponent() as f64).abs() < 0.5,
                "{order:?}: {exact}"
            );
            assert!(
                (polynomial - order.points() as f64).abs() < 0.1,
                "{order:?}: {polynomial}"
            );
        }
        // The polynomial is not sufficient for contacts of coarse elements.
        assert!((deviation(Order::Four, 0.7, true) / 0.04 - 1.0).abs() < 0.01);
        assert!(deviation(Order::Four, 0.7, false) < 4e-4);
    }
}
