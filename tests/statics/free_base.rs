//! Rods with a free base, which only holds and contacts bear, against closed forms.

use std::f64::consts::FRAC_PI_2;

use super::elastica::legendre;
use crate::fixtures::held::assert_close;
use crate::fixtures::rods::{DENSITY, GRAVITY, RADIUS, bending_stiffness, density_for, weightless, young_tissue};
use morphorod::equilibrium::{EquilibriumError, Held, NewtonSolver};
use morphorod::load::{Load, Weight};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder, HalfSpace, Hold, Joint, Support};
use morphorod::{Environment, Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Length of the rods of this file, m.
const LENGTH: f64 = 0.1;

/// Equilibrium of a rod of young tissue. The laws are trait objects, so that all tests share one compiled solver.
fn solve(
    rod: &mut Rod,
    load: &dyn Load,
    support: &dyn Support,
    environment: &Environment,
) -> Result<Held, EquilibriumError> {
    NewtonSolver::default().solve_held(rod, &young_tissue(), &load, &support, environment)
}

/// A straight horizontal rod along e1 whose middle is at a place (m).
fn horizontal(middle: Vector3<f64>, elements: usize) -> Rod {
    let mut rod = Rod::uniform(LENGTH, RADIUS, Still::tilted(FRAC_PI_2).base, elements, Order::Eight).expect("a rod");
    rod.set_base_position(middle - Vector3::x() * (0.5 * LENGTH)).expect("a position");
    rod
}

fn gravity() -> Environment {
    Still::upright().environment(0.0)
}

#[test]
fn rod_held_at_both_ends_is_the_elastica_with_pinned_ends() {
    // Euler's elastica with the modulus k: P L²/B = 4 K², and the ends approach each other by 2 (1 − E/K) L. Love,
    // A Treatise on the Mathematical Theory of Elasticity (1927), § 263.
    for modulus in [0.3_f64, 0.6, 0.8] {
        let (k, e) = legendre(FRAC_PI_2, modulus);
        let mut rod = Rod::uniform(LENGTH, RADIUS, UnitQuaternion::identity(), 12, Order::Eight).expect("a rod");
        rod.set_base_position(Vector3::new(0.2, 0.1, -0.3)).expect("a position");
        let from = Vector3::new(0.21, 0.1, -0.3);
        let to = from + Vector3::z() * (LENGTH * (2.0 * e / k - 1.0));
        let support = (Joint::Free, Hold::place(LENGTH).at(from), Hold::apex().at(to));
        let held = solve(&mut rod, &(), &support, &weightless()).expect("an equilibrium");
        let thrust = 4.0 * k * k * bending_stiffness() / (LENGTH * LENGTH);
        assert_eq!(held.reactions.len(), 2);
        assert_close("thrust", held.reactions[0].force.z, thrust, 1e-8);
        assert_close("thrust", held.reactions[1].force.z, -thrust, 1e-8);
        assert!((rod.base_position() - from).norm() < 1e-12 && (rod.tip() - to).norm() < 1e-12);
        println!("{k} {} {}", held.equilibrium, held.increments);
    }
}

/// Thin horizontal cylinders along e2 with their tops at height zero and at the given places along e1 (m).
fn props(places: [f64; 2], friction: f64) -> Vec<Contact<Cylinder>> {
    let radius = 1e-4;
    let prop = |x: &f64| {
        let through = Vector3::new(*x, 0.0, -radius);
        Contact { obstacle: Cylinder { through, along: Vector3::y(), radius }, radius: 0.0, friction }
    };
    places.iter().map(prop).collect()
}

#[test]
fn beam_on_two_props_has_the_reactions_of_statics_and_the_deflection_of_beam_theory() {
    // A beam of load q per length with a span l between overhangs c: the middle is q l² (5 l² − 24 c²)/(384 B) below
    // the props (superposition of 5 q l⁴/384 B and of the couples q c²/2 at the props). Its slopes are of the order
    // q L³/B = 1e-4, whose square is the relative error of the theory.
    let density = density_for(1e-4, LENGTH);
    let weight = 1e-4 * bending_stiffness() / (LENGTH * LENGTH);
    for friction in [0.0, 0.5] {
        for (from, to) in [(-0.03, 0.03), (-0.035, 0.02)] {
            let mut rod = horizontal(Vector3::zeros(), 8);
            let support = (Joint::Free, props([from, to], friction));
            let held = solve(&mut rod, &Weight { density }, &support, &gravity()).expect("an equilibrium");
            println!("{friction} {} {:?}", held.equilibrium, held.reactions);
            let [a, b] = &held.reactions[..] else { panic!("{} reactions", held.reactions.len()) };
            let (a, b) = if a.arc_length < b.arc_length { (a, b) } else { (b, a) };
            let sum = a.force + b.force - Vector3::z() * weight;
            assert!(sum.norm() < 1e-8 * weight, "{sum}");
            assert_close("reaction", a.force.z / weight, to / (to - from), 1e-7);
            assert_close("reaction", b.force.z / weight, -from / (to - from), 1e-7);
            if from == -to {
                let (span, overhang) = (to - from, 0.5 * LENGTH - to);
                let load = weight / LENGTH;
                let sag = load * span * span * (5.0 * span * span - 24.0 * overhang * overhang)
                    / (384.0 * bending_stiffness());
                let middle = rod.at(0.5 * LENGTH).expect("a place").0;
                let at = |s: f64| rod.at(s).expect("a place").0;
                let chord = 0.5 * (at(a.arc_length) + at(b.arc_length));
                assert_close("sag", chord.z - middle.z, sag, 1e-6);
            }
        }
    }
}
