//! What an integrator with a tolerance has chosen for the time ahead.

use super::error::StateError;

/// The resolution that keeps a tolerance until a time. Part of the state, so that a run that is resumed goes on with the same steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Plan {
    /// For which tolerance it was made, relative to the length.
    pub tolerance: f64,
    /// Until when it holds, s.
    pub until: f64,
    /// Longest step, s.
    pub step: f64,
    /// Longest step of the coarsest trial, s.
    pub coarsest: f64,
    /// Longest element, m.
    pub longest_element: f64,
    /// Of mature elements, rad.
    pub merge_tolerance: f64,
    /// Estimated error of the shape by then, relative to the length, since the run began.
    pub error: f64,
}

impl Plan {
    /// Refuses numbers that no plan has.
    pub fn check(&self) -> Result<(), StateError> {
        let Self { tolerance, until, step, coarsest, longest_element, merge_tolerance, error } = *self;
        let positive = [
            ("planned tolerance", tolerance),
            ("planned step", step),
            ("step of the coarsest trial", coarsest),
            ("planned longest element", longest_element),
            ("planned merge tolerance", merge_tolerance),
        ];
        for (what, value) in positive {
            StateError::unless(value > 0.0 && value.is_finite(), what, value, "positive and finite")?;
        }
        StateError::unless(until.is_finite(), "end of the plan", until, "finite (s)")?;
        StateError::unless(error >= 0.0 && error.is_finite(), "estimated error", error, "not negative, and finite")
    }
}
