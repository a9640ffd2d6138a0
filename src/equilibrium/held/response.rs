//! The response of a rod to forces at places: displacements of the places, and the step of the
//! whole rod.
//!
//! The coordinates of a place are the three components of its position and, if required, of its
//! tangent. A reaction is the force (N) and the couple that are conjugate to them.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::mechanics::Mechanics;
use crate::equilibrium::elimination::Row;
use crate::equilibrium::system::System;
use crate::reference_element::MAX_POINTS;
use crate::rod::Rod;

/// Three coordinates of a place as linear functions of the unknowns of its element: the position
/// relative to the start of the element, or the tangent.
#[derive(Debug, Clone)]
struct Coordinates {
    /// The element of the place.
    element: usize,
    /// Derivatives by the unknowns of the element, eliminated as the gradient.
    rows: [Row; 3],
    /// Derivatives by the rotations of the last and of the first frame of the element.
    last: Matrix3<f64>,
    first: Matrix3<f64>,
    /// Weights (m) of the Gauss points up to the place; `None` for a tangent, to which elements
    /// before add nothing.
    weights: Option<[f64; MAX_POINTS]>,
}

/// A whole element: its chord, and the compliance of the elements before it.
#[derive(Debug, Clone)]
struct Chord {
    /// The position of the last frame of the element.
    end: Coordinates,
    /// Compliance (m/N) of the interiors and of the centre line of all elements before.
    before: Matrix3<f64>,
    /// Compliance of the centre line at each Gauss point over its weight, 1/(N m); empty without
    /// shear and stretch.
    line: Vec<Matrix3<f64>>,
}

/// The response of a rod with a factorised tangent.
#[derive(Debug, Default)]
pub(super) struct LinearResponse {
    points: usize,
    chords: Vec<Chord>,
    /// The coordinates of all places: triple k begins with coordinate 3 k.
    triples: Vec<Coordinates>,
    /// The first coordinate of each place, and whether its tangent follows.
    places: Vec<(usize, bool)>,
    /// Unknowns whose diagonal entry was increased; their coordinates follow those of the places.
    boosts: Vec<usize>,
    /// Displacement of a free base per force, m/N, with its three coordinates after those of the
    /// boosts.
    base: Option<f64>,
    /// Displacements of the coordinates per reaction; symmetric.
    pub compliance: DMatrix<f64>,
    /// Couples on the frames by the reaction of each coordinate, and the rotations by them.
    columns: Vec<[Vec<Vector3<f64>>; 2]>,
}

impl Coordinates {
    /// The coordinates with given derivatives by the unknowns of an element of `points` Gauss
    /// points.
    fn new(
        system: &System,
        element: usize,
        points: usize,
        rows: [Row; 3],
        weights: Option<[f64; MAX_POINTS]>,
    ) -> Self {
        let (mut last, mut first) = (Matrix3::zeros(), Matrix3::zeros());
        for (k, row) in rows.iter().enumerate() {
            let (by_last, by_first) = system.elements[element].outer(row, points);
            last.set_row(k, &by_last.transpose());
            first.set_row(k, &by_first.transpose());
        }
        Self {
            element,
            rows,
            last,
            first,
            weights,
        }
    }

    /// Adds the couples on the frames by a force.
    fn add_to(&self, couples: &mut [Vector3<f64>], force: &Vector3<f64>) {
        couples[self.element + 1] += self.last.tr_mul(force);
        couples[self.element] += self.first.tr_mul(force);
    }

    /// The value for given rotations of the frames.
    fn along(&self, turns: &[Vector3<f64>]) -> Vector3<f64> {
        self.last * turns[self.element + 1] + self.first * turns[self.element]
    }
}

