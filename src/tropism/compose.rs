//! Laws put together: tuples, options and boxes.

use nalgebra::Vector3;

use super::{Growing, LawDerivatives, Site, TropismLaw};
use crate::error::ParameterError;

macro_rules! forward {
    ($self:ident => $law:expr) => {
        #[inline]
        fn gradient(&$self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
            $law.gradient(at, past, now)
        }
        #[inline]
        fn variables(&$self) -> usize {
            $law.variables()
        }
        #[inline]
        fn stimuli(&$self) -> usize {
            $law.stimuli()
        }
        #[inline]
        fn delays(&$self, delays: &mut [f64]) {
            $law.delays(delays);
        }
        #[inline]
        fn sense(&$self, site: &Site, stimuli: &mut [f64]) {
            $law.sense(site, stimuli);
        }
        fn at_rest(&$self, stimuli: &[f64], variables: &mut [f64]) {
            $law.at_rest(stimuli, variables);
        }
        #[inline]
        fn settled(&$self, stimuli: &[f64], variables: &mut [f64]) {
            $law.settled(stimuli, variables);
        }
        #[inline]
        fn rates(&$self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
            $law.rates(variables, stimuli, rates);
        }
        #[inline]
        fn time_constants(&$self, constants: &mut [f64]) {
            $law.time_constants(constants);
        }
        #[inline]
        fn senses_now(&$self) -> bool {
            $law.senses_now()
        }
        #[inline]
        fn needs_position(&$self) -> bool {
            $law.needs_position()
        }
        fn derivatives(&$self, at: &Growing, variables: &[f64], stimuli: &[f64], out: &mut LawDerivatives) {
            $law.derivatives(at, variables, stimuli, out);
        }
        fn next_discontinuity(&$self, t: f64) -> f64 {
            $law.next_discontinuity(t)
        }
        fn check(&$self) -> Result<(), ParameterError> {
            $law.check()
        }
    };
}

impl<T: TropismLaw + ?Sized> TropismLaw for Box<T> {
    forward!(self => (**self));
}

impl<T: TropismLaw + ?Sized> TropismLaw for &T {
    forward!(self => (**self));
}

/// A law that is absent keeps nothing and steers nowhere.
impl<T: TropismLaw> TropismLaw for Option<T> {
    #[inline]
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        self.as_ref().map_or_else(Vector3::zeros, |law| law.gradient(at, past, now))
    }
    #[inline]
    fn variables(&self) -> usize {
        self.as_ref().map_or(0, T::variables)
    }
    #[inline]
    fn stimuli(&self) -> usize {
        self.as_ref().map_or(0, T::stimuli)
    }
    #[inline]
    fn delays(&self, delays: &mut [f64]) {
        if let Some(law) = self {
            law.delays(delays);
        }
    }
    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        if let Some(law) = self {
            law.sense(site, stimuli);
        }
    }
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        if let Some(law) = self {
            law.at_rest(stimuli, variables);
        }
    }
    #[inline]
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
        if let Some(law) = self {
            law.settled(stimuli, variables);
        }
    }
    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        if let Some(law) = self {
            law.rates(variables, stimuli, rates);
        }
    }
    #[inline]
    fn time_constants(&self, constants: &mut [f64]) {
        if let Some(law) = self {
            law.time_constants(constants);
        }
    }
    #[inline]
    fn senses_now(&self) -> bool {
        self.as_ref().is_some_and(T::senses_now)
    }
    #[inline]
    fn needs_position(&self) -> bool {
        self.as_ref().is_some_and(T::needs_position)
    }
    fn derivatives(&self, at: &Growing, variables: &[f64], stimuli: &[f64], out: &mut LawDerivatives) {
        if let Some(law) = self {
            law.derivatives(at, variables, stimuli, out);
        }
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        self.as_ref().map_or(f64::INFINITY, |law| law.next_discontinuity(t))
    }
    fn check(&self) -> Result<(), ParameterError> {
        self.as_ref().map_or(Ok(()), T::check)
    }
}

