//! The direction in which a tip moves.

use std::f64::consts::TAU;

use super::OrbitError;
use super::path::PlanePath;

impl PlanePath {
    /// The direction angle of the velocity at every position: ψ_g of Bastien and Meroz (2016), from the first coordinate towards the
    /// second, unwrapped (rad). It grows by 2π in every turn counterclockwise, falls by 2π in one clockwise, and jumps to and fro by π where
    /// a tip swings in a plane. Velocities are differences of both neighbours, so noise that is not small against a step has to be taken
    /// away before: [`Tracking::direction`](super::Tracking::direction) does. A tip that stands still keeps its last direction.
    ///
    /// # Errors
    /// Fewer than two positions.
    pub fn direction(&self) -> Result<Vec<f64>, OrbitError> {
        let n = self.positions.len();
        if n < 2 {
            return Err(OrbitError::TooFew { positions: n, needed: 2 });
        }
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
        // A tip that has not moved yet has the direction in which it will.
        let first = angles.iter().flatten().next().copied().unwrap_or(0.0);
        Ok(angles.into_iter().map(|angle| angle.unwrap_or(first)).collect())
    }
}

/// An angle and so many turns that it is nearest to another one.
pub(super) fn nearest_turn(angle: f64, other: f64) -> f64 {
    angle + TAU * ((other - angle) / TAU).round()
}
