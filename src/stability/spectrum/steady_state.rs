//! Steady states of a shoot.

use nalgebra::{DMatrix, DVector};

use super::characteristic::CharacteristicMatrix;
use crate::equilibrium::{EquilibriumSolver, Unloaded};
use crate::linear::{SteadyLaws, check_autonomous, check_steady, precise_solver};
use crate::load::InternalForce;
use crate::model::Model;
use crate::rod::Rod;
use crate::scene::Scene;
use crate::sensing::visit_sites;
use crate::shoot::Shoot;
use crate::stability::error::StabilityError;

/// Report of the search for a steady state.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SteadyState {
    /// Newton iterations for the visible strain and for the whole.
    pub iterations: usize,
    /// The largest gradient of the laws, 1/m: what remains of the residual.
    pub gradient: f64,
    /// Negative eigenvalues of the energy. If there are any, the equilibrium is unstable.
    pub negative: usize,
}

/// Solves for the intrinsic strain at which a shoot is in equilibrium and the gradients of its laws vanish, u̇* = 0.
///
/// Laws sense the shape, so that the visible strain is found first, without load and stiffness. The intrinsic strain that
/// keeps it under the load follows point by point. A few Newton iterations for the whole then remove the difference that is
/// due to the discretisation.
#[derive(Debug, Clone)]
pub struct SteadyStateSolver {
    /// Largest gradient of the laws in a steady state, relative to 1/radius.
    pub tolerance: f64,
    /// Largest number of iterations of either part.
    pub max_iterations: usize,
}

impl Default for SteadyStateSolver {
    /// 1e-10 of 1/radius, at most 50 iterations.
    fn default() -> Self {
        Self { tolerance: 1e-10, max_iterations: 50 }
    }
}

impl SteadyStateSolver {
    /// Brings the shoot into a steady state at its present time. Start an integrator with
    /// [`ConstantHistory::Steady`](crate::integrator::ConstantHistory::Steady) to keep it there.
    ///
    /// # Errors
    /// Laws that are not autonomous or have no steady state, or no equilibrium. The shoot is then unchanged.
    pub fn solve(&self, shoot: &mut Shoot<impl Model>) -> Result<SteadyState, StabilityError> {
        let mut rod = shoot.state.rod.clone();
        let found = self.solve_rod(shoot, &mut rod)?;
        shoot.state.rod = rod;
        Ok(found)
    }

    /// Brings a rod, instead of that of the shoot, into a steady state under the shoot's laws. After an error the rod is not
    /// usable.
    pub(super) fn solve_rod(&self, shoot: &Shoot<impl Model>, rod: &mut Rod) -> Result<SteadyState, StabilityError> {
        let environment = shoot.environment();
        rod.set_base(shoot.model.scene().base(environment.time))?;
        let mut iterations = self.find_shape(shoot, rod)?;
        let mut solver = precise_solver();
        let first = rod.first_growing() * rod.order().points();
        let limit = iterations + self.max_iterations;
        let mut last = f64::INFINITY;
        loop {
            let force = InternalForce::of(rod, shoot.model.load(), &environment);
            let found = solver.equilibrate(rod, shoot.model.constitutive(), &force)?;
            let steady = SteadyLaws::of(shoot, rod, &force);
            check_steady(shoot.model.tropism(), &steady)?;
            check_autonomous(shoot, rod, shoot.model.load(), &steady)?;
            let gradient = steady.largest_gradient();
            if gradient * steady.radius() <= self.tolerance {
                return Ok(SteadyState { iterations, gradient, negative: found.inertia.negative });
            }
            if iterations == limit || !gradient.is_finite() || gradient > 10.0 * last {
                return Err(StabilityError::NoSteadyState { iterations, gradient });
            }
            last = gradient;
            iterations += 1;
            let matrix = CharacteristicMatrix::about(shoot, rod, &steady, &force, &mut solver)?;
            let step = matrix.steady_step(&steady);
            let step = step.ok_or(StabilityError::NoSteadyState { iterations, gradient })?;
            for (&(i, c), value) in matrix.unknowns.iter().zip(step.iter()) {
                rod.points_mut()[first + i].intrinsic[c] += value;
            }
        }
    }

