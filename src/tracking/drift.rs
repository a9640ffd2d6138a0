//! Drift of a tip track: motion that is slower than a given period, as growth and the course of the day.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::statistics::GAMMA_MEDIAN;
use super::{Track, TrackingError};
use crate::error::ParameterError;

impl Track {
    /// The drift of a track at its own times, by local quadratic regression with Gaussian weights (Cleveland and
    /// Loader 1996). Times need not be evenly spaced. Away from the ends and from gaps the drift contains the share
    /// (1 + u) e⁻ᵘ of a wave with period P, with u = 1.678 (`period`/P)²:
    ///
    /// | P over `period` | 1/2 | 1 | 2 | 4 | 10 |
    /// |---|---|---|---|---|---|
    /// | share in the drift | 0.009 | 1/2 | 0.93 | 0.995 | 0.9999 |
    ///
    /// At distances below `period`/2 from an end the drift contains more fast motion; at the end itself about as
    /// much as of a motion twice as slow. A parabola is drift entirely. The time to compute it is proportional to
    /// the number of positions and to their number in 2.9 periods.
    ///
    /// # Errors
    /// A period that is not positive or longer than the track, or fewer than four positions.
    pub fn drift(&self, period: f64) -> Result<Self, TrackingError> {
        ParameterError::positive("period at which drift begins", period, "s")?;
        // One more than the number of coefficients of a parabola.
        TrackingError::unless_positions(4, self.times.len())?;
        let duration = self.times[self.times.len() - 1] - self.times[0];
        TrackingError::unless_at_least(period, "duration of the track (s)", duration)?;
        let width = period * (2.0 * GAMMA_MEDIAN).sqrt() / std::f64::consts::TAU;
        // The weights are 4e-6 at five standard deviations, where they are truncated.
        let reach = 5.0;
        let mut begin = 0;
        let fitted = self.times.iter().enumerate().map(|(i, t)| {
            while t - self.times[begin] > reach * width {
                begin += 1;
            }
            let near = self.times[begin..].iter().zip(&self.positions[begin..]);
            let near = near.map(|(other, p)| ((other - t) / width, p)).take_while(|(u, _)| *u <= reach);
            parabola(near, &self.positions[i])
        });
        Ok(Self { times: self.times.clone(), positions: fitted.collect() })
    }

    /// The track less its [`drift`](Self::drift). It contains at least 99 % of waves with less than half of the
    /// given period.
    ///
    /// # Errors
    /// The errors of [`drift`](Self::drift).
    pub fn without_drift(&self, period: f64) -> Result<Self, TrackingError> {
        let drift = self.drift(period)?;
        let positions = self.positions.iter().zip(&drift.positions).map(|(p, slow)| p - slow).collect();
        Ok(Self { times: drift.times, positions })
    }
}

/// The share of a wave with a period (s) that the drift for the period `drift` (s) contains. It is a half if both
/// are equal.
pub(super) fn in_drift(period: f64, drift: f64) -> f64 {
    let u = GAMMA_MEDIAN * (drift / period).powi(2);
    (1.0 + u) * (-u).exp()
}

/// The value at zero of the parabola that fits neighbouring positions best. Distances are in standard deviations of
/// the weights. Positions are taken relative to that in the `middle`, which avoids cancellation.
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
    // One or two positions between gaps do not determine a parabola: its last pivot is rounding. Such positions are
    // their own drift.
    let determined = |last: f64| last.powi(2) > f64::EPSILON.sqrt() * moments[4];
    let factors = matrix.cholesky().filter(|factors| determined(factors.l_dirty()[(2, 2)]));
    let Some(inverse) = factors.map(|factors| factors.solve(&Vector3::x())) else { return *middle };
    let change = right[0] * inverse[0] + right[1] * inverse[1] + right[2] * inverse[2];
    if change.iter().all(|x| x.is_finite()) { middle + change } else { *middle }
}
