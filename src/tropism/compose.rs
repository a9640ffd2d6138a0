//! Compositions of tropism laws: tuples, lists, options, and laws behind pointers.

use nalgebra::Vector3;

use super::{Declaration, Growing, Site, Size, TropismLaw};
use crate::compositions::{combined, compositions};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;
use crate::scene::earlier;

/// Forwards all methods of a law to a part, except its gradient and its check.
macro_rules! forward_state {
    ($self:ident, $part:expr) => {
        $crate::pointers::forward_methods!($self, TropismLaw of $part =>
            fn declare(to: &mut Declaration);
            fn sense(site: &Site, stimuli: &mut [f64]);
            fn rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
            fn coupled_rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
            fn steady(stimuli: &[f64], variables: &mut [f64]);
            fn initial(stimuli: &[f64], variables: &mut [f64]);
            fn next_discontinuity(t: f64) -> f64;
            fn shortest_period() -> f64;
            fn name_of_undefined(at: &Growing, past: &[f64], now: &[f64]) -> &'static str;
            fn name_of(variable: usize) -> &'static str;
        );
    };
}

pub(super) use forward_state;

forward_pointers!(TropismLaw forward_state {
    fn gradient(at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64>;
    fn size() -> Size;
    fn check() -> Result<(), ParameterError>;
});

/// The methods of a law that consists of the laws in one or more iterators.
///
/// Variables and stimuli of the parts are consecutive in the slices, and gradients add. Slices
/// whose lengths do not agree with the declarations of the parts give NaN, which the integrator
/// rejects.
macro_rules! composition {
    ($self:ident: $($laws:expr),*) => {
        #[inline]
        fn gradient(&$self, at: &Growing, mut past: &[f64], mut now: &[f64]) -> Vector3<f64> {
            let (present, mut sum) = (!now.is_empty(), Vector3::zeros());
            $(for law in $laws {
                let size = law.size();
                let number = if present || size.reads_present { size.stimuli } else { 0 };
                let own = (past.split_off(..size.variables), now.split_off(..number));
                let (Some(past), Some(now)) = own else { return Vector3::repeat(f64::NAN) };
                sum += law.gradient(at, past, size.present(now));
            })*
            if past.is_empty() && now.is_empty() { sum } else { Vector3::repeat(f64::NAN) }
        }
        #[inline(always)]
        fn declare(&$self, to: &mut Declaration) {
            $(for law in $laws {
                law.declare(to);
            })*
        }
        #[inline]
        fn sense(&$self, site: &Site, stimuli: &mut [f64]) {
            let mut rest = &mut *stimuli;
            $(for law in $laws {
                let Some(own) = rest.split_off_mut(..law.size().stimuli) else { return stimuli.fill(f64::NAN) };
                law.sense(site, own);
            })*
            if !rest.is_empty() {
                stimuli.fill(f64::NAN);
            }
        }
        composition!(@rates rates $self: $($laws),*);
        composition!(@rates coupled_rates $self: $($laws),*);
        composition!(@state steady $self: $($laws),*);
        composition!(@state initial $self: $($laws),*);
        fn next_discontinuity(&$self, t: f64) -> f64 {
            combined!(f64::INFINITY, |first, law| first = earlier(first, law.next_discontinuity(t)); $($laws),*)
        }
        fn shortest_period(&$self) -> f64 {
            combined!(f64::INFINITY, |shortest, law| shortest = earlier(shortest, law.shortest_period()); $($laws),*)
        }
        fn name_of_undefined(&$self, at: &Growing, mut past: &[f64], mut now: &[f64]) -> &'static str {
            let present = !now.is_empty();
            $(for law in $laws {
                let size = law.size();
                let number = if present || size.reads_present { size.stimuli } else { 0 };
                let own = (past.split_off(..size.variables), now.split_off(..number));
                let (Some(past), Some(now)) = own else { return std::any::type_name::<Self>() };
                if !law.gradient(at, past, size.present(now)).sum().is_finite() {
                    return law.name_of_undefined(at, past, size.present(now));
                }
            })*
            std::any::type_name::<Self>()
        }
        fn name_of(&$self, mut variable: usize) -> &'static str {
            $(for law in $laws {
                match variable.checked_sub(law.size().variables) {
                    None => return law.name_of(variable),
                    Some(rest) => variable = rest,
                }
            })*
            std::any::type_name::<Self>()
        }
        fn check(&$self) -> Result<(), ParameterError> {
            $(for law in $laws {
                law.check()?;
            })*
            Ok(())
        }
    };
    (@rates $method:ident $self:ident: $($laws:expr),*) => {
        #[inline]
        fn $method(&$self, mut variables: &[f64], mut stimuli: &[f64], rates: &mut [f64]) {
            let mut rest = &mut *rates;
            $(for law in $laws {
                let Size { variables: v, stimuli: x, .. } = law.size();
                let own = (variables.split_off(..v), stimuli.split_off(..x), rest.split_off_mut(..v));
                let (Some(variables), Some(stimuli), Some(own)) = own else { return rates.fill(f64::NAN) };
                law.$method(variables, stimuli, own);
            })*
            if !(variables.is_empty() && stimuli.is_empty()) {
                rates.fill(f64::NAN);
            }
        }
    };
    (@state $method:ident $self:ident: $($laws:expr),*) => {
        #[inline]
        fn $method(&$self, mut stimuli: &[f64], variables: &mut [f64]) {
            let mut rest = &mut *variables;
            $(for law in $laws {
                let Size { variables: v, stimuli: x, .. } = law.size();
                let (Some(x), Some(y)) = (stimuli.split_off(..x), rest.split_off_mut(..v)) else {
                    return variables.fill(f64::NAN);
                };
                law.$method(x, y);
            })*
            if !(stimuli.is_empty() && rest.is_empty()) {
                variables.fill(f64::NAN);
            }
        }
    };
}

/// No law: no variables, and a gradient of zero.
impl TropismLaw for () {
    #[inline]
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

compositions!(TropismLaw, composition);
