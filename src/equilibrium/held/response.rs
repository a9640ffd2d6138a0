//! The response of a rod to forces at places: displacements of the places, and the step of the whole rod.
//!
//! The coordinates of a place are the three components of its position and, if required, of its tangent. A reaction is
//! the force (N) and the couple that are conjugate to them.

mod base;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::mechanics::Mechanics;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::system::System;
use crate::reference_element::MAX_POINTS;
use crate::rod::Rod;

/// A place whose displacement is required.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub element: usize,
    pub x: f64,
    /// Whether the change of the tangent is required, too.
    pub with_tangent: bool,
}

/// A linear function with three components of the unknowns of one element, eliminated as the gradient.
#[derive(Debug, Clone, Default)]
struct Part {
    rows: [Row; 3],
    /// Derivatives by the rotations of the last and of the first frame of the element.
    last: Matrix3<f64>,
    first: Matrix3<f64>,
}

/// A whole element: the derivatives of its chord, and the compliance of the elements before it.
#[derive(Debug, Clone)]
struct Chord {
    part: Part,
    /// Compliance (m/N) of the interiors and of the centre line of all elements before.
    before: Matrix3<f64>,
    /// Compliance of the centre line at each Gauss point over its weight, 1/(N m); empty without shear and stretch.
    line: Vec<Matrix3<f64>>,
    /// Weights of the Gauss points, m.
    weights: [f64; MAX_POINTS],
}

/// A place with its derivatives.
#[derive(Debug, Clone)]
struct SpotParts {
    element: usize,
    /// The part of the element up to the place.
    part: Part,
    weights: [f64; MAX_POINTS],
    tangent: Option<Part>,
    /// Number of its first coordinate.
    first: usize,
}

/// The response of a rod with a factorised tangent.
#[derive(Debug, Default)]
pub(super) struct LinearResponse {
    points: usize,
    chords: Vec<Chord>,
    places: Vec<SpotParts>,
    /// Unknowns whose diagonal entry was increased; their coordinates follow those of the places.
    boosts: Vec<usize>,
    /// Displacement of a free base per force, m/N, with its three coordinates after those of the boosts.
    base: Option<f64>,
    /// Displacements of the coordinates per reaction; symmetric.
    pub compliance: DMatrix<f64>,
    /// Couples on the frames by the reaction of each coordinate, and the rotations by them.
    columns: Vec<[Vec<Vector3<f64>>; 2]>,
}

impl Part {
    fn new(system: &System, element: usize, rows: [Row; 3], points: usize) -> Self {
        let (mut last, mut first) = (Matrix3::zeros(), Matrix3::zeros());
        for (k, row) in rows.iter().enumerate() {
            let (by_last, by_first) = system.elements[element].outer(row, points);
            last.set_row(k, &by_last.transpose());
            first.set_row(k, &by_first.transpose());
        }
        Self { rows, last, first }
    }
}

impl LinearResponse {
    /// The response of a rod whose tangent is factorised, at `spots` and in the unknowns `boosts`.
    pub fn of(body: &mut dyn Mechanics, rod: &Rod, spots: &[Spot], boosts: &[(usize, f64)]) -> Self {
        let points = rod.order().points();
        let mut response =
            Self { points, boosts: boosts.iter().map(|(unknown, _)| *unknown).collect(), ..Self::default() };
        let reach = spots.iter().map(|spot| spot.element + 1).max().unwrap_or(0);
        response.base = body.system().joints.free_base.map(|base| 1.0 / base.stiffness);
        response.add_chords(body, rod, reach);
        let mut first = 0;
        for spot in spots {
            let weights = upto_parts(rod, spot.element, spot.x);
            let part = match spot.x < 1.0 {
                true => Part::new(body.system(), spot.element, body.chord_rows(rod, spot.element, spot.x), points),
                false => response.chords[spot.element].part.clone(),
            };
            let tangent = spot
                .with_tangent
                .then(|| Part::new(body.system(), spot.element, body.tangent_rows(rod, spot.element, spot.x), points));
            response.places.push(SpotParts { element: spot.element, part, weights, tangent, first });
            first += if spot.with_tangent { 6 } else { 3 };
        }
        response.compute(body.system_mut());
        response
    }

