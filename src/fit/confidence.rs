//! Covariance of the estimates, and which combinations of parameters the data determine.

use nalgebra::{DMatrix, DVector};

use super::problem::Problem;
use super::residuals::Row;
use super::search::{Loss, Reached, priors};

/// Ratio of a singular value to the largest one below which the combination has no effect on the data. Extrapolated
/// differences on a frozen grid give 1e-10 for combinations without effect, and have an error of this size for others.
const STRUCTURAL: f64 = 1e-8;

/// Component of a combination without effect above which a parameter belongs to it.
const BELONGS: f64 = 1e-3;

/// Largest part of the squares that a fit can absorb in the estimate of the noise, largest correlation of successive
/// values, and number of iterations for both. Negative correlations do not narrow intervals.
const MOST_ABSORBED: f64 = 0.75;
const LARGEST_LAG_ONE: f64 = 0.99;
const ITERATIONS: usize = 8;

/// Linearised confidence at a point.
pub(super) struct Confidence {
    /// Covariance of the coordinates without the combinations that have no effect.
    pub covariance: DMatrix<f64>,
    /// The same for squares and white noise of the given size.
    pub white: DMatrix<f64>,
    /// Singular values, and combinations of coordinates as columns.
    pub singular: DVector<f64>,
    pub directions: DMatrix<f64>,
    pub lag_one: f64,
}

impl Confidence {
    /// Whether the combination of a column has no effect on the data.
    pub fn is_structural(&self, direction: usize) -> bool {
        self.singular[direction] <= STRUCTURAL * self.singular.max()
    }

    /// Whether a coordinate belongs to a combination without effect.
    pub fn is_in_structural(&self, coordinate: usize) -> bool {
        let belongs = |j: usize| self.is_structural(j) && self.directions[(coordinate, j)].abs() > BELONGS;
        (0..self.singular.len()).any(belongs)
    }
}

/// Singular values and right singular vectors of a Jacobian together with the priors.
pub(super) fn singular(
    problem: &Problem,
    x: &DVector<f64>,
    jacobian: &DMatrix<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    // Singular values of an empty matrix are not defined.
    if jacobian.is_empty() {
        return None;
    }
    let known: Vec<_> = priors(problem, x).collect();
    let mut rows = jacobian.clone().resize_vertically(jacobian.nrows() + known.len(), 0.0);
    for (row, (i, [_, slope])) in known.iter().enumerate() {
        rows[(jacobian.nrows() + row, *i)] = *slope;
    }
    // The triangular factor has the same singular values, and is small.
    let triangle = rows.qr().r();
    let svd = triangle.try_svd(false, true, f64::EPSILON, 0)?;
    let directions = svd.v_t?.transpose();
    Some((svd.singular_values, directions))
}

/// Confidence at a point, with the Jacobian there.
///
/// The covariance is A B A with A = (m JᵀJ)⁻¹, B = s² Jᵀ R J (Huber 1981, section 7.6): m is the share of residuals
/// inside the threshold, s² the mean square of the derivative of the loss, and R the correlation of a first-order
/// autoregressive noise with the observed correlation of successive residuals. For white noise and squares this is
/// s² (JᵀJ)⁻¹. Residuals that are smaller than the noise do not narrow the intervals: m is at most the share for normal
/// noise, and white noise is added up to its mean square.
pub(super) fn confidence(
    problem: &Problem,
    loss: Loss,
    reached: &Reached,
    jacobian: &DMatrix<f64>,
) -> Option<Confidence> {
    let (residuals, rows) = (&reached.at.residuals, &reached.at.rows);
    let n = residuals.len();
    let (singular, directions) = singular(problem, &reached.x, jacobian)?;
    let slopes = residuals.map(|r| loss.slope(r));
    let (normal_variance, normal_share) = loss.for_normal_noise();
    let inside = residuals.iter().filter(|r| loss.is_inside(**r)).count().max(1) as f64 / n as f64;
    let inside = inside.min(normal_share);
    let cutoff = STRUCTURAL * singular.max();
    let inverse = singular.map(|s| if s > cutoff { 1.0 / (s * s) } else { 0.0 });
    let bread = &directions * DMatrix::from_diagonal(&inverse) * directions.transpose();
    // Priors have the covariance that they state.
    let Noise { lag_one, variance, square: correlated } = Noise::of(&slopes, rows, jacobian, &bread);
    let white = jacobian.tr_mul(jacobian) * (normal_variance - variance).max(0.0);
    let mut middle = (correlated * variance + white) / (inside * inside);
    for (i, [_, slope]) in priors(problem, &reached.x) {
        middle[(i, i)] += slope * slope;
    }
    let covariance = &bread * middle * &bread;
    Some(Confidence { covariance, white: bread, singular, directions, lag_one })
}

