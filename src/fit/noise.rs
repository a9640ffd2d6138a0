//! Noise whose successive values are correlated, estimated from the residuals of a fit.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::residuals::Origin;
use crate::tracking::{RedNoise, median, normal_deviate};

/// Largest part of the squares of the residuals that a fit absorbs, in the estimate of the noise.
const MOST_ABSORBED: f64 = 0.75;

/// Largest correlation of successive values. The smallest one is zero: negative correlations do not
/// narrow intervals.
const LARGEST_CORRELATION: f64 = 0.99;

/// Number of iterations for the absorbed part and the correlations, which depend on each other.
const ITERATIONS: usize = 8;

/// Largest lag of the test for correlated noise, in frames, and smallest number of residuals for
/// each lag. Residuals of a local minimum have the signs of the motion, which change after tens of
/// frames.
const LAGS: usize = 20;
const LEAST_PER_LAG: usize = 8;

/// Noise of each series, estimated from the residuals of a fit.
pub(super) struct Noise(Vec<SeriesNoise>);

/// Noise of a series.
struct SeriesNoise {
    chains: Vec<Chain>,
    /// Correlation of successive values of a coordinate, and model of the correlations at all lags.
    lag_one: f64,
    correlation: RedNoise,
    /// Mean square of the noise.
    variance: f64,
    /// Result of the test for correlated noise: see [`Noise::excess`].
    excess: f64,
}

/// Residuals of one coordinate of a series in successive frames.
struct Chain {
    /// Indices of the residuals.
    indices: Vec<usize>,
    /// Times between successive residuals over the median of these times in the series.
    gaps: Vec<f64>,
}

impl Noise {
    /// Estimates the noise from the residuals of a fit, or from the derivatives of their loss, with
    /// the Jacobian J. `inverse` is (JᵀJ)⁻¹.
    pub fn of(
        residuals: &DVector<f64>,
        rows: &[Origin],
        jacobian: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
    ) -> Self {
        let count = rows.iter().map(|row| row.series + 1).max().unwrap_or(0);
        let of = |series| SeriesNoise::of(chains(rows, series), residuals, jacobian, inverse);
        Self((0..count).map(of).collect())
    }

    /// Covariance Jᵀ S J of the sums Jᵀ r of residuals r whose covariance S is that of the noise.
    /// White noise is added to each series until its mean square has at least the size `least`.
    pub fn covariance(&self, jacobian: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(jacobian.ncols(), jacobian.ncols());
        for SeriesNoise {
            chains,
            correlation,
            variance,
            ..
        } in &self.0
        {
            let total = variance.max(least).max(f64::MIN_POSITIVE);
            let noise = RedNoise {
                share: correlation.share * variance / total,
                ..*correlation
            };
            sum += correlated_square(chains, jacobian, noise) * total;
        }
        sum
    }

    /// Largest correlation of successive values of a series.
    pub fn lag_one(&self) -> f64 {
        self.0
            .iter()
            .map(|series| series.lag_one)
            .fold(0.0, f64::max)
    }

    /// Number of standard deviations by which the correlations at all lags of a series exceed those
    /// of white noise: the test of G. E. P. Box and D. A. Pierce (J. Am. Stat. Assoc. 65, 1509,
    /// 1970). A wrong model or a local minimum leaves residuals that are smaller than the noise,
    /// and keep their sign over many frames.
    pub fn excess(&self) -> f64 {
        self.0
            .iter()
            .map(|series| series.excess)
            .fold(0.0, f64::max)
    }

    /// Number of successive residuals that contain the information of one, the largest of all
    /// series: the variance of the mean of many residuals over that of white noise, which is the
    /// spectrum at frequency zero.
    pub fn redundancy(&self) -> f64 {
        self.0
            .iter()
            .map(|series| series.correlation.spectrum(1.0))
            .fold(1.0, f64::max)
    }
}

