//! Springs and elastic joints with a potential of the user.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::Support;
use crate::error::ParameterError;
use crate::pointers::forward_pointers;

/// Energy U(x) of a spring or an elastic joint, with its derivatives by the vector x: a position
/// (m) or a rotation vector (rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Energy U, J.
    pub value: f64,
    /// Gradient ∂U/∂x, N or N m. The force on the shoot is its negative.
    pub gradient: Vector3<f64>,
    /// Second derivative ∂²U/∂x², symmetric, N/m or N m. It may be indefinite, and discontinuous
    /// where a rope becomes slack.
    pub stiffness: Matrix3<f64>,
}

/// The potential of a spring or an elastic joint: its energy as a function of a vector and of time.
///
/// The gradient must be that of the energy, and the stiffness that of the gradient. The solver
/// compares them by differences at the first and at the last position of each search.
///
/// ```
/// use morphorod::nalgebra::{Matrix3, Vector3};
/// use morphorod::support::{Argument, Elastic, Energy, Potential};
///
/// /// A rope to an anchor (m) that becomes taut at its length (m), with a stiffness in N/m.
/// struct Rope {
///     anchor: Vector3<f64>,
///     length: f64,
///     stiffness: f64,
/// }
///
/// impl Potential for Rope {
///     fn energy(&self, place: &Vector3<f64>, _time: f64) -> Energy {
///         let from = place - self.anchor;
///         let (distance, stretch) = (from.norm(), from.norm() - self.length);
///         if stretch <= 0.0 {
///             return Energy { value: 0.0, gradient: Vector3::zeros(), stiffness: Matrix3::zeros() };
///         }
///         let along = from / distance;
///         let across = Matrix3::identity() - along * along.transpose();
///         Energy {
///             value: 0.5 * self.stiffness * stretch * stretch,
///             gradient: along * (self.stiffness * stretch),
///             stiffness: (along * along.transpose() + across * (stretch / distance)) * self.stiffness,
///         }
///     }
/// }
///
/// let rope = Rope { anchor: Vector3::z() * 0.1, length: 0.06, stiffness: 0.5 };
/// let tied = Elastic { initial_apex_distance: 0.0, argument: Argument::Position, potential: rope };
/// # let _ = tied;
/// ```
pub trait Potential {
    /// Energy with its derivatives at x (a position in the fixed frame, m, or a rotation
    /// vector, rad) and at a time (s).
    fn energy(&self, x: &Vector3<f64>, time: f64) -> Energy;

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

forward_pointers!(Potential {
    fn energy(x: &Vector3<f64>, time: f64) -> Energy;
    fn check() -> Result<(), ParameterError>;
});

/// The vector on which a potential depends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Argument {
    /// The position of the place in the fixed frame, m.
    #[default]
    Position,
    /// The rotation vector θ, of less than π, from a given frame to that of the place, along the
    /// directors, rad. The couple on the shoot does the work −∂U/∂θ · dθ.
    Rotation {
        /// The frame at θ = 0. It rotates e1, e2, e3 into d1, d2, d3.
        frame: UnitQuaternion<f64>,
    },
}

/// A spring at a material place, or an elastic joint, with a potential.
///
/// A place is given as that of a [`Hold`](super::Hold), and may have a hold and several potentials.
/// An elastic joint at the base requires a [`Joint`](super::Joint) there.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Elastic<P> {
    /// Distance of the place from the apex at t = 0, m; zero for the apex.
    pub initial_apex_distance: f64,
    /// Whether the potential depends on the position or on the rotation of the place.
    pub argument: Argument,
    /// The potential.
    pub potential: P,
}

impl<P: Potential> Support for Elastic<P> {
    fn potentials(&self) -> Vec<Elastic<&dyn Potential>> {
        let Self {
            initial_apex_distance,
            argument,
            potential,
        } = self;
        vec![Elastic {
            initial_apex_distance: *initial_apex_distance,
            argument: *argument,
            potential,
        }]
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative(
            "distance of an elastic place from the apex",
            self.initial_apex_distance,
            "m",
        )?;
        if let Argument::Rotation { frame } = &self.argument {
            super::hold::check_frame(frame)?;
        }
        self.potential.check()
    }
}
