//! Laws that consist of a perception, a memory kernel and a response.

use nalgebra::Vector3;

use super::perception::signal_length;
use super::{Declaration, Growing, KernelTerm, MemoryKernel, Perception, Response, Site, TropismLaw};
use crate::error::ParameterError;

/// Response to a perceived signal that is filtered by a [`MemoryKernel`]: a [`TropismLaw`].
///
/// A decay is a variable for each component of the signal, and an oscillation is two. The variables of the perception
/// come first.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Filtered<R> {
    /// The response and its perception.
    pub response: R,
    /// The kernel and the reaction time.
    pub kernel: MemoryKernel,
}

/// Signal of the perception of a response.
type SignalOf<R> = <<R as Response>::Perception as Perception>::Signal;

impl<R: Response> Filtered<R> {
    /// Number of components of the signal.
    fn components() -> usize {
        signal_length::<SignalOf<R>>()
    }

    /// Number of variables of the kernel; those of the perception precede them.
    fn filters(&self) -> usize {
        self.kernel.terms.iter().map(KernelTerm::variables).sum::<usize>() * Self::components()
    }

    /// Calls `each` with each term, each component k of the signal, and the places of (p, q) among the variables of the
    /// kernel. Both places are the same without oscillation.
    fn visit(&self, mut each: impl FnMut(&KernelTerm, usize, [usize; 2])) {
        let (n, mut first) = (Self::components(), 0);
        for term in &self.kernel.terms {
            let second = first + n * (term.variables() - 1);
            (0..n).for_each(|k| each(term, k, [first + k, second + k]));
            first = second + n;
        }
    }

    /// Divides the variables into those of the perception and those of the kernel.
    fn split<'a>(&self, variables: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        variables.split_at(variables.len() - self.filters())
    }

    /// Writes the rates of the variables of the perception, and those of the kernel if `all` returns true for them.
    fn write_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64], all: impl Fn(&[f64]) -> bool) {
        let perception = self.response.perception();
        let (own, filters) = self.split(variables);
        let (own_rates, rates) = rates.split_at_mut(own.len());
        perception.rates(own, stimuli, own_rates);
        if all(filters) {
            let signal = perception.signal(own, stimuli);
            self.visit(|term, k, [i, j]| {
                let [p, q] = term.rates([filters[i], filters[j]], signal.as_ref()[k]);
                // The rate of a decay is p, and both places are the same.
                rates[j] = q;
                rates[i] = p;
            });
        }
    }
}

impl<R: Response> TropismLaw for Filtered<R> {
    fn declare(&self, to: &mut Declaration) {
        let perception = self.response.perception();
        let signal = perception.declare(to);
        let delay = Some(perception.delay() + self.kernel.delay);
        for term in &self.kernel.terms {
            match term.variables() {
                1 => to.uncoupled_memories(Self::components(), signal, term.time, delay),
                _ => to.oscillations(Self::components(), signal, (term.time, term.frequency), delay),
            };
        }
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.response.perception().sense(site, stimuli);
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.write_rates(variables, stimuli, rates, |_| true);
    }

    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        // Only memories of a computed signal are iterated. Others are NaN here.
        self.write_rates(variables, stimuli, rates, |filters| filters.first().is_some_and(|y| !y.is_nan()));
    }

    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        let perception = self.response.perception();
        let (own, filters) = variables.split_at_mut(variables.len() - self.filters());
        perception.steady(stimuli, own);
        let signal = perception.signal(own, stimuli);
        self.visit(|term, k, [i, j]| {
            let [p, q] = term.steady(signal.as_ref()[k]);
            filters[j] = q;
            filters[i] = p;
        });
    }

    /// The memories are zero, and the perception has its own initial state.
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (own, filters) = variables.split_at_mut(variables.len() - self.filters());
        self.response.perception().initial(stimuli, own);
        filters.fill(0.0);
    }

    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let (_, filters) = self.split(past);
        let mut signal = SignalOf::<R>::default();
        self.visit(|term, k, [i, j]| {
            let [p, q] = term.weights();
            signal.as_mut()[k] += p * filters[i] + q * filters[j];
        });
        self.response.gradient(at, signal)
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        self.response.perception().next_discontinuity(t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.response.check()?;
        self.kernel.check()
    }
}