impl SeriesNoise {
    /// Estimates the noise of a series from its residuals and its rows of the Jacobian.
    ///
    /// A fit absorbs tr[(JᵀJ)⁻¹ Jᵀ R J] of the n squares. This number exceeds that of the
    /// parameters if the noise is as slow as the columns of J. The products of successive residuals
    /// are reduced by the same part.
    fn of(
        chains: Vec<Chain>,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
    ) -> Self {
        let own = || {
            chains
                .iter()
                .flat_map(|chain| &chain.indices)
                .map(|i| residuals[*i])
        };
        let n = own().count() as f64;
        // Twice the standard error of a correlation of white noise.
        let uncertainty = 2.0 / n.sqrt();
        let observed = [1, 2].map(|lag| correlation(&chains, residuals, lag));
        // `f64::min` and `f64::max` return the limit for a number that is not defined, unlike
        // `clamp`.
        let absorbed = |correlation| {
            let square = correlated_square(&chains, jacobian, correlation);
            (inverse * square).trace().min(MOST_ABSORBED * n).max(0.0)
        };
        let (mut lag_one, mut model) = (0.0, RedNoise::WHITE);
        for _ in 0..ITERATIONS {
            let part = absorbed(model) / n;
            let lags =
                observed.map(|one| (one + (1.0 - one) * part).clamp(0.0, LARGEST_CORRELATION));
            (lag_one, model) = (lags[0], significant(lags, uncertainty));
        }
        let variance = own().map(|r| r * r).sum::<f64>() / (n - absorbed(model)).max(1.0);
        let excess = excess(&chains, residuals);
        Self {
            chains,
            lag_one,
            correlation: model,
            variance,
            excess,
        }
    }
}

/// Noise with the given correlations of values one frame and two frames apart. Those below
/// `uncertainty` count as zero.
fn significant([one, two]: [f64; 2], uncertainty: f64) -> RedNoise {
    let two = if two < uncertainty { 0.0 } else { two };
    if one < uncertainty {
        RedNoise::WHITE
    } else {
        RedNoise::of([one, two], LARGEST_CORRELATION)
    }
}

/// Chains of the residuals of a series.
fn chains(rows: &[Origin], series: usize) -> Vec<Chain> {
    let mut indices: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, row) in rows
        .iter()
        .enumerate()
        .filter(|(_, row)| row.series == series)
    {
        indices.entry(row.index).or_default().push(i);
    }
    let gap = |pair: &[usize]| rows[pair[1]].time - rows[pair[0]].time;
    let typical = median(
        indices
            .values()
            .flat_map(|chain| chain.windows(2).map(gap))
            .collect(),
    );
    let gaps = |chain: &[usize]| chain.windows(2).map(|pair| gap(pair) / typical).collect();
    indices
        .into_values()
        .map(|indices| Chain {
            gaps: gaps(&indices),
            indices,
        })
        .collect()
}

/// Correlation of values that are `lag` frames apart.
fn correlation(chains: &[Chain], values: &DVector<f64>, lag: usize) -> f64 {
    let pairs = chains
        .iter()
        .flat_map(|Chain { indices, .. }| indices.iter().zip(&indices[lag.min(indices.len())..]));
    let (product, square) = pairs.fold((0.0, 0.0), |(product, square), (i, k)| {
        (
            product + values[*i] * values[*k],
            square + 0.5 * (values[*i].powi(2) + values[*k].powi(2)),
        )
    });
    if square > 0.0 { product / square } else { 0.0 }
}

/// Sum of the squares of the correlations at all lags, in standard deviations above its mean for
/// white noise.
fn excess(chains: &[Chain], values: &DVector<f64>) -> f64 {
    let count = chains
        .iter()
        .flat_map(|chain| &chain.indices)
        .filter(|i| values[**i] != 0.0)
        .count();
    let lags = LAGS.min(count / LEAST_PER_LAG);
    let squares = (1..=lags).map(|lag| correlation(chains, values, lag).powi(2) * count as f64);
    if lags == 0 {
        0.0
    } else {
        normal_deviate(squares.sum::<f64>() / lags as f64, lags as f64)
    }
}

