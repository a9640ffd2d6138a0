//! Bounded Levenberg–Marquardt search with a robust loss (K. Levenberg, Q. Appl. Math. 2, 164, 1944; D. Marquardt, J.
//! SIAM 11, 431, 1963).
//!
//! Coordinates at a bound towards which the objective decreases are kept there. The changes of the others solve the
//! damped normal equations, and are clipped to the bounds.

use nalgebra::{DMatrix, DVector};

use super::FitError;
use super::problem::{Evaluated, Problem};

/// Loss of a residual. The residual is divided by the standard deviation of its noise, and has no unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Half the square: maximum likelihood for normal noise.
    Squares,
    /// Half the square up to a threshold (in standard deviations of the noise), and linear beyond (P. J. Huber, Ann.
    /// Math. Stat. 35, 73, 1964). Outliers have a bounded influence. The threshold is at least 0.01.
    Huber(f64),
}

impl Loss {
    /// Huber's loss with the threshold 1.345. For normal noise it has 95 % of the efficiency of squares.
    pub const ROBUST: Self = Self::Huber(1.345);

    /// Loss of a residual.
    pub(super) fn value(self, r: f64) -> f64 {
        match self {
            Self::Huber(c) if r.abs() > c => c * r.abs() - 0.5 * c * c,
            _ => 0.5 * r * r,
        }
    }

    /// Derivative of the loss.
    pub(super) fn slope(self, r: f64) -> f64 {
        match self {
            Self::Huber(c) => r.clamp(-c, c),
            Self::Squares => r,
        }
    }

    /// Mean square of the derivative of the loss, and share of residuals in the quadratic part, for normal noise.
    pub(super) fn for_normal_noise(self) -> (f64, f64) {
        // Integrals over the normal distribution by the midpoint rule. The density is below 1e-14 beyond 8.
        const STEP: f64 = 1e-3;
        let midpoints = (0..8000).map(|k| STEP * (f64::from(k) + 0.5));
        midpoints.fold((0.0, 0.0), |(square, share), r| {
            let weight = STEP * (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * r * r).exp();
            let inside = if self.is_inside(r) { weight } else { 0.0 };
            (square + weight * self.slope(r).powi(2), share + inside)
        })
    }

    /// Whether a residual is in the quadratic part.
    pub(super) fn is_inside(self, r: f64) -> bool {
        !matches!(self, Self::Huber(c) if r.abs() > c)
    }
}

/// Initial damping.
const DAMPING: f64 = 1e-3;

/// Factor of the damping after a successful step.
const LESS_DAMPING: f64 = 0.2;

/// Factor of the damping after a failed step.
const MORE_DAMPING: f64 = 5.0;

/// Smallest damping.
const LEAST_DAMPING: f64 = 1e-9;

/// Largest damping.
const MOST_DAMPING: f64 = 1e12;

/// Damping of the steps that confirm the end of a search. The weakest combinations that have an effect have squares of
/// relative singular values of 1e-12 and more, and steps along them with the first damping are long enough to be
/// noticed.
const CONFIRMATION: [f64; 3] = [LEAST_DAMPING, 1e-7, 1e-5];

/// Largest number of steps in an iteration, with increasing damping.
const TRIALS: usize = 12;

/// Largest change of a coordinate in an iteration. A logarithmic parameter changes by at most the factor e.
const LONGEST: f64 = 1.0;

/// Conditions for the end of a search.
#[derive(Clone, Copy)]
pub(super) struct End {
    /// Predicted length of a step, in standard errors, below which the search has converged.
    pub accuracy: f64,
    /// Largest number of iterations.
    pub iterations: usize,
}

/// Point that a search has reached.
pub(super) struct Reached {
    /// Free coordinates.
    pub x: DVector<f64>,
    /// Residuals at this point.
    pub at: Evaluated,
    /// Loss of all residuals and priors.
    pub objective: f64,
    /// Number of iterations, each with one Jacobian.
    pub iterations: usize,
    pub converged: bool,
    /// Error of the family or of a run that prevents any further step.
    pub failure: Option<FitError>,
}

/// Objective: the sum of the losses and of half the squares of the priors.
pub(super) fn objective(problem: &Problem, loss: Loss, x: &DVector<f64>, residuals: &DVector<f64>) -> f64 {
    let data: f64 = residuals.iter().map(|r| loss.value(*r)).sum();
    data + priors(problem, x).map(|(_, [r, _])| 0.5 * r * r).sum::<f64>()
}

/// Indices of the free coordinates with a prior, each with the residual of the prior and its derivative.
pub(super) fn priors<'a>(problem: &'a Problem, x: &'a DVector<f64>) -> impl Iterator<Item = (usize, [f64; 2])> + 'a {
    let residual = |(i, k): (usize, &usize)| Some((i, problem.parameters[*k].prior_residual(x[i])?));
    problem.free.iter().enumerate().filter_map(residual)
}

