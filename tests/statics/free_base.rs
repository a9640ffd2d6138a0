//! Rods with a free base, which only holds and contacts bear, against closed forms.

use std::f64::consts::FRAC_PI_2;

use super::elastica::legendre;
use crate::fixtures::held::assert_close;
use crate::fixtures::rods::{bending_stiffness, density_for, weightless};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use morphorod::equilibrium::{EquilibriumError, Held, NewtonSolver};
use morphorod::load::{ApicalForce, Load, PointForce, Weight};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, HalfSpace, Hold, Joint, Support};
use morphorod::{Environment, Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Length of the rods of this file, m.
const LENGTH: f64 = 0.1;

/// Equilibrium of a rod of young tissue. The laws are trait objects, so that all tests share one
/// compiled solver.
fn solve(
    rod: &mut Rod,
    load: &dyn Load,
    support: &dyn Support,
    environment: &Environment,
) -> Result<Held, EquilibriumError> {
    NewtonSolver::default().solve_held(rod, &YOUNG, &load, &support, environment)
}

/// A straight horizontal rod along e1 whose middle is at a place (m).
fn horizontal(middle: Vector3<f64>, elements: usize) -> Rod {
    let mut rod = Rod::uniform(
        LENGTH,
        RADIUS,
        Still::tilted(FRAC_PI_2).base,
        elements,
        Order::Eight,
    )
    .expect("a rod");
    rod.set_base_position(middle - Vector3::x() * (0.5 * LENGTH))
        .expect("a position");
    rod
}

fn gravity() -> Environment {
    Still::upright().environment(0.0)
}

#[test]
fn rod_held_at_both_ends_is_the_elastica_with_pinned_ends() {
    // Euler's elastica with the modulus k: P L²/B = 4 K², and the ends approach each other by 2 (1
    // − E/K) L. Love, A Treatise on the Mathematical Theory of Elasticity (1927), § 263.
    for modulus in [0.3_f64, 0.6, 0.8] {
        let (k, e) = legendre(FRAC_PI_2, modulus);
        let mut rod = Rod::uniform(LENGTH, RADIUS, UnitQuaternion::identity(), 12, Order::Eight)
            .expect("a rod");
        rod.set_base_position(Vector3::new(0.2, 0.1, -0.3))
            .expect("a position");
        let from = Vector3::new(0.21, 0.1, -0.3);
        let to = from + Vector3::z() * (LENGTH * (2.0 * e / k - 1.0));
        let support = (
            Joint::Free,
            Hold::place(LENGTH).at(from),
            Hold::apex().at(to),
        );
        let held = solve(&mut rod, &(), &support, &weightless()).expect("an equilibrium");
        let thrust = 4.0 * k * k * bending_stiffness() / (LENGTH * LENGTH);
        assert_eq!(held.reactions.len(), 2);
        assert_close("thrust", held.reactions[0].force.z, thrust, 1e-8);
        assert_close("thrust", held.reactions[1].force.z, -thrust, 1e-8);
        assert!((rod.base_position() - from).norm() < 1e-12 && (rod.tip() - to).norm() < 1e-12);
    }
}

/// Thin horizontal cylinders along e2 with their tops at height zero and at the given places along
/// e1 (m).
fn props(places: [f64; 2], friction: f64) -> Vec<Contact<Cylinder>> {
    let radius = 1e-4;
    let prop = |x: &f64| {
        let through = Vector3::new(*x, 0.0, -radius);
        Contact {
            obstacle: Cylinder {
                through,
                along: Vector3::y(),
                radius,
            },
            radius: 0.0,
            friction,
        }
    };
    places.iter().map(prop).collect()
}

#[test]
fn beam_on_two_props_has_the_reactions_of_statics_and_the_deflection_of_beam_theory() {
    // A beam of load q per length with a span l between overhangs c: the middle is q l² (5 l² − 24
    // c²)/(384 B) below the props (superposition of 5 q l⁴/384 B and of the couples q c²/2 at the
    // props). Its slopes are of the order q L³/B = 1e-4, whose square is the relative error of the
    // theory.
    let density = density_for(1e-4, LENGTH);
    let weight = 1e-4 * bending_stiffness() / (LENGTH * LENGTH);
    // A beam without friction rests only in the symmetric position.
    for (friction, from, to) in [(0.0, -0.03, 0.03), (0.5, -0.03, 0.03), (0.5, -0.035, 0.02)] {
        let mut rod = horizontal(Vector3::zeros(), 8);
        let support = (Joint::Free, props([from, to], friction));
        let held =
            solve(&mut rod, &Weight { density }, &support, &gravity()).expect("an equilibrium");
        assert_eq!(held.reactions.len(), 2);
        let mut reactions = held.reactions.clone();
        reactions.sort_by(|a, b| a.arc_length.total_cmp(&b.arc_length));
        let [a, b] = [reactions[0], reactions[1]];
        let sum = a.force + b.force - Vector3::z() * weight;
        assert!(sum.norm() < 1e-8 * weight, "{sum}");
        assert_close("reaction", a.force.z / weight, to / (to - from), 5e-8);
        assert_close("reaction", b.force.z / weight, -from / (to - from), 5e-8);
        if from == -to {
            let (span, overhang) = (to - from, 0.5 * LENGTH - to);
            let shape = span * span * (5.0 * span * span - 24.0 * overhang * overhang);
            let sag = weight / LENGTH * shape / (384.0 * bending_stiffness());
            let at = |s: f64| held.rod.at(s).expect("a place").0.z;
            let above = 0.5 * (at(a.arc_length) + at(b.arc_length));
            assert_close("sag", above - at(0.5 * LENGTH), sag, 1e-6);
        }
    }
}

/// A strip of weight W = B/L² on a table with the coefficient of friction 0.3: the equilibrium, and
/// the sum of the contact forces over W.
fn strip(push: f64, hold: Option<Hold>) -> Result<(Held, Vector3<f64>), EquilibriumError> {
    let weight = bending_stiffness() / (LENGTH * LENGTH);
    let mut rod = horizontal(Vector3::zeros(), 8);
    let table = HalfSpace {
        through: Vector3::zeros(),
        normal: Vector3::z(),
    };
    let table = Contact {
        obstacle: table,
        radius: 0.0,
        friction: 0.3,
    };
    let mut support: Vec<Box<dyn Support>> = vec![Box::new(Joint::Free), Box::new(table)];
    support.extend(hold.map(|hold| Box::new(hold) as Box<dyn Support>));
    let load = (
        Weight {
            density: density_for(1.0, LENGTH),
        },
        ApicalForce(move |_| Vector3::x() * (push * weight)),
    );
    let held = solve(&mut rod, &load, &support, &gravity())?;
    let contacts = held.reactions.iter().filter(|at| at.obstacle.is_some());
    let sum = contacts.map(|at| at.force / weight).sum::<Vector3<f64>>();
    Ok((held, sum))
}

#[test]
fn strip_on_a_table_sticks_up_to_the_friction_force_and_not_beyond() {
    // Coulomb's law for the whole strip: it rests if the horizontal force is less than μ W.
    for push in [0.0, 0.2, 0.29] {
        let (held, sum) = strip(push, None).expect("an equilibrium");
        assert!((sum - Vector3::new(-push, 0.0, 1.0)).norm() < 1e-8, "{sum}");
        let moved = held.rod.base_position() + Vector3::x() * (0.5 * LENGTH);
        assert!(moved.norm() < 1e-8 * LENGTH, "{moved}");
        let jump = held.equilibrium.jump;
        assert!(
            jump.is_none(),
            "the initial shape is the equilibrium: {jump:?}"
        );
    }
    assert!(matches!(
        strip(0.4, None),
        Err(EquilibriumError::NotHeld { .. })
    ));
}

#[test]
fn point_force_at_a_free_base_acts_on_it() {
    let force = Vector3::new(0.3, -0.2, 0.1) * bending_stiffness() / (LENGTH * LENGTH);
    // The sum of the lengths of the elements may differ from the length by rounding.
    for elements in [1, 3, 7, 8, 11, 13] {
        let mut rod = horizontal(Vector3::zeros(), elements);
        let hold = Hold::place(LENGTH)
            .at(rod.base_position())
            .held(rod.frames()[0]);
        let load = PointForce {
            initial_apex_distance: LENGTH,
            force,
        };
        let held =
            solve(&mut rod, &load, &(Joint::Free, hold), &weightless()).expect("an equilibrium");
        // The hold at the base is the only support, and it bears the force.
        let sum = held
            .reactions
            .iter()
            .map(|at| at.force)
            .sum::<Vector3<f64>>();
        assert!(
            (sum + force).norm() < 1e-12 * force.norm(),
            "{elements}: {sum}"
        );
    }
}

#[test]
fn force_that_drags_a_strip_over_a_table_is_friction_times_weight() {
    let along = Hold::apex().on_plane(Vector3::x() * (0.52 * LENGTH), Vector3::x_axis());
    let (held, sum) = strip(0.0, Some(along)).expect("an equilibrium");
    assert!((sum - Vector3::new(-0.3, 0.0, 1.0)).norm() < 1e-8, "{sum}");
    assert!((held.rod.base_position().x + 0.48 * LENGTH).abs() < 1e-8 * LENGTH);
}

#[test]
fn rod_that_nothing_holds_is_an_error() {
    // The bend by the smallest weight is q ℓ³/(E I) = 1.6e-11. A joint turns the apex and bears no
    // force.
    let joint = (
        Joint::Free,
        Hold::apex().elastic_joint(UnitQuaternion::identity(), 1e-4),
    );
    for density in [1e3, 1e-3, 1e-9] {
        for support in [&Joint::Free as &dyn Support, &joint] {
            let mut rod = horizontal(Vector3::zeros(), 4);
            let start = rod.clone();
            let error = solve(&mut rod, &Weight { density }, support, &gravity()).unwrap_err();
            assert!(
                matches!(error, EquilibriumError::NotHeld { force } if force.z < 0.0),
                "{density}: {error}"
            );
            assert_eq!(rod, start);
        }
    }
}
