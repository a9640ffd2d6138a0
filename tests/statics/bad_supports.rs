//! Invalid supports: each is an error that names the cause, and leaves the rod unchanged.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::held::Held;
use crate::fixtures::messages::in_words;
use crate::fixtures::rods::tight;
use crate::fixtures::shoots::{RADIUS, WEIGHT};
use morphorod::Scene;
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::EquilibriumSolver;
use morphorod::load::{Load, Weight};
use morphorod::support::{
    Contact, Cylinder, Distance, HalfSpace, Hold, Joint, Moving, Obstacle, Sphere, Support,
};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

fn horizontal() -> Held<Weight> {
    Held::straight(LENGTH, FRAC_PI_2, 8, WEIGHT)
}

/// Fails unless a support is refused at a time (s) by an error that contains all words, and the rod
/// does not change.
fn refused(support: &dyn Support, time: f64, words: &[&str]) {
    let mut held = horizontal();
    held.hold(&());
    held.time = time;
    let kept = held.rod.clone();
    let error = held.try_hold(support).expect_err(words[0]).to_string();
    assert!(
        words.iter().all(|word| error.contains(word)),
        "{error} instead of {words:?}"
    );
    assert_eq!(held.rod, kept, "{words:?}");
}

#[test]
fn holds_beyond_the_reach_of_the_rod_between_them_are_refused() {
    let between = ["distance between two holds", "at 0.05 m"];
    let at = |share: f64| Vector3::x() * (share * LENGTH);
    let (middle, apex) = (Hold::place(0.5 * LENGTH), Hold::apex());
    // Each place is within reach of the base.
    refused(&(middle.at(at(0.1)), apex.at(at(0.7))), 0.0, &between);
    refused(
        &(
            middle.at(at(0.1)),
            apex.on_plane(at(0.7), Vector3::x_axis()),
        ),
        0.0,
        &between,
    );
    refused(
        &(
            middle.on_line(at(0.45), Vector3::z_axis()),
            apex.at(at(-0.1)),
        ),
        0.0,
        &between,
    );
    // A ring whose middle is held farther away than half of its length does not close.
    refused(
        &(
            Hold::place(0.625 * LENGTH).at(at(0.3)),
            Hold::place(0.25 * LENGTH).at(at(-0.2)),
        ),
        0.0,
        &["two holds"],
    );
    refused(
        &(middle.at(at(0.6)), apex.at(at(0.0))),
        0.0,
        &["distance of a hold from the base", "at 0.025 m"],
    );
    // Almost taut parts are permitted. A part at its full length has no equilibrium under its
    // weight.
    horizontal().hold(&(
        middle.at(at(0.499)),
        apex.on_plane(Vector3::zeros(), Vector3::z_axis()),
    ));
}

#[test]
fn hold_that_becomes_invalid_in_time_is_refused() {
    let place = Moving(|t: f64| Hold::apex().at(Vector3::x() * (0.9 * LENGTH / (1.0 - t))));
    refused(&place, 1.0, &["held position", "at 0.05 m"]);
    let frame = Moving(|t: f64| {
        let frame =
            UnitQuaternion::new_unchecked(UnitQuaternion::identity().into_inner() * (1.0 + t));
        Hold::apex().held(frame)
    });
    refused(
        &frame,
        1.0,
        &["norm of the quaternion of a held frame", "at 0.05 m"],
    );
}

/// An obstacle with a distance that is given as a function of the place and time, and a velocity.
struct Of<F>(F, Vector3<f64>);

impl<F: Fn(&Vector3<f64>, f64) -> Distance> Obstacle for Of<F> {
    fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
        (self.0)(place, time)
    }

    fn velocity(&self, _place: &Vector3<f64>, _time: f64) -> Vector3<f64> {
        self.1
    }
}

/// A contact without the size of the shoot.
fn contact<O>(obstacle: O, friction: f64) -> Contact<O> {
    Contact {
        obstacle,
        radius: 0.0,
        friction,
    }
}

