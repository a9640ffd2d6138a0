//! What is slow in a path: growth, the course of the day.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::OrbitError;
use super::path::PlanePath;
use crate::error::ParameterError;

/// Weights reach so many standard deviations: there they are 4e-6.
const REACH: f64 = 5.0;
/// Solution of (1 + u) e⁻ᵘ = 1/2: where half of a wave is drift.
const HALF: f64 = 1.678_346_990_016_660_7;
/// Of the spread of squares in time this must be left beside a line, or a parabola is rounding: two positions leave none.
const SPREAD: f64 = 1e-10;
/// Positions that a parabola needs, and one more.
const LEAST: usize = 4;

impl PlanePath {
    /// The slow part of a path, at the same times: at each of them the value of the parabola that fits the positions around it best,
    /// with weights that fall off as a Gaussian (local quadratic least squares; Cleveland and Loader 1996). It asks for no even
    /// sampling. A wave of a period P is in it by (1 + u) e⁻ᵘ, u = 1.678 (`period`/P)², away from the ends and from gaps:
    ///
    /// | P over `period` | 1/2 | 1 | 2 | 4 | 10 |
    /// |---|---|---|---|---|---|
    /// | in the drift | 0.009 | 1/2 | 0.93 | 0.995 | 0.9999 |
    ///
    /// Nearer to an end than `period`/2 more of fast motion is in it, at the end itself about as much as of a motion that is twice as
    /// slow. Parabolas are in it entirely. It takes time in proportion to the number of positions and to that in 2.9 periods.
    ///
    /// # Errors
    /// A period that is not positive, or fewer than four positions.
    pub fn drift(&self, period: f64) -> Result<Self, OrbitError> {
        ParameterError::positive("period at which drift begins", period)?;
        let positions = self.times.len();
        if positions < LEAST {
            return Err(OrbitError::TooFew { positions, needed: LEAST });
        }
        let width = period * (2.0 * HALF).sqrt() / std::f64::consts::TAU;
        let mut begin = 0;
        let fitted = self.times.iter().enumerate().map(|(i, t)| {
            while t - self.times[begin] > REACH * width {
                begin += 1;
            }
            let near = self.times[begin..].iter().zip(&self.positions[begin..]);
            let near = near.map(|(other, p)| ((other - t) / width, p)).take_while(|(u, _)| *u <= REACH);
            parabola(near, &self.positions[i])
        });
        Ok(Self { times: self.times.clone(), positions: fitted.collect() })
    }

    /// The path without its slow part: its positions less those of [`drift`](Self::drift), which says what is left of which period. Of
    /// periods shorter than half of the given one, 99 % or more.
    ///
    /// # Errors
    /// Those of [`drift`](Self::drift).
    pub fn without_drift(&self, period: f64) -> Result<Self, OrbitError> {
        let drift = self.drift(period)?;
        let positions = self.positions.iter().zip(&drift.positions).map(|(p, slow)| p - slow).collect();
        Ok(Self { times: drift.times, positions })
    }
}

/// How much of a wave of a period (s) is in the drift.
pub(super) fn in_drift(period: f64, drift: f64) -> f64 {
    let u = HALF * (drift / period).powi(2);
    (1.0 + u) * (-u).exp()
}

/// The value in the middle of the parabola that fits best, or of what is as smooth as so few positions allow. Distances are in standard
/// deviations of the weights; positions are taken from that in the middle on, which keeps digits.
fn parabola<'a>(near: impl Iterator<Item = (f64, &'a Vector2<f64>)>, middle: &Vector2<f64>) -> Vector2<f64> {
    let (mut moments, mut right) = ([0.0; 5], [Vector2::zeros(); 3]);
    for (u, position) in near {
        let mut term = (-0.5 * u * u).exp();
        for (k, moment) in moments.iter_mut().enumerate() {
            *moment += term;
            if let Some(right) = right.get_mut(k) {
                *right += (position - middle) * term;
            }
            term *= u;
        }
    }
    let matrix = Matrix3::from_fn(|i, j| moments[i + j]);
    // A position alone between gaps has no parabola, and is its own drift.
    let factors = matrix.cholesky().filter(|factors| factors.l_dirty()[(2, 2)].powi(2) > SPREAD * moments[4]);
    let Some(inverse) = factors.map(|factors| factors.solve(&Vector3::x())) else { return *middle };
    let change = right[0] * inverse[0] + right[1] * inverse[1] + right[2] * inverse[2];
    if change.iter().all(|x| x.is_finite()) { middle + change } else { *middle }
}
