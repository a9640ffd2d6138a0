//! Noise whose successive values are correlated, estimated from the residuals of a fit.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::residuals::Row;
use crate::tracking::median;

/// Largest part of the squares of the residuals that a fit absorbs, in the estimate of the noise.
const MOST_ABSORBED: f64 = 0.75;

/// Largest correlation of successive values. The smallest one is zero: negative correlations do not narrow intervals.
const LARGEST_CORRELATION: f64 = 0.99;

/// Number of iterations for the absorbed part and the correlations, which depend on each other.
const ITERATIONS: usize = 8;

/// Correlation of values k frames apart: 1 for k = 0, otherwise `share` · `decay`^k. White noise has the share zero. A
/// first-order autoregressive process has the share one. The sum of both has a share between zero and one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correlation {
    /// Part of the variance that belongs to the autoregressive process.
    pub share: f64,
    /// Correlation of successive values of the autoregressive process.
    pub decay: f64,
}

impl Correlation {
    /// White noise.
    pub const WHITE: Self = Self { share: 0.0, decay: 0.0 };

    /// Process with the given correlations of values one frame and two frames apart. Correlations below `uncertainty`
    /// count as zero.
    fn of([one, two]: [f64; 2], uncertainty: f64) -> Self {
        if one < uncertainty {
            return Self::WHITE;
        }
        // The quotient of two uncertain numbers is used only if both differ from zero.
        let decay = if two < uncertainty { one } else { (two / one).clamp(one, LARGEST_CORRELATION) };
        Self { share: one / decay, decay }
    }

    /// Variance of the mean of many values over that of white noise of the same variance. This number of successive
    /// values contains the information of one.
    pub fn redundancy(self) -> f64 {
        1.0 - self.share + self.share * (1.0 + self.decay) / (1.0 - self.decay)
    }
}

/// Noise, estimated from the residuals of a fit.
pub(super) struct Noise {
    /// Correlation of successive values of a coordinate.
    pub lag_one: f64,
    /// Model of the correlations at all lags.
    pub correlation: Correlation,
    /// Mean square of the noise.
    pub variance: f64,
    /// Jᵀ R J, with the correlations R of the noise.
    pub square: DMatrix<f64>,
}

impl Noise {
    /// Estimates the noise from the residuals of a fit, or from the derivatives of their loss, with the Jacobian J.
    /// `inverse` is (JᵀJ)⁻¹.
    ///
    /// A fit absorbs tr[(JᵀJ)⁻¹ Jᵀ R J] of the n squares. This number exceeds that of the parameters if the noise is as
    /// slow as the columns of J. The products of successive residuals are reduced by the same part.
    pub fn of(residuals: &DVector<f64>, rows: &[Row], jacobian: &DMatrix<f64>, inverse: &DMatrix<f64>) -> Self {
        let n = residuals.len() as f64;
        // Twice the standard error of a correlation of white noise.
        let uncertainty = 2.0 / n.sqrt();
        let chains = Chains::new(rows);
        let observed = [1, 2].map(|lag| chains.correlation(residuals, lag));
        let mut square = jacobian.tr_mul(jacobian);
        let absorbed = |square: &DMatrix<f64>| (inverse * square).trace().clamp(0.0, MOST_ABSORBED * n);
        let (mut lag_one, mut correlation) = (0.0, Correlation::WHITE);
        for _ in 0..ITERATIONS {
            let part = absorbed(&square) / n;
            let lags = observed.map(|one| (one + (1.0 - one) * part).clamp(0.0, LARGEST_CORRELATION));
            (lag_one, correlation) = (lags[0], Correlation::of(lags, uncertainty));
            square = chains.correlated_square(rows, jacobian, correlation);
        }
        let variance = residuals.norm_squared() / (n - absorbed(&square)).max(1.0);
        Self { lag_one, correlation, variance, square }
    }
}

/// Chains of residuals: those of one coordinate of one series in successive frames.
pub(super) struct Chains {
    /// Index of the row before each row in its chain; `None` for the first.
    previous: Vec<Option<usize>>,
    /// Median time between successive rows of the chains of the series to which each row belongs, s.
    spacing: Vec<f64>,
}

