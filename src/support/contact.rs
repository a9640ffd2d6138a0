//! Contact of a shoot with an obstacle.

use super::{Obstacle, Support};
use crate::error::ParameterError;

/// Contact of a shoot with an obstacle. The centre line keeps a distance of at least the shoot's
/// radius from the surface of the obstacle.
///
/// The reaction is a force: a normal one that pushes, and with friction a tangential one of at most
/// μ times the normal one (Coulomb). Both act on the centre line.
///
/// A shoot starts straight along the d3 of its base. If an obstacle crosses this line, the search
/// for the first equilibrium may fail. There may also be several equilibria, and the elements
/// determine which of them is found. Then advance the shoot without the obstacle and add it with
/// `shoot.with_model(shoot.model().with_support(contact))`, or move the obstacle in with a distance
/// that depends on time.
///
/// A shoot that snaps beside an obstacle may reach another stable shape than without the obstacle,
/// even if it never touches it: the search with obstacles follows another path.
///
/// A growing shoot sags until it leans on a horizontal pole:
///
/// ```
/// use morphorod::constitutive::LinearElastic;
/// use morphorod::growth::UniformGrowth;
/// use morphorod::integrator::{Integrator, MethodOfSteps};
/// use morphorod::load::Weight;
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{Contact, Cylinder};
/// use morphorod::{Shoot, Still};
///
/// let radius = 0.5e-3;
/// let pole = Cylinder { through: Vector3::new(0.025, 0.0, 0.032), along: Vector3::y(), radius: 2e-3 };
/// let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
///     .length(0.04)
///     .radius(radius)
///     .growth(UniformGrowth { zone_length: 0.04, time: 72e3 })
///     .load(Weight { density: 1000.0 })
///     .scene(Still::tilted(0.5))
///     .support(Contact { obstacle: pole, radius, friction: 0.0 })
///     .build()?;
/// let mut integrator = MethodOfSteps::new(600.0);
/// integrator.advance(&mut shoot, 0.0)?;
/// assert!(shoot.reactions().is_empty(), "the short shoot does not reach the pole");
/// integrator.advance(&mut shoot, 10.0 * 3600.0)?;
/// let contact = shoot.reactions()[0];
/// assert!(contact.normal > 0.0);
/// // The centre line is at a distance of both radii from the axis of the pole.
/// let (place, _) = shoot.rod().at(contact.arc_length).expect("a place of the shoot");
/// assert!(((place - pole.through).norm() - 2.5e-3).abs() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact<O> {
    /// The obstacle.
    pub obstacle: O,
    /// Distance of the centre line from the surface in contact, m: the radius of the shoot, or
    /// zero. It must be positive if the obstacle has edges.
    pub radius: f64,
    /// Coefficient of friction μ; zero for none.
    pub friction: f64,
}

impl<O: Obstacle> Support for Contact<O> {
    fn contacts(&self) -> Vec<Contact<&dyn Obstacle>> {
        vec![Contact {
            obstacle: &self.obstacle,
            radius: self.radius,
            friction: self.friction,
        }]
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.obstacle.check()?;
        let surfaces = self.obstacle.surfaces();
        ParameterError::unless(
            surfaces > 0,
            "number of surfaces of an obstacle",
            surfaces as f64,
            "at least 1",
        )?;
        ParameterError::not_negative("radius of a shoot in contact", self.radius, "m")?;
        let sharp = self.radius == 0.0 && self.obstacle.has_edges();
        let (name, requirement) = (
            "radius of a shoot in contact with an obstacle with edges",
            "positive (m)",
        );
        ParameterError::unless(!sharp, name, self.radius, requirement)?;
        ParameterError::not_negative("coefficient of friction", self.friction, "")?;
        let compliance = self.obstacle.compliance();
        ParameterError::finite("compliance of an obstacle", compliance.sum(), "m/N")?;
        let (name, skew) = (
            "asymmetry of the compliance of an obstacle",
            (compliance - compliance.transpose()).norm(),
        );
        ParameterError::unless(skew <= 1e-12 * compliance.norm(), name, skew, "zero (m/N)")?;
        let (name, least) = (
            "least compliance of an obstacle",
            compliance.symmetric_eigenvalues().min(),
        );
        ParameterError::unless(
            least >= -1e-12 * compliance.norm(),
            name,
            least,
            "zero or positive (m/N)",
        )
    }
}
