//! Noise whose successive values are correlated, estimated from the residuals of a fit.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::residuals::Row;
use crate::tracking::{RedNoise, median};

/// Largest part of the squares of the residuals that a fit absorbs, in the estimate of the noise.
const MOST_ABSORBED: f64 = 0.75;

/// Largest correlation of successive values. The smallest one is zero: negative correlations do not narrow intervals.
const LARGEST_CORRELATION: f64 = 0.99;

/// Number of iterations for the absorbed part and the correlations, which depend on each other.
const ITERATIONS: usize = 8;

/// Largest lag of the test for correlated noise, in frames, and smallest number of residuals for each lag. Residuals of
/// a local minimum have the signs of the motion, which change after tens of frames.
const LAGS: usize = 20;
const LEAST_PER_LAG: usize = 8;

/// Noise of each series, estimated from the residuals of a fit.
pub(super) struct Noise(Vec<SeriesNoise>);

struct SeriesNoise {
    /// Indices of the residuals of the series, and its chains.
    indices: Vec<usize>,
    chains: Chains,
    /// Correlation of successive values of a coordinate, and model of the correlations at all lags.
    lag_one: f64,
    correlation: RedNoise,
    /// Mean square of the noise.
    variance: f64,
    /// Result of the test for correlated noise: see [`Noise::excess`].
    excess: f64,
}

impl Noise {
    /// Estimates the noise from the residuals of a fit, or from the derivatives of their loss, with the Jacobian J.
    /// `inverse` is (JᵀJ)⁻¹.
    pub fn of(residuals: &DVector<f64>, rows: &[Row], jacobian: &DMatrix<f64>, inverse: &DMatrix<f64>) -> Self {
        let count = rows.iter().map(|row| row.series + 1).max().unwrap_or(0);
        let of = |series| SeriesNoise::of(series, (residuals, rows), jacobian, inverse);
        Self((0..count).map(of).collect())
    }

    /// Covariance Jᵀ S J of the sums Jᵀ r of residuals r whose covariance S is that of the noise. White noise is added
    /// to each series until its mean square has at least the size `least`.
    pub fn covariance(&self, jacobian: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(jacobian.ncols(), jacobian.ncols());
        for SeriesNoise { indices, chains, correlation, variance, .. } in &self.0 {
            let jacobian = jacobian.select_rows(indices);
            sum += chains.correlated_square(&jacobian, *correlation) * *variance;
            sum += jacobian.tr_mul(&jacobian) * (least - variance).max(0.0);
        }
        sum
    }

    /// Largest correlation of successive values of a series.
    pub fn lag_one(&self) -> f64 {
        self.0.iter().map(|series| series.lag_one).fold(0.0, f64::max)
    }

    /// Number of standard deviations by which the correlations at all lags of a series exceed those of white noise: the
    /// test of G. E. P. Box and D. A. Pierce (J. Am. Stat. Assoc. 65, 1509, 1970). A wrong model or a local minimum
    /// leaves residuals that are smaller than the noise, and have this sign over many frames.
    pub fn excess(&self) -> f64 {
        self.0.iter().map(|series| series.excess).fold(0.0, f64::max)
    }

    /// Number of successive residuals that contain the information of one, the largest of all series: the variance of
    /// the mean of many residuals over that of white noise, which is the spectrum at frequency zero.
    pub fn redundancy(&self) -> f64 {
        self.0.iter().map(|series| series.correlation.spectrum(1.0)).fold(1.0, f64::max)
    }
}

