//! Dead loads: forces whose direction in space does not depend on the shape of the shoot.

mod apical;
mod distributed;
mod internal;
mod point;
mod weight;
mod whirl;

pub use apical::{ApicalForce, Pulse};
pub use distributed::Distributed;
pub use internal::InternalForce;
pub(crate) use internal::PointReaction;
pub use point::PointForce;
pub use weight::{GradedWeight, Weight};
pub use whirl::Whirl;

use nalgebra::Vector3;

use crate::compositions::{combined, compositions};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;
use crate::rod::Tissue;
use crate::scene::{Environment, earlier};

/// Cross section through the shoot at a point, with the part of the shoot between it and the apex.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Cut {
    /// Arc length s of the cut from the base, m.
    pub arc_length: f64,
    /// Length beyond the cut, ℓ − s, m.
    pub length_beyond: f64,
    /// Volume of tissue beyond the cut, m³.
    pub volume_beyond: f64,
    /// Distance of the material point from the apex at t = 0, m. It identifies the point during
    /// growth.
    pub initial_apex_distance: f64,
}

impl Cut {
    /// Cut at an arc length from the base (m) of a uniform shoot that has not grown, with a length
    /// (m) and a cross-sectional area (m²) beyond it. For other shoots set the fields.
    #[must_use]
    pub fn new(arc_length: f64, length_beyond: f64, area: f64) -> Self {
        let volume_beyond = length_beyond * area;
        Self {
            arc_length,
            length_beyond,
            volume_beyond,
            initial_apex_distance: length_beyond,
        }
    }
}

/// Load that does not depend on the shape of the shoot (a dead load), so that the force n(s) in the
/// rod is known before the shape, equation (11).
///
/// A load returns the total [`force`](Self::force) on the part beyond a cut, the force [per
/// length](Self::per_length), which is integrated, or both. Forces are in newtons and in the fixed
/// frame. A tuple or a `Vec` of loads is a load, the sum of its parts; `()` is no load. A wind that
/// increases with height:
///
/// ```
/// use morphorod::load::{Cut, Load};
/// use morphorod::Environment;
/// use morphorod::nalgebra::Vector3;
///
/// /// Force per length and height along e1 on a nearly upright shoot, N/m².
/// struct Wind(f64);
///
/// impl Load for Wind {
///     fn force(&self, cut: &Cut, _environment: &Environment) -> Vector3<f64> {
///         // The integral of the force per length from the cut to the apex.
///         let (from, to) = (cut.arc_length, cut.arc_length + cut.length_beyond);
///         Vector3::x() * (self.0 * (to * to - from * from) / 2.0)
///     }
/// }
/// ```
///
/// A wind whose force is proportional to the width of the shoot:
///
/// ```
/// use morphorod::constitutive::Tissue;
/// use morphorod::load::{Cut, Load};
/// use morphorod::Environment;
/// use morphorod::nalgebra::Vector3;
///
/// /// Pressure of the wind along e1, Pa.
/// struct Pressure(f64);
///
/// impl Load for Pressure {
///     fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
///         Vector3::zeros()
///     }
///     fn per_length(&self, tissue: &Tissue, _environment: &Environment) -> Vector3<f64> {
///         Vector3::x() * (self.0 * 2.0 * tissue.section.along_d2)
///     }
/// }
/// ```
///
/// The force must be smooth in arc length except at the places that [`jumps`](Self::jumps) returns.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a load",
    note = "`Shoot::builder` takes the elastic law, `.growth`, `.tropism`, `.load` and `.scene` take the others",
    note = "loads implement `morphorod::load::Load`; tuples of up to six loads and `Vec`s of loads are loads",
    note = "a force (N) on the apex as a function of time (s) is `ApicalForce(|t: f64| ...)`"
)]
pub trait Load {
    /// Total force on the part beyond the cut, in the fixed frame, N, without the force [per
    /// length](Self::per_length). Their sum is n(s) of equation (11), since the apex is free.
    fn force(&self, cut: &Cut, environment: &Environment) -> Vector3<f64>;

    /// Force per unit of unstretched length on the tissue at a point, in the fixed frame, N/m; zero
    /// by default. It is integrated from the apex by the Gauss points of the elements.
    #[inline]
    fn per_length(&self, _tissue: &Tissue, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// First time after `t` (s) at which the load or its time derivative is discontinuous; infinite
    /// by default. Integrators step onto it and evaluate the load a few units of rounding before
    /// and after it. The value at this time itself has no effect.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Shortest period (s) of the load as a function of time after `t` (s), as that of a force that
    /// rotates; infinite by default. A time step of more than half of it is an error of
    /// [`MethodOfSteps`](crate::integrator::MethodOfSteps), since it does not distinguish this
    /// period from longer ones. [`Adaptive`](crate::integrator::Adaptive) begins with at most such
    /// steps.
    fn shortest_period(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Places along the shoot at which the force is discontinuous, as distances from the apex at t
    /// = 0, m. The builder of a shoot puts nodes there, which growth and merging of elements keep.
    /// A discontinuity inside an element reduces the accuracy. Empty by default. A distance outside
    /// 0 to the length at t = 0 is an error of [`build`](crate::ShootBuilder::build) and
    /// [`with_model`](crate::Shoot::with_model).
    fn jumps(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

forward_pointers!(Load {
    fn force(cut: &Cut, environment: &Environment) -> Vector3<f64>;
    fn per_length(tissue: &Tissue, environment: &Environment) -> Vector3<f64>;
    fn next_discontinuity(t: f64) -> f64;
    fn shortest_period(t: f64) -> f64;
    fn jumps() -> Vec<f64>;
    fn check() -> Result<(), ParameterError>;
});

/// The methods of a load that is the sum of the loads in one or more iterators.
macro_rules! sum_of_loads {
    ($self:ident: $($loads:expr),*) => {
        fn force(&$self, cut: &Cut, environment: &Environment) -> Vector3<f64> {
            combined!(Vector3::zeros(), |sum, load| sum += load.force(cut, environment); $($loads),*)
        }

        fn per_length(&$self, tissue: &Tissue, environment: &Environment) -> Vector3<f64> {
            combined!(Vector3::zeros(), |sum, load| sum += load.per_length(tissue, environment); $($loads),*)
        }

        fn next_discontinuity(&$self, t: f64) -> f64 {
            combined!(f64::INFINITY, |first, load| first = earlier(first, load.next_discontinuity(t)); $($loads),*)
        }

        fn shortest_period(&$self, t: f64) -> f64 {
            combined!(f64::INFINITY, |least, load| least = earlier(least, load.shortest_period(t)); $($loads),*)
        }

        fn jumps(&$self) -> Vec<f64> {
            combined!(Vec::new(), |all, load| all.extend(load.jumps()); $($loads),*)
        }

        fn check(&$self) -> Result<(), ParameterError> {
            $(for load in $loads {
                load.check()?;
            })*
            Ok(())
        }
    };
}

/// No load.
impl Load for () {
    fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }
}

compositions!(Load, sum_of_loads);