/// Searches for a minimum of the objective from the point `x`.
pub(super) fn search(problem: &Problem, loss: Loss, x: DVector<f64>, end: End) -> Result<Reached, FitError> {
    let n = problem.free.len();
    let limits: Vec<_> = problem.free.iter().map(|k| problem.parameters[*k].limits()).collect();
    let at = problem.evaluate(&x)?;
    let objective_at = objective(problem, loss, &x, &at.residuals);
    let mut now = Reached { x, at, objective: objective_at, iterations: 0, converged: n == 0, failure: None };
    let mut damping = DAMPING;
    while !now.converged && now.iterations < end.iterations {
        now.iterations += 1;
        let jacobian = problem.one_sided_jacobian(&now.x, &now.at)?;
        let weights = now.at.residuals.map(|r| if r == 0.0 { 1.0 } else { loss.slope(r) / r });
        let slopes = now.at.residuals.map(|r| loss.slope(r));
        let mut gradient = jacobian.tr_mul(&slopes);
        let mut matrix = weighted_square(&jacobian, &weights);
        for (i, [r, slope]) in priors(problem, &now.x) {
            gradient[i] += r * slope;
            matrix[(i, i)] += slope * slope;
        }
        let held = |i: usize| {
            let [low, high] = limits[i];
            now.x[i] <= low && gradient[i] > 0.0 || now.x[i] >= high && gradient[i] < 0.0
        };
        let moving: Vec<usize> = (0..n).filter(|i| !held(*i)).collect();
        if moving.iter().all(|i| gradient[*i] == 0.0) {
            now.converged = true;
            break;
        }
        let (mut improved, mut failure) = (None, None);
        for _ in 0..TRIALS {
            let Some(step) = damped_step(&matrix, &gradient, &moving, damping) else {
                damping = (damping * MORE_DAMPING).min(MOST_DAMPING);
                continue;
            };
            let x = displaced(&now.x, &step, &moving, &limits);
            let change = &x - &now.x;
            // Length of the step in standard errors: predicted change of the residuals over the noise.
            let size = change.dot(&(&matrix * &change)).max(0.0).sqrt();
            if size <= end.accuracy && damping < 1.0 {
                // Damping shortens steps along a combination with a small effect, although its minimum may be distant.
                improved = less_damped(problem, loss, &now, end, |damping| {
                    let step = damped_step(&matrix, &gradient, &moving, damping)?;
                    Some(displaced(&now.x, &step, &moving, &limits))
                })?;
                now.converged = improved.is_none();
                break;
            }
            failure = None;
            match problem.evaluate(&x) {
                Ok(at) => {
                    let value = objective(problem, loss, &x, &at.residuals);
                    if value < now.objective {
                        improved = Some((x, at, value));
                        damping = (damping * LESS_DAMPING).max(LEAST_DAMPING);
                        break;
                    }
                }
                // The family or the integrator may fail far from the solution. More damping shortens the step.
                Err(error @ (FitError::Family { .. } | FitError::Run { .. })) => failure = Some(error),
                Err(error) => return Err(error),
            }
            if size <= end.accuracy {
                now.converged = failure.is_none();
                break;
            }
            damping = (damping * MORE_DAMPING).min(MOST_DAMPING);
        }
        match improved {
            Some((x, at, value)) => (now.x, now.at, now.objective) = (x, at, value),
            None => {
                now.failure = failure;
                break;
            }
        }
    }
    Ok(now)
}

/// Point, its residuals and its objective.
type Improved = (DVector<f64>, Evaluated, f64);

/// Returns a point of a step with less damping whose objective is lower than that of `now` by more than the square of
/// the accuracy. `point` returns the end of a step with a damping.
fn less_damped(
    problem: &Problem,
    loss: Loss,
    now: &Reached,
    end: End,
    point: impl Fn(f64) -> Option<DVector<f64>>,
) -> Result<Option<Improved>, FitError> {
    for x in CONFIRMATION.into_iter().filter_map(point) {
        match problem.evaluate(&x) {
            Ok(at) => {
                let value = objective(problem, loss, &x, &at.residuals);
                if value < now.objective - end.accuracy * end.accuracy {
                    return Ok(Some((x, at, value)));
                }
            }
            Err(FitError::Family { .. } | FitError::Run { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// End of a step of the `moving` coordinates, shortened to the largest change and clipped to the limits.
fn displaced(x: &DVector<f64>, step: &DVector<f64>, moving: &[usize], limits: &[[f64; 2]]) -> DVector<f64> {
    let longest = step.amax();
    let factor = if longest > LONGEST { LONGEST / longest } else { 1.0 };
    let mut x = x.clone();
    for (i, k) in moving.iter().enumerate() {
        x[*k] = (x[*k] + step[i] * factor).clamp(limits[*k][0], limits[*k][1]);
    }
    x
}

/// Jᵀ W J, with the diagonal matrix W of the weights.
pub(super) fn weighted_square(jacobian: &DMatrix<f64>, weights: &DVector<f64>) -> DMatrix<f64> {
    let mut scaled = jacobian.clone();
    for (mut row, weight) in scaled.row_iter_mut().zip(weights.iter()) {
        row *= *weight;
    }
    jacobian.tr_mul(&scaled)
}

/// Solution of the damped normal equations for the moving coordinates. `None` if the matrix is not positive definite,
/// or the solution not finite.
fn damped_step(matrix: &DMatrix<f64>, gradient: &DVector<f64>, moving: &[usize], damping: f64) -> Option<DVector<f64>> {
    let n = moving.len();
    let largest = moving.iter().map(|i| matrix[(*i, *i)]).fold(0.0, f64::max);
    let mut damped = DMatrix::from_fn(n, n, |i, j| matrix[(moving[i], moving[j])]);
    for i in 0..n {
        // The diagonal element of a coordinate without effect is zero, and gets a small damping.
        damped[(i, i)] += damping * damped[(i, i)].max(1e-12 * largest);
    }
    let right = DVector::from_fn(n, |i, _| -gradient[moving[i]]);
    damped.cholesky().map(|factor| factor.solve(&right)).filter(|step| step.iter().all(|x| x.is_finite()))
}
