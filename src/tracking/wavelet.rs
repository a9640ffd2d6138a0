//! Continuous wavelet transform with the Morlet wavelet, a wave times a Gaussian.

use std::f64::consts::{PI, SQRT_2, TAU};

use nalgebra::{Complex, Vector2};

use super::track::whole_steps;

/// Angular frequency of the wave at scale 1, ω0, for which Torrence and Compo (1998) tabulate the
/// properties of the wavelet.
pub(super) const OMEGA: f64 = 6.0;
/// Width of the cone of influence on one side over the scale: the power of a jump has fallen by the
/// factor e² there (Torrence and Compo 1998, table 1).
pub(super) const CONE: f64 = SQRT_2;
/// Length of a gap at a period, over the period. Linear interpolation across it has an error of up
/// to 0.3 amplitudes.
const GAP: f64 = 0.25;
/// Shortest gap, in median intervals: one lost frame is not a gap.
const USUAL: f64 = 2.5;

/// Fourier period of a scale over the scale, 4π/(ω0 + √(2 + ω0²)) = 1.033 (Torrence and Compo 1998,
/// table 1). The power of a wave is largest at the scale with its period.
pub(super) fn period_over_scale() -> f64 {
    4.0 * PI / (OMEGA + (2.0 + OMEGA * OMEGA).sqrt())
}

/// Sampling times of a track, and the evenly spaced instants at which the transform is evaluated.
pub(super) struct Sampling<'a> {
    pub times: &'a [f64],
    /// The median interval, s.
    pub interval: f64,
    /// Time between instants, s.
    pub every: f64,
    pub stretches: Vec<Stretch>,
}

/// Evenly spaced instants between two gaps.
pub(super) struct Stretch {
    /// Index of the first instant among all instants.
    pub offset: usize,
    /// Time of the first instant, s.
    pub start: f64,
    pub count: usize,
}

impl<'a> Sampling<'a> {
    /// Instants `every` given time (s) between the gaps at the period `shortest`.
    pub fn new(times: &'a [f64], interval: f64, every: f64, shortest: f64) -> Self {
        let mut sampling = Self {
            times,
            interval,
            every,
            stretches: Vec::new(),
        };
        let mut offset = 0;
        for [from, to] in sampling.parts(shortest) {
            let count = whole_steps(to - from, every) + 1;
            sampling.stretches.push(Stretch {
                offset,
                start: from,
                count,
            });
            offset += count;
        }
        sampling
    }

    /// Length above which an interval is a gap at a period, s.
    fn shortest_gap(&self, period: f64) -> f64 {
        (GAP * period).max(USUAL * self.interval)
    }

    /// First and last times of the parts without a gap at a period.
    pub fn parts(&self, period: f64) -> Vec<[f64; 2]> {
        let parts = self
            .times
            .chunk_by(|a, b| b - a <= self.shortest_gap(period));
        parts.map(|part| [part[0], part[part.len() - 1]]).collect()
    }

    /// All instants, s.
    pub fn instants(&self) -> Vec<f64> {
        let at = |stretch: &Stretch, k: usize| stretch.start + self.every * k as f64;
        self.stretches
            .iter()
            .flat_map(|stretch| (0..stretch.count).map(move |k| at(stretch, k)))
            .collect()
    }

    /// Returns for each instant whether it lies outside the cones of influence of both ends and of
    /// every gap at a scale.
    pub fn outside_cone(&self, scale: f64, instants: &[f64]) -> Vec<bool> {
        let cone = CONE * scale;
        let parts = self.parts(scale * period_over_scale());
        let clear = |t: &f64| {
            let part = parts.get(parts.partition_point(|[_, to]| to < t));
            part.is_some_and(|[from, to]| t - from >= cone && to - t >= cone)
        };
        instants.iter().map(clear).collect()
    }

    /// Weights of the samples at a period (s): half of both neighbouring intervals, of which gaps
    /// count only to their shortest length.
    pub fn weights(&self, period: f64) -> Vec<f64> {
        let most = 0.5 * self.shortest_gap(period);
        let n = self.times.len();
        let half = |i: usize| (0.5 * (self.times[i + 1] - self.times[i])).min(most);
        // The first and the last sample have one neighbouring interval.
        (0..n)
            .map(|i| {
                (i.saturating_sub(1)..(i + 1).min(n.saturating_sub(1)))
                    .map(half)
                    .sum()
            })
            .collect()
    }
}

/// Response of the transform at a scale (s) to a wave with a period (s) and amplitude 1.
pub(super) fn gain(scale: f64, period: f64) -> f64 {
    (-0.5 * (TAU * scale / period - OMEGA).powi(2)).exp()
}

/// The transform at one scale, at every instant.
pub(super) struct Transform {
    /// Analytic signal: that of a wave A cos ωt is A exp(iωt) times the [`gain`].
    pub waves: Vec<Vector2<Complex<f64>>>,
    /// Mean of |waves|² for a coordinate of white noise with variance 1.
    pub noise: Vec<f64>,
}

/// The transform of positions at a scale (s).
///
/// The values of the Gaussian at evenly spaced instants follow from one another by two products.
/// Sums are divided by the sum of the weights: a wave keeps its amplitude where a part of the
/// Gaussian lies beyond an end.
pub(super) fn transform(sampling: &Sampling, positions: &[Vector2<f64>], scale: f64) -> Transform {
    let total = sampling
        .stretches
        .last()
        .map_or(0, |last| last.offset + last.count);
    let mut waves = vec![Vector2::from_element(Complex::ZERO); total];
    let (mut noise, mut whole) = (vec![0.0; total], vec![0.0; total]);
    let weights = sampling.weights(scale * period_over_scale());
    // The Gaussian is truncated at four scales; 6e-5 of its integral lie beyond.
    let (omega, every, reach) = (OMEGA / scale, sampling.every, 4.0 * scale);
    let origin = sampling.times.first().copied().unwrap_or(0.0);
    let slower = (-(every / scale).powi(2)).exp();
    for ((t, position), weight) in sampling.times.iter().zip(positions).zip(&weights) {
        let turned = Complex::cis(-omega * (t - origin)) * weight;
        let turned = position.map(|x| turned * x);
        let squared = weight * weight;
        let begin = sampling
            .stretches
            .partition_point(|s| s.start + every * s.count as f64 <= t - reach);
        for stretch in sampling.stretches[begin..]
            .iter()
            .take_while(|s| s.start <= t + reach)
        {
            let place = |time: f64| ((time - stretch.start) / every).max(0.0);
            let first = place(t - reach).ceil() as usize;
            let end = (place(t + reach).floor() as usize + 1).min(stretch.count);
            let away = (stretch.start + every * first as f64 - t) / scale;
            let mut gauss = (-0.5 * away * away).exp();
            let mut ratio = (-(away + 0.5 * every / scale) * every / scale).exp();
            for k in stretch.offset + first..stretch.offset + end.max(first) {
                waves[k] += turned.map(|z| z * gauss);
                noise[k] += squared * gauss * gauss;
                whole[k] += weight * gauss;
                gauss *= ratio;
                ratio *= slower;
            }
        }
    }
    for (k, t) in sampling.instants().into_iter().enumerate() {
        let size = if whole[k] > 0.0 { 2.0 / whole[k] } else { 0.0 };
        let forth = Complex::cis(omega * (t - origin)) * size;
        waves[k] = waves[k].map(|z| z * forth);
        noise[k] *= size * size;
    }
    Transform { waves, noise }
}
