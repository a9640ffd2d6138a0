//! Force at a point along the shoot.

use nalgebra::Vector3;

use super::{Cut, Load};
use crate::error::ParameterError;
use crate::scene::Environment;

/// Constant force at a material point, in the fixed frame, such as the weight of a fruit or the
/// tension of a thread.
///
/// The point is given by its distance from the apex at t = 0 and moves with the tissue. For the
/// point at arc length s of a shoot this distance is
/// `shoot.profile().at(s)?.tissue.initial_apex_distance`. [`Shoot::builder`] and
/// [`Shoot::with_model`] put a node at the point, since a discontinuity of the force inside an
/// element reduces the accuracy. A rod that is built otherwise needs such a node, too.
///
/// [`Shoot::builder`]: crate::Shoot::builder
/// [`Shoot::with_model`]: crate::Shoot::with_model
///
/// ```
/// use morphorod::Shoot;
/// use morphorod::constitutive::LinearElastic;
/// use morphorod::load::{PointForce, Weight};
/// use morphorod::nalgebra::Vector3;
///
/// // A fruit of half a gram, 2 cm below the tip of a shoot of 10 cm.
/// let fruit = PointForce { initial_apex_distance: 0.02, force: Vector3::new(0.0, 0.0, -0.5e-3 * 9.81) };
/// let shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e9, poissons_ratio: 0.5 })
///     .length(0.1)
///     .radius(1e-3)
///     .load((Weight { density: 1000.0 }, fruit))
///     .build()?;
/// assert!(shoot.rod().centre_line().iter().any(|(s, _)| (s - 0.08).abs() < 1e-15));
/// # Ok::<(), morphorod::ParameterError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PointForce {
    /// Distance of the point from the apex at t = 0, m; from 0, the apex, to the length at t = 0,
    /// the base.
    pub initial_apex_distance: f64,
    /// Force, N.
    pub force: Vector3<f64>,
}

impl Load for PointForce {
    #[inline]
    fn force(&self, cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        if cut.initial_apex_distance >= self.initial_apex_distance {
            self.force
        } else {
            Vector3::zeros()
        }
    }

    fn jumps(&self) -> Vec<f64> {
        vec![self.initial_apex_distance]
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::not_negative(
            "distance of a point force from the apex",
            self.initial_apex_distance,
            "m",
        )?;
        ParameterError::finite("point force", self.force.sum(), "N")
    }
}
