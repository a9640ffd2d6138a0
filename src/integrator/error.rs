//! Errors of integrators.

use crate::check::describe_type;
use crate::equilibrium::EquilibriumError;
use crate::error::{Number, ParameterError, debug_by_display, ensure};

/// Result of an integrator or of a part of a run.
pub(super) type Outcome<T = ()> = Result<T, IntegrationError>;

/// Largest number of elements into which the tissue that leaves the growth zone in one step is
/// divided.
pub(super) const MAX_PARTS: f64 = 1024.0;

/// Largest growth of a shoot in a call, in lengths of its growth zone: that of 2.3 years with a
/// growth time of 20 h. Steps and elements are proportional to it, and the work to its square, so
/// that more growth takes hours: the unit of the growth time is wrong.
pub(super) const MAX_ZONES: f64 = 1000.0;

/// Reason why a call of an integrator failed. The state of the shoot is the one before the call.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationError {
    /// A parameter or setting is out of range, or the state does not fit the laws of the shoot.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No equilibrium was found.
    #[error("at {} s: {error}", Number(*time))]
    Equilibrium {
        /// Time of the equilibrium, s.
        time: f64,
        /// Error of the equilibrium solver.
        error: EquilibriumError,
    },
    /// The corrections of an implicit step did not converge.
    #[error(
        "the step to {} s did not converge: its last correction changed an angle by {:.4} rad, which exceeds the \
         tolerance; take a shorter step, more corrections or a larger tolerance",
        Number(*time), Number(*change)
    )]
    NotConverged {
        /// End of the step, s.
        time: f64,
        /// Largest change of an angle in the last correction, rad.
        change: f64,
    },
    /// A part of a [`TimeStep`](super::TimeStep) is missing.
    #[error("the step to {} s lacks its {missing}, which must be computed before this part", Number(*time))]
    Incomplete {
        /// End of the step, s.
        time: f64,
        /// The part that must precede the call.
        missing: &'static str,
    },
    /// The laws' variables at a material point could not be integrated over the step.
    #[error(
        "the variables of the tropism laws at material point {point} cannot be integrated to {} s: they change too \
         fast for this step or grow without bound; take a shorter step, or check the rates and time constants of the \
         laws",
        Number(*time)
    )]
    Variables {
        /// End of the step, s.
        time: f64,
        /// Index of the point, counted from the base.
        point: usize,
    },
    /// The tissue that leaves the growth zone in a step would be divided into more than 1024
    /// elements.
    #[error(
        "from {} s on a step of {} s would create more than {MAX_PARTS} mature elements: take a shorter step, or \
         check the unit of the growth rate (1/s)",
        Number(*time), Number(*step)
    )]
    GrowsTooFast {
        /// Start of the step, s.
        time: f64,
        /// Length of the step, s.
        step: f64,
    },
    /// The shoot would grow by more than 1000 lengths of its growth zone in a call. The work
    /// increases with the square of this number.
    #[error(
        "from {} s to {} s the shoot would grow by {:.4} lengths of its growth zone, and a call permits {MAX_ZONES}: \
         check the unit of the growth time (s), or advance in several calls",
        Number(*from), Number(*until), Number(*zones)
    )]
    GrowsTooFar {
        /// Time that was reached, s.
        from: f64,
        /// End of the call, s.
        until: f64,
        /// Elongation over the length of the growth zone.
        zones: f64,
    },
    /// Growth stretches an element so unevenly that its Gauss points do not resolve it.
    #[error(
        "growth up to {} s stretches one end of element {element} {} times as much as the other, which its material \
         points do not resolve: take more elements or a shorter step, or compare `flow` and `exit_time` of the growth \
         law with its rate by `check::growth_law`",
        Number(*time), describe_ratio(*ratio)
    )]
    Uneven {
        /// End of the step, s.
        time: f64,
        /// Index of the element, counted from the base.
        element: usize,
        /// Ratio of the largest to the smallest length per coordinate at the points of the element.
        ratio: f64,
    },
    /// The scene rotates the base, or the axis of its hinge, too far in a step: between the ends of
    /// steps stimuli are interpolated. A gravity that rotates is not examined.
    #[error(
        "in the step to {} s the base rotates by {angle:.2} rad: take steps of at most 1/20 of a rotation, and \
         announce a sudden rotation by `Scene::next_discontinuity`",
        Number(*time)
    )]
    BaseTurns {
        /// End of the step, s.
        time: f64,
        /// Rotation of the base in the step, rad.
        angle: f64,
    },
    /// The work of a call exceeds its limit.
    #[error(
        "at {} s the work exceeds its limit `max_work` of {limit} evaluations of the forces in the rod: increase \
         it, or take longer steps",
        Number(*time)
    )]
    WorkLimit {
        /// Time that was reached, s.
        time: f64,
        /// The limit.
        limit: usize,
    },
    /// The rod is not slender at a place that differential growth has bent: the radius of its
    /// intrinsic curvature is not larger than that of the section, and the tissue on the inner side
    /// would have no length. The response of the laws diverges, as that of proprioception does if
    /// its sensitivity times its delay exceeds π/2 growth times.
    #[error(
        "at {} s the intrinsic curvature at {:.4} m from the base is {:.4} 1/m, and the radius {:.4} m: the rod is \
         not slender there. Check the unit of the growth time (s), and strains and histories that were set; if the \
         response of the tropism laws diverges, reduce a sensitivity, a delay or a memory time, or end the run earlier",
        Number(*time), Number(*arc_length), Number(*curvature), Number(*radius)
    )]
    NotSlender {
        /// End of the step, s.
        time: f64,
        /// Arc length of the place from the base, m.
        arc_length: f64,
        /// Intrinsic curvature of the centre line, 1/m.
        curvature: f64,
        /// Distance of the surface from the centre line on the inner side of the bend, m.
        radius: f64,
    },
    /// The tolerance was not met within the permitted work or number of elements.
    #[error(
        "the tolerance {} is not met after {work} evaluations of the forces in the rod: {}{}",
        Number(*tolerance), describe_estimate(*reached), describe_snap(*snap)
    )]
    ToleranceNotMet {
        /// Tolerance, relative to the length.
        tolerance: f64,
        /// Estimated error that was reached, relative to the length; infinite if there is no
        /// estimate yet.
        reached: f64,
        /// [`Statistics::work`](super::Statistics::work) of all runs.
        work: usize,
        /// End of the step with a snap in one of the runs, s; `None` without a snap. After a snap
        /// the error decreases slowly.
        snap: Option<f64>,
    },
    /// A condition did not hold by the latest time.
    #[error(
        "the condition does not hold by {} s: its value is {}, and must become zero or positive",
        Number(*time), Number(*value)
    )]
    NotReached {
        /// Time that was reached, s.
        time: f64,
        /// Value of the condition at that time.
        value: f64,
    },
    /// A run cannot follow the recorded [`Grid`](super::Grid) of another run.
    #[error("the run cannot follow the recorded grid from {} s on: {problem}", Number(*time))]
    Grid {
        /// Start of the step, s.
        time: f64,
        /// Reason.
        problem: &'static str,
    },
    /// The growth law or a tropism law returned NaN or infinity at a place.
    #[error(
        "the {what} of {} is not finite at {:.4} m from the base and {} s",
        describe_type(law), Number(*arc_length), Number(*time)
    )]
    Undefined {
        /// The quantity, with its component.
        what: &'static str,
        /// Name of the type of the law.
        law: &'static str,
        /// Arc length of the place from the base, m.
        arc_length: f64,
        /// Time at which the law was evaluated, s.
        time: f64,
    },
    /// A law, the scene or a condition returned NaN or infinity.
    #[error("the {what} is not finite at {} s: check the law, scene or condition that returns it", Number(*time))]
    NotFinite {
        /// Name of the value.
        what: &'static str,
        /// Time, s.
        time: f64,
    },
}

