//! Loads that keep their direction in space, given by the force that they exert on everything beyond a cut.

mod apical;
mod distributed;
mod internal;
mod point;
mod weight;
mod whirl;

pub use apical::{ApicalForce, Pulse};
pub use distributed::Distributed;
pub use internal::InternalForce;
pub use point::PointForce;
pub use weight::{GradedWeight, Weight};
pub use whirl::Whirl;

use nalgebra::Vector3;

use crate::error::ParameterError;
use crate::pointers::forward_pointers;
use crate::rod::Tissue;
use crate::scene::{Environment, earlier};

/// A cut through the shoot, and what lies between it and the apex.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Cut {
    /// Arc length s of the cut from the base, m.
    pub arc_length: f64,
    /// Length beyond the cut, ℓ − s, m.
    pub length_beyond: f64,
    /// Volume of tissue beyond the cut, m³.
    pub volume_beyond: f64,
    /// Distance of the cut's material from the apex at t = 0, m: the name of the place, whatever grows.
    pub initial_apex_distance: f64,
}

impl Cut {
    /// A cut at an arc length from the base (m), of a uniform shoot that has not grown: so much length (m) of such an area (m²)
    /// lies beyond. Set the fields for any other.
    #[must_use]
    pub fn new(arc_length: f64, length_beyond: f64, area: f64) -> Self {
        let volume_beyond = length_beyond * area;
        Self { arc_length, length_beyond, volume_beyond, initial_apex_distance: length_beyond }
    }
}

/// A load fixed in space: then the force n(s) in the rod is known before the shape is.
///
/// A load says what total [`force`](Self::force) acts beyond a cut, or what force acts [per length](Self::per_length), which is
/// integrated for it, or both. Loads compose by being put in a tuple; the forces add. `()` is no load. A wind that rises
/// with height:
///
/// ```
/// use morphorod::load::{Cut, Load};
/// use morphorod::Environment;
/// use morphorod::nalgebra::Vector3;
///
/// /// Force per length and height, N/m², along e1, on a shoot that stands nearly upright.
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
/// and one that pushes the more the wider the shoot is:
///
/// ```
/// use morphorod::constitutive::Tissue;
/// use morphorod::load::{Cut, Load};
/// use morphorod::Environment;
/// use morphorod::nalgebra::Vector3;
///
/// /// Pressure of the wind, Pa, along e1.
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
/// The force should be smooth in arc length but at the places that [`jumps`](Self::jumps) names.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a load",
    note = "elastic laws go to `Shoot::builder`, growth laws to `.growth`, tropisms to `.tropism`, loads to `.load`, scenes to `.scene`",
    note = "loads implement `morphorod::load::Load`; tuples of up to six are loads, longer ones are nested: `((a, b), c)`",
    note = "a force (N) on the apex as a function of time (s) is `ApicalForce(|t: f64| ...)`"
)]
pub trait Load {
    /// The total force on the part beyond the cut, in the fixed frame, N, beside what acts [per length](Self::per_length).
    /// Both together are n(s) of equation (11), since the apex is free.
    fn force(&self, cut: &Cut, environment: &Environment) -> Vector3<f64>;

    /// The force per unit of length, as growth has made it and unstretched, on the tissue at a place, in the fixed frame, N/m: none
    /// unless said otherwise. It is integrated from the apex by the Gauss points of the elements.
    #[inline]
    fn per_length(&self, _tissue: &Tissue, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }

    /// The first time after `t` (s) at which the load or its slope has a discontinuity; infinite if there is none.
    /// Integrators step onto it, and read loads a few units of rounding before and after it: whether a load acts for `t > on`
    /// or `t >= on` makes no difference.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The places along the shoot at which the force jumps, by their distance from the apex at t = 0, m. A shoot that is
    /// built or put under other laws gets nodes there, which growth and merging keep: inside an element a jump costs
    /// accuracy.
    fn jumps(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

forward_pointers!(Load {
    fn force(cut: &Cut, environment: &Environment) -> Vector3<f64>;
    fn per_length(tissue: &Tissue, environment: &Environment) -> Vector3<f64>;
    fn next_discontinuity(t: f64) -> f64;
    fn jumps() -> Vec<f64>;
    fn check() -> Result<(), ParameterError>;
});

impl<L: Load> Load for Option<L> {
    fn force(&self, cut: &Cut, environment: &Environment) -> Vector3<f64> {
        self.as_ref().map_or_else(Vector3::zeros, |l| l.force(cut, environment))
    }

    fn per_length(&self, tissue: &Tissue, environment: &Environment) -> Vector3<f64> {
        self.as_ref().map_or_else(Vector3::zeros, |l| l.per_length(tissue, environment))
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        self.as_ref().map_or(f64::INFINITY, |l| l.next_discontinuity(t))
    }

    fn jumps(&self) -> Vec<f64> {
        self.iter().flat_map(Load::jumps).collect()
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.as_ref().map_or(Ok(()), Load::check)
    }
}

macro_rules! tuple_of_loads {
    ($($name:ident $index:tt),*) => {
        impl<$($name: Load),*> Load for ($($name,)*) {
            fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
                Vector3::zeros() $(+ self.$index.force(_cut, _environment))*
            }

            fn per_length(&self, _tissue: &Tissue, _environment: &Environment) -> Vector3<f64> {
                Vector3::zeros() $(+ self.$index.per_length(_tissue, _environment))*
            }

            fn next_discontinuity(&self, _t: f64) -> f64 {
                [f64::INFINITY $(, self.$index.next_discontinuity(_t))*].into_iter().fold(f64::INFINITY, earlier)
            }

            fn jumps(&self) -> Vec<f64> {
                [Vec::new() $(, self.$index.jumps())*].concat()
            }

            fn check(&self) -> Result<(), ParameterError> {
                $(self.$index.check()?;)*
                Ok(())
            }
        }
    };
}

tuple_of_loads!();
tuple_of_loads!(A 0);
tuple_of_loads!(A 0, B 1);
tuple_of_loads!(A 0, B 1, C 2);
tuple_of_loads!(A 0, B 1, C 2, D 3);
tuple_of_loads!(A 0, B 1, C 2, D 3, E 4);
tuple_of_loads!(A 0, B 1, C 2, D 3, E 4, F 5);
