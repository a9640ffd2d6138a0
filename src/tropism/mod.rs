//! How the shoot steers: laws of differential growth.

mod compose;
mod derivatives;
mod gravitropism;
mod memory;
mod oscillator;
mod proprioception;
mod statoliths;

pub use derivatives::LawDerivatives;
pub use gravitropism::Gravitropism;
pub use memory::Memory;
pub use oscillator::{Oscillator, Sense};
pub use proprioception::Proprioception;
pub use statoliths::{Graviception, SettledStatoliths, Statoliths};

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::rod::Rod;
use crate::scene::Environment;

/// What a law can see from a material point, at a moment when the shoot is in equilibrium.
#[derive(Debug, Clone, Copy)]
pub struct Site<'a> {
    /// Time and gravity.
    pub environment: Environment,
    /// The frame: it turns e1, e2, e3 into the directors d1, d2, d3.
    pub frame: UnitQuaternion<f64>,
    /// The visible strain u = u* + ue, components along the directors, 1/m.
    pub strain: Vector3<f64>,
    /// The couple, components along the directors, N m.
    pub couple: Vector3<f64>,
    /// Arc length from the base, m.
    pub arc_length: f64,
    /// Distance from the apex along the shoot, m.
    pub apex_distance: f64,
    /// Radius of the cross section, m.
    pub radius: f64,
    /// Position in the fixed frame, the base at the origin, m. Computed only for laws that
    /// [ask for it](TropismLaw::needs_position); otherwise zero.
    pub position: Vector3<f64>,
    /// The whole shoot, for laws that sense elsewhere than they act, at the apex say.
    pub rod: &'a Rod,
}

impl Site<'_> {
    /// The components along the directors of a vector of the fixed frame.
    #[must_use]
    pub fn along_directors(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.frame.inverse_transform_vector(v)
    }
}

/// Where and when a law is asked for a growth gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growing {
    /// Time, s.
    pub time: f64,
    /// Radius of the cross section, m.
    pub radius: f64,
    /// Distance from the apex along the shoot, m.
    pub apex_distance: f64,
}

/// A law of differential growth. It gives rates and never steps: the integrator owns time, and multiplies by REGR.
///
/// A law may keep variables at every material point of the growth zone, driven by stimuli that it senses there:
///
/// 1. [`sense`](Self::sense) turns what can be seen from a point into a few numbers, the stimuli x, once in a step;
/// 2. the variables y obey ẏ = [`rates`](Self::rates)(y, x(t));
/// 3. [`gradient`](Self::gradient) turns the variables of some time ago into u̇*/REGR.
///
/// Laws compose by being put in a tuple: variables and stimuli stand side by side, the gradients add. `()` steers nowhere.
/// A law without variables overrides only [`gradient`](Self::gradient).
pub trait TropismLaw {
    /// The rate of the intrinsic strain divided by REGR, components along the directors, 1/m.
    ///
    /// `past` holds every variable as it was its [delay](Self::delays) ago. `now` holds the present stimuli if
    /// [`senses_now`](Self::senses_now), and is empty otherwise.
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64>;

    /// How many variables the law keeps at a material point.
    #[inline]
    fn variables(&self) -> usize {
        0
    }

    /// How many stimuli it senses there.
    #[inline]
    fn stimuli(&self) -> usize {
        0
    }

    /// How long ago [`gradient`](Self::gradient) reads each variable, s; infinite for a variable that it does not read.
    #[inline]
    fn delays(&self, delays: &mut [f64]) {
        delays.fill(0.0);
    }

    /// The stimuli x at a place.
    #[inline]
    fn sense(&self, _site: &Site, _stimuli: &mut [f64]) {}

    /// The variables at t = 0 of a shoot without a past: the default past.
    fn at_rest(&self, _stimuli: &[f64], variables: &mut [f64]) {
        variables.fill(0.0);
    }

    /// The variables after these stimuli have lasted for ever: the settled past.
    #[inline]
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.at_rest(stimuli, variables);
    }

    /// The rates ẏ of the variables y under the stimuli x, in 1/s times the variables' unit.
    #[inline]
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        rates.fill(0.0);
    }

    /// For each variable the time in which it relaxes, τ in ẏ = (… − y)/τ, s; infinite if it does not. The integrator
    /// then treats −y/τ exactly, at any ratio of step to τ.
    #[inline]
    fn time_constants(&self, constants: &mut [f64]) {
        constants.fill(f64::INFINITY);
    }

    /// Whether [`gradient`](Self::gradient) reads the present stimuli, without delay.
    #[inline]
    fn senses_now(&self) -> bool {
        false
    }

    /// Whether [`sense`](Self::sense) reads the position of the site.
    #[inline]
    fn needs_position(&self) -> bool {
        false
    }

    /// The derivatives of [`rates`](Self::rates) and [`gradient`](Self::gradient), for the stability of a shoot. By
    /// [differences](LawDerivatives::by_differences) unless the law knows better: it is quicker then, and exact where
    /// variables are so small that a step of 1e-4 is a large one.
    fn derivatives(&self, at: &Growing, variables: &[f64], stimuli: &[f64], out: &mut LawDerivatives) {
        out.by_differences(self, at, variables, stimuli);
    }

    /// The first time after `t` (s) at which what the law senses or asks for jumps, or has a jump of slope, of its own:
    /// a lamp that is switched on. Infinite if there is none. An integrator steps onto it.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}
