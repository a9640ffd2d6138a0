//! Laws that consist of a perception, a memory or a memory kernel, and a response.

use nalgebra::Vector3;

use super::perception::{read_signal, signal_length};
use super::{
    Declaration, Growing, KernelTerm, Memory, MemoryKernel, Perception, Site, Source, TropismLaw,
};
use crate::error::ParameterError;
use crate::pointers::{forward_methods, forward_pointers};

/// Growth gradient as a function of a perceived signal. [`remembered`](Self::remembered) makes a
/// [`TropismLaw`](super::TropismLaw) of it, with a memory of the signal. For example, gravitropism
/// may saturate:
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::tropism::{Growing, Memory, Response, SettledStatoliths};
///
/// struct Saturating {
///     sensitivity: f64,
///     perception: SettledStatoliths,
/// }
///
/// impl Response for Saturating {
///     type Perception = SettledStatoliths;
///
///     fn perception(&self) -> &SettledStatoliths {
///         &self.perception
///     }
///
///     /// The signal has the norm sin θ for a shoot at the angle θ from the vertical.
///     fn gradient(&self, at: &Growing, [h1, h2]: [f64; 2]) -> Vector3<f64> {
///         let bent = Vector3::new(-h2, h1, 0.0) / at.section.radius();
///         bent * self.sensitivity / (1.0 + 2.0 * h1.hypot(h2))
///     }
/// }
///
/// let law = Saturating { sensitivity: 0.8, perception: SettledStatoliths };
/// let law = law.remembered(Memory { time: 720.0, delay: 720.0 });
/// # use morphorod::{Shoot, Still, constitutive::LinearElastic, growth::UniformGrowth};
/// # let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e8, poissons_ratio: 0.5 }).length(0.05).radius(5e-4)
/// #     .growth(UniformGrowth { zone_length: 0.04, time: 72e3 }).tropism(law).scene(Still::tilted(0.5)).build()?;
/// # shoot.check_laws()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Response {
    /// Type of the perception of the signal.
    type Perception: Perception;

    /// Perception of the signal.
    fn perception(&self) -> &Self::Perception;

    /// Growth gradient for a signal: u̇*/REGR, the rate of the intrinsic strain divided by REGR,
    /// components along the directors, 1/m.
    fn gradient(
        &self,
        at: &Growing,
        signal: <Self::Perception as Perception>::Signal,
    ) -> Vector3<f64>;

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
        Remembered {
            response: self,
            memory,
        }
    }

    /// The response to the signal filtered by a memory kernel of any shape.
    #[inline]
    fn filtered(self, kernel: MemoryKernel) -> Filtered<Self>
    where
        Self: Sized,
    {
        Filtered {
            response: self,
            kernel,
        }
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
/// It is also a response, so that memories can be chained. Each memory filters once. Their delays
/// add, since filters and delays commute.
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
    /// Number of `variables` that belong to the perception of the response; the memories follow
    /// them.
    #[inline]
    fn perceiving(variables: &[f64]) -> usize {
        variables.len() - signal_length::<SignalOf<R>>()
    }

    /// Writes the rates of the variables of the perception, and those of the memories if `all`
    /// returns true for them.
    #[inline]
    fn write_rates(
        &self,
        variables: &[f64],
        stimuli: &[f64],
        rates: &mut [f64],
        all: impl Fn(&[f64]) -> bool,
    ) {
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
        to.memories(
            signal_length::<SignalOf<R>>(),
            signal,
            self.memory.time,
            None,
        )
    }

    forward_methods!(self, Perception of *self.response.perception() =>
        fn sense(site: &Site, stimuli: &mut [f64]);
        fn next_discontinuity(t: f64) -> f64;
    );

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
        // A perception receives only its own variables, so that its rates do not depend on the
        // memories.
        let length = signal_length::<SignalOf<R>>();
        to.uncoupled_memories(length, signal, self.memory.time, Some(self.delay()));
    }

    #[inline]
    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        // Only memories of a computed signal are iterated. Others are NaN here.
        self.write_rates(variables, stimuli, rates, |memories| {
            memories.first().is_some_and(|y| !y.is_nan())
        });
    }

    forward_methods!(self, Perception of *self =>
        fn sense(site: &Site, stimuli: &mut [f64]);
        fn rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
        fn steady(stimuli: &[f64], variables: &mut [f64]);
        fn initial(stimuli: &[f64], variables: &mut [f64]);
        fn next_discontinuity(t: f64) -> f64;
        fn check() -> Result<(), ParameterError>;
    );
}

/// Response to a perceived signal that is filtered by a [`MemoryKernel`]: a [`TropismLaw`].
///
/// A decay is a variable for each component of the signal, and an oscillation is two. The variables
/// of the perception come first.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Filtered<R> {
    /// The response and its perception.
    pub response: R,
    /// The kernel and the reaction time.
    pub kernel: MemoryKernel,
}

impl<R: Response> Filtered<R> {
    /// Number of components of the signal.
    fn components() -> usize {
        signal_length::<SignalOf<R>>()
    }

    /// Number of variables of the kernel; those of the perception precede them.
    fn filters(&self) -> usize {
        self.kernel
            .terms
            .iter()
            .map(KernelTerm::variables)
            .sum::<usize>()
            * Self::components()
    }

    /// Calls `each` with each term, each component k of the signal, and the places of (p, q) among
    /// the variables of the kernel. Both places are the same without oscillation.
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

    /// Writes the rates of the variables of the perception, and those of the kernel if `all`
    /// returns true for them.
    fn write_rates(
        &self,
        variables: &[f64],
        stimuli: &[f64],
        rates: &mut [f64],
        all: impl Fn(&[f64]) -> bool,
    ) {
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
                _ => to.oscillations(
                    Self::components(),
                    signal,
                    (term.time, term.frequency),
                    delay,
                ),
            };
        }
    }

    forward_methods!(self, Perception of *self.response.perception() =>
        fn sense(site: &Site, stimuli: &mut [f64]);
        fn next_discontinuity(t: f64) -> f64;
    );

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.write_rates(variables, stimuli, rates, |_| true);
    }

    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        // Only memories of a computed signal are iterated. Others are NaN here.
        self.write_rates(variables, stimuli, rates, |filters| {
            filters.first().is_some_and(|y| !y.is_nan())
        });
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

    fn check(&self) -> Result<(), ParameterError> {
        self.response.check()?;
        self.kernel.check()
    }
}
