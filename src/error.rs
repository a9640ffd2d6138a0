//! Error of a parameter that is missing or out of range.

use std::fmt;

/// A parameter that is missing or out of range.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct ParameterError {
    /// Name of the parameter, with the law to which it belongs.
    pub name: &'static str,
    /// The given value; NaN for a missing one.
    pub value: f64,
    /// Requirement that the value does not meet, with its unit.
    pub requirement: &'static str,
    /// Arc length from the base at t = 0 (m) at which the value was found, for a quantity that varies along the shoot;
    /// `None` for any other.
    pub place: Option<f64>,
    /// Whether the parameter was not given.
    pub missing: bool,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, requirement, .. } = self;
        if self.missing {
            return write!(f, "{name} is missing: it must be {requirement}");
        }
        let value = Number(*value);
        match self.place {
            None => write!(f, "{name} is {value} but must be {requirement}"),
            Some(s) => write!(f, "{name} is {value} at {s:.4} m from the base but must be {requirement}"),
        }
    }
}

impl std::error::Error for ParameterError {}

/// A number in a message. Very small and very large ones are written with an exponent.
pub(crate) struct Number(pub f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, size) = (self.0, self.0.abs());
        let short = value == 0.0 || !size.is_finite() || (1e-4..1e7).contains(&size);
        if short { write!(f, "{value}") } else { write!(f, "{value:e}") }
    }
}

/// Implements `Debug` of an error by its `Display`: `main() -> Result<(), Box<dyn Error>>` and `unwrap` print the
/// former.
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
    /// Returns an error unless `ok`.
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn unless(ok: bool, name: &'static str, value: f64, requirement: &'static str) -> Result<(), Self> {
        if ok { Ok(()) } else { Err(Self::refused(name, value, requirement)) }
    }

    /// The error of a value that does not meet its requirement.
    pub(crate) fn refused(name: &'static str, value: f64, requirement: &'static str) -> Self {
        Self { name, value, requirement, place: None, missing: false }
    }

    /// The error of a parameter that was not given.
    pub(crate) fn missing(name: &'static str, requirement: &'static str) -> Self {
        Self { name, value: f64::NAN, requirement, place: None, missing: true }
    }

    /// The same error at an arc length (m) from the base at t = 0, for a quantity that varies along the shoot.
    pub(crate) fn at(self, place: f64) -> Self {
        Self { place: Some(place), ..self }
    }

    /// Returns an error unless the value is positive and finite.
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn positive(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value > 0.0 && value.is_finite(), name, value, "positive and finite (SI units)")
    }

    /// Returns an error for NaN and infinite values.
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn finite(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value.is_finite(), name, value, "a finite number (SI units)")
    }

    /// Returns an error unless the value is zero or positive, and finite.
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn not_negative(name: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value >= 0.0 && value.is_finite(), name, value, "zero or positive, and finite (SI units)")
    }
}
