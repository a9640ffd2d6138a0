//! The resolution that `Adaptive` has chosen.

use crate::error::ParameterError;

/// Resolution for a tolerance until a time. It is part of the state, so that a run that is resumed
/// makes the same steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Plan {
    /// Tolerance, relative to the length.
    pub tolerance: f64,
    /// End of the time for which the resolution was chosen, s.
    pub until: f64,
    /// Longest step, s.
    pub step: f64,
    /// Longest step of the coarsest trial run, s.
    pub coarsest_step: f64,
    /// Longest element, m.
    pub longest_element: f64,
    /// Merge tolerance of mature elements, rad.
    pub merge_tolerance: f64,
    /// Estimated error of the shape at `until` since the beginning of the run, relative to the
    /// length.
    pub error: f64,
}

impl Plan {
    /// Returns an error if a number is invalid.
    pub fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("planned tolerance", self.tolerance, "")?;
        ParameterError::positive("planned step", self.step, "s")?;
        ParameterError::positive("step of the coarsest trial run", self.coarsest_step, "s")?;
        ParameterError::positive("planned longest element", self.longest_element, "m")?;
        ParameterError::positive("planned merge tolerance", self.merge_tolerance, "rad")?;
        ParameterError::finite("end of the plan", self.until, "s")?;
        ParameterError::not_negative("estimated error", self.error, "")
    }
}
