//! Model of a tip track: a polynomial drift and waves.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::background::Background;
use super::ellipse::Ellipse;
use super::statistics::{chosen, resolved_interval};
use crate::numerics::quadrature::{legendre, legendre_sequence};
use crate::numerics::sines::sines;

/// Power of a residual along the next polynomial, over its mean in noise, above which the drift
/// needs that polynomial. Noise exceeds it with probability e⁻⁵ = 0.7 % if its variance is known.
const DRIFTING: f64 = 5.0;

/// Positions at times that are scaled to −1 … 1. Lengths are in a unit of the order of the largest
/// coordinate.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    pub times: Vec<f64>,
    pub positions: Vec<Vector2<f64>>,
    /// Highest resolved angular frequency. It differs by a turn over the whole track from its alias
    /// above the Nyquist frequency of the resolved interval.
    pub highest: f64,
}

impl Samples {
    /// Samples at given times, −1 … 1.
    pub fn new(times: Vec<f64>, positions: Vec<Vector2<f64>>) -> Self {
        let highest = PI / resolved_interval(&times) - 0.5 * PI;
        Self {
            times,
            positions,
            highest,
        }
    }

    /// The samples for which `used` is true. The resolution is that of all.
    pub fn only(&self, used: &[bool]) -> Self {
        Self {
            times: chosen(&self.times, used),
            positions: chosen(&self.positions, used),
            highest: self.highest,
        }
    }

    /// Rounding error of the positions.
    pub fn rounding(&self) -> f64 {
        64.0 * f64::EPSILON * self.positions.iter().map(Vector2::amax).fold(0.0, f64::max)
    }
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
#[derive(Debug, Clone, Copy, Default)]
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
        let waves = omegas
            .iter()
            .map(|omega| Wave {
                omega: *omega,
                ..Wave::default()
            })
            .collect();
        Self {
            drift: vec![Vector2::zeros(); degree + 1],
            waves,
            variance: 0.0,
        }
    }

    /// Amplitude of the largest wave.
    pub fn largest(&self) -> f64 {
        self.waves
            .iter()
            .map(|wave| wave.ellipse().major)
            .fold(0.0, f64::max)
    }

    /// Degree of the drift.
    pub fn degree(&self) -> usize {
        self.drift.len() - 1
    }

    /// Angular frequencies of the waves.
    pub fn omegas(&self) -> Vec<f64> {
        self.waves.iter().map(|wave| wave.omega).collect()
    }

    /// Residuals of samples.
    pub fn residuals(&self, samples: &Samples) -> Vec<Vector2<f64>> {
        let drift = |t: f64| -> Vector2<f64> {
            legendre_sequence(t)
                .zip(&self.drift)
                .map(|(p, c)| c * p)
                .sum()
        };
        let mut rest: Vec<_> = samples
            .times
            .iter()
            .zip(&samples.positions)
            .map(|(t, p)| p - drift(*t))
            .collect();
        let (mut sine, mut cosine) = (vec![0.0; rest.len()], vec![0.0; rest.len()]);
        for wave in &self.waves {
            sines(wave.omega, &samples.times, &mut sine, &mut cosine);
            for ((rest, sine), cosine) in rest.iter_mut().zip(&sine).zip(&cosine) {
                *rest -= wave.cosine * *cosine + wave.sine * *sine;
            }
        }
        rest
    }

    /// Increases the standard errors to those in white noise with the variance of the whole
    /// residual. Other oscillations in the residual disturb the waves more than the noise near
    /// their frequencies.
    pub fn widen(&mut self) {
        for wave in &mut self.waves {
            let factor = (self.variance / wave.variance).sqrt().max(1.0);
            wave.variance *= factor * factor;
            wave.omega_error *= factor;
            wave.cosine_error *= factor;
            wave.sine_error *= factor;
        }
    }

    /// Whether a polynomial with a degree higher by one or two would follow drift in the residual:
    /// the part of the residual along that Legendre polynomial exceeds `smallest`, and noise with
    /// the level at the lowest frequencies above the drift.
    pub fn drifts(&self, samples: &Samples, smallest: f64) -> bool {
        let (rest, lowest) = (self.residuals(samples), self.lowest());
        let variance =
            Background::WHITE.level(&samples.times, &rest, lowest, &self.omegas(), lowest);
        let Some(variance) = variance else {
            return false;
        };
        let next = [self.drift.len(), self.drift.len() + 1];
        next.into_iter().any(|degree| {
            let values: Vec<f64> = samples
                .times
                .iter()
                .map(|t| legendre(degree, *t).0)
                .collect();
            let along: Vector2<f64> = rest
                .iter()
                .zip(&values)
                .map(|(rest, value)| rest * *value)
                .sum();
            let square: f64 = values.iter().map(|value| value * value).sum();
            // In noise |along|²/square is exponentially distributed, and its mean is twice the
            // variance.
            let noise = DRIFTING * 2.0 * variance + samples.rounding().powi(2);
            along.norm_squared() > noise * square && along.norm() > smallest * square
        })
    }

    /// The lowest frequency above the drift: a polynomial of degree d follows up to d/2 turns.
    pub fn lowest(&self) -> f64 {
        0.5 * PI * self.drift.len() as f64
    }
}
