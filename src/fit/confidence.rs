//! Covariance of the estimates.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::noise::Noise;
use super::problem::Problem;
use super::search::{Loss, Reached, priors};
use super::singular::Singular;

/// Largest number of iterations for an eigenvalue. Usually two or three suffice.
const ITERATIONS: usize = 100;

/// Covariance of the linearised problem at a point, with the noise that it assumes.
pub(super) struct Confidence {
    /// Covariance of the free coordinates, without the combinations that have no effect.
    pub covariance: DMatrix<f64>,
    /// The same for the loss of squares and white noise of the size in the problem.
    pub white: DMatrix<f64>,
    /// Correlation of the noise in successive frames, and number of residuals with the information of one; the largest
    /// of all series.
    pub lag_one: f64,
    pub redundancy: f64,
}

impl Confidence {
    /// Confidence of `free` coordinates of which nothing is known.
    pub fn none(free: usize) -> Self {
        let covariance = DMatrix::from_element(free, free, f64::INFINITY);
        Self { white: covariance.clone(), covariance, lag_one: 0.0, redundancy: 1.0 }
    }

    /// Confidence at a point, with the Jacobian there and its decomposition.
    ///
    /// The covariance is A B A with A = (m JᵀJ)⁻¹ and B = s² Jᵀ R J (P. J. Huber, Robust Statistics, 1981, section
    /// 7.6). Here m is the share of residuals inside the threshold, s² the mean square of the derivative of the loss
    /// in a series, and R the correlation of its successive residuals. For white noise and squares the covariance is s²
    /// (JᵀJ)⁻¹. Residuals that are smaller than the noise do not narrow the intervals: m is at most its value for
    /// normal noise, and white noise is added until the mean square has at least its value for normal noise. Priors are
    /// residuals with their own standard deviation.
    pub fn of(
        problem: &Problem,
        loss: Loss,
        reached: &Reached,
        (jacobian, singular): (&DMatrix<f64>, &Singular),
    ) -> Self {
        let (residuals, rows) = (&reached.at.residuals, &reached.at.rows);
        let slopes = residuals.map(|r| loss.slope(r));
        let (normal_variance, normal_share) = loss.for_normal_noise();
        let inside = residuals.iter().filter(|r| loss.is_inside(**r)).count().max(1) as f64 / residuals.len() as f64;
        let inside = inside.min(normal_share);
        let inverse = singular.inverse();
        let noise = Noise::of(&slopes, rows, jacobian, &inverse);
        let mut middle = noise.covariance(jacobian, normal_variance) / (inside * inside);
        for (i, [_, slope]) in priors(problem, &reached.x) {
            middle[(i, i)] += slope * slope;
        }
        let covariance = &inverse * middle * &inverse;
        Self { covariance, white: inverse, lag_one: noise.lag_one(), redundancy: noise.redundancy() }
    }
}

/// Combinations of coordinates with a standard error above `widest`, the largest error first. Each has its components,
/// the largest ±1, and its standard error.
pub(super) fn uncertain(covariance: &DMatrix<f64>, widest: f64) -> Vec<(DVector<f64>, f64)> {
    // nalgebra does not decompose an empty matrix.
    if covariance.is_empty() {
        return vec![];
    }
    let iterations = ITERATIONS * covariance.nrows();
    let Some(eigen) = SymmetricEigen::try_new(covariance.clone(), f64::EPSILON, iterations) else { return vec![] };
    let combination = |j: usize| {
        let direction = eigen.eigenvectors.column(j);
        (direction.unscale(direction.amax()), eigen.eigenvalues[j].max(0.0).sqrt() * direction.amax())
    };
    let mut all: Vec<_> = (0..eigen.eigenvalues.len()).map(combination).filter(|(_, error)| *error > widest).collect();
    all.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    all
}
