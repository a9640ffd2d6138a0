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
    /// The change of the tangent d3 along a direction at coordinate `x` of an element.
    Tangent { element: usize, x: f64, direction: Vector3<f64> },
    /// A component of the rotation of a frame, along its directors: number of the unknown in the condensed tangent.
    Turn { unknown: usize },
}

/// Combinations of linear functions: the functions and factors of each.
pub(super) type Basis = Vec<Vec<(usize, f64)>>;

/// Combinations of columns inside the elements and at the frames.
#[derive(Debug, Default)]
struct Parts {
    rows: Vec<Vec<Row>>,
    nodes: Vec<Vec<Vector3<f64>>>,
}

/// Columns with their products with the inverse tangent.
#[derive(Debug, Default)]
pub(super) struct Border {
    /// Eliminated rows of the chords of the elements.
    chords: Vec<[Row; 3]>,
    /// Parts of the columns inside the elements, from the base up to the last element that they depend on.
    rows: Vec<Vec<Row>>,
    /// Parts of the columns at the frames, and their products with the inverse of the condensed tangent.
    nodes: Vec<Vec<Vector3<f64>>>,
    solved: Vec<Vec<Vector3<f64>>>,
    /// Parts of the reactions where they differ from the columns: of friction that slides.
    acts: Option<Parts>,
    /// G = Bᵀ K⁻¹ B.
    pub gram: DMatrix<f64>,
    /// Bᵀ K⁻¹ A with the reactions A; equal to G unless contacts slide with friction.
    pub coupling: DMatrix<f64>,
    /// Sums of the absolute terms of the diagonal of G. Rounding of an entry that cancels is relative to them.
    pub sizes: Vec<f64>,
    /// Second derivatives of the energy by the reactions, from shear and stretch; not positive.
    pub yields: DMatrix<f64>,
}

impl Border {
    /// Computes the columns for the tangent that a system has assembled and factorised. They are combinations of
    /// linear functions, by the rows of `basis`.
    pub fn assemble<const P: usize>(
        &mut self,
        system: &mut System,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
        (columns, basis, acts): (&[Column], &Basis, Option<&Basis>),
    ) {
        let reference = rod.reference();
        let reach = columns.iter().map(|column| match column {
            Column::Place { element, .. } => element + 1,
            Column::Tangent { .. } | Column::Turn { .. } => 0,
        });
        let reach = reach.max().unwrap_or(0);
        self.chords.clear();
        for e in 0..reach {
            let parts = whole_parts(rod, e);
            let data = System::data::<P>(rod, force, e);
            self.chords.push(system.elements[e].chord_rows::<P>(reference, material, &data, &parts));
        }
        let first = system.joints.first_free();
        let m = basis.len();
        let plain: Vec<Vec<Row>> = columns
            .iter()
            .map(|column| match *column {
                Column::Turn { .. } => Vec::new(),
                Column::Tangent { element, x, direction } => {
                    let data = System::data::<P>(rod, force, element);
                    let mut rows = vec![Row::default(); element + 1];
                    // The row of this element alone; it follows from the frame at its start.
                    rows[element] =
                        combined(&system.elements[element].tangent_rows::<P>(reference, &data, x), &direction);
                    rows
                }
                Column::Place { element, x, direction } => {
                    let mut rows: Vec<Row> =
                        self.chords[..element].iter().map(|chord| combined(chord, &direction)).collect();
                    if x < 1.0 {
                        let data = System::data::<P>(rod, force, element);
                        let parts = upto_parts(rod, element, x);
                        let chord = system.elements[element].chord_rows::<P>(reference, material, &data, &parts);
                        rows.push(combined(&chord, &direction));
                    } else {
                        rows.push(combined(&self.chords[element], &direction));
                    }
                    rows
                }
            })
            .collect();
        let combine = |basis: &Basis| {
            let mut parts = Parts::default();
            for combination in basis {
                let mut rows: Vec<Row> = Vec::new();
                for (from, factor) in combination {
                    rows.resize(rows.len().max(plain[*from].len()), Row::default());
                    for (to, row) in rows.iter_mut().zip(&plain[*from]) {
                        add_row(to, row, *factor);
                    }
                }
                let mut nodes = vec![Vector3::zeros(); rod.elements() + 1];
                for (e, row) in rows.iter().enumerate() {
                    let (last, start) = system.elements[e].outer::<P>(row);
                    nodes[e + 1] += last;
                    nodes[e] += start;
                }
                system.joints.confine(&mut nodes);
                for (from, factor) in combination {
                    if let Column::Turn { unknown } = columns[*from] {
                        nodes[first + unknown / 3][unknown % 3] += factor;
                    }
                }
                parts.rows.push(rows);
                parts.nodes.push(nodes);
            }
            parts
        };
        Parts { rows: self.rows, nodes: self.nodes } = combine(basis);
        self.acts = acts.map(combine);
        self.solved.clone_from(&self.nodes);
        for solved in &mut self.solved {
            system.tangent.solve(&mut solved[first..]);
        }
        let left = stacked::<P>(&self.nodes, &self.rows, |_, _| 1.0);
        let right = stacked::<P>(&self.solved, &self.rows, |e, k| system.elements[e].inverse_pivots()[k]);
        // The product of two matrices is faster than `tr_mul`, which computes entry by entry.
        let product = left.transpose() * &right;
        // Both triangles differ by rounding.
        self.gram = DMatrix::from_fn(m, m, |a, b| product[(a.max(b), a.min(b))]);
        let pairs = left.column_iter().zip(right.column_iter());
        self.sizes = pairs.map(|(x, y)| x.iter().zip(&y).map(|(x, y)| (x * y).abs()).sum()).collect();
        self.coupling = match &self.acts {
            Some(Parts { rows, nodes }) => right.transpose() * stacked::<P>(nodes, rows, |_, _| 1.0),
            None => self.gram.clone(),
        };
        let n = columns.len();
        self.yields = DMatrix::zeros(n, n);
        self.add_yields(rod, material, force, columns);
        let change = DMatrix::from_fn(m, n, |i, j| {
            basis[i].iter().filter(|(from, _)| *from == j).map(|(_, factor)| factor).sum::<f64>()
        });
        self.yields = if self.yields.iter().any(|value| *value != 0.0) {
            &change * &self.yields * change.transpose()
        } else {
            DMatrix::zeros(m, m)
        };
    }