impl LinearResponse {
    /// The response of a rod whose tangent is factorised, at places and in the unknowns `boosts`. A
    /// place is an element and a coordinate in it, with whether the change of its tangent is
    /// required.
    pub fn of(
        body: &mut dyn Mechanics,
        rod: &Rod,
        places: &[((usize, f64), bool)],
        boosts: &[(usize, f64)],
    ) -> Self {
        let points = rod.order().points();
        let mut response = Self {
            points,
            boosts: boosts.iter().map(|(unknown, _)| *unknown).collect(),
            ..Self::default()
        };
        let reach = places
            .iter()
            .map(|((element, _), _)| element + 1)
            .max()
            .unwrap_or(0);
        response.base = body
            .system()
            .joints
            .free_base
            .map(|base| 1.0 / base.stiffness);
        response.add_chords(body, rod, reach);
        for &((element, x), with_tangent) in places {
            response.places.push((response.added(), with_tangent));
            let coordinates =
                |rows, weights| Coordinates::new(body.system(), element, points, rows, weights);
            let position = match x < 1.0 {
                true => coordinates(
                    body.chord_rows(rod, element, x),
                    Some(upto_parts(rod, element, x)),
                ),
                false => response.chords[element].end.clone(),
            };
            response.triples.push(position);
            if with_tangent {
                response
                    .triples
                    .push(coordinates(body.tangent_rows(rod, element, x), None));
            }
        }
        response.compute(body.system_mut());
        response
    }

    fn add_chords(&mut self, body: &dyn Mechanics, rod: &Rod, reach: usize) {
        let p = self.points;
        let mut before = Matrix3::zeros();
        for e in 0..reach {
            let weights = upto_parts(rod, e, 1.0);
            let end = Coordinates::new(
                body.system(),
                e,
                p,
                body.chord_rows(rod, e, 1.0),
                Some(weights),
            );
            let line: Option<Vec<_>> = (0..p)
                .map(|g| {
                    body.line_compliance(rod, e, g)
                        .map(|compliance| compliance / weights[g])
                })
                .collect();
            let chord = Chord {
                end,
                before,
                line: line.unwrap_or_default(),
            };
            before += self.interior(body.system(), &chord.end, &chord.end)
                + chord.yields(&weights, &weights);
            self.chords.push(chord);
        }
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.added() + self.boosts.len() + if self.base.is_some() { 3 } else { 0 }
    }

    /// The first coordinate after those of the places.
    pub fn added(&self) -> usize {
        3 * self.triples.len()
    }

    /// The first coordinate of a place.
    pub fn first(&self, place: usize) -> usize {
        self.places[place].0
    }

