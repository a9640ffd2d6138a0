//! Touch: force per length at contacts, differential growth in closed form, threshold, sign,
//! symmetry and saved states.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    HOUR, MEMORY, RADIUS, WEIGHT, YOUNG, reduced, rod, steering, tissue,
};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::checkpoint::{from_bytes, to_bytes};
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::Linearisation;
use morphorod::support::{Contact, Cylinder, HalfSpace, Hold, Obstacle};
use morphorod::tropism::{
    AtApex, DirectionalTropism, Oscillator, Perception, Response, SettledStatoliths, Thigmotropism,
    Touch, TropismLaw,
};
use morphorod::{DynLaws, Shoot, State, Still, check};
use nalgebra::{UnitQuaternion, Vector3};

const LENGTH: f64 = 0.05;
/// Growth time, s.
const GROWTH_TIME: f64 = 20.0 * HOUR;
/// Bending stiffness B, N m².
const BENDING: f64 = 1e7 * PI / 4.0 * RADIUS * RADIUS * RADIUS * RADIUS;
/// Intrinsic curvature of the propped shoot, 1/m, which causes angles of 3e-4 rad.
const CURVATURE: f64 = 0.02;
/// Distance that the apex of the propped shoot moves before it touches the wall, m: a fifth of its
/// free deflection.
const GAP: f64 = 0.1 * CURVATURE * LENGTH * LENGTH;
/// A width of four elements, and forces per length of the order of that at the apex of the propped
/// shoot, 2.9e-5 N/m.
const TOUCH: Touch = Touch {
    width: 0.02,
    threshold: 2e-6,
    saturation: 2e-5,
};

/// A shoot in contact with an obstacle without friction.
fn contact<O: Obstacle>(obstacle: O) -> Contact<O> {
    Contact {
        obstacle,
        radius: RADIUS,
        friction: 0.0,
    }
}

/// A weightless upright shoot of constant length whose intrinsic curvature presses its apex on a
/// wall in a horizontal direction.
fn propped_on(side: Vector3<f64>, law: impl TropismLaw + Send + Sync + 'static) -> Shoot<DynLaws> {
    let wall = HalfSpace {
        through: side * (GAP + RADIUS),
        normal: -side,
    };
    let mut shoot = reduced(LENGTH, GROWTH_TIME)
        .elements(10)
        .tropism(law)
        .load(())
        .scene(Still::weightless())
        .support(contact(wall))
        .into_dyn()
        .build()
        .unwrap();
    shoot.set_intrinsic(|_| Vector3::z().cross(&side) * CURVATURE);
    shoot
}

/// The shoot with a wall at the side of e1.
fn propped(law: impl TropismLaw + Send + Sync + 'static) -> Shoot<DynLaws> {
    propped_on(Vector3::x(), law)
}

fn run(step: f64) -> MethodOfSteps {
    MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-12))
}

fn thigmotropism(sensitivity: f64) -> impl TropismLaw + Clone {
    Thigmotropism {
        sensitivity,
        perception: TOUCH,
    }
    .remembered(MEMORY)
}

/// A growing shoot whose oscillator presses it on a vertical pole.
fn swinging(
    law: impl TropismLaw + Send + Sync + 'static,
    turn: UnitQuaternion<f64>,
    friction: f64,
) -> Shoot<DynLaws> {
    let obstacle = Cylinder {
        through: turn * Vector3::x() * 0.02,
        along: turn * Vector3::z(),
        radius: 2e-3,
    };
    let still = Still::upright();
    rod(tissue(1e8), 0.06)
        .growth(UniformGrowth {
            zone_length: 0.05,
            time: 40.0 * HOUR,
        })
        .tropism((Oscillator::new(1.0, 2.0 * HOUR), law))
        .load(WEIGHT)
        .scene(Still {
            base: turn * still.base,
            gravity: turn * still.gravity,
        })
        .support(Contact {
            friction,
            ..contact(obstacle)
        })
        .into_dyn()
        .build()
        .unwrap()
}

/// A law for the forces of [`swinging`] shoots.
fn winds(sensitivity: f64) -> impl TropismLaw + Clone {
    let perception = Touch {
        width: 0.01,
        threshold: 1e-3,
        saturation: 2e-2,
    };
    Thigmotropism {
        sensitivity,
        perception,
    }
    .remembered(MEMORY)
}

