//! Errors of equilibria.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::check::LawError;
use crate::error::{Number, ParameterError, debug_by_display, ensure};
use crate::rod::RodError;

/// Rotation of a frame (rad) below which a step of a search is rounding: that of the sums over some
/// hundreds of nodes.
const ROUNDING: f64 = 1e-13;
/// Causes of a step that is rounding.
const HINT: &str = "; this step is rounding: perhaps the tolerance is too small, or the rod, which does not stretch, \
                    is held at places that are as far apart as the part between them is long";
/// Causes of a contact whose condition is violated.
const CAUSES: &str =
    ", perhaps since the search began inside the obstacle, or since a hold is too far around it";

/// Contact that violates its condition at the end of a search without success.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactViolation {
    /// Index of the obstacle among those of the support, counted from zero.
    pub obstacle: usize,
    /// Arc length s of the place from the base, m.
    pub arc_length: f64,
    /// Distance by which the condition is violated, m: the penetration of the surface, or the
    /// distance from it of a place on which the obstacle exerts a force. Positive.
    pub violation: f64,
}

impl std::fmt::Display for ContactViolation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            obstacle,
            arc_length,
            violation,
        } = self;
        let (place, by) = (Number(*arc_length), Number(*violation));
        write!(
            f,
            "the contact with obstacle {obstacle} at {place:.4} m from the base is violated by {by:.2} m"
        )
    }
}

