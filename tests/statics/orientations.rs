//! Held rods in every orientation of the fixed frame: the axes of coordinates must not decide
//! whether an equilibrium is found, nor which one.

use std::f64::consts::{PI, TAU};

use super::held::modulus;
use crate::fixtures::gauss::gauss;
use crate::fixtures::held::{Held, about, assert_close};
use crate::fixtures::random::Draw;
use crate::fixtures::rods::{bending_stiffness, tight};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Weight};
use morphorod::rod::Rod;
use morphorod::support::{Hold, Joint, Moving, Support};
use morphorod::{Model, Order, Shoot, Still};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

fn rotation(draw: &mut Draw) -> UnitQuaternion<f64> {
    let axis = Unit::new_normalize(draw.vector(1.0));
    about(axis, draw.uniform(0.0, TAU))
}

/// The upright base, or a random one.
fn orientation(i: usize, draw: &mut Draw) -> UnitQuaternion<f64> {
    if i == 0 {
        UnitQuaternion::identity()
    } else {
        rotation(draw)
    }
}

/// A straight rod without weight on a base of given frame.
fn column(base: UnitQuaternion<f64>, elements: usize) -> Held<()> {
    let scene = Still {
        base,
        gravity: Vector3::zeros(),
    };
    Held::on(scene, LENGTH, (elements, Order::Eight), ())
}

#[test]
fn columns_have_eulers_forces_in_every_orientation() {
    let mut draw = Draw::new(1);
    for i in 0..20 {
        let base = orientation(i, &mut draw);
        let tip = Hold::apex().at(base * Vector3::z() * (0.9 * LENGTH));
        // The forces at a shortening of 0.1 between pins and between clamps are 4 K² and 16 K² with
        // the modulus of the elastica (`held::closed_forms_of_the_elastica_give_the_reference_numbers`).
        // That between a clamp and a pin is the limit of 32 and 64 elements, on which its digits
        // agree.
        let pinned: Box<dyn Support> = Box::new((Joint::Ball, tip));
        let cases: [(&str, Box<dyn Support>, f64); 3] = [
            ("pinned", pinned, 10.392_563_948_289),
            ("clamped and pinned", Box::new(tip), 20.958_642_205_6),
            ("clamped", Box::new(tip.held(base)), 41.570_255_793_156),
        ];
        for (name, support, expected) in cases {
            for elements in [16, 64] {
                let name = format!("{name}, {elements} elements, orientation {i}");
                let mut held = column(base, elements);
                held.hold(&support);
                let along = (base.inverse() * held.reaction().0).z.abs();
                let force = along * LENGTH * LENGTH / bending_stiffness();
                // Sixteen elements of order eight have an error of 8e-11 between clamps.
                assert_close(&name, force, expected, 1e-9);
                assert_eq!(held.found.inertia.negative, 0, "{name}");
            }
        }
    }
}

#[test]
fn apex_on_a_plane_or_a_line_across_the_column_is_half_an_elastica() {
    // The apex is free to rotate and to move sideways. The rod is half of the elastica between pins,
    // with the force K² B/L² along the axis. The only condition of a plane is that in which the
    // straight rod is rigid.
    let mut draw = Draw::new(7);
    for i in 0..8 {
        let base = orientation(i, &mut draw);
        let axis = base * Vector3::z();
        let across = base * about(Vector3::z_axis(), draw.uniform(0.0, TAU)) * Vector3::x();
        for height in [0.756, 0.891, 0.964] {
            let (_, complete) = modulus(1.0 - height);
            let through = axis * (height * LENGTH);
            let plane = Hold::apex().on_plane(through, Unit::new_normalize(axis));
            let line = Hold::apex().on_line(through, Unit::new_normalize(across));
            for (name, support) in [("plane", plane), ("line", line)] {
                let name = format!("{name}, height {height}, orientation {i}");
                let mut held = column(base, 8);
                held.hold(&support);
                let force = held.reaction().0 * LENGTH * LENGTH / bending_stiffness();
                assert_close(&name, -force.dot(&axis), complete * complete, 1e-9);
                // Rounding of the directions of the condition.
                assert!(force.cross(&axis).norm() < 1e-14, "{name}: {force:?}");
                assert_eq!(held.found.inertia.negative, 0, "{name}");
            }
        }
    }
}

#[test]
fn apex_reaches_random_places_with_and_without_weight() {
    let mut draw = Draw::new(2);
    for _ in 0..20 {
        let (base, place) = (rotation(&mut draw), draw.vector(0.57) * LENGTH);
        for density in [0.0, 1.0, 1000.0] {
            let scene = Still {
                base,
                ..Still::upright()
            };
            let weight = Weight { density };
            let mut held = Held::on(scene, LENGTH, (16, Order::Eight), weight);
            held.hold(&Hold::apex().at(place));
            // The violation that counts as rounding.
            assert!((held.rod.tip() - place).norm() < 1e-12 * LENGTH);
            assert_eq!(held.found.inertia.negative, 0);
        }
    }
}

