//! Nonlinear least squares for a polynomial drift and waves with unknown frequencies.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::background::Background;
use super::harmonics::{Harmonics, Samples};
use super::normal_equations::{Columns, NormalEquations, Unknowns};

/// Largest number of iterations.
const ITERATIONS: usize = 30;
/// Change of a frequency at convergence, in turns over the whole track.
pub(super) const CONVERGED: f64 = 1e-12;
/// Largest change of a frequency in an iteration, in turns over the whole track. Larger ones reach
/// another peak of the spectrum.
const LONGEST_MOVE: f64 = 0.2;
/// Largest change of a frequency, in turns over the whole track, after which Newton's method
/// computes the next step. From larger distances it may reach another extremum than the
/// Gauss–Newton method.
const NEAR: f64 = 1e-2;
impl Harmonics {
    /// Fits all coefficients and the frequencies of the first `free` waves, coefficients first. The
    /// Gauss–Newton method is replaced by Newton's method when the frequencies change little, which
    /// converges quadratically also if the residual is large. Returns whether the iteration
    /// converged.
    pub fn fit(&mut self, samples: &Samples, free: usize) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        if 2 * samples.times.len() <= 2 * linear + free {
            return false;
        }
        let mut columns = Columns::new(samples, self.drift.len(), self.waves.len());
        let mut last = f64::INFINITY;
        for iteration in 0..ITERATIONS {
            let moves = if iteration == 0 { 0 } else { free };
            columns.set(self, moves);
            let Some(equations) = NormalEquations::of(&columns, self, moves) else {
                return false;
            };
            let near = last < NEAR;
            let newton = near.then(|| equations.newton_step()).flatten();
            let Some(step) = newton.or_else(|| equations.gauss_newton_step()) else {
                return false;
            };
            let largest = self.add(&step);
            if !largest.is_finite() {
                return false;
            }
            if iteration == 0 {
                continue;
            }
            // Newton's method converges quadratically: the quotient of two changes bounds that of
            // the next ones.
            let converged = largest < CONVERGED || near && largest * largest < CONVERGED * last;
            if converged || iteration + 1 == ITERATIONS && largest < LONGEST_MOVE {
                return equations
                    .variances()
                    .is_some_and(|variances| self.finish(samples, &variances));
            }
            last = largest;
        }
        false
    }

    /// Adds a step. Returns the largest change of a frequency, in turns over the whole track,
    /// before its limitation.
    pub(super) fn add(&mut self, step: &Unknowns) -> f64 {
        let mut largest = 0.0_f64;
        let coefficient = |i: usize| Vector2::new(step.coefficients[0][i], step.coefficients[1][i]);
        for (k, wave) in self.waves.iter_mut().enumerate() {
            let at = self.drift.len() + 2 * k;
            wave.cosine += coefficient(at);
            wave.sine += coefficient(at + 1);
            if let Some(change) = step.omegas.get(k) {
                // Scaled times span two units: one turn over the track is an angular frequency of
                // π.
                let turns = change / PI;
                wave.omega += turns.clamp(-LONGEST_MOVE, LONGEST_MOVE) * PI;
                largest = largest.max(turns.abs());
            }
        }
        self.drift
            .iter_mut()
            .enumerate()
            .for_each(|(j, drift)| *drift += coefficient(j));
        largest
    }

    /// Computes standard errors from the variances of the unknowns for noise of variance one, and
    /// from the spectrum of the residual. Returns whether they are finite.
    fn finish(&mut self, samples: &Samples, variances: &Unknowns) -> bool {
        let linear = self.drift.len() + 2 * self.waves.len();
        let rest = self.residuals(samples);
        let sum = rest.iter().map(Vector2::norm_squared).sum::<f64>();
        self.variance = sum / (2 * rest.len() - 2 * linear - variances.omegas.len()) as f64;
        let background = Background::of(&samples.times, &rest);
        let (omegas, lowest) = (self.omegas(), self.lowest());
        for (k, wave) in self.waves.iter_mut().enumerate() {
            let at = self.drift.len() + 2 * k;
            // The noise near the frequency of a wave determines its errors.
            let near = background.level(&samples.times, &rest, wave.omega, &omegas, lowest);
            wave.variance = near.unwrap_or(self.variance * background.at(wave.omega));
            let error = |inverse: f64| (wave.variance * inverse).sqrt();
            let errors = |i: usize| Vector2::from_fn(|c, _| error(variances.coefficients[c][i]));
            (wave.cosine_error, wave.sine_error) = (errors(at), errors(at + 1));
            wave.omega_error = variances
                .omegas
                .get(k)
                .map_or(0.0, |inverse| error(*inverse));
        }
        self.variance.is_finite()
    }
}