#[test]
fn obstacle_that_contains_the_base_is_refused_at_any_time() {
    let ball = Sphere {
        centre: Vector3::z() * -0.01,
        radius: 0.02,
    };
    refused(
        &contact(ball, 0.0),
        0.0,
        &["distance of the base from an obstacle"],
    );
    let thick = Contact {
        obstacle: Sphere {
            radius: 0.008,
            ..ball
        },
        radius: 0.003,
        friction: 0.0,
    };
    refused(
        &thick,
        0.0,
        &["distance of the base from an obstacle", "is -0.001"],
    );
    // A floor that rises above the base.
    let floor = |place: &Vector3<f64>, t: f64| Distance {
        value: place.z + 0.01 * (1.0 - t),
        normal: Vector3::z(),
        curvature: Matrix3::zeros(),
    };
    refused(
        &contact(Of(floor, Vector3::zeros()), 0.0),
        2.0,
        &["distance of the base from an obstacle", "is -0.01"],
    );
}

#[test]
fn base_that_touches_an_obstacle_up_to_rounding_is_permitted() {
    // The gap of the base to a pole along the rod and above it is −4e-19 m, by rounding.
    let pole = Cylinder {
        through: Vector3::z() * 0.0055,
        along: Vector3::x(),
        radius: 0.005,
    };
    let touching = Contact {
        obstacle: pole,
        radius: 0.0005,
        friction: 0.0,
    };
    assert!(pole.distance(&Vector3::zeros(), 0.0).value < touching.radius);
    let mut held = horizontal();
    held.hold(&touching);
    assert!(held.reactions.is_empty());
}

#[test]
fn friction_radius_and_compliance_out_of_range_are_refused() {
    let floor = HalfSpace {
        through: -Vector3::z() * 0.005,
        normal: Vector3::z(),
    };
    for value in [-0.1, f64::NAN, f64::INFINITY] {
        refused(
            &contact(floor, value),
            0.0,
            &[
                "coefficient of friction",
                &format!("is {}", in_words(value)),
            ],
        );
        let radius = Contact {
            obstacle: floor,
            radius: value,
            friction: 0.0,
        };
        refused(&radius, 0.0, &["radius of a shoot in contact"]);
    }
    /// A floor with a compliance.
    struct Soft(HalfSpace, Matrix3<f64>);
    impl Obstacle for Soft {
        fn distance(&self, place: &Vector3<f64>, time: f64) -> Distance {
            self.0.distance(place, time)
        }
        fn compliance(&self) -> Matrix3<f64> {
            self.1
        }
    }
    let skew = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    for (compliance, name) in [
        (Matrix3::identity() * f64::NAN, "compliance of an obstacle"),
        (skew, "asymmetry of the compliance"),
        (-Matrix3::identity(), "least compliance"),
    ] {
        refused(&contact(Soft(floor, compliance), 0.0), 0.0, &[name]);
    }
}

#[test]
fn functions_that_are_no_signed_distance_are_refused() {
    let floor = HalfSpace {
        through: -Vector3::z() * 0.005,
        normal: Vector3::z(),
    };
    let ball = Sphere {
        centre: Vector3::new(0.035, 0.0, -0.013),
        radius: 0.01,
    };
    let no_velocity = Vector3::zeros();
    let double = |at: &Vector3<f64>, t: f64| Distance {
        value: 2.0 * floor.distance(at, t).value,
        ..floor.distance(at, t)
    };
    refused(
        &contact(Of(double, no_velocity), 0.0),
        0.0,
        &["derivative of the distance", "m from the base"],
    );
    let long = |at: &Vector3<f64>, t: f64| Distance {
        normal: Vector3::z() * 2.0,
        ..floor.distance(at, t)
    };
    refused(
        &contact(Of(long, no_velocity), 0.0),
        0.0,
        &["norm of the gradient", "m from the base"],
    );
    let nan = |at: &Vector3<f64>, t: f64| {
        let value = if at.x > 0.03 {
            f64::NAN
        } else {
            floor.distance(at, t).value
        };
        Distance {
            value,
            ..floor.distance(at, t)
        }
    };
    refused(
        &contact(Of(nan, no_velocity), 0.0),
        0.0,
        &["distance from an obstacle", "m from the base"],
    );
    let flat = |at: &Vector3<f64>, t: f64| Distance {
        curvature: Matrix3::zeros(),
        ..ball.distance(at, t)
    };
    refused(
        &contact(Of(flat, no_velocity), 0.0),
        0.0,
        &["curvature of an obstacle", "m from the base"],
    );
    let sound = |at: &Vector3<f64>, t: f64| ball.distance(at, t);
    refused(
        &contact(Of(sound, Vector3::x() * f64::NAN), 0.3),
        0.0,
        &["velocity of an obstacle", "m from the base"],
    );
    horizontal().hold(&contact(Of(sound, no_velocity), 0.0));
}