/// Error of a search for an equilibrium. The rod has not changed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// The iteration did not converge. A better initial guess, a finer mesh or a smaller load may
    /// help.
    #[error(
        "no equilibrium after {iterations} iterations: {}{}; shorter steps, more elements, a smaller load, a larger \
         tolerance or a larger `max_iterations` may help",
        describe_search(*step, *residual, *force),
        contact.map_or(String::new(), |worst| format!("; {worst}{CAUSES}"))
    )]
    NoConvergence {
        /// Number of Newton iterations.
        iterations: usize,
        /// The largest rotation of the last step, rad; infinite before the first step.
        step: f64,
        /// The largest unbalanced couple, N m.
        residual: f64,
        /// The largest force in the rod, N.
        force: f64,
        /// The contact whose condition is violated most; `None` without contacts, and for a solver
        /// that does not report it.
        contact: Option<ContactViolation>,
    },
    /// Supports do not balance the load of a rod whose base is free.
    #[error(
        "nothing holds the free base against a force of ({:.4}, {:.4}, {:.4}) N: add a hold, a spring or a contact \
         that bears it",
        Number(force.x), Number(force.y), Number(force.z)
    )]
    NotHeld {
        /// Resultant force of the load and of the reactions on the rod at the end of the search, in
        /// the fixed frame, N.
        force: Vector3<f64>,
    },
    /// An element would rotate by π, where its rotation vector is discontinuous. Shorter elements
    /// are needed.
    #[error("element {element}, counted from the base, would rotate by π: {}", describe_fold(*intrinsic))]
    Folded {
        /// The element, counted from zero at the base.
        element: usize,
        /// Rotation of the element by the magnitude of its intrinsic strain alone, rad. It is the
        /// cause if it is not much less than π, and the load otherwise.
        intrinsic: f64,
    },
    /// The search has rotated the frame of an elastic joint to about π, where its rotation vector
    /// is discontinuous.
    #[error(
        "no equilibrium: the search has rotated the frame of the elastic joint at {:.4} m from the base by {:.4} rad; at \
         π its rotation vector, and with it the couple, is discontinuous; a frame of the joint closer to that of the \
         rod, or a smaller couple, may help",
        Number(*arc_length), Number(*turn)
    )]
    JointTurned {
        /// Arc length of the joint, m.
        arc_length: f64,
        /// Rotation from the frame of the joint to that of the rod, rad.
        turn: f64,
    },
    /// The only equilibrium found is unstable.
    #[error(
        "the equilibrium found is unstable, with {negative} negative eigenvalues of its tangent: the rod buckles or \
         falls over; shorter steps, a smaller load, or a solver that is not `stable_only` may help"
    )]
    Unstable {
        /// Number of negative eigenvalues.
        negative: usize,
    },
    /// The rod is compressed to length zero at some place.
    #[error(
        "the rod is crushed: its stretch is {:.4} at {:.4} m from the base but must be positive; reduce the force \
         along the rod or increase the stiffness",
        Number(*stretch), Number(*arc_length)
    )]
    Crushed {
        /// The stretch v3, which should be positive.
        stretch: f64,
        /// Arc length of the place, m.
        arc_length: f64,
    },
    /// An input or a value of an elastic law is not finite.
    #[error(
        "the {what} is not finite: check the elastic law, the strains, the load and the supports"
    )]
    NotFinite {
        /// The quantity that is not finite.
        what: &'static str,
    },
    /// A solver has changed more of the rod than its shape.
    #[error(
        "the equilibrium solver has changed {what} of the rod, but may change only its shape, with `Rod::set_shape`"
    )]
    Changed {
        /// What was changed.
        what: &'static str,
    },
    /// The shape that a solver has returned is not in equilibrium.
    #[error(
        "the shape that the equilibrium solver returns is not in equilibrium: Newton's method rotates its frames by up \
         to {:.2} rad, and the solver reports an error of {:.2} rad; compare the couples of `RodEnergy` and the \
         elastic law with those of the solver",
        Number(*rotation), Number(*reported)
    )]
    Unbalanced {
        /// Largest rotation of a frame to the equilibrium that Newton's method finds from the
        /// shape, rad.
        rotation: f64,
        /// Error of the shape that the solver has reported, rad.
        reported: f64,
    },
    /// A solver has computed a shape that the rod refuses.
    #[error(transparent)]
    Shape(#[from] RodError),
    /// The search failed, and the methods of the elastic law contradict each other, as
    /// [`check`](crate::check) finds.
    #[error(transparent)]
    Law(#[from] Box<LawError>),
    /// A setting or an input is out of range: a tolerance, a stiffness, a load on a rod that is
    /// solved as unloaded, or a number of elements that exceeds the memory.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

debug_by_display!(EquilibriumError);

/// The result of a part of a search.
pub(super) type Outcome<T = ()> = Result<T, EquilibriumError>;

/// Describes the end of a search: the largest rotation of its last step (rad), which is infinite or
/// zero without a step, the largest unbalanced couple (N m), which is zero before an evaluation,
/// and the largest force (N).
fn describe_search(step: f64, couple: f64, force: f64) -> String {
    let moved = if step > 0.0 && step.is_finite() {
        format!("the last step rotated a frame by {:.4} rad", Number(step))
    } else {
        "no step was accepted".to_owned()
    };
    if couple == 0.0 {
        return moved;
    }
    if !(couple.is_finite() && force.is_finite()) {
        return format!("{moved}, and the unbalanced couples are not finite");
    }
    let [couple, force] = [couple, force].map(Number);
    let balance = format!(
        "the largest unbalanced couple is {couple:.4} N m, and the largest force {force:.4} N"
    );
    let hint = if (f64::MIN_POSITIVE..ROUNDING).contains(&step) {
        HINT
    } else {
        ""
    };
    format!("{moved}, {balance}{hint}")
}

impl EquilibriumError {
    /// Returns an error for a quantity that is not finite.
    pub(super) fn finite(ok: bool, what: &'static str) -> Outcome {
        ensure(ok, Self::NotFinite { what })
    }

    /// Whether a smaller load, a better initial guess or a smaller time step may succeed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        matches!(
            self,
            Self::NoConvergence { .. }
                | Self::NotHeld { .. }
                | Self::JointTurned { .. }
                | Self::Unstable { .. }
                | Self::Folded { .. }
                | Self::Shape(RodError::Folded { .. })
                // A law that is used only in a range may be inconsistent outside.
                | Self::Law(_)
        )
    }
}

/// Describes the cause of a fold of an element that its intrinsic strain alone rotates by an angle
/// (rad), and the remedies.
fn describe_fold(intrinsic: f64) -> String {
    if intrinsic < FRAC_PI_2 {
        let check = "check the units of length, radius, stiffness and load";
        return format!(
            "{check}; if the shape is as expected, take more elements or a smaller load"
        );
    }
    let (turn, remedy) = (
        Number(intrinsic),
        "if the shape is as expected, take more elements",
    );
    let check = "check the tropism laws, their sensitivities, a strain that was set (1/m), and the units of growth \
                 time, length and radius";
    format!("its intrinsic strain alone rotates it by {turn:.3} rad; {check}; {remedy}")
}
