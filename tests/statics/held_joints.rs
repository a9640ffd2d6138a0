//! Joints, guides and held frames: closed forms, balance, symmetry, order of accuracy and errors.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::held::{Held, about, assert_close};
use crate::fixtures::rods::{DENSITY, GRAVITY, MODULUS, bending_stiffness, cases, density_for};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use approx::abs_diff_eq;
use morphorod::constitutive::Timoshenko;
use morphorod::load::Weight;
use morphorod::support::{Hold, Joint, Moving, Support};
use morphorod::{Order, Still};
use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Length, m.
const LENGTH: f64 = 0.05;

/// Weight per length, N/m.
fn per_length() -> Vector3<f64> {
    -Vector3::z() * (DENSITY * GRAVITY * PI * RADIUS * RADIUS)
}

/// Horizontal rod along e1 under its weight.
fn horizontal(elements: usize) -> Held<Weight> {
    Held::straight(LENGTH, FRAC_PI_2, elements, WEIGHT)
}

/// Fails unless the tip is at a place, to an error relative to the length.
fn assert_tip(held: &Held<impl morphorod::load::Load>, place: &Vector3<f64>, tolerance: f64) {
    let error = (held.rod.tip() - place).norm() / LENGTH;
    assert!(
        error <= tolerance,
        "{} against {place}: {error:e}",
        held.rod.tip()
    );
}

/// End of an arc that begins upright and turns by an angle towards e1.
fn arc(angle: f64) -> Vector3<f64> {
    Vector3::new(1.0 - angle.cos(), 0.0, angle.sin()) * (LENGTH / angle)
}

#[test]
fn held_frame_bends_a_rod_to_an_arc_and_twists_it_uniformly() {
    let unit = bending_stiffness() / LENGTH;
    for angle in [0.5, 2.0, 3.0] {
        let mut bent = Held::straight(LENGTH, 0.0, 8, ());
        bent.hold(&Hold::apex().held(about(Vector3::y_axis(), angle)));
        // Gauss quadrature of the arc with eight elements has an error of 2e-13 at 3 rad.
        assert_tip(&bent, &arc(angle), 1e-12);
        let mut twisted = Held::straight(LENGTH, 0.0, 8, ());
        twisted.hold(&Hold::apex().held(about(Vector3::z_axis(), angle)));
        assert_tip(&twisted, &(Vector3::z() * LENGTH), 1e-14);
        // The strain is constant in each element, and the couples are those of the law to rounding.
        for (held, couple) in [
            (bent, Vector3::y() * angle * unit),
            (twisted, Vector3::z() * (angle * unit / 1.5)),
        ] {
            let (force, found) = held.reaction();
            assert!(
                (found - couple).norm() < 1e-13 * couple.norm() && force == Vector3::zeros(),
                "{found}"
            );
            assert_eq!(held.signs(), (0, 0));
        }
    }
}

#[test]
fn elastic_joint_shares_the_rotation_with_the_rod() {
    // The couple is constant: E I a/ℓ = K (φ − a) for the angle a of the apex.
    let unit = bending_stiffness() / LENGTH;
    for (angle, stiffness) in [(0.5, 1.0), (2.0, 0.3), (2.0, 100.0), (3.0, 5.0)] {
        let mut held = Held::straight(LENGTH, 0.0, 8, ());
        held.hold(&Hold::apex().elastic_joint(about(Vector3::y_axis(), angle), stiffness * unit));
        let turned = stiffness * angle / (1.0 + stiffness);
        // The error of the quadrature is that of the held frame.
        assert_tip(&held, &arc(turned), 1e-12);
        let energy = 0.5 * unit * (turned * turned + stiffness * (angle - turned).powi(2));
        assert_close("energy", held.found.energy, energy, 1e-13);
        assert_close("couple", held.reaction().1.y, unit * turned, 1e-12);
    }
}

#[test]
fn guided_apex_slides_to_the_place_of_least_energy() {
    let through = Vector3::x() * (0.9 * LENGTH);
    let mut guided = horizontal(16);
    guided.hold(&Hold::apex().on_line(through, Vector3::z_axis()));
    let (force, couple) = guided.reaction();
    assert_eq!(
        (force.z, couple, guided.signs()),
        (0.0, Vector3::zeros(), (0, 0))
    );
    assert!((guided.rod.tip() - through).xy().norm() < 1e-14 * LENGTH);
    // A hold at the same point needs no force along the line, to rounding.
    let mut held = horizontal(16);
    held.hold(&Hold::apex().at(guided.rod.tip()));
    assert!(
        (held.reaction().0 - force).norm() < 1e-11 * force.norm(),
        "{}",
        held.reaction().0
    );
    assert_close("energy", held.found.energy, guided.found.energy, 1e-11);
}