/// Jᵀ R J with the correlations R of the noise of a series.
fn correlated_square(chains: &[Chain], jacobian: &DMatrix<f64>, noise: RedNoise) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(jacobian.ncols(), jacobian.ncols());
    for Chain { indices, gaps } in chains {
        let own = jacobian.select_rows(indices);
        sum += own.tr_mul(&own);
        if noise != RedNoise::WHITE {
            let mut tails = DMatrix::zeros(own.nrows(), own.ncols());
            for (i, gap) in gaps.iter().enumerate() {
                let tail = (tails.row(i) + own.row(i)) * noise.decay.powf(*gap);
                tails.set_row(i + 1, &tail);
            }
            let cross = own.tr_mul(&tails) * noise.share;
            sum += &cross + cross.transpose();
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn correlations_below_their_uncertainty_are_zero() {
        assert_eq!(significant([0.09, 0.09], 0.1), RedNoise::WHITE);
        assert_eq!(
            significant([0.2, 0.09], 0.1),
            RedNoise {
                share: 1.0,
                decay: 0.2
            }
        );
    }

    /// Rows of one coordinate in frames at times 0, 1, 2, 4.
    #[test]
    fn correlations_decay_with_time() {
        let rows: Vec<_> = [0.0, 1.0, 2.0, 4.0]
            .map(|time| Origin {
                series: 0,
                index: 0,
                time,
            })
            .into();
        let jacobian = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, -1.0, 3.0]);
        let noise = RedNoise {
            share: 0.6,
            decay: 0.5,
        };
        let found = correlated_square(&chains(&rows, 0), &jacobian, noise);
        let mut expected = 0.0;
        for (i, row) in rows.iter().enumerate() {
            for (k, other) in rows.iter().enumerate() {
                let distance = (row.time - other.time).abs();
                let correlation = if i == k {
                    1.0
                } else {
                    noise.share * noise.decay.powf(distance)
                };
                expected += jacobian[i] * correlation * jacobian[k];
            }
        }
        // The error is rounding.
        assert_relative_eq!(found[0], expected, epsilon = 0.0, max_relative = 1e-14);
    }

    /// White noise with a wave of a third of its variance, and a period of 40 frames, is not white.
    #[test]
    fn slow_residuals_below_the_noise_are_distinguished_from_white_noise() {
        let rows: Vec<_> = (0..400)
            .map(|k| Origin {
                series: 0,
                index: 0,
                time: f64::from(k),
            })
            .collect();
        // The signs of a quadratic residue sequence have no correlations.
        let sign = |k: u32| {
            if (k * k % 401).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            }
        };
        let wave = |k: u32| (std::f64::consts::TAU * f64::from(k) / 40.0).sin();
        let excess = |part: f64| {
            let residuals = DVector::from_iterator(400, (0..400).map(|k| sign(k) + part * wave(k)));
            Noise::of(
                &residuals,
                &rows,
                &DMatrix::zeros(400, 0),
                &DMatrix::zeros(0, 0),
            )
            .excess()
        };
        assert!(excess(0.0) < 4.0, "{}", excess(0.0));
        // Correlations of cos(2π lag/40) / 4 at 20 lags have squares with the sum 0.6, and 400
        // residuals times this sum is far above the mean of χ², 20, whose standard deviation is 6.
        assert!(excess((2.0_f64 / 3.0).sqrt()) > 6.0, "{}", excess(0.8));
    }

    /// A slow series of 40 frames, and a second one of 400 frames with white noise of three times
    /// its size.
    #[test]
    fn correlation_and_variance_of_each_series_are_its_own() {
        let row = |series: usize| {
            move |k: u32| Origin {
                series,
                index: 0,
                time: f64::from(k),
            }
        };
        let rows: Vec<_> = (0..40).map(row(0)).chain((0..400).map(row(1))).collect();
        // A wave has the correlation cos 2π/40. The signs of a quadratic residue sequence have
        // none.
        let wave = |k: u32| (std::f64::consts::TAU * f64::from(k) / 40.0).sin();
        let sign = |k: u32| {
            if (k * k % 401).is_multiple_of(2) {
                3.0
            } else {
                -3.0
            }
        };
        let residuals = DVector::from_iterator(440, (0..40).map(wave).chain((0..400).map(sign)));
        let none = DMatrix::zeros(440, 0);
        let found = Noise::of(&residuals, &rows, &none, &DMatrix::zeros(0, 0));
        let [slow, white] = &found.0[..] else {
            panic!("two series")
        };
        // The sums of a wave over a period without its end.
        assert_relative_eq!(slow.variance, 0.5, epsilon = 1e-12);
        assert!(
            slow.lag_one > 0.95 && slow.correlation.spectrum(1.0) > 10.0,
            "{}",
            slow.lag_one
        );
        assert_relative_eq!(white.variance, 9.0, epsilon = 1e-12);
        assert!(
            white.correlation == RedNoise::WHITE,
            "{:?}",
            white.correlation
        );
    }
}
