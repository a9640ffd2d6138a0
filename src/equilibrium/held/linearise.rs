//! Assembly of the linear rod of an iteration.

use nalgebra::{DMatrix, DVector};

use super::candidate::Candidate;
use super::elastic::Spring;
use super::linear::{Conditions, Factors, Linear, Role, Rows, along};
use super::response::LinearResponse;
use super::search::HeldSearch;
use crate::equilibrium::EquilibriumError;
use crate::rod::Rod;

/// Largest share of the spring at a free base that remains in a step.
const LARGEST_SHARE: f64 = 0.5;

impl HeldSearch<'_> {
    /// The violations of the conditions of holds and springs, in the order of the links of a linear
    /// rod.
    pub(super) fn residuals(&self) -> Vec<f64> {
        let each = self.sites.iter().flat_map(|site| {
            let springs = site
                .spring
                .iter()
                .flat_map(Spring::stiff)
                .map(|(.., residual)| residual);
            site.missing().map(|(_, distance)| distance).chain(springs)
        });
        let springs_of_base = self
            .body
            .system()
            .joints
            .free_base
            .iter()
            .flat_map(|_| [0.0; 3]);
        each.chain(self.boosts.iter().map(|_| 0.0))
            .chain(springs_of_base)
            .collect()
    }

    /// The linear rod at the present configuration, without a shift.
    pub(super) fn linear_rod(&mut self, rod: &Rod) -> Result<Linear, EquilibriumError> {
        let factors = self.factorise(rod, 0.0)?;
        self.body.balance();
        Ok(self.linearise(rod, factors))
    }

    /// The linear rod with the factorised tangent and the unbalanced couples in the system.
    pub(super) fn linearise(&mut self, rod: &Rod, factors: Factors) -> Linear {
        let sites = self.sites.iter().map(|site| (site.place(), false));
        let candidates = self
            .candidates
            .iter()
            .map(|at| ((at.element, at.x), at.follows_gap));
        let places: Vec<_> = sites.chain(candidates).collect();
        let mut response = LinearResponse::of(&mut *self.body, rod, &places, &self.boosts);
        let first = 3 * self.sites.len();
        let size = response.added() - first;
        self.add_yielding(&mut response);
        let free = response.free(self.body.system_mut());
        let (mut links, mut roles) = (Rows::default(), Vec::new());
        for (i, site) in self.sites.iter().enumerate() {
            for (direction, _) in site.missing() {
                links.push(along(3 * i, &direction), 0.0);
                roles.push(Role::Hold(i, direction));
            }
            for (axis, stiffness, _) in site.spring.iter().flat_map(Spring::stiff) {
                let axis = axis * stiffness.abs().sqrt();
                links.push(along(3 * i, &axis), -stiffness.signum());
                roles.push(Role::Spring(i, axis));
            }
        }
        let system = self.body.system();
        let base = system.joints.free_base;
        let remains = base.map_or(0.0, |base| {
            (system.base_force.norm() / (base.reach * base.stiffness))
                .clamp(base.least, LARGEST_SHARE)
        });
        let stiffness = self.boosts.iter().map(|(_, increase)| *increase);
        for (k, increase) in stiffness
            .chain(base.iter().flat_map(|base| [base.stiffness; 3]))
            .enumerate()
        {
            // The reaction undoes the part 1 − `remains` of the increase.
            links.push(
                [(first + size + k, 1.0)],
                1.0 / (increase * (1.0 - remains)),
            );
            roles.push(Role::Boost);
        }
        let rows = links.matrix(response.size());
        let products = &rows * &response.compliance;
        let mut matrix = &products * rows.transpose();
        links
            .diagonal
            .iter()
            .enumerate()
            .for_each(|(i, d)| matrix[(i, i)] -= d);
        let scale = DVector::from_fn(links.len(), |i, _| {
            let size = matrix[(i, i)].abs() + links.diagonal[i].abs();
            1.0 / size.max(f64::MIN_POSITIVE).sqrt()
        });
        let solver = Conditions::new(&matrix, scale);
        let mut compliance: DMatrix<f64> = response
            .compliance
            .view((first, first), (size, size))
            .into_owned();
        let across = products.columns(first, size);
        for (mut own, violations) in compliance.column_iter_mut().zip(across.column_iter()) {
            own += across.tr_mul(&solver.solve(&-violations));
        }
        if links.len() > 0 {
            compliance.fill_upper_triangle_with_lower_triangle();
        }
        let residuals = DVector::from_vec(self.residuals());
        Linear {
            factors,
            response,
            links,
            roles,
            residuals,
            rows,
            products,
            solver,
            first,
            size,
            compliance,
            free,
            remains,
            share: 1.0,
        }
    }

    /// Adds the compliances of the obstacles: one that yields is displaced by the forces on all of
    /// its surfaces.
    fn add_yielding(&self, response: &mut LinearResponse) {
        for (i, a) in self.candidates.iter().enumerate() {
            let together =
                |(_, b): &(usize, &Candidate)| self.obstacles.move_together(a.obstacle, b.obstacle);
            for (j, b) in self.candidates.iter().enumerate().filter(together) {
                let at = (
                    response.first(self.sites.len() + i),
                    response.first(self.sites.len() + j),
                );
                let mut block = response.compliance.fixed_view_mut::<3, 3>(at.0, at.1);
                block += self.obstacles.compliances[b.obstacle];
            }
        }
    }
}