    /// The changes of the columns' functions in the Newton step from the balance of a system, without reactions.
    pub fn step<const P: usize>(&self, system: &System) -> DVector<f64> {
        DVector::from_fn(self.rows.len(), |c, _| {
            let outer: f64 = self.solved[c].iter().zip(&system.turns).map(|(x, y)| x.dot(y)).sum();
            let inner = system.elements.iter().zip(&self.rows[c]);
            outer - inner.map(|(element, row)| element.interior_product::<P>(row, element.condensed())).sum::<f64>()
        })
    }

    /// Adds reactions to the balance of a system.
    pub fn load<const P: usize>(&self, system: &mut System, reactions: &DVector<f64>) {
        let (rows, nodes) = match &self.acts {
            Some(Parts { rows, nodes }) => (rows, nodes),
            None => (&self.rows, &self.nodes),
        };
        for (c, &factor) in reactions.iter().enumerate() {
            for (turn, node) in system.turns.iter_mut().zip(&nodes[c]) {
                *turn += node * factor;
            }
            for (element, row) in system.elements.iter_mut().zip(&rows[c]) {
                element.subtract(row, factor);
            }
        }
    }

    /// Adds −∫ cᵢ dᵢ · C dⱼ cⱼ ds, with the compliance C of the centre line and the share c of a reaction at a point.
    fn add_yields(&mut self, rod: &Rod, material: &impl Constitutive, force: &InternalForce, columns: &[Column]) {
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
                let shares: Vec<_> = columns
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

/// Vectors at the frames, followed by the interior parts of rows times a factor for each element and unknown. Each
/// pair of them is a column.
fn stacked<const P: usize>(
    nodes: &[Vec<Vector3<f64>>],
    rows: &[Vec<Row>],
    factor: impl Fn(usize, usize) -> f64,
) -> DMatrix<f64> {
    let frames = nodes.first().map_or(0, Vec::len);
    let (interior, outer) = (3 * (P - 1), 3 * frames);
    let mut all = DMatrix::zeros(outer + interior * frames, nodes.len());
    for (mut column, (nodes, rows)) in all.column_iter_mut().zip(nodes.iter().zip(rows)) {
        let values = nodes.iter().flat_map(|node| node.iter());
        column.iter_mut().zip(values).for_each(|(to, value)| *to = *value);
        for (e, row) in rows.iter().enumerate() {
            for (k, value) in row.as_flattened()[..interior].iter().enumerate() {
                column[outer + interior * e + k] = value * factor(e, k);
            }
        }
    }
    all
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
            add_row(&mut sum, row, *factor);
        }
    }
    sum
}

fn add_row(to: &mut Row, row: &Row, factor: f64) {
    for (to, from) in to.as_flattened_mut().iter_mut().zip(row.as_flattened()) {
        *to += factor * from;
    }
}
