//! Jumps of held rods: each is reported, with a distance that does not depend on the increments,
//! and smooth motions are not jumps.

use std::f64::consts::PI;

use crate::fixtures::held::{about, assert_close};
use crate::fixtures::random::Draw;
use crate::fixtures::rods::bending_stiffness;
use crate::fixtures::shoots::{RADIUS, YOUNG};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Distance, HalfSpace, Hold, Moving, Obstacle, Support};
use morphorod::{Model, Order, Scene, Shoot, Still};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// A straight weightless rod on a base of given frame.
fn rod(base: UnitQuaternion<f64>) -> Rod {
    Rod::uniform(LENGTH, RADIUS, base, 12, Order::Eight).unwrap()
}

fn still(base: UnitQuaternion<f64>) -> Still {
    Still {
        base,
        gravity: Vector3::zeros(),
    }
}

/// A straight weightless shoot with a support.
fn shoot(base: UnitQuaternion<f64>, elements: usize, support: impl Support) -> Shoot<impl Model> {
    Shoot::builder(YOUNG)
        .length(LENGTH)
        .radius(RADIUS)
        .elements(elements)
        .scene(still(base))
        .support(support)
        .build()
        .unwrap()
}

fn frame(draw: &mut Draw) -> UnitQuaternion<f64> {
    about(
        Unit::new_normalize(draw.vector(1.0)),
        draw.uniform(0.0, 2.0 * PI),
    )
}

/// Motions of the centre line and reported jumps, relative to the length, of a hold that moves from
/// t = 0 to 1 in a number of calls.
fn sequence(
    base: UnitQuaternion<f64>,
    calls: usize,
    hold: impl Fn(f64) -> Hold,
) -> Vec<(f64, Option<f64>)> {
    let mut rod = rod(base);
    let scene = still(base);
    let mut solver = NewtonSolver::with_tolerance(1e-10);
    let mut moves = Vec::new();
    for call in 0..=calls {
        let before = rod.centre_line_at(17);
        let hold = hold(call as f64 / calls as f64);
        let held = solver
            .solve_held(&mut rod, &YOUNG, &(), &hold, &scene.environment(0.0))
            .unwrap();
        let each = rod.centre_line_at(17).into_iter().zip(before);
        let motion = each.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / LENGTH;
        // The first call begins with a straight rod.
        if call > 0 {
            moves.push((motion, held.equilibrium.jump.map(|jump| jump / LENGTH)));
        }
    }
    moves
}

/// An arch between clamps at a given distance. That at its apex turns by an angle from one side of
/// the chord to the other.
fn arch(base: UnitQuaternion<f64>, chord: f64, angle: f64) -> impl Fn(f64) -> Hold {
    move |t| {
        let turned = about(Vector3::x_axis(), angle * (t - 0.31));
        Hold::apex()
            .at(base * Vector3::z() * (chord * LENGTH))
            .held(base * turned)
    }
}

#[test]
fn arch_between_clamps_that_turn_jumps_once_over_the_same_distance() {
    let mut draw = Draw::new(3);
    for chord in [0.6, 0.8] {
        let base = frame(&mut draw);
        let distances = [20, 60].map(|calls| {
            let moves = sequence(base, calls, arch(base, chord, 1.2));
            let far: Vec<_> = moves.iter().filter(|(motion, _)| *motion > 0.1).collect();
            let told: Vec<f64> = moves.iter().filter_map(|(_, jump)| *jump).collect();
            // The rod also moves in the rest of the call.
            assert_eq!(
                (far.len(), told.len()),
                (1, 1),
                "{chord} {calls}: {moves:?}"
            );
            assert!((told[0] / far[0].0 - 1.0).abs() < 0.02, "{chord} {calls}");
            told[0]
        });
        // The distance is resolved to 1 %.
        assert_close("distance", distances[0], distances[1], 0.01);
    }
}

#[test]
fn smooth_motions_of_a_hold_are_no_jumps() {
    let mut draw = Draw::new(5);
    for _ in 0..12 {
        let base = frame(&mut draw);
        // The tip moves on a line that stays between 0.3 and 0.95 of the length from the base.
        let (from, to) = loop {
            let [a, b] = [0.95, 0.95].map(|reach| draw.vector(reach));
            let closest = (0..=20)
                .map(|i| (a + (b - a) * (f64::from(i) / 20.0)).norm())
                .fold(f64::INFINITY, f64::min);
            let within = [a, b].iter().all(|place| place.norm() < 0.95);
            if within && closest > 0.3 {
                break (a, b);
            }
        };
        let hold = move |t: f64| Hold::apex().at(base * (from + (to - from) * t) * LENGTH);
        for (motion, jump) in sequence(base, 20, hold) {
            assert!(jump.is_none() && motion < 0.2, "{from} {to}: {motion}");
        }
    }
}