    fn add_chords(&mut self, body: &dyn Mechanics, rod: &Rod, reach: usize) {
        let p = self.points;
        let mut before = Matrix3::zeros();
        for e in 0..reach {
            let weights = upto_parts(rod, e, 1.0);
            let part = Part::new(body.system(), e, body.chord_rows(rod, e, 1.0), p);
            let line: Option<Vec<_>> =
                (0..p).map(|g| body.line_compliance(rod, e, g).map(|compliance| compliance / weights[g])).collect();
            let chord = Chord { part, before, line: line.unwrap_or_default(), weights };
            before += self.interior(body.system(), e, &chord.part, &chord.part) + chord.yields(&weights, &weights);
            self.chords.push(chord);
        }
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.added() + self.boosts.len() + if self.base.is_some() { 3 } else { 0 }
    }

    /// The first coordinate after those of the places.
    pub fn added(&self) -> usize {
        self.places.iter().map(SpotParts::size).sum()
    }

    /// The first coordinate of a place.
    pub fn first(&self, place: usize) -> usize {
        self.places[place].first
    }

    /// Whether the tangent of each place is among the coordinates.
    pub fn with_tangents(&self) -> impl Iterator<Item = bool> + '_ {
        self.places.iter().map(|place| place.tangent.is_some())
    }

    /// The compliance of the interior of an element between two functions.
    fn interior(&self, system: &System, element: usize, a: &Part, b: &Part) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.product(system, element, &a.rows[i], &b.rows[j]))
    }

    /// The product of two eliminated rows with the inverse of the interior of an element.
    fn product(&self, system: &System, element: usize, a: &Row, b: &Row) -> f64 {
        let each = a.as_flattened().iter().zip(b.as_flattened()).zip(system.elements[element].inverse_pivots());
        each.take(3 * (self.points - 1)).map(|((a, b), inverse)| a * b * inverse).sum()
    }

    /// The compliance by the interiors and the centre line between two places.
    fn inside(&self, system: &System, a: &SpotParts, b: &SpotParts) -> Matrix3<f64> {
        let element = a.element.min(b.element);
        let chord = &self.chords[element];
        let of = |place: &SpotParts| match place.element > element {
            true => (chord.part.clone(), chord.weights),
            false => (place.part.clone(), place.weights),
        };
        let ((part_a, weights_a), (part_b, weights_b)) = (of(a), of(b));
        chord.before + self.interior(system, element, &part_a, &part_b) + chord.yields(&weights_a, &weights_b)
    }

    fn compute(&mut self, system: &mut System) {
        let size = self.size();
        self.compliance = DMatrix::zeros(size, size);
        let zero = Matrix3::zeros();
        for j in 0..self.places.len() {
            for (at, tangential) in [(0, false), (3, true)] {
                if tangential && self.places[j].tangent.is_none() {
                    continue;
                }
                for c in 0..3 {
                    let mut turns = vec![Vector3::zeros(); system.elements.len() + 1];
                    let unit = Vector3::ith(c, 1.0);
                    self.add_couples(&mut turns, j, &unit, tangential);
                    let moved = self.solve_column(system, turns);
                    let column = self.places[j].first + at + c;
                    self.compliance.column_mut(column).copy_from(&moved);
                }
            }
            for i in 0..self.places.len() {
                let (a, b) = (&self.places[i], &self.places[j]);
                let inside = self.inside(system, a, b);
                let with = |tangent: &Option<Part>, other: &SpotParts, element: usize| match tangent {
                    Some(tangent) if other.element > element => {
                        self.interior(system, element, tangent, &self.chords[element].part)
                    }
                    Some(tangent) if other.element == element => self.interior(system, element, tangent, &other.part),
                    _ => zero,
                };
                let turn_place = with(&a.tangent, b, a.element);
                let place_turn = with(&b.tangent, a, b.element).transpose();
                let turn_turn = match (&a.tangent, &b.tangent) {
                    (Some(x), Some(y)) if a.element == b.element => self.interior(system, a.element, x, y),
                    _ => zero,
                };
                let (first_a, first_b) = (a.first, b.first);
                let (turns_a, turns_b) = (a.tangent.is_some(), b.tangent.is_some());
                let mut add = |row: usize, column: usize, block: &Matrix3<f64>| {
                    let mut view = self.compliance.fixed_view_mut::<3, 3>(row, column);
                    view += block;
                };
                add(first_a, first_b, &inside);
                if turns_a {
                    add(first_a + 3, first_b, &turn_place);
                }
                if turns_b {
                    add(first_a, first_b + 3, &place_turn);
                }
                if turns_a && turns_b {
                    add(first_a + 3, first_b + 3, &turn_turn);
                }
            }
        }
        let first = self.added();
        for (k, unknown) in self.boosts.clone().into_iter().enumerate() {
            let mut turns = vec![Vector3::zeros(); system.elements.len() + 1];
            turns[system.joints.first_free() + unknown / 3][unknown % 3] = 1.0;
            let moved = self.solve_column(system, turns);
            self.compliance.column_mut(first + k).copy_from(&moved);
        }
        self.add_base(system);
        // The matrix is symmetric except for rounding. Its lower triangle makes it exactly symmetric.
        self.compliance.fill_upper_triangle_with_lower_triangle();
    }

    /// Adds the couples on the frames by a force at a place, or by the couple that is conjugate to its tangent.
    fn add_couples(&self, turns: &mut [Vector3<f64>], place: usize, force: &Vector3<f64>, tangential: bool) {
        let at = &self.places[place];
        if tangential {
            if let Some(tangent) = &at.tangent {
                tangent.add_to(turns, at.element, force);
            }
            return;
        }
        for (e, chord) in self.chords[..at.element].iter().enumerate() {
            chord.part.add_to(turns, e, force);
        }
        at.part.add_to(turns, at.element, force);
    }

    /// As [`outer`](Self::outer), for the couples of the next coordinate, which are kept.
    fn solve_column(&mut self, system: &mut System, couples: Vec<Vector3<f64>>) -> DVector<f64> {
        let mut turns = couples.clone();
        let moved = self.outer(system, &mut turns);
        self.columns.push([couples, turns]);
        moved
    }

    /// Sum of the absolute terms in the displacement of a combination of coordinates by its own reaction, which is
    /// `total`. Rounding of a sum that cancels is relative to it.
    pub fn terms(&self, factors: &[(usize, f64)], total: f64) -> f64 {
        let sum = |second: bool| {
            let mut sum = vec![Vector3::<f64>::zeros(); self.columns.first().map_or(0, |[couples, _]| couples.len())];
            for (coordinate, factor) in factors {
                let [couples, turns] = &self.columns[*coordinate];
                let each = if second { turns } else { couples };
                sum.iter_mut().zip(each).for_each(|(sum, value)| *sum += value * *factor);
            }
            sum
        };
        let products = sum(false).iter().zip(&sum(true)).map(|(a, b)| a.dot(b)).collect::<Vec<_>>();
        let outer: f64 = products.iter().sum();
        products.iter().map(|product| product.abs()).sum::<f64>() + (total - outer).abs()
    }

    /// Solves for the rotations of the frames by couples on them, and returns the displacements of the coordinates by
    /// these rotations.
    fn outer(&self, system: &mut System, turns: &mut [Vector3<f64>]) -> DVector<f64> {
        let first = system.joints.first_free();
        system.joints.confine(turns);
        system.tangent.solve(&mut turns[first..]);
        let chord = |(e, chord): (usize, &Chord)| chord.part.along(turns, e);
        let displacements = self.running(self.chords.iter().enumerate().map(chord));
        let mut moved = DVector::zeros(self.size());
        for place in &self.places {
            let by = displacements[place.element] + place.part.along(turns, place.element);
            moved.fixed_rows_mut::<3>(place.first).copy_from(&by);
            if let Some(tangent) = &place.tangent {
                moved.fixed_rows_mut::<3>(place.first + 3).copy_from(&tangent.along(turns, place.element));
            }
        }
        let last = self.added();
        for (k, unknown) in self.boosts.iter().enumerate() {
            moved[last + k] = turns[first + unknown / 3][unknown % 3];
        }
        moved
    }

    /// Running sums, which begin with zero.
    fn running(&self, each: impl Iterator<Item = Vector3<f64>>) -> Vec<Vector3<f64>> {
        let mut sums = vec![Vector3::zeros()];
        for value in each {
            sums.push(sums[sums.len() - 1] + value);
        }
        sums
    }

    /// The displacements of the coordinates by the unbalanced couples of a system, without changes of the reactions.
    pub fn free(&self, system: &mut System) -> DVector<f64> {
        let mut turns = system.turns.clone();
        let mut moved = self.outer(system, &mut turns);
        let inner = |part: &Part, e: usize| {
            let condensed = &system.elements[e].condensed;
            Vector3::from_fn(|i, _| -self.product(system, e, &part.rows[i], condensed))
        };
        let displacements = self.running(self.chords.iter().enumerate().map(|(e, chord)| inner(&chord.part, e)));
        for place in &self.places {
            let by = displacements[place.element] + inner(&place.part, place.element);
            let mut rows = moved.fixed_rows_mut::<3>(place.first);
            rows += by;
            if let Some(tangent) = &place.tangent {
                let mut rows = moved.fixed_rows_mut::<3>(place.first + 3);
                rows += inner(tangent, place.element);
            }
        }
        self.displace_base(system, &mut moved);
        moved
    }

    /// Adds reactions to the unbalanced couples of a system.
    pub fn load(&self, system: &mut System, reactions: &DVector<f64>) {
        let (mut beyond, mut sum) = (vec![Vector3::zeros(); self.chords.len()], Vector3::zeros());
        let mut turns = vec![Vector3::zeros(); system.turns.len()];
        let mut add = |part: &Part, e: usize, force: &Vector3<f64>| {
            part.add_to(&mut turns, e, force);
            for (row, factor) in part.rows.iter().zip(force.iter()) {
                system.elements[e].subtract(row, *factor);
            }
        };
        for place in &self.places {
            let force: Vector3<f64> = reactions.fixed_rows::<3>(place.first).into_owned();
            beyond[..place.element].iter_mut().for_each(|sum| *sum += force);
            sum += force;
            add(&place.part, place.element, &force);
            if let Some(tangent) = &place.tangent {
                add(tangent, place.element, &reactions.fixed_rows::<3>(place.first + 3).into_owned());
            }
        }
        for (e, (chord, force)) in self.chords.iter().zip(&beyond).enumerate() {
            add(&chord.part, e, force);
        }
        let first = system.joints.first_free();
        system.joints.confine(&mut turns);
        let last = self.added();
        for (k, unknown) in self.boosts.iter().enumerate() {
            turns[first + unknown / 3][unknown % 3] += reactions[last + k];
        }
        system.turns.iter_mut().zip(&turns).for_each(|(to, turn)| *to += turn);
        if self.base.is_some() {
            system.base += sum + reactions.fixed_rows::<3>(self.size() - 3);
        }
    }
}

