//! The law of one contact: unilateral contact with Coulomb friction, as an equation that is solved
//! by Newton's method.
//!
//! With the gap g, the normal n, the slip s, the force P of normal part λ and tangential part Q,
//! the law is (Alart and Curnier, Comput. Methods Appl. Mech. Engrg. 92, 353–375, 1991)
//!
//! ```text
//! λ = τ⁺,   Q = proj(Q − k s, μ τ⁺),   τ = λ − k g,
//! ```
//!
//! with any k > 0 and the projection to the disc of a radius.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::support::Distance;

/// Gap between a place of the centre line and an obstacle: the distance minus the radius of the
/// contact.
pub(super) type Gap = Distance;

/// State of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    Open,
    Sticking,
    Sliding,
}

/// The law at a place r, for a force P and a place without slip.
pub(super) struct Law {
    pub status: Status,
    /// The excess of P over the force that the law requires, N.
    pub residual: Vector3<f64>,
    /// Its derivatives by P, by r, and by the place without slip.
    pub by_force: Matrix3<f64>,
    pub by_place: Matrix3<f64>,
    pub by_anchor: Matrix3<f64>,
}

impl Law {
    /// Evaluates the law for a force (N), the displacement (m) from the place without slip, a
    /// coefficient of friction and a scale `k` (N/m).
    pub fn new(
        gap: &Gap,
        force: &Vector3<f64>,
        displacement: &Vector3<f64>,
        friction: f64,
        k: f64,
    ) -> Self {
        let Gap {
            value,
            normal: n,
            curvature,
        } = *gap;
        let (identity, zero) = (Matrix3::identity(), Matrix3::zeros());
        let across = identity - n * n.transpose();
        let lambda = n.dot(force);
        let tau = lambda - k * value;
        if !(tau > 0.0) {
            return Self {
                status: Status::Open,
                residual: *force,
                by_force: identity,
                by_place: zero,
                by_anchor: zero,
            };
        }
        // dλ = n · dP + P · dn with dn = ∇²g dr.
        let lambda_place: RowVector3<f64> = force.transpose() * curvature;
        let tau_place = lambda_place - n.transpose() * k;
        let tangential = force - n * lambda;
        let slip = across * displacement;
        let trial = tangential - slip * k;
        // Derivatives of the tangential part of a vector v by its normal: −n (v · dn) − (v · n) dn.
        let turning = |v: &Vector3<f64>| -(n * (v.transpose() * curvature) + curvature * n.dot(v));
        let trial_place = turning(force) - (across + turning(displacement)) * k;
        let (size, radius) = (trial.norm(), friction * tau);
        // The projection is `trial * part`, with derivatives by the trial and by the radius.
        let (status, part, by_trial, by_radius) = if size <= radius {
            // Without friction the disc is a point.
            let part = if radius > 0.0 { 1.0 } else { 0.0 };
            (Status::Sticking, part, identity * part, Vector3::zeros())
        } else {
            let (along, part) = (trial / size, radius / size);
            (
                Status::Sliding,
                part,
                (identity - along * along.transpose()) * part,
                along,
            )
        };
        let by_tau = n + by_radius * friction;
        Self {
            status,
            residual: force - n * tau - trial * part,
            by_force: identity - by_tau * n.transpose() - by_trial * across,
            by_place: -curvature * tau - by_tau * tau_place - by_trial * trial_place,
            by_anchor: -by_trial * across * k,
        }
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
        Gap {
            value: norm - 1.0,
            normal,
            curvature,
        }
    }

    #[test]
    fn derivatives_of_the_law_are_those_of_its_residual() {
        let (place, k) = (Vector3::new(0.6, -0.5, 0.65), 1.7);
        let normal = place.normalize();
        // Contacts that are open, stick, slide, and slide without friction.
        for (force, anchor, friction, status) in [
            (normal * -0.3 + Vector3::x() * 0.1, place, 0.5, Status::Open),
            (
                normal * 0.9 + Vector3::x() * 0.02,
                place + Vector3::y() * 0.01,
                0.5,
                Status::Sticking,
            ),
            (
                normal * 0.9 + Vector3::x() * 0.4,
                place + Vector3::y() * 0.5,
                0.5,
                Status::Sliding,
            ),
            (
                normal * 0.9 + Vector3::x() * 0.4,
                place + Vector3::y() * 0.5,
                0.0,
                Status::Sliding,
            ),
        ] {
            let law = |force: &Vector3<f64>, place: &Vector3<f64>, anchor: &Vector3<f64>| {
                Law::new(&sphere(place), force, &(place - anchor), friction, k)
            };
            let here = law(&force, &place, &anchor);
            assert_eq!(here.status, status);
            // Central differences have errors of order h² = 1e-10.
            let h = 1e-5;
            for axis in 0..3 {
                let by = Vector3::ith(axis, h);
                let difference =
                    |ahead: Law, behind: Law| (ahead.residual - behind.residual) / (2.0 * h);
                for (derivative, difference) in [
                    (
                        here.by_force,
                        difference(
                            law(&(force + by), &place, &anchor),
                            law(&(force - by), &place, &anchor),
                        ),
                    ),
                    (
                        here.by_place,
                        difference(
                            law(&force, &(place + by), &anchor),
                            law(&force, &(place - by), &anchor),
                        ),
                    ),
                    (
                        here.by_anchor,
                        difference(
                            law(&force, &place, &(anchor + by)),
                            law(&force, &place, &(anchor - by)),
                        ),
                    ),
                ] {
                    let column = derivative.column(axis).into_owned();
                    assert_relative_eq!(column, difference, epsilon = 1e-8, max_relative = 1e-8);
                }
            }
        }
    }

    #[test]
    fn contact_without_friction_and_slip_has_no_tangential_stiffness() {
        let law = Law::new(
            &sphere(&(Vector3::z() * 0.99)),
            &(Vector3::z() * 0.9),
            &Vector3::zeros(),
            0.0,
            1.7,
        );
        assert_eq!(law.by_anchor, Matrix3::zeros());
        assert_eq!(
            law.by_force.fixed_view::<2, 2>(0, 0),
            Matrix3::identity().fixed_view::<2, 2>(0, 0)
        );
    }
}
