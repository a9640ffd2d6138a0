//! Assembly of the linear rod of an iteration.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::candidate::Candidate;
use super::elastic::Spring;
use super::law::Status;
use super::linear::{Conditions, Factors, Linear, Precision, Role, Rows, along};
use super::response::LinearResponse;
use super::search::HeldSearch;
use crate::equilibrium::EquilibriumError;
use crate::equilibrium::tangent::STIFFNESS;
use crate::rod::Rod;

/// Largest share of the spring at a free base that remains in a step.
const LARGEST_SHARE: f64 = 0.5;
/// Largest compliance of a hold, relative to that in another direction, that is rounding.
const ROUNDED: f64 = 1e-14;
/// Displacement of a loaded contact against its condition, relative to the rotation of the rod
/// times the length, below which a direction does not move it. A direction that moves it does so by
/// about this product.
const MOVED: f64 = 1e-6;
/// Unbalanced couple or moment of a violation, relative to the force times the length, below which
/// the rod is close to equilibrium: a negative stiffness that it may cause is then no reason for a
/// descent.
const NEAR: f64 = 1e-3;

/// The principal axes of a symmetric matrix, that of the levers of a place, in the space of
/// orthonormal directions. In these axes a direction in which a straight rod is rigid is a condition
/// of its own in any orientation of the rod.
fn principal(directions: &[Vector3<f64>], levers: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let size = directions.len();
    let restricted = DMatrix::from_fn(size, size, |i, j| {
        directions[i].dot(&(levers * directions[j]))
    });
    if size < 2 || restricted.iter().any(|value| !value.is_finite()) {
        return directions.to_vec();
    }
    let axes = restricted.symmetric_eigen().eigenvectors;
    let axis = |k: usize| (0..size).map(|i| directions[i] * axes[(i, k)]).sum();
    (0..size).map(axis).collect()
}

/// The factors that scale the conditions of holds and springs, given the absolute terms of the
/// displacement along each by its own reaction.
fn scale_of(links: &Rows, roles: &[Role], terms: &[f64]) -> DVector<f64> {
    let largest = |site: usize| {
        let own = roles.iter().zip(terms);
        let own = own.filter(|(role, _)| role.holds(site));
        own.map(|(_, terms)| *terms).fold(0.0, f64::max)
    };
    DVector::from_fn(links.len(), |i, _| {
        let size = match roles[i] {
            // A compliance that is rounding stays small beside those of the other directions.
            Role::Hold(site, _) => {
                let largest = largest(site);
                if terms[i] < ROUNDED * largest {
                    largest
                } else {
                    terms[i]
                }
            }
            // A compliance that is a difference of larger terms is small: its direction is neutral.
            _ => terms[i] + links.diagonal[i].abs(),
        };
        1.0 / size.max(f64::MIN_POSITIVE).sqrt()
    })
}

