//! Spectrum of the noise of a tip track: white noise, or white and red noise.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::red_noise::RedNoise;
use super::statistics::{SIGNIFICANT, resolved_interval};
use crate::numerics::sines::sines;

/// Largest correlation of successive values. Red noise with this correlation is a random walk on
/// all tracks shorter than a million intervals.
const LARGEST: f64 = 1.0 - 1e-6;
/// Distance of a neighbouring frequency, in turns over the whole track. The fit of a wave affects
/// nearer ones.
const APART: f64 = 2.0;
/// Largest number of neighbouring frequencies: a geometric mean of twelve has a standard error of a
/// fifth. A third of them is enough, and a third more are examined on either side.
const NEIGHBOURS: usize = 12;

/// Spectrum of noise over that of white noise with the same variance. Intervals without a lost
/// frame have the correlations of red noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Background {
    noise: RedNoise,
    /// Median interval, in the unit of the times.
    interval: f64,
}

impl Background {
    /// White noise.
    pub const WHITE: Self = Self {
        noise: RedNoise::WHITE,
        interval: 0.0,
    };

    /// Estimates the spectrum from the autocorrelation of a residual at lags of one and two
    /// intervals. Time differences are rounded to multiples of the median interval.
    pub fn of(times: &[f64], residual: &[Vector2<f64>]) -> Self {
        let interval = resolved_interval(times);
        let variance =
            residual.iter().map(Vector2::norm_squared).sum::<f64>() / residual.len().max(1) as f64;
        // Each lag has the sum of the products of its pairs, and their number.
        let mut sums = [(0.0, 0.0); 2];
        for (i, k) in (1..=2).flat_map(|back| (back..times.len()).map(move |k| (k - back, k))) {
            let lag = ((times[k] - times[i]) / interval).round();
            let Some((sum, count)) = [1.0, 2.0]
                .iter()
                .position(|at| *at == lag)
                .map(|at| &mut sums[at])
            else {
                continue;
            };
            *sum += residual[k].dot(&residual[i]);
            *count += 1.0;
        }
        let correlation = |(sum, count): (f64, f64)| {
            if count > 0.0 && variance > 0.0 {
                sum / (count * variance)
            } else {
                0.0
            }
        };
        let [first, second] = sums.map(correlation);
        let pairs = sums[0].1;
        // The standard error in white noise: each pair has two coordinates.
        if !(first > SIGNIFICANT / (2.0 * pairs).sqrt()) {
            return Self::WHITE;
        }
        let noise = RedNoise::of([first, second], LARGEST);
        // Lost frames spread the power evenly over all frequencies, in proportion to their number.
        let regular = times
            .windows(2)
            .filter(|pair| ((pair[1] - pair[0]) / interval).round() == 1.0)
            .count();
        let regular = regular as f64 / (times.len() - 1) as f64;
        Self {
            noise: RedNoise {
                share: regular * noise.share,
                ..noise
            },
            interval,
        }
    }

    /// The spectrum at an angular frequency, in the inverse unit of the times.
    pub fn at(&self, omega: f64) -> f64 {
        self.noise.spectrum((omega * self.interval).cos())
    }

    /// The smallest value of the spectrum: that at the Nyquist frequency.
    pub fn least(&self) -> f64 {
        self.noise.spectrum(-1.0)
    }

