//! The law of one contact: unilateral contact with Coulomb friction, as an equation that is solved by Newton's method.
//!
//! With the gap g, the normal n, the slip s, the force P of normal part λ and tangential part Q, the law is (Alart and
//! Curnier, Comput. Methods Appl. Mech. Engrg. 92, 353–375, 1991)
//!
//! ```text
//! λ = τ⁺,   Q = proj(Q − k s, μ τ⁺),   τ = λ − k g,
//! ```
//!
//! with any k > 0 and the projection to the disc of a radius.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::support::Distance;

/// Gap between a place of the centre line and an obstacle: the distance minus the radius of the contact.
pub(super) type Gap = Distance;

/// State of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    Open,
    Sticking,
    Sliding,
}

/// The smoothing of the law: τ⁺ is replaced by (τ + √(τ² + 4ε²))/2 with the force ε (N), and the projection to the disc
/// of radius r by the analogous mean of the size of its argument and r, with the ratio d < 1. Both are zero for the
/// exact law.
///
/// With it λ k g = ε²: the solutions follow the central path of an interior point method.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Smoothing {
    pub force: f64,
    pub ratio: f64,
}

/// The law at a place r, for a force P and a place without slip.
pub(super) struct Law {
    pub status: Status,
    /// Whether the force depends on the place.
    pub active: bool,
    /// The excess of P over the force that the law requires, N.
    pub residual: Vector3<f64>,
    /// Its derivatives by P, by r, and by the place without slip.
    pub by_force: Matrix3<f64>,
    pub by_place: Matrix3<f64>,
    pub by_anchor: Matrix3<f64>,
}

impl Law {
    /// Evaluates the law for a force (N), the displacement (m) from the place without slip, a coefficient of friction
    /// and a scale `k` (N/m).
    pub fn new(
        gap: &Gap,
        force: &Vector3<f64>,
        displacement: &Vector3<f64>,
        (friction, k): (f64, f64),
        smoothing: Smoothing,
    ) -> Self {
        let Gap { value, normal: n, curvature } = *gap;
        let (identity, zero) = (Matrix3::identity(), Matrix3::zeros());
        let across = identity - n * n.transpose();
        let lambda = n.dot(force);
        let tau = lambda - k * value;
        if !(tau > 0.0) && smoothing.force == 0.0 {
            return Self {
                status: Status::Open,
                active: false,
                residual: *force,
                by_force: identity,
                by_place: zero,
                by_anchor: zero,
            };
        }
        // dλ = n · dP + P · dn with dn = ∇²g dr.
        let lambda_place: RowVector3<f64> = force.transpose() * curvature;
        let tau_place = lambda_place - n.transpose() * k;
        let root = tau.hypot(2.0 * smoothing.force);
        // The second form avoids cancellation for τ < 0.
        let push = if tau > 0.0 { 0.5 * (tau + root) } else { 2.0 * smoothing.force.powi(2) / (root - tau) };
        let by_tau = push / root;
        let tangential = force - n * lambda;
        let slip = across * displacement;
        let trial = tangential - slip * k;
        // Derivatives of the tangential part of a vector v by its normal: −n (v · dn) − (v · n) dn.
        let turning = |v: &Vector3<f64>| -(n * (v.transpose() * curvature) + curvature * n.dot(v));
        let trial_place = turning(force) - (across + turning(displacement)) * k;
        let Projection { part, by_trial, by_radius } = Projection::new(&trial, friction * push, smoothing.ratio);
        let status = match trial.norm() {
            _ if !(tau > 0.0) => Status::Open,
            size if size <= friction * push => Status::Sticking,
            _ => Status::Sliding,
        };
        let normal_tau = (n + by_radius * friction) * by_tau;
        Self {
            status,
            active: true,
            residual: force - n * push - trial * part,
            by_force: identity - normal_tau * n.transpose() - by_trial * across,
            by_place: -curvature * push - normal_tau * tau_place - by_trial * trial_place,
            by_anchor: -by_trial * across * k,
        }
    }
}