    /// Whether the tangent of each place is among the coordinates.
    pub fn with_tangents(&self) -> impl Iterator<Item = bool> + '_ {
        self.places.iter().map(|(_, with_tangent)| *with_tangent)
    }

    /// The compliance of the interior of an element between coordinates in it.
    fn interior(&self, system: &System, a: &Coordinates, b: &Coordinates) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.product(system, a.element, &a.rows[i], &b.rows[j]))
    }

    /// The product of two eliminated rows with the inverse of the interior of an element.
    fn product(&self, system: &System, element: usize, a: &Row, b: &Row) -> f64 {
        let each = a
            .as_flattened()
            .iter()
            .zip(b.as_flattened())
            .zip(&system.elements[element].hessian.inverse);
        each.take(3 * (self.points - 1))
            .map(|((a, b), inverse)| a * b * inverse)
            .sum()
    }

    /// The coordinates that an element adds to those of a place in or beyond it; `None` for a
    /// tangent beyond it.
    fn in_element<'a>(&'a self, at: &'a Coordinates, e: usize) -> Option<&'a Coordinates> {
        if at.element == e {
            Some(at)
        } else {
            at.weights.is_some().then(|| &self.chords[e].end)
        }
    }

    /// The compliance by the interiors and the centre line between two positions or tangents.
    fn inside(&self, system: &System, a: &Coordinates, b: &Coordinates) -> Matrix3<f64> {
        let e = a.element.min(b.element);
        let (Some(a), Some(b)) = (self.in_element(a, e), self.in_element(b, e)) else {
            return Matrix3::zeros();
        };
        let (interior, chord) = (self.interior(system, a, b), &self.chords[e]);
        let (Some(weights_a), Some(weights_b)) = (&a.weights, &b.weights) else {
            return interior;
        };
        chord.before + interior + chord.yields(weights_a, weights_b)
    }

    /// Computes the compliance, and the couples and rotations by the reaction of each coordinate.
    fn compute(&mut self, system: &mut System) {
        let size = self.size();
        self.compliance = DMatrix::zeros(size, size);
        for j in 0..self.triples.len() {
            for c in 0..3 {
                let (mut couples, unit) = (
                    vec![Vector3::zeros(); system.elements.len() + 1],
                    Vector3::ith(c, 1.0),
                );
                let at = &self.triples[j];
                let before = if at.weights.is_some() { at.element } else { 0 };
                let each = self.chords[..before]
                    .iter()
                    .map(|chord| &chord.end)
                    .chain([at]);
                each.for_each(|part| part.add_to(&mut couples, &unit));
                self.add_column(system, couples);
            }
            for i in 0..self.triples.len() {
                let inside = self.inside(system, &self.triples[i], &self.triples[j]);
                let mut block = self.compliance.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                block += inside;
            }
        }
        for unknown in self.boosts.clone() {
            let mut couples = vec![Vector3::zeros(); system.elements.len() + 1];
            couples[system.joints.first_free() + unknown / 3][unknown % 3] = 1.0;
            self.add_column(system, couples);
        }
        self.add_base(system);
        // The matrix is symmetric except for rounding. Its lower triangle makes it exactly
        // symmetric.
        self.compliance.fill_upper_triangle_with_lower_triangle();
    }

    /// Sets the next column of the compliance to the displacements by couples on the frames.
    fn add_column(&mut self, system: &mut System, couples: Vec<Vector3<f64>>) {
        let mut turns = couples.clone();
        let moved = self.outer(system, &mut turns);
        self.compliance
            .column_mut(self.columns.len())
            .copy_from(&moved);
        self.columns.push([couples, turns]);
    }

    /// The sum of c cᵀ over the frames for the couples cᵀ f on them by a force f at a place, m². It
    /// contains the geometry alone: a compliance may vanish at a critical load, and the axes in which
    /// it does are not those in which the rod is straight.
    pub fn levers(&self, place: usize) -> Matrix3<f64> {
        let first = self.first(place);
        Matrix3::from_fn(|i, j| {
            let [a, b] = [i, j].map(|axis| &self.columns[first + axis][0]);
            a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
        })
    }

    /// The rotations of the frames by given reactions.
    pub fn turns(&self, reactions: &DVector<f64>) -> Vec<Vector3<f64>> {
        let count = self.columns.first().map_or(0, |[_, turns]| turns.len());
        let mut sum = vec![Vector3::zeros(); count];
        for ([_, turns], factor) in self.columns.iter().zip(reactions.iter()) {
            let each = sum.iter_mut().zip(turns);
            each.for_each(|(sum, turn)| *sum += turn * *factor);
        }
        sum
    }

    /// Sum of the absolute terms in the displacement of a combination of coordinates by its own
    /// reaction, which is `total`. Rounding of a sum that cancels is relative to it.
    pub fn terms(&self, factors: &[(usize, f64)], total: f64) -> f64 {
        let [couples, turns] = [0, 1].map(|k| {
            let mut sum = vec![
                Vector3::<f64>::zeros();
                self.columns.first().map_or(0, |[couples, _]| couples.len())
            ];
            for (coordinate, factor) in factors {
                let each = sum.iter_mut().zip(&self.columns[*coordinate][k]);
                each.for_each(|(sum, value)| *sum += value * *factor);
            }
            sum
        });
        let products = couples
            .iter()
            .zip(&turns)
            .map(|(a, b)| a.dot(b))
            .collect::<Vec<f64>>();
        let outer: f64 = products.iter().sum();
        products.iter().map(|product| product.abs()).sum::<f64>() + (total - outer).abs()
    }

    /// Solves for the rotations of the frames by couples on them, and returns the displacements of
    /// the coordinates by these rotations.
    fn outer(&self, system: &mut System, turns: &mut [Vector3<f64>]) -> DVector<f64> {
        let first = system.joints.first_free();
        system.joints.confine(turns);
        system.tangent.solve(&mut turns[first..]);
        let mut moved = DVector::zeros(self.size());
        for (k, by) in self.gathered(|part| part.along(turns)).enumerate() {
            moved.fixed_rows_mut::<3>(3 * k).copy_from(&by);
        }
        let last = self.added();
        for (k, unknown) in self.boosts.iter().enumerate() {
            moved[last + k] = turns[first + unknown / 3][unknown % 3];
        }
        moved
    }

    /// The sums of a function over the elements before each place and the part of its own element.
    fn gathered(
        &self,
        of: impl Fn(&Coordinates) -> Vector3<f64>,
    ) -> impl Iterator<Item = Vector3<f64>> {
        let mut before = vec![Vector3::zeros()];
        for (e, chord) in self.chords.iter().enumerate() {
            before.push(before[e] + of(&chord.end));
        }
        self.triples.iter().map(move |at| {
            if at.weights.is_some() {
                before[at.element] + of(at)
            } else {
                of(at)
            }
        })
    }

    /// The displacements of the coordinates by the unbalanced couples of a system, without changes
    /// of the reactions.
    pub fn free(&self, system: &mut System) -> DVector<f64> {
        let mut turns = system.couples.clone();
        let mut moved = self.outer(system, &mut turns);
        let inner = |at: &Coordinates| {
            let condensed = &system.elements[at.element].condensed;
            Vector3::from_fn(|i, _| -self.product(system, at.element, &at.rows[i], condensed))
        };
        for (k, by) in self.gathered(inner).enumerate() {
            let mut rows = moved.fixed_rows_mut::<3>(3 * k);
            rows += by;
        }
        self.displace_base(system, &mut moved);
        moved
    }

    /// Adds reactions to the unbalanced couples of a system.
    pub fn load(&self, system: &mut System, reactions: &DVector<f64>) {
        let (mut beyond, mut sum) = (vec![Vector3::zeros(); self.chords.len()], Vector3::zeros());
        let mut couples = vec![Vector3::zeros(); system.couples.len()];
        let mut add = |at: &Coordinates, force: &Vector3<f64>| {
            at.add_to(&mut couples, force);
            for (row, factor) in at.rows.iter().zip(force.iter()) {
                system.elements[at.element].subtract(row, *factor);
            }
        };
        for (k, at) in self.triples.iter().enumerate() {
            let force: Vector3<f64> = reactions.fixed_rows::<3>(3 * k).into_owned();
            if at.weights.is_some() {
                beyond[..at.element]
                    .iter_mut()
                    .for_each(|sum| *sum += force);
                sum += force;
            }
            add(at, &force);
        }
        self.chords
            .iter()
            .zip(&beyond)
            .for_each(|(chord, force)| add(&chord.end, force));
        let first = system.joints.first_free();
        system.joints.confine(&mut couples);
        let last = self.added();
        for (k, unknown) in self.boosts.iter().enumerate() {
            couples[first + unknown / 3][unknown % 3] += reactions[last + k];
        }
        system
            .couples
            .iter_mut()
            .zip(&couples)
            .for_each(|(to, couple)| *to += couple);
        if self.base.is_some() {
            system.base_force += sum + reactions.fixed_rows::<3>(self.size() - 3);
        }
    }

    /// The first coordinates of all places and of a free base, whose displacement moves all places
    /// alike.
    fn displaced(&self) -> Vec<usize> {
        self.places
            .iter()
            .map(|(first, _)| *first)
            .chain([self.size() - 3])
            .collect()
    }

    /// Adds the displacements of all places by that of a free base to the compliance.
    fn add_base(&mut self, system: &System) {
        let Some(compliance) = self.base else { return };
        let firsts = self.displaced();
        for (a, b) in firsts
            .iter()
            .flat_map(|a| firsts.iter().map(move |b| (*a, *b)))
        {
            let mut block = self.compliance.fixed_view_mut::<3, 3>(a, b);
            block += Matrix3::from_diagonal_element(compliance);
        }
        // Reactions do not exert couples on the frames in this displacement.
        let zero = vec![Vector3::zeros(); system.elements.len() + 1];
        self.columns
            .extend((0..3).map(|_| [zero.clone(), zero.clone()]));
    }

    /// Adds the displacement of a free base by the unbalanced force.
    fn displace_base(&self, system: &System, moved: &mut DVector<f64>) {
        let Some(compliance) = self.base else { return };
        let by = system.base_force * compliance;
        for first in self.displaced() {
            let mut rows = moved.fixed_rows_mut::<3>(first);
            rows += by;
        }
    }
}

impl Chord {
    /// The compliance of the centre line of the element between two places with the given weights.
    fn yields(&self, a: &[f64; MAX_POINTS], b: &[f64; MAX_POINTS]) -> Matrix3<f64> {
        self.line
            .iter()
            .zip(a.iter().zip(b))
            .map(|(compliance, (a, b))| compliance * (a * b))
            .sum()
    }
}

/// The weights (m) that integrate a polynomial through the material points from the start of an
/// element to `x`.
pub(super) fn upto_parts(rod: &Rod, e: usize, x: f64) -> [f64; MAX_POINTS] {
    let mut parts = rod.reference().within(x);
    for (part, point) in parts.iter_mut().zip(rod.element_points(e)) {
        *part *= point.jacobian;
    }
    parts
}
