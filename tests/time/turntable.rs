//! Shoots whose base rotates on a turntable, next to a pole.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{RADIUS, WEIGHT, rod, tissue};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder, Distance, Joint, Obstacle, Support};
use morphorod::{Along, DynLaws, Scene, Shoot, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

const TISSUE: LinearElastic = tissue(1e8);

/// A base that rotates about a vertical axis at a rate (rad/s), at an arm (m) from the axis, and
/// moves at a velocity (m/s). The shoot is horizontal, along e1 at first.
#[derive(Clone, Copy, Default)]
struct Turntable {
    rate: f64,
    arm: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Turntable {
    fn turn(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.rate * t)
    }
}

impl Scene for Turntable {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Still::upright().gravity
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        self.turn(t) * Still::tilted(FRAC_PI_2).base
    }
    fn position(&self, t: f64) -> Vector3<f64> {
        self.turn(t) * self.arm + self.velocity * t
    }
}

/// A vertical pole of 1 mm radius through a point (m), which moves at a velocity (m/s) or rotates
/// with a turntable.
#[derive(Clone, Copy)]
struct Pole {
    through: Vector3<f64>,
    table: Turntable,
}

impl Obstacle for Pole {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        let through = self.table.turn(time) * self.through + self.table.velocity * time;
        Cylinder {
            through,
            along: Vector3::z(),
            radius: 1e-3,
        }
        .distance(place, time)
    }
    fn velocity(&self, _place: &Vector3<f64>, _time: f64) -> Vector3<f64> {
        self.table.velocity
    }
}

fn contact(through: Vector3<f64>, table: Turntable, friction: f64) -> Contact<Pole> {
    Contact {
        obstacle: Pole { through, table },
        radius: RADIUS,
        friction,
    }
}

/// A shoot of 5 cm without growth in a scene with a support, after a time (s) in steps of a length
/// (s).
fn elastic(
    scene: Turntable,
    support: impl Support + Send + Sync + 'static,
    time: f64,
    step: f64,
) -> Shoot<DynLaws> {
    let builder = rod(TISSUE, 0.05).elements(8).load(WEIGHT);
    let mut shoot = builder
        .scene(scene)
        .support(support)
        .into_dyn()
        .build()
        .unwrap();
    MethodOfSteps::new(step).advance(&mut shoot, time).unwrap();
    shoot
}

#[test]
fn shoot_on_a_turntable_does_not_pass_through_a_thin_pole() {
    // A place beside the pole moves by 4 mm in a step of 60 s. In the finest steps it moves by a
    // tenth of the radius of the pole. The contact slides without friction, so that the shape does
    // not depend on the steps.
    let table = Turntable {
        rate: 0.12 / 60.0,
        ..Turntable::default()
    };
    let pole = contact(Vector3::new(0.034, 3e-3, 0.0), Turntable::default(), 0.0);
    // The base is clamped, or twists freely.
    for joint in [None, Some(Joint::Hinge(Vector3::z_axis()))] {
        let [coarse, fine] = [60.0, 1.5].map(|step| elastic(table, (joint, pole), 300.0, step));
        let force = |shoot: &Shoot<DynLaws>| {
            shoot
                .reactions()
                .iter()
                .map(|reaction| reaction.normal)
                .sum::<f64>()
        };
        assert!(force(&coarse) > 1e-4);
        assert_relative_eq!(force(&coarse), force(&fine), max_relative = 1e-6);
        // The tolerance of the frames is 1e-11 rad, and that of the place of the contact 3e-10 of
        // the length.
        assert_abs_diff_eq!(InNorm(coarse.tip()), InNorm(fine.tip()), epsilon = 1e-9);
    }
}

/// A shoot on a hinge on a turntable, which rotates by 0.05 to 0.2 rad in a step and carries it
/// past a pole with friction. All moves at a velocity (m/s).
fn carried_past_a_pole(
    draw: &mut Draw,
    velocity: Vector3<f64>,
    friction: f64,
) -> (Turntable, Shoot<DynLaws>) {
    let table = Turntable {
        rate: draw.uniform(0.05, 0.2) / 60.0,
        velocity,
        ..Turntable::default()
    };
    let through = Vector3::new(draw.uniform(0.02, 0.048), draw.uniform(1.6e-3, 7.6e-3), 0.0);
    let pole = contact(
        through,
        Turntable {
            velocity,
            ..Turntable::default()
        },
        friction,
    );
    (
        table,
        elastic(table, (Joint::Hinge(Vector3::z_axis()), pole), 300.0, 60.0),
    )
}

#[test]
fn hinged_base_follows_a_turntable_past_any_pole() {
    // In two of these scenes an equilibrium is found only after a step is divided in two.
    let mut draw = Draw::new(4);
    for case in 0..40 {
        let (table, shoot) = carried_past_a_pole(&mut draw, Vector3::zeros(), [0.0, 0.3][case % 2]);
        let axis = |frame: UnitQuaternion<f64>| frame * Vector3::z();
        let [actual, expected] = [shoot.rod().frames()[0], table.base(300.0)].map(axis);
        // The difference is rounding.
        assert!(
            (actual - expected).norm() < 1e-14,
            "{case}: {actual} {expected}"
        );
    }
}

