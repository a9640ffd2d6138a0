//! Direction of motion of a tip.

use std::f64::consts::TAU;

use super::{Track, TrackingError};

impl Track {
    /// The direction angle of the velocity at every position: ψ_g of Bastien and Meroz (2016), from the first
    /// coordinate towards the second, unwrapped (rad). It increases by 2π in a counterclockwise turn, decreases by
    /// 2π in a clockwise one, and changes by ±π where a tip swings in a plane. Velocities are differences of both
    /// neighbours. Noise that is not small against a step should be removed before;
    /// [`Nutation::direction`](super::Nutation::direction) does so. A tip at rest keeps its last direction.
    ///
    /// # Errors
    /// Fewer than two positions.
    pub fn direction(&self) -> Result<Vec<f64>, TrackingError> {
        let n = self.positions.len();
        TrackingError::unless_positions(2, n)?;
        let velocity = |i: usize| self.positions[(i + 1).min(n - 1)] - self.positions[i.saturating_sub(1)];
        let mut last: Option<f64> = None;
        let mut angles: Vec<Option<f64>> = Vec::with_capacity(n);
        for i in 0..n {
            let v = velocity(i);
            if v.x != 0.0 || v.y != 0.0 {
                let angle = v.y.atan2(v.x);
                last = Some(last.map_or(angle, |last| nearest_turn(angle, last)));
            }
            angles.push(last);
        }
        // Before its first motion the tip has the direction of that motion.
        let first = angles.iter().flatten().next().copied().unwrap_or(0.0);
        Ok(angles.into_iter().map(|angle| angle.unwrap_or(first)).collect())
    }
}

/// The angle that differs from `angle` by whole turns and is nearest to `other`.
pub(super) fn nearest_turn(angle: f64, other: f64) -> f64 {
    angle + TAU * ((other - angle) / TAU).round()
}
