//! The border of the tangent: one column for each direction in which a support acts on the rod.

use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

use crate::constitutive::{Constitutive, Tissue};
use crate::equilibrium::elimination::Row;
use crate::equilibrium::system::System;
use crate::load::InternalForce;
use crate::reference_element::MAX_POINTS;
use crate::rod::Rod;

/// A linear function of the rotations of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Column {
    /// The displacement along a direction of the place at coordinate `x` of an element.
    Place { element: usize, x: f64, direction: Vector3<f64> },
    /// A component of the rotation of a frame, along its directors: number of the unknown in the condensed tangent.
    Turn { unknown: usize },
}

/// Columns with their products with the inverse tangent.
#[derive(Debug, Default)]
pub(super) struct Border {
    /// Eliminated rows of the chords of the elements.
    chords: Vec<[Row; 3]>,
    /// Eliminated rows of the parts of an element up to a place in it: index of the column and row.
    parts: Vec<Option<Row>>,
    columns: Vec<Column>,
    /// The columns at the frames, and their products with the inverse of the condensed tangent.
    nodes: Vec<Vec<Vector3<f64>>>,
    solved: Vec<Vec<Vector3<f64>>>,
    /// G = Bᵀ K⁻¹ B.
    pub gram: DMatrix<f64>,
    /// Sums of the absolute terms of the diagonal of G. Rounding of an entry that cancels is relative to them.
    pub sizes: Vec<f64>,
    /// Second derivatives of the energy by the reactions, from shear and stretch; not positive.
    pub yields: DMatrix<f64>,
}

impl Border {
    /// Computes the columns for the tangent that a system has assembled and factorised.
    pub fn assemble<const P: usize>(
        &mut self,
        system: &mut System,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
        columns: &[Column],
    ) {
        let n = rod.elements();
        let reference = rod.reference();
        let reach = columns.iter().map(|column| match column {
            Column::Place { element, .. } => element + 1,
            Column::Turn { .. } => 0,
        });
        let reach = reach.max().unwrap_or(0);
        self.chords.clear();
        for e in 0..reach {
            let parts = whole_parts(rod, e);
            let data = System::data::<P>(rod, force, e);
            self.chords.push(system.elements[e].chord_rows::<P>(reference, material, &data, &parts));
        }
        self.columns.clear();
        self.columns.extend_from_slice(columns);
        self.parts.clear();
        let first = system.joints.first_free();
        self.nodes.resize_with(columns.len(), Vec::new);
        self.solved.resize_with(columns.len(), Vec::new);
        for (c, column) in columns.iter().enumerate() {
            let nodes = &mut self.nodes[c];
            nodes.clear();
            nodes.resize(n + 1, Vector3::zeros());
            let mut part = None;
            match *column {
                Column::Turn { unknown } => nodes[first + unknown / 3][unknown % 3] = 1.0,
                Column::Place { element, x, direction } => {
                    for e in 0..=element {
                        let row = if e == element && x < 1.0 {
                            let data = System::data::<P>(rod, force, e);
                            let parts = upto_parts(rod, e, x);
                            let rows = system.elements[e].chord_rows::<P>(reference, material, &data, &parts);
                            let row = combined(&rows, &direction);
                            part = Some(row);
                            row
                        } else {
                            combined(&self.chords[e], &direction)
                        };
                        let (last, start) = system.elements[e].outer::<P>(&row);
                        nodes[e + 1] += last;
                        nodes[e] += start;
                    }
                    system.joints.confine(nodes);
                }
            }
            self.parts.push(part);
            let solved = &mut self.solved[c];
            solved.clone_from(nodes);
            system.tangent.solve(&mut solved[first..]);
        }
        let m = columns.len();
        self.gram = DMatrix::zeros(m, m);
        self.sizes.clear();
        for a in 0..m {
            for b in 0..=a {
                let value = self.terms::<P>(system, a, b).sum();
                (self.gram[(a, b)], self.gram[(b, a)]) = (value, value);
            }
            self.sizes.push(self.terms::<P>(system, a, a).map(f64::abs).sum());
        }
        self.yields = DMatrix::zeros(m, m);
        self.add_yields(rod, material, force);
    }

