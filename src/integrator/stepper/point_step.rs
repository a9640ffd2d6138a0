//! A material point over a step.

use crate::tropism::TropismLaw;

/// A material point over a step, from which
/// [`TimeStep::set_variables`](super::TimeStep::set_variables) computes its variables.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct PointStep<'a> {
    /// Index of the point among all points of the rod.
    pub point: usize,
    /// Variables at the start, in the order of the declaration of the laws.
    pub variables: &'a [f64],
    /// Their rates at the start, 1/s times their units.
    pub rates: &'a [f64],
    /// Stimuli at the start and at the end.
    pub stimuli: [&'a [f64]; 2],
    pub(super) law: &'a dyn TropismLaw,
}

impl PointStep<'_> {
    /// Writes the rates of the laws at the given variables and stimuli to `rates`.
    pub fn rates_at(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.law.rates(variables, stimuli, rates);
    }
}

impl std::fmt::Debug for PointStep<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            point,
            variables,
            rates,
            stimuli,
            ..
        } = self;
        let mut of_fields = f.debug_struct("PointStep");
        of_fields
            .field("point", point)
            .field("variables", variables)
            .field("rates", rates)
            .field("stimuli", stimuli);
        of_fields.finish_non_exhaustive()
    }
}
