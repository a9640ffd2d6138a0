//! Completeness of the lists of roots and multipliers: they contain all roots to the right of their
//! line and all multipliers outside their radius.

use std::f64::consts::TAU;

use super::cycles::{Parameters, circle, plain};
use super::random_orbits::{Circling, assert_growth, growth_in_time};
use super::rosettes::PLAIN;
use super::{assert_complex_eq, mode, planes};
use morphorod::cycle::RotatingWaveSolver;
use morphorod::tropism::Memory;

/// An earlier version returned an empty list of roots for this circle and counted none as unstable.
#[test]
fn circle_of_a_sensitive_shoot_with_short_memories_has_the_decay_seen_in_time() {
    let parameters = Parameters {
        youngs_modulus: 1.2814e7,
        beta: 1.90302,
        eta: 6.7958,
        growth_time: 32_749.97,
        memory: Memory {
            time: 600.23,
            delay: 338.05,
        },
        length: 0.0697,
    };
    let mut shoot = parameters.shoot(4);
    let circle = RotatingWaveSolver::default()
        .from_mode(&shoot, &mode(&shoot), 0.01)
        .unwrap();
    let found = circle.roots(&shoot, 1).unwrap();
    assert!(!found.roots.is_empty() && found.line < found.roots[0].value.re);
    assert_eq!(found.unstable(), 0);
    let period = TAU / circle.rate.abs();
    let leading = (found.roots[0].value.re * period).exp();
    let mut strains = circle.rod.points()[circle.rod.zone()]
        .iter()
        .map(|point| point.intrinsic);
    shoot.set_intrinsic(|_| strains.next().unwrap());
    let history = Circling {
        rate: circle.rate,
        memory: parameters.memory,
    };
    let seen = growth_in_time(shoot, &history, period, parameters.memory.delay, leading);
    assert_growth("the sensitive shoot", leading, seen);
}

/// An earlier version with fourteen Krylov vectors omitted the second root.
#[test]
fn all_roots_to_the_right_of_the_line_are_in_the_shorter_list() {
    for length in [0.076, 0.077, 0.078] {
        let shoot = plain(length, 4);
        let orbit = circle(&shoot, 0.05);
        let [short, long] = [1, 4].map(|count| orbit.roots(&shoot, count).unwrap());
        assert!(short.line < 0.0 && !short.roots.is_empty() && long.roots.len() >= 4);
        let beyond = long.roots.iter().filter(|root| root.value.re > short.line);
        for (k, root) in beyond.enumerate() {
            // The tolerance of Newton's method is 1e-12 of the rate of rotation.
            assert_complex_eq(length, short.roots[k].value, root.value, 1e-9 * orbit.rate);
        }
    }
}

#[test]
fn all_multipliers_outside_the_radius_are_in_the_shorter_list() {
    let [short, long] = [1, 5].map(|count| PLAIN.swing.multipliers(&PLAIN.shoot, count).unwrap());
    assert!(long.radius < short.radius && short.radius < 1.0);
    for (short_set, long_set) in planes(&short.values).iter().zip(&planes(&long.values)) {
        assert!(!short_set.is_empty() && long_set.len() >= 5);
        let beyond = long_set
            .iter()
            .filter(|one| one.value.norm() > short.radius);
        for (k, one) in beyond.enumerate() {
            // The eigenvectors converge to 1e-10, and the condition numbers of the multipliers are
            // several tens.
            assert_complex_eq(k, short_set[k].value, one.value, 1e-8);
        }
    }
}
