//! Tropism laws: differential growth, equations (4) to (8).

mod at_apex;
mod compose;
mod declaration;
mod derivatives;
mod gravitropism;
mod kernel;
mod kernel_fit;
mod light;
mod localised;
mod memory;
mod oscillator;
mod perception;
mod proprioception;
mod random;
mod response;
mod rotation;
mod statoliths;
mod touch;

pub use at_apex::AtApex;
pub use declaration::{Declaration, Size, Source, Variable};
pub(crate) use derivatives::{law_matrices, rates_in_steady_state};
pub use gravitropism::{DirectionalTropism, Gravitropism};
pub use kernel::{KernelTerm, MemoryKernel};
pub use light::{During, Light, LightSource, LineLight, ParallelLight, Phototropism, PointLight};
pub use localised::Localised;
pub use memory::Memory;
pub use oscillator::{Handedness, Oscillator};
pub use perception::Perception;
pub use proprioception::Proprioception;
pub use random::RandomDrive;
pub use response::{Filtered, Remembered, Response};
pub use rotation::Rotation;
pub use statoliths::{SettledStatoliths, Statoliths};
pub use touch::{Thigmotropism, Touch};

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::ParameterError;
use crate::rod::{MaterialPoint, Rod};
use crate::scene::Environment;
use crate::section::Section;

/// Material point of a shoot in equilibrium, from which a law computes its stimuli.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Site<'a> {
    /// Time and gravity.
    pub environment: Environment,
    /// Frame, the rotation of e1, e2, e3 to the directors d1, d2, d3.
    pub frame: UnitQuaternion<f64>,
    /// Visible strain u = u* + ue, components along the directors, 1/m.
    pub strain: Vector3<f64>,
    /// Couple, components along the directors, N m.
    pub couple: Vector3<f64>,
    /// Arc length from the base, m.
    pub arc_length: f64,
    /// Distance from the apex along the shoot, m.
    pub apex_distance: f64,
    /// Distance from the apex at t = 0, m, which identifies the material point.
    pub initial_apex_distance: f64,
    /// Cross section.
    pub section: Section,
    /// Position in the fixed frame, m; the base is at [`Scene::position`](crate::Scene::position).
    /// NaN unless a law [declares](Declaration::with_position) that it reads the position.
    pub position: Vector3<f64>,
    /// Position of the tip, under the conditions of `position`.
    pub tip: Vector3<f64>,
    /// The rod, for laws that sense at another place than they act, as at the apex.
    pub rod: &'a Rod,
}

impl<'a> Site<'a> {
    /// Site at the base of a rod with a given frame, zero strain and couple, and unknown position.
    /// Tests of a law set the fields that the law reads.
    #[must_use]
    pub fn new(environment: Environment, frame: UnitQuaternion<f64>, rod: &'a Rod) -> Self {
        Self {
            environment,
            frame,
            strain: Vector3::zeros(),
            couple: Vector3::zeros(),
            arc_length: 0.0,
            apex_distance: rod.length(),
            initial_apex_distance: rod.initial_length,
            section: rod.points()[0].section,
            position: Vector3::repeat(f64::NAN),
            tip: Vector3::repeat(f64::NAN),
            rod,
        }
    }

    /// Components along the directors of a vector in the fixed frame.
    #[must_use]
    #[inline]
    pub fn along_directors(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.frame.inverse_transform_vector(v)
    }
}

/// Place and time at which a law evaluates its growth gradient.
///
/// The place is in the growth zone, where the [age](crate::constitutive::Tissue::age) of the tissue
/// is zero: it begins when the tissue leaves the zone. What distinguishes tissue there is how much
/// it has grown and where it was, which follow from both distances. In uniform growth the stretch
/// since t = 0 is their ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Growing {
    /// Time, s.
    pub time: f64,
    /// Cross section.
    pub section: Section,
    /// Distance from the apex along the shoot, m.
    pub apex_distance: f64,
    /// Distance from the apex at t = 0, m, which identifies the material point.
    pub initial_apex_distance: f64,
}

impl Growing {
    /// Place at a distance (m) from the apex with a section, or the radius (m) of a circular one,
    /// at a time (s), in a shoot that has not grown.
    #[must_use]
    #[inline]
    pub fn new(time: f64, section: impl Into<Section>, apex_distance: f64) -> Self {
        Self {
            time,
            section: section.into(),
            apex_distance,
            initial_apex_distance: apex_distance,
        }
    }

    /// A material point at a distance from the apex (m) at a time (s).
    #[inline]
    pub(crate) fn of(point: &MaterialPoint, time: f64, apex_distance: f64) -> Self {
        let MaterialPoint {
            section,
            initial_apex_distance,
            ..
        } = *point;
        Self {
            time,
            section,
            apex_distance,
            initial_apex_distance,
        }
    }

    /// The place of a site at its time.
    pub(crate) fn at(site: &Site) -> Self {
        let &Site {
            environment,
            section,
            apex_distance,
            initial_apex_distance,
            ..
        } = site;
        Self {
            time: environment.time,
            section,
            apex_distance,
            initial_apex_distance,
        }
    }
}

