//! The exact solution of one contact with Coulomb friction.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

/// Number of intervals of the direction of slip in which a solution is sought.
const DIRECTIONS: usize = 24;

/// The force of one contact, given the compliance and the gap and slip without force in the frame of its normal (first)
/// and its tangential directions. While the contact slides, its force has the size μ λ and opposes the slip: the
/// direction is a root of the component of the slip across the force.
pub(super) fn one_contact(compliance: &Matrix3<f64>, free: &Vector3<f64>, friction: f64) -> Vector3<f64> {
    let normal = Vector3::x() * (-free[0] / compliance[(0, 0)]).max(0.0);
    if free[0] >= 0.0 || friction == 0.0 {
        return if free[0] >= 0.0 { Vector3::zeros() } else { normal };
    }
    if let Some(sticking) = compliance.lu().solve(&-free)
        && sticking[0] > 0.0
        && sticking.yz().norm() <= friction * sticking[0]
    {
        return sticking;
    }
    // For a force in the direction `angle` of the cone: the slip across it and along it, and the force.
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let along = Vector3::new(1.0, friction * cos, friction * sin);
        let stiffness = (compliance * along)[0];
        let force = along * if stiffness > 0.0 { -free[0] / stiffness } else { f64::INFINITY };
        let slip = compliance * force + free;
        (slip[1] * sin - slip[2] * cos, slip[1] * cos + slip[2] * sin, force)
    };
    let mut best: Option<Vector3<f64>> = None;
    for i in 0..DIRECTIONS {
        let [mut low, mut high] = [i, i + 1].map(|i| TAU * i as f64 / DIRECTIONS as f64);
        let [first, last] = [at(low), at(high)];
        // The comparisons fail for NaN.
        if !(first.0 * last.0 <= 0.0 && (first.1 < 0.0 || last.1 < 0.0)) {
            continue;
        }
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (low + high);
            if first.0 * at(middle).0 <= 0.0 { high = middle } else { low = middle }
        }
        let (_, along, force) = at(0.5 * (low + high));
        if along <= 0.0 && best.is_none_or(|best| force.norm() < best.norm()) {
            best = Some(force);
        }
    }
    best.unwrap_or(normal)
}
