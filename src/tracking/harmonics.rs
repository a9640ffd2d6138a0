//! Nonlinear least squares for a polynomial drift and waves with unknown frequencies.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Vector2};

use super::background::{Background, level};
use super::ellipse::Ellipse;
use super::statistics::resolved_interval;
use crate::numerics::quadrature::legendre_sequence;

/// Largest number of Gauss–Newton iterations. They converge quadratically where noise is small.
const ITERATIONS: usize = 30;
/// Change of a frequency at convergence, in turns over the whole track.
pub(super) const CONVERGED: f64 = 1e-12;
/// Largest change of a frequency in an iteration, in turns over the whole track. Larger ones reach another peak of
/// the spectrum.
const LONGEST_MOVE: f64 = 0.2;
/// Power of a residual along the next polynomial, over its mean in noise, above which the drift needs that
/// polynomial. Noise exceeds it with probability e⁻⁵ = 0.7 % if its variance is known.
const DRIFTING: f64 = 5.0;

/// Positions at times that are scaled to −1 … 1. Lengths are in a unit of the order of the largest coordinate.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    pub times: Vec<f64>,
    pub positions: Vec<Vector2<f64>>,
    /// Highest resolved angular frequency. It differs by a turn over the whole track from its alias above the
    /// Nyquist frequency of the resolved interval.
    pub highest: f64,
    /// Rounding error of the positions.
    pub rounding: f64,
}

impl Samples {
    /// Samples at given times, −1 … 1.
    pub fn new(times: Vec<f64>, positions: Vec<Vector2<f64>>) -> Self {
        let highest = PI / resolved_interval(&times) - 0.5 * PI;
        let rounding = rounding(&positions);
        Self { times, positions, highest, rounding }
    }

    /// The samples for which `used` is true. The resolution is that of all.
    pub fn only(&self, used: &[bool]) -> Self {
        let chosen = || (0..used.len()).filter(|i| used[*i]);
        let positions: Vec<_> = chosen().map(|i| self.positions[i]).collect();
        Self {
            times: chosen().map(|i| self.times[i]).collect(),
            rounding: rounding(&positions),
            highest: self.highest,
            positions,
        }
    }
}

/// Rounding error of positions.
fn rounding(positions: &[Vector2<f64>]) -> f64 {
    let largest = positions.iter().map(Vector2::amax).fold(0.0, f64::max);
    64.0 * f64::EPSILON * largest
}

/// drift + Σ a cos ωτ + b sin ωτ, for both coordinates.
#[derive(Debug, Clone)]
pub(super) struct Harmonics {
    /// Coefficients of the Legendre polynomials.
    pub drift: Vec<Vector2<f64>>,
    pub waves: Vec<Wave>,
    /// Variance of the noise of a coordinate.
    pub variance: f64,
}

/// a cos ωτ + b sin ωτ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    pub omega: f64,
    pub cosine: Vector2<f64>,
    pub sine: Vector2<f64>,
    /// Variance of white noise with the power of the noise at ω.
    pub variance: f64,
    /// Standard errors of ω, a and b.
    pub omega_error: f64,
    pub cosine_error: Vector2<f64>,
    pub sine_error: Vector2<f64>,
}

impl Wave {
    /// A wave with amplitude zero.
    pub fn new(omega: f64) -> Self {
        let zero = Vector2::zeros();
        Self { omega, cosine: zero, sine: zero, variance: 0.0, omega_error: 0.0, cosine_error: zero, sine_error: zero }
    }

    /// Standard error of the semi-axes: the root mean square of those of the coefficients.
    pub fn error(&self) -> f64 {
        0.5 * (self.cosine_error.norm_squared() + self.sine_error.norm_squared()).sqrt()
    }

    /// The ellipse of the wave.
    pub fn ellipse(&self) -> Ellipse {
        Ellipse::of(&self.cosine, &self.sine)
    }

    pub fn at(&self, t: f64) -> Vector2<f64> {
        let (sine, cosine) = (self.omega * t).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}

impl Harmonics {
    /// Drift and waves with coefficients zero.
    pub fn new(degree: usize, omegas: &[f64]) -> Self {
        let waves = omegas.iter().map(|omega| Wave::new(*omega)).collect();
        Self { drift: vec![Vector2::zeros(); degree + 1], waves, variance: 0.0 }
    }

    /// Amplitude of the largest wave.
    pub fn largest(&self) -> f64 {
        self.waves.iter().map(|wave| wave.ellipse().major).fold(0.0, f64::max)
    }

    /// Degree of the drift.
    pub fn degree(&self) -> usize {
        self.drift.len() - 1
    }

    /// Angular frequencies of the waves.
    pub fn omegas(&self) -> Vec<f64> {
        self.waves.iter().map(|wave| wave.omega).collect()
    }

    pub fn at(&self, t: f64) -> Vector2<f64> {
        let drift: Vector2<f64> = legendre_sequence(t).zip(&self.drift).map(|(p, c)| c * p).sum();
        drift + self.waves.iter().map(|wave| wave.at(t)).sum::<Vector2<f64>>()
    }

    /// Residuals of samples.
    pub fn residuals(&self, samples: &Samples) -> Vec<Vector2<f64>> {
        samples.times.iter().zip(&samples.positions).map(|(t, p)| p - self.at(*t)).collect()
    }

