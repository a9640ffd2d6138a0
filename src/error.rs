//! A parameter that makes no sense, named.

/// A parameter was given a value that it cannot have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} is {value} but must be {requirement}")]
pub struct ParameterError {
    /// What the parameter is called, with the law that it belongs to.
    pub name: &'static str,
    /// The value that was given.
    pub value: f64,
    /// What the value must be, with its unit.
    pub requirement: &'static str,
}

impl ParameterError {
    /// Refuses `value` unless `ok`.
    ///
    /// # Errors
    /// The parameter's name and value with the requirement.
    pub fn unless(ok: bool, name: &'static str, value: f64, requirement: &'static str) -> Result<(), Self> {
        if ok { Ok(()) } else { Err(Self { name, value, requirement }) }
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
