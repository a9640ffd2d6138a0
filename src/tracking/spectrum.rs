//! Power spectrum of a track.

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector2};

use super::statistics::{GAMMA_MEDIAN, LEAST, median};
use crate::numerics::fourier::FourierSums;

/// A power spectrum: frequencies, 1/s, and the power of both coordinates over that of white noise
/// with variance 1 in one coordinate.
pub(super) struct Spectrum(Vec<(f64, f64)>);

impl Spectrum {
    /// The spectrum of samples with given weights (s) and a Hann window, up to the Nyquist
    /// frequency of the median `interval`.
    pub fn of(times: &[f64], positions: &[Vector2<f64>], weights: &[f64], interval: f64) -> Self {
        let n = times.len();
        let (start, duration) = (times[0], times[n - 1] - times[0]);
        let highest = 0.5 / interval;
        // At most four frequencies for each position limit the work for a track with a gap that is
        // longer than all the rest.
        let step = duration.recip().max(highest / (4.0 * n as f64));
        let hann = |t: f64| 0.5 - 0.5 * (TAU * (t - start) / duration).cos();
        // The weights are divided by the duration, so that their squares neither overflow nor
        // underflow in any unit of time.
        let tapers: Vec<f64> = times
            .iter()
            .zip(weights)
            .map(|(t, weight)| weight / duration * hann(*t))
            .collect();
        let noise: f64 = tapers.iter().map(|x| x * x).sum();
        let angles: Vec<f64> = times.iter().map(|t| TAU * step * (t - start)).collect();
        // The highest frequency belongs to the spectrum in spite of rounding.
        let count = (highest / step * (1.0 + 1e-9)) as usize;
        let tapered = positions
            .iter()
            .zip(&tapers)
            .map(|(p, taper)| Complex::new(p.x * taper, p.y * taper));
        let sums = FourierSums::new(&angles, count + 1).of(tapered);
        let power = |[x, y]: &[Complex<f64>; 2]| (x.norm_sqr() + y.norm_sqr()) / noise;
        Self(
            sums.iter()
                .enumerate()
                .skip(1)
                .map(|(k, sums)| (step * k as f64, power(sums)))
                .collect(),
        )
    }

    /// The power at periods from `shortest` to `longest` over the whole power.
    pub fn share(&self, shortest: f64, longest: f64) -> f64 {
        // The ends of the band belong to it in spite of rounding.
        let inside = |f: f64| f * longest >= 1.0 - 1e-9 && f * shortest <= 1.0 + 1e-9;
        let all: f64 = self.0.iter().map(|line| line.1).sum();
        let own: f64 = self
            .0
            .iter()
            .filter(|line| inside(line.0))
            .map(|line| line.1)
            .sum();
        if all > 0.0 { own / all } else { 0.0 }
    }

    /// The standard deviation of white noise in a coordinate, from the median of the power at
    /// periods below `shortest`. `left` is the share of an amplitude at a period that removal of
    /// the drift has left. `None` with too few frequencies.
    pub fn floor(&self, shortest: f64, left: impl Fn(f64) -> f64) -> Option<f64> {
        let faster = self.0.iter().filter(|line| line.0 * shortest > 1.0);
        let faster: Vec<f64> = faster
            .map(|line| line.1 / left(line.0.recip()).powi(2))
            .collect();
        // The power of noise in two coordinates has a gamma distribution of shape 2.
        (faster.len() >= LEAST).then(|| (median(faster) / GAMMA_MEDIAN).sqrt())
    }
}
