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

/// Combinations of columns, each a list of columns with their factors.
pub(super) type Basis = Vec<Vec<(usize, f64)>>;

/// Combinations of columns, in two parts.
#[derive(Debug, Default)]
struct Parts {
    /// Eliminated rows of the elements, from the base up to the last element that a combination depends on.
    rows: Vec<Vec<Row>>,
    /// Parts at the frames.
    nodes: Vec<Vec<Vector3<f64>>>,
}

/// Combinations of columns with their products with the inverse tangent.
#[derive(Debug, Default)]
pub(super) struct Border {
    parts: Parts,
    /// Products of the parts at the frames with the inverse of the condensed tangent.
    solved: Vec<Vec<Vector3<f64>>>,
    /// Combinations in which the reactions act, if friction that slides makes them differ from `parts`.
    acts: Option<Parts>,
    /// G = Bᵀ K⁻¹ B.
    pub gram: DMatrix<f64>,
    /// Bᵀ K⁻¹ A with the combinations A in which the reactions act, if they differ from B.
    pub coupling: Option<DMatrix<f64>>,
    /// Sums of the absolute terms of the diagonal of G. Rounding of an entry that cancels is relative to them.
    pub sizes: Vec<f64>,
    /// Second derivatives of the energy by the reactions, from shear and stretch; not positive.
    pub yields: DMatrix<f64>,
}

impl Border {
    /// Computes combinations of columns for the tangent that a system has assembled and factorised: those of `basis`,
    /// and those of `acts` in which the reactions act if they differ.
    pub fn assemble<const P: usize>(
        &mut self,
        system: &mut System,
        rod: &Rod,
        material: &impl Constitutive,
        force: &InternalForce,
        (columns, basis, acts): (&[Column], &Basis, Option<&Basis>),
    ) {
        let rows = rows_of_columns::<P>(system, rod, material, force, columns);
        let combine = |basis| Parts::combined::<P>(system, columns, &rows, basis);
        (self.parts, self.acts) = (combine(basis), acts.map(combine));
        self.multiply::<P>(system);
        self.yields = congruent(basis, line_yields(rod, material, force, columns));
    }

    /// Computes the products of the combinations with the inverse tangent and with each other.
    fn multiply<const P: usize>(&mut self, system: &mut System) {
        let first = system.joints.first_free();
        self.solved.clone_from(&self.parts.nodes);
        for solved in &mut self.solved {
            system.tangent.solve(&mut solved[first..]);
        }
        let left = stacked::<P>(&self.parts.nodes, &self.parts.rows, |_, _| 1.0);
        let right = stacked::<P>(&self.solved, &self.parts.rows, |e, k| system.elements[e].inverse_pivots()[k]);
        // The product of two matrices is faster than `tr_mul`, which computes entry by entry.
        let product = left.transpose() * &right;
        // The product is symmetric except for rounding. Its lower triangle makes the matrix exactly symmetric.
        let m = product.nrows();
        self.gram = DMatrix::from_fn(m, m, |a, b| product[(a.max(b), a.min(b))]);
        let pairs = left.column_iter().zip(right.column_iter());
        self.sizes = pairs.map(|(x, y)| x.iter().zip(&y).map(|(x, y)| (x * y).abs()).sum()).collect();
        let acts = self.acts.as_ref();
        self.coupling = acts.map(|Parts { rows, nodes }| right.transpose() * stacked::<P>(nodes, rows, |_, _| 1.0));
    }

    /// The changes of the combinations in the Newton step from the balance of a system, without reactions.
    pub fn step<const P: usize>(&self, system: &System) -> DVector<f64> {
        DVector::from_fn(self.solved.len(), |c, _| {
            let outer: f64 = self.solved[c].iter().zip(&system.turns).map(|(x, y)| x.dot(y)).sum();
            let inner = system.elements.iter().zip(&self.parts.rows[c]);
            outer - inner.map(|(element, row)| element.interior_product::<P>(row, element.condensed())).sum::<f64>()
        })
    }

    /// Adds reactions to the balance of a system.
    pub fn load<const P: usize>(&self, system: &mut System, reactions: &DVector<f64>) {
        let Parts { rows, nodes } = self.acts.as_ref().unwrap_or(&self.parts);
        for (c, &factor) in reactions.iter().enumerate() {
            for (turn, node) in system.turns.iter_mut().zip(&nodes[c]) {
                *turn += node * factor;
            }
            for (element, row) in system.elements.iter_mut().zip(&rows[c]) {
                element.subtract(row, factor);
            }
        }
    }
}

impl Parts {
    /// Combines columns whose eliminated rows are given.
    fn combined<const P: usize>(system: &System, columns: &[Column], rows: &[Vec<Row>], basis: &Basis) -> Self {
        let mut parts = Self::default();
        for combination in basis {
            let mut sum: Vec<Row> = Vec::new();
            for (from, factor) in combination {
                sum.resize(sum.len().max(rows[*from].len()), Row::default());
                for (to, row) in sum.iter_mut().zip(&rows[*from]) {
                    add_row(to, row, *factor);
                }
            }
            parts.nodes.push(at_frames::<P>(system, columns, &sum, combination));
            parts.rows.push(sum);
        }
        parts
    }
}

