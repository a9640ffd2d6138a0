//! Several obstacles as one.

use nalgebra::Vector3;

use super::{Distance, Obstacle};
use crate::error::ParameterError;

/// Several obstacles that are one rigid body: a corner of half spaces, or a body with dents made of
/// convex ones. Members may overlap.
///
/// Each surface of each member is a surface of the union, so that a shoot may touch several at the
/// same place. A [`Reaction`](super::Reaction) states the index of the surface.
///
/// ```
/// use morphorod::nalgebra::Vector3;
/// use morphorod::support::{Contact, HalfSpace, Union};
///
/// // A groove along e1, 1 cm below the base.
/// let side = |y: f64| HalfSpace { through: Vector3::z() * -0.01, normal: Vector3::new(0.0, y, 1.0) };
/// let groove = Contact { obstacle: Union(vec![side(-1.0), side(1.0)]), radius: 5e-4, friction: 0.3 };
/// # let _ = groove;
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Union<O>(
    /// The members; `Box<dyn Obstacle>` for members of several types. If they move, they move
    /// together. The union is rigid: the compliance of each member is zero.
    pub Vec<O>,
);

impl<O: Obstacle> Union<O> {
    /// The nearest member, and the distance from it.
    fn nearest(&self, place: &Vector3<f64>, time: f64) -> Option<(&O, Distance)> {
        let each = self
            .0
            .iter()
            .map(|member| (member, member.distance(place, time)));
        each.reduce(|a, b| if b.1.value < a.1.value { b } else { a })
    }
}

impl<O: Obstacle> Obstacle for Union<O> {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.nearest(place, time)
            .map_or_else(Distance::nowhere, |(_, distance)| distance)
    }

    fn surfaces(&self) -> usize {
        self.0.iter().map(Obstacle::surfaces).sum()
    }

    fn distance_to(&self, surface: usize, place: &Vector3<f64>, time: f64) -> Distance {
        let mut all = self
            .0
            .iter()
            .flat_map(|member| (0..member.surfaces()).map(move |own| (member, own)));
        let found = all
            .nth(surface)
            .map(|(member, own)| member.distance_to(own, place, time));
        found.unwrap_or_else(|| self.distance(place, time))
    }

    fn has_edges(&self) -> bool {
        self.0.iter().any(Obstacle::has_edges)
    }

    fn velocity(&self, place: &Vector3<f64>, time: f64) -> Vector3<f64> {
        self.nearest(place, time)
            .map_or_else(Vector3::zeros, |(member, _)| member.velocity(place, time))
    }

    fn check(&self) -> Result<(), ParameterError> {
        let (name, number) = ("number of members of a union", self.0.len());
        ParameterError::unless(number > 0, name, number as f64, "at least 1")?;
        for member in &self.0 {
            member.check()?;
            let (name, size) = (
                "compliance of a member of a union",
                member.compliance().norm(),
            );
            ParameterError::unless(
                size == 0.0,
                name,
                size,
                "zero (m/N), since a union moves as a whole",
            )?;
        }
        Ok(())
    }
}
