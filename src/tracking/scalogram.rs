//! Wavelet scalogram of a tip track, and its ridge.

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector2};

use super::background::Background;
use super::ellipse::Ellipse;
use super::statistics::{chosen, normal_deviate};
use super::wavelet::{Sampling, Transform, gain, period_over_scale, transform};
use crate::numerics::scalar::vertex;

/// Factor by which scales reach beyond the band on both sides, so that waves outside the band have
/// their maxima there.
const BEYOND: f64 = 1.25;

/// Wavelet power by time and period, with the Morlet wavelet of ω0 = 6, as defined by Torrence and
/// Compo (1998).
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Scalogram {
    /// Times, s, evenly spaced between gaps.
    pub times: Vec<f64>,
    /// Fourier periods of the scales, s, increasing: 1.033 scales each. They reach beyond the band
    /// by a quarter on both sides.
    pub periods: Vec<f64>,
    /// Power |W|²/σ² by period and then by time, averaged over both coordinates: 1 on average for
    /// white noise. σ² is the variance of the track without its drift.
    pub power: Vec<Vec<f64>>,
    /// Whether a place lies outside the cones of influence of both ends and of every gap, in the
    /// order of `power`.
    pub outside_cone: Vec<Vec<bool>>,
}

/// A place on the ridge: the period of largest power at a time. Power is proportional to the square
/// of the amplitude and to the period: the slower of two waves with equal amplitudes has the ridge.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RidgePoint {
    /// Time, s.
    pub time: f64,
    /// Period, s.
    pub period: f64,
    /// The ellipse of the motion with this period. Its sense is `None` unless the semi-minor axis
    /// exceeds three standard errors of noise at the noise floor.
    pub ellipse: Ellipse,
}

/// A scalogram with the quantities from which its ridge is determined.
pub(super) struct Analysis {
    pub scalogram: Scalogram,
    scales: Vec<f64>,
    /// The transform at each scale.
    transforms: Vec<Transform>,
    /// Variance of a coordinate without drift.
    variance: f64,
    /// Variance of a coordinate of the residual without oscillations.
    rest_variance: f64,
    /// Spectrum of white and red noise with the autocorrelation of that residual.
    background: Background,
    band: [f64; 2],
    every: f64,
}

/// A place of the ridge: indices of time and scale, period (s), and the analytic signal, whose real
/// part is the position.
pub(super) struct RidgePlace {
    pub time: usize,
    scale: usize,
    pub period: f64,
    pub wave: Vector2<Complex<f64>>,
    /// Standard error of the real and of the imaginary part of the wave in white noise.
    pub error: f64,
}

