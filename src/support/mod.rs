//! What holds a shoot besides its base, and what it touches: holds, springs and obstacles.
//!
//! A prop under its apex supports a horizontal rod. At small load it bears 3/8 of the weight:
//!
//! ```
//! use std::f64::consts::{FRAC_PI_2, PI};
//!
//! use morphorod::constitutive::LinearElastic;
//! use morphorod::equilibrium::NewtonSolver;
//! use morphorod::load::Weight;
//! use morphorod::nalgebra::Vector3;
//! use morphorod::profile::Profile;
//! use morphorod::rod::Rod;
//! use morphorod::support::Hold;
//! use morphorod::{Order, Scene, Still};
//!
//! let (length, radius, density) = (0.04, 5e-4, 1000.0);
//! let scene = Still::tilted(FRAC_PI_2);
//! let mut rod = Rod::uniform(length, radius, scene.base, 8, Order::Eight)?;
//! let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
//! // The apex slides without friction in the horizontal plane through the base.
//! let prop = Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis());
//! let environment = scene.environment(0.0);
//! let held = NewtonSolver::default().solve_held(&mut rod, &tissue, &Weight { density }, &prop, &environment)?;
//! let weight = density * scene.gravity.norm() * PI * radius * radius * length;
//! assert!((held.reactions[0].force.z / weight - 0.37501).abs() < 1e-5);
//! // The couple at the base is an eighth of weight times length, a quarter of that of the free rod.
//! let base = Profile::of(&rod, &tissue, &Weight { density }, &environment).at(0.0).expect("a number");
//! assert!((base.couple.norm() / (weight * length) - 0.125).abs() < 1e-3);
//! assert_eq!(held.equilibrium.inertia.negative, 0, "stable");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod contact;
mod cuboid;
mod hold;
mod obstacle;
mod polyhedron;
mod potential;
mod reaction;
#[cfg(test)]
mod tests;
mod union;

pub use contact::Contact;
pub use cuboid::Cuboid;
pub(crate) use hold::closest_about;
pub use hold::{Hold, Joint, Moving, Orientation, Position};
pub use obstacle::{Capsule, Cylinder, Distance, HalfSpace, Obstacle, Sphere};
pub use polyhedron::ConvexPolyhedron;
pub use potential::{Argument, Elastic, Energy, Potential};
pub(crate) use reaction::Patch;
pub use reaction::{Reaction, Slip};
pub use union::Union;

use crate::compositions::{combined, compositions};
use crate::error::ParameterError;
use crate::pointers::forward_pointers;
use crate::scene::earlier;

/// What holds a shoot: the joint of its base, [holds](Hold) and [springs](Elastic) at places along
/// it, and obstacles that it may [touch](Contact).
///
/// `()` is no support: the base is clamped and the rest of the shoot is free. A tuple or a `Vec` of
/// supports is a support that combines its parts.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{Contact, Cylinder, Hold};
///
/// // The apex is held at a place, and the shoot may touch a pole of 1 mm radius. The shoot has a radius of 0.5 mm.
/// let pole = Cylinder { through: Vector3::x() * 0.02, along: Vector3::z(), radius: 1e-3 };
/// let hold = Hold::apex().at(Vector3::new(0.0, 0.0, 0.04));
/// let support = (hold, Contact { obstacle: pole, radius: 5e-4, friction: 0.0 });
/// # let _ = support;
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a support",
    note = "supports implement `morphorod::support::Support`: `Hold`, `Elastic` and `Contact` do; tuples of up to six \
        supports and `Vec`s of supports are supports"
)]
pub trait Support {
    /// Whether there is no support. A shoot without support has the equilibrium of a free rod.
    fn is_absent(&self) -> bool {
        false
    }

    /// The joint of the base; `None` for the clamp, which is the default.
    fn base(&self) -> Option<Joint> {
        None
    }

    /// The holds and springs at a time (s); none by default.
    fn holds(&self, _time: f64) -> Vec<Hold> {
        Vec::new()
    }

    /// The springs and elastic joints with a potential; none by default.
    fn potentials(&self) -> Vec<Elastic<&dyn Potential>> {
        Vec::new()
    }

    /// The obstacles that the shoot may touch; none by default.
    fn contacts(&self) -> Vec<Contact<&dyn Obstacle>> {
        Vec::new()
    }

    /// The first time after `t` (s) at which a hold or an obstacle moves discontinuously, or its
    /// velocity is discontinuous; infinite by default.
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

forward_pointers!(Support {
    fn is_absent() -> bool;
    fn base() -> Option<Joint>;
    fn holds(time: f64) -> Vec<Hold>;
    fn potentials() -> Vec<Elastic<&dyn Potential>>;
    fn contacts() -> Vec<Contact<&dyn Obstacle>>;
    fn next_discontinuity(t: f64) -> f64;
    fn check() -> Result<(), ParameterError>;
});

/// No support besides the clamped base.
impl Support for () {
    fn is_absent(&self) -> bool {
        true
    }
}

/// The methods of a support that combines the supports in one or more iterators.
macro_rules! all_supports {
    ($self:ident: $($supports:expr),*) => {
        fn is_absent(&$self) -> bool {
            combined!(true, |absent, support| absent &= support.is_absent(); $($supports),*)
        }

        fn base(&$self) -> Option<Joint> {
            combined!(None, |joint, support| joint = joint.or(support.base()); $($supports),*)
        }

        fn holds(&$self, time: f64) -> Vec<Hold> {
            combined!(Vec::new(), |all, support| all.extend(support.holds(time)); $($supports),*)
        }

        fn potentials(&$self) -> Vec<Elastic<&dyn Potential>> {
            combined!(Vec::new(), |all, support| all.extend(support.potentials()); $($supports),*)
        }

        fn contacts(&$self) -> Vec<Contact<&dyn Obstacle>> {
            combined!(Vec::new(), |all, support| all.extend(support.contacts()); $($supports),*)
        }

        fn next_discontinuity(&$self, t: f64) -> f64 {
            combined!(f64::INFINITY, |next, part| next = earlier(next, part.next_discontinuity(t)); $($supports),*)
        }

        fn check(&$self) -> Result<(), ParameterError> {
            let mut joints = 0;
            $(for support in $supports {
                support.check()?;
                joints += usize::from(support.base().is_some());
            })*
            ParameterError::unless(joints < 2, "number of joints of the base", joints as f64, "at most one")
        }
    };
}

compositions!(Support, all_supports);
