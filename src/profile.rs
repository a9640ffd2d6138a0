//! Strain, force, couple and growth at any place along a rod in equilibrium.

use nalgebra::{UnitQuaternion, Vector3};

use crate::constitutive::{Constitutive, line_strain_under, strain_near};
use crate::growth::GrowthLaw;
use crate::load::{Cut, InternalForce, Load};
use crate::rod::{MaterialPoint, Rod, Tissue, centre_line_tangent, weighted};
use crate::scene::Environment;

/// A place along a rod in equilibrium. Components "along the directors" are those along d1, d2, d3
/// of the place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Place {
    /// Arc length s from the base, m.
    pub arc_length: f64,
    /// Distance from the apex along the rod, ℓ − s, m.
    pub apex_distance: f64,
    /// The tissue there: section, age and initial distance from the apex.
    pub tissue: Tissue,
    /// Position in the fixed frame, m.
    pub position: Vector3<f64>,
    /// The frame, which rotates e1, e2, e3 into the directors.
    pub frame: UnitQuaternion<f64>,
    /// The visible strain u: bending about d1, bending about d2, twist; along the directors, 1/m.
    /// Positive u2 bends towards d1, negative u1 towards d2, positive u3 twists d1 towards d2.
    pub strain: Vector3<f64>,
    /// The strain v of the centre line, ∂p/∂s along the directors: shear v1 and v2, stretch v3; (0,
    /// 0, 1) for an elastic law without them.
    pub line_strain: Vector3<f64>,
    /// The intrinsic strain u*, along the directors, 1/m.
    pub intrinsic: Vector3<f64>,
    /// The couple m that the part beyond exerts on the part below, along the directors, N m.
    pub couple: Vector3<f64>,
    /// The force n that the part beyond exerts on the part below, in the fixed frame, N.
    pub force: Vector3<f64>,
    /// The elastic energy of bending, twist, shear and stretch per unstretched length, J/m.
    pub elastic_energy: f64,
    /// The relative elemental growth rate REGR, 1/s; zero outside the growth zone. In a shoot of
    /// constant length it is the rate of the ongoing differential growth.
    pub regr: f64,
    /// The speed ds/dt at which growth moves the tissue away from the base, along the shoot, m/s.
    pub speed: f64,
}

impl Place {
    /// The curvature √(u1² + u2²), 1/m: the rotation of the section per unstretched length, which
    /// is the curvature of the centre line without shear and stretch.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        self.strain.xy().norm()
    }

    /// The unit tangent of the centre line in the fixed frame: d3 without shear.
    #[must_use]
    pub fn tangent(&self) -> Vector3<f64> {
        self.frame * self.line_strain / self.line_strain.norm()
    }
}

/// A rod in equilibrium under a load, which can be evaluated at any place.
///
/// [`Shoot::profile`](crate::Shoot::profile) returns the profile of a shoot. The profile of a rod:
///
/// ```
/// use morphorod::constitutive::LinearElastic;
/// use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
/// use morphorod::load::Weight;
/// use morphorod::rod::Rod;
/// use morphorod::profile::Profile;
/// use morphorod::{Order, Scene, Still};
///
/// let scene = Still::tilted(1.0);
/// let (tissue, load) = (LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 }, Weight { density: 1000.0 });
/// let mut rod = Rod::uniform(0.06, 0.5e-3, scene.base, 8, Order::Eight)?;
/// let environment = scene.environment(0.0);
/// let _ = NewtonSolver::default().solve(&mut rod, &tissue, &load, &environment)?;
///
/// let profile = Profile::of(&rod, &tissue, &load, &environment);
/// for place in profile.sample(5) {
///     println!("{:.3} m: {:.2} /m, {:.2e} N m", place.arc_length, place.curvature(), place.couple.norm());
/// }
/// // The force is the whole weight at the base; the couple vanishes at the apex.
/// let [base, apex] = [0.0, rod.length()].map(|s| profile.at(s).expect("a number"));
/// assert!((base.force.z + 1000.0 * 9.81 * rod.volume()).abs() < 1e-15);
/// assert!(apex.couple.norm() < 1e-20 * base.couple.norm());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Between the material points, position, frame, force and couple are at least as accurate as at
/// them: of order p + 2 in the length of the element, with [p points](crate::Order::points) in an
/// element, and of order 2 with one point. The intrinsic strain is the polynomial through its
/// values at the points, of order p. Age and visible strain then have this order as well. Merging
/// smooths the intrinsic strain of mature tissue ([`guide::method`](crate::guide::method)). In a
/// rod that is not in equilibrium, the couple is that required by the load and the
/// [reactions](Rod::reactions). At the ends of elements, also at the base, the force is exactly the
/// sum of the load and the reactions beyond. Inside an element with a reaction it is a polynomial.
/// A shoot whose laws were [exchanged](crate::Shoot::with_model) reaches equilibrium when an
/// integrator advances it to the present time.
#[derive(Debug)]
pub struct Profile<'a, C, L, G = ()> {
    rod: &'a Rod,
    material: &'a C,
    load: &'a L,
    growth: &'a G,
    environment: Environment,
    /// Length of the rod, m.
    length: f64,
    /// Quantities at the ends of the elements, from base to apex.
    ends: Vec<Beyond>,
    /// Force of the reactions of a support in each element, N: at its first end, at its material
    /// points, and at its last end; empty without a support.
    reactions: Vec<Vector3<f64>>,
}