/// A heavy rod that hangs from a horizontal clamp above a table.
fn on_table(length: f64, height: f64) -> Shoot<DynLaws> {
    let table = HalfSpace {
        through: Vector3::z() * (-height - RADIUS),
        normal: Vector3::z(),
    };
    let builder = rod(YOUNG, length).elements(30).load(WEIGHT);
    let mut shoot = builder
        .scene(Still::tilted(FRAC_PI_2))
        .support(contact(table))
        .into_dyn()
        .build()
        .unwrap();
    run(60.0).advance(&mut shoot, 0.0).unwrap();
    shoot
}

#[test]
fn force_per_length_integrates_to_the_forces() {
    let mut leaning = swinging((), UnitQuaternion::identity(), 0.3);
    run(120.0).advance(&mut leaning, 1.5 * HOUR).unwrap();
    let mut propped = propped(());
    run(60.0).advance(&mut propped, 0.0).unwrap();
    for shoot in [leaning, on_table(0.09, 4e-3), propped] {
        let (rod, length) = (shoot.rod(), shoot.rod().length());
        assert!(!shoot.reactions().is_empty());
        let sum: Vector3<f64> = shoot.reactions().iter().map(|at| at.force).sum();
        // The trapezoidal rule for three continuous derivatives has an error of (h/w)⁵ = 1e-14 or
        // less. The last width is larger than half of the shoot, so that its kernel is reflected at
        // both ends.
        for width in [3e-3, 1e-2, 0.7 * length, 2.0 * length] {
            let (touch, n) = (Touch { width, ..TOUCH }, 20_000);
            let at = |i: u32| touch.force_per_length(rod, length * f64::from(i) / f64::from(n));
            let inside: Vector3<f64> = (1..n).map(at).sum();
            let integral = (inside + 0.5 * (at(0) + at(n))) * (length / f64::from(n));
            assert_abs_diff_eq!(InNorm(integral), InNorm(sum), epsilon = 1e-12 * sum.norm());
        }
    }
}

#[test]
fn force_per_length_of_a_rod_on_a_table_is_its_weight() {
    let shoot = on_table(0.09, 4e-3);
    let (rod, length, touch) = (
        shoot.rod(),
        shoot.rod().length(),
        Touch {
            width: 0.01,
            ..TOUCH
        },
    );
    let first = shoot
        .reactions()
        .iter()
        .map(|at| at.arc_length)
        .fold(f64::INFINITY, f64::min);
    let weight = Vector3::z() * (WEIGHT.density * 9.81 * PI * RADIUS * RADIUS);
    println!(
        "lift-off at {first} m of {length} m, {} reactions",
        shoot.reactions().len()
    );
    // The pressure at the stations of a contact is that of elements of 3 mm.
    let mut largest = 0.0_f64;
    for i in 0..=100 {
        let s = first + 0.015 + (length - first - 0.015) * f64::from(i) / 100.0;
        largest = largest.max((touch.force_per_length(rod, s) - weight).norm() / weight.norm());
    }
    println!("largest relative error {largest:e}");
    // This includes the apex, where the kernel is reflected.
    assert!(largest < 1e-4, "{largest:e}");
    assert_eq!(
        touch.force_per_length(rod, first - 0.0101),
        Vector3::zeros()
    );
}

/// The kernel of [`Touch`] for a force at the apex, at a distance from it (m), 1/m.
fn at_apex(distance: f64) -> f64 {
    let x = distance / TOUCH.width;
    if x < 1.0 {
        2.0 * 315.0 / 256.0 / TOUCH.width * (1.0 - x * x).powi(4)
    } else {
        0.0
    }
}

