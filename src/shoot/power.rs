//! Power of growth: the rate at which it changes the energies of a shoot.

use nalgebra::Vector3;

use super::Shoot;
use crate::load::InternalForce;
use crate::model::{Constitutive, GrowthLaw, Model};
use crate::rod::{Tissue, weighted};

/// Relative change of lengths and ages in a central difference: near the cube root of the machine
/// precision, where the errors of rounding and of truncation are equal.
const CHANGE: f64 = 1e-5;
/// Smallest age of a difference, over the time in which the fastest tissue elongates by the factor
/// e. In younger tissue rounding of the age would exceed its change.
const YOUNGEST: f64 = 1e-5;

impl<M: Model> Shoot<M> {
    /// The power of growth and of lignification, W: the rate at which they change the sum of the
    /// elastic energy and the energy of the load ([`Energies`](super::Energies)), while the frames
    /// and the [reactions](Self::reactions) are constant.
    ///
    /// In equilibrium the motion of the frames changes this sum by the work of the reactions on
    /// their places. Loads and a base that change in time do further work
    /// ([recipe](crate::guide::recipes#the-balance-of-energy)).
    ///
    /// The rate of elongation r is REGR plus a constant in each element. With the strain u, the
    /// force n, the couple m, the tangent t of the centre line and the elastic energy w per length,
    /// the power is
    ///
    /// ```text
    /// ∫ r (w − m · u − n · t) − m · ∂u*/∂t + ∂w/∂t − ∂n/∂t · t ds − ∂n/∂t · p at the base.
    /// ```
    ///
    /// ∂w/∂t is due to the age of the tissue at constant strain, ∂n/∂t to tissue that grows beyond
    /// and has a load. Both are central differences with a relative error of about 1e-10. Younger
    /// tissue than 1e-5 of the time in which the fastest tissue elongates by the factor e has the
    /// rate ∂w/∂t of this age. In a shoot without growth this rate is inaccurate for tissue that
    /// has just become mature, and omitted at the age zero. The power is that of the discretised
    /// shoot, which must be in equilibrium, as after any call of an integrator.
    ///
    /// ```
    /// # use morphorod::Shoot;
    /// # use morphorod::constitutive::LinearElastic;
    /// # use morphorod::growth::UniformGrowth;
    /// # use morphorod::integrator::{Integrator, MethodOfSteps};
    /// # use morphorod::load::Weight;
    /// # let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    /// #     .length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.04, time: 72e3 })
    /// #     .load(Weight { density: 1000.0 }).build()?;
    /// MethodOfSteps::new(600.0).advance(&mut shoot, 600.0)?;
    /// // An upright shoot has the energy G ℓ/2 and a weight G in proportion to its length ℓ. The energy increases at G
    /// // times the speed of the tip.
    /// let (weight, speed) = (1000.0 * 9.81 * shoot.rod().volume(), 0.04 / 72e3);
    /// assert!((shoot.growth_power() / (weight * speed) - 1.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// The balance of energy of a shoot that grows over a pole in a changing wind, with Simpson's
    /// rule over three shapes:
    ///
    /// ```
    /// use morphorod::constitutive::LinearElastic;
    /// use morphorod::growth::UniformGrowth;
    /// use morphorod::integrator::{Integrator, MethodOfSteps};
    /// use morphorod::load::{ApicalForce, Weight};
    /// use morphorod::nalgebra::Vector3;
    /// use morphorod::support::{Contact, Cylinder};
    /// use morphorod::{Model, Shoot, Still};
    ///
    /// const LENGTH: f64 = 0.05;
    /// const WEIGHT: Weight = Weight { density: 1000.0 };
    ///
    /// /// The force of the wind on the apex, N.
    /// fn wind(t: f64) -> Vector3<f64> {
    ///     Vector3::y() * (2e-6 * (t / 3600.0).sin())
    /// }
    ///
    /// /// The works of growth, wind and friction, J, between the first and the last of three equidistant shapes.
    /// fn works(shapes: &[Shoot<impl Model>]) -> [f64; 3] {
    ///     let interval = shapes[1].time() - shapes[0].time();
    ///     let [mut growth, mut wind_work, mut friction] = [0.0; 3];
    ///     // Weights of the power at each time, and factors of F · x for F at this time and x at all three.
    ///     let rule = [(1.0, [-3.0, 4.0, -1.0]), (4.0, [-4.0, 0.0, 4.0]), (1.0, [1.0, -4.0, 3.0])];
    ///     for (shoot, (weight, factors)) in shapes.iter().zip(rule) {
    ///         growth += shoot.growth_power() * weight * interval / 3.0;
    ///         // The work of a force on the tissue at a distance from the apex at t = 0.
    ///         let work = |force: Vector3<f64>, initial_apex_distance: f64| -> f64 {
    ///             let each = shapes.iter().zip(factors).map(|(shoot, factor)| {
    ///                 let place = shoot.rod().arc_length_of(LENGTH - initial_apex_distance).expect("a number");
    ///                 shoot.profile().at(place).expect("a number").position.dot(&force) * factor / 6.0
    ///             });
    ///             each.sum()
    ///         };
    ///         wind_work += work(wind(shoot.time()), 0.0);
    ///         friction += shoot.reactions().iter().map(|at| work(at.force, at.initial_apex_distance)).sum::<f64>();
    ///     }
    ///     [growth, wind_work, friction]
    /// }
    ///
    /// fn main() -> Result<(), Box<dyn std::error::Error>> {
    ///     let pole = Cylinder { through: Vector3::new(0.035, 0.0, -0.0065), along: Vector3::y(), radius: 5e-3 };
    ///     let mut shoot = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
    ///         .length(LENGTH)
    ///         .radius(5e-4)
    ///         .growth(UniformGrowth { zone_length: 0.04, time: 72e3 })
    ///         .load((WEIGHT, ApicalForce(wind)))
    ///         .scene(Still::tilted(std::f64::consts::FRAC_PI_2))
    ///         .support(Contact { obstacle: pole, radius: 5e-4, friction: 0.3 })
    ///         .merge_tolerance(0.0)
    ///         .build()?;
    ///     let step = 300.0;
    ///     let mut steps = MethodOfSteps::new(step);
    ///     let energy = |shoot: &Shoot<_>| shoot.energies().elastic + shoot.load_energy(&WEIGHT);
    ///     steps.advance(&mut shoot, 3600.0)?;
    ///     let (before, mut sums) = (energy(&shoot), [0.0; 3]);
    ///     for _ in 0..6 {
    ///         let mut shapes = vec![shoot.clone()];
    ///         for _ in 0..2 {
    ///             let next = shoot.time() + step;
    ///             steps.advance(&mut shoot, next)?;
    ///             shapes.push(shoot.clone());
    ///         }
    ///         sums.iter_mut().zip(works(&shapes)).for_each(|(sum, work)| *sum += work);
    ///     }
    ///     let [growth, wind_work, friction] = sums;
    ///     println!("work of growth {growth:.3e} J, of wind {wind_work:.1e} J, of friction {friction:.3e} J");
    ///     let error = energy(&shoot) - before - sums.iter().sum::<f64>();
    ///     assert!(friction < 0.0 && error.abs() < 1e-6 * growth.abs(), "{sums:?} {error}");
    ///     Ok(())
    /// }
    /// ```
    #[must_use]
    pub fn growth_power(&self) -> f64 {
        let (rod, law, environment) = (self.rod(), self.model.constitutive(), self.environment());
        let (time, p, rates) = (
            environment.time,
            rod.order().points(),
            self.elongation_rates(),
        );
        let mut force = InternalForce::of(rod, self.model.load(), &environment);
        let largest = rates.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let youngest = if largest > 0.0 {
            YOUNGEST / largest
        } else {
            0.0
        };
        let (load_rates, load_rate_at_base) = self.load_rates(&rates, largest);
        // In contact the shape has more nodes than the rod of the laws.
        let (parent, intrinsic_rates) = (&self.state.rod, self.intrinsic_rates());
        let mut walk = parent.walk();
        let mut intrinsic_rate = |s: f64| {
            let (e, x) = walk.to(s)?;
            let first = (e * p).checked_sub(parent.zone().start)?;
            Some(weighted(
                intrinsic_rates.get(first..first + p)?,
                &parent.reference().at_points(x),
            ))
        };
        force.react(rod, rod.reactions());
        let each = rod.points().iter().enumerate().map(|(i, point)| {
            let (e, g, tissue) = (i / p, i % p, Tissue::of(point, time));
            let (strain, frame) = (rod.strain_at_point(e, g), rod.frame_at_point(e, g));
            let (elastic, n) = (
                strain - point.intrinsic,
                frame.inverse_transform_vector(&force.at_points()[i]),
            );
            // The energy w − n · t, which the strain of the centre line minimises, so that its
            // change has no effect.
            let energy = |tissue: &Tissue| {
                let line = law.line_response(tissue, &n);
                law.respond(tissue, &elastic).energy
                    + line.map_or(-n.z, |line| line.energy - n.dot(&line.strain))
            };
            let couple = law.respond(&tissue, &elastic).couple;
            let mut power = rates[i] * (energy(&tissue) - couple.dot(&strain));
            power -=
                intrinsic_rate(force.cuts()[i].arc_length).map_or(0.0, |rate| couple.dot(&rate));
            let age = if tissue.age > 0.0 {
                tissue.age.max(youngest)
            } else {
                0.0
            };
            // The change underflows in a shoot without growth if the age is a few units of rounding
            // at t = 0.
            let change = 2.0 * CHANGE * age;
            if change > 0.0 {
                let [younger, older] = [-CHANGE, CHANGE].map(|part| {
                    energy(&Tissue {
                        age: age * (1.0 + part),
                        ..tissue
                    })
                });
                power += (older - younger) / change;
            }
            power
                - load_rates.get(i).map_or(0.0, |rate| {
                    rate.dot(&(frame * rod.line_strain_at_point(e, g)))
                })
        });
        rod.integral(each) - load_rate_at_base.dot(&rod.base_position())
    }