    /// The row of a column in an element; `None` beyond its place.
    fn row(&self, c: usize, e: usize) -> Option<Row> {
        match (self.columns[c], self.parts[c]) {
            (Column::Place { element, .. }, Some(row)) if e == element => Some(row),
            (Column::Place { element, direction, .. }, _) if e <= element => {
                Some(combined(&self.chords[e], &direction))
            }
            _ => None,
        }
    }

    /// The terms of an entry of G.
    fn terms<const P: usize>(&self, system: &System, a: usize, b: usize) -> impl Iterator<Item = f64> {
        let outer = self.nodes[a].iter().zip(&self.solved[b]).map(|(x, y)| x.dot(y));
        let inner = system
            .elements
            .iter()
            .enumerate()
            .map_while(move |(e, element)| Some(element.interior_product::<P>(&self.row(a, e)?, &self.row(b, e)?)));
        outer.chain(inner)
    }

    /// The changes of the columns' functions in the Newton step from the balance of a system, without reactions.
    pub fn step<const P: usize>(&self, system: &System) -> DVector<f64> {
        DVector::from_fn(self.columns.len(), |c, _| {
            let outer: f64 = self.solved[c].iter().zip(&system.turns).map(|(x, y)| x.dot(y)).sum();
            let inner =
                system.elements.iter().enumerate().map_while(|(e, element)| {
                    Some(element.interior_product::<P>(&self.row(c, e)?, element.condensed()))
                });
            outer - inner.sum::<f64>()
        })
    }

    /// Adds reactions to the balance of a system.
    pub fn load<const P: usize>(&self, system: &mut System, reactions: &DVector<f64>) {
        for (c, &factor) in reactions.iter().enumerate() {
            for (turn, node) in system.turns.iter_mut().zip(&self.nodes[c]) {
                *turn += node * factor;
            }
            for (e, element) in system.elements.iter_mut().enumerate() {
                let Some(row) = self.row(c, e) else { break };
                element.subtract(&row, factor);
            }
        }
    }

    /// Adds −∫ cᵢ dᵢ · C dⱼ cⱼ ds, with the compliance C of the centre line and the share c of a reaction at a point.
    fn add_yields(&mut self, rod: &Rod, material: &impl Constitutive, force: &InternalForce) {
        let (time, p) = (force.environment().time, rod.order().points());
        for e in 0..self.chords.len() {
            let whole = whole_parts(rod, e);
            for g in 0..p {
                let point = &rod.points()[e * p + g];
                let frame: UnitQuaternion<f64> = rod.frame_at_point(e, g);
                let along = frame.inverse_transform_vector(&force.at_points()[e * p + g]);
                let Some(line) = material.line_response(&Tissue::of(point, time), &along) else { return };
                let turn = frame.to_rotation_matrix().into_inner();
                let compliance: Matrix3<f64> = turn * line.compliance * turn.transpose() / whole[g];
                let shares: Vec<_> = self
                    .columns
                    .iter()
                    .map(|column| match *column {
                        Column::Place { element, direction, .. } if element > e => direction * whole[g],
                        Column::Place { element, x, direction } if element == e => direction * upto_parts(rod, e, x)[g],
                        _ => Vector3::zeros(),
                    })
                    .collect();
                for a in 0..shares.len() {
                    for b in 0..shares.len() {
                        self.yields[(a, b)] -= shares[a].dot(&(compliance * shares[b]));
                    }
                }
            }
        }
    }
}

/// The lengths of the parts of an element that its material points stand for, m.
fn whole_parts(rod: &Rod, e: usize) -> [f64; MAX_POINTS] {
    upto_parts(rod, e, 1.0)
}

/// The weights (m) that integrate a polynomial through the material points from the start of an element to `x`.
pub(super) fn upto_parts(rod: &Rod, e: usize, x: f64) -> [f64; MAX_POINTS] {
    let mut parts = if x < 1.0 { rod.reference().integral_upto(x) } else { [0.0; MAX_POINTS] };
    for (g, point) in rod.element_points(e).iter().enumerate() {
        if x >= 1.0 {
            parts[g] = rod.reference().weights[g];
        }
        parts[g] *= point.jacobian;
    }
    parts
}

fn combined(rows: &[Row; 3], direction: &Vector3<f64>) -> Row {
    let mut sum = Row::default();
    for (row, factor) in rows.iter().zip(direction.iter()) {
        if *factor != 0.0 {
            for (to, from) in sum.as_flattened_mut().iter_mut().zip(row.as_flattened()) {
                *to += factor * from;
            }
        }
    }
    sum
}
