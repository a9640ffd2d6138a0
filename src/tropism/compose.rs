//! Laws put together: tuples, options, boxes and references.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{Declaration, Growing, Site, Size, TropismLaw};
use crate::error::ParameterError;
use crate::scene::earlier;

/// Every method by way of another law, which a pattern finds in `self`.
macro_rules! forward {
    ($self:ident: $($pattern:pat => $law:expr),+) => {
        #[inline]
        fn gradient(&$self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
            match $self { $($pattern => $law.gradient(at, past, now)),+ }
        }
        #[inline(always)]
        fn declare(&$self, to: &mut Declaration) {
            match $self { $($pattern => $law.declare(to)),+ }
        }
        #[inline]
        fn size(&$self) -> Size {
            match $self { $($pattern => $law.size()),+ }
        }
        #[inline]
        fn sense(&$self, site: &Site, stimuli: &mut [f64]) {
            match $self { $($pattern => $law.sense(site, stimuli)),+ }
        }
        #[inline]
        fn rates(&$self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
            match $self { $($pattern => $law.rates(variables, stimuli, rates)),+ }
        }
        #[inline]
        fn steady(&$self, stimuli: &[f64], variables: &mut [f64]) {
            match $self { $($pattern => $law.steady(stimuli, variables)),+ }
        }
        fn at_rest(&$self, stimuli: &[f64], variables: &mut [f64]) {
            match $self { $($pattern => $law.at_rest(stimuli, variables)),+ }
        }
        fn next_discontinuity(&$self, t: f64) -> f64 {
            match $self { $($pattern => $law.next_discontinuity(t)),+ }
        }
        fn name_of(&$self, variable: usize) -> &'static str {
            match $self { $($pattern => $law.name_of(variable)),+ }
        }
        fn check(&$self) -> Result<(), ParameterError> {
            match $self { $($pattern => $law.check()),+ }
        }
    };
}

impl<T: TropismLaw + ?Sized> TropismLaw for Box<T> {
    forward!(self: law => (**law));
}

impl<T: TropismLaw + ?Sized> TropismLaw for Arc<T> {
    forward!(self: law => (**law));
}

impl<T: TropismLaw + ?Sized> TropismLaw for &T {
    forward!(self: law => (**law));
}

/// A law that is absent keeps nothing and steers nowhere.
impl<T: TropismLaw> TropismLaw for Option<T> {
    forward!(self: Some(law) => law, None => ());
}

/// No law: nothing is kept and nothing steers.
impl TropismLaw for () {
    #[inline]
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

/// Two laws: what the first keeps and senses stands before what the second does, and the gradients add.
///
/// A law that does not declare the same at every call would have the other one read what is not its own: then what is asked for
/// is not a number, which the integrator refuses.
impl<A: TropismLaw, B: TropismLaw> TropismLaw for (A, B) {
    #[inline]
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        let (a, b) = (self.0.size(), self.1.size());
        let stimuli = if a.reads_present || b.reads_present { a.stimuli + b.stimuli } else { now.len() };
        if past.len() != a.variables + b.variables || now.len() != stimuli {
            return Vector3::repeat(f64::NAN);
        }
        let past = past.split_at(a.variables);
        let now = if a.reads_present || b.reads_present { now.split_at(a.stimuli) } else { (now, now) };
        self.0.gradient(at, past.0, a.present(now.0)) + self.1.gradient(at, past.1, b.present(now.1))
    }
    #[inline(always)]
    fn declare(&self, to: &mut Declaration) {
        self.0.declare(to);
        self.1.declare(to);
    }
    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let (a, b) = (self.0.size().stimuli, self.1.size().stimuli);
        if stimuli.len() != a + b {
            return stimuli.fill(f64::NAN);
        }
        let stimuli = stimuli.split_at_mut(a);
        self.0.sense(site, stimuli.0);
        self.1.sense(site, stimuli.1);
    }
    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        let (first, second) = (self.0.size(), self.1.size());
        if !first.fits(second, variables, stimuli) {
            return rates.fill(f64::NAN);
        }
        let (variables, stimuli) = (variables.split_at(first.variables), stimuli.split_at(first.stimuli));
        let rates = rates.split_at_mut(first.variables);
        self.0.rates(variables.0, stimuli.0, rates.0);
        self.1.rates(variables.1, stimuli.1, rates.1);
    }
    #[inline]
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (first, second) = (self.0.size(), self.1.size());
        if !first.fits(second, variables, stimuli) {
            return variables.fill(f64::NAN);
        }
        let (stimuli, variables) = (stimuli.split_at(first.stimuli), variables.split_at_mut(first.variables));
        self.0.steady(stimuli.0, variables.0);
        self.1.steady(stimuli.1, variables.1);
    }
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (first, second) = (self.0.size(), self.1.size());
        if !first.fits(second, variables, stimuli) {
            return variables.fill(f64::NAN);
        }
        let (stimuli, variables) = (stimuli.split_at(first.stimuli), variables.split_at_mut(first.variables));
        self.0.at_rest(stimuli.0, variables.0);
        self.1.at_rest(stimuli.1, variables.1);
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        earlier(self.0.next_discontinuity(t), self.1.next_discontinuity(t))
    }
    fn name_of(&self, variable: usize) -> &'static str {
        let first = self.0.size().variables;
        if variable < first { self.0.name_of(variable) } else { self.1.name_of(variable - first) }
    }
    fn check(&self) -> Result<(), ParameterError> {
        self.0.check()?;
        self.1.check()
    }
}

impl<A: TropismLaw> TropismLaw for (A,) {
    forward!(self: (a,) => a);
}

/// Longer tuples are pairs of pairs.
macro_rules! tuple_of_laws {
    ($($Name:ident $name:ident)* => $pairs:expr) => {
        impl<$($Name: TropismLaw),*> TropismLaw for ($($Name,)*) {
            forward!(self: ($($name,)*) => $pairs);
        }
    };
}

tuple_of_laws!(A a B b C c => (a, (b, c)));
tuple_of_laws!(A a B b C c D d => ((a, b), (c, d)));
tuple_of_laws!(A a B b C c D d E e => ((a, b), (c, (d, e))));
tuple_of_laws!(A a B b C c D d E e F f => ((a, (b, c)), (d, (e, f))));
