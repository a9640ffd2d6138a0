//! Errors of a search that does not converge.

use std::f64::consts::PI;

use nalgebra::Matrix3;

use super::law::Status;
use super::search::HeldSearch;
use super::settings;
use crate::equilibrium::{ContactViolation, EquilibriumError};

/// Smallest unbalanced force on a free base, relative to the largest force in the rod, for which
/// the rod is not held.
const LOOSE: f64 = 1e-3;

/// Smallest determinant of Σ d dᵀ over the unit vectors d along which holds act, for which they
/// determine the position of a free base. Two planes that differ by 1e-3 rad have 1e-6.
const CLOSED: f64 = 1e-6;

impl HeldSearch<'_> {
    /// The contact that violates its condition most; `None` if none does by more than rounding.
    fn worst_contact(&self) -> Option<ContactViolation> {
        let each = self.candidates.iter().map(|at| {
            let penetration = -at.gap.value;
            let violation = if at.status == Status::Open {
                penetration
            } else {
                penetration.abs()
            };
            ContactViolation {
                obstacle: self.obstacles.name_of(at.obstacle),
                arc_length: at.arc_length,
                violation,
            }
        });
        let worst = each.max_by(|a, b| a.violation.total_cmp(&b.violation))?;
        (worst.violation > settings::ROUNDING * self.length && worst.violation.is_finite())
            .then_some(worst)
    }

    /// Whether the unbalanced force on a free base is too large for an equilibrium.
    pub(super) fn floats(&self) -> bool {
        let (largest, rounding) = (
            self.body.force().largest(),
            settings::ROUNDING * self.force_scale(),
        );
        let free = self.body.system().joints.free_base.is_some();
        free && self.body.force().at_base().norm() > (LOOSE * largest).max(rounding)
    }

    /// The error of a search that did not converge, with the size of its last step (rad).
    pub(super) fn not_found(&self, step: f64) -> EquilibriumError {
        let closed: Matrix3<f64> = self
            .sites
            .iter()
            .flat_map(|site| &site.fixed)
            .map(|d| d * d.transpose())
            .sum();
        // A rod whose position is determined by holds is held, although the search may not have
        // balanced it yet.
        if self.floats() && !(closed.determinant() > CLOSED) {
            return EquilibriumError::NotHeld {
                force: self.body.force().at_base(),
            };
        }
        EquilibriumError::NoConvergence {
            iterations: self.found.iterations,
            step,
            residual: self.body.system().unbalanced,
            force: self.body.force().largest(),
            contact: self.worst_contact(),
        }
    }

    /// Replaces the error of a search without convergence if a step may have rotated the frame of an
    /// elastic joint past π.
    pub(super) fn with_cause(&self, error: EquilibriumError) -> EquilibriumError {
        match (error, self.largest_joint_turn) {
            (EquilibriumError::NoConvergence { .. }, Some((turn, arc_length)))
                if turn > PI - settings::LARGEST_TURN =>
            {
                EquilibriumError::JointTurned { arc_length, turn }
            }
            (error, _) => error,
        }
    }
}
