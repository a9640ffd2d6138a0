//! Equilibria under symmetries: rotation and mirroring of the whole scene, and changes of units.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods;
use crate::fixtures::rods::{GRAVITY, MODULUS, bending_stiffness, cases};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use approx::abs_diff_eq;
use morphorod::constitutive::{Constitutive, LinearElastic};
use morphorod::equilibrium::{Equilibrium, EquilibriumSolver, NewtonSolver};
use morphorod::load::{ApicalForce, Distributed, Load, Weight};
use morphorod::rod::Rod;
use morphorod::{Environment, Order};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Tolerance of the frames, rad. Rounding does not permit a smaller value if one direction is a
/// thousand times softer than the others.
const PRECISION: f64 = 1e-12;

/// A shoot in a scene, with all parameters that a symmetry may transform.
#[derive(Debug, Clone)]
struct Case {
    length: f64,
    radius: f64,
    modulus: f64,
    density: f64,
    gravity: Vector3<f64>,
    base: UnitQuaternion<f64>,
    apical: Vector3<f64>,
    distributed: Vector3<f64>,
    /// Coefficients a and b of u*(s) = a + b s/ℓ (1/m), components along the directors.
    strain: [Vector3<f64>; 2],
}

impl Case {
    /// Solves for the equilibrium from a straight initial guess.
    fn solve(&self) -> (Rod, Equilibrium) {
        let mut rod =
            Rod::uniform(self.length, self.radius, self.base, 12, Order::default()).expect("a rod");
        rod.set_intrinsic(|point| {
            self.strain[0] + self.strain[1] * (1.0 - point.apex_distance / self.length)
        });
        let found = self.equilibrate(&mut rod);
        (rod, found)
    }

