//! Contact of rods with frictionless obstacles, against reference solutions by shooting and by
//! collocation.
//!
//! The reference numbers are the rows of the table of boundary value problems with contact: 5.x for
//! a heavy rod above a plane, 6.x for a rod that leans against a pole.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::rods::{DENSITY, GRAVITY, bending_stiffness, weightless};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use morphorod::equilibrium::{EquilibriumSolver, Held, NewtonSolver};
use morphorod::rod::Rod;
use morphorod::support::{
    Contact, Cylinder, Distance, HalfSpace, Obstacle, Reaction, Sphere, Support,
};
use morphorod::{Environment, Order, Scene, Still};
use nalgebra::{Matrix3, Vector3};

/// Weight per length, N/m.
fn per_length() -> f64 {
    DENSITY * GRAVITY * PI * RADIUS * RADIUS
}

/// A frictionless plane at a distance below the base (m), touched by the centre line.
fn floor(depth: f64) -> Contact<HalfSpace> {
    let plane = HalfSpace {
        through: Vector3::z() * -depth,
        normal: Vector3::z(),
    };
    Contact {
        obstacle: plane,
        radius: 0.0,
        friction: 0.0,
    }
}

/// Equilibrium of a straight heavy rod, clamped horizontally, with a support.
fn horizontal(length: f64, elements: usize, order: Order, support: &impl Support) -> Held {
    let scene = Still::tilted(FRAC_PI_2);
    let mut rod = Rod::uniform(length, RADIUS, scene.base, elements, order).unwrap();
    NewtonSolver::default()
        .solve_held(&mut rod, &YOUNG, &WEIGHT, support, &scene.environment(0.0))
        .unwrap()
}

/// The reactions in the order of arc length.
fn along(held: &Held) -> Vec<Reaction> {
    let mut reactions = held.reactions.clone();
    reactions.sort_by(|a, b| a.arc_length.total_cmp(&b.arc_length));
    reactions
}

/// Couple at the base that lifts the rod (N m), from the balance of weight and reactions.
fn base_couple(held: &Held) -> f64 {
    // ∫ x ds by Simpson's rule over the smooth parts on both sides of a contact would need its
    // place; the midpoint rule with 20,000 parts is accurate to 1e-9.
    let (n, length) = (20_000, held.rod.length());
    let line = held.rod.centre_line_at(2 * n + 1);
    let moment: f64 =
        line.iter().skip(1).step_by(2).map(|p| p.x).sum::<f64>() * length / n as f64 * per_length();
    let pushed: f64 = held
        .reactions
        .iter()
        .map(|r| r.force.z * held.rod.at(r.arc_length).unwrap().0.x)
        .sum();
    pushed - moment
}

fn assert_close(value: f64, reference: f64, relative: f64, what: &str) {
    let error = value / reference - 1.0;
    assert!(
        error.abs() <= relative,
        "{what}: {value:e} against {reference:e}, relative difference {error:.1e}"
    );
}

#[test]
fn tip_of_a_heavy_rod_on_a_plane_has_the_reference_force() {
    // Rows 5.21 to 5.23 and 5.27 to 5.29.
    for (length, depth, force, x, couple) in [
        (
            0.06,
            0.006,
            0.00013200523495782268,
            0.05967261779744886,
            -5.917971640460956e-06,
        ),
        (
            0.09,
            0.03,
            0.00019180582857755577,
            0.08438822679300353,
            -1.3171035754573045e-05,
        ),
    ] {
        let held = horizontal(length, 16, Order::Eight, &floor(depth));
        assert_eq!(held.reactions.len(), 1);
        let reaction = held.reactions[0];
        assert!((reaction.arc_length - length).abs() < 1e-12 * length);
        assert_eq!(
            (reaction.initial_apex_distance, reaction.obstacle),
            (0.0, Some(0))
        );
        assert_close(reaction.normal, force, 1e-10, "force");
        assert!((reaction.force - Vector3::z() * reaction.normal).norm() < 1e-15);
        assert_close(held.rod.tip().x, x, 1e-10, "tip");
        assert_close(base_couple(&held), couple, 1e-7, "couple");
        assert_eq!(held.equilibrium.inertia.negative, 0);
    }
}

