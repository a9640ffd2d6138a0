//! How the shoot steers: laws of differential growth.

mod compose;
mod declaration;
mod derivatives;
mod gravitropism;
mod memory;
mod oscillator;
mod perception;
mod proprioception;
mod response;
mod statoliths;

pub use declaration::{Declaration, Rotation, Size, Source, Variable};
pub(crate) use derivatives::law_matrices;
pub use gravitropism::{DirectionalTropism, Gravitropism};
pub use memory::Memory;
pub use oscillator::{Handedness, Oscillator};
pub use perception::{Perception, Signal};
pub use proprioception::{Proprioception, VisibleBending};
pub use response::{Remembered, Response};
pub use statoliths::{SettledStatoliths, Statoliths};

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::rod::Rod;
use crate::scene::Environment;
use crate::section::Section;

/// What a law can see from a material point, at a moment when the shoot is in equilibrium.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
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
    /// The cross section.
    pub section: Section,
    /// Position in the fixed frame, the base at the origin, m. Computed only for laws that
    /// [ask for it](Declaration::with_position); otherwise not a number.
    pub position: Vector3<f64>,
    /// The whole shoot, for laws that sense elsewhere than they act, at the apex say.
    pub rod: &'a Rod,
}

impl<'a> Site<'a> {
    /// The site of a frame on a rod, without strain and couple, at the base, at an unknown position: for tests of a law, which set what
    /// it reads.
    #[must_use]
    pub fn new(environment: Environment, frame: UnitQuaternion<f64>, rod: &'a Rod) -> Self {
        Self {
            environment,
            frame,
            strain: Vector3::zeros(),
            couple: Vector3::zeros(),
            arc_length: 0.0,
            apex_distance: rod.length(),
            section: rod.points()[0].section,
            position: Vector3::repeat(f64::NAN),
            rod,
        }
    }

    /// The components along the directors of a vector of the fixed frame.
    #[must_use]
    pub fn along_directors(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.frame.inverse_transform_vector(v)
    }
}

/// Place and time at which a law evaluates its growth gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Growing {
    /// Time, s.
    pub time: f64,
    /// The cross section.
    pub section: Section,
    /// Distance from the apex along the shoot, m.
    pub apex_distance: f64,
}

impl Growing {
    /// At a time (s), for a section or the radius (m) of a circular one, at a distance (m) from the apex.
    #[must_use]
    #[inline]
    pub fn new(time: f64, section: impl Into<Section>, apex_distance: f64) -> Self {
        Self { time, section: section.into(), apex_distance }
    }
}

