//! The linear rod of an iteration: its response at holds, springs and candidates.
//!
//! The coordinates y are the displacements at these places. With the changes f of the forces at the
//! candidates and r of the reactions of holds, springs and increased pivots they are
//! y = y₀ + C (f + Tᵀ r). The compliance C includes shear and stretch, and y₀ are the displacements
//! by the unbalanced couples. The conditions with the violations c are
//!
//! ```text
//! T y + c = D r,      so that      (T C Tᵀ − D) r = −(c + T y₀ + T C f).
//! ```
//!
//! D is zero for a hold and 1/k for a pivot that was increased by k. For a spring it is −1, or 1 if
//! its stiffness is negative, and its row contains the square root of the magnitude. The reactions
//! are eliminated. The contact problem is posed on the compliance that remains between the
//! candidates. The inertia follows from the negative of the matrix, D − T C Tᵀ, which is the matrix
//! S of `docs/supports.md`.

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};

use super::response::LinearResponse;
use super::settings;
use crate::equilibrium::Inertia;

/// Largest eigenvalue of the scaled matrix of the reactions that is attributed to rounding.
pub(super) const NEUTRAL: f64 = 1e-8;
/// Eigenvalue of the scaled matrix below which it is compared with its uncertainty.
pub(super) const SUSPECT: f64 = 1e-2;
/// Largest work of the unbalanced couples and violations in a direction, relative to the stiffness
/// that is not determined, for which the rod does not move in it: a rotation of 0.1 rad. Along a
/// symmetry the work is of second order in the distance from equilibrium and the stiffness of first
/// order, and in a soft direction both are of first order.
const UNDETERMINED: f64 = 0.1;

/// Rotation along a rod, rad, below which it counts as straight and lies in no plane. Couples by
/// rounding, 1e-15 of the force times the length, then conceal no stiffness above 1e-9 of this
/// product.
const STRAIGHT: f64 = 1e-6;

/// What a condition belongs to: a hold, a spring, an increased pivot, or the spring at a free base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Role {
    /// Component of the force of a hold: site and direction.
    Hold(usize, Vector3<f64>),
    /// Force of a spring along a principal axis: site, and axis times √|κ| for the stiffness κ.
    Spring(usize, Vector3<f64>),
    /// Increase of a pivot, or spring at a free base.
    Boost,
}

impl Role {
    /// Whether a condition is one of the hold of a site.
    pub fn holds(&self, site: usize) -> bool {
        matches!(self, Self::Hold(own, _) if *own == site)
    }
}

/// Rows on coordinates, and the diagonal D of their matrix.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub factors: Vec<Vec<(usize, f64)>>,
    pub diagonal: Vec<f64>,
}

impl Rows {
    pub fn push(&mut self, factors: impl IntoIterator<Item = (usize, f64)>, diagonal: f64) {
        self.factors.push(factors.into_iter().collect());
        self.diagonal.push(diagonal);
    }

    pub fn remove(&mut self, row: usize) {
        self.factors.remove(row);
        self.diagonal.remove(row);
    }

    pub fn len(&self) -> usize {
        self.factors.len()
    }

    /// The matrix T of the rows.
    pub fn matrix(&self, columns: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.len(), columns);
        for (i, factors) in self.factors.iter().enumerate() {
            factors
                .iter()
                .for_each(|(j, factor)| matrix[(i, *j)] += factor);
        }
        matrix
    }
}

/// A matrix whose rows and columns are multiplied by `scale`.
pub(super) fn scaled(matrix: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        matrix[(i, j)] * scale[i] * scale[j]
    })
}

/// A symmetric matrix of conditions, scaled and factorised.
pub(super) struct Conditions {
    /// `None` without conditions.
    eigen: Option<SymmetricEigen<f64, nalgebra::Dyn>>,
    pub scale: DVector<f64>,
    /// Eigenvectors that solutions leave out.
    omitted: Vec<bool>,
    /// Whether a direction that is not neutral may be omitted or has another stiffness.
    pub incomplete: bool,
}

impl Conditions {
    /// Factorises a matrix, whose rows and columns are multiplied by `scale`. Solutions omit
    /// eigenvectors whose eigenvalue is rounding.
    pub fn new(matrix: &DMatrix<f64>, scale: DVector<f64>) -> Self {
        let (n, scaled) = (scale.len(), scaled(matrix, &scale));
        // The eigenvalues of a matrix that is not finite are not found.
        let finite = scaled.iter().all(|value| value.is_finite());
        let scaled = if finite { scaled } else { DMatrix::zeros(n, n) };
        let eigen = (n > 0).then(|| SymmetricEigen::new(scaled));
        let values = eigen.iter().flat_map(|eigen| eigen.eigenvalues.iter());
        Self {
            omitted: values.map(|value| value.abs() <= NEUTRAL).collect(),
            eigen,
            scale,
            incomplete: false,
        }
    }

