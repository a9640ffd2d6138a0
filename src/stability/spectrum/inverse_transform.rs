//! Functions of time from their Laplace transform.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Complex, DMatrix};

/// Intervals of the duration at whose ends functions are sampled.
pub(super) const SAMPLES: usize = 256;

/// The line of integration lies right of all singularities by this over the duration. The period of the series is four durations: what
/// it repeats is damped by exp(−16), and what it leaves out grows by exp(4) at most.
pub(super) const DAMPING: f64 = 4.0;

/// The trapezoidal rule for the integral over a line, a Fourier series in time (Dubner and Abate 1968):
///
/// ```text
/// f(t) = exp(at)/(2T) [F(a)/2 + Σ Re(F(a + ikπ/(2T)) exp(ikπt/(2T)))],   0 ≤ t ≤ T.
/// ```
pub(super) struct Series {
    /// a, 1/s.
    line: f64,
    /// T, s.
    duration: f64,
    terms: Vec<DMatrix<Complex<f64>>>,
}

impl Series {
    pub fn new(line: f64, duration: f64) -> Self {
        Self { line, duration, terms: Vec::new() }
    }

    /// The number of terms.
    pub fn terms(&self) -> usize {
        self.terms.len()
    }

    /// Doubles the number of terms of the transform `f`.
    pub fn extend<E>(&mut self, f: impl Fn(Complex<f64>) -> Result<DMatrix<Complex<f64>>, E>) -> Result<(), E> {
        for k in self.terms.len()..(2 * self.terms.len()).max(2 * SAMPLES) {
            let mut term = f(Complex::new(self.line, k as f64 * FRAC_PI_2 / self.duration))?;
            if k == 0 {
                term *= Complex::from(0.5);
            }
            self.terms.push(term);
        }
        Ok(())
    }

    /// The time of a sample, s.
    pub fn time(&self, sample: usize) -> f64 {
        self.duration * sample as f64 / SAMPLES as f64
    }

    /// The functions at all samples.
    pub fn sampled(&self) -> Vec<DMatrix<f64>> {
        let turn = 4 * SAMPLES;
        let phases: Vec<Complex<f64>> = (0..turn).map(|j| Complex::cis(2.0 * PI * j as f64 / turn as f64)).collect();
        (0..=SAMPLES).map(|j| self.sum(self.time(j), |k| phases[k * j % turn])).collect()
    }

    /// The functions at a time within the duration, s.
    pub fn at(&self, t: f64) -> DMatrix<f64> {
        self.sum(t, |k| Complex::cis(k as f64 * FRAC_PI_2 * t / self.duration))
    }

    fn sum(&self, t: f64, phase: impl Fn(usize) -> Complex<f64>) -> DMatrix<f64> {
        let (rows, columns) = self.terms.first().map_or((0, 0), DMatrix::shape);
        let mut sum = DMatrix::zeros(rows, columns);
        for (k, term) in self.terms.iter().enumerate() {
            let phase = phase(k);
            sum.zip_apply(term, |sum, z| *sum += z.re * phase.re - z.im * phase.im);
        }
        sum * ((self.line * t).exp() / (2.0 * self.duration))
    }
}