impl HeldSearch<'_> {
    /// The violations of the conditions of holds and springs with the roles of a linear rod. They
    /// are fewer or more if the stiff axes of a spring have changed.
    pub(super) fn residuals(&self, roles: &[Role]) -> Vec<f64> {
        let springs = self.sites.iter().flat_map(|site| &site.spring);
        let mut springs = springs
            .flat_map(Spring::stiff)
            .map(|(.., residual)| residual);
        let each = roles.iter().filter_map(|role| match role {
            Role::Hold(site, direction) => {
                let site = &self.sites[*site];
                Some(direction.dot(&(site.position - site.target)))
            }
            Role::Spring(..) => springs.next(),
            Role::Boost => Some(0.0),
        });
        let mut residuals: Vec<f64> = each.collect();
        residuals.extend(springs);
        residuals
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
        let remains = self.remaining_share();
        let (links, roles) = self.links(&response, remains);
        let rows = links.matrix(response.size());
        let products = &rows * &response.compliance;
        let mut matrix = &products * rows.transpose();
        links
            .diagonal
            .iter()
            .enumerate()
            .for_each(|(i, d)| matrix[(i, i)] -= d);
        let each = links.factors.iter().enumerate();
        let terms: Vec<f64> = each
            .map(|(i, row)| response.terms(row, products.row(i).dot(&rows.row(i))))
            .collect();
        let scale = scale_of(&links, &roles, &terms);
        let mut solver = Conditions::new(&matrix, scale);
        let precision = self.precision(rod);
        let uncertainty = |factors: &DVector<f64>| {
            let reactions = rows.tr_mul(factors);
            let all = precision.uncertainty(&response.turns(&reactions));
            if self.move_contact(&reactions, &response, all.turn) {
                all.in_contact()
            } else {
                all
            }
        };
        let residuals = DVector::from_vec(self.residuals(&roles));
        let violations = &residuals + &rows * &free;
        solver.treat_undetermined(&violations, uncertainty, self.completes);
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
        let mut linear = Linear {
            factors,
            response,
            links,
            roles,
            terms,
            residuals,
            rows,
            products,
            matrix,
            solver,
            first,
            size,
            compliance,
            free,
            remains,
            share: 1.0,
            precision,
        };
        self.relax_undetermined(&mut linear);
        linear
    }

    /// Whether reactions, which cause rotations of at most `turn` (rad), move a loaded contact against
    /// its condition.
    fn move_contact(&self, reactions: &DVector<f64>, response: &LinearResponse, turn: f64) -> bool {
        let candidates = self.candidates.iter().enumerate();
        let mut loaded = candidates.filter(|(_, at)| at.status != Status::Open);
        loaded.any(|(i, at)| {
            let first = response.first(self.sites.len() + i);
            let by: Vector3<f64> = response.compliance.fixed_rows::<3>(first) * reactions;
            let by = if at.status == Status::Sticking {
                by.norm()
            } else {
                at.gap.normal.dot(&by).abs()
            };
            by > MOVED * turn * self.length
        })
    }

    /// Gives contacts that stick a compliance in directions that neither the stiffness of the rod
    /// nor its motion determines. Their forces do not change in these directions in a step, as
    /// those of holds.
    fn relax_undetermined(&self, linear: &mut Linear) {
        // A line of contact permits no rotation about a chord.
        let sticks = |(_, at): &(usize, &Candidate)| at.status == Status::Sticking && at.point;
        let sticking: Vec<_> = self.candidates.iter().enumerate().filter(sticks).collect();
        if sticking.is_empty() {
            return;
        }
        let mut coordinates = Vec::new();
        let mut violations = linear.free_candidates(&DVector::zeros(linear.response.size()));
        for (i, at) in sticking {
            let first = linear.response.first(self.sites.len() + i) - linear.first;
            let slip = at.slip(&self.obstacles.yielded[at.obstacle]);
            let mut own = violations.fixed_rows_mut::<3>(first);
            own += at.gap.normal * at.gap.value + slip;
            coordinates.extend(first..first + 3);
        }
        let compliance = &linear.compliance;
        let matrix = compliance
            .select_rows(&coordinates)
            .select_columns(&coordinates);
        let scale = DVector::from_iterator(
            coordinates.len(),
            coordinates.iter().map(|&i| {
                let at = linear.first + i;
                let total = linear.response.compliance[(at, at)];
                let terms = linear.response.terms(&[(at, 1.0)], total);
                1.0 / terms.max(f64::MIN_POSITIVE).sqrt()
            }),
        );
        let mut conditions = Conditions::new(&matrix, scale);
        let uncertainty = |factors: &DVector<f64>| {
            let mut forces = DVector::zeros(linear.size);
            for (i, factor) in coordinates.iter().zip(factors.iter()) {
                forces[*i] = *factor;
            }
            let links = linear.products.columns(linear.first, linear.size) * &forces;
            let links = linear.solver.solve(&-links);
            let all = linear.reactions(&forces, &links);
            linear.precision.uncertainty(&linear.response.turns(&all))
        };
        let violations = violations.select_rows(&coordinates);
        conditions.treat_undetermined(&violations, uncertainty, self.completes);
        let relaxed = conditions.compliance_of_omitted();
        for (i, &row) in coordinates.iter().enumerate() {
            for (j, &column) in coordinates.iter().enumerate() {
                linear.compliance[(row, column)] += relaxed[(i, j)];
            }
        }
    }

    /// The share of the spring at a free base, and of the increases of pivots, that remains in a
    /// step.
    fn remaining_share(&self) -> f64 {
        let system = self.body.system();
        system.joints.free_base.map_or(0.0, |base| {
            (system.base_force.norm() / (base.reach * base.stiffness))
                .clamp(base.least, LARGEST_SHARE)
        })
    }

    /// The conditions of holds and springs, of increased pivots, and of the spring at a free base,
    /// of which a share remains.
    fn links(&self, response: &LinearResponse, remains: f64) -> (Rows, Vec<Role>) {
        let mut links = Rows::default();
        let mut roles = Vec::new();
        for (i, site) in self.sites.iter().enumerate() {
            // In contact the search may amplify rounding, which would decide between equal levers.
            let directions = if self.obstacles.contacts.is_empty() {
                principal(&site.fixed, &response.levers(i))
            } else {
                site.fixed.clone()
            };
            for direction in directions {
                links.push(along(3 * i, &direction), 0.0);
                roles.push(Role::Hold(i, direction));
            }
            for (axis, stiffness, _) in site.spring.iter().flat_map(Spring::stiff) {
                let axis = axis * stiffness.abs().sqrt();
                links.push(along(3 * i, &axis), -stiffness.signum());
                roles.push(Role::Spring(i, axis));
            }
        }
        let base = self.body.system().joints.free_base;
        let increases = self.boosts.iter().map(|(_, increase)| *increase);
        let springs = base.iter().flat_map(|base| [base.stiffness; 3]);
        for (k, stiffness) in increases.chain(springs).enumerate() {
            // The reaction undoes the part 1 − `remains` of the increase.
            links.push(
                [(response.added() + k, 1.0)],
                1.0 / (stiffness * (1.0 - remains)),
            );
            roles.push(Role::Boost);
        }
        (links, roles)
    }

    /// The precision of stiffnesses with the factorised tangent and the unbalanced couples in the
    /// system. Far from equilibrium and in a search for an unstable equilibrium, it is that of
    /// rounding alone.
    fn precision(&self, rod: &Rod) -> Precision {
        let system = self.body.system();
        let moment = self.force_scale() * self.length;
        let violation = self.violation() * self.force_scale();
        let missing = system.unbalanced.max(violation) / moment;
        let near = self.stable && missing < NEAR;
        let (first, nodes) = (system.joints.first_free(), 0..system.couples.len());
        let size = |node: usize, axis: usize| match node.checked_sub(first) {
            Some(block) => system.tangent.size(3 * block + axis),
            None => 0.0,
        };
        let rounding = |node: usize| Vector3::from_fn(|axis, _| STIFFNESS * size(node, axis));
        let inside = |node: usize| match node.checked_sub(1) {
            Some(e) => system.elements[e].interior_couples(system.points),
            None => 0.0,
        };
        let unbalanced = |node: usize| {
            if near {
                system.couples[node].norm() + inside(node) + violation / nodes.len() as f64
            } else {
                0.0
            }
        };
        let frames = rod.frames();
        let bend = frames.windows(2).map(|ends| ends[0].angle_to(&ends[1]));
        Precision {
            rounding: nodes.clone().map(rounding).collect(),
            unbalanced: nodes.clone().map(unbalanced).collect(),
            bend: bend.sum(),
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
