//! A rod wound on a drum that rotates below it: the ratio of the tensions of both tails, compared
//! with the closed form of an elastic rod.

#[path = "../../examples/capstan/drum.rs"]
mod drum;

use std::f64::consts::PI;

use crate::fixtures::rods::bending_stiffness;
use crate::fixtures::shoots::{RADIUS, YOUNG, rod};
use drum::{CIRCLE, Drum, TURN, closed_form};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::support::{Contact, Cylinder, Distance, Joint, Obstacle, Slip};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

/// Coefficient of friction.
const FRICTION: f64 = 0.3;
/// Tension of the slack tail over B/Rc².
const TENSION: f64 = 100.0;
/// Length of each tail over the decay length √(B/F0) of the slack one.
const TAIL: f64 = 15.0;

/// Direction of the force on the apex at a time: it turns to `angle` in a second.
fn direction(angle: f64, t: f64) -> Vector3<f64> {
    let turned = angle * t.min(1.0);
    Vector3::new(turned.sin(), 0.0, turned.cos())
}

/// A drum that stops after a second.
struct Stopping(Drum);

impl Obstacle for Stopping {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        self.0.distance(place, time)
    }

    fn velocity(&self, place: &Vector3<f64>, time: f64) -> Vector3<f64> {
        if time > 1.0 + 1e-9 {
            Vector3::zeros()
        } else {
            self.0.velocity(place, time)
        }
    }
}

/// An upright rod on a ball joint that touches the drum. The force on its apex, with a tension
/// `slack` over B/Rc², turns by `angle` in a second. The drum stops then, and in five further steps
/// the force increases to that at which 0.9 of the friction is necessary.
fn wound(angle: f64, slack: f64, elements: usize, steps: f64) -> Shoot<DynLaws> {
    let tension = slack * bending_stiffness() / (CIRCLE * CIRCLE);
    let tail = TAIL * CIRCLE / slack.sqrt();
    let increase =
        move |t: f64| 1.0 + (1.0 / 0.9 - 1.0) * ((t - 1.0) * steps / 5.0).clamp(0.0, 1.0);
    let pull = move |t: f64| direction(angle, t) * (tension * increase(t));
    let through = Vector3::new(1.001 * CIRCLE, 0.0, tail);
    let cylinder = Cylinder {
        through,
        along: Vector3::y(),
        radius: CIRCLE - RADIUS,
    };
    let drum = Stopping(Drum {
        cylinder,
        rate: TURN * steps,
    });
    rod(YOUNG, 2.0 * tail + angle * CIRCLE)
        .elements(elements)
        .load(ApicalForce(pull))
        .scene(Still::weightless())
        .support((
            Joint::Ball,
            Contact {
                obstacle: drum,
                radius: RADIUS,
                friction: FRICTION,
            },
        ))
        .into_dyn()
        .build()
        .unwrap()
}

fn integrator(steps: f64) -> MethodOfSteps {
    // The reported inertia does not contain all of the friction and does not decide stability.
    MethodOfSteps::with_solver(
        1.0 / steps,
        NewtonSolver {
            stable_only: false,
            ..NewtonSolver::with_tolerance(1e-10)
        },
    )
}

#[test]
fn closed_form_of_the_capstan_matches_reference_numbers() {
    // Values of a shooting method, with twelve digits.
    for (friction, turns, slack, expected) in [
        (0.3, 1.0, 100.0, 6.556_370_727_365_803),
        (0.5, 1.5, 25.0, 108.738_919_686_554_27),
        (0.3, 1.0, 2.0, 5.318_684_178_016_102),
    ] {
        let turn = 2.0 * PI * turns;
        let found = closed_form(friction, turn, slack, (friction * turn).exp());
        assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
    }
}

#[test]
fn tension_grows_along_a_sliding_contact() {
    // Elements have 0.23 and 0.64 of the radius of the centre line; the errors, 3e-8 and 4e-7, are
    // those of the discretisation. In a slack rod the tails lift off 41° early, and the contact is
    // longer than a point from an angle of 76° on.
    for (angle, slack, elements, steps, tolerance) in [
        (2.0 * PI, TENSION, 40, 30.0, 1e-6),
        (0.6 * PI, 2.0, 36, 8.0, 1e-5),
    ] {
        let mut shoot = wound(angle, slack, elements, steps);
        MethodOfSteps {
            retries: 10,
            ..integrator(steps)
        }
        .advance(&mut shoot, 1.0)
        .unwrap();
        assert!(
            shoot
                .reactions()
                .iter()
                .all(|at| at.slip == Some(Slip::Slides))
        );
        let base = shoot.profile().at(0.0).unwrap().force;
        let turn = angle - base.x.atan2(base.z);
        let ratio = base.norm() * CIRCLE * CIRCLE / (slack * bending_stiffness());
        let expected = closed_form(FRICTION, turn, slack, ratio);
        assert!(
            (ratio / expected - 1.0).abs() < tolerance,
            "{slack} {ratio} {expected}"
        );
        // The formula exp(μ Φ) differs by 0.2 % and more.
        let elementary = (FRICTION * turn).exp();
        assert!(
            (ratio / elementary - 1.0).abs() > 1e-3,
            "{slack} {ratio} {elementary}"
        );
    }
}

#[test]
fn rod_at_rest_on_a_drum_does_not_creep() {
    let (angle, steps) = (0.4 * PI, 8.0);
    let mut shoot = wound(angle, TENSION, 20, steps);
    let mut run = MethodOfSteps {
        retries: 10,
        ..integrator(steps)
    };
    let at = |step: u32| f64::from(step) / steps;
    run.advance(&mut shoot, at(14)).unwrap();
    assert!(
        shoot
            .reactions()
            .iter()
            .all(|at| at.slip == Some(Slip::Sticks))
    );
    let (first, length) = (shoot.rod().centre_line_at(101), shoot.rod().length());
    // The force is constant from step 13 on. The next increments correct the error of the
    // equilibria, which is below the tolerance of 1e-10, and move the rod by 2e-11 of its length.
    for step in 15..18 {
        run.advance(&mut shoot, at(step)).unwrap();
    }
    let before = shoot.rod().centre_line_at(101);
    for step in 18..38 {
        run.advance(&mut shoot, at(step)).unwrap();
    }
    let line = shoot.rod().centre_line_at(101);
    let moved = |from: &[Vector3<f64>]| {
        from.iter()
            .zip(&line)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max)
    };
    assert!(
        moved(&first) < 1e-10 * length,
        "{:e}",
        moved(&first) / length
    );
    let creep = moved(&before);
    // Ten thousand increments with a creep of 1e-13 of the length remain below 1e-9. A slip that
    // was counted from another interpolation of the shape than that of the solver would be 1e-7 of
    // the length in each increment.
    assert!(creep < 20.0 * 1e-13 * length, "{:e}", creep / length);
}