#[test]
fn obstacle_without_surfaces_is_refused() {
    struct Absent;
    impl Obstacle for Absent {
        fn distance(&self, place: &Vector3<f64>, _time: f64) -> Distance {
            Distance {
                value: place.z + 1.0,
                normal: Vector3::z(),
                curvature: Matrix3::zeros(),
            }
        }
        fn surfaces(&self) -> usize {
            0
        }
    }
    refused(
        &contact(Absent, 0.0),
        0.0,
        &["number of surfaces of an obstacle is 0 but must be at least 1"],
    );
}

#[test]
fn start_inside_an_obstacle_is_projected_out() {
    // The straight rod is inside the wedge of a plane, through a pole, and inside a ball beyond its
    // middle.
    let slope = HalfSpace {
        through: -Vector3::z() * 0.002,
        normal: Vector3::new(-0.3, 0.0, 1.0),
    };
    let pole = Cylinder {
        through: Vector3::new(0.03, 0.0, 0.0005),
        along: Vector3::y(),
        radius: 0.002,
    };
    let ball = Sphere {
        centre: Vector3::new(0.04, 0.002, 0.001),
        radius: 0.006,
    };
    let obstacles: [&dyn Obstacle; 3] = [&slope, &pole, &ball];
    for obstacle in obstacles {
        let mut held = horizontal();
        let place = |held: &Held<Weight>, i: i32| held.place(f64::from(i) / 200.0);
        let least = |held: &Held<Weight>| {
            (0..=200)
                .map(|i| obstacle.distance(&place(held, i), 0.0).value)
                .fold(f64::INFINITY, f64::min)
        };
        assert!(least(&held) < -0.001);
        match held.try_hold(&contact(obstacle, 0.0)) {
            Ok(()) => {
                // The elements interpolate the shape, whose third derivative is discontinuous at
                // the contact.
                assert!(least(&held) > -1e-5 * LENGTH, "{:e}", least(&held));
                assert!(held.reactions.iter().all(|at| at.normal >= 0.0));
                println!("{:?}", held.reactions);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn supports_at_a_clamped_base_name_the_joint_that_they_require() {
    let base = Hold::place(LENGTH);
    let word = ["requires `Joint::Free`"];
    refused(&base.at(Vector3::x() * 0.01), 0.0, &word);
    refused(
        &base.elastic_joint(UnitQuaternion::identity(), 1e-6),
        0.0,
        &word,
    );
    // A floor through the base: the centre line keeps the radius of the contact from its surface.
    let floor = Contact {
        obstacle: HalfSpace {
            through: Vector3::zeros(),
            normal: Vector3::z(),
        },
        radius: 5e-4,
        friction: 0.0,
    };
    refused(
        &floor,
        0.0,
        &["is -0.0005", "minus the radius of the contact"],
    );
}

#[test]
fn shape_through_an_obstacle_is_named() {
    // The rod pierces the axis of a pole, so that no side is nearer.
    let pole = Cylinder {
        through: Vector3::x() * 0.02,
        along: Vector3::z(),
        radius: 1e-3,
    };
    refused(
        &Contact {
            obstacle: pole,
            radius: 5e-4,
            friction: 0.0,
        },
        0.0,
        &[
            "perhaps since the search began inside the obstacle, or since a hold is too far around it; shorter steps",
        ],
    );
}

/// The workspace of a solver has no joints after an error, with which a free rod would have a base
/// that rotates.
#[test]
fn solver_forgets_a_support_that_is_refused() {
    let held = horizontal();
    let (law, load): (&dyn Constitutive, &dyn Load) = (&held.law, &held.load);
    let environment = held.scene.environment(0.0);
    let between = Hold::place(0.37 * LENGTH).at(Vector3::zeros());
    let support: &dyn Support = &(
        Joint::Ball,
        Hold::apex().elastic_joint(UnitQuaternion::identity(), 1e-6),
        between,
    );
    let (mut solver, mut first, mut second) = (tight(), held.rod.clone(), held.rod.clone());
    let refused = solver
        .inertia_held(&held.rod, &law, &load, &support, &environment, &[])
        .unwrap_err();
    assert!(
        refused.to_string().contains("distance of a held place"),
        "{refused}"
    );
    let _ = solver.solve(&mut first, &law, &load, &environment).unwrap();
    let _ = tight()
        .solve(&mut second, &law, &load, &environment)
        .unwrap();
    assert_eq!(first, second);
}

#[test]
fn inertia_with_the_reaction_of_an_obstacle_is_refused() {
    let mut held = horizontal();
    let through = Vector3::z() * -0.01 * LENGTH;
    let floor = contact(
        HalfSpace {
            through,
            normal: Vector3::z(),
        },
        0.0,
    );
    held.hold(&floor);
    assert!(!held.reactions.is_empty());
    let (law, load, support): (&dyn Constitutive, &dyn Load, &dyn Support) =
        (&held.law, &held.load, &floor);
    let environment = held.scene.environment(0.0);
    let answer = tight().inertia_held(
        &held.rod,
        &law,
        &load,
        &support,
        &environment,
        &held.reactions,
    );
    let error = answer.unwrap_err().to_string();
    assert!(
        error.contains("number of reactions of obstacles"),
        "{error}"
    );
}

/// Inside of a tube about e1. Its axis has no normal.
fn tube(radius: f64) -> impl Obstacle {
    let distance = move |place: &Vector3<f64>, _: f64| {
        let across = Vector3::new(0.0, place.y, place.z);
        let away = across.norm();
        let normal = if away > 0.0 {
            -across / away
        } else {
            Vector3::zeros()
        };
        let round =
            Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0)) - normal * normal.transpose();
        let curvature = if away > 0.0 {
            round / -away
        } else {
            Matrix3::zeros()
        };
        Distance {
            value: radius - away,
            normal,
            curvature,
        }
    };
    Of(distance, Vector3::zeros())
}

#[test]
fn rod_on_the_axis_of_a_tube_sags_as_on_the_plane_below_it() {
    // The rod bends in the vertical plane through the axis, where the tube is the plane.
    let radius = 0.1 * LENGTH;
    let plane = HalfSpace {
        through: Vector3::z() * -radius,
        normal: Vector3::z(),
    };
    let (mut inside, mut above) = (horizontal(), horizontal());
    inside.hold(&contact(tube(radius), 0.0));
    above.hold(&contact(plane, 0.0));
    assert!(!above.reactions.is_empty());
    // Both rods satisfy the same equations, and the solver has a tolerance of 1e-14 rad.
    let apart = (inside.rod.tip() - above.rod.tip()).norm();
    assert!(apart < 1e-11 * LENGTH, "{apart:e}");
    let sum = |held: &Held<Weight>| held.reactions.iter().map(|at| at.force.z).sum::<f64>();
    let forces = [sum(&inside), sum(&above)];
    assert!((forces[0] / forces[1] - 1.0).abs() < 1e-9, "{forces:?}");
}

#[test]
fn forces_between_two_walls_without_clearance_are_undetermined() {
    let bent = |clearance: f64| {
        let wall = |side: f64| {
            let through = Vector3::z() * (side * (RADIUS + 0.5 * clearance));
            let normal = Vector3::z() * -side;
            Contact {
                obstacle: HalfSpace { through, normal },
                radius: RADIUS,
                friction: 0.0,
            }
        };
        let mut held = horizontal();
        held.rod.set_intrinsic(|_| Vector3::y() * (0.3 / LENGTH));
        (held, (wall(-1.0), wall(1.0)))
    };
    let (mut held, walls) = bent(0.0);
    held.assert_refused(&walls, "clearance of the shoot between two obstacles");
    let (mut held, walls) = bent(1e-3 * RADIUS);
    held.hold(&walls);
}