#[test]
fn reaction_is_the_derivative_of_the_energy_by_the_held_place() {
    let place = Vector3::new(0.8, 0.15, -0.1) * LENGTH;
    let mut held = horizontal(16);
    let force = held.hold(&Hold::apex().at(place)).reaction().0;
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let energy = |step: f64| {
            let mut moved = Held {
                rod: held.rod.clone(),
                ..horizontal(16)
            };
            moved
                .hold(&Hold::apex().at(place + axis * (step * LENGTH)))
                .found
                .energy
        };
        // Differences of order four with the step h = 1e-3. The error is of order h⁴ = 1e-12 times
        // the scale of the shape, and rounding contributes 1e-15/h.
        let h = 1e-3;
        let slope = (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h)))
            / (12.0 * h * LENGTH);
        let error = (slope - force.dot(&axis)).abs() / force.norm();
        assert!(error < 1e-9, "{slope} against {force}: {error:e}");
    }
}

#[test]
fn rod_on_a_ball_joint_or_a_hinge_hangs_straight() {
    for tilt in [1.0, FRAC_PI_2, 2.0] {
        for (joint, neutral) in [(Joint::Ball, 1), (Joint::Hinge(Vector3::y_axis()), 0)] {
            let mut held = Held::straight(LENGTH, tilt, 8, WEIGHT);
            held.hold(&joint);
            assert_tip(&held, &(-Vector3::z() * LENGTH), 1e-14);
            // The centre of the weight is half the length below the base.
            assert_close(
                "energy",
                held.found.energy,
                per_length().z * LENGTH * LENGTH / 2.0,
                1e-14,
            );
            // A rod on a ball joint rotates freely about the vertical.
            assert_eq!(held.signs(), (0, neutral));
        }
    }
}

#[test]
fn rod_on_a_ball_joint_and_a_prop_is_a_simply_supported_beam() {
    for load in [1e-3, 1.0, 5.0] {
        let mut held = Held::straight(
            LENGTH,
            FRAC_PI_2,
            8,
            Weight {
                density: density_for(load, LENGTH),
            },
        );
        held.hold(&(
            Joint::Ball,
            Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis()),
        ));
        // Half of the weight at any load, by symmetry.
        let share = held.reaction().0.z * LENGTH * LENGTH / (load * bending_stiffness());
        assert_close("reaction", share, 0.5, 1e-13);
        // The sag of a linear beam, 5 q ℓ⁴/(384 E I), has a relative error of order λ² with λ = q
        // ℓ³/(E I).
        assert_close(
            "sag",
            -held.place(0.5).z / LENGTH,
            5.0 / 384.0 * load,
            1e-3 * load * load + 1e-11,
        );
        // Rotations about the vertical and about the rod are free.
        assert_eq!(held.signs(), (0, 2));
    }
}

#[test]
fn vertical_hinge_bears_the_couple_of_a_clamp() {
    // d1 of the horizontal base is vertical.
    let (mut hinged, mut clamped) = (horizontal(8), horizontal(8));
    hinged.hold(&Joint::Hinge(Vector3::x_axis()));
    clamped.hold(&());
    // The two searches differ by rounding.
    assert_tip(&hinged, &clamped.rod.tip(), 1e-13);
    assert_eq!((hinged.signs(), clamped.signs()), ((0, 1), (0, 0)));
    let base = clamped.couple_beyond(0.0, &per_length());
    assert!(
        (hinged.reaction().1 + base).norm() < 1e-9 * base.norm(),
        "{} against {base}",
        hinged.reaction().1
    );
}

#[test]
fn part_beyond_an_interior_clamp_is_a_cantilever() {
    for part in [0.4, 0.5] {
        let mut held = horizontal(10);
        let clamp = Hold::place(part * LENGTH)
            .on_line(Vector3::zeros(), Vector3::x_axis())
            .held(held.scene.base);
        held.hold(&clamp);
        let mut alone = Held::straight(part * LENGTH, FRAC_PI_2, 10, WEIGHT);
        alone.hold(&());
        // Elements of the part have an error of 1e-13 relative to the length.
        assert_tip(&held, &(held.place(1.0 - part) + alone.rod.tip()), 1e-12);
        // The clamp bears the part beyond it and half of the part before it, which is clamped at
        // both ends.
        assert_close(
            "force",
            held.reaction().0.z,
            -per_length().z * LENGTH * 0.5 * (1.0 + part),
            1e-6,
        );
    }
}