impl SeriesNoise {
    /// Estimates the noise of a series from its residuals and its rows of the Jacobian.
    ///
    /// A fit absorbs tr[(JᵀJ)⁻¹ Jᵀ R J] of the n squares. This number exceeds that of the parameters if the noise is as
    /// slow as the columns of J. The products of successive residuals are reduced by the same part.
    fn of(
        series: usize,
        (residuals, rows): (&DVector<f64>, &[Row]),
        jacobian: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
    ) -> Self {
        let indices: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].series == series).collect();
        let chains = Chains::new(&indices.iter().map(|i| rows[*i]).collect::<Vec<_>>());
        let (residuals, jacobian) = (&residuals.select_rows(&indices), &jacobian.select_rows(&indices));
        let n = residuals.len() as f64;
        // Twice the standard error of a correlation of white noise.
        let uncertainty = 2.0 / n.sqrt();
        let observed = [1, 2].map(|lag| chains.correlation(residuals, lag));
        // `f64::min` and `f64::max` return the limit for a number that is not defined, unlike `clamp`.
        let absorbed = |correlation| {
            let square = chains.correlated_square(jacobian, correlation);
            (inverse * square).trace().min(MOST_ABSORBED * n).max(0.0)
        };
        let (mut lag_one, mut correlation) = (0.0, RedNoise::WHITE);
        for _ in 0..ITERATIONS {
            let part = absorbed(correlation) / n;
            let lags = observed.map(|one| (one + (1.0 - one) * part).clamp(0.0, LARGEST_CORRELATION));
            (lag_one, correlation) = (lags[0], significant(lags, uncertainty));
        }
        let variance = residuals.norm_squared() / (n - absorbed(correlation)).max(1.0);
        let excess = chains.excess(residuals);
        Self { indices, chains, lag_one, correlation, variance, excess }
    }
}

/// Noise with the given correlations of values one frame and two frames apart. Those below `uncertainty` count as zero.
fn significant([one, two]: [f64; 2], uncertainty: f64) -> RedNoise {
    let two = if two < uncertainty { 0.0 } else { two };
    if one < uncertainty { RedNoise::WHITE } else { RedNoise::of([one, two], LARGEST_CORRELATION) }
}

/// Chains of the residuals of a series: those of one coordinate in successive frames.
struct Chains {
    /// Index of the previous residual of the chain, and the time between both over the median of these times.
    previous: Vec<Option<(usize, f64)>>,
}

impl Chains {
    fn new(rows: &[Row]) -> Self {
        let mut last = BTreeMap::new();
        let mut before = |(i, row): (usize, &Row)| {
            let before = last.insert(row.coordinate, i)?;
            Some((before, row.time - rows[before].time))
        };
        let mut previous: Vec<Option<(usize, f64)>> = rows.iter().enumerate().map(&mut before).collect();
        let typical = median(previous.iter().flatten().map(|(_, gap)| *gap).collect());
        previous.iter_mut().flatten().for_each(|(_, gap)| *gap /= typical);
        Self { previous }
    }

    /// Correlation of values that are `lag` frames apart.
    fn correlation(&self, values: &DVector<f64>, lag: usize) -> f64 {
        let mut sums = [0.0, 0.0];
        for i in 0..values.len() {
            if let Some(before) = (0..lag).try_fold(i, |i, _| self.previous[i].map(|(before, _)| before)) {
                sums[0] += values[i] * values[before];
                sums[1] += 0.5 * (values[i].powi(2) + values[before].powi(2));
            }
        }
        if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
    }

    /// Sum of the squares of the correlations at all lags, in standard deviations above its mean for white noise. The
    /// cube root of a χ² is almost normal (E. B. Wilson and M. M. Hilferty, Proc. Natl. Acad. Sci. 17, 684, 1931).
    fn excess(&self, values: &DVector<f64>) -> f64 {
        let count = values.iter().filter(|value| **value != 0.0).count();
        let lags = LAGS.min(count / LEAST_PER_LAG);
        if lags == 0 {
            return 0.0;
        }
        let squares = (1..=lags).map(|lag| self.correlation(values, lag).powi(2) * count as f64);
        let (mean, variance) = (squares.sum::<f64>() / lags as f64, 2.0 / (9.0 * lags as f64));
        (mean.cbrt() - 1.0 + variance) / variance.sqrt()
    }

