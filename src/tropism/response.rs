//! The common case of a law: tissue perceives something, and answers to what it remembers of it.

use nalgebra::Vector3;

use super::{Declaration, Growing, Memory, Perception, Signal, Site, Source, TropismLaw};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// What tissue perceives, with the growth that it asks for in answer. [`remembered`](Self::remembered) makes a
/// [`TropismLaw`](super::TropismLaw) of it.
pub trait Response {
    /// What perceives the signal.
    type Perception: Perception;

    /// What perceives the signal.
    fn perception(&self) -> &Self::Perception;

    /// The growth gradient that a signal asks for: the rate of the intrinsic strain divided by REGR, components along the
    /// directors, 1/m.
    fn gradient(&self, at: &Growing, signal: <Self::Perception as Perception>::Signal) -> Vector3<f64>;

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        self.perception().check()
    }

    /// The answer to what is remembered of the signal. Memories chain: the memory of a memory filters twice.
    #[inline]
    fn remembered(self, memory: Memory) -> Remembered<Self>
    where
        Self: Sized,
    {
        Remembered { response: self, memory }
    }
}

forward_pointers!(Response {
    type Perception;
    fn perception() -> &T::Perception;
    fn gradient(at: &Growing, signal: SignalOf<T>) -> Vector3<f64>;
    fn check() -> Result<(), ParameterError>;
});

/// A response to the memory M of what is perceived: a [`TropismLaw`].
///
/// It is a response itself, so memories chain. Each filters once; their delays add up, since filters and delays may change
/// places.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Remembered<R> {
    /// The response, and what it perceives.
    pub response: R,
    /// Memory and reaction time.
    pub memory: Memory,
}

/// The signal of a response's perception.
type SignalOf<R> = <<R as Response>::Perception as Perception>::Signal;

impl<R: Response> Remembered<R> {
    /// How many of `variables` the response's perception keeps; the memories stand behind them.
    #[inline]
    fn perceiving(variables: &[f64]) -> usize {
        variables.len() - SignalOf::<R>::LENGTH
    }

    #[inline(always)]
    fn declare_memories(&self, to: &mut Declaration, delay: Option<f64>) -> Source {
        let signal = self.response.perception().declare(to);
        to.memories(SignalOf::<R>::LENGTH, signal, self.memory.time, delay)
    }
}

impl<R: Response> Perception for Remembered<R> {
    type Signal = SignalOf<R>;

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        self.declare_memories(to, None)
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.response.perception().sense(site, stimuli);
    }

    #[inline]
    fn signal(&self, variables: &[f64], _stimuli: &[f64]) -> Self::Signal {
        Signal::read(&variables[Self::perceiving(variables)..])
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        let perception = self.response.perception();
        let (own, memories) = variables.split_at(Self::perceiving(variables));
        let (own_rates, rates) = rates.split_at_mut(Self::perceiving(rates));
        perception.rates(own, stimuli, own_rates);
        let signal = perception.signal(own, stimuli);
        for k in 0..SignalOf::<R>::LENGTH {
            rates[k] = self.memory.rate(memories[k], signal.as_ref()[k]);
        }
    }

    #[inline]
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        let perception = self.response.perception();
        let (own, memories) = variables.split_at_mut(Self::perceiving(variables));
        perception.steady(stimuli, own);
        memories.copy_from_slice(perception.signal(own, stimuli).as_ref());
    }

    /// The perception is at rest, the memory is empty.
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (own, memories) = variables.split_at_mut(Self::perceiving(variables));
        self.response.perception().at_rest(stimuli, own);
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
        self.declare_memories(to, Some(self.delay()));
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
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        Perception::steady(self, stimuli, variables);
    }

    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        Perception::at_rest(self, stimuli, variables);
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        Perception::next_discontinuity(self, t)
    }

    fn check(&self) -> Result<(), ParameterError> {
        Perception::check(self)
    }
}
