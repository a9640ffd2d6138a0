//! The wavelet scalogram of a path, and its ridge.

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector2};

use super::background::Background;
use super::ellipse::Ellipse;
use super::wavelet::{Sampling, gain, period_over_scale, transform};

/// Scales in an octave: the parabola through three of them has its top within 1e-3 of the period of a wave.
const PER_OCTAVE: f64 = 16.0;
/// By how much scales reach beyond the band on both sides: a wave outside it must have its top there, not inside.
const BEYOND: f64 = 1.25;
/// A ridge is told from white noise if its power is so many times that of noise: noise in one coordinate is, in one place of twenty.
const TOLD: f64 = 3.0;
/// Octaves after which powers are independent of each other, for ω0 = 6 (δj0 of Torrence and Compo 1998, table 2).
const OCTAVES_APART: f64 = 0.6;
/// The decorrelation factor γ of the same table: scales after which powers are independent in time.
const SCALES_APART: f64 = 2.32;

/// Power by time and period, of Morlet's wavelet with ω0 = 6, as Torrence and Compo (1998) define it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Scalogram {
    /// Times, s; evenly spaced between gaps.
    pub times: Vec<f64>,
    /// Fourier periods of the scales, s, increasing; 1.033 scales each. They reach a little beyond the band on both sides.
    pub periods: Vec<f64>,
    /// |W|²/σ² by period and then by time, the mean of both coordinates: 1 on average for white noise. σ² is the variance of the path
    /// without its drift.
    pub power: Vec<Vec<f64>>,
    /// Whether a place lies outside the cone of influence of both ends and of every gap, in the order of `power`.
    pub outside_cone: Vec<Vec<bool>>,
}

/// A place on the ridge: the period of largest power at a time. Power grows with the square of the amplitude and with the period, so of two
/// equal amplitudes the slower one has the ridge.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RidgePoint {
    /// Time, s.
    pub time: f64,
    /// Period, s.
    pub period: f64,
    /// The ellipse that the tip goes round in this period. Its sense is `None` unless the semi-minor axis exceeds three standard errors that
    /// noise at the noise floor leaves at this time.
    pub ellipse: Ellipse,
}

/// A scalogram, and what its ridge is sought in.
pub(super) struct Analysis {
    pub scalogram: Scalogram,
    scales: Vec<f64>,
    /// By scale and time, the waves, and their squared size times the scale: largest on the ridge.
    waves: Vec<Vec<Vector2<Complex<f64>>>>,
    strength: Vec<Vec<f64>>,
    /// By scale and time, the mean of |wave|² for a coordinate that is white noise of variance 1.
    noise: Vec<Vec<f64>>,
    variance: f64,
    /// Variance of a coordinate of the rest without oscillations.
    left: f64,
    /// Spectrum of white and red noise with the autocorrelation of the rest.
    background: Background,
    band: [f64; 2],
    every: f64,
}

/// A place of the ridge among scales and times, its period (s), and the wave there: its real part is the position.
pub(super) struct Place {
    pub time: usize,
    scale: usize,
    pub period: f64,
    pub wave: Vector2<Complex<f64>>,
    /// Standard error that white noise leaves to the parts of the wave.
    pub error: f64,
}

