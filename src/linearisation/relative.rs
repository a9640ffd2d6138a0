//! Relative differences.

/// A difference of two numbers with the sizes `a` and `b`, relative to the larger size.
pub(crate) fn relative(difference: f64, a: f64, b: f64) -> f64 {
    difference / a.max(b).max(f64::MIN_POSITIVE)
}