    /// Treats directions whose stiffness is not determined, given the `violations` of the conditions
    /// at the start of a step and the uncertainty for the factors of the conditions in a direction.
    /// Neutral directions are omitted, and unless the solution `completes` a step, those in which
    /// the rotation is not determined, too. In the others the stiffness, minus the eigenvalue, is
    /// replaced by its magnitude, so that the energy decreases.
    pub fn treat_undetermined(
        &mut self,
        violations: &DVector<f64>,
        uncertainty: impl Fn(&DVector<f64>) -> Uncertainty,
        completes: bool,
    ) {
        let Some(eigen) = &mut self.eigen else {
            return;
        };
        let scaled = violations.component_mul(&self.scale);
        for k in 0..eigen.eigenvalues.len() {
            let size = eigen.eigenvalues[k].abs();
            if !(size < SUSPECT) {
                continue;
            }
            let direction = eigen.eigenvectors.column(k);
            let Uncertainty {
                rounding,
                unbalanced,
                own,
                turn,
                moves_contact,
            } = uncertainty(&direction.component_mul(&self.scale));
            // A quotient of two quantities that are not determined would be a motion at random.
            let work = direction.dot(&scaled).abs() * turn;
            let undetermined = size <= rounding + unbalanced;
            // A violation that is more than rounding shows that the direction is not neutral.
            let neutral = size <= NEUTRAL && work <= UNDETERMINED * settings::ROUNDING;
            let is_small = work <= UNDETERMINED * (rounding + own);
            self.omitted[k] = !moves_contact && (undetermined && is_small && !completes || neutral);
            if undetermined && !self.omitted[k] {
                eigen.eigenvalues[k] = -size.max(rounding + own);
            }
            let bound = NEUTRAL.max(rounding);
            self.incomplete |= (bound..bound + unbalanced).contains(&size);
        }
    }

    /// The matrix that makes the scaled eigenvalues of the omitted directions one.
    pub fn compliance_of_omitted(&self) -> DMatrix<f64> {
        let n = self.scale.len();
        let mut sum = DMatrix::zeros(n, n);
        let Some(eigen) = &self.eigen else {
            return sum;
        };
        let each = eigen.eigenvalues.iter().zip(&self.omitted).enumerate();
        for (k, (value, _)) in each.filter(|(_, (_, omitted))| **omitted) {
            let direction = eigen.eigenvectors.column(k).component_div(&self.scale);
            sum += &direction * direction.transpose() * (1.0 - value);
        }
        sum
    }

    /// The solution for a right-hand side, with the component zero in the omitted directions.
    pub fn solve(&self, rhs: &DVector<f64>) -> DVector<f64> {
        let Some(eigen) = &self.eigen else {
            return DVector::zeros(0);
        };
        let mut y = eigen.eigenvectors.tr_mul(&rhs.component_mul(&self.scale));
        let each = y.iter_mut().zip(eigen.eigenvalues.iter());
        for ((y, value), omitted) in each.zip(&self.omitted) {
            *y = if *omitted { 0.0 } else { *y / value };
        }
        (&eigen.eigenvectors * y).component_mul(&self.scale)
    }
}

/// Factors of a vector at a coordinate.
pub(super) fn along(first: usize, direction: &Vector3<f64>) -> impl Iterator<Item = (usize, f64)> {
    let direction = *direction;
    (0..3).map(move |c| (first + c, direction[c]))
}

/// The factorised tangent on which a linear rod is based.
#[derive(Clone, Copy)]
pub(super) struct Factors {
    /// Energy of the rod with its loads, J.
    pub energy: f64,
    /// Signs of the pivots.
    pub pivots: Inertia,
    /// Shift of the tangent, N.
    pub shift: f64,
}

/// The linear rod.
pub(super) struct Linear {
    pub factors: Factors,
    pub response: LinearResponse,
    /// Conditions of holds, springs and increased pivots.
    pub links: Rows,
    pub roles: Vec<Role>,
    /// Sum of the absolute terms of the displacement along each condition by its own reaction.
    pub terms: Vec<f64>,
    pub residuals: DVector<f64>,
    /// T, and T C for the compliance C.
    pub rows: DMatrix<f64>,
    pub products: DMatrix<f64>,
    /// T C Tᵀ − D, and its factors.
    pub matrix: DMatrix<f64>,
    pub solver: Conditions,
    /// First coordinate of the candidates, and their number.
    pub first: usize,
    pub size: usize,
    /// Compliance between the coordinates of the candidates.
    pub compliance: DMatrix<f64>,
    /// Displacements by the unbalanced couples, without changes of the reactions.
    pub free: DVector<f64>,
    /// Share of the boosts that remains in the step. It bounds displacements that only contacts
    /// limit.
    pub remains: f64,
    /// The share of the unbalanced couples and of the residuals that the step removes.
    pub share: f64,
    /// What determines the stiffness in a direction.
    pub precision: Precision,
}