impl Analysis {
    /// Looks at positions without drift for periods in a band.
    pub fn new(
        sampling: &Sampling,
        positions: &[Vector2<f64>],
        rest: &[Vector2<f64>],
        variance: f64,
        band: [f64; 2],
    ) -> Self {
        let lowest = (band[0] / BEYOND).max(2.0 * sampling.interval);
        let octaves = (BEYOND * band[1] / lowest).log2();
        let count = (octaves * PER_OCTAVE).ceil() as usize + 1;
        let step = octaves / (count - 1) as f64;
        let periods: Vec<f64> = (0..count).map(|j| lowest * (step * j as f64).exp2()).collect();
        let scales: Vec<f64> = periods.iter().map(|period| period / period_over_scale()).collect();
        let times = sampling.instants();
        let (mut power, mut waves, mut strength, mut outside_cone) = (vec![], vec![], vec![], vec![]);
        let mut noise = vec![];
        for scale in &scales {
            let answer = transform(sampling, positions, *scale);
            let squares: Vec<f64> = answer.waves.iter().map(|wave| wave[0].norm_sqr() + wave[1].norm_sqr()).collect();
            let ratio = |(square, noise): (&f64, &f64)| {
                let expected = 2.0 * variance * noise;
                if expected > 0.0 { square / expected } else { 0.0 }
            };
            power.push(squares.iter().zip(&answer.noise).map(ratio).collect());
            strength.push(squares.iter().map(|square| square * scale).collect());
            outside_cone.push(sampling.outside_cone(*scale, &times));
            waves.push(answer.waves);
            noise.push(answer.noise);
        }
        let background = Background::of(sampling.times, rest);
        let left = rest.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * rest.len()) as f64;
        let scalogram = Scalogram { times, periods, power, outside_cone };
        Self { scalogram, scales, waves, strength, noise, variance, left, background, band, every: sampling.every }
    }

    /// The ridge: the places where the power is largest in the band and more than white noise has, outside the cone. The variance of noise is
    /// that of all if it is not known.
    pub fn ridge(&self, noise: Option<f64>) -> Vec<Place> {
        let noise = noise.unwrap_or(self.variance);
        let least = TOLD * (noise / self.variance).min(1.0);
        let Scalogram { times, periods, power, outside_cone } = &self.scalogram;
        let top = |k: usize| {
            let height = |j: usize| self.strength[j][k];
            let inside = |j: &usize| (self.band[0]..=self.band[1]).contains(&periods[*j]);
            let highest = |j: &usize| height(*j) >= height(j - 1) && height(*j) > height(j + 1);
            let tops = (1..periods.len() - 1).filter(inside).filter(highest);
            let j = tops.max_by(|a, b| height(*a).total_cmp(&height(*b)))?;
            if !outside_cone[j][k] || !(power[j][k] >= least) || power[j][k] == 0.0 {
                return None;
            }
            let [a, b, c] = [j - 1, j, j + 1].map(|j| height(j).ln());
            let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
            // Of a flat top no place is better than another.
            let shift = if shift.is_finite() { shift.clamp(-0.5, 0.5) } else { 0.0 };
            let period = periods[j] * (periods[j + 1] / periods[j]).powf(shift);
            let size = gain(self.scales[j], period).recip();
            // Half of |wave|² is that of its real part.
            let error = size * (0.5 * noise * self.noise[j][k]).sqrt();
            Some(Place { time: k, scale: j, period, wave: self.waves[j][k].map(|z| z * size), error })
        };
        (0..times.len()).filter_map(top).collect()
    }

    /// The probability that noise with the variance and the autocorrelation of the rest has as much power, averaged over time, as one of the scales on
    /// a ridge; the noise has a number of independent `coordinates` (1 to 2).
    pub fn chance(&self, ridge: &[Place], coordinates: f64) -> f64 {
        let tried = ((self.band[1] / self.band[0]).log2() / OCTAVES_APART).max(1.0);
        let mut scales: Vec<usize> = ridge.iter().map(|place| place.scale).collect();
        scales.sort_unstable();
        scales.dedup();
        let chance = |j: usize| {
            let Scalogram { periods, power, outside_cone, .. } = &self.scalogram;
            let seen: Vec<f64> =
                power[j].iter().zip(&outside_cone[j]).filter(|(_, out)| **out).map(|(p, _)| *p).collect();
            let background = self.background.at(TAU / periods[j]) * self.left / self.variance;
            let mean = seen.iter().sum::<f64>() / (seen.len().max(1) as f64 * background);
            let apart = seen.len() as f64 * self.every / decorrelation(periods[j]);
            // Equation (23) of Torrence and Compo (1998), for each coordinate.
            tail(mean, 2.0 * coordinates * (1.0 + apart * apart).sqrt())
        };
        scales.into_iter().map(chance).fold(1.0, f64::min) * tried
    }
}

/// Time (s) after which wavelet powers at a period (s) are independent of each other.
pub(super) fn decorrelation(period: f64) -> f64 {
    SCALES_APART * period / period_over_scale()
}

/// The chance that χ² of so many degrees of freedom is so many times its mean or more; by Wilson's and Hilferty's cube root, above the
/// mean a bound from above.
fn tail(ratio: f64, freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    let z = (ratio.cbrt() - (1.0 - variance)) / variance.sqrt();
    // Mills's bound of the tail of a normal distribution.
    if z > 1.0 { (-0.5 * z * z).exp() / (z * TAU.sqrt()) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A coordinate is sampled over √99 decorrelation times. By equation (23) of Torrence and Compo (1998) its mean power then has
    /// twenty degrees of freedom, and that of two coordinates has forty.
    #[test]
    fn mean_power_has_the_degrees_of_freedom_of_torrence_and_compo() {
        let count = 1000;
        let every = 99f64.sqrt() * SCALES_APART / count as f64;
        let scalogram = Scalogram {
            times: (0..count).map(|k| every * k as f64).collect(),
            periods: vec![period_over_scale()],
            power: vec![vec![2.0; count]],
            outside_cone: vec![vec![true; count]],
        };
        let (scales, waves, strength, noise) = (vec![1.0], vec![], vec![], vec![]);
        let (background, band) = (Background::WHITE, [1.0, 1.0]);
        let analysis =
            Analysis { scalogram, scales, waves, strength, noise, variance: 1.0, left: 1.0, background, band, every };
        let ridge = [Place { time: 0, scale: 0, period: 1.0, wave: Vector2::zeros(), error: 0.0 }];
        // The probabilities of twice the mean are from tables of the χ² distribution. The bound that is computed exceeds them by
        // 14 % and 12 %.
        assert_relative_eq!(analysis.chance(&ridge, 1.0), 0.004_995, epsilon = 0.0, max_relative = 0.15);
        assert_relative_eq!(analysis.chance(&ridge, 2.0), 0.000_176_3, epsilon = 0.0, max_relative = 0.15);
    }
}
