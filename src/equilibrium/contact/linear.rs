//! The linear rod of an iteration: its response at holds, springs and candidates.
//!
//! The conditions of holds and springs are linear in the coordinates, y = T c + …, and their reactions are eliminated:
//! what remains is the compliance of the rod between its candidates, with which the contact problem is posed.

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};

use super::response::{Response, Spot};
use super::search::ContactSearch;
use crate::equilibrium::held::elastic::Spring;
use crate::rod::Rod;

/// Largest eigenvalue of the scaled matrix of the reactions that is attributed to rounding.
pub(super) const NEUTRAL: f64 = 1e-8;

/// What a condition of a hold or a spring belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Role {
    /// Component of the force of a hold: site and direction.
    Hold(usize, Vector3<f64>),
    /// Force of a spring along a principal axis: site, and axis times √|κ| for the stiffness κ.
    Spring(usize, Vector3<f64>),
    /// Increase of a pivot.
    Boost,
}

/// Rows on coordinates, with the diagonal D of their matrix and their residuals.
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

    pub fn len(&self) -> usize {
        self.factors.len()
    }

    /// The matrix T of the rows.
    pub fn matrix(&self, columns: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.len(), columns);
        for (i, factors) in self.factors.iter().enumerate() {
            factors.iter().for_each(|(j, factor)| matrix[(i, *j)] += factor);
        }
        matrix
    }
}

/// Factors of a vector at a coordinate.
pub(super) fn along(first: usize, direction: &Vector3<f64>) -> impl Iterator<Item = (usize, f64)> {
    let direction = *direction;
    (0..3).map(move |c| (first + c, direction[c]))
}

/// The linear rod.
pub(super) struct Linear {
    pub response: Response,
    /// Conditions of holds, springs and increased pivots.
    pub links: Rows,
    pub roles: Vec<Role>,
    pub residuals: DVector<f64>,
    /// T, and T C for the compliance C.
    rows: DMatrix<f64>,
    products: DMatrix<f64>,
    solver: Option<(SymmetricEigen<f64, nalgebra::Dyn>, DVector<f64>)>,
    /// First coordinate of the candidates, and their number.
    pub first: usize,
    pub size: usize,
    /// Compliance between the coordinates of the candidates.
    pub compliance: DMatrix<f64>,
    /// Displacements by the unbalanced couples, without changes of the reactions.
    pub free: DVector<f64>,
    /// The share of the unbalanced couples and of the residuals that the step removes.
    pub share: f64,
}

impl Linear {
    /// The solution of the conditions of links for given violations: changes of their reactions.
    pub fn solve_links(&self, violations: &DVector<f64>) -> DVector<f64> {
        let Some((eigen, scale)) = &self.solver else { return DVector::zeros(0) };
        let mut y = eigen.eigenvectors.tr_mul(&-violations.component_mul(scale));
        for (y, value) in y.iter_mut().zip(eigen.eigenvalues.iter()) {
            // Neutral directions keep their reactions.
            *y = if value.abs() <= NEUTRAL { 0.0 } else { *y / value };
        }
        (&eigen.eigenvectors * y).component_mul(scale)
    }

    /// The displacement along a condition by its own reaction.
    pub fn flexibility(&self, condition: usize) -> f64 {
        self.products.row(condition).dot(&self.rows.row(condition)).abs()
    }

    /// All reactions that hold the places of links against given displacements of the coordinates.
    pub fn held(&self, moved: &DVector<f64>) -> DVector<f64> {
        let links = self.solve_links(&(&self.rows * moved));
        self.reactions(&DVector::zeros(self.size), &links)
    }

    /// Changes of the reactions of the links for changes of those of the candidates.
    pub fn links_by(&self, offset: &DVector<f64>, changes: &DVector<f64>) -> DVector<f64> {
        if self.links.len() == 0 {
            return DVector::zeros(0);
        }
        let by_candidates = self.products.columns(self.first, self.size) * changes;
        self.solve_links(
            &(&self.residuals * self.share + &self.rows * (&self.free * self.share + offset) + by_candidates),
        )
    }

    /// Displacements of the candidates' coordinates without changes of their reactions.
    pub fn free_candidates(&self, offset: &DVector<f64>) -> DVector<f64> {
        let moved = &self.free * self.share + offset;
        let mut own: DVector<f64> = moved.rows(self.first, self.size).into_owned();
        if self.links.len() > 0 {
            let links = self.links_by(offset, &DVector::zeros(self.size));
            own += self.products.columns(self.first, self.size).tr_mul(&links);
        }
        own
    }

