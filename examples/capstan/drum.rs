//! A rotating drum, and the closed form of the tension of a rod that is wound on it.

use morphorod::support::{Cylinder, Distance, Obstacle};
use nalgebra::Vector3;

/// Radius of the circle of the centre line on the drum, m.
pub const CIRCLE: f64 = 2.5e-3;
/// Rotation of the drum in a step, rad. All of the contact slides if the drum moves faster than the
/// rod.
pub const TURN: f64 = 0.002;

/// A drum that rotates about the axis of its cylinder.
pub struct Drum {
    pub cylinder: Cylinder,
    /// Angular velocity, rad/s.
    pub rate: f64,
}

impl Obstacle for Drum {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.cylinder.distance(place, time)
    }

    fn velocity(&self, place: &Vector3<f64>, _: f64) -> Vector3<f64> {
        self.cylinder.along.cross(&(place - self.cylinder.through)) * self.rate
    }
}

/// Ratio of the tensions of both tails while all of the contact slides, by fixed-point iteration
/// from the initial guess `ratio`.
///
/// In the contact the tension T grows by dT/ds = μ T/Rc with the coefficient of friction μ and the
/// radius Rc of the centre line. The tails are elasticas: they lift off where they still have to
/// turn by δ with cos δ = 1 − B/(2 Rc² F) for their tension F and the bending stiffness B. At each
/// lift-off there is a concentrated force, which has friction, too. The index 0 denotes the slack
/// tail, the index 1 the other one:
///
/// ```text
/// F1 (cos δ1 − μ sin δ1) = F0 (cos δ0 + μ sin δ0) exp(μ (Φ − δ0 − δ1)).
/// ```
///
/// `angle` is the angle Φ between the asymptotes of the tails (rad), `slack` the tension F0 over
/// B/Rc².
pub fn closed_form(friction: f64, angle: f64, slack: f64, mut ratio: f64) -> f64 {
    let lift_off = |tension: f64| f64::acos(1.0 - 0.5 / tension);
    let low = lift_off(slack);
    for _ in 0..50 {
        let high = lift_off(ratio * slack);
        let growth = (friction * (angle - low - high)).exp();
        ratio = (low.cos() + friction * low.sin()) * growth / (high.cos() - friction * high.sin());
    }
    ratio
}
