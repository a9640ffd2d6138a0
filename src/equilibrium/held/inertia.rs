//! Inertia of a held equilibrium on the directions that its supports permit.

use nalgebra::{DMatrix, DVector};

use super::candidate::Candidate;
use super::law::Status;
use super::linear::{Linear, NEUTRAL, Role, Rows, SUSPECT, along, scaled};
use super::search::HeldSearch;
use super::settings;
use super::sites::across;
use crate::equilibrium::Inertia;

/// The conditions of an earlier contact along the rod: obstacle, arc length (m), and the factors of
/// each.
type Previous = (usize, f64, Vec<Vec<(usize, f64)>>);

/// The conditions of all supports on a linear rod with the compliance C.
pub(super) struct Bordered {
    /// The diagonal D.
    pub diagonal: Vec<f64>,
    /// The rows T on the coordinates.
    pub rows: DMatrix<f64>,
    /// The matrix D − T C Tᵀ of the reactions, and the factors that scale it.
    pub matrix: DMatrix<f64>,
    pub scale: DVector<f64>,
}

impl Bordered {
    /// The given conditions on a linear rod.
    pub fn new(linear: &Linear, rows: Rows) -> Self {
        let t = rows.matrix(linear.response.size());
        let mut matrix: DMatrix<f64> = &t * &linear.response.compliance * t.transpose();
        let terms: Vec<f64> = rows
            .factors
            .iter()
            .enumerate()
            .map(|(i, row)| linear.response.terms(row, matrix[(i, i)]))
            .collect();
        matrix = -matrix;
        rows.diagonal
            .iter()
            .enumerate()
            .for_each(|(i, d)| matrix[(i, i)] += d);
        let size = |i: usize| (terms[i] + rows.diagonal[i].abs()).max(f64::MIN_POSITIVE);
        let scale = DVector::from_fn(rows.len(), |i, _| size(i).sqrt().recip());
        Self {
            diagonal: rows.diagonal,
            rows: t,
            matrix,
            scale,
        }
    }
}