impl Chains {
    /// Chains of rows in the order of time.
    pub fn new(rows: &[Row]) -> Self {
        let mut last = BTreeMap::new();
        let previous: Vec<Option<usize>> =
            rows.iter().enumerate().map(|(i, row)| last.insert((row.series, row.coordinate), i)).collect();
        let mut gaps = BTreeMap::<usize, Vec<f64>>::new();
        for (i, before) in previous.iter().enumerate() {
            if let Some(before) = before {
                gaps.entry(rows[i].series).or_default().push(rows[i].time - rows[*before].time);
            }
        }
        let medians: BTreeMap<usize, f64> = gaps.into_iter().map(|(series, gaps)| (series, median(gaps))).collect();
        // A series without successive rows does not use its spacing.
        let spacing = rows.iter().map(|row| medians.get(&row.series).copied().unwrap_or(1.0)).collect();
        Self { previous, spacing }
    }

    /// Correlation of values that are `lag` frames apart.
    fn correlation(&self, values: &DVector<f64>, lag: usize) -> f64 {
        let mut sums = [0.0, 0.0];
        for i in 0..values.len() {
            if let Some(before) = (0..lag).try_fold(i, |i, _| self.previous[i]) {
                sums[0] += values[i] * values[before];
                sums[1] += 0.5 * (values[i].powi(2) + values[before].powi(2));
            }
        }
        if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
    }

    /// Jᵀ R J, where the correlation R of two rows of a chain decays with the time between them over the median
    /// spacing.
    pub fn correlated_square(&self, rows: &[Row], jacobian: &DMatrix<f64>, noise: Correlation) -> DMatrix<f64> {
        if noise == Correlation::WHITE {
            return jacobian.tr_mul(jacobian);
        }
        let mut tails = DMatrix::zeros(rows.len(), jacobian.ncols());
        for i in 0..rows.len() {
            if let Some(before) = self.previous[i] {
                let decay = noise.decay.powf((rows[i].time - rows[before].time) / self.spacing[i]);
                let tail = (tails.row(before) + jacobian.row(before)) * decay;
                tails.set_row(i, &tail);
            }
        }
        let cross = jacobian.tr_mul(&tails) * noise.share;
        jacobian.tr_mul(jacobian) + &cross + cross.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn correlations_of_two_lags_give_share_and_decay() {
        for (share, decay) in [(1.0, 0.8), (0.5, 0.95), (0.3, 0.9)] {
            let found = Correlation::of([share * decay, share * decay * decay], 0.1);
            // The error is rounding.
            assert_relative_eq!(found.share, share, epsilon = 0.0, max_relative = 1e-14);
            assert_relative_eq!(found.decay, decay, epsilon = 0.0, max_relative = 1e-14);
        }
        assert_eq!(Correlation::of([0.09, 0.09], 0.1), Correlation::WHITE);
        // The second correlation counts as zero.
        assert_eq!(Correlation::of([0.2, 0.09], 0.1), Correlation { share: 1.0, decay: 0.2 });
    }

    /// Rows of one coordinate in frames at times 0, 1, 2, 4.
    #[test]
    fn correlations_decay_with_time() {
        let rows: Vec<_> = [0.0, 1.0, 2.0, 4.0].map(|time| Row { series: 0, coordinate: 0, time }).into();
        let jacobian = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, -1.0, 3.0]);
        let noise = Correlation { share: 0.6, decay: 0.5 };
        let found = Chains::new(&rows).correlated_square(&rows, &jacobian, noise);
        let mut expected = 0.0;
        for (i, row) in rows.iter().enumerate() {
            for (k, other) in rows.iter().enumerate() {
                let distance = (row.time - other.time).abs();
                let correlation = if i == k { 1.0 } else { noise.share * noise.decay.powf(distance) };
                expected += jacobian[i] * correlation * jacobian[k];
            }
        }
        // The error is rounding.
        assert_relative_eq!(found[0], expected, epsilon = 0.0, max_relative = 1e-14);
        // Sum over all lags, 1 + 2 · 0.6 · (0.5 + 0.25 + …).
        assert_relative_eq!(noise.redundancy(), 2.2, epsilon = 0.0, max_relative = 1e-14);
    }
}