    /// Fits all coefficients and the frequencies of the first `free` waves by the Gauss–Newton method, coefficients
    /// first. Returns whether the iteration converged.
    pub fn fit(&mut self, samples: &Samples, free: usize) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        if 2 * samples.times.len() <= 2 * linear + free {
            return false;
        }
        for iteration in 0..ITERATIONS {
            let moves = if iteration == 0 { 0 } else { free };
            let Some((change, inverse)) = self.correction(samples, moves) else { return false };
            let mut largest = 0.0_f64;
            for (k, wave) in self.waves.iter_mut().enumerate() {
                let at = self.drift.len() + 2 * k;
                for c in 0..2 {
                    wave.cosine[c] += change[c * linear + at];
                    wave.sine[c] += change[c * linear + at + 1];
                }
                if k < moves {
                    // Scaled times span two units: one turn over the track is an angular frequency of π.
                    let turns = change[2 * linear + k] / PI;
                    wave.omega += turns.clamp(-LONGEST_MOVE, LONGEST_MOVE) * PI;
                    largest = largest.max(turns.abs());
                }
            }
            for (j, drift) in self.drift.iter_mut().enumerate() {
                *drift += Vector2::new(change[j], change[linear + j]);
            }
            if !largest.is_finite() {
                return false;
            }
            if iteration > 0 && largest < CONVERGED || iteration + 1 == ITERATIONS && largest < LONGEST_MOVE {
                return self.finish(samples, &inverse, moves);
            }
        }
        false
    }

    /// The change of all coefficients and of the first `moves` frequencies, and the inverse of the normal matrix.
    fn correction(&self, samples: &Samples, moves: usize) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let linear = self.drift.len() + 2 * self.waves.len();
        let size = 2 * linear + moves;
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        let mut row: Vec<(usize, f64)> = Vec::with_capacity(linear + moves);
        for (t, position) in samples.times.iter().zip(&samples.positions) {
            let rest = position - self.at(*t);
            let mut basis: Vec<f64> = legendre_sequence(*t).take(self.drift.len()).collect();
            basis.extend(self.waves.iter().flat_map(|wave| {
                let (sine, cosine) = (wave.omega * t).sin_cos();
                [cosine, sine]
            }));
            for c in 0..2 {
                row.clear();
                row.extend(basis.iter().enumerate().map(|(j, value)| (c * linear + j, *value)));
                row.extend(self.waves[..moves].iter().enumerate().map(|(k, wave)| {
                    let (sine, cosine) = (wave.omega * t).sin_cos();
                    (2 * linear + k, t * (wave.sine[c] * cosine - wave.cosine[c] * sine))
                }));
                for &(i, x) in &row {
                    right[i] += x * rest[c];
                    for &(j, y) in &row {
                        normal[(i, j)] += x * y;
                    }
                }
            }
        }
        // Frequencies and coefficients differ in units and size.
        let scale =
            DVector::from_fn(size, |i, _| if normal[(i, i)] > 0.0 { normal[(i, i)].sqrt().recip() } else { 1.0 });
        let scaled = DMatrix::from_fn(size, size, |i, j| normal[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let change = &inverse * right;
        Some((change, inverse))
    }

    /// Computes standard errors from the inverse of the normal matrix and the spectrum of the residual. Returns
    /// whether they are finite.
    fn finish(&mut self, samples: &Samples, inverse: &DMatrix<f64>, free: usize) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        let rest = self.residuals(samples);
        let sum = rest.iter().map(Vector2::norm_squared).sum::<f64>();
        self.variance = sum / (2 * rest.len() - 2 * linear - free) as f64;
        let background = Background::of(&samples.times, &rest);
        let (omegas, lowest) = (self.omegas(), self.lowest());
        for (k, wave) in self.waves.iter_mut().enumerate() {
            let at = self.drift.len() + 2 * k;
            // The noise near the frequency of a wave determines its errors.
            let near = level(&samples.times, &rest, &background, wave.omega, &omegas, lowest);
            let variance = near.unwrap_or(self.variance * background.at(wave.omega));
            wave.variance = variance;
            let error = |i: usize| (variance * inverse[(i, i)]).sqrt();
            wave.omega_error = if k < free { error(2 * linear + k) } else { 0.0 };
            wave.cosine_error = Vector2::new(error(at), error(linear + at));
            wave.sine_error = Vector2::new(error(at + 1), error(linear + at + 1));
        }
        self.variance.is_finite()
    }

    /// Increases the standard errors to those in white noise with the variance of the whole residual. Other
    /// oscillations in the residual disturb the waves more than the noise near their frequencies.
    pub fn widen(&mut self) {
        for wave in &mut self.waves {
            let factor = (self.variance / wave.variance).sqrt().max(1.0);
            wave.variance *= factor * factor;
            wave.omega_error *= factor;
            wave.cosine_error *= factor;
            wave.sine_error *= factor;
        }
    }

    /// Whether a polynomial with a degree higher by one or two would follow drift in the residual: the part of the
    /// residual along that Legendre polynomial exceeds `smallest`, and noise with the level at the lowest
    /// frequencies above the drift.
    pub fn drifts(&self, samples: &Samples, smallest: f64) -> bool {
        let (rest, lowest) = (self.residuals(samples), self.lowest());
        let variance = level(&samples.times, &rest, &Background::WHITE, lowest, &self.omegas(), lowest);
        let Some(variance) = variance else { return false };
        let next = [self.drift.len(), self.drift.len() + 1];
        next.into_iter().any(|degree| {
            let (mut along, mut square) = (Vector2::zeros(), 0.0);
            for (t, rest) in samples.times.iter().zip(&rest) {
                let value = legendre_sequence(*t).nth(degree).unwrap_or_default();
                along += rest * value;
                square += value * value;
            }
            // In noise |along|²/square is exponentially distributed, and its mean is twice the variance.
            let noise = DRIFTING * 2.0 * variance + samples.rounding.powi(2);
            along.norm_squared() > noise * square && along.norm() > smallest * square
        })
    }

    /// The lowest frequency above the drift: a polynomial of degree d follows up to d/2 turns.
    fn lowest(&self) -> f64 {
        0.5 * PI * self.drift.len() as f64
    }
}