impl HeldSearch<'_> {
    /// The conditions of all supports on a linear rod. The rows are the conditions of the links,
    /// the gaps and slips of loaded contacts, and the stiffnesses by which contact forces turn with
    /// the normal and move along the rod.
    pub(super) fn bordered(&self, linear: &Linear) -> Bordered {
        Bordered::new(linear, self.conditions(linear))
    }

    /// The rows of these conditions, first those of the links.
    pub(super) fn conditions(&self, linear: &Linear) -> Rows {
        let mut rows = linear.links.clone();
        for (diagonal, _) in rows
            .diagonal
            .iter_mut()
            .zip(&linear.roles)
            .filter(|(_, role)| **role == Role::Boost)
        {
            *diagonal *= 1.0 - linear.remains;
        }
        self.add_contact_rows(linear, &mut rows);
        rows
    }

    /// The inertia of a linear rod on the directions that the supports permit. The part of sliding
    /// friction that is not symmetric is left out, so that the inertia does not decide stability
    /// then. A stiffness within its rounding is neutral. `with_unbalanced` it is also neutral within
    /// the uncertainty by the couples that were unbalanced when the linear rod was assembled.
    pub(super) fn inertia_of(&self, linear: &Linear, with_unbalanced: bool) -> Inertia {
        let mut inertia = linear.factors.pivots;
        let Bordered {
            diagonal,
            rows,
            matrix,
            scale,
        } = self.bordered(linear);
        let (n, scaled) = (diagonal.len(), scaled(&matrix, &scale));
        if scaled.iter().any(|value| !value.is_finite()) {
            return Inertia {
                margin: f64::NAN,
                ..inertia
            };
        }
        let mut eigenvalues = if n > 0 {
            scaled.symmetric_eigenvalues()
        } else {
            DVector::zeros(0)
        };
        let mut uncertainties = DVector::zeros(n);
        if !self.is_loaded() && eigenvalues.iter().any(|value| value.abs() < SUSPECT) {
            let eigen = scaled.symmetric_eigen();
            for (k, value) in eigen.eigenvalues.iter().enumerate() {
                if value.abs() < SUSPECT {
                    let factors = eigen.eigenvectors.column(k).component_mul(&scale);
                    let turns = linear.response.turns(&rows.tr_mul(&factors));
                    let uncertainty = linear.precision.uncertainty(&turns);
                    uncertainties[k] = uncertainty.rounding;
                    if with_unbalanced {
                        uncertainties[k] += uncertainty.unbalanced;
                    }
                }
            }
            eigenvalues = eigen.eigenvalues;
        }
        // The bordered matrix has one negative eigenvalue for every condition and every spring of
        // positive stiffness.
        let expected = diagonal.iter().filter(|d| **d <= 0.0).count();
        // A condition and a spring of negative stiffness each have one positive eigenvalue.
        let positive = diagonal.iter().filter(|d| **d >= 0.0).count();
        inertia.margin = inertia.margin.abs();
        for (value, uncertainty) in eigenvalues.iter().zip(uncertainties.iter()) {
            // With the sign as the scale, the least magnitude of an eigenvalue enters the margin.
            inertia.count(*value, value.signum(), f64::max(NEUTRAL, *uncertainty));
        }
        let confined = self.body.system().joints.confined_directions();
        inertia.negative = inertia.negative.saturating_sub(expected);
        inertia.positive = inertia.positive.saturating_sub(positive + confined);
        inertia
    }

    /// Adds the rows of the loaded contacts.
    fn add_contact_rows(&self, linear: &Linear, rows: &mut Rows) {
        let loaded = |(_, at): &(usize, &Candidate)| at.status != Status::Open && at.normal() > 0.0;
        let mut order: Vec<(usize, &Candidate)> =
            self.candidates.iter().enumerate().filter(loaded).collect();
        order.sort_by(|a, b| {
            a.1.obstacle
                .cmp(&b.1.obstacle)
                .then(a.1.arc_length.total_cmp(&b.1.arc_length))
        });
        let following: Vec<bool> = linear
            .response
            .with_tangents()
            .skip(self.sites.len())
            .collect();
        let mut previous: Vec<Previous> = Vec::new();
        for (i, at) in order {
            let (first, normal) = (linear.response.first(self.sites.len() + i), at.gap.normal);
            let mut conditions: Vec<Vec<(usize, f64)>> = vec![along(first, &normal).collect()];
            let slip = at.slip(&self.obstacles.yielded[at.obstacle]);
            let rubs = self.obstacles.contacts[at.obstacle].friction > 0.0;
            let rests = at.status == Status::Sticking
                || rubs && slip.norm() <= settings::ROUNDING * self.length;
            if rests {
                conditions
                    .extend(across(&normal).map(|side| along(first, &side).collect::<Vec<_>>()));
            } else if rubs {
                // Friction turns with the slip: a stiffness μλ/|slip| across it.
                let friction = self.obstacles.contacts[at.obstacle].friction * at.normal();
                let side = normal.cross(&slip).normalize() * (friction / slip.norm()).sqrt();
                rows.push(along(first, &side), -1.0);
            }
            // Conditions at neighbouring stations are nearly equal. Their divided differences up to
            // the second are the basis in which the matrix is well scaled.
            for (kind, own) in conditions.iter().enumerate() {
                let same =
                    |(obstacle, _, rows): &&Previous| *obstacle == at.obstacle && rows.len() > kind;
                let mut row = own.clone();
                let earlier: Vec<_> = previous.iter().rev().filter(same).take(2).collect();
                if let Some((_, s, before)) = earlier.first() {
                    let slope = 1.0 / (at.arc_length - s);
                    row = combined(&[(own, slope), (&before[kind], -slope)]);
                    if let Some((_, s0, first)) = earlier.get(1) {
                        let other = 1.0 / (s - s0);
                        row = combined(&[
                            (own, slope),
                            (&before[kind], -slope - other),
                            (&first[kind], other),
                        ]);
                    }
                }
                rows.push(row, 0.0);
            }
            previous.push((at.obstacle, at.arc_length, conditions));
            let push = at.normal();
            // The normal force turns with the normal: a stiffness −λ ∇²g.
            let eigen = at.gap.curvature.symmetric_eigen();
            for (side, value) in eigen
                .eigenvectors
                .column_iter()
                .zip(eigen.eigenvalues.iter())
            {
                let stiffness = -push * value;
                if stiffness != 0.0 {
                    let side = side.into_owned() * stiffness.abs().sqrt();
                    rows.push(along(first, &side), -stiffness.signum());
                }
            }
            let inside = self
                .end(at)
                .is_none_or(|outward| at.approach().0 * outward >= 0.0);
            if inside && following[i] && at.approach().1 > 0.0 {
                // The place moves along the rod so that the gap stays least: a stiffness λ/g″
                // (docs/supports.md).
                let factor = (push / at.approach().1).sqrt();
                let turned = at.gap.curvature * at.tangent * factor;
                let tangent = normal * factor;
                rows.push(
                    along(first, &turned).chain(along(first + 3, &tangent)),
                    -1.0,
                );
            }
        }
    }
}

/// A combination of rows.
fn combined(rows: &[(&Vec<(usize, f64)>, f64)]) -> Vec<(usize, f64)> {
    rows.iter()
        .flat_map(|(row, factor)| row.iter().map(move |(i, value)| (*i, value * factor)))
        .collect()
}