    fn equilibrate(&self, rod: &mut Rod) -> Equilibrium {
        let tissue = LinearElastic {
            youngs_modulus: self.modulus,
            poissons_ratio: 0.3,
        };
        let force = self.apical;
        let loads = (
            Weight {
                density: self.density,
            },
            ApicalForce(move |_: f64| force),
            Distributed(self.distributed),
        );
        let (law, load): (&dyn Constitutive, &dyn Load) = (&tissue, &loads);
        NewtonSolver::with_tolerance(PRECISION)
            .solve(
                rod,
                &law,
                &load,
                &Environment {
                    time: 0.0,
                    gravity: self.gravity,
                },
            )
            .expect("an equilibrium")
    }
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

/// Random shoots of 6 cm length. Under 9.81 m/s², q ℓ³/(E I) is at most about 12, which is 1.5
/// times the self-buckling load. Each component of gravity is at most 9.81 m/s². The other loads
/// are of similar size. Each component of a ℓ and b ℓ is at most 1 rad.
fn case() -> impl Strategy<Value = Case> {
    let length = 0.06;
    let force = 3.0 * bending_stiffness() / (length * length);
    let loads = (
        0.0..12.0_f64,
        vector(1.0),
        vector(force),
        vector(force / length),
    );
    (loads, rotation(), vector(1.0), vector(1.0)).prop_map(
        move |((load, down, apical, distributed), base, a, b)| Case {
            length,
            radius: RADIUS,
            modulus: MODULUS,
            density: load * rods::density_for(1.0, length) + 1.0,
            gravity: down * GRAVITY,
            base,
            apical,
            distributed,
            strain: [a / length, b / length],
        },
    )
}

/// Bound on the difference of two equilibria, rad. It is the sum of three times their error
/// estimates and of rounding, which the softest direction amplifies by the inverse of its margin.
fn promised(a: &Equilibrium, b: &Equilibrium) -> f64 {
    3.0 * (a.error + b.error) + 8.0 * f64::EPSILON / a.inertia.margin.min(b.inertia.margin)
}

/// Largest angle between the frames of two rods, rad.
fn apart<'a>(
    a: impl Iterator<Item = UnitQuaternion<f64>>,
    b: impl Iterator<Item = &'a UnitQuaternion<f64>>,
) -> f64 {
    a.zip(b).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn rotating_the_scene_rotates_the_equilibrium(case in case(), turn in rotation()) {
        let (rod, found) = case.solve();
        let turned = Case {
            base: turn * case.base,
            gravity: turn * case.gravity,
            apical: turn * case.apical,
            distributed: turn * case.distributed,
            ..case.clone()
        };
        let (image, again) = turned.solve();
        let difference = apart(rod.frames().iter().map(|f| turn * f), image.frames().iter());
        let promise = promised(&found, &again);
        prop_assert!(difference < promise, "{difference:e} against {promise:e}");
        let (expected, found_tip) = (turn * rod.tip(), image.tip());
        let bound = promise * case.length;
        let near = abs_diff_eq!(InNorm(expected), InNorm(found_tip), epsilon = bound);
        prop_assert!(near, "{expected} against {found_tip}");
        // Rounding may change the number of iterations by one.
        prop_assert!(found.iterations.abs_diff(again.iterations) <= 1, "{} {}", found.iterations, again.iterations);
        // A solved rod that is rotated with its scene is in equilibrium.
        let mut carried = rod.clone();
        carried.set_base(turned.base).unwrap();
        prop_assert_eq!(turned.equilibrate(&mut carried).iterations, 1);
    }

    #[test]
    fn mirroring_the_scene_mirrors_the_equilibrium(case in case()) {
        // The mirror Q reverses d1 of the base. A strain is an axial vector, u → −Q u. In the
        // right-handed directors −Q d1, Q d2, Q d3 its components are u1, −u2, −u3, and the base is
        // unchanged.
        let axis = case.base * Vector3::x();
        let mirror = Matrix3::identity() - axis * axis.transpose() * 2.0;
        let flip = |u: Vector3<f64>| Vector3::new(u.x, -u.y, -u.z);
        let mirrored = Case {
            gravity: mirror * case.gravity,
            apical: mirror * case.apical,
            distributed: mirror * case.distributed,
            strain: case.strain.map(flip),
            ..case.clone()
        };
        let ((rod, found), (image, again)) = (case.solve(), mirrored.solve());
        let promise = promised(&found, &again);
        let (expected, found_tip) = (mirror * rod.tip(), image.tip());
        let bound = promise * case.length;
        let near = abs_diff_eq!(InNorm(expected), InNorm(found_tip), epsilon = bound);
        prop_assert!(near, "{expected} against {found_tip}");
        let axes = |f: &UnitQuaternion<f64>| {
            let m = f.to_rotation_matrix().into_inner();
            mirror * m * Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0))
        };
        let frames = rod.frames().iter().zip(image.frames());
        let largest = frames.map(|(a, b)| (axes(a) - b.to_rotation_matrix().into_inner()).norm()).fold(0.0, f64::max);
        prop_assert!(largest < 2.0 * promise, "{largest:e} against {promise:e}");
    }

    #[test]
    fn power_of_two_units_reproduce_the_equilibrium_bit_for_bit(
        case in case(), length in -30..30_i32, force in -30..30_i32,
    ) {
        // Powers of two scale every product without rounding. Moduli are forces over squared
        // lengths.
        let (l, f) = (2_f64.powi(length), 2_f64.powi(force));
        let scaled = Case {
            length: case.length * l,
            radius: case.radius * l,
            modulus: case.modulus * f / (l * l),
            density: case.density * f / (l * l * l),
            apical: case.apical * f,
            distributed: case.distributed * (f / l),
            strain: case.strain.map(|u| u / l),
            ..case.clone()
        };
        let ((rod, found), (image, again)) = (case.solve(), scaled.solve());
        prop_assert_eq!(rod.frames(), image.frames());
        prop_assert_eq!(rod.tip() * l, image.tip());
        prop_assert_eq!((found.iterations, found.inertia), (again.iterations, again.inertia));
        prop_assert_eq!(found.energy * (f * l), again.energy);
    }

    #[test]
    fn split_loads_give_the_same_equilibrium(case in case(), share in 0.0..1.0_f64) {
        // The weight per length of a uniform shoot is a distributed load, and any load may be
        // split.
        let weight = case.gravity * (case.density * std::f64::consts::PI * case.radius * case.radius);
        let split = Case { density: case.density * share, ..case.clone() };
        let split = Case { distributed: case.distributed + weight * (1.0 - share), ..split };
        let ((rod, found), (other, again)) = (case.solve(), split.solve());
        let promise = promised(&found, &again);
        let difference = apart(rod.frames().iter().copied(), other.frames().iter());
        prop_assert!(difference < promise, "{difference:e} against {promise:e}");
    }
}

#[test]
fn boxed_and_absent_loads_act_like_plain_loads() {
    let rod = || {
        Rod::uniform(
            0.06,
            RADIUS,
            UnitQuaternion::identity(),
            8,
            Order::default(),
        )
        .expect("a rod")
    };
    let push = |_: f64| Vector3::new(1e-5, 2e-5, 0.0);
    let environment = Environment {
        time: 0.0,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
    };
    let weight = Weight { density: 1000.0 };
    let boxed: Box<dyn Load> = Box::new(ApicalForce(push));
    let absent: Option<Distributed> = None;
    let (mut plain, mut dressed) = (rod(), rod());
    let law: &dyn Constitutive = &YOUNG;
    let solve = |rod: &mut Rod, load: &dyn Load| {
        NewtonSolver::with_tolerance(PRECISION).solve(rod, &law, &load, &environment)
    };
    let one = solve(&mut plain, &(weight, ApicalForce(push)));
    let other = solve(&mut dressed, &(weight, boxed, (), absent));
    assert_eq!((one, plain), (other, dressed));
}