#[test]
fn constant_velocity_of_all_bodies_does_not_change_the_tip() {
    // In one of these scenes a step is divided. The tip would be 50 mm away there if the time from
    // which slip counts were not that of the shape at the start of the step.
    let velocity = Vector3::new(0.0, 0.0, 3e-5);
    let [mut still, mut moving] = [Draw::new(4), Draw::new(4)];
    for case in 0..20 {
        let (_, unmoved) = carried_past_a_pole(&mut still, Vector3::zeros(), 0.3);
        let (_, moved) = carried_past_a_pole(&mut moving, velocity, 0.3);
        let difference = (moved.tip() - moved.rod().base_position() - unmoved.tip()).norm();
        // The parts of a step in which contacts are followed differ, and with friction the error is
        // of first order in them. In 300 scenes the largest difference is 1.1e-5 m.
        assert!(difference < 2e-5, "{case}: {difference:e}");
    }
}

#[test]
fn turned_pot_bends_the_shoot_around_the_pole() {
    // The base turns by 0.6 rad at once.
    let base = Still::tilted(FRAC_PI_2).base;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.6);
    let scene = Turned {
        scene: Still {
            base,
            ..Still::upright()
        },
        turn,
        from: 600.0,
        until: f64::INFINITY,
    };
    let pole = contact(Vector3::new(0.034, 3e-3, 0.0), Turntable::default(), 0.0);
    let builder = rod(TISSUE, 0.05).elements(8).load(WEIGHT);
    let mut shoot = builder
        .scene(scene)
        .support(pole)
        .into_dyn()
        .build()
        .unwrap();
    MethodOfSteps::new(300.0)
        .advance(&mut shoot, 1200.0)
        .unwrap();
    let table = Turntable {
        rate: 0.6 / 300.0,
        ..Turntable::default()
    };
    let slow = elastic(table, pole, 300.0, 1.5);
    assert_abs_diff_eq!(InNorm(shoot.tip()), InNorm(slow.tip()), epsilon = 1e-9);
}

#[test]
fn pole_that_moves_is_equivalent_to_a_base_that_moves_the_other_way() {
    let through = Vector3::new(0.034, 3e-3, 0.0);
    let still = Turntable::default();
    let moves = Turntable {
        velocity: Vector3::new(5e-6, 7e-5, 1e-5),
        ..still
    };
    let back = Turntable {
        velocity: -moves.velocity,
        ..still
    };
    // The parts of a step in which contacts are followed differ, and with friction the error is of
    // first order in them.
    for (friction, tolerance) in [(0.0, 1e-9), (0.3, 1e-5)] {
        let base = elastic(moves, contact(through, still, friction), 240.0, 60.0);
        let pole = elastic(still, contact(through, back, friction), 240.0, 60.0);
        assert!(base.reactions()[0].normal > 1e-4);
        let tip = base.tip() - base.rod().base_position();
        assert_abs_diff_eq!(InNorm(tip), InNorm(pole.tip()), epsilon = tolerance);
        // The motion does not change the shape of a shoot without the pole.
        let free = elastic(moves, (), 240.0, 60.0);
        let unmoved = elastic(still, (), 0.0, 60.0);
        assert_abs_diff_eq!(
            InNorm(free.tip() - free.rod().base_position()),
            InNorm(unmoved.tip()),
            epsilon = 1e-13
        );
        assert!((tip - unmoved.tip()).norm() > 5e-3);
    }
}

#[test]
fn shoot_and_pole_on_the_same_turntable_keep_their_shape() {
    // The pole is 20 mm from the axis, and both rotate by 0.5 rad in a step.
    let table = Turntable {
        rate: 0.5 / 60.0,
        arm: Vector3::new(-0.01, 0.02, 0.03),
        ..Turntable::default()
    };
    // The pole presses the shoot aside by 2 mm.
    let press = contact(
        table.arm + Vector3::new(0.03, -1.5e-3 + 2e-3, 0.0),
        table,
        0.0,
    );
    let mut shoot = elastic(table, press, 0.0, 60.0);
    let (before, force) = (
        shoot.tip() - shoot.rod().base_position(),
        shoot.reactions()[0].normal,
    );
    assert!(before.y < -1e-3 && force > 0.0, "{before}, {force}");
    MethodOfSteps::new(60.0).advance(&mut shoot, 300.0).unwrap();
    let after = table.turn(300.0).inverse() * (shoot.tip() - shoot.rod().base_position());
    assert_abs_diff_eq!(InNorm(after), InNorm(before), epsilon = 1e-9);
    assert_relative_eq!(shoot.reactions()[0].normal, force, max_relative = 1e-6);
}

#[test]
fn base_that_moves_away_leaves_a_rough_pole() {
    // The base moves towards the pole and back.
    let path = |t: f64| Vector3::y() * (4e-3 * (t * std::f64::consts::TAU / 1200.0).sin());
    let base = Still::tilted(FRAC_PI_2).base;
    let builder = rod(TISSUE, 0.05).elements(8).load(WEIGHT);
    let scene = Along {
        scene: Still {
            base,
            ..Still::upright()
        },
        path,
    };
    let pole = contact(Vector3::new(0.034, 3e-3, 0.0), Turntable::default(), 0.4);
    let mut shoot = builder
        .scene(scene)
        .support(pole)
        .into_dyn()
        .build()
        .unwrap();
    let unmoved = elastic(Turntable::default(), (), 0.0, 60.0).tip();
    let mut touched = 0;
    for step in 0..=20 {
        MethodOfSteps::new(60.0)
            .advance(&mut shoot, 60.0 * f64::from(step))
            .unwrap();
        let shift = shoot.rod().base_position().y;
        // The gap to a straight shoot is 1.5 mm.
        let touches = shift > 1.5e-3;
        assert_eq!(shoot.reactions().is_empty(), !touches, "{shift} m");
        touched += usize::from(touches);
        if !touches {
            let tip = shoot.tip() - shoot.rod().base_position();
            assert_abs_diff_eq!(InNorm(tip), InNorm(unmoved), epsilon = 1e-11);
        }
    }
    assert!(touched > 3);
}