/// The projection of a vector v to the disc of radius r.
struct Projection {
    /// The size of the projection over that of v.
    part: f64,
    /// Its derivatives by v and by r.
    by_trial: Matrix3<f64>,
    by_radius: Vector3<f64>,
}

impl Projection {
    /// The size of the projection is ½ (|v| + r − √((|v| − r)² + 4 d² |v| r)).
    fn new(v: &Vector3<f64>, radius: f64, d: f64) -> Self {
        let (identity, size, square) = (Matrix3::identity(), v.norm(), d * d);
        let root = ((size - radius).powi(2) + 4.0 * square * size * radius).sqrt();
        if size == 0.0 || root == 0.0 {
            let part = if radius > 0.0 { 1.0 - square } else { 0.0 };
            return Self { part, by_trial: identity * part, by_radius: Vector3::zeros() };
        }
        let along = v / size;
        // The product of the roots of the quadratic equation avoids cancellation.
        let part = 2.0 * radius * (1.0 - square) / (size + radius + root);
        let by_size = 0.5 * (1.0 - (size - radius + 2.0 * square * radius) / root);
        let by_radius = 0.5 * (1.0 - (radius - size + 2.0 * square * size) / root);
        let by_trial = identity * part + along * along.transpose() * (by_size - part);
        Self { part, by_trial, by_radius: along * by_radius }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// The gap to a sphere of unit radius about the origin.
    fn sphere(place: &Vector3<f64>) -> Gap {
        let (norm, normal) = (place.norm(), place.normalize());
        let curvature = (Matrix3::identity() - normal * normal.transpose()) / norm;
        Gap { value: norm - 1.0, normal, curvature }
    }

    #[test]
    fn derivatives_of_the_law_are_those_of_its_residual() {
        let (place, k) = (Vector3::new(0.6, -0.5, 0.65), 1.7);
        let normal = place.normalize();
        // Contacts that are open, stick, slide, and slide without friction.
        for (force, anchor, friction, status) in [
            (normal * -0.3 + Vector3::x() * 0.1, place, 0.5, Status::Open),
            (normal * 0.9 + Vector3::x() * 0.02, place + Vector3::y() * 0.01, 0.5, Status::Sticking),
            (normal * 0.9 + Vector3::x() * 0.4, place + Vector3::y() * 0.5, 0.5, Status::Sliding),
            (normal * 0.9 + Vector3::x() * 0.4, place + Vector3::y() * 0.5, 0.0, Status::Sliding),
        ] {
            for smoothing in [Smoothing::default(), Smoothing { force: 0.2, ratio: 0.3 }] {
                let law = |force: &Vector3<f64>, place: &Vector3<f64>, anchor: &Vector3<f64>| {
                    Law::new(&sphere(place), force, &(place - anchor), (friction, k), smoothing)
                };
                let here = law(&force, &place, &anchor);
                if smoothing == Smoothing::default() {
                    assert_eq!(here.status, status);
                }
                // Central differences have errors of order h² = 1e-10.
                let h = 1e-5;
                for axis in 0..3 {
                    let by = Vector3::ith(axis, h);
                    let difference = |ahead: Law, behind: Law| (ahead.residual - behind.residual) / (2.0 * h);
                    for (derivative, difference) in [
                        (
                            here.by_force,
                            difference(law(&(force + by), &place, &anchor), law(&(force - by), &place, &anchor)),
                        ),
                        (
                            here.by_place,
                            difference(law(&force, &(place + by), &anchor), law(&force, &(place - by), &anchor)),
                        ),
                        (
                            here.by_anchor,
                            difference(law(&force, &place, &(anchor + by)), law(&force, &place, &(anchor - by))),
                        ),
                    ] {
                        let column = derivative.column(axis).into_owned();
                        assert_relative_eq!(column, difference, epsilon = 1e-8, max_relative = 1e-8);
                    }
                }
            }
        }
    }
}
