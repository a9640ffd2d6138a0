//! Perception of stimuli by tissue.

use super::{Declaration, Site, Source};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// Number of components of a signal.
pub(super) fn signal_length<S: AsRef<[f64]> + Default>() -> usize {
    S::default().as_ref().len()
}

/// Reads a signal from the first numbers of a slice. Components beyond its end are NaN.
pub(super) fn read_signal<S: AsMut<[f64]> + Default>(from: &[f64]) -> S {
    let mut signal = S::default();
    let components = signal.as_mut().iter_mut().enumerate();
    components.for_each(|(k, x)| *x = from.get(k).copied().unwrap_or(f64::NAN));
    signal
}

/// Perception of a signal by tissue, from stimuli at its place and, if needed, from variables.
///
/// A perception without variables implements [`declare`](Self::declare) and [`sense`](Self::sense).
/// This example perceives the direction of light:
///
/// ```
/// use morphorod::tropism::{Declaration, DirectionalTropism, Memory, Perception, Response, Site, Source};
/// use morphorod::nalgebra::Vector3;
///
/// struct Sunlight(Vector3<f64>);
///
/// impl Perception for Sunlight {
///     type Signal = [f64; 2];
///
///     fn declare(&self, to: &mut Declaration) -> Source {
///         to.stimulus_pair()
///     }
///
///     fn sense(&self, site: &Site, stimuli: &mut [f64]) {
///         let light = site.along_directors(&self.0);
///         stimuli.copy_from_slice(&[light.x, light.y]);
///     }
/// }
///
/// // A law: growth bends the tissue towards the light.
/// let phototropism = DirectionalTropism { sensitivity: 0.8, perception: Sunlight(Vector3::x()) }
///     .remembered(Memory { time: 600.0, delay: 300.0 });
/// # let _ = phototropism;
/// ```
///
/// A photoreceptor whose excitation y follows the light l and saturates, τ ẏ = l/(1 + |l|/l0) − y:
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::tropism::{Declaration, Perception, Rotation, Site, Source, Variable};
///
/// struct Photoreceptor {
///     /// l in the fixed frame, W/m².
///     light: Vector3<f64>,
///     /// l0, W/m².
///     saturation: f64,
///     /// τ, s.
///     time: f64,
/// }
///
/// impl Perception for Photoreceptor {
///     type Signal = [f64; 2];
///
///     fn declare(&self, to: &mut Declaration) -> Source {
///         to.stimulus_pair();
///         // The integrator treats the term −y/τ exactly. The components of the vector turn with the directors.
///         let component = |rotation| Variable::unread().relaxing_in(self.time).turning(rotation);
///         let y = to.variable(component(Rotation::First));
///         to.variable(component(Rotation::Second));
///         y
///     }
///
///     fn sense(&self, site: &Site, stimuli: &mut [f64]) {
///         let light = site.along_directors(&self.light);
///         stimuli.copy_from_slice(&[light.x, light.y]);
///     }
///
///     fn signal(&self, y: &[f64], _stimuli: &[f64]) -> [f64; 2] {
///         [y[0], y[1]]
///     }
///
///     fn rates(&self, y: &[f64], stimuli: &[f64], rates: &mut [f64]) {
///         self.steady(stimuli, rates);
///         for (rate, y) in rates.iter_mut().zip(y) {
///             *rate = (*rate - y) / self.time;
///         }
///     }
///
///     /// The excitation at which the rates vanish.
///     fn steady(&self, l: &[f64], y: &mut [f64]) {
///         let excess = 1.0 + l[0].hypot(l[1]) / self.saturation;
///         y.copy_from_slice(&[l[0] / excess, l[1] / excess]);
///     }
///
///     /// The excitation at t = 0: the light is switched on.
///     fn initial(&self, _l: &[f64], y: &mut [f64]) {
///         y.fill(0.0);
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a perception",
    note = "perceptions implement `morphorod::tropism::Perception`, as `SettledStatoliths` does"
)]
pub trait Perception {
    /// Signal that the response depends on, `[f64; N]`.
    type Signal: AsRef<[f64]> + AsMut<[f64]> + Default + Copy;

    /// Declares the stimuli and the variables, which the gradient does not read. Returns the first
    /// component of the signal among them. By default the stimuli are the signal.
    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimuli(signal_length::<Self::Signal>())
    }

    /// Writes the declared stimuli at a place.
    fn sense(&self, site: &Site, stimuli: &mut [f64]);

    /// Signal for given variables and stimuli; by default the first stimuli.
    fn signal(&self, _variables: &[f64], stimuli: &[f64]) -> Self::Signal {
        read_signal(stimuli)
    }

    /// Writes the rates of the variables, in their unit per second. A perception with variables
    /// must implement it; the default is NaN.
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        rates.fill(f64::NAN);
    }

    /// Writes the steady state of the variables, for which the [`rates`](Self::rates) vanish under
    /// constant stimuli. The default is zero; see
    /// [`TropismLaw::steady`](super::TropismLaw::steady).
    fn steady(&self, _stimuli: &[f64], variables: &mut [f64]) {
        variables.fill(0.0);
    }

    /// Writes the variables at t = 0 of a shoot without a history; by default the steady state.
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.steady(stimuli, variables);
    }

    /// Delay with which the response reads the signal, s.
    fn delay(&self) -> f64 {
        0.0
    }

    /// First time after `t` (s) at which the stimuli are discontinuous, as
    /// [`TropismLaw::next_discontinuity`](super::TropismLaw::next_discontinuity).
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// Forwards all methods of a perception to a part with the same signal, except its sensing.
macro_rules! forward_signal {
    ($self:ident, $part:expr) => {
        $crate::pointers::forward_methods!($self, Perception of $part =>
            fn declare(to: &mut Declaration) -> Source;
            fn signal(variables: &[f64], stimuli: &[f64]) -> Self::Signal;
            fn rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
            fn steady(stimuli: &[f64], variables: &mut [f64]);
            fn initial(stimuli: &[f64], variables: &mut [f64]);
            fn delay() -> f64;
            fn next_discontinuity(t: f64) -> f64;
            fn check() -> Result<(), ParameterError>;
        );
    };
}

pub(super) use forward_signal;

forward_pointers!(Perception forward_signal {
    type Signal;
    fn sense(site: &Site, stimuli: &mut [f64]);
});