#[test]
fn column_with_an_apex_beside_its_axis_has_almost_the_force_of_the_column() {
    // The force along the column changes in proportion to the offset.
    let mut draw = Draw::new(3);
    let base = rotation(&mut draw);
    for offset in [1e-12, 1e-10, 1e-8, 1e-6, 1e-4] {
        let place = base * Vector3::new(offset, 0.0, 0.9) * LENGTH;
        let mut held = column(base, 16);
        held.hold(&Hold::apex().at(place));
        let along = (base.inverse() * held.reaction().0).z.abs();
        let force = along * LENGTH * LENGTH / bending_stiffness();
        assert_close("force", force, 20.958_642_205_6, 1e-9 + 2.0 * offset);
        assert_eq!(held.found.inertia.negative, 0, "{offset:e}");
    }
}

#[test]
fn column_above_its_critical_load_is_not_stable_in_any_orientation() {
    // Rounding of a straight rod was taken for a rotation of its plane: with 1.003 times the critical
    // load the straight column was returned as stable in rotated scenes.
    let mut draw = Draw::new(7);
    for base in [
        UnitQuaternion::identity(),
        rotation(&mut draw),
        rotation(&mut draw),
    ] {
        for over in [1e-4, 1e-3, 3e-3] {
            let scene = Still {
                base,
                gravity: Vector3::zeros(),
            };
            // π²/4 B/L² for a clamped column.
            let critical = (0.5 * PI / LENGTH).powi(2) * bending_stiffness();
            let force = base * -Vector3::z() * ((1.0 + over) * critical);
            let load = ApicalForce(move |_| force);
            let mut held = Held::on(scene, LENGTH, (16, Order::Eight), load);
            held.hold(&Hold::apex());
            assert_eq!(held.found.inertia.negative, 0, "{over}");
            // The angle θ of the apex satisfies P/Pc = (2 K(sin θ/2)/π)² = 1 + θ²/8, and the first mode
            // moves the apex by 2 L θ/π.
            let expected = 2.0 / PI * (8.0 * over).sqrt();
            let tip = base.inverse() * held.rod.tip() / LENGTH;
            let deflection = tip.xy().norm();
            // The next terms of both series are of the order of θ².
            assert_close("deflection", deflection, expected, 8.0 * over);
        }
    }
}

/// Mean twist of a rod with equal elements, turns.
fn twist(rod: &Rod) -> f64 {
    let (points, weights) = gauss(rod.order().points());
    let each = (0..rod.elements()).flat_map(|e| (0..points.len()).map(move |g| (e, g)));
    let sum: f64 = each
        .map(|(e, g)| rod.strain(e, g).expect("a point").z * weights[g])
        .sum();
    sum * rod.length() / rod.elements() as f64 / TAU
}

#[test]
fn twist_of_a_buckled_rod_follows_its_apex_in_time() {
    // The shape without weight rotates freely about the line of its ends. Motions in this direction
    // were extrapolated, and added up to eight turns of twist in a step.
    let turned = |t: f64| {
        let frame = about(Vector3::z_axis(), TAU * t);
        Hold::apex().at(Vector3::z() * (0.8 * LENGTH)).held(frame)
    };
    for elements in [8, 16] {
        let mut shoot = Shoot::builder(YOUNG)
            .length(LENGTH)
            .radius(RADIUS)
            .elements(elements)
            .scene(Still::weightless())
            .support(Moving(turned))
            .into_dyn()
            .build()
            .expect("a shoot");
        let mut run = MethodOfSteps::with_solver(0.01, tight());
        let mut held = column(UnitQuaternion::identity(), elements);
        for step in 0..=100 {
            let t = 0.01 * f64::from(step);
            let _ = run.advance(&mut shoot, t).expect("a step");
            held.hold(&turned(t));
            let (a, b) = (twist(shoot.rod()), twist(&held.rod));
            // The results of both searches differ by rounding only.
            assert!(
                (a - b).abs() < 1e-9,
                "{elements} elements, {t} turns: {a} and {b}"
            );
        }
        // Part of the turn is writhe. The number is that on 12, 16, 24 and 48 elements, in whose digits
        // they agree; a rod is scaled without effect.
        let turns = twist(&held.rod);
        assert!((turns - 0.827_240_5).abs() < 1e-7, "{turns}");
    }
}