/// Precision of the stiffness vᵀ K v of a rod in a direction v.
///
/// If rotations v leave the energy unchanged, as those about the line of two pins do, the derivative
/// of vᵀ g = 0 is K v + (∂v)ᵀ g = 0 for the gradient g of the energy. The stiffness vanishes in
/// equilibrium only. Elsewhere it is at most Σ |g_k| |∂v_k|, and a smaller one has a sign without
/// meaning. Where a rod between clamps rotates about its chord by the angle α, and its sections
/// rotate back about their tangents, v is α times the slope, and its derivative is α v. The angle
/// is the change of v along the rod over the rotation of the frames along it.
///
/// The tangent has rounding in addition, as in [neutral directions](crate::equilibrium) of a free
/// rod.
pub(super) struct Precision {
    /// Rounding of the diagonal of the tangent, by frames, N m.
    pub rounding: Vec<Vector3<f64>>,
    /// Unbalanced couples, and the moment of forces on violated conditions, N m.
    pub unbalanced: Vec<f64>,
    /// Sum of the rotations from each frame to the next, rad.
    pub bend: f64,
}

/// Uncertainty of the stiffness in a direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Uncertainty {
    /// Rounding, N m.
    pub rounding: f64,
    /// The part by unbalanced couples, N m.
    pub unbalanced: f64,
    /// Work of the unbalanced couples, at most, in a rotation by v, N m.
    own: f64,
    /// Largest rotation in the direction, rad.
    pub turn: f64,
    /// Whether the direction moves a loaded contact against its condition, which determines the
    /// motion then.
    pub moves_contact: bool,
}

impl Uncertainty {
    /// The part by rounding of the tangent, in a direction that moves a loaded contact.
    pub fn in_contact(self) -> Self {
        Self {
            unbalanced: 0.0,
            own: 0.0,
            moves_contact: true,
            ..self
        }
    }
}

impl Precision {
    /// The uncertainty for given rotations.
    pub fn uncertainty(&self, turns: &[Vector3<f64>]) -> Uncertainty {
        let mut sum = Uncertainty::default();
        let mut couples = 0.0;
        for ((turn, rounding), unbalanced) in turns.iter().zip(&self.rounding).zip(&self.unbalanced)
        {
            sum.rounding += rounding.dot(&turn.component_mul(turn));
            sum.own += unbalanced * turn.norm_squared();
            couples += unbalanced * turn.norm();
            sum.turn = sum.turn.max(turn.norm());
        }
        let change: f64 = turns
            .windows(2)
            .map(|ends| (ends[1] - ends[0]).norm())
            .sum();
        let angle = change / self.bend.max(STRAIGHT);
        sum.unbalanced = couples * angle.max(sum.turn);
        sum
    }
}

impl Linear {
    /// Changes of the reactions of the links, with which their conditions hold, for changes of
    /// those of the candidates.
    pub fn links_by(&self, offset: &DVector<f64>, changes: &DVector<f64>) -> DVector<f64> {
        let by_candidates = self.products.columns(self.first, self.size) * changes;
        let violations = &self.residuals * self.share
            + &self.rows * (&self.free * self.share + offset)
            + by_candidates;
        self.solver.solve(&-violations)
    }

    /// Displacements of the candidates' coordinates without changes of their reactions.
    pub fn free_candidates(&self, offset: &DVector<f64>) -> DVector<f64> {
        let moved = &self.free * self.share + offset;
        let links = self.links_by(offset, &DVector::zeros(self.size));
        moved.rows(self.first, self.size)
            + self.products.columns(self.first, self.size).tr_mul(&links)
    }

    /// All reactions, conjugate to the coordinates, of given changes of those of candidates and
    /// links.
    pub fn reactions(&self, candidates: &DVector<f64>, links: &DVector<f64>) -> DVector<f64> {
        let mut all = self.rows.tr_mul(links);
        let mut own = all.rows_mut(self.first, self.size);
        own += candidates;
        all
    }

    /// Displacements of all coordinates by changes of the reactions.
    pub fn displacements(&self, reactions: &DVector<f64>) -> DVector<f64> {
        &self.free * self.share + &self.response.compliance * reactions
    }
}
