//! Least squares: a drift and some periods at once, the periods unknown too.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Vector2};

use super::background::{Background, level};
use super::robust::median_gap;

/// Significance threshold: amplitude, minor axis or difference of frequencies over its standard error. Normal noise exceeds it in one case
/// of 370.
pub(super) const SIGNIFICANT: f64 = 3.0;
/// Corrections at most; they converge as those of Newton's method where noise is small.
const CORRECTIONS: usize = 30;
/// A frequency is found when it moves by less than this, in turns over the whole path.
pub(super) const CONVERGED: f64 = 1e-12;
/// No correction moves a frequency by more than this, in turns over the whole path: further off another peak begins.
const LONGEST_MOVE: f64 = 0.2;

/// Power of a residual along the next polynomial, over its mean in noise, above which the drift needs it. Noise exceeds it with probability
/// e⁻⁵ = 0.7 % if its variance is known.
const DRIFTING: f64 = 5.0;
/// Positions at times that are scaled to −1 … 1.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    pub times: Vec<f64>,
    pub positions: Vec<Vector2<f64>>,
}

impl Samples {
    /// The highest angular frequency that is resolved: its mirror image at the Nyquist frequency of the median interval differs from it by a
    /// turn over the whole path.
    pub fn highest(&self) -> f64 {
        PI / median_gap(&self.times) - 0.5 * PI
    }

    /// The square of what rounding of the positions may make, m².
    pub fn rounding(&self) -> f64 {
        let largest = self.positions.iter().map(Vector2::norm_squared).fold(0.0, f64::max);
        (64.0 * f64::EPSILON).powi(2) * largest
    }
}

/// drift + Σ a cos ωτ + b sin ωτ, for both coordinates.
#[derive(Debug, Clone)]
pub(super) struct Harmonics {
    /// Coefficients of Legendre's polynomials.
    pub drift: Vec<Vector2<f64>>,
    pub waves: Vec<Wave>,
    /// Variance of a coordinate's noise, m².
    pub variance: f64,
}

/// a cos ωτ + b sin ωτ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    pub omega: f64,
    pub cosine: Vector2<f64>,
    pub sine: Vector2<f64>,
    /// Variance of white noise with the power of the noise at ω, m².
    pub variance: f64,
    /// Standard error of ω, and those of the coefficients of a and b.
    pub omega_error: f64,
    pub cosine_error: Vector2<f64>,
    pub sine_error: Vector2<f64>,
}

impl Wave {
    /// A wave of no size.
    pub fn still(omega: f64) -> Self {
        let zero = Vector2::zeros();
        Self { omega, cosine: zero, sine: zero, variance: 0.0, omega_error: 0.0, cosine_error: zero, sine_error: zero }
    }

    /// Standard error of the semi-axes: the root mean square of those of the coefficients.
    pub fn error(&self) -> f64 {
        0.5 * (self.cosine_error.norm_squared() + self.sine_error.norm_squared()).sqrt()
    }

    pub fn at(&self, t: f64) -> Vector2<f64> {
        let (sine, cosine) = (self.omega * t).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}

/// Legendre's polynomials up to a degree.
pub(super) fn legendre(degree: usize, t: f64) -> Vec<f64> {
    let mut out = vec![1.0; degree + 1];
    if degree > 0 {
        out[1] = t;
    }
    for n in 2..=degree {
        let m = n as f64;
        out[n] = ((2.0 * m - 1.0) * t * out[n - 1] - (m - 1.0) * out[n - 2]) / m;
    }
    out
}

impl Harmonics {
    /// The drift alone, and waves of no size yet.
    pub fn new(degree: usize, omegas: &[f64]) -> Self {
        let waves = omegas.iter().map(|omega| Wave::still(*omega)).collect();
        Self { drift: vec![Vector2::zeros(); degree + 1], waves, variance: 0.0 }
    }

    /// Degree of the drift.
    pub fn degree(&self) -> usize {
        self.drift.len() - 1
    }

    pub fn at(&self, t: f64) -> Vector2<f64> {
        let drift: Vector2<f64> = legendre(self.drift.len() - 1, t).iter().zip(&self.drift).map(|(p, c)| c * *p).sum();
        drift + self.waves.iter().map(|wave| wave.at(t)).sum::<Vector2<f64>>()
    }

    /// What is left of the positions.
    pub fn residuals(&self, samples: &Samples) -> Vec<Vector2<f64>> {
        samples.times.iter().zip(&samples.positions).map(|(t, p)| p - self.at(*t)).collect()
    }

    /// Fits all to the samples that are used, but for the frequencies of the waves behind the first `free`: Gauss's and Newton's method,
    /// coefficients first. Returns whether it succeeded.
    pub fn fit(&mut self, samples: &Samples, used: &[bool], free: usize) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        let number = used.iter().filter(|used| **used).count();
        if 2 * number <= 2 * linear + free {
            return false;
        }
        for correction in 0..CORRECTIONS {
            let moves = if correction == 0 { 0 } else { free };
            let Some((change, normal)) = self.correction(samples, used, moves) else { return false };
            let mut furthest = 0.0_f64;
            for (k, wave) in self.waves.iter_mut().enumerate() {
                let at = self.drift.len() + 2 * k;
                for c in 0..2 {
                    wave.cosine[c] += change[c * linear + at];
                    wave.sine[c] += change[c * linear + at + 1];
                }
                if k < moves {
                    // τ goes from −1 to 1: ω is half a turn for every turn over the path.
                    let turns = change[2 * linear + k] / PI;
                    wave.omega += turns.clamp(-LONGEST_MOVE, LONGEST_MOVE) * PI;
                    furthest = furthest.max(turns.abs());
                }
            }
            for (j, drift) in self.drift.iter_mut().enumerate() {
                *drift += Vector2::new(change[j], change[linear + j]);
            }
            if !furthest.is_finite() {
                return false;
            }
            if correction > 0 && furthest < CONVERGED || correction + 1 == CORRECTIONS && furthest < LONGEST_MOVE {
                return self.finish(samples, used, &normal, moves);
            }
        }
        false
    }