debug_by_display!(IntegrationError);

fn describe_estimate(error: f64) -> String {
    if error.is_finite() {
        return format!(
            "the error is estimated as {:.2} of the length",
            Number(error)
        );
    }
    "there is no estimate of the error yet".to_owned()
}

/// Describes the remedies for an error that is too large, with the effect of a snap at a time (s).
fn describe_snap(time: Option<f64>) -> String {
    let Some(time) = time else {
        return "; a larger tolerance, a larger `max_work` or shorter calls may help, or a law jumps in time and does \
                not announce it by `next_discontinuity`"
            .to_owned();
    };
    let time = Number(time);
    format!(
        "; after the snap at {time} s errors decrease slowly: advance to an earlier time, or take fixed steps"
    )
}

/// Returns a ratio with one decimal place. It is infinite where growth is discontinuous.
fn describe_ratio(ratio: f64) -> String {
    if ratio < 1e6 {
        format!("{ratio:.1}")
    } else {
        "more than a million".to_owned()
    }
}

impl IntegrationError {
    /// Returns the error of a value that is not finite unless `ok`. A condition may be infinite,
    /// but not NaN.
    #[inline]
    pub(super) fn finite(ok: bool, what: &'static str, time: f64) -> Result<(), Self> {
        ensure(ok, Self::NotFinite { what, time })
    }

    /// Returns whether a shorter step may succeed.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Equilibrium { error, .. } => error.is_recoverable(),
            Self::NotConverged { .. } | Self::Variables { .. } | Self::GrowsTooFast { .. } => true,
            Self::Uneven { .. } | Self::BaseTurns { .. } => true,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_have_no_rows_of_zeros_and_no_infinity() {
        let at_once = IntegrationError::NotFinite {
            what: "gravity",
            time: 2e-300,
        };
        let expected = "the gravity is not finite at 2e-300 s: check the law, scene or condition that returns it";
        assert_eq!(at_once.to_string(), expected);
        let torn = IntegrationError::Uneven {
            time: 600.0,
            element: 80,
            ratio: f64::INFINITY,
        };
        assert!(
            torn.to_string()
                .contains("up to 600 s stretches one end of element 80 more than a million times")
        );
    }
}