#[test]
fn hinged_apex_transmits_no_couple_about_the_axis() {
    let place = Vector3::x() * (0.9 * LENGTH);
    let mut socket = horizontal(16);
    let frame = about(Vector3::z_axis(), 0.3) * about(Vector3::x_axis(), 0.4) * socket.scene.base;
    socket.hold(&Hold::apex().at(place).hinged(frame, Vector3::z_axis()));
    let (tangent, couple) = (socket.rod.apex_frame() * Vector3::z(), socket.reaction().1);
    // The tangent is held to rounding. The couple about it is that of the tolerance.
    assert!(
        (tangent - frame * Vector3::z()).norm() < 1e-14
            && couple.dot(&tangent).abs() < 1e-13 * couple.norm()
    );
    // A hinge across the plane of bending equals a pin.
    let (mut hinge, mut pin) = (horizontal(16), horizontal(16));
    hinge.hold(
        &Hold::apex()
            .at(place)
            .hinged(hinge.scene.base, Vector3::y_axis()),
    );
    pin.hold(&Hold::apex().at(place));
    assert!((hinge.reaction().0 - pin.reaction().0).norm() < 1e-12 * pin.reaction().0.norm());
}

/// The apex moves out of the plane, and its frame rotates, in a unit of time.
fn path(base: UnitQuaternion<f64>) -> impl Support {
    Moving(move |t: f64| {
        let place = Vector3::new(0.9 - 0.2 * t, 0.1 * t, 0.1 * t) * LENGTH;
        Hold::apex()
            .at(place)
            .held(about(Vector3::z_axis(), 0.5 * t) * base)
    })
}

/// Rod at the end of the path, which it follows in a number of calls.
fn moved(calls: usize) -> Held<Weight> {
    let mut held = horizontal(16);
    let path = path(held.scene.base);
    for call in 0..=calls {
        held.time = call as f64 / calls as f64;
        held.hold(&path);
    }
    held
}

#[test]
fn hold_that_moves_in_one_call_or_in_many_gives_the_same_state() {
    let one = moved(1);
    for calls in [2, 10] {
        let many = moved(calls);
        // The tolerance of the frames is 1e-14 rad. A few iterations of rounding remain.
        assert_tip(&many, &one.rod.tip(), 1e-13);
        assert!((many.place(0.5) - one.place(0.5)).norm() < 1e-12 * LENGTH);
        let ((force, couple), (other, turning)) = (one.reaction(), many.reaction());
        assert!(
            (force - other).norm() < 1e-11 * force.norm()
                && (couple - turning).norm() < 1e-11 * couple.norm()
        );
    }
}

#[test]
fn couples_balance_at_every_material_point() {
    // Springs, elastic joint and prop at three places, and the moved clamp.
    let mut several = horizontal(16);
    let stiffness = bending_stiffness() / LENGTH.powi(3);
    several.hold(&(
        Hold::place(0.75 * LENGTH).spring(
            Vector3::new(0.01, 0.01, 0.0),
            Matrix3::identity() * (20.0 * stiffness),
        ),
        Hold::place(0.5 * LENGTH)
            .elastic_joint(several.scene.base, 3.0 * bending_stiffness() / LENGTH),
        Hold::apex().on_plane(Vector3::z() * 0.01, Vector3::z_axis()),
    ));
    for held in [several, moved(1)] {
        let couple = held
            .reactions
            .iter()
            .map(|r| r.couple.norm().max(r.force.norm() * LENGTH))
            .fold(0.0, f64::max);
        // The strain is differentiated from the rotations and has one order less than they have.
        let error = held.unbalanced(&per_length()) / couple;
        assert!(error < 1e-6, "{error:e}");
    }
}

proptest! {
    #![proptest_config(cases(8))]
    #[test]
    fn rotation_of_scene_and_holds_rotates_shape_and_reactions(axis in prop::array::uniform3(-2.0..2.0_f64)) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(axis));
        let held = |turn: UnitQuaternion<f64>| {
            let plain = Still::tilted(FRAC_PI_2);
            let scene = Still { gravity: turn * plain.gravity, base: turn * plain.base };
            let mut held = Held::on(scene, LENGTH, (16, Order::Eight), WEIGHT);
            let middle = turn * Vector3::new(0.02, 0.0, 0.002);
            let across = Unit::new_unchecked(turn * Vector3::z());
            let end = turn * Vector3::new(0.8, 0.2, 0.1) * LENGTH;
            let frame = turn * about(Vector3::z_axis(), 0.4) * plain.base;
            held.hold(&(Hold::place(0.5 * LENGTH).on_plane(middle, across), Hold::apex().at(end).held(frame)));
            held
        };
        let (plain, turned) = (held(UnitQuaternion::identity()), held(turn));
        // Rounding of the rotated data is amplified by the search, in about twenty iterations.
        let error = (turned.place(0.3) - turn * plain.place(0.3)).norm() / LENGTH;
        prop_assert!(abs_diff_eq!(error, 0.0, epsilon = 1e-11), "{error:e}");
        for (a, b) in turned.reactions.iter().zip(&plain.reactions) {
            prop_assert!((a.force - turn * b.force).norm() <= 1e-9 * b.force.norm(), "{a:?} against {b:?}");
            let couple = b.force.norm() * LENGTH;
            prop_assert!((a.couple - turn * b.couple).norm() <= 1e-9 * couple, "{a:?} against {b:?}");
        }
    }
}

