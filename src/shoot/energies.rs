//! Energies of a shoot in its present shape.

use nalgebra::{UnitQuaternion, Vector3};

use super::Shoot;
use crate::load::{InternalForce, Load};
use crate::model::{Constitutive, Model};
use crate::rod::Tissue;
use crate::so3;
use crate::support::{Argument, Orientation, Position, Support};

/// Energies of a shoot in its present shape, see [`Shoot::energies`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Energies {
    /// Elastic energy of bending, twist, shear and stretch, J: zero without elastic strain.
    pub elastic: f64,
    /// Potential energy of the load, J: minus the work of its present forces on the tissue from the
    /// origin of the fixed frame to its place. That of a [`Weight`](crate::load::Weight) is the
    /// gravitational energy.
    pub load: f64,
    /// Energy of the supports, J: of springs, elastic joints, potentials, and obstacles that yield.
    pub support: f64,
}

impl Energies {
    /// Sum of the energies, J. An equilibrium is a stationary point of it, without friction.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.elastic + self.load + self.support
    }
}

impl<M: Model> Shoot<M> {
    /// The energies of the shoot. It must be in equilibrium, as after any call of an integrator.
    /// They are those of the discretised shoot, whose equilibrium has an error of the order 2 p
    /// with [p points](crate::Order::points) in an element.
    ///
    /// ```
    /// # use morphorod::{Shoot, Still};
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # use morphorod::load::Weight;
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e9, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).load(Weight { density: 1000.0 })
    /// #     .scene(Still::tilted(std::f64::consts::FRAC_PI_2)).build()?;
    /// MethodOfSteps::new(600.0).advance(&mut shoot, 600.0)?;
    /// let energies = shoot.energies();
    /// // A linear cantilever stores half of the work of its weight.
    /// assert!((energies.elastic + 0.5 * energies.load).abs() < 1e-4 * energies.elastic);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn energies(&self) -> Energies {
        Energies {
            elastic: self.elastic_energy(),
            load: self.load_energy(self.model.load()),
            support: self.support_energy(),
        }
    }

    /// The potential energy of a load on the shoot in its present shape, J, as [`Energies::load`].
    /// For one of the loads of a tuple it is the part of this load.
    #[must_use]
    pub fn load_energy(&self, load: &impl Load) -> f64 {
        let rod = self.rod();
        let force = InternalForce::of(rod, load, &self.environment());
        let along = |(e, g): (usize, usize), force: &Vector3<f64>| {
            force.dot(&(rod.frame_at_point(e, g) * rod.line_strain_at_point(e, g)))
        };
        let p = rod.order().points();
        let each = force
            .at_points()
            .iter()
            .enumerate()
            .map(|(i, force)| along((i / p, i % p), force));
        // The difference from zero is not −0 without a load.
        0.0 - rod.integral(each) - force.at_base().dot(&rod.base_position())
    }

    fn elastic_energy(&self) -> f64 {
        let (rod, law, environment) = (self.rod(), self.model.constitutive(), self.environment());
        let mut force = InternalForce::of(rod, self.model.load(), &environment);
        force.react(rod, rod.reactions());
        let p = rod.order().points();
        let each =
            rod.points()
                .iter()
                .zip(force.at_points())
                .enumerate()
                .map(|(i, (point, force))| {
                    let (e, g, tissue) = (i / p, i % p, Tissue::of(point, environment.time));
                    let bending = law
                        .respond(&tissue, &(rod.strain_at_point(e, g) - point.intrinsic))
                        .energy;
                    let line = law.line_response(
                        &tissue,
                        &rod.frame_at_point(e, g).inverse_transform_vector(force),
                    );
                    bending + line.map_or(0.0, |line| line.energy)
                });
        rod.integral(each)
    }

    fn support_energy(&self) -> f64 {
        let (rod, support, time) = (self.rod(), self.model.support(), self.environment().time);
        if support.is_absent() {
            return 0.0;
        }
        let line = rod.centre_line();
        // The distances are checked when the shoot is built.
        let place = |distance: f64| {
            let (e, x) = rod.locate_initial(distance).unwrap_or((0, 0.0));
            (line[e].1 + rod.chord(e, x), rod.frame_within(e, x))
        };
        let angle = |from: &UnitQuaternion<f64>, frame: &UnitQuaternion<f64>| {
            so3::log(&(from.inverse() * frame))
        };
        let mut sum = 0.0;
        for hold in support.holds(time) {
            let (position, frame) = place(hold.initial_apex_distance);
            if let Position::Spring { anchor, stiffness } = &hold.position {
                let from = position - anchor;
                sum += 0.5 * from.dot(&(stiffness * from));
            }
            if let Orientation::Spring {
                frame: from,
                stiffness,
            } = &hold.orientation
            {
                sum += 0.5 * stiffness * angle(from, &frame).norm_squared();
            }
        }
        for elastic in support.potentials() {
            let (position, frame) = place(elastic.initial_apex_distance);
            let x = match &elastic.argument {
                Argument::Position => position,
                Argument::Rotation { frame: from } => angle(from, &frame),
            };
            sum += elastic.potential.energy(&x, time).value;
        }
        for (index, contact) in support.contacts().iter().enumerate() {
            let on = rod
                .reactions()
                .iter()
                .filter(|reaction| reaction.obstacle == Some(index));
            let force: Vector3<f64> = on.map(|reaction| reaction.force).sum();
            sum += 0.5 * force.dot(&(contact.obstacle.compliance() * force));
        }
        sum
    }
}
