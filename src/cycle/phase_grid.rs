//! Periodic functions by their values at equally spaced phases: trigonometric polynomials.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

/// Number of waves in a rotation that are resolved. Stimuli of isotropic laws have the waves 0 and ±1; products of three of these are
/// still distinguished.
pub(super) const WAVES: usize = 3;

/// An odd number of phases 2πj/n: with an even one the highest wave has a cosine only.
#[derive(Debug, Clone)]
pub(super) struct PhaseGrid {
    pub angles: Vec<f64>,
    /// d/dθ of the values.
    pub derivative: DMatrix<f64>,
}

impl PhaseGrid {
    /// With all waves up to `waves` times round.
    pub fn new(waves: usize) -> Self {
        let n = 2 * waves + 1;
        let angles: Vec<f64> = (0..n).map(|j| TAU * j as f64 / n as f64).collect();
        let derivative = DMatrix::from_fn(n, n, |j, l| {
            if j == l {
                return 0.0;
            }
            let sign = if (j + l) % 2 == 0 { 0.5 } else { -0.5 };
            sign / (PI * (j as f64 - l as f64) / n as f64).sin()
        });
        Self { angles, derivative }
    }

    pub fn len(&self) -> usize {
        self.angles.len()
    }

    /// The values `delay` (rad) earlier: rows are the phases at which they are read.
    pub fn earlier(&self, delay: f64) -> DMatrix<f64> {
        let n = self.len();
        DMatrix::from_fn(n, n, |j, l| kernel(self.angles[j] - delay - self.angles[l], n))
    }
}

/// Σ cos kφ over all waves, divided by their number: one at zero, zero at all other phases.
fn kernel(phi: f64, n: usize) -> f64 {
    let waves = n / 2;
    (1.0 + 2.0 * (1..=waves).map(|k| (k as f64 * phi).cos()).sum::<f64>()) / n as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Waves up to the highest are derived and delayed to rounding; one more is not.
    #[test]
    fn waves_that_fit_are_exact() {
        let circle = PhaseGrid::new(4);
        let error = |k: f64| {
            let wave = |phase: f64| (k * phase + 0.3).cos();
            let values = DVector::from_iterator(9, circle.angles.iter().map(|phase| wave(*phase)));
            let slopes = circle.angles.iter().map(|phase| -k * (k * phase + 0.3).sin());
            let earlier = circle.angles.iter().map(|phase| wave(phase - 0.7));
            let slope = (&circle.derivative * &values - DVector::from_iterator(9, slopes)).amax();
            slope.max((circle.earlier(0.7) * &values - DVector::from_iterator(9, earlier)).amax())
        };
        for k in 0..=4 {
            // Rounding of a sum of nine numbers times the number of waves.
            assert!(error(f64::from(k)) < 1e-13, "{k}: {}", error(f64::from(k)));
        }
        assert!(error(5.0) > 0.1);
    }
}