#[test]
fn differential_growth_at_a_contact_has_its_closed_form() {
    // The sensitivity is so small that the shape does not change.
    let (sensitivity, t) = (1e-9, 2.0 * HOUR);
    let gained = |perception: Box<dyn Perception<Signal = [f64; 2]> + Send + Sync>| {
        let mut shoot = propped(
            DirectionalTropism {
                sensitivity,
                perception,
            }
            .remembered(MEMORY),
        );
        run(30.0).advance(&mut shoot, t).unwrap();
        shoot
    };
    let since = t - MEMORY.delay;
    let memory = since + MEMORY.time * (-since / MEMORY.time).exp_m1();
    let full = sensitivity / (RADIUS * GROWTH_TIME) * memory;
    for (shoot, apex) in [
        (gained(Box::new(TOUCH)), false),
        (gained(Box::new(AtApex(TOUCH))), true),
    ] {
        let [reaction] = shoot.reactions() else {
            panic!("{:?}", shoot.reactions())
        };
        // Force of a propped beam. Equilibria with the apex on a wall have errors of 1e-9 m, and
        // the gap is 5e-6 m.
        let force = 3.0 * BENDING / LENGTH.powi(3) * (0.5 * CURVATURE * LENGTH * LENGTH - GAP);
        assert_relative_eq!(reaction.normal, force, epsilon = 0.0, max_relative = 1e-3);
        let (mut zero, mut between, mut one) = (0, 0, 0);
        for point in shoot.rod().points() {
            let distance = if apex {
                0.0
            } else {
                point.initial_apex_distance
            };
            let density = reaction.normal * at_apex(distance);
            let x = ((density - TOUCH.threshold) / (TOUCH.saturation - TOUCH.threshold))
                .clamp(0.0, 1.0);
            let strength = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
            let growth = point.intrinsic - Vector3::y() * CURVATURE;
            // Rounding of the curvature 0.02 after 240 steps. Cubics in steps of 1/24 of the memory
            // time have an error of (1/24)⁴/384 = 1e-8, and the angles one of 1e-7.
            let epsilon = 1e-6 * full + 1e-16;
            assert_abs_diff_eq!(
                InNorm(growth),
                InNorm(Vector3::y() * (strength * full)),
                epsilon = epsilon
            );
            (zero, between, one) = match strength {
                0.0 => (zero + 1, between, one),
                1.0 => (zero, between, one + 1),
                _ => (zero, between + 1, one),
            };
        }
        println!("{zero} points below the threshold, {between} between, {one} saturated");
        assert!(one > 0 && (apex || zero > 0 && between > 0));
    }
}

#[test]
fn forces_below_the_threshold_have_no_effect() {
    let touch = Touch {
        threshold: 4e-5,
        saturation: 8e-5,
        ..TOUCH
    };
    let [mut with, mut without] = [0.3, 0.0].map(|sensitivity| {
        propped(
            Thigmotropism {
                sensitivity,
                perception: touch,
            }
            .remembered(MEMORY),
        )
    });
    for shoot in [&mut with, &mut without] {
        run(120.0).advance(shoot, 2.0 * HOUR).unwrap();
    }
    let density = with.reactions()[0].normal * at_apex(0.0);
    assert!(
        density > 0.5 * touch.threshold && density < touch.threshold,
        "{density}"
    );
    assert_eq!(with.rod(), without.rod());
    assert_eq!(
        [0.0, 4e-5, 8e-5, 1.0].map(|force| touch.strength(force)),
        [0.0, 0.0, 1.0, 1.0]
    );
    assert_relative_eq!(touch.strength(6e-5), 0.5, epsilon = 1e-12);
}

#[test]
fn positive_sensitivity_presses_the_shoot_on_the_obstacle_and_negative_one_relieves_it() {
    let forces = [-1e-4, 0.0, 1e-4].map(|sensitivity| {
        let mut shoot = propped(thigmotropism(sensitivity));
        run(120.0).advance(&mut shoot, 2.0 * HOUR).unwrap();
        shoot.reactions().iter().map(|at| at.normal).sum::<f64>()
    });
    assert!(
        forces[0] < 0.99 * forces[1] && forces[2] > 1.01 * forces[1],
        "{forces:?}"
    );
    // The same on another side of the shoot.
    let mut shoot = propped_on(Vector3::new(0.6, -0.8, 0.0), thigmotropism(1e-4));
    run(120.0).advance(&mut shoot, 2.0 * HOUR).unwrap();
    assert_relative_eq!(
        shoot.reactions()[0].normal,
        forces[2],
        epsilon = 0.0,
        max_relative = 1e-3
    );
}

#[test]
fn touch_turns_with_the_scene() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.7, -1.9, 0.4));
    let [upright, turned] = [UnitQuaternion::identity(), turn].map(|turn| {
        let mut shoot = swinging(winds(0.5), turn, 0.0);
        run(120.0).advance(&mut shoot, 1.5 * HOUR).unwrap();
        assert!(!shoot.reactions().is_empty());
        shoot
    });
    let mut without = swinging((), UnitQuaternion::identity(), 0.0);
    run(120.0).advance(&mut without, 1.5 * HOUR).unwrap();
    let moved = (upright.tip() - without.tip()).norm();
    assert!(moved > 1e-4, "{moved}");
    // The times at which contacts begin have rounding errors, which equilibria of 1e-12 magnify.
    assert_abs_diff_eq!(
        InNorm(turn * upright.tip()),
        InNorm(turned.tip()),
        epsilon = 1e-8
    );
}

