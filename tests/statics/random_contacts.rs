//! Random scenes: rods with intrinsic curvature and twist, and one or two obstacles near them, with
//! and without friction.

use approx::assert_relative_eq;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::rod::Rod;
use morphorod::support::{Capsule, Contact, Cylinder, HalfSpace, Obstacle, Sphere};
use morphorod::{Environment, Order, Scene, Still};
use nalgebra::Vector3;

/// Scenes of order four among the first 12,000 in which nodes do not reach the contacts, so that
/// the result has a reported error. In the first one a force acts at 5e-5 of the length above the
/// obstacle, with the error 1e-2. In the others the interpolated shape penetrates by up to 1.6
/// times the error, by at most 8e-5 of the length.
const MISPLACED: [u64; 11] = [
    2161, 2162, 2247, 3228, 3727, 3895, 5493, 9165, 9597, 9994, 11093,
];

/// A scene in which a contact point stayed beside the apex, which penetrated the obstacle by 2.6e-4
/// of the length.
const BESIDE_APEX: u64 = 8494;

type Obstacles = Vec<Contact<Box<dyn Obstacle>>>;

fn direction(draw: &mut Draw) -> Vector3<f64> {
    draw.vector(1.0)
        .try_normalize(1e-3)
        .unwrap_or_else(Vector3::x)
}

/// A straight rod, its environment, and obstacles between it and its shape without them.
fn scene(seed: u64) -> (Rod, Environment, Obstacles) {
    let mut draw = Draw::new(seed);
    let length = draw.uniform(0.03, 0.12);
    let tilted = Still::tilted(draw.uniform(0.0, 2.5));
    let still = if draw.chance(0.7) {
        tilted
    } else {
        Still {
            base: tilted.base,
            ..Still::weightless()
        }
    };
    let order = if draw.chance(0.7) {
        Order::Eight
    } else {
        Order::Four
    };
    let elements = draw.uniform(6.0, 17.0) as usize;
    let mut rod = Rod::uniform(length, RADIUS, still.base, elements, order).unwrap();
    let (bend, azimuth) = (draw.uniform(0.0, 3.0) / length, draw.uniform(0.0, 6.3));
    let twist = if draw.chance(0.5) {
        0.0
    } else {
        draw.uniform(-1.5, 1.5) / length
    };
    rod.set_intrinsic(|_| Vector3::new(-azimuth.sin() * bend, azimuth.cos() * bend, twist));
    let environment = still.environment(0.0);
    let mut free = rod.clone();
    let _ = NewtonSolver::default()
        .solve(&mut free, &YOUNG, &WEIGHT, &environment)
        .unwrap();
    let tangent = still.base * Vector3::z();
    let number = if draw.chance(0.7) { 1 } else { 2 };
    let mut obstacles = Obstacles::new();
    for _ in 0..1000 {
        let s = draw.uniform(0.2, 1.0) * length;
        let (way, size) = (
            free.at(s).unwrap().0 - tangent * s,
            draw.uniform(0.02, 0.2) * length,
        );
        let Some(side) = way.try_normalize(1e-3 * length) else {
            continue;
        };
        let surface = tangent * s + way * draw.uniform(0.1, 0.95);
        let centre = surface + side * size;
        let half = direction(&mut draw) * (length * draw.uniform(0.05, 0.6));
        let obstacle: Box<dyn Obstacle> = match draw.uniform(0.0, 4.0) as u8 {
            0 => Box::new(HalfSpace {
                through: surface,
                normal: direction(&mut draw) * 0.5 - side,
            }),
            1 => Box::new(Cylinder {
                through: centre,
                along: half,
                radius: size,
            }),
            2 => Box::new(Sphere {
                centre,
                radius: size,
            }),
            _ => Box::new(Capsule {
                ends: [centre - half, centre + half],
                radius: size,
            }),
        };
        let gap = |i: i32| {
            obstacle
                .distance(&(tangent * (length * f64::from(i) / 200.0)), 0.0)
                .value
                - RADIUS
        };
        if (0..=200).all(|i| gap(i) > 1e-3 * length) {
            obstacles.push(Contact {
                obstacle,
                radius: RADIUS,
                friction: 0.0,
            });
        }
        if obstacles.len() == number {
            break;
        }
    }
    (rod, environment, obstacles)
}