/// A straight shoot without weight whose apex moves by 0.1 L towards its base in one second,
/// between clamps or to a pin.
fn shortened(base: UnitQuaternion<f64>, elements: usize, clamped: bool) -> Shoot<impl Model> {
    let hold = move |t: f64| {
        let tip = Hold::apex().at(base * Vector3::z() * (LENGTH * (1.0 - 0.1 * t)));
        if clamped { tip.held(base) } else { tip }
    };
    let scene = Still {
        base,
        gravity: Vector3::zeros(),
    };
    Shoot::builder(YOUNG)
        .length(LENGTH)
        .radius(RADIUS)
        .elements(elements)
        .scene(scene)
        .support(Moving(hold))
        .build()
        .expect("a shoot")
}

/// Angle (rad) about the axis of the base from its d1 to the middle of the rod.
fn plane(shoot: &Shoot<impl Model>, base: UnitQuaternion<f64>) -> f64 {
    let (middle, _) = shoot.rod().at(0.5 * LENGTH).expect("a place");
    let middle = base.inverse() * middle;
    middle.y.atan2(middle.x)
}

#[test]
fn column_stays_in_the_plane_of_its_first_step() {
    // All planes are equal, and the first step bends the rod towards d1. A step may rotate the plane
    // by the rounding of its equilibrium, at most 4e-7 in 100 steps.
    let mut draw = Draw::new(4);
    for base in [UnitQuaternion::identity(), rotation(&mut draw)] {
        for clamped in [false, true] {
            for (elements, step) in [(8, 0.2), (8, 0.01), (32, 0.2), (32, 0.01)] {
                let mut shoot = shortened(base, elements, clamped);
                let mut run = MethodOfSteps::new(step);
                let statistics = run.advance(&mut shoot, 1.0).expect("steps");
                let angle = plane(&shoot, base);
                let case = format!("clamped {clamped}, {elements} elements, steps of {step} s");
                assert!(angle.abs() < 1e-5, "{case}: {angle:e}");
                assert_eq!(statistics.snaps, 0, "{case}");
            }
        }
    }
}

#[test]
fn adaptive_steps_find_the_column_in_every_orientation() {
    let mut draw = Draw::new(6);
    for base in [UnitQuaternion::identity(), rotation(&mut draw)] {
        for (clamped, expected) in [(false, 20.958_642_205_6), (true, 41.570_255_793_156)] {
            let mut shoot = shortened(base, 16, clamped);
            let statistics = Adaptive::new(1e-6).advance(&mut shoot, 1.0).expect("a run");
            assert!(statistics.error.expect("an estimate") <= 1e-6);
            assert!(plane(&shoot, base).abs() < 1e-5);
            let force = base.inverse() * shoot.reactions()[0].force;
            let force = force.z.abs() * LENGTH * LENGTH / bending_stiffness();
            // The estimate is that of the shape, in parts of the length. The force changes with the
            // shape by a factor of the order of one.
            assert_close("force", force, expected, 1e-5);
        }
    }
}

#[test]
fn clamp_that_turns_by_a_tiny_angle_selects_the_plane_of_a_column_held_at_its_middle() {
    // The energies of the planes differ by 1e-7 or 1e-5 of the force times the length. In the
    // iteration the unbalanced couples exceed this stiffness, so that its sign has to be found when
    // the rest of the rod is in equilibrium.
    let mut draw = Draw::new(8);
    for (turn, elements, step) in [1e-7, 1e-5]
        .into_iter()
        .flat_map(|turn| [(8, 0.2), (16, 0.05), (32, 0.2)].map(|(n, step)| (turn, n, step)))
    {
        let base = rotation(&mut draw);
        let angle = draw.uniform(0.0, TAU);
        let plane_of_turn = about(Vector3::z_axis(), angle);
        let axis = Unit::new_normalize(plane_of_turn * Vector3::y());
        let hold = move |t: f64| {
            let tip = Hold::apex().at(base * Vector3::z() * (LENGTH * (1.0 - 0.1 * t)));
            tip.held(base * about(axis, turn * t))
        };
        let line = Unit::new_normalize(base * Vector3::z());
        let middle = Hold::place(0.5 * LENGTH).on_line(Vector3::zeros(), line);
        let scene = Still {
            base,
            gravity: Vector3::zeros(),
        };
        let mut shoot = Shoot::builder(YOUNG)
            .length(LENGTH)
            .radius(RADIUS)
            .elements(elements)
            .scene(scene)
            .support((middle, Moving(hold)))
            .build()
            .expect("a shoot");
        let case = format!("turn {turn:e}, {elements} elements, steps of {step} s");
        let statistics = MethodOfSteps::new(step)
            .advance(&mut shoot, 1.0)
            .expect(&case);
        assert_eq!(statistics.snaps, 0, "{case}");
        let (quarter, _) = shoot.rod().at(0.25 * LENGTH).expect("a place");
        let quarter = (base * plane_of_turn).inverse() * quarter;
        // Rounding of the couples, 1e-15 of the force times the length, over the smallest stiffness
        // is 1e-8.
        let angle = (quarter.y / quarter.x).abs();
        assert!(angle < 1e-7, "{case}: {angle:e}");
    }
}