#[test]
fn resumed_runs_with_touch_return_the_same_bytes() {
    let build = || swinging(winds(0.5), UnitQuaternion::identity(), 0.0);
    let mut whole = build();
    MethodOfSteps::new(120.0)
        .advance(&mut whole, 1.5 * HOUR)
        .unwrap();
    let mut stepped = build();
    while stepped.time() < 1.5 * HOUR {
        let state: State = from_bytes(&to_bytes(stepped.state()).unwrap()).unwrap();
        stepped = build();
        stepped.restore(&state).unwrap();
        let _ = MethodOfSteps::new(120.0)
            .step(&mut stepped, 1.5 * HOUR)
            .unwrap();
    }
    assert!(!stepped.reactions().is_empty());
    assert!(to_bytes(stepped.state()).unwrap() == to_bytes(whole.state()).unwrap());
}

#[test]
fn methods_of_the_law_agree_in_contact() {
    let law = (
        winds(0.5),
        Thigmotropism {
            sensitivity: 0.1,
            perception: AtApex(TOUCH),
        }
        .remembered(MEMORY),
    );
    let mut shoot = swinging(law, UnitQuaternion::identity(), 0.3);
    run(120.0).advance(&mut shoot, 1.5 * HOUR).unwrap();
    assert!(!shoot.reactions().is_empty());
    shoot.check_laws().unwrap();
    let site =
        morphorod::tropism::Site::new(shoot.environment(), UnitQuaternion::identity(), shoot.rod());
    check::perception(&TOUCH, &[site]).unwrap();
}

#[test]
fn holds_are_not_sensed_and_a_law_without_contact_does_not_change_stability() {
    let steering = steering(SettledStatoliths);
    let wall = || {
        contact(HalfSpace {
            through: Vector3::x() * 0.02,
            normal: -Vector3::x(),
        })
    };
    let guide = || Hold::place(0.02).on_plane(Vector3::zeros(), Vector3::x_axis());
    let build = |law: Box<dyn TropismLaw + Send + Sync>, tilt: f64| {
        reduced(LENGTH, GROWTH_TIME)
            .elements(8)
            .tropism((steering, law))
            .scene(Still::tilted(tilt))
            .support((guide(), wall()))
            .into_dyn()
            .build()
            .unwrap()
    };
    let root = |law| {
        Linearisation::about(&build(law, 0.0))
            .unwrap()
            .rightmost()
            .unwrap()
            .value
    };
    let (with, without) = (root(Box::new(thigmotropism(0.5))), root(Box::new(())));
    // The law adds stable roots and no coupling. Responses are differences, with a relative error
    // of 1e-9.
    assert_abs_diff_eq!(
        (with - without).norm(),
        0.0,
        epsilon = 1e-9 * without.norm()
    );
    let mut held = build(Box::new(thigmotropism(0.5)), 0.3);
    run(60.0).advance(&mut held, 0.0).unwrap();
    let [hold] = held.reactions() else {
        panic!("{:?}", held.reactions())
    };
    assert!(hold.force.norm() > 0.0);
    assert_eq!(
        TOUCH.force_per_length(held.rod(), hold.arc_length),
        Vector3::zeros()
    );
}

#[test]
fn parameters_of_touch_out_of_range_are_refused() {
    let refused = |touch: Touch| {
        let law = Thigmotropism {
            sensitivity: 0.5,
            perception: touch,
        }
        .remembered(MEMORY);
        TropismLaw::check(&law).unwrap_err().name
    };
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(refused(Touch { width, ..TOUCH }), "sensing width of touch");
    }
    assert_eq!(
        refused(Touch {
            threshold: -1.0,
            ..TOUCH
        }),
        "threshold of touch"
    );
    for saturation in [TOUCH.threshold, f64::NAN, f64::INFINITY] {
        assert_eq!(
            refused(Touch {
                saturation,
                ..TOUCH
            }),
            "saturation of touch"
        );
    }
}
