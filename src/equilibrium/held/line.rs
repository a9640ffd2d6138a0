//! The centre line of a rod.

use nalgebra::Vector3;

use super::response::upto_parts;
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
    /// The base and the stations of all elements, from base to apex. The last station of an element is its end.
    pub places: Vec<LinePlace>,
    /// Number of stations in an element.
    stations: usize,
}

impl Line {
    pub fn new(rod: &Rod, tangents: Vec<Vector3<f64>>) -> Self {
        let stations = &rod.reference().stations;
        let base = LinePlace { element: 0, x: 0.0, arc_length: 0.0, path: 0.0, position: rod.base_position() };
        let mut places = Vec::with_capacity(1 + rod.elements() * stations.len());
        places.push(base);
        let mut line = Self { tangents, places, stations: stations.len() };
        for e in 0..rod.elements() {
            for (x, weights) in stations {
                let mut parts = *weights;
                parts.iter_mut().zip(rod.element_points(e)).for_each(|(part, point)| *part *= point.jacobian);
                let place = line.within(rod, (e, *x), &parts);
                line.places.push(place);
            }
        }
        line
    }

    /// The place at coordinate `x` of an element.
    pub fn place(&self, rod: &Rod, (element, x): (usize, f64)) -> LinePlace {
        self.within(rod, (element, x), &upto_parts(rod, element, x))
    }

    /// The place at coordinate `x` of an element, given the weights (m) of the integral up to there.
    fn within(&self, rod: &Rod, (element, x): (usize, f64), parts: &[f64]) -> LinePlace {
        let p = rod.order().points();
        let mut place = LinePlace { element, x, ..self.places[element * self.stations] };
        for (tangent, part) in self.tangents[element * p..(element + 1) * p].iter().zip(parts) {
            place.position += tangent * *part;
            place.path += tangent.norm() * part;
            place.arc_length += part;
        }
        place
    }

    /// The stations of all elements, from base to apex.
    pub fn stations(&self) -> &[LinePlace] {
        &self.places[1..]
    }
}

/// Number of equidistant places, from base to apex, at which the displacement of a rod is measured. The tip alone does
/// not suffice, since it may be held. Shapes with fewer than eight waves are resolved.
pub(super) const COMPARED: usize = 17;

/// The largest displacement (m) of the centre line of a rod from the given places of another shape, which are those of
/// `centre_line_at`.
pub(super) fn displacement(rod: &Rod, from: &[Vector3<f64>]) -> f64 {
    let moved = rod.centre_line_at(from.len()).into_iter().zip(from).map(|(a, b)| (a - b).norm());
    moved.fold(0.0, f64::max)
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
