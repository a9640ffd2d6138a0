//! A parameter that makes no sense, named.

use std::fmt;

/// A parameter was given a value that it cannot have, or was not given.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct ParameterError {
    /// What the parameter is called, with the law that it belongs to.
    pub name: &'static str,
    /// The value that was given; not a number if none was.
    pub value: f64,
    /// What the value must be, with its unit.
    pub requirement: &'static str,
    /// Where along the shoot, for what varies: the arc length from the base at t = 0, m.
    pub place: Option<f64>,
    /// Whether the parameter was not given at all.
    pub missing: bool,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, requirement, .. } = self;
        if self.missing {
            return write!(f, "{name} is missing: it must be {requirement}");
        }
        // Zeros are hard to count.
        let size = value.abs();
        let short = *value == 0.0 || !size.is_finite() || (1e-4..1e7).contains(&size);
        let value = if short { format!("{value}") } else { format!("{value:e}") };
        match self.place {
            None => write!(f, "{name} is {value} but must be {requirement}"),
            Some(s) => write!(f, "{name} is {value} at {s:.4} m from the base but must be {requirement}"),
        }
    }
}

impl std::error::Error for ParameterError {}

/// Implements `Debug` of an error by its `Display`: `main() -> Result<(), Box<dyn Error>>` and `unwrap` print the former.
macro_rules! debug_by_display {
    ($error:ty) => {
        impl std::fmt::Debug for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                std::fmt::Display::fmt(self, f)
            }
        }
    };
}
pub(crate) use debug_by_display;

debug_by_display!(ParameterError);

impl ParameterError {
    /// Refuses `value` unless `ok`.
    ///
    /// # Errors
    /// The parameter's name and value with the requirement.
    pub fn unless(ok: bool, name: &'static str, value: f64, requirement: &'static str) -> Result<(), Self> {
        if ok { Ok(()) } else { Err(Self { name, value, requirement, place: None, missing: false }) }
    }

    /// The error of a parameter that was not given.
    #[must_use]
    pub fn missing(name: &'static str, requirement: &'static str) -> Self {
        Self { name, value: f64::NAN, requirement, place: None, missing: true }
    }

    /// The same error, of something that varies along the shoot, at an arc length (m) from the base at t = 0.
    #[must_use]
    pub fn at(self, place: f64) -> Self {
        Self { place: Some(place), ..self }
    }

    /// Refuses a value that is not a positive finite number.
    ///
    /// # Errors
    /// The parameter's name and value with the requirement.
    pub fn positive(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value > 0.0 && value.is_finite(), name, value, "positive and finite (SI units)")
    }

    /// Refuses a value that is not a finite number.
    ///
    /// # Errors
    /// The parameter's name and value with the requirement.
    pub fn finite(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value.is_finite(), name, value, "a finite number (SI units)")
    }

    /// Refuses a value that is negative, infinite or not a number.
    ///
    /// # Errors
    /// The parameter's name and value with the requirement.
    pub fn not_negative(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value >= 0.0 && value.is_finite(), name, value, "zero or positive, and finite (SI units)")
    }
}
