//! Covariance of the estimates.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::noise::Noise;
use super::problem::{Point, Problem};
use super::singular::Singular;

/// Largest number of iterations for an eigenvalue. Usually two or three suffice.
const ITERATIONS: usize = 100;

/// Linearised problem at the estimates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    /// Indices of the parameters with a standard error.
    pub free: Vec<usize>,
    /// Covariance of the coordinates of these parameters, without the combinations that have no effect.
    pub covariance: DMatrix<f64>,
    /// The same covariance for the loss of squares and white noise of the size in the problem.
    pub white: DMatrix<f64>,
    /// Number of successive residuals that contain the information of one.
    pub redundancy: f64,
    /// Combinations without effect on the data: changes of the coordinates.
    pub without_effect: Vec<DVector<f64>>,
}

impl Linear {
    /// Linearised problem at a point, with the Jacobian there, its decomposition, and the noise.
    ///
    /// The covariance is A B A with A = (m JᵀJ)⁻¹ and B = s² Jᵀ R J (P. J. Huber, Robust Statistics, 1981, section
    /// 7.6). Here m is the share of residuals inside the threshold, s² the mean square of the derivative of the loss
    /// in a series, and R the correlation of its successive residuals. For white noise and squares the covariance is s²
    /// (JᵀJ)⁻¹. Residuals that are smaller than the noise do not narrow the intervals: m is at most its value for
    /// normal noise, and white noise is added until the mean square has at least its value for normal noise. Priors are
    /// residuals with their own standard deviation.
    pub fn of(problem: &Problem, point: &Point, jacobian: &DMatrix<f64>, singular: &Singular, noise: &Noise) -> Self {
        let (normal_variance, normal_share) = problem.loss.for_normal_noise();
        let inside = point.residuals.iter().filter(|r| problem.loss.is_inside(**r)).count().max(1) as f64;
        let inside = (inside / point.residuals.len() as f64).min(normal_share);
        let mut middle = noise.covariance(jacobian, normal_variance) / (inside * inside);
        for (i, [_, slope]) in problem.priors(&point.x) {
            middle[(i, i)] += slope * slope;
        }
        let white = singular.inverse();
        Self {
            free: problem.free.clone(),
            covariance: &white * middle * &white,
            white,
            redundancy: noise.redundancy(),
            without_effect: singular.without_effect(),
        }
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
