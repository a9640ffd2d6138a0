//! Laws that consist of a perception, a memory and a response.

use nalgebra::Vector3;

use super::perception::{read_signal, signal_length};
use super::{Declaration, Filtered, Growing, Memory, MemoryKernel, Perception, Site, Source, TropismLaw};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// Growth gradient as a function of a perceived signal. [`remembered`](Self::remembered) makes a
/// [`TropismLaw`](super::TropismLaw) of it, with a memory of the signal.
pub trait Response {
    /// Type of the perception of the signal.
    type Perception: Perception;

    /// Perception of the signal.
    fn perception(&self) -> &Self::Perception;

    /// Growth gradient for a signal: u̇*/REGR, the rate of the intrinsic strain divided by REGR, components along
    /// the directors, 1/m.
    fn gradient(&self, at: &Growing, signal: <Self::Perception as Perception>::Signal) -> Vector3<f64>;

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        self.perception().check()
    }

    /// The response to the memory of the signal. A memory of a memory filters twice.
    #[inline]
    fn remembered(self, memory: Memory) -> Remembered<Self>
    where
        Self: Sized,
    {
        Remembered { response: self, memory }
    }

    /// The response to the signal filtered by a memory kernel of any shape.
    #[inline]
    fn filtered(self, kernel: MemoryKernel) -> Filtered<Self>
    where
        Self: Sized,
    {
        Filtered { response: self, kernel }
    }
}

forward_pointers!(Response {
    type Perception;
    fn perception() -> &T::Perception;
    fn gradient(at: &Growing, signal: SignalOf<T>) -> Vector3<f64>;
    fn check() -> Result<(), ParameterError>;
});

/// Response to the [memory](Memory) of a perceived signal: a [`TropismLaw`].
///
/// It is also a response, so that memories can be chained. Each memory filters once. Their delays add, since
/// filters and delays commute.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Remembered<R> {
    /// The response and its perception.
    pub response: R,
    /// Memory time and reaction time.
    pub memory: Memory,
}

/// Signal of the perception of a response.
type SignalOf<R> = <<R as Response>::Perception as Perception>::Signal;

impl<R: Response> Remembered<R> {
    /// Number of `variables` that belong to the perception of the response; the memories follow them.
    #[inline]
    fn perceiving(variables: &[f64]) -> usize {
        variables.len() - signal_length::<SignalOf<R>>()
    }

    /// Writes the rates of the variables of the perception, and those of the memories if `all` returns true for
    /// them.
    #[inline]
    fn write_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64], all: impl Fn(&[f64]) -> bool) {
        let perception = self.response.perception();
        let (own, memories) = variables.split_at(Self::perceiving(variables));
        let (own_rates, rates) = rates.split_at_mut(Self::perceiving(rates));
        perception.rates(own, stimuli, own_rates);
        if all(memories) {
            let signal = perception.signal(own, stimuli);
            for k in 0..signal_length::<SignalOf<R>>() {
                rates[k] = self.memory.rate(memories[k], signal.as_ref()[k]);
            }
        }
    }
}

impl<R: Response> Perception for Remembered<R> {
    type Signal = SignalOf<R>;

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        let signal = self.response.perception().declare(to);
        // Another perception may contain this one, and compute its rates from the memories.
        to.memories(signal_length::<SignalOf<R>>(), signal, self.memory.time, None)
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.response.perception().sense(site, stimuli);
    }

    #[inline]
    fn signal(&self, variables: &[f64], _stimuli: &[f64]) -> Self::Signal {
        read_signal(&variables[Self::perceiving(variables)..])
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.write_rates(variables, stimuli, rates, |_| true);
    }

    #[inline]
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        let perception = self.response.perception();
        let (own, memories) = variables.split_at_mut(Self::perceiving(variables));
        perception.steady(stimuli, own);
        memories.copy_from_slice(perception.signal(own, stimuli).as_ref());
    }

    /// The memories are zero, and the perception has its own initial state.
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (own, memories) = variables.split_at_mut(Self::perceiving(variables));
        self.response.perception().initial(stimuli, own);
        memories.fill(0.0);
    }

    #[inline]
    fn delay(&self) -> f64 {
        self.response.perception().delay() + self.memory.delay
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        self.response.perception().next_discontinuity(t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.response.check()?;
        self.memory.check()
    }
}

impl<R: Response> Response for Remembered<R> {
    type Perception = Self;

    #[inline]
    fn perception(&self) -> &Self {
        self
    }

    #[inline]
    fn gradient(&self, at: &Growing, signal: SignalOf<R>) -> Vector3<f64> {
        self.response.gradient(at, signal)
    }
}

impl<R: Response> TropismLaw for Remembered<R> {
    #[inline]
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        self.response.gradient(at, self.signal(past, &[]))
    }

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) {
        let signal = self.response.perception().declare(to);
        // A perception receives only its own variables, so that its rates do not depend on the memories.
        let length = signal_length::<SignalOf<R>>();
        to.uncoupled_memories(length, signal, self.memory.time, Some(self.delay()));
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        Perception::sense(self, site, stimuli);
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        Perception::rates(self, variables, stimuli, rates);
    }

    #[inline]
    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        // Only memories of a computed signal are iterated. Others are NaN here.
        self.write_rates(variables, stimuli, rates, |memories| memories.first().is_some_and(|y| !y.is_nan()));
    }

    #[inline]
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        Perception::steady(self, stimuli, variables);
    }

    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        Perception::initial(self, stimuli, variables);
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        Perception::next_discontinuity(self, t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        Perception::check(self)
    }
}