/// Integrals over the part of the rod beyond a place, and the position of the place.
#[derive(Debug, Clone, Copy)]
struct Beyond {
    /// Unstretched length, m.
    length: f64,
    /// Volume, m³.
    volume: f64,
    /// Integral of the distributed force, in the fixed frame, N.
    distributed: Vector3<f64>,
    /// Couple at the place, in the fixed frame, N m.
    couple: Vector3<f64>,
    /// Position of the place in the fixed frame, m.
    position: Vector3<f64>,
}

impl<'a, C: Constitutive, L: Load> Profile<'a, C, L> {
    /// The profile of a rod in equilibrium with a material under a load, for the time and gravity
    /// of an environment. The forces and couples of supports in the last equilibrium,
    /// [`Rod::reactions`], are included. There is no growth law: [`regr`](Place::regr) and
    /// [`speed`](Place::speed) are zero.
    #[must_use]
    pub fn of(rod: &'a Rod, material: &'a C, load: &'a L, environment: &Environment) -> Self {
        Profile::growing(rod, (material, load, &()), *environment)
    }
}

impl<'a, C: Constitutive, L: Load, G: GrowthLaw> Profile<'a, C, L, G> {
    /// The profile of a growing rod.
    pub(crate) fn growing(
        rod: &'a Rod,
        (material, load, growth): (&'a C, &'a L, &'a G),
        environment: Environment,
    ) -> Self {
        let (zero, elements) = (Vector3::zeros(), rod.elements());
        let apex = Beyond {
            length: 0.0,
            volume: 0.0,
            distributed: zero,
            couple: zero,
            position: rod.tip(),
        };
        let (length, ends) = (rod.length(), vec![apex; elements + 1]);
        let mut force = InternalForce::of(rod, load, &environment);
        force.react(rod, rod.reactions());
        let reactions = force.reactions_in_elements(rod);
        let mut profile = Self {
            rod,
            material,
            load,
            growth,
            environment,
            length,
            ends,
            reactions,
        };
        for e in (0..=elements).rev() {
            if e < elements {
                profile.ends[e] = profile.beyond(e, 0.0);
            }
            force
                .couples_at(e)
                .for_each(|couple| profile.ends[e].couple += couple);
        }
        profile
    }

    /// The place at an arc length `s` (m). `None` for NaN and for a place beyond the ends; up to
    /// rounding it is at the end. At a jump of the force the load determines the side, up to the
    /// rounding of `s`; a [`PointForce`](crate::load::PointForce) and a reaction act only below
    /// their point.
    #[must_use]
    pub fn at(&self, s: f64) -> Option<Place> {
        let (e, x) = self.rod.locate_on(s)?;
        Some(Place {
            arc_length: s.clamp(0.0, self.length),
            ..self.within(e, x)
        })
    }

    /// `count` places at equal distances from base to apex, including both. A single place is the
    /// base.
    #[must_use]
    pub fn sample(&self, count: usize) -> Vec<Place> {
        let last = count.saturating_sub(1).max(1);
        (0..count)
            .filter_map(|i| self.at(self.length * (i as f64 / last as f64)))
            .collect()
    }

    /// Integrals over the rod beyond the coordinate `x` of element `e`, and the position there. The
    /// part in the element is integrated by its Gauss rule on [x, 1].
    fn beyond(&self, e: usize, x: f64) -> Beyond {
        let reference = self.rod.reference();
        let mut sum = self.lengths_beyond(e, x);
        for (y, w) in reference.points.iter().zip(&reference.weights) {
            let y = x + (1.0 - x) * y;
            let (point, frame) = (self.rod.point_within(e, y), self.rod.frame_within(e, y));
            let (tissue, force) = (
                self.tissue(&point),
                self.force((e, y), &point, &self.lengths_beyond(e, y)),
            );
            let tangent = frame * line_strain_under(self.material, &tissue, &frame, &force);
            let part = w * (1.0 - x) * point.jacobian;
            sum.couple += tangent.cross(&force) * part;
            sum.position -= tangent * part;
        }
        sum
    }

    /// The integrals of length, volume and distributed force beyond the coordinate `x` of element
    /// `e`. Couple and position are those at the last end of the element.
    fn lengths_beyond(&self, e: usize, x: f64) -> Beyond {
        let reference = self.rod.reference();
        let mut sum = self.ends[e + 1];
        for (y, w) in reference.points.iter().zip(&reference.weights) {
            let point = self.rod.point_within(e, x + (1.0 - x) * y);
            let (part, tissue) = (w * (1.0 - x) * point.jacobian, self.tissue(&point));
            sum.length += part;
            sum.volume += part * tissue.section.area();
            sum.distributed += self.load.per_length(&tissue, &self.environment) * part;
        }
        sum
    }

    /// The force at a place, in the fixed frame, N.
    fn force(&self, (e, x): (usize, f64), point: &MaterialPoint, beyond: &Beyond) -> Vector3<f64> {
        let mut cut = Cut::new(self.length - beyond.length, beyond.length, 0.0);
        cut.volume_beyond = beyond.volume;
        cut.initial_apex_distance = point.initial_apex_distance;
        let load = beyond.distributed + self.load.force(&cut, &self.environment);
        if self.reactions.is_empty() {
            return load;
        }
        let p = self.rod.order().points();
        let within = &self.reactions[e * (p + 2)..(e + 1) * (p + 2)];
        // At the material points the force of a reaction inside the element is distributed over
        // them.
        load + if x <= 0.0 {
            within[0]
        } else if x >= 1.0 {
            within[p + 1]
        } else {
            weighted(&within[1..=p], &self.rod.reference().at_points(x))
        }
    }

    fn tissue(&self, point: &MaterialPoint) -> Tissue {
        Tissue::of(point, self.environment.time)
    }

    /// The place at coordinate `x` of element `e`.
    fn within(&self, e: usize, x: f64) -> Place {
        let (rod, time) = (self.rod, self.environment.time);
        let (beyond, point, frame) = (
            self.beyond(e, x),
            rod.point_within(e, x),
            rod.frame_within(e, x),
        );
        let (tissue, intrinsic) = (self.tissue(&point), point.intrinsic);
        let couple = frame.inverse_transform_vector(&beyond.couple);
        let force = self.force((e, x), &point, &beyond);
        // The strain follows from the couple. For a law that is not linear the differentiated
        // strain is the guess.
        let near = || rod.strain_within(e, x) - intrinsic;
        let (length, sigma) = (self.length, beyond.length);
        let zone = self.growth.zone_length();
        let (in_zone, elongates) = (e >= rod.first_growing, self.growth.elongates());
        let speed = |sigma: f64| {
            if elongates {
                self.growth.apical_speed(sigma.min(zone), time)
            } else {
                0.0
            }
        };
        let elastic = strain_near(self.material, &tissue, near, &couple);
        let line = self
            .material
            .line_response(&tissue, &frame.inverse_transform_vector(&force));
        let energy =
            self.material.respond(&tissue, &elastic).energy + line.map_or(0.0, |line| line.energy);
        Place {
            arc_length: length - sigma,
            apex_distance: sigma,
            tissue,
            position: beyond.position,
            frame,
            strain: intrinsic + elastic,
            line_strain: line.map_or(centre_line_tangent(), |line| line.strain),
            intrinsic,
            couple,
            force,
            elastic_energy: energy,
            regr: if in_zone {
                self.growth.regr(sigma, time)
            } else {
                0.0
            },
            speed: if in_zone {
                speed(length) - speed(sigma)
            } else {
                0.0
            },
        }
    }
}
