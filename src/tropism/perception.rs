//! What tissue perceives at its place.

use super::{Declaration, Site, Source};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// A few numbers that are passed on from perception to response: `[f64; N]`.
pub trait Signal: AsRef<[f64]> + Copy {
    /// How many numbers.
    const LENGTH: usize;

    /// The first numbers of a slice; not numbers where it holds fewer.
    fn read(from: &[f64]) -> Self;
}

impl<const N: usize> Signal for [f64; N] {
    const LENGTH: usize = N;

    fn read(from: &[f64]) -> Self {
        std::array::from_fn(|k| from.get(k).copied().unwrap_or(f64::NAN))
    }
}

/// What tissue perceives at its place: a signal, from what is sensed there and from variables of its own if it needs any.
///
/// A perception without variables says what its signal is, [`declare`](Self::declare)s its stimuli and
/// [`sense`](Self::sense)s them. This one perceives where the light comes from:
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
/// // A law: tissue turns to where the light came from.
/// let phototropism = DirectionalTropism { sensitivity: 0.8, perception: Sunlight(Vector3::x()) }
///     .remembered(Memory { time: 600.0, delay: 300.0 });
/// # let _ = phototropism;
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a perception",
    note = "what tissue perceives implements `morphorod::tropism::Perception`, as `SettledStatoliths` does"
)]
pub trait Perception {
    /// The numbers that are passed on.
    type Signal: Signal;

    /// Declares the stimuli, and the variables if there are any, which the gradient does not read. Returns where the
    /// signal stands among them. Unless said otherwise the stimuli are the signal, of which nothing more is known.
    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimuli(Self::Signal::LENGTH)
    }

    /// Writes the stimuli at a place, as many as are declared.
    fn sense(&self, site: &Site, stimuli: &mut [f64]);

    /// The signal, from the variables and the stimuli: the first stimuli unless said otherwise.
    fn signal(&self, _variables: &[f64], stimuli: &[f64]) -> Self::Signal {
        Self::Signal::read(stimuli)
    }

    /// Writes the rates of the variables, their unit per second. As provided they are not numbers: a perception that keeps
    /// variables must write them.
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        rates.fill(f64::NAN);
    }

    /// Writes the steady state of the variables: those whose [`rates`](Self::rates) vanish under these stimuli. As provided they are
    /// zero, which is a steady state only under stimuli that do not drive them; see
    /// [`TropismLaw::steady`](super::TropismLaw::steady).
    fn steady(&self, _stimuli: &[f64], variables: &mut [f64]) {
        variables.fill(0.0);
    }

    /// Writes the variables at t = 0 of a shoot without a history: steady unless said otherwise.
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.steady(stimuli, variables);
    }

    /// The time by which the signal still lags when it is read, s.
    fn delay(&self) -> f64 {
        0.0
    }

    /// The first time after `t` (s) at which the stimuli have a discontinuity of their own, as
    /// [`TropismLaw::next_discontinuity`](super::TropismLaw::next_discontinuity).
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

forward_pointers!(Perception {
    type Signal;
    fn declare(to: &mut Declaration) -> Source;
    fn sense(site: &Site, stimuli: &mut [f64]);
    fn signal(variables: &[f64], stimuli: &[f64]) -> T::Signal;
    fn rates(variables: &[f64], stimuli: &[f64], rates: &mut [f64]);
    fn steady(stimuli: &[f64], variables: &mut [f64]);
    fn at_rest(stimuli: &[f64], variables: &mut [f64]);
    fn delay() -> f64;
    fn next_discontinuity(t: f64) -> f64;
    fn check() -> Result<(), ParameterError>;
});
