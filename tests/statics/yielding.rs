//! Contact with obstacles that yield: linear springs, rigid obstacles at the displaced place, and
//! Coulomb's law.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::held::Held;
use crate::fixtures::rods::{DENSITY, bending_stiffness};
use crate::fixtures::shoots::WEIGHT;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::load::{Distributed, Weight};
use morphorod::support::{Contact, Cylinder, Distance, HalfSpace, Hold, Obstacle, Slip};
use nalgebra::{Matrix3, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// An obstacle on springs of a compliance (m/N).
#[derive(Clone, Copy)]
struct Sprung<O>(O, Matrix3<f64>);

impl<O: Obstacle> Obstacle for Sprung<O> {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.0.distance(place, time)
    }

    fn compliance(&self) -> Matrix3<f64> {
        self.1
    }
}

/// Compliance ℓ³/(E I), m/N.
fn unit() -> f64 {
    LENGTH.powi(3) / bending_stiffness()
}

/// A compliance without symmetry axes among those of the fixed frame, relative to [`unit`].
fn skewed(size: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.2, 0.1, 0.2, 0.8, -0.2, 0.1, -0.2, 1.3) * (size * unit())
}

#[test]
fn plane_on_springs_acts_on_the_apex_as_a_spring() {
    // The apex of a sagging rod presses on the plane, whose compliance is below and above that of
    // the rod, 1/3.
    let plane = HalfSpace {
        through: -Vector3::z() * (0.1 * LENGTH),
        normal: Vector3::z(),
    };
    for compliance in [0.01, 0.3, 3.0, 100.0] {
        let obstacle = Sprung(plane, Matrix3::identity() * (compliance * unit()));
        let (mut sprung, mut spring) = (
            Held::straight(LENGTH, FRAC_PI_2, 8, WEIGHT),
            Held::straight(LENGTH, FRAC_PI_2, 8, WEIGHT),
        );
        sprung.hold(&Contact {
            obstacle,
            radius: 0.0,
            friction: 0.0,
        });
        let along = Vector3::z() * Vector3::z().transpose() / (compliance * unit());
        spring.hold(&Hold::apex().spring(plane.through, along));
        println!("{compliance}: {}", sprung.found);
        // Both searches end with frames to 1e-14 rad.
        assert_relative_eq!(
            sprung.reaction().0.z,
            spring.reaction().0.z,
            epsilon = 0.0,
            max_relative = 1e-10
        );
        assert_abs_diff_eq!(
            (sprung.rod.tip() - spring.rod.tip()).norm(),
            0.0,
            epsilon = 1e-11 * LENGTH
        );
        assert_relative_eq!(
            sprung.found.energy,
            spring.found.energy,
            epsilon = 0.0,
            max_relative = 1e-10
        );
        assert_eq!(sprung.signs(), (0, 0));
    }
}

#[test]
fn displaced_pole_acts_as_a_rigid_pole_at_its_place() {
    for compliance in [0.03, 0.3, 3.0] {
        let pole = Cylinder {
            through: Vector3::new(0.03, 0.0, -4e-3),
            along: Vector3::new(0.2, 1.0, 0.0),
            radius: 1e-3,
        };
        let weight = Weight { density: DENSITY };
        let mut sprung = Held::straight(LENGTH, FRAC_PI_2, 10, weight);
        sprung.hold(&Contact {
            obstacle: Sprung(pole, skewed(compliance)),
            radius: 0.0,
            friction: 0.0,
        });
        let force = sprung.reaction().0;
        let displaced = Cylinder {
            through: pole.through - skewed(compliance) * force,
            ..pole
        };
        let mut rigid = Held {
            rod: sprung.rod.clone(),
            ..Held::straight(LENGTH, FRAC_PI_2, 10, weight)
        };
        rigid.hold(&Contact {
            obstacle: displaced,
            radius: 0.0,
            friction: 0.0,
        });
        let moved = (skewed(compliance) * force).norm();
        println!("{compliance}: {} displaced by {moved:e} m", sprung.found);
        // The places of contact have errors of 1e-11 of the length.
        assert_abs_diff_eq!(
            (rigid.reaction().0 - force).norm(),
            0.0,
            epsilon = 1e-8 * force.norm()
        );
        assert_abs_diff_eq!(
            (rigid.rod.tip() - sprung.rod.tip()).norm(),
            0.0,
            epsilon = 1e-8 * LENGTH
        );
    }
}

/// An inclined plane through the apex of an upright rod, and a load that presses the rod on it.
fn pressed(compliance: Matrix3<f64>, friction: f64) -> (Contact<Sprung<HalfSpace>>, Distributed) {
    let plane = HalfSpace {
        through: Vector3::z() * LENGTH,
        normal: Vector3::new(-1.0, 0.0, -0.3),
    };
    let load = Vector3::new(1.0, 0.3, 0.1) * (3.0 / (unit() * LENGTH)) * LENGTH;
    (
        Contact {
            obstacle: Sprung(plane, compliance),
            radius: 0.0,
            friction,
        },
        Distributed(load),
    )
}

#[test]
fn apex_that_sticks_to_an_obstacle_on_springs_is_held_by_springs() {
    for size in [0.01, 0.1, 1.0] {
        let (contact, load) = pressed(skewed(size), 5.0);
        let (mut sticking, mut held) = (
            Held::straight(LENGTH, 0.0, 8, load),
            Held::straight(LENGTH, 0.0, 8, load),
        );
        sticking.hold(&contact);
        assert_eq!(sticking.reactions[0].slip, Some(Slip::Sticks));
        let stiffness = skewed(size).try_inverse().unwrap();
        let symmetric = (stiffness + stiffness.transpose()) * 0.5;
        held.hold(&Hold::apex().spring(Vector3::z() * LENGTH, symmetric));
        println!("{size}: {}", sticking.found);
        // A contact that sticks has a compliance of 1e-9 of that of the rod, which changes a force
        // of the order of one.
        let force = held.reaction().0;
        assert_abs_diff_eq!(
            (sticking.reaction().0 - force).norm(),
            0.0,
            epsilon = 1e-6 * force.norm()
        );
        assert_abs_diff_eq!(
            (sticking.rod.tip() - held.rod.tip()).norm(),
            0.0,
            epsilon = 1e-8 * LENGTH
        );
    }
}

#[test]
fn apex_that_slides_on_an_obstacle_on_springs_obeys_coulombs_law() {
    for (size, friction) in [(0.01, 0.1), (0.1, 0.1), (1.0, 0.05)] {
        let (contact, load) = pressed(skewed(size), friction);
        let mut held = Held::straight(LENGTH, 0.0, 8, load);
        held.hold(&contact);
        println!("{size}: {}", held.found);
        let (force, normal) = (held.reaction().0, contact.obstacle.0.normal.normalize());
        assert_eq!(held.reactions[0].slip, Some(Slip::Slides));
        let tangential = force - normal * normal.dot(&force);
        assert_relative_eq!(
            tangential.norm(),
            friction * normal.dot(&force),
            epsilon = 0.0,
            max_relative = 1e-10
        );
        // The displacement of the apex relative to the obstacle is in the plane and opposes the
        // friction.
        let slip = held.rod.tip() - Vector3::z() * LENGTH + skewed(size) * force;
        assert_abs_diff_eq!(slip.dot(&normal), 0.0, epsilon = 1e-11 * LENGTH);
        // The direction of the slip is updated after each step.
        assert_abs_diff_eq!(
            (slip.normalize() + tangential.normalize()).norm(),
            0.0,
            epsilon = 1e-8
        );
    }
}