/// Law of differential growth: the growth gradient u̇*/REGR, which the integrator multiplies by
/// REGR and integrates in time.
///
/// Most laws are a response to the memory of a perceived signal. They are implemented by
/// [`Response`], from which [`Remembered`] makes a law.
///
/// A law can have variables y at every material point of the growth zone, and stimuli x on which
/// their rates depend:
///
/// 1. [`declare`](Self::declare) declares the stimuli and the variables. `stimuli` and `now` are
///    slices of all stimuli (`now` may be empty, see [`gradient`](Self::gradient)); `variables`,
///    `rates` and `past` are slices of all variables.
/// 2. [`sense`](Self::sense) computes the stimuli at a point, after each equilibrium.
/// 3. The variables obey ẏ = [`rates`](Self::rates)(y, x(t)).
/// 4. [`gradient`](Self::gradient) computes u̇*/REGR from the variables at earlier times.
///
/// A tuple or a `Vec` of laws is a law: each law has its own variables and stimuli, and the
/// gradients add. `()` has the gradient zero. A law without variables implements only
/// [`gradient`](Self::gradient).
///
/// This example twists tissue on the sunny side. Its variable is the temperature of the tissue
/// relative to the shade, in K, which follows that of the surface.
///
/// ```
/// use morphorod::tropism::{Declaration, Growing, Site, TropismLaw, Variable};
/// use morphorod::nalgebra::Vector3;
///
/// struct Thermotwist {
///     /// Time constant of the temperature, s.
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
    note = "`Shoot::builder` takes the elastic law, `.growth`, `.tropism`, `.load` and `.scene` take the others",
    note = "a perception becomes a response in `DirectionalTropism {{ sensitivity, perception }}`",
    note = "a response becomes a law by its memory: `response.remembered(memory)`",
    note = "tuples of up to six laws and `Vec`s of laws are laws"
)]
pub trait TropismLaw {
    /// Growth gradient u̇*/REGR, the rate of the intrinsic strain divided by REGR, components along
    /// the directors, 1/m.
    ///
    /// `past` contains every variable at the time that is earlier by its declared delay; the values
    /// of [unread](Variable::unread) variables are undefined. `now` contains the present stimuli if
    /// the law declares that it [reads them](Declaration::with_present), and is empty otherwise.
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64>;

    /// Declares the stimuli and the variables in the order of the slices. The declaration must be
    /// the same at every call.
    fn declare(&self, _to: &mut Declaration) {}

    /// Numbers of stimuli and variables. Laws do not implement it, except pointers, which forward
    /// it.
    fn size(&self) -> Size {
        Size::of(|to| self.declare(to))
    }

    /// Writes the declared stimuli x at a place, in the order of their declaration. A law with
    /// stimuli must implement it; the default writes nothing.
    fn sense(&self, _site: &Site, _stimuli: &mut [f64]) {}

    /// Writes the rates ẏ of all variables y under the stimuli x, in their unit per second,
    /// including those of declared memories. A law with variables must implement it; the default is
    /// NaN, for which an integrator returns an error.
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        rates.fill(f64::NAN);
    }

    /// Writes the rates of the [coupled](Variable::coupled) variables and of those that are not
    /// declared memories. It may omit the others, which are NaN in `variables`. The default writes
    /// all [`rates`](Self::rates). Integrators call it several times in a step.
    fn coupled_rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.rates(variables, stimuli, rates);
    }

    /// Writes the steady state of the variables, for which the [`rates`](Self::rates) vanish under
    /// constant stimuli. The default is [`initial`](Self::initial), which is a steady state only if
    /// the rates are zero there, for example if they do not depend on the stimuli. The module
    /// [`stability`](crate::stability) and [`RotatingWaveSolver`](crate::cycle::RotatingWaveSolver)
    /// return an error if the rates do not vanish;
    /// [`ConstantHistory::Steady`](crate::integrator::ConstantHistory::Steady) does not check them.
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.initial(stimuli, variables);
    }

    /// Writes the variables at t = 0 of a shoot without a history; zero by default.
    fn initial(&self, _stimuli: &[f64], variables: &mut [f64]) {
        variables.fill(0.0);
    }

    /// First time after `t` (s) at which the stimuli, the gradient or their time derivatives are
    /// discontinuous as functions of time, as for a lamp that is switched on; infinite by default.
    /// Integrators step onto it and evaluate the law a few units of rounding before and after it.
    /// The value at this time itself has no effect.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Shortest period of the gradient as a function of time (s), as that of an oscillator;
    /// infinite by default. A time step of more than half of it is an error of
    /// [`MethodOfSteps`](crate::integrator::MethodOfSteps), since it does not distinguish this
    /// period from longer ones.
    fn shortest_period(&self) -> f64 {
        f64::INFINITY
    }

    /// Name of the type of the law whose gradient is not finite, for messages of errors. A
    /// composition returns the name of the part. The arguments are those of
    /// [`gradient`](Self::gradient).
    fn name_of_undefined(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Name of the type of the law that declares a variable, for messages of errors. A composition
    /// returns the name of the part. `variable` is the index among the variables of this law, from
    /// zero.
    fn name_of(&self, _variable: usize) -> &'static str {
        std::any::type_name::<Self>()
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}
