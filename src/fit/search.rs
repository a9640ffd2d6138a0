//! Bounded Levenberg–Marquardt search (K. Levenberg, Q. Appl. Math. 2, 164, 1944; D. Marquardt, J.
//! SIAM 11, 431, 1963).
//!
//! An iteration linearises the residuals, and tries steps with increasing damping until one lowers
//! the objective by more than half the square of the accuracy. Damping shortens steps, above all
//! those along combinations with a small effect. The search has converged if no step that is longer
//! than the accuracy does so, neither with more damping nor with the least one.
//!
//! Unknowns at a bound towards which the objective decreases are kept there. The others solve the
//! damped normal equations, and are clipped to the bounds.

use nalgebra::{DMatrix, DVector};

use super::FitError;
use super::problem::{Point, Problem};

/// Damping of the first step, relative to the diagonal of the normal equations.
const DAMPING: f64 = 1e-3;

/// Factor between two dampings that are tried. The first damping of an iteration is that of the
/// step before, divided by this factor.
const MORE: f64 = 10.0;

/// Smallest and largest damping.
const DAMPINGS: [f64; 2] = [1e-9, 1e12];

/// Damping of the last steps that are tried. The first damping hides steps along combinations with
/// a weak effect.
const LEAST: [f64; 3] = [DAMPINGS[0], 1e-7, 1e-5];

/// Largest change of an unknown in an iteration. A logarithmic parameter changes by at most the
/// factor e.
const LONGEST: f64 = 1.0;

/// Conditions for the end of a search.
#[derive(Clone, Copy)]
pub(super) struct StoppingRule {
    /// Predicted length of a step, in standard errors of the estimates, below which it is not
    /// tried. Residuals that are larger than the noise enlarge the standard errors.
    pub accuracy: f64,
    /// Largest number of iterations.
    pub iterations: usize,
}

/// End of a search.
pub(super) struct Reached {
    pub point: Point,
    /// Whether the permitted iterations were enough; the last error if the family or a run failed
    /// for every step.
    pub converged: Result<bool, FitError>,
}

/// Searches for a minimum of the objective from the unknowns `x`.
pub(super) fn search(
    problem: &Problem,
    x: DVector<f64>,
    end: StoppingRule,
) -> Result<Reached, FitError> {
    let mut point = problem.at(x)?;
    let mut damping = DAMPING;
    for _ in 0..end.iterations {
        match DampedProblem::of(problem, &point, end.accuracy)?.lower(damping) {
            Ok(Some((lower, used))) => (point, damping) = (lower, (used / MORE).max(DAMPINGS[0])),
            none => {
                return Ok(Reached {
                    point,
                    converged: none.map(|_| true),
                });
            }
        }
    }
    Ok(Reached {
        point,
        converged: Ok(false),
    })
}

/// Problem whose residuals are linearised at a point.
struct DampedProblem<'a> {
    problem: &'a Problem<'a>,
    at: &'a Point,
    /// Gradient of the objective, and approximation of its second derivatives.
    gradient: DVector<f64>,
    matrix: DMatrix<f64>,
    /// Indices of the unknowns that are not kept at a bound.
    moving: Vec<usize>,
    /// Length of a step, in standard errors, below which it is not tried.
    accuracy: f64,
}

impl<'a> DampedProblem<'a> {
    fn of(problem: &'a Problem, at: &'a Point, accuracy: f64) -> Result<Self, FitError> {
        let jacobian = problem.one_sided_jacobian(at)?;
        let slopes = at.residuals.map(|r| problem.loss.slope(r));
        let mut weighted = jacobian.clone();
        for (i, mut row) in weighted
            .row_iter_mut()
            .enumerate()
            .filter(|(i, _)| at.residuals[*i] != 0.0)
        {
            row *= slopes[i] / at.residuals[i];
        }
        let (mut gradient, mut matrix) = (jacobian.tr_mul(&slopes), jacobian.tr_mul(&weighted));
        for (i, [r, slope]) in problem.priors(&at.x) {
            gradient[i] += r * slope;
            matrix[(i, i)] += slope * slope;
        }
        let is_kept = |i: &usize| {
            let [low, high] = problem.limits(*i);
            at.x[*i] <= low && gradient[*i] > 0.0 || at.x[*i] >= high && gradient[*i] < 0.0
        };
        let moving = (0..at.x.len()).filter(|i| !is_kept(i)).collect();
        let mean_square = 2.0 * at.objective / at.residuals.len() as f64;
        let accuracy = accuracy * mean_square.max(1.0).sqrt();
        Ok(Self {
            problem,
            at,
            gradient,
            matrix,
            moving,
            accuracy,
        })
    }

    /// First point with a lower objective at the end of a step, with increasing damping and then
    /// with the least one; and its damping. `None` if no step lowers it: the search has converged.
    fn lower(&self, damping: f64) -> Result<Option<(Point, f64)>, FitError> {
        let more = std::iter::successors(Some(damping), |damping| Some(damping * MORE));
        let found = self.first_lower(more.take_while(|damping| *damping <= DAMPINGS[1]))?;
        Ok(found.or_else(|| self.first_lower(LEAST).ok().flatten()))
    }

    /// First point with a lower objective at the end of a step with one of the dampings, and this
    /// damping. The error is that of the last step if each of them fails.
    fn first_lower(
        &self,
        dampings: impl IntoIterator<Item = f64>,
    ) -> Result<Option<(Point, f64)>, FitError> {
        let (mut failure, mut is_evaluated) = (None, false);
        for damping in dampings {
            let Some((x, _)) = self
                .step(damping)
                .filter(|(_, length)| *length > self.accuracy)
            else {
                continue;
            };
            match self.problem.at(x) {
                // This is the decrease by a step to a minimum at the distance `accuracy`.
                Ok(point)
                    if point.objective
                        < self.at.objective - 0.5 * self.accuracy * self.accuracy =>
                {
                    return Ok(Some((point, damping)));
                }
                Ok(_) => is_evaluated = true,
                // The family or the integrator may fail far from the solution. More damping
                // shortens the step.
                Err(error) => failure = Some(error),
            }
        }
        failure.filter(|_| !is_evaluated).map_or(Ok(None), Err)
    }

    /// End of a step, and its length in standard errors: the predicted change of the residuals over
    /// the noise. `None` if the damped matrix is not positive definite, or the solution not finite.
    fn step(&self, damping: f64) -> Option<(DVector<f64>, f64)> {
        let n = self.moving.len();
        let mut damped =
            DMatrix::from_fn(n, n, |i, j| self.matrix[(self.moving[i], self.moving[j])]);
        let largest = damped.diagonal().iter().copied().fold(0.0, f64::max);
        for i in 0..n {
            // The diagonal element of an unknown without effect is zero, and gets a small damping.
            damped[(i, i)] += damping * damped[(i, i)].max(1e-12 * largest);
        }
        let right = DVector::from_fn(n, |i, _| -self.gradient[self.moving[i]]);
        let step = damped.cholesky()?.solve(&right);
        let longest = step.amax();
        let mut x = self.at.x.clone();
        for (change, k) in step.iter().zip(&self.moving) {
            let [low, high] = self.problem.limits(*k);
            x[*k] = (x[*k] + change * (LONGEST / longest).min(1.0)).clamp(low, high);
        }
        let change = &x - &self.at.x;
        let length = change.dot(&(&self.matrix * &change)).max(0.0).sqrt();
        step.iter()
            .all(|change| change.is_finite())
            .then_some((x, length))
    }
}