impl Part {
    /// Adds the couples on the frames by a force.
    fn add_to(&self, turns: &mut [Vector3<f64>], element: usize, force: &Vector3<f64>) {
        turns[element + 1] += self.last.tr_mul(force);
        turns[element] += self.first.tr_mul(force);
    }

    /// The value for given rotations of the frames.
    fn along(&self, turns: &[Vector3<f64>], element: usize) -> Vector3<f64> {
        self.last * turns[element + 1] + self.first * turns[element]
    }
}

impl SpotParts {
    fn size(&self) -> usize {
        if self.tangent.is_some() { 6 } else { 3 }
    }
}

impl Chord {
    /// The compliance of the centre line of the element between two places with the given weights.
    fn yields(&self, a: &[f64; MAX_POINTS], b: &[f64; MAX_POINTS]) -> Matrix3<f64> {
        self.line.iter().zip(a.iter().zip(b)).map(|(compliance, (a, b))| compliance * (a * b)).sum()
    }
}

/// The weights (m) that integrate a polynomial through the material points from the start of an element to `x`.
pub(super) fn upto_parts(rod: &Rod, e: usize, x: f64) -> [f64; MAX_POINTS] {
    let mut parts = rod.reference().within(x);
    for (part, point) in parts.iter_mut().zip(rod.element_points(e)) {
        *part *= point.jacobian;
    }
    parts
}
