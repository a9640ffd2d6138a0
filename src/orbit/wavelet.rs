//! Morlet's wavelet, at one scale: a Gaussian that is moved along the path, times a wave.

use std::f64::consts::{PI, SQRT_2, TAU};

use nalgebra::{Complex, Vector2};

/// Turns of the wave under the Gaussian: ω0, for which Torrence and Compo (1998) give their numbers.
pub(super) const OMEGA: f64 = 6.0;
/// The Gaussian reaches so many scales: beyond lie 6e-5 of it.
const REACH: f64 = 4.0;
/// An interval longer than this part of a period is a gap at that period: across it a straight line misses up to 0.3 of an amplitude.
const GAP: f64 = 0.25;
/// No interval is a gap that is shorter than so many median intervals: a frame may be lost.
const USUAL: f64 = 2.5;

/// The Fourier period of a scale over the scale, 4π/(ω0 + √(2 + ω0²)) = 1.033 (Torrence and Compo 1998, table 1): at a period the power
/// is largest for this scale.
pub(super) fn period_over_scale() -> f64 {
    4.0 * PI / (OMEGA + (2.0 + OMEGA * OMEGA).sqrt())
}

/// Where a path is sampled, and the even instants at which it is looked at.
pub(super) struct Sampling<'a> {
    pub times: &'a [f64],
    /// The median interval, s.
    pub interval: f64,
    /// Between instants, s.
    pub every: f64,
    pub stretches: Vec<Stretch>,
}

/// Instants without a gap between them.
pub(super) struct Stretch {
    /// Place of its first one among all.
    pub offset: usize,
    /// Time of its first one, s.
    pub start: f64,
    pub count: usize,
}

/// Whether an interval is a gap at a period.
fn is_gap(interval: f64, period: f64, usual: f64) -> bool {
    interval > (GAP * period).max(USUAL * usual)
}

impl<'a> Sampling<'a> {
    /// Instants `every` so many seconds between gaps, for periods from `shortest` on.
    pub fn new(times: &'a [f64], interval: f64, every: f64, shortest: f64) -> Self {
        let mut sampling = Self { times, interval, every, stretches: Vec::new() };
        let mut offset = 0;
        for [from, to] in sampling.parts(shortest) {
            let count = ((to - from) / every * (1.0 + 4.0 * f64::EPSILON)).floor() as usize + 1;
            sampling.stretches.push(Stretch { offset, start: from, count });
            offset += count;
        }
        sampling
    }

    /// First and last times of what has no gap at a period.
    pub fn parts(&self, period: f64) -> Vec<[f64; 2]> {
        let (Some(first), Some(last)) = (self.times.first(), self.times.last()) else { return Vec::new() };
        let mut edges = vec![*first];
        for pair in self.times.windows(2).filter(|pair| is_gap(pair[1] - pair[0], period, self.interval)) {
            edges.extend([pair[0], pair[1]]);
        }
        edges.push(*last);
        edges.chunks(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// All instants, s.
    pub fn instants(&self) -> Vec<f64> {
        let at = |stretch: &Stretch, k: usize| stretch.start + self.every * k as f64;
        self.stretches.iter().flat_map(|stretch| (0..stretch.count).map(move |k| at(stretch, k))).collect()
    }

    /// Which instants lie outside the cone of influence of a scale: at least √2 scales from both ends and from every gap, so that the
    /// power of a jump there has fallen by e² (Torrence and Compo 1998, table 1).
    pub fn outside_cone(&self, scale: f64, instants: &[f64]) -> Vec<bool> {
        let cone = SQRT_2 * scale;
        let parts = self.parts(scale * period_over_scale());
        let mut part = 0;
        let clear = |t: &f64| {
            while part + 1 < parts.len() && parts[part][1] < *t {
                part += 1;
            }
            parts.get(part).is_some_and(|[from, to]| t - from >= cone && to - t >= cone)
        };
        instants.iter().map(clear).collect()
    }

    /// The time that each sample stands for at a period, s: half of both intervals beside it, as far as they are no gaps.
    pub fn weights(&self, period: f64) -> Vec<f64> {
        let most = 0.5 * (GAP * period).max(USUAL * self.interval);
        let n = self.times.len();
        let half = |i: usize| (0.5 * (self.times[i + 1] - self.times[i])).min(most);
        // Before the first and behind the last one there is none.
        (0..n).map(|i| (i.saturating_sub(1)..(i + 1).min(n.saturating_sub(1))).map(half).sum()).collect()
    }
}

/// What a scale (s) gives of a wave of a period (s) and size 1.
pub(super) fn gain(scale: f64, period: f64) -> f64 {
    (-0.5 * (TAU * scale / period - OMEGA).powi(2)).exp()
}

/// A scale's answer at every instant.
pub(super) struct Answer {
    /// A wave A cos ωt gives A exp(iωt) times the [`gain`].
    pub waves: Vec<Vector2<Complex<f64>>>,
    /// The mean of |waves|² for a coordinate that is white noise of variance 1.
    pub noise: Vec<f64>,
}

/// The transform of positions at a scale (s).
///
/// Each sample is turned back by the wave and then spread over the instants by the Gaussian, whose values at even instants follow from
/// one another by two products. Sums are divided by that of the weights, so that a wave keeps its size where a part of the Gaussian lies
/// beyond an end.
pub(super) fn transform(sampling: &Sampling, positions: &[Vector2<f64>], scale: f64) -> Answer {
    let total = sampling.stretches.last().map_or(0, |last| last.offset + last.count);
    let mut waves = vec![Vector2::from_element(Complex::ZERO); total];
    let (mut noise, mut whole) = (vec![0.0; total], vec![0.0; total]);
    let weights = sampling.weights(scale * period_over_scale());
    let (omega, every, reach) = (OMEGA / scale, sampling.every, REACH * scale);
    let origin = sampling.times.first().copied().unwrap_or(0.0);
    let slower = (-(every / scale).powi(2)).exp();
    for ((t, position), weight) in sampling.times.iter().zip(positions).zip(&weights) {
        let turned = Complex::cis(-omega * (t - origin)) * weight;
        let turned = position.map(|x| turned * x);
        let squared = weight * weight;
        let begin = sampling.stretches.partition_point(|s| s.start + every * s.count as f64 <= t - reach);
        for stretch in sampling.stretches[begin..].iter().take_while(|s| s.start <= t + reach) {
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
    Answer { waves, noise }
}
