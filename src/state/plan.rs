//! The resolution that `Adaptive` has chosen.

use super::error::StateError;

/// The resolution for a tolerance until a time. It is part of the state, so that a run that is resumed makes the same steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Plan {
    /// Tolerance, relative to the length.
    pub tolerance: f64,
    /// End of the time for which it was chosen, s.
    pub until: f64,
    /// Longest step, s.
    pub step: f64,
    /// Longest step of the coarsest trial, s.
    pub coarsest_step: f64,
    /// Longest element, m.
    pub longest_element: f64,
    /// Merge tolerance of mature elements, rad.
    pub merge_tolerance: f64,
    /// Time that the last call has reached, s. At another time the shoot was advanced by another integrator.
    pub reached: f64,
    /// Estimated error of the shape at the end, relative to the length, since the run began.
    pub error: f64,
}

impl Plan {
    /// Returns an error if a number is invalid.
    pub fn check(&self) -> Result<(), StateError> {
        let Self { tolerance, until, step, coarsest_step, longest_element, merge_tolerance, reached, error } = *self;
        let positive = [
            ("planned tolerance", tolerance),
            ("planned step", step),
            ("step of the coarsest trial", coarsest_step),
            ("planned longest element", longest_element),
            ("planned merge tolerance", merge_tolerance),
        ];
        for (what, value) in positive {
            StateError::unless(value > 0.0 && value.is_finite(), what, value, "positive and finite")?;
        }
        StateError::unless(until.is_finite(), "end of the plan", until, "finite (s)")?;
        StateError::unless(reached.is_finite(), "time that the plan has reached", reached, "finite (s)")?;
        StateError::unless(error >= 0.0 && error.is_finite(), "estimated error", error, "not negative, and finite")
    }
}