    /// The change of all coefficients, and of the first `moves` frequencies, and the normal matrix.
    fn correction(&self, samples: &Samples, used: &[bool], moves: usize) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let linear = self.drift.len() + 2 * self.waves.len();
        let size = 2 * linear + moves;
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        let mut row: Vec<(usize, f64)> = Vec::with_capacity(linear + moves);
        for ((t, position), _) in samples.times.iter().zip(&samples.positions).zip(used).filter(|(_, used)| **used) {
            let rest = position - self.at(*t);
            let mut basis = legendre(self.drift.len() - 1, *t);
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
        // Frequencies and coefficients have units of their own.
        let scale =
            DVector::from_fn(size, |i, _| if normal[(i, i)] > 0.0 { normal[(i, i)].sqrt().recip() } else { 1.0 });
        let scaled = DMatrix::from_fn(size, size, |i, j| normal[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let change = &inverse * right;
        Some((change, inverse))
    }

    /// Computes standard errors from the inverse of the normal matrix and the spectrum of the residual.
    fn finish(&mut self, samples: &Samples, used: &[bool], inverse: &DMatrix<f64>, free: usize) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        let chosen: Vec<usize> = (0..used.len()).filter(|i| used[*i]).collect();
        let times: Vec<f64> = chosen.iter().map(|i| samples.times[*i]).collect();
        let left = self.residuals(samples);
        let left: Vec<Vector2<f64>> = chosen.iter().map(|i| left[*i]).collect();
        let sum = left.iter().map(Vector2::norm_squared).sum::<f64>();
        self.variance = sum / (2 * left.len() - 2 * linear - free) as f64;
        let background = Background::of(&times, &left);
        let omegas: Vec<f64> = self.waves.iter().map(|wave| wave.omega).collect();
        for (k, wave) in self.waves.iter_mut().enumerate() {
            let at = self.drift.len() + 2 * k;
            // A wave is disturbed by the noise near its own frequency.
            let near = level(&times, &left, &background, wave.omega, &omegas, lowest_above(&self.drift));
            let variance = near.unwrap_or(self.variance * background.at(wave.omega));
            wave.variance = variance;
            let error = |i: usize| (variance * inverse[(i, i)]).sqrt();
            wave.omega_error = if k < free { error(2 * linear + k) } else { 0.0 };
            wave.cosine_error = Vector2::new(error(at), error(linear + at));
            wave.sine_error = Vector2::new(error(at + 1), error(linear + at + 1));
        }
        self.variance.is_finite()
    }

    /// Increases the standard errors to those in white noise of the variance of the whole residual. Other oscillations that the residual
    /// contains disturb the waves more than the noise near their frequencies.
    pub fn widen(&mut self) {
        for wave in &mut self.waves {
            let factor = (self.variance / wave.variance).sqrt().max(1.0);
            wave.variance *= factor * factor;
            wave.omega_error *= factor;
            wave.cosine_error *= factor;
            wave.sine_error *= factor;
        }
    }

    /// Whether the residual of the used positions contains drift that a polynomial of a degree higher by one or two would follow: the
    /// part of the residual along that Legendre polynomial exceeds `smallest` (m) and noise as it is at the lowest frequencies above the
    /// drift.
    pub fn drifts(&self, samples: &Samples, used: &[bool], smallest: f64) -> bool {
        let chosen: Vec<usize> = (0..used.len()).filter(|i| used[*i]).collect();
        let times: Vec<f64> = chosen.iter().map(|i| samples.times[*i]).collect();
        let left = self.residuals(samples);
        let left: Vec<Vector2<f64>> = chosen.iter().map(|i| left[*i]).collect();
        let omegas: Vec<f64> = self.waves.iter().map(|wave| wave.omega).collect();
        let lowest = lowest_above(&self.drift);
        let Some(variance) = level(&times, &left, &Background::WHITE, lowest, &omegas, lowest) else { return false };
        let next = [self.drift.len(), self.drift.len() + 1];
        next.into_iter().any(|degree| {
            let (mut along, mut square) = (Vector2::zeros(), 0.0);
            for (t, rest) in times.iter().zip(&left) {
                let value = legendre(degree, *t)[degree];
                along += rest * value;
                square += value * value;
            }
            // Of noise |along|²/square has twice the variance as its mean, and is distributed exponentially.
            let noise = DRIFTING * 2.0 * variance + samples.rounding();
            along.norm_squared() > noise * square && along.norm() > smallest * square
        })
    }
}

/// The lowest frequency that a drift does not follow: a polynomial of degree d follows up to d/2 turns.
fn lowest_above(drift: &[Vector2<f64>]) -> f64 {
    0.5 * PI * drift.len() as f64
}