/// The tuple of one law stands for the law; longer tuples are built from pairs, first law first.
macro_rules! tuple_of_laws {
    ($($name:ident $index:tt),*) => {
        #[allow(unused_variables, unused_mut, unused_assignments)]
        impl<$($name: TropismLaw),*> TropismLaw for ($($name,)*) {
            #[inline]
            fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
                let mut sum = Vector3::zeros();
                let (mut v, mut m) = (0, 0);
                $(
                    let law = &self.$index;
                    let (nv, nm) = (law.variables(), if law.senses_now() { law.stimuli() } else { 0 });
                    let present = if nm > 0 { &now[m..m + nm] } else { &now[..0] };
                    sum += law.gradient(at, &past[v..v + nv], present);
                    v += nv;
                    m += law.stimuli();
                )*
                sum
            }
            #[inline]
            fn variables(&self) -> usize {
                0 $(+ self.$index.variables())*
            }
            #[inline]
            fn stimuli(&self) -> usize {
                0 $(+ self.$index.stimuli())*
            }
            #[inline]
            fn delays(&self, delays: &mut [f64]) {
                let mut v = 0;
                $(
                    let nv = self.$index.variables();
                    self.$index.delays(&mut delays[v..v + nv]);
                    v += nv;
                )*
            }
            #[inline]
            fn sense(&self, site: &Site, stimuli: &mut [f64]) {
                let mut m = 0;
                $(
                    let nm = self.$index.stimuli();
                    self.$index.sense(site, &mut stimuli[m..m + nm]);
                    m += nm;
                )*
            }
            fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
                let (mut v, mut m) = (0, 0);
                $(
                    let (nv, nm) = (self.$index.variables(), self.$index.stimuli());
                    self.$index.at_rest(&stimuli[m..m + nm], &mut variables[v..v + nv]);
                    v += nv;
                    m += nm;
                )*
            }
            #[inline]
            fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
                let (mut v, mut m) = (0, 0);
                $(
                    let (nv, nm) = (self.$index.variables(), self.$index.stimuli());
                    self.$index.settled(&stimuli[m..m + nm], &mut variables[v..v + nv]);
                    v += nv;
                    m += nm;
                )*
            }
            #[inline]
            fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
                let (mut v, mut m) = (0, 0);
                $(
                    let (nv, nm) = (self.$index.variables(), self.$index.stimuli());
                    self.$index.rates(&variables[v..v + nv], &stimuli[m..m + nm], &mut rates[v..v + nv]);
                    v += nv;
                    m += nm;
                )*
            }
            #[inline]
            fn time_constants(&self, constants: &mut [f64]) {
                let mut v = 0;
                $(
                    let nv = self.$index.variables();
                    self.$index.time_constants(&mut constants[v..v + nv]);
                    v += nv;
                )*
            }
            #[inline]
            fn senses_now(&self) -> bool {
                false $(|| self.$index.senses_now())*
            }
            #[inline]
            fn needs_position(&self) -> bool {
                false $(|| self.$index.needs_position())*
            }
            fn derivatives(&self, at: &Growing, variables: &[f64], stimuli: &[f64], out: &mut LawDerivatives) {
                let (mut v, mut m) = (0, 0);
                $(
                    let (nv, nm) = (self.$index.variables(), self.$index.stimuli());
                    let mut part = out.part(v..v + nv, m..m + nm);
                    self.$index.derivatives(at, &variables[v..v + nv], &stimuli[m..m + nm], &mut part);
                    v += nv;
                    m += nm;
                )*
            }
            fn next_discontinuity(&self, t: f64) -> f64 {
                f64::INFINITY $(.min(self.$index.next_discontinuity(t)))*
            }
            fn check(&self) -> Result<(), ParameterError> {
                $(self.$index.check()?;)*
                Ok(())
            }
        }
    };
}

tuple_of_laws!();
tuple_of_laws!(A 0);
tuple_of_laws!(A 0, B 1);
tuple_of_laws!(A 0, B 1, C 2);
tuple_of_laws!(A 0, B 1, C 2, D 3);
tuple_of_laws!(A 0, B 1, C 2, D 3, E 4);
