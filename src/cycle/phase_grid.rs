//! Trigonometric interpolation: periodic functions by their values at equally spaced phases. See L.
//! N. Trefethen, *Spectral methods in MATLAB* (2000), chapter 3.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

/// Largest resolved wave number. Stimuli of isotropic laws have the wave numbers 0 and ±1; products
/// of three of them are resolved.
pub(super) const WAVES: usize = 3;

/// An odd number n of phases 2πj/n. With even n the sine of the highest wave vanishes at all
/// phases.
pub(super) struct PhaseGrid {
    /// Phases, rad.
    pub angles: Vec<f64>,
    /// Matrix of d/dθ.
    pub derivative: DMatrix<f64>,
}

impl PhaseGrid {
    /// The grid that resolves wave numbers up to `waves`.
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

    /// Number of phases.
    pub fn len(&self) -> usize {
        self.angles.len()
    }

    /// Matrix of the shift θ ↦ θ − `delay` (rad).
    pub fn earlier(&self, delay: f64) -> DMatrix<f64> {
        let n = self.len();
        DMatrix::from_fn(n, n, |j, l| {
            // The Dirichlet kernel Σ cos kφ over all waves, divided by their number.
            let phase = self.angles[j] - delay - self.angles[l];
            (1.0 + 2.0 * (1..=n / 2).map(|k| (k as f64 * phase).cos()).sum::<f64>()) / n as f64
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Derivatives and shifts are exact up to the highest resolved wave number.
    #[test]
    fn resolved_waves_are_differentiated_and_shifted_exactly() {
        let grid = PhaseGrid::new(4);
        let error = |k: f64| {
            let wave = |phase: f64| (k * phase + 0.3).cos();
            let values = DVector::from_iterator(9, grid.angles.iter().map(|phase| wave(*phase)));
            let slopes = grid.angles.iter().map(|phase| -k * (k * phase + 0.3).sin());
            let earlier = grid.angles.iter().map(|phase| wave(phase - 0.7));
            let slope = (&grid.derivative * &values - DVector::from_iterator(9, slopes)).amax();
            slope.max((grid.earlier(0.7) * &values - DVector::from_iterator(9, earlier)).amax())
        };
        for k in 0..=4 {
            // Rounding of a sum of nine terms times the wave number.
            assert!(error(f64::from(k)) < 1e-13, "{k}: {}", error(f64::from(k)));
        }
        assert!(error(5.0) > 0.1);
    }
}