    /// REGR at the points of the shape plus a constant in each element, 1/s. With it the length of
    /// the element has the rate at which its ends separate. Without contact a time step of an
    /// integrator scales elements in the same way.
    fn elongation_rates(&self) -> Vec<f64> {
        let (rod, growth, time) = (self.rod(), self.model.growth(), self.environment().time);
        let mut rates = vec![0.0; rod.points().len()];
        if !growth.elongates() {
            return rates;
        }
        let (p, weights, zone) = (
            rod.order().points(),
            &rod.reference().weights,
            growth.zone_length(),
        );
        let speed = |node: usize| growth.apical_speed(rod.node_distance[node].min(zone), time);
        for e in rod.first_growing..rod.elements() {
            let points = rod.element_points(e);
            let rates = &mut rates[e * p..(e + 1) * p];
            rates
                .iter_mut()
                .zip(points)
                .for_each(|(rate, point)| *rate = growth.regr(point.apex_distance, time));
            let each = rates.iter().zip(points).zip(weights);
            let sum: f64 = each
                .map(|((rate, point), weight)| weight * point.jacobian * rate)
                .sum();
            let correction = (speed(e) - speed(e + 1) - sum) / rod.length_of(e);
            rates.iter_mut().for_each(|rate| *rate += correction);
        }
        rates
    }

    /// The rates of the force of the load by elongation, at the points of the shape and at the
    /// base, N/s. `largest` is the largest modulus of the rates of elongation. There are no points
    /// without elongation.
    fn load_rates(&self, rates: &[f64], largest: f64) -> (Vec<Vector3<f64>>, Vector3<f64>) {
        if largest == 0.0 {
            return (Vec::new(), Vector3::zeros());
        }
        let [before, after] = [-CHANGE, CHANGE].map(|part| {
            let mut rod = self.rod().clone();
            for (point, rate) in rod.points.iter_mut().zip(rates) {
                point.jacobian *= 1.0 + part * rate / largest;
            }
            InternalForce::of(&rod, self.model.load(), &self.environment())
        });
        let rate = |before: &Vector3<f64>, after: &Vector3<f64>| {
            (after - before) * (largest / (2.0 * CHANGE))
        };
        let each = before.at_points().iter().zip(after.at_points());
        (
            each.map(|(before, after)| rate(before, after)).collect(),
            rate(&before.at_base(), &after.at_base()),
        )
    }
}