    /// The variance of white noise with the power of a residual near an angular frequency; `None`
    /// with fewer than four free frequencies.
    ///
    /// The power is evaluated at neighbouring frequencies, one turn over the whole track apart.
    /// They differ by two turns or more from the given one and from those of fitted `waves`, where
    /// the fit has removed power. The spectrum of the background converts the power to the given
    /// frequency. The times reach from −1 to 1. The variance is the geometric mean, which the
    /// nearest frequency of a steep spectrum does not dominate. A factor accounts for the number of
    /// frequencies: with it, 1.64 standard errors are Student's quantile for 90 %.
    pub fn level(
        &self,
        times: &[f64],
        rest: &[Vector2<f64>],
        omega: f64,
        waves: &[f64],
        lowest: f64,
    ) -> Option<f64> {
        let highest = PI / resolved_interval(times);
        let apart = |omega: &f64| waves.iter().all(|wave| (omega - wave).abs() >= APART * PI);
        let distances = (0..NEIGHBOURS + NEIGHBOURS / 3).map(|j| PI * (APART + j as f64));
        let beside = distances.flat_map(|distance| [omega - distance, omega + distance]);
        let (mut logarithms, mut count) = (0.0, 0.0);
        let (mut sine, mut cosine) = (vec![0.0; times.len()], vec![0.0; times.len()]);
        for other in beside
            .filter(|omega| (lowest..highest).contains(omega))
            .filter(apart)
            .take(NEIGHBOURS)
        {
            sines(other, times, &mut sine, &mut cosine);
            let along = |wave: &[f64]| {
                rest.iter()
                    .zip(wave)
                    .map(|(rest, x)| rest * *x)
                    .sum::<Vector2<f64>>()
            };
            // The squares of the cosine and of the sine add up to one in each coordinate.
            let power = (along(&cosine).norm_squared() + along(&sine).norm_squared())
                / (2.0 * times.len() as f64);
            // The power is χ² with four degrees of freedom: the logarithm of its mean exceeds the
            // mean of its logarithm by ln 2 − ψ(2).
            logarithms += (power * self.at(omega) / self.at(other)).ln() + 0.270_363;
            count += 1.0;
        }
        // Degrees of freedom of the geometric mean over the number of frequencies, 2/(π²/6 − 1):
        // the logarithms have the variance ψ'(2) = π²/6 − 1.
        let freedom = 3.101 * count;
        // The quantile of Student's distribution with ν degrees of freedom over the normal one is 1
        // + (z² + 1)/4ν + O(1/ν²), with z = 1.645.
        let student = 1.0 + 0.926 / freedom;
        (count >= (NEIGHBOURS / 3) as f64).then(|| f64::exp(logarithms / count) * student.powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// An autoregressive process of zero mean with innovations from a linear congruential
    /// generator.
    fn red_noise(correlation: f64, count: usize) -> (Vec<f64>, Vec<Vector2<f64>>) {
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut value = Vector2::zeros();
        let next = |_| {
            value = value * correlation + Vector2::new(uniform(), uniform());
            value
        };
        (
            (0..count).map(|k| 2.0 * k as f64).collect(),
            (0..count).map(next).collect(),
        )
    }

    #[test]
    fn spectrum_of_autoregressive_noise_is_that_of_torrence_and_compo() {
        let (times, noise) = red_noise(0.8, 100_000);
        let found = Background::of(&times, &noise);
        // At frequency zero the spectrum is (1 + 0.8)/(1 − 0.8) = 9, at the Nyquist frequency its
        // inverse. The correlation has a standard error of √((1 − 0.8²)/2e5) = 1.3e-3, which
        // changes the spectrum at zero by 0.07.
        assert_abs_diff_eq!(found.noise.decay, 0.8, epsilon = 6e-3);
        assert_abs_diff_eq!(found.at(0.0), 9.0, epsilon = 0.35);
        assert_abs_diff_eq!(
            found.at(std::f64::consts::FRAC_PI_2),
            1.0 / 9.0,
            epsilon = 0.015
        );
    }

    #[test]
    fn spectrum_of_white_noise_is_flat() {
        let (times, noise) = red_noise(0.0, 1000);
        let found = Background::of(&times, &noise);
        assert_eq!([found.at(0.0), found.at(0.3), found.at(1.5)], [1.0; 3]);
        let still = Background::of(&times, &vec![Vector2::zeros(); 1000]);
        assert_eq!(still.at(0.0), 1.0);
    }
}