/// The part of a combination at the frames, given its eliminated rows.
fn at_frames<const P: usize>(
    system: &System,
    columns: &[Column],
    rows: &[Row],
    combination: &[(usize, f64)],
) -> Vec<Vector3<f64>> {
    let mut nodes = vec![Vector3::zeros(); system.elements.len() + 1];
    for (e, row) in rows.iter().enumerate() {
        let (last, start) = system.elements[e].outer(row, P);
        nodes[e + 1] += last;
        nodes[e] += start;
    }
    system.joints.confine(&mut nodes);
    let first = system.joints.first_free();
    for (from, factor) in combination {
        if let Column::Turn { unknown } = columns[*from] {
            nodes[first + unknown / 3][unknown % 3] += factor;
        }
    }
    nodes
}

/// The eliminated rows of each column, from the base up to the last element that it depends on.
fn rows_of_columns<const P: usize>(
    system: &System,
    rod: &Rod,
    material: &impl Constitutive,
    force: &InternalForce,
    columns: &[Column],
) -> Vec<Vec<Row>> {
    let chord = |element: usize, x: f64| {
        let (data, parts) = (System::data::<P>(rod, force, element), upto_parts(rod, element, x));
        system.elements[element].chord_rows::<P>(rod.reference(), material, &data, &parts)
    };
    let chords: Vec<[Row; 3]> = (0..reach(columns)).map(|element| chord(element, 1.0)).collect();
    let rows = |column: &Column| match *column {
        Column::Turn { .. } => Vec::new(),
        Column::Tangent { element, x, direction } => {
            let data = System::data::<P>(rod, force, element);
            let tangent = system.elements[element].tangent_rows::<P>(rod.reference(), &data, x);
            // The rows of the elements before it are zero, since the tangent follows from the frame at their end.
            let mut rows = vec![Row::default(); element + 1];
            rows[element] = component(&tangent, &direction);
            rows
        }
        Column::Place { element, x, direction } => {
            let last = if x < 1.0 { chord(element, x) } else { chords[element] };
            chords[..element].iter().chain([&last]).map(|chord| component(chord, &direction)).collect()
        }
    };
    columns.iter().map(rows).collect()
}

/// Number of elements from the base up to the last place in a list of columns.
fn reach(columns: &[Column]) -> usize {
    let ends = columns.iter().map(|column| match column {
        Column::Place { element, .. } => element + 1,
        Column::Tangent { .. } | Column::Turn { .. } => 0,
    });
    ends.max().unwrap_or(0)
}

/// The matrix −∫ cᵢ dᵢ · C dⱼ cⱼ ds of columns, with the compliance C of the centre line and the force cᵢ dᵢ in the rod
/// per unit of reaction i. It is zero for a material without shear and stretch.
fn line_yields(rod: &Rod, material: &impl Constitutive, force: &InternalForce, columns: &[Column]) -> DMatrix<f64> {
    let (time, p) = (force.environment().time, rod.order().points());
    let mut yields = DMatrix::zeros(columns.len(), columns.len());
    for e in 0..reach(columns) {
        let whole = upto_parts(rod, e, 1.0);
        for g in 0..p {
            let point = &rod.points()[e * p + g];
            let frame: UnitQuaternion<f64> = rod.frame_at_point(e, g);
            let along = frame.inverse_transform_vector(&force.at_points()[e * p + g]);
            let Some(line) = material.line_response(&Tissue::of(point, time), &along) else { return yields };
            let turn = frame.to_rotation_matrix().into_inner();
            let compliance: Matrix3<f64> = turn * line.compliance * turn.transpose() / whole[g];
            let share = |column: &Column| match *column {
                Column::Place { element, direction, .. } if element > e => direction * whole[g],
                Column::Place { element, x, direction } if element == e => direction * upto_parts(rod, e, x)[g],
                _ => Vector3::zeros(),
            };
            let shares: Vec<_> = columns.iter().map(share).collect();
            for a in 0..shares.len() {
                for b in 0..shares.len() {
                    yields[(a, b)] -= shares[a].dot(&(compliance * shares[b]));
                }
            }
        }
    }
    yields
}

/// The matrix T M Tᵀ of the combinations in the rows of T, given the matrix M of what they combine.
pub(super) fn congruent(basis: &Basis, matrix: DMatrix<f64>) -> DMatrix<f64> {
    if matrix.iter().all(|value| *value == 0.0) {
        return DMatrix::zeros(basis.len(), basis.len());
    }
    let mut rows = DMatrix::<f64>::zeros(basis.len(), matrix.nrows());
    for (i, combination) in basis.iter().enumerate() {
        combination.iter().for_each(|(j, factor)| rows[(i, *j)] += factor);
    }
    &rows * matrix * rows.transpose()
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

/// The weights (m) that integrate a polynomial through the material points from the start of an element to `x`.
pub(super) fn upto_parts(rod: &Rod, e: usize, x: f64) -> [f64; MAX_POINTS] {
    scaled_parts(rod, e, &rod.reference().within(x))
}

/// The weights (m) of an element, given those for an element of length one.
pub(super) fn scaled_parts(rod: &Rod, e: usize, weights: &[f64; MAX_POINTS]) -> [f64; MAX_POINTS] {
    let mut parts = *weights;
    for (part, point) in parts.iter_mut().zip(rod.element_points(e)) {
        *part *= point.jacobian;
    }
    parts
}

/// The component of three rows along a direction.
fn component(rows: &[Row; 3], direction: &Vector3<f64>) -> Row {
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