/// A law of differential growth. It gives rates and never steps: the integrator owns time, and multiplies by REGR.
///
/// Most laws answer to what is remembered of a perception. For these [`Response`] is less to write, and
/// [`Remembered`] makes a law of it. This trait is for all others, and is what the rest of the crate knows.
///
/// A law may keep variables y at every material point of the growth zone, driven by stimuli x that it senses there:
///
/// 1. [`declare`](Self::declare) says how many stimuli and variables there are. `stimuli` and `now` are slices of as many
///    numbers as there are stimuli (`now` may be empty, see [`gradient`](Self::gradient)); `variables`, `rates` and `past`
///    of as many as there are variables;
/// 2. [`sense`](Self::sense) turns what can be seen from a point into the stimuli, once in a step;
/// 3. the variables obey ẏ = [`rates`](Self::rates)(y, x(t));
/// 4. [`gradient`](Self::gradient) turns the variables of some time ago into u̇*/REGR.
///
/// Laws compose by being put in a tuple: variables and stimuli stand one behind the other, each law sees its own, and the
/// gradients add. `()` steers nowhere. A law without variables overrides only [`gradient`](Self::gradient).
///
/// This law twists tissue that the sun has warmed. Its variable is the temperature of the tissue, in degrees above the shade,
/// which follows that of the surface.
///
/// ```
/// use morphorod::tropism::{Declaration, Growing, Site, TropismLaw, Variable};
/// use morphorod::nalgebra::Vector3;
///
/// struct Thermotwist {
///     /// Of the tissue, s.
///     time_constant: f64,
/// }
///
/// impl TropismLaw for Thermotwist {
///     fn declare(&self, to: &mut Declaration) {
///         to.stimuli(1);
///         to.variable(Variable::read_after(0.0).relaxing_in(self.time_constant));
///     }
///
///     fn sense(&self, site: &Site, stimuli: &mut [f64]) {
///         // The sun is on the side of e1.
///         stimuli[0] = 10.0 * site.along_directors(&Vector3::x()).x.max(0.0);
///     }
///
///     fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
///         rates[0] = (stimuli[0] - variables[0]) / self.time_constant;
///     }
///
///     fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
///         variables[0] = stimuli[0];
///     }
///
///     fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
///         Vector3::z() * (0.01 * past[0] / at.section.radius())
///     }
/// }
/// # assert_eq!(Declaration::of(&Thermotwist { time_constant: 60.0 }).size().variables, 1);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a tropism law",
    note = "elastic laws go to `Shoot::builder`, growth laws to `.growth`, tropisms to `.tropism`, loads to `.load`, scenes to `.scene`",
    note = "a perception becomes a response in `DirectionalTropism {{ sensitivity, perception }}`",
    note = "a response becomes a law by its memory: `response.remembered(memory)`",
    note = "tuples of up to six laws are laws, longer ones are nested: `((a, b), c)`"
)]
pub trait TropismLaw {
    /// The rate of the intrinsic strain divided by REGR, components along the directors, 1/m.
    ///
    /// `past` holds every variable as it was its declared delay ago; what stands there for one that is declared unread has no
    /// meaning. `now` holds the present stimuli if the law has declared that it
    /// [reads them](Declaration::with_present), and is empty otherwise.
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64>;

    /// Declares the stimuli and the variables, in the order in which they stand in the slices. It must say the same at
    /// every call.
    fn declare(&self, _to: &mut Declaration) {}

    /// The counts of what is declared. Provided; a law behind a pointer answers for what it points at.
    fn size(&self) -> Size {
        Size::of(|to| self.declare(to))
    }

    /// Writes the stimuli x at a place, as many as are declared.
    fn sense(&self, _site: &Site, _stimuli: &mut [f64]) {}

    /// Writes the rates ẏ of the variables y under the stimuli x, in 1/s times the variables' unit: of all of them, those that
    /// are declared to be memories, too. A law that keeps variables must write them; as provided they are not numbers, and
    /// an integrator refuses to start.
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        rates.fill(f64::NAN);
    }

    /// Writes the steady state of the variables: those whose [`rates`](Self::rates) vanish under these stimuli. As provided the variables
    /// are those of [`at_rest`](Self::at_rest), which is a steady state only under stimuli that do not drive them. The module
    /// [`stability`](crate::stability) and [`RotatingWaveSolver`](crate::cycle::RotatingWaveSolver) compare it with the rates and return an error
    /// if it is wrong; [`ConstantHistory::Steady`](crate::integrator::ConstantHistory::Steady) does not.
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.at_rest(stimuli, variables);
    }

    /// Writes the variables at t = 0 of a shoot without a history: zero unless said otherwise.
    fn at_rest(&self, _stimuli: &[f64], variables: &mut [f64]) {
        variables.fill(0.0);
    }

    /// The first time after `t` (s) at which what the law senses or asks for has a discontinuity, or its slope has one, of
    /// its own: a lamp that is switched on. Infinite if there is none. An integrator steps onto it, and reads laws a
    /// few units of rounding before and after it: whether a lamp is on for `t > on` or `t >= on` makes no difference.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The name of the law that keeps a variable, for messages of errors: the name of its type. Provided; laws that consist of others
    /// return the name of the part. `variable` counts the variables that this law declares, from zero.
    fn name_of(&self, _variable: usize) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}