/// Noise as a first-order autoregressive process, from residuals after a fit.
pub(super) struct Noise {
    /// Correlation of successive values.
    pub lag_one: f64,
    /// Mean square.
    pub variance: f64,
    /// Jᵀ R J, with the correlations R of the noise.
    pub square: DMatrix<f64>,
}

impl Noise {
    /// Estimate from residuals (or derivatives of their loss) after a fit with the Jacobian J, where `inverse` is
    /// (JᵀJ)⁻¹.
    ///
    /// A fit absorbs the part tr[(JᵀJ)⁻¹ Jᵀ R J] of n squares, which exceeds the number of parameters if the noise is
    /// as slow as the columns of J. The same part is missing in the products of successive residuals.
    pub fn of(residuals: &DVector<f64>, rows: &[Row], jacobian: &DMatrix<f64>, inverse: &DMatrix<f64>) -> Self {
        let n = residuals.len() as f64;
        let chains = Chains::new(rows);
        let observed = chains.lag_one(residuals);
        let mut square = jacobian.tr_mul(jacobian);
        let absorbed = |square: &DMatrix<f64>| (inverse * square).trace().clamp(0.0, MOST_ABSORBED * n);
        let mut lag_one = 0.0;
        for _ in 0..ITERATIONS {
            let part = absorbed(&square) / n;
            lag_one = (observed + (1.0 - observed) * part).clamp(0.0, LARGEST_LAG_ONE);
            square = chains.correlated_square(rows, jacobian, lag_one);
        }
        let variance = residuals.norm_squared() / (n - absorbed(&square)).max(1.0);
        Self { lag_one, variance, square }
    }
}

/// Coordinates that are measured in successive frames.
pub(super) struct Chains {
    /// Index of the previous row of each row in its chain.
    previous: Vec<Option<usize>>,
    /// Typical time between rows of each chain, s, by row.
    spacing: Vec<f64>,
}

impl Chains {
    pub fn new(rows: &[Row]) -> Self {
        let mut last = std::collections::BTreeMap::new();
        let previous: Vec<Option<usize>> =
            rows.iter().enumerate().map(|(i, row)| last.insert((row.series, row.coordinate), i)).collect();
        let mut gaps = std::collections::BTreeMap::<usize, Vec<f64>>::new();
        for (i, before) in previous.iter().enumerate() {
            if let Some(before) = before {
                gaps.entry(rows[i].series).or_default().push(rows[i].time - rows[*before].time);
            }
        }
        let typical = |mut gaps: Vec<f64>| {
            gaps.sort_by(f64::total_cmp);
            gaps[gaps.len() / 2]
        };
        let typical: std::collections::BTreeMap<usize, f64> = gaps.into_iter().map(|(s, g)| (s, typical(g))).collect();
        let spacing = rows.iter().map(|row| typical.get(&row.series).copied().unwrap_or(1.0)).collect();
        Self { previous, spacing }
    }

    /// Correlation of successive values.
    pub fn lag_one(&self, values: &DVector<f64>) -> f64 {
        let mut sums = [0.0, 0.0];
        for (i, before) in self.previous.iter().enumerate() {
            if let Some(before) = before {
                sums[0] += values[i] * values[*before];
                sums[1] += 0.5 * (values[i].powi(2) + values[*before].powi(2));
            }
        }
        if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
    }

    /// Jᵀ R J with the correlation ρ^(time between rows over their typical spacing) within chains.
    pub fn correlated_square(&self, rows: &[Row], jacobian: &DMatrix<f64>, lag_one: f64) -> DMatrix<f64> {
        // Correlations of white noise have an error of n^(−1/2).
        if lag_one < 2.0 / (rows.len() as f64).sqrt() {
            return jacobian.tr_mul(jacobian);
        }
        let mut tails = DMatrix::zeros(rows.len(), jacobian.ncols());
        for i in 0..rows.len() {
            if let Some(before) = self.previous[i] {
                let decay = lag_one.powf((rows[i].time - rows[before].time) / self.spacing[i]);
                let tail = (tails.row(before) + jacobian.row(before)) * decay;
                tails.set_row(i, &tail);
            }
        }
        let cross = jacobian.tr_mul(&tails);
        jacobian.tr_mul(jacobian) + &cross + cross.transpose()
    }
}