#[test]
fn touch_down_of_a_heavy_rod_has_the_reference_place_and_force() {
    // Rows 5.1 to 5.4 and 5.9 to 5.12: any length beyond the touch-down.
    for (length, depth, place, force, couple, x) in [
        (
            0.08,
            0.001,
            0.04628476120104626,
            0.00011885189829243201,
            -2.7502957110141073e-06,
            0.046269943112122354,
        ),
        (
            0.14,
            0.02,
            0.09894146512341628,
            0.0002504187286094599,
            -1.229969633610716e-05,
            0.09611904844961708,
        ),
    ] {
        let held = horizontal(length, 16, Order::Eight, &floor(depth));
        let reactions = along(&held);
        assert_close(reactions[0].arc_length, place, 1e-9, "place");
        assert_close(held.rod.at(place).unwrap().0.x, x, 1e-8, "x");
        // The plane carries the weight beyond the touch-down, and the concentrated force.
        let pushed: f64 = reactions.iter().map(|reaction| reaction.normal).sum();
        assert_close(
            pushed - per_length() * (length - place),
            force,
            1e-6,
            "force",
        );
        assert!(reactions.iter().all(|reaction| reaction.normal > 0.0));
        assert_close(base_couple(&held), couple, 1e-6, "couple");
    }
}

#[test]
fn contact_begins_and_becomes_tangential_at_the_reference_heights() {
    // Rows 5.17 and 5.18.
    let (drop, tangential) = (0.022492779622535326, 0.0028188606564112824);
    let reactions = |depth: f64| along(&horizontal(0.06, 16, Order::Eight, &floor(depth)));
    assert!(reactions(drop * (1.0 + 1e-7)).is_empty());
    let touching = reactions(drop * (1.0 - 1e-7));
    assert!(touching.len() == 1 && touching[0].normal > 0.0);
    let before = reactions(tangential * (1.0 + 1e-6));
    assert!(before.len() == 1 && before[0].arc_length > 0.06 * (1.0 - 1e-12));
    let after = reactions(tangential * (1.0 - 1e-3));
    assert!(after[0].arc_length < 0.06 * (1.0 - 1e-6), "{after:?}");
}

const POLE: Contact<Cylinder> = Contact {
    obstacle: Cylinder {
        through: Vector3::new(0.015, 0.0, 0.0),
        along: Vector3::new(0.0, 0.0, 1.0),
        radius: 0.002,
    },
    radius: 0.0005,
    friction: 0.0,
};

/// Upright rod of 5 cm length with an intrinsic curvature of 40/m towards an azimuth (rad).
fn curved(azimuth: f64) -> Rod {
    let mut rod = Rod::uniform(0.05, RADIUS, Still::upright().base, 16, Order::Eight).unwrap();
    rod.set_intrinsic(|_| Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0) * 40.0);
    rod
}

/// Smallest gap between a rod and the pole, m.
fn least_gap(rod: &Rod) -> f64 {
    let gap = |s: f64| POLE.obstacle.distance(&rod.at(s).unwrap().0, 0.0).value - POLE.radius;
    let (mut a, mut b) = (0.3 * rod.length(), rod.length());
    for _ in 0..90 {
        let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if gap(c) < gap(d) { b = d } else { a = c }
    }
    gap(0.5 * (a + b))
}

#[test]
fn rod_that_leans_against_a_pole_has_the_reference_contact() {
    // Rows 6.1 to 6.6, 6.15 to 6.20, 6.29 to 6.34, 6.43 to 6.48 and 6.57 to 6.62: degrees past
    // first touch, place, force, polar angle about the axis of the pole, tip.
    let still = Still::upright();
    type Row = (f64, f64, f64, f64, [f64; 3]);
    let heavy: [Row; 3] = [
        (
            5.0,
            0.0260361555566481,
            9.034303557008503e-05,
            -1.7282308028203655,
            [
                0.036899655237427234,
                -0.005527925128775184,
                0.014498398515899586,
            ],
        ),
        (
            40.0,
            0.027398559975188558,
            0.0006541517464815096,
            -1.6476736787312865,
            [
                0.036423153526761,
                -0.0007890101512263153,
                0.018594629938252682,
            ],
        ),
        (
            80.0,
            0.032113692298763756,
            0.0009589632000063993,
            -1.4807788099766381,
            [
                0.031367736969161474,
                0.0030682322699068705,
                0.03015604768378354,
            ],
        ),
    ];
    let light: [Row; 2] = [
        (
            10.0,
            0.028907891247852226,
            0.00015527775408219954,
            -1.7120011307444665,
            [
                0.03501107721308207,
                -0.004586480556950285,
                0.02296855363179605,
            ],
        ),
        (
            80.0,
            0.0355237475914693,
            0.0008460723703268227,
            -1.4336681666036266,
            [
                0.027948968085198346,
                0.0019470918093351002,
                0.03526010386098762,
            ],
        ),
    ];
    for (environment, rows) in [
        (still.environment(0.0), &heavy[..]),
        (weightless(), &light[..]),
    ] {
        let free = |azimuth: f64| {
            let mut rod = curved(azimuth);
            let _ = NewtonSolver::default()
                .solve(&mut rod, &YOUNG, &WEIGHT, &environment)
                .unwrap();
            rod
        };
        let (mut apart, mut touching) = (-1.0, -0.05);
        for _ in 0..45 {
            let middle = 0.5 * (apart + touching);
            if least_gap(&free(middle)) > 0.0 {
                apart = middle
            } else {
                touching = middle
            }
        }
        for &(degrees, place, force, angle, tip) in rows {
            // Without friction the contact force stays horizontal, in increments of about two
            // degrees.
            let mut rod = free(apart);
            let steps = (degrees / 2.0_f64).ceil();
            let mut held = None;
            for k in 1..=steps as usize {
                let azimuth = apart + degrees.to_radians() * k as f64 / steps;
                rod.set_intrinsic(|_| Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0) * 40.0);
                let solve = NewtonSolver::default().solve_held(
                    &mut rod,
                    &YOUNG,
                    &WEIGHT,
                    &POLE,
                    &environment,
                );
                held = Some(solve.unwrap());
            }
            let held = held.unwrap();
            assert_eq!(held.reactions.len(), 1, "{degrees}°");
            let reaction = held.reactions[0];
            assert_close(reaction.arc_length, place, 1e-6, "place");
            assert_close(reaction.normal, force, 1e-6, "force");
            let from = held.rod.at(reaction.arc_length).unwrap().0 - POLE.obstacle.through;
            assert_close(from.y.atan2(from.x), angle, 1e-6, "polar angle");
            assert!(
                (held.rod.tip() - Vector3::from(tip)).norm() < 1e-6 * 0.05,
                "{degrees}°: {}",
                held.rod.tip()
            );
        }
    }
}

