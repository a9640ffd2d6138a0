//! Power spectrum of a track.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::statistics::{GAMMA_MEDIAN, LEAST, median};

/// A power spectrum.
pub(super) struct Spectrum {
    /// Frequencies, 1/s, and the power of both coordinates over that of white noise with variance 1 in one
    /// coordinate.
    lines: Vec<(f64, f64)>,
}

impl Spectrum {
    /// The spectrum of samples with given weights (s) and a Hann window, up to the Nyquist frequency of the median
    /// `interval`.
    pub fn of(times: &[f64], positions: &[Vector2<f64>], weights: &[f64], interval: f64) -> Self {
        let n = times.len();
        let (start, duration) = (times[0], times[n - 1] - times[0]);
        let highest = 0.5 / interval;
        // At most four frequencies for each position limit the work for a track with a gap that is longer than all
        // the rest.
        let step = duration.recip().max(highest / (4.0 * n as f64));
        let hann = |t: f64| 0.5 - 0.5 * (TAU * (t - start) / duration).cos();
        let tapers: Vec<f64> = times.iter().zip(weights).map(|(t, weight)| weight * hann(*t)).collect();
        let noise: f64 = tapers.iter().map(|x| x * x).sum();
        let turns: Vec<(f64, f64)> = times.iter().map(|t| (TAU * step * (t - start)).sin_cos()).collect();
        let mut phases = turns.clone();
        let mut lines = Vec::new();
        for k in 1..=(highest / step * (1.0 + 1e-9)) as usize {
            let mut sums = [Vector2::zeros(); 2];
            for (((phase, turn), position), taper) in phases.iter_mut().zip(&turns).zip(positions).zip(&tapers) {
                let (sine, cosine) = *phase;
                sums[0] += position * (taper * cosine);
                sums[1] += position * (taper * sine);
                *phase = (sine * turn.1 + cosine * turn.0, cosine * turn.1 - sine * turn.0);
            }
            lines.push((step * k as f64, (sums[0].norm_squared() + sums[1].norm_squared()) / noise));
        }
        Self { lines }
    }

    /// The power at periods from `shortest` to `longest` over the whole power.
    pub fn share(&self, shortest: f64, longest: f64) -> f64 {
        // The ends of the band belong to it in spite of rounding.
        let inside = |f: f64| f * longest >= 1.0 - 1e-9 && f * shortest <= 1.0 + 1e-9;
        let all: f64 = self.lines.iter().map(|line| line.1).sum();
        let own: f64 = self.lines.iter().filter(|line| inside(line.0)).map(|line| line.1).sum();
        if all > 0.0 { own / all } else { 0.0 }
    }

    /// The standard deviation of white noise in a coordinate, from the median of the power at periods below
    /// `shortest`. `left` is the share of an amplitude at a period that removal of the drift has left. `None` with
    /// too few frequencies.
    pub fn floor(&self, shortest: f64, left: impl Fn(f64) -> f64) -> Option<f64> {
        let faster = self.lines.iter().filter(|line| line.0 * shortest > 1.0);
        let faster: Vec<f64> = faster.map(|line| line.1 / left(line.0.recip()).powi(2)).collect();
        // The power of noise in two coordinates has a gamma distribution of shape 2.
        (faster.len() >= LEAST).then(|| (median(faster) / GAMMA_MEDIAN).sqrt())
    }
}