#[test]
fn reaction_has_the_order_of_the_elements() {
    let load = 10.0;
    for order in Order::ALL {
        let errors: Vec<f64> = [4, 8, 16, 32]
            .iter()
            .map(|&elements| {
                let weight = Weight {
                    density: density_for(load, LENGTH),
                };
                let mut held = Held::of_order(LENGTH, FRAC_PI_2, (elements, order), weight);
                held.hold(&Hold::apex().on_plane(Vector3::zeros(), Vector3::z_axis()));
                let share = held.reaction().0.z * LENGTH * LENGTH / (load * bending_stiffness());
                (share / 0.375_991_338_135_435_1 - 1.0).abs()
            })
            // Smaller errors are rounding of the reference.
            .filter(|error| *error > 3e-12)
            .collect();
        let halvings = errors.len() - 1;
        let observed = (errors[halvings - 1] / errors[halvings]).log2();
        // The next term of the error changes the order that the finest pair shows by 0.35 or less.
        assert!(
            (observed - order.exponent() as f64).abs() < 0.4,
            "{order:?}: {observed} from {errors:?}"
        );
    }
}

#[test]
fn straight_rod_that_stretches_follows_hookes_law() {
    let stiffness = MODULUS * PI * RADIUS * RADIUS;
    for stretch in [0.9999, 1.001, 1.05] {
        let mut held = Held::straight(LENGTH, 0.0, 8, ());
        held.law = Box::new(Timoshenko::circular(YOUNG));
        held.hold(&Hold::apex().at(Vector3::z() * (LENGTH * stretch)));
        // The difference of the lengths is rounded to 1e-16 of the length, and the strain is 1e-4
        // or more.
        assert_close(
            "force",
            held.reaction().0.z,
            stiffness * (stretch - 1.0),
            1e-11,
        );
        let energy = 0.5 * stiffness * LENGTH * (stretch - 1.0).powi(2);
        assert_close("energy", held.found.energy, energy, 1e-8);
        assert_eq!(held.signs(), (0, 0));
    }
}

#[test]
fn invalid_holds_are_errors_and_leave_the_rod_unchanged() {
    let at = |hold: Hold| hold.at(Vector3::x() * (0.9 * LENGTH));
    let (apex, frame) = (Hold::apex(), UnitQuaternion::identity());
    let skew = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let long = Unit::new_unchecked(Vector3::z() * 2.0);
    // Each support with a part of the message.
    let invalid: [(Box<dyn Support>, &str); 16] = [
        (Box::new(at(Hold::place(0.013))), "end of an element"),
        (
            Box::new((at(apex), apex.held(frame))),
            "number of holds of one place",
        ),
        (
            Box::new(at(Hold::place(LENGTH))),
            "distance of a hold from the base",
        ),
        (
            Box::new(Hold::place(LENGTH).held(frame)),
            "distance of a hold from the base",
        ),
        (
            Box::new((Joint::Ball, at(Hold::place(LENGTH)))),
            "distance of a hold from the base",
        ),
        (
            Box::new(at(Hold::place(1.1 * LENGTH))),
            "distance of a held place from the apex",
        ),
        (
            Box::new(at(Hold::place(-0.01))),
            "distance of a held place from the apex",
        ),
        (
            Box::new(at(Hold::place(f64::NAN))),
            "distance of a held place from the apex",
        ),
        (Box::new(apex.at(Vector3::x() * f64::NAN)), "held position"),
        (
            Box::new(apex.spring(Vector3::zeros(), skew)),
            "asymmetry of the stiffness",
        ),
        (
            Box::new(apex.spring(Vector3::zeros(), -Matrix3::identity())),
            "least stiffness of a spring",
        ),
        (
            Box::new(apex.elastic_joint(frame, -1.0)),
            "stiffness of an elastic joint",
        ),
        (
            Box::new(apex.on_plane(Vector3::zeros(), long)),
            "norm of the normal",
        ),
        (
            Box::new(apex.held(Unit::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0)))),
            "norm of the quaternion",
        ),
        (Box::new(Joint::Hinge(long)), "norm of the axis"),
        // A place beyond the reach of the rod.
        (
            Box::new(apex.at(Vector3::x() * (2.0 * LENGTH))),
            "distance of a hold from the base",
        ),
    ];
    let mut held = horizontal(8);
    held.hold(&());
    for (support, expected) in invalid {
        held.assert_refused(&support, expected);
    }
    // The rod is usable afterwards.
    held.hold(&apex.on_plane(Vector3::zeros(), Vector3::z_axis()));
}