#[test]
fn errors_of_place_force_and_tip_decrease_by_second_order_or_more() {
    // The touch-down is at different positions in the elements of these meshes; the largest error
    // counts.
    let (length, depth, place) = (0.14, 0.02, 0.09894146512341628);
    let exact = horizontal(length, 48, Order::Eight, &floor(depth));
    let pushed = |held: &Held| {
        held.reactions
            .iter()
            .map(|reaction| reaction.normal)
            .sum::<f64>()
    };
    for order in [Order::Four] {
        let errors = [8, 32].map(|first| {
            let mut largest = [0.0_f64; 3];
            for elements in [first, first + first / 4, first + 3 * first / 8] {
                let held = horizontal(length, elements, order, &floor(depth));
                let errors = [
                    (along(&held)[0].arc_length - place).abs() / length,
                    (pushed(&held) - pushed(&exact)).abs() / pushed(&exact),
                    (held.rod.tip() - exact.rod.tip()).norm() / length,
                ];
                largest
                    .iter_mut()
                    .zip(errors)
                    .for_each(|(largest, error)| *largest = largest.max(error));
            }
            largest
        });
        for quantity in 0..3 {
            let observed = (errors[0][quantity] / errors[1][quantity]).ln() / 4.0_f64.ln();
            assert!(
                observed > 2.0,
                "{order:?}, quantity {quantity}: order {observed} from {errors:?}"
            );
        }
    }
}

#[test]
fn energy_changes_by_the_work_of_a_rising_plane() {
    // dE/dh is the force of the plane, here with contact of the tip. The work is integrated by
    // Romberg's rule.
    let solve = |depth: f64| {
        let held = horizontal(0.06, 24, Order::Eight, &floor(depth));
        (
            held.equilibrium.energy,
            held.reactions
                .iter()
                .map(|reaction| reaction.normal)
                .sum::<f64>(),
        )
    };
    for (from, to) in [(0.02, 0.012), (0.012, 0.006)] {
        let simpson = |n: usize| {
            let height = (from - to) / n as f64;
            let force = |k: usize| solve(from - height * k as f64).1;
            let weight = |k: usize| {
                if k == 0 || k == n {
                    1.0
                } else {
                    2.0 + 2.0 * (k % 2) as f64
                }
            };
            (0..=n).map(|k| weight(k) * force(k)).sum::<f64>() * height / 3.0
        };
        let rules = [64, 128, 256].map(simpson);
        let refined = [0, 1].map(|k| rules[k + 1] + (rules[k + 1] - rules[k]) / 15.0);
        let work = refined[1] + (refined[1] - refined[0]) / 63.0;
        let change = solve(to).0 - solve(from).0;
        assert!(
            (change - work).abs() <= 1e-10 * solve(to).0.abs().max(work),
            "{change:e} against {work:e}"
        );
    }
}

