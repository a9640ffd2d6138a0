//! Error of a parameter that is missing or out of range.

use std::fmt;

/// Largest difference of the norm of a frame or a direction from one, and largest rotation of a
/// base that keeps its frame (rad): far above the rounding of products of quaternions, and below
/// any error of a shape.
pub(crate) const UNIT: f64 = 1e-9;

/// A parameter that is missing or out of range.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct ParameterError {
    /// Name of the parameter, with the law to which it belongs.
    pub name: &'static str,
    /// The given value; NaN for a missing one.
    pub value: f64,
    /// Requirement that the value does not meet. It ends with the unit, unless this is the field
    /// `unit`.
    pub requirement: &'static str,
    /// Unit of the value; empty for a number, and for a requirement that states the unit.
    pub unit: &'static str,
    /// Arc length from the base at t = 0 (m) at which the value was found, for a quantity that
    /// varies along the shoot; `None` for any other.
    pub place: Option<f64>,
    /// Whether the parameter was not given.
    pub missing: bool,
    /// The required number, if there is a single one.
    pub needed: Option<f64>,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            value,
            requirement,
            unit,
            needed,
            ..
        } = self;
        if self.missing {
            return write!(f, "{name} is missing: it must be {requirement}");
        }
        write!(f, "{name} is {}", Number(*value))?;
        self.place.map_or(Ok(()), |s| {
            write!(f, " at {:.4} m from the base", Number(s))
        })?;
        f.write_str(" but must be ")?;
        needed.map_or(Ok(()), |needed| write!(f, "{}, ", Number(needed)))?;
        f.write_str(requirement)?;
        if unit.is_empty() {
            Ok(())
        } else {
            write!(f, " ({unit})")
        }
    }
}

impl std::error::Error for ParameterError {}

/// Returns an error unless `ok`.
pub(crate) fn ensure<E>(ok: bool, error: E) -> Result<(), E> {
    if ok { Ok(()) } else { Err(error) }
}

/// A number in a message, with ten significant digits or as many as the precision of the format.
/// Very small and very large ones are written with an exponent, and those that are not finite in
/// words.
pub(crate) struct Number(pub f64);

/// Significant digits of a number in a message. They distinguish a norm from 1 at the tolerance of
/// 1e-9 of norms.
const DIGITS: usize = 10;

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            x if x.is_nan() => return f.write_str("not a number"),
            f64::INFINITY => return f.write_str("infinite"),
            f64::NEG_INFINITY => return f.write_str("minus infinity"),
            // A time just after zero.
            x if x.is_subnormal() => return f.write_str("0"),
            _ => (),
        }
        let digits = f.precision().unwrap_or(DIGITS);
        let rounded = format!("{:.*e}", digits.saturating_sub(1), self.0)
            .parse()
            .unwrap_or(self.0);
        let short = rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs());
        if short {
            write!(f, "{rounded}")
        } else {
            write!(f, "{rounded:e}")
        }
    }
}

/// A residual or an estimate of an error in a message, with two digits. One that is not finite is
/// unknown.
pub(crate) struct Known(pub f64);

impl fmt::Display for Known {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_finite() {
            write!(f, "{:.2}", Number(self.0))
        } else {
            f.write_str("unknown")
        }
    }
}

/// Implements `Debug` of an error by its `Display`: `main() -> Result<(), Box<dyn Error>>` and
/// `unwrap` print the former.
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
    pub fn unless(
        ok: bool,
        name: &'static str,
        value: f64,
        requirement: &'static str,
    ) -> Result<(), Self> {
        if ok {
            Ok(())
        } else {
            Err(Self::refused(name, value, requirement))
        }
    }

    /// The error of a value that does not meet its requirement.
    pub(crate) fn refused(name: &'static str, value: f64, requirement: &'static str) -> Self {
        Self {
            name,
            value,
            requirement,
            unit: "",
            place: None,
            missing: false,
            needed: None,
        }
    }

    /// Returns an error unless a number of things is the needed one, which the requirement
    /// describes. `numbers` are the found one and the needed one.
    pub(crate) fn count(
        name: &'static str,
        numbers: [usize; 2],
        requirement: &'static str,
    ) -> Result<(), Self> {
        let [found, needed] = numbers.map(|number| number as f64);
        Self::unless(found == needed, name, found, requirement).map_err(|error| Self {
            needed: Some(needed),
            ..error
        })
    }

    /// Returns an error unless a norm is one up to [`UNIT`].
    pub(crate) fn unit(name: &'static str, norm: f64) -> Result<(), Self> {
        Self::unless((norm - 1.0).abs() < UNIT, name, norm, "1")
    }

    /// The error of a parameter that was not given.
    pub(crate) fn missing(name: &'static str, requirement: &'static str) -> Self {
        Self {
            missing: true,
            ..Self::refused(name, f64::NAN, requirement)
        }
    }

    /// The same error at an arc length (m) from the base at t = 0, for a quantity that varies along
    /// the shoot.
    pub(crate) fn at(self, place: f64) -> Self {
        Self {
            place: Some(place),
            ..self
        }
    }

    /// Returns an error unless the value is positive and finite. The unit is part of the message,
    /// and empty for a number.
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn positive(name: &'static str, value: f64, unit: &'static str) -> Result<(), Self> {
        Self::unless(
            value > 0.0 && value.is_finite(),
            name,
            value,
            "positive and finite",
        )
        .map_err(|error| Self { unit, ..error })
    }

    /// Returns an error for NaN and infinite values, with the unit as [`positive`](Self::positive).
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn finite(name: &'static str, value: f64, unit: &'static str) -> Result<(), Self> {
        Self::unless(value.is_finite(), name, value, "finite")
            .map_err(|error| Self { unit, ..error })
    }

    /// Returns an error unless the value is zero or positive, and finite, with the unit as
    /// [`positive`](Self::positive).
    ///
    /// # Errors
    /// Name, value and requirement of the parameter.
    pub fn not_negative(name: &'static str, value: f64, unit: &'static str) -> Result<(), Self> {
        Self::unless(
            value >= 0.0 && value.is_finite(),
            name,
            value,
            "zero or positive, and finite",
        )
        .map_err(|error| Self { unit, ..error })
    }
}