#[test]
fn steps_in_time_report_the_jump_of_an_arch() {
    let base = UnitQuaternion::identity();
    let jumps = [0.05, 0.01].map(|step| {
        let mut shoot = shoot(base, 12, Moving(arch(base, 0.7, 1.2)));
        let solver = NewtonSolver::with_tolerance(1e-10);
        let spent = MethodOfSteps::with_solver(step, solver)
            .advance(&mut shoot, 1.0)
            .unwrap();
        assert_eq!(spent.snaps, 1, "{step}");
        spent.largest_jump / LENGTH
    });
    assert_close("distance", jumps[0], jumps[1], 0.01);
    assert!(jumps[0] > 0.3, "{jumps:?}");
}

/// A wall in front of the apex that approaches the base.
struct Approaching {
    normal: Vector3<f64>,
    speed: f64,
}

impl Obstacle for Approaching {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let wall = HalfSpace {
            through: -self.normal * (LENGTH - self.speed * time),
            normal: self.normal,
        };
        wall.distance(place, time)
    }

    fn velocity(&self, _: &Vector3<f64>, _: f64) -> Vector3<f64> {
        self.normal * self.speed
    }
}

/// A column on a base of given frame, and a wall that shortens it by a part of its length in one
/// second.
fn under_wall(
    base: UnitQuaternion<f64>,
    elements: usize,
    shortening: f64,
    friction: f64,
) -> Shoot<impl Model> {
    let wall = Approaching {
        normal: base * -Vector3::z(),
        speed: shortening * LENGTH,
    };
    let support = Contact {
        obstacle: wall,
        radius: 0.0,
        friction,
    };
    shoot(base, elements, support)
}

/// The upright frame and two random ones.
fn bases(seed: u64) -> [UnitQuaternion<f64>; 3] {
    let mut draw = Draw::new(seed);
    [
        UnitQuaternion::identity(),
        frame(&mut draw),
        frame(&mut draw),
    ]
}

#[test]
fn column_that_a_rough_wall_shortens_sticks_for_every_step() {
    // A clamped column whose tip sticks buckles at (4.4934 / L)² B = 20.19 B/L², and the shortening
    // of 2e-4 L changes the force by less than 1e-4 of it. The tip would slide at a lateral force of
    // 0.05 of the axial one.
    // The rod may bend in any plane through its axis.
    let bases = bases(5);
    let steps = [1.0, 0.2, 0.05, 0.01, 0.002];
    for (base, step) in bases
        .iter()
        .flat_map(|base| steps.map(|step| (*base, step)))
    {
        let mut shoot = under_wall(base, 16, 2e-4, 0.05);
        let solver = NewtonSolver::with_tolerance(1e-11);
        let statistics = MethodOfSteps::with_solver(step, solver)
            .advance(&mut shoot, 1.0)
            .unwrap();
        assert_eq!(statistics.snaps, 0, "{step} s, {base}");
        let force: Vector3<f64> = shoot.reactions().iter().map(|at| at.force).sum();
        let force = -force.dot(&(base * Vector3::z())) * LENGTH * LENGTH / bending_stiffness();
        assert_close(&format!("force for {step} s"), force, 20.190_728_6, 1e-4);
    }
}

#[test]
fn column_under_a_smooth_wall_buckles_in_its_plane_in_every_orientation() {
    // Half of the elastica between pins, whose force at a shortening of 0.1 is 10.392564 B/L². All
    // planes through the axis are equal, and a rotation of the plane from step to step would be
    // taken for an error in time.
    for (base, elements) in bases(6).iter().flat_map(|base| [8, 16].map(|n| (*base, n))) {
        let column = || under_wall(base, elements, 0.1, 0.0);
        // In its first step, shorter by 6e-6 of its length, the rod takes the mode in which it
        // buckles. Sixteen iterations are those of the upright column.
        let mut first = column();
        let solver = NewtonSolver::with_tolerance(1e-11);
        let statistics = MethodOfSteps::with_solver(6e-5, solver)
            .advance(&mut first, 6e-5)
            .unwrap();
        assert_eq!(statistics.snaps, 0, "{base}");
        assert!(statistics.iterations <= 20, "{base}: {statistics:?}");
        let amplitude = (base.inverse() * first.rod().tip()).xy().norm() / LENGTH;
        // The shortening of the mode is (π/4)² times the square of the deflection of its apex, to
        // second order in it.
        let expected = 4.0 / PI * 6e-6_f64.sqrt();
        assert_close("amplitude", amplitude, expected, 1e-5);

        let mut column = column();
        let statistics = Adaptive::new(1e-6).advance(&mut column, 1.0).unwrap();
        assert!(statistics.error.unwrap() <= 1e-6);
        let force: Vector3<f64> = column.reactions().iter().map(|at| at.force).sum();
        let force = base.inverse() * force * LENGTH * LENGTH / bending_stiffness();
        // Elements of order eight have an error of 1e-12, and the wall determines the shape.
        assert_close("force", -force.z, 0.25 * 10.392_563_948_289, 1e-11);
        let tip = base.inverse() * column.rod().tip();
        assert!(tip.y.atan2(tip.x).abs() < 1e-6, "{base}: {tip:?}");
    }
}