    /// Gives the rod the shape in which the gradients of the laws vanish, and the intrinsic strain that keeps it, by Newton's
    /// method for the visible strain on an unloaded copy of the rod.
    fn find_shape(&self, shoot: &Shoot<impl Model>, rod: &mut Rod) -> Result<usize, StabilityError> {
        let environment = shoot.environment();
        let p = rod.order().points();
        let mut trial = rod.clone();
        for e in 0..rod.elements() {
            for g in 0..p {
                trial.points_mut()[e * p + g].intrinsic = rod.strain_at_point(e, g);
            }
        }
        let evaluate = |trial: &mut Rod| -> Result<SteadyLaws, StabilityError> {
            let force = InternalForce::of(trial, &(), &environment);
            let _ = Unloaded.equilibrate(trial, shoot.model.constitutive(), &force)?;
            Ok(SteadyLaws::of(shoot, trial, &force))
        };
        let mut steady = evaluate(&mut trial)?;
        check_steady(shoot.model.tropism(), &steady)?;
        check_autonomous(shoot, &trial, &(), &steady)?;
        let mut iterations = 0;
        loop {
            let gradient = steady.largest_gradient();
            if gradient * steady.radius() <= 0.1 * self.tolerance {
                break;
            }
            let failed = StabilityError::NoSteadyState { iterations, gradient };
            if iterations == self.max_iterations || !gradient.is_finite() {
                return Err(failed);
            }
            let residual = flat(&steady);
            let step = jacobian(&trial, residual.len(), evaluate)?.lu().solve(&residual).ok_or(failed.clone())?;
            let mut fraction = 1.0;
            (trial, steady) = loop {
                let mut moved = displaced(&trial, &(&step * -fraction));
                if let Ok(next) = evaluate(&mut moved)
                    && flat(&next).norm() < residual.norm()
                {
                    break (moved, next);
                }
                fraction *= 0.5;
                if fraction < 1e-6 {
                    return Err(failed);
                }
            };
            iterations += 1;
        }
        let turn = unresolved(&trial);
        if turn > RESOLVED {
            return Err(StabilityError::Unresolved { turn });
        }
        // The visible strain is the sum of the elastic strain under the couple and the intrinsic strain.
        let force = InternalForce::of(&trial, shoot.model.load(), &environment);
        let mut change = DVector::zeros(3 * steady.gradients.len());
        let first = trial.points().len() - steady.gradients.len();
        visit_sites(&trial, shoot.model.constitutive(), &force, false, |i, site| {
            change.fixed_rows_mut::<3>(3 * i).copy_from(&(trial.points()[first + i].intrinsic - site.strain));
        });
        *rod = displaced(&trial, &change);
        Ok(iterations)
    }
}

/// The gradients as one vector.
fn flat(steady: &SteadyLaws) -> DVector<f64> {
    DVector::from_iterator(3 * steady.gradients.len(), steady.gradients.iter().flatten().copied())
}

/// A rod with a change of the intrinsic strain at the points of its growth zone.
fn displaced(rod: &Rod, change: &DVector<f64>) -> Rod {
    let mut moved = rod.clone();
    let first = rod.points().len() - change.len() / 3;
    for (k, value) in change.iter().enumerate() {
        moved.points_mut()[first + k / 3].intrinsic[k % 3] += value;
    }
    moved
}

/// The derivative of the gradients with respect to the intrinsic strain, by central differences.
fn jacobian(
    rod: &Rod,
    n: usize,
    evaluate: impl Fn(&mut Rod) -> Result<SteadyLaws, StabilityError>,
) -> Result<DMatrix<f64>, StabilityError> {
    let mut out = DMatrix::zeros(n, n);
    // Strains are of the size of 1/length or of the gradient over a sensitivity; 1e-4/length is a small angle.
    let h = 1e-4 / rod.length();
    for k in 0..n {
        let change = DVector::from_fn(n, |i, _| if i == k { h } else { 0.0 });
        let [ahead, behind] = [evaluate(&mut displaced(rod, &change))?, evaluate(&mut displaced(rod, &-change))?];
        out.set_column(k, &((flat(&ahead) - flat(&behind)) / (2.0 * h)));
    }
    // Components that nothing drives have rows and columns of zeros; they do not change.
    for k in 0..n {
        if out.row(k).amax() == 0.0 {
            out[(k, k)] = 1.0;
        }
    }
    Ok(out)
}

/// Largest rotation of a frame within an element by the highest polynomial of the strain in a shape that is resolved, rad.
/// It lies between the discretisation error of a resolved shape and the rotation by an oscillation between the points.
const RESOLVED: f64 = 0.1;

/// The largest rotation by the highest polynomial of the intrinsic strain in an element, rad. With one point in an element
/// it is that of half the jump to the next element, or of the whole strain if there is only one element.
fn unresolved(rod: &Rod) -> f64 {
    let reference = rod.reference();
    let p = reference.p;
    if p == 1 {
        let turn = |e: usize| rod.points()[e].intrinsic * rod.element_length(e);
        let jumps = (1..rod.elements()).map(|e| 0.5 * (turn(e) - turn(e - 1)).norm());
        return if rod.elements() == 1 { turn(0).norm() } else { jumps.fold(0.0, f64::max) };
    }
    // The Legendre coefficient of degree p − 1, from the highest divided difference at the Gauss points.
    let mut largest = 0.0_f64;
    for e in 0..rod.elements() {
        let points = rod.element_points(e);
        let mut sum = nalgebra::Vector3::zeros();
        for g in 0..p {
            let others = (0..p).filter(|&k| k != g).map(|k| reference.points[g] - reference.points[k]);
            sum += points[g].intrinsic / others.product::<f64>();
        }
        // A polynomial with leading coefficient c in [0, 1] is at most 2 c/4^(p−1) off one of lower degree (Chebyshev).
        largest = largest.max(2.0 * sum.norm() / 4.0_f64.powi(p as i32 - 1) * rod.element_length(e));
    }
    largest
}