#[test]
fn random_contacts_push_within_the_cone_of_friction_without_penetration() {
    let (count, mut failures, mut touching) = (number("MORPHOROD_CASES", 450), Vec::new(), 0);
    let seeds: Vec<u64> = (0..count)
        .chain((BESIDE_APEX >= count).then_some(BESIDE_APEX))
        .collect();
    for &seed in &seeds {
        let friction = [0.0, 0.5, 1.0][seed as usize % 3];
        let (mut rod, environment, mut obstacles) = scene(seed);
        obstacles
            .iter_mut()
            .for_each(|contact| contact.friction = friction);
        let solve =
            NewtonSolver::default().solve_held(&mut rod, &YOUNG, &WEIGHT, &obstacles, &environment);
        let held = match solve {
            Ok(held) => held,
            Err(error) => {
                failures.push((seed, error));
                continue;
            }
        };
        touching += u64::from(!held.reactions.is_empty());
        assert_eq!(held.equilibrium.inertia.negative, 0, "{seed}");
        let (error, misplaced) = (held.equilibrium.error, MISPLACED.contains(&seed));
        assert!(!misplaced || error > 1e-7, "{seed}: {error:e}");
        // A penetration that the search reports is part of the error.
        assert!(seed != BESIDE_APEX || error < 1e-7, "{seed}: {error:e}");
        let apart = if misplaced { error } else { 0.0 };
        let length = rod.length();
        let largest = held
            .reactions
            .iter()
            .map(|reaction| reaction.normal)
            .fold(0.0, f64::max);
        for reaction in &held.reactions {
            let contact = &obstacles[reaction.obstacle.unwrap()];
            let gap = contact
                .obstacle
                .distance(&held.rod.at(reaction.arc_length).unwrap().0, 0.0);
            assert!(reaction.normal >= 0.0, "{seed}: {reaction:?}");
            // The place that is evaluated here differs from that of the contact by the
            // interpolation of the shape.
            let tangential = (reaction.force - gap.normal * reaction.normal).norm();
            assert!(
                tangential <= friction * reaction.normal + 1e-4 * largest,
                "{seed}: {reaction:?}"
            );
            assert!(
                (gap.value - RADIUS).abs() < (1e-5 + apart) * length,
                "{seed}: {:e}",
                (gap.value - RADIUS) / length
            );
        }
        // The bound at the apex does not contain the error, of which its penetration is a part.
        for contact in &obstacles {
            let gap = contact.obstacle.distance(&held.rod.tip(), 0.0).value - RADIUS;
            assert!(
                gap > -(1e-5 + apart) * length,
                "{seed}: apex at {:e}",
                gap / length
            );
        }
        // `centre_line_at` integrates the tangents within an element more accurately than the
        // discrete equations. In an element of order four that bends much its places differ from
        // theirs by up to 1e-5 of the length.
        for place in (0..=400).filter_map(|i| Some(held.rod.at(length * f64::from(i) / 400.0)?.0)) {
            for contact in &obstacles {
                let gap = contact.obstacle.distance(&place, 0.0).value - RADIUS;
                // Three of the first 1800 scenes penetrate between stations by more than 1e-9 plus
                // the reported error: by up to 1.3e-8.
                let permitted = (2e-8 + error + apart) * length;
                assert!(gap > -permitted, "{seed}: penetration {:e}", -gap / length);
            }
        }
    }
    let count = seeds.len() as u64;
    println!("{touching} of {count} rods touch, failures: {failures:?}");
    // None of the first 12,000 scenes fails (`MORPHOROD_CASES=12000`).
    assert!(failures.is_empty(), "{failures:?}");
    assert!(touching * 2 > count, "{touching} scenes with contact");
}

#[test]
fn parts_of_a_long_contact_push_within_the_cone_of_friction() {
    // Scenes in which the pressure that is extrapolated to the end of a long contact is negative,
    // or has another direction than the force there.
    for (seed, friction) in [(103_092, 0.0), (335, 0.3)] {
        let (mut rod, environment, mut obstacles) = scene(seed);
        obstacles
            .iter_mut()
            .for_each(|contact| contact.friction = friction);
        let solve =
            NewtonSolver::default().solve_held(&mut rod, &YOUNG, &WEIGHT, &obstacles, &environment);
        let held = solve.unwrap();
        assert!(
            held.reactions.iter().any(|reaction| reaction.length > 0.0),
            "{seed}"
        );
        for reaction in &held.reactions {
            let place = held.rod.at(reaction.arc_length).unwrap().0;
            let normal = obstacles[reaction.obstacle.unwrap()]
                .obstacle
                .distance(&place, 0.0)
                .normal;
            assert!(reaction.normal >= 0.0, "{seed}: {reaction:?}");
            // The obstacle is a plane, so that only rounding separates the two.
            assert_relative_eq!(
                reaction.force.dot(&normal),
                reaction.normal,
                epsilon = 0.0,
                max_relative = 1e-12
            );
            let tangential = (reaction.force - normal * reaction.normal).norm();
            // The last term is rounding.
            let cone = friction * reaction.normal * (1.0 + 1e-9) + 1e-12 * reaction.normal;
            assert!(tangential <= cone, "{seed}: {reaction:?}");
        }
    }
}