    /// All reactions, conjugate to the coordinates, of given changes of those of candidates and links.
    pub fn reactions(&self, candidates: &DVector<f64>, links: &DVector<f64>) -> DVector<f64> {
        let mut all = DVector::zeros(self.response.size());
        all.rows_mut(self.first, self.size).copy_from(candidates);
        if self.links.len() > 0 {
            all += self.rows.tr_mul(links);
        }
        all
    }

    /// Displacements of all coordinates by changes of the reactions.
    pub fn displacements(&self, reactions: &DVector<f64>) -> DVector<f64> {
        &self.free * self.share + &self.response.compliance * reactions
    }
}

impl ContactSearch<'_> {
    /// The linear rod with the factorised tangent and the unbalanced couples in the system.
    pub(super) fn linearise(&mut self, rod: &Rod) -> Linear {
        let spot = |element, x, turns| Spot { element, x, turns };
        let sites = self.sites.iter().map(|site| spot(site.element, site.x, false));
        let candidates = self.candidates.iter().map(|at| spot(at.element, at.x, at.slides()));
        let spots: Vec<Spot> = sites.chain(candidates).collect();
        let mut response = Response::of(&mut *self.body, rod, &spots, &self.boosts);
        let first = 3 * self.sites.len();
        let size = response.size() - first - self.boosts.len();
        // An obstacle that yields is displaced by the forces on it.
        for (i, a) in self.candidates.iter().enumerate() {
            for (j, b) in self.candidates.iter().enumerate().filter(|(_, b)| b.obstacle == a.obstacle) {
                let at = (response.first(self.sites.len() + i), response.first(self.sites.len() + j));
                let mut block = response.compliance.fixed_view_mut::<3, 3>(at.0, at.1);
                block += self.obstacles.compliances[b.obstacle];
            }
        }
        let free = response.free(self.body.system_mut());
        let (mut links, mut roles, mut residuals) = (Rows::default(), Vec::new(), Vec::new());
        for (i, site) in self.sites.iter().enumerate() {
            for (direction, residual) in site.missing() {
                links.push(along(3 * i, &direction), 0.0);
                roles.push(Role::Hold(i, direction));
                residuals.push(residual);
            }
            for (axis, stiffness, residual) in site.spring.iter().flat_map(Spring::stiff) {
                let axis = axis * stiffness.abs().sqrt();
                links.push(along(3 * i, &axis), -stiffness.signum());
                roles.push(Role::Spring(i, axis));
                residuals.push(residual);
            }
        }
        for (k, (_, increase)) in self.boosts.iter().enumerate() {
            // The unknown is scaled so that its diagonal entry is one.
            links.push([(first + size + k, 1.0)], 1.0 / increase);
            roles.push(Role::Boost);
            residuals.push(0.0);
        }
        let rows = links.matrix(response.size());
        let products = &rows * &response.compliance;
        let mut matrix = &products * rows.transpose();
        links.diagonal.iter().enumerate().for_each(|(i, d)| matrix[(i, i)] -= d);
        let solver = (links.len() > 0).then(|| {
            let scale = DVector::from_fn(links.len(), |i, _| {
                let size = matrix[(i, i)].abs() + links.diagonal[i].abs();
                1.0 / size.max(f64::MIN_POSITIVE).sqrt()
            });
            let scaled = DMatrix::from_fn(links.len(), links.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
            // The eigenvalues of a matrix that is not finite are not found.
            let finite = scaled.iter().all(|value| value.is_finite());
            let scaled = if finite { scaled } else { DMatrix::from_element(scaled.nrows(), scaled.ncols(), 0.0) };
            (SymmetricEigen::new(scaled), scale)
        });
        let mut compliance: DMatrix<f64> = response.compliance.view((first, first), (size, size)).into_owned();
        let residuals = DVector::from_vec(residuals);
        let mut linear = Linear {
            response,
            links,
            roles,
            residuals,
            rows,
            products,
            solver,
            first,
            size,
            compliance: DMatrix::zeros(0, 0),
            free,
            share: 1.0,
        };
        if linear.links.len() > 0 && size > 0 {
            let across = linear.products.columns(first, size).into_owned();
            for column in 0..size {
                let changes = linear.solve_links(&across.column(column).into_owned());
                let mut own = compliance.column_mut(column);
                own += across.tr_mul(&changes);
            }
            compliance.fill_upper_triangle_with_lower_triangle();
        }
        linear.compliance = compliance;
        linear
    }
}