impl Analysis {
    /// Transforms positions without drift for periods in a band. `rest` is the residual without
    /// oscillations.
    pub fn new(
        sampling: &Sampling,
        [positions, rest]: [&[Vector2<f64>]; 2],
        variance: f64,
        band: [f64; 2],
    ) -> Self {
        let lowest = (band[0] / BEYOND).max(2.0 * sampling.interval);
        let octaves = (BEYOND * band[1] / lowest).log2();
        // With 16 scales in an octave the vertex of the parabola through three of them has a
        // relative error below 1e-3 in the period of a wave.
        let count = (16.0 * octaves).ceil() as usize + 1;
        let step = octaves / (count - 1) as f64;
        let periods: Vec<f64> = (0..count)
            .map(|j| lowest * (step * j as f64).exp2())
            .collect();
        let scales: Vec<f64> = periods
            .iter()
            .map(|period| period / period_over_scale())
            .collect();
        let times = sampling.instants();
        let ratio = |(wave, noise): (&Vector2<Complex<f64>>, &f64)| {
            let expected = 2.0 * variance * noise;
            if expected > 0.0 {
                wave.norm_squared() / expected
            } else {
                0.0
            }
        };
        let transforms: Vec<_> = scales
            .iter()
            .map(|scale| transform(sampling, positions, *scale))
            .collect();
        let power = transforms
            .iter()
            .map(|at| at.waves.iter().zip(&at.noise).map(ratio).collect())
            .collect();
        let outside_cone = scales
            .iter()
            .map(|scale| sampling.outside_cone(*scale, &times))
            .collect();
        let background = Background::of(sampling.times, rest);
        let rest_variance =
            rest.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * rest.len()) as f64;
        let scalogram = Scalogram {
            times,
            periods,
            power,
            outside_cone,
        };
        let every = sampling.every;
        Self {
            scalogram,
            scales,
            transforms,
            variance,
            rest_variance,
            background,
            band,
            every,
        }
    }

    /// The ridge: the places of largest power in the band that exceed white noise and lie outside
    /// the cones of influence. The variance of the noise is that of the track if it is not known.
    pub fn ridge(&self, noise: Option<f64>) -> Vec<RidgePlace> {
        let noise = noise.unwrap_or(self.variance);
        // White noise in one coordinate has three times its mean power with probability e⁻³ = 5 %.
        let least = 3.0 * (noise / self.variance).min(1.0);
        let Scalogram {
            times,
            periods,
            power,
            outside_cone,
        } = &self.scalogram;
        let top = |k: usize| {
            // The power |W|² of Torrence and Compo (1998) is proportional to the scale.
            let height = |j: usize| self.transforms[j].waves[k].norm_squared() * self.scales[j];
            let inside = |j: &usize| (self.band[0]..=self.band[1]).contains(&periods[*j]);
            let highest = |j: &usize| height(*j) >= height(j - 1) && height(*j) > height(j + 1);
            let tops = (1..periods.len() - 1).filter(inside).filter(highest);
            let j = tops.max_by(|a, b| height(*a).total_cmp(&height(*b)))?;
            if !outside_cone[j][k] || !(power[j][k] >= least) || power[j][k] == 0.0 {
                return None;
            }
            let shift = vertex([j - 1, j, j + 1].map(|j| height(j).ln()));
            // A flat maximum has no vertex.
            let shift = if shift.is_finite() {
                shift.clamp(-0.5, 0.5)
            } else {
                0.0
            };
            let period = periods[j] * (periods[j + 1] / periods[j]).powf(shift);
            let size = gain(self.scales[j], period).recip();
            // The real part has half of |wave|².
            let error = size * (0.5 * noise * self.transforms[j].noise[k]).sqrt();
            Some(RidgePlace {
                time: k,
                scale: j,
                period,
                wave: self.transforms[j].waves[k].map(|z| z * size),
                error,
            })
        };
        (0..times.len()).filter_map(top).collect()
    }

    /// The probability that noise with the variance and the autocorrelation of the residual has as
    /// much power, averaged over time, as one of the scales on a ridge. The noise has a number of
    /// independent `coordinates` (1 to 2).
    pub fn chance(&self, ridge: &[RidgePlace], coordinates: f64) -> f64 {
        // Powers 0.6 octaves apart are independent (δj0 of Torrence and Compo 1998, table 2).
        let tried = ((self.band[1] / self.band[0]).log2() / 0.6).max(1.0);
        let mut scales: Vec<usize> = ridge.iter().map(|place| place.scale).collect();
        scales.sort_unstable();
        scales.dedup();
        let chance = |j: usize| {
            let Scalogram {
                periods,
                power,
                outside_cone,
                ..
            } = &self.scalogram;
            let seen = chosen(&power[j], &outside_cone[j]);
            let background =
                self.background.at(TAU / periods[j]) * self.rest_variance / self.variance;
            let mean = seen.iter().sum::<f64>() / (seen.len().max(1) as f64 * background);
            let apart = seen.len() as f64 * self.every / decorrelation(periods[j]);
            // Equation (23) of Torrence and Compo (1998), for each coordinate.
            tail(mean, 2.0 * coordinates * (1.0 + apart * apart).sqrt())
        };
        scales.into_iter().map(chance).fold(1.0, f64::min) * tried
    }
}

/// Time (s) after which wavelet powers at a period (s) are independent: the decorrelation factor γ
/// of Torrence and Compo (1998, table 2) is 2.32 scales.
pub(super) fn decorrelation(period: f64) -> f64 {
    2.32 * period / period_over_scale()
}

/// The probability that χ² with given degrees of freedom exceeds its mean by a `ratio`. Above the
/// mean it is an upper bound.
fn tail(ratio: f64, freedom: f64) -> f64 {
    let z = normal_deviate(ratio, freedom);
    // Bound of Mills for the tail of a normal distribution.
    if z > 1.0 {
        (-0.5 * z * z).exp() / (z * TAU.sqrt())
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A coordinate is sampled over √99 decorrelation times. By equation (23) of Torrence and Compo
    /// (1998) its mean power then has twenty degrees of freedom, and that of two coordinates has
    /// forty.
    #[test]
    fn mean_power_has_the_degrees_of_freedom_of_torrence_and_compo() {
        let count = 1000;
        let every = 99f64.sqrt() * decorrelation(period_over_scale()) / count as f64;
        let scalogram = Scalogram {
            times: (0..count).map(|k| every * k as f64).collect(),
            periods: vec![period_over_scale()],
            power: vec![vec![2.0; count]],
            outside_cone: vec![vec![true; count]],
        };
        let (scales, transforms) = (vec![1.0], vec![]);
        let (background, band) = (Background::WHITE, [1.0, 1.0]);
        let analysis = Analysis {
            scalogram,
            scales,
            transforms,
            variance: 1.0,
            rest_variance: 1.0,
            background,
            band,
            every,
        };
        let ridge = [RidgePlace {
            time: 0,
            scale: 0,
            period: 1.0,
            wave: Vector2::zeros(),
            error: 0.0,
        }];
        // The probabilities of twice the mean are from tables of the χ² distribution. The bound
        // that is computed exceeds them by 14 % and 12 %.
        assert_relative_eq!(
            analysis.chance(&ridge, 1.0),
            0.004_995,
            epsilon = 0.0,
            max_relative = 0.15
        );
        assert_relative_eq!(
            analysis.chance(&ridge, 2.0),
            0.000_176_3,
            epsilon = 0.0,
            max_relative = 0.15
        );
    }
}