    /// Jᵀ R J with the correlations R of the noise.
    fn correlated_square(&self, jacobian: &DMatrix<f64>, noise: RedNoise) -> DMatrix<f64> {
        if noise == RedNoise::WHITE {
            return jacobian.tr_mul(jacobian);
        }
        let mut tails = DMatrix::zeros(jacobian.nrows(), jacobian.ncols());
        for (i, previous) in self.previous.iter().enumerate() {
            if let Some((before, gap)) = *previous {
                let tail = (tails.row(before) + jacobian.row(before)) * noise.decay.powf(gap);
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
    fn correlations_below_their_uncertainty_are_zero() {
        assert_eq!(significant([0.09, 0.09], 0.1), RedNoise::WHITE);
        assert_eq!(significant([0.2, 0.09], 0.1), RedNoise { share: 1.0, decay: 0.2 });
    }

    /// Rows of one coordinate in frames at times 0, 1, 2, 4.
    #[test]
    fn correlations_decay_with_time() {
        let rows: Vec<_> = [0.0, 1.0, 2.0, 4.0].map(|time| Row { series: 0, coordinate: 0, time }).into();
        let jacobian = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, -1.0, 3.0]);
        let noise = RedNoise { share: 0.6, decay: 0.5 };
        let found = Chains::new(&rows).correlated_square(&jacobian, noise);
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
    }

    /// White noise with a wave of a third of its variance, and a period of 40 frames, is not white.
    #[test]
    fn slow_residuals_below_the_noise_are_distinguished_from_white_noise() {
        let rows: Vec<_> = (0..400).map(|k| Row { series: 0, coordinate: 0, time: f64::from(k) }).collect();
        // The signs of a quadratic residue sequence have no correlations.
        let sign = |k: u32| if (k * k % 401).is_multiple_of(2) { 1.0 } else { -1.0 };
        let wave = |k: u32| (std::f64::consts::TAU * f64::from(k) / 40.0).sin();
        let excess = |part: f64| {
            let residuals = DVector::from_iterator(400, (0..400).map(|k| sign(k) + part * wave(k)));
            Noise::of(&residuals, &rows, &DMatrix::zeros(400, 0), &DMatrix::zeros(0, 0)).excess()
        };
        assert!(excess(0.0) < 4.0, "{}", excess(0.0));
        // Correlations of cos(2π lag/40) / 4 at 20 lags have squares with the sum 0.6, and 400 residuals times this sum
        // is far above the mean of χ², 20, whose standard deviation is 6.
        assert!(excess((2.0_f64 / 3.0).sqrt()) > 6.0, "{}", excess(0.8));
    }

    /// A slow series of 40 frames, and a second one of 400 frames with white noise of three times its size.
    #[test]
    fn correlation_and_variance_of_each_series_are_its_own() {
        let row = |series: usize| move |k: u32| Row { series, coordinate: 0, time: f64::from(k) };
        let rows: Vec<_> = (0..40).map(row(0)).chain((0..400).map(row(1))).collect();
        // A wave has the correlation cos 2π/40. The signs of a quadratic residue sequence have none.
        let wave = |k: u32| (std::f64::consts::TAU * f64::from(k) / 40.0).sin();
        let sign = |k: u32| if (k * k % 401).is_multiple_of(2) { 3.0 } else { -3.0 };
        let residuals = DVector::from_iterator(440, (0..40).map(wave).chain((0..400).map(sign)));
        let none = DMatrix::zeros(440, 0);
        let found = Noise::of(&residuals, &rows, &none, &DMatrix::zeros(0, 0));
        let [slow, white] = &found.0[..] else { panic!("two series") };
        // The sums of a wave over a period without its end.
        assert_relative_eq!(slow.variance, 0.5, epsilon = 1e-12);
        assert!(slow.lag_one > 0.95 && slow.correlation.spectrum(1.0) > 10.0, "{}", slow.lag_one);
        assert_relative_eq!(white.variance, 9.0, epsilon = 1e-12);
        assert!(white.correlation == RedNoise::WHITE, "{:?}", white.correlation);
    }
}