#[test]
fn several_obstacles_are_touched_at_once() {
    // A ball below the middle, and a plane below the tip.
    let ball = Sphere {
        centre: Vector3::new(0.05, 0.001, -0.012),
        radius: 0.01,
    };
    let support = (
        floor(0.03),
        Contact {
            obstacle: ball,
            radius: RADIUS,
            friction: 0.0,
        },
    );
    let held = horizontal(0.12, 16, Order::Eight, &support);
    let touched: Vec<usize> = along(&held)
        .iter()
        .filter_map(|reaction| reaction.obstacle)
        .collect();
    assert!(touched.contains(&0) && touched[0] == 1, "{touched:?}");
    for reaction in &held.reactions {
        let place = held.rod.at(reaction.arc_length).unwrap().0;
        let contact = &support.contacts()[reaction.obstacle.unwrap()];
        let gap = contact.obstacle.distance(&place, 0.0);
        assert!((gap.value - contact.radius).abs() < 1e-10 * 0.12);
        assert!(
            reaction.normal >= 0.0
                && (reaction.force - gap.normal * reaction.normal).norm() < 1e-12
        );
        assert_eq!((reaction.slip, reaction.couple), (None, Vector3::zeros()));
    }
}

/// A floor that rises, m/s.
struct Lift(f64);

impl Obstacle for Lift {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        Distance {
            value: place.z + 0.02 - self.0 * time,
            normal: Vector3::z(),
            curvature: Matrix3::zeros(),
        }
    }
}

#[test]
fn moving_obstacle_of_a_user_is_taken_at_the_present_time() {
    let support = Contact {
        obstacle: Lift(1e-5),
        radius: 0.0,
        friction: 0.0,
    };
    let scene = Still::tilted(FRAC_PI_2);
    let mut rod = Rod::uniform(0.06, RADIUS, scene.base, 12, Order::Eight).unwrap();
    let mut solver = NewtonSolver::default();
    for time in [0.0, 500.0, 1000.0, 1400.0] {
        let environment: Environment = scene.environment(time);
        let held = solver
            .solve_held(&mut rod, &YOUNG, &WEIGHT, &support, &environment)
            .unwrap();
        let fixed = horizontal(0.06, 12, Order::Eight, &floor(0.02 - 1e-5 * time));
        assert!(
            (held.rod.tip() - fixed.rod.tip()).norm() < 1e-11 * 0.06,
            "{time}"
        );
        assert_close(
            held.reactions[0].normal,
            fixed.reactions[0].normal,
            1e-9,
            "force",
        );
    }
}

#[test]
fn coil_on_a_cylinder_presses_by_its_excess_of_curvature() {
    // The arc in contact has the tension T = (κ* − 1/Rc) B/Rc and the pressure T/Rc. It ends in a
    // bridge to the tip. Lengths of the bridge over Rc and tip forces over B/Rc² are those of a
    // shooting method, with twelve digits.
    let (radius, length) = (0.01, 0.045);
    let unit = bending_stiffness() / (radius * radius);
    let pole = Cylinder {
        through: Vector3::x() * radius,
        along: Vector3::y(),
        radius,
    };
    let support = Contact {
        obstacle: pole,
        radius: 0.0,
        friction: 0.0,
    };
    let mut rod = Rod::uniform(length, RADIUS, Still::upright().base, 40, Order::Eight).unwrap();
    rod.set_intrinsic(|_| Vector3::y() * (0.9 / radius));
    let _ = NewtonSolver::default()
        .solve(&mut rod, &YOUNG, &(), &weightless())
        .unwrap();
    // The tightly curved coil is unstable: it would leave its plane.
    let mut solver = NewtonSolver {
        stable_only: false,
        ..NewtonSolver::default()
    };
    for (curvature, bridge, force) in [
        (1.05, None, None),
        (1.1, Some(2.146187257254802), Some(0.11836330853241389)),
        (1.4, None, None),
        (1.7, None, None),
        (2.0, Some(2.231854946903354), Some(1.161881199687339)),
    ] {
        rod.set_intrinsic(|_| Vector3::y() * (curvature / radius));
        let held = solver
            .solve_held(&mut rod, &YOUNG, &(), &support, &weightless())
            .unwrap();
        let negative = usize::from(curvature == 2.0);
        assert_eq!(held.equilibrium.inertia.negative, negative, "{curvature}");
        let reactions = along(&held);
        let [.., end, tip] = &reactions[..] else {
            panic!("two contacts")
        };
        let (Some(bridge), Some(force)) = (bridge, force) else {
            continue;
        };
        assert_close(tip.normal / unit, force, 1e-6, "tip force");
        assert_close((length - end.arc_length) / radius, bridge, 1e-6, "bridge");
        // Without load, the force at the base is the sum of the reactions. The tangent there is e3.
        let tension = held
            .reactions
            .iter()
            .map(|reaction| reaction.force.z)
            .sum::<f64>();
        assert_close(tension / unit, curvature - 1.0, 1e-6, "tension");
    }
}
