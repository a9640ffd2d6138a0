//! Errors of laws that cannot be linearised about a steady state.

/// Reason why laws have no linearisation. `StabilityError` has a public variant for each of these, with the same fields.
#[derive(Debug)]
pub(crate) enum LawError {
    /// A quantity is infinite or not a number.
    NonFinite { what: &'static str },
    /// The state that `TropismLaw::steady` returns is not a steady state of `TropismLaw::rates`.
    Unsteady { law: &'static str, variable: usize, rate: f64, share: f64 },
    /// A law, a load, growth, gravity or the base depends on time; the change is in 1/m.
    TimeDependent { change: f64 },
}
