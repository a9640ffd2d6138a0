//! Springs and elastic joints with a potential of the user: closed forms, balance, stability and
//! errors.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::held::{Held, about, assert_close, bisect};
use crate::fixtures::rods::{DENSITY, MODULUS, bending_stiffness};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::Timoshenko;
use morphorod::load::Weight;
use morphorod::support::{Argument, Elastic, Energy, Hold, Joint, Potential, Support};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Length, m.
const LENGTH: f64 = 0.05;

/// A potential that is given as a function.
struct Of<F>(F);

impl<F: Fn(&Vector3<f64>) -> Energy> Potential for Of<F> {
    fn energy(&self, x: &Vector3<f64>, _time: f64) -> Energy {
        (self.0)(x)
    }
}

/// A spring between the apex and the surroundings.
fn spring(energy: impl Fn(&Vector3<f64>) -> Energy) -> impl Support {
    Elastic {
        initial_apex_distance: 0.0,
        argument: Argument::Position,
        potential: Of(energy),
    }
}

/// An elastic joint at a distance from the apex (m), without couple in a given frame.
fn joint(
    distance: f64,
    frame: UnitQuaternion<f64>,
    energy: impl Fn(&Vector3<f64>) -> Energy,
) -> impl Support {
    Elastic {
        initial_apex_distance: distance,
        argument: Argument::Rotation { frame },
        potential: Of(energy),
    }
}

/// The potential U(|x − x₀|), given U with its first two derivatives by the distance.
fn radial(x: &Vector3<f64>, from: &Vector3<f64>, law: impl Fn(f64) -> [f64; 3]) -> Energy {
    let (away, [value, slope, bend]) = (x - from, law((x - from).norm()));
    let along = away.normalize();
    let (parallel, over) = (along * along.transpose(), slope / away.norm());
    Energy {
        value,
        gradient: along * slope,
        stiffness: parallel * bend + (Matrix3::identity() - parallel) * over,
    }
}

/// The potential ½ x · K x − f · x.
fn quadratic(x: &Vector3<f64>, stiffness: &Matrix3<f64>, force: &Vector3<f64>) -> Energy {
    let gradient = stiffness * x - force;
    Energy {
        value: 0.5 * x.dot(&(gradient - force)),
        gradient,
        stiffness: *stiffness,
    }
}

fn horizontal(elements: usize) -> Held<Weight> {
    Held::straight(LENGTH, FRAC_PI_2, elements, WEIGHT)
}

/// Stiffness E I/ℓ³ of the rod, N/m.
fn unit() -> f64 {
    bending_stiffness() / LENGTH.powi(3)
}

#[test]
fn quadratic_potentials_are_linear_springs_and_joints() {
    let stiffness = Matrix3::new(3.0, 1.0, 0.0, 1.0, 5.0, 0.5, 0.0, 0.5, 0.0) * unit();
    let stiffness = stiffness + Matrix3::identity() * unit();
    let anchor = Vector3::new(0.9, 0.1, 0.05) * LENGTH;
    let (mut linear, mut own) = (horizontal(8), horizontal(8));
    linear.hold(&Hold::apex().spring(anchor, stiffness));
    own.hold(&spring(|x: &Vector3<f64>| {
        quadratic(&(x - anchor), &stiffness, &Vector3::zeros())
    }));
    let turn = about(Vector3::x_axis(), 0.7) * own.scene.base;
    let couple = 2.0 * bending_stiffness() / LENGTH;
    let (mut jointed, mut other) = (horizontal(8), horizontal(8));
    jointed.hold(&Hold::apex().elastic_joint(turn, couple));
    let soft = Matrix3::identity() * couple;
    other.hold(&joint(0.0, turn, |x: &Vector3<f64>| {
        quadratic(x, &soft, &Vector3::zeros())
    }));
    for (a, b) in [(linear, own), (jointed, other)] {
        // The frames have errors of 1e-14 rad, in searches that differ by rounding.
        assert_abs_diff_eq!(
            (a.rod.tip() - b.rod.tip()).norm(),
            0.0,
            epsilon = 1e-13 * LENGTH
        );
        assert_relative_eq!(
            a.found.energy,
            b.found.energy,
            epsilon = 0.0,
            max_relative = 1e-11
        );
        let (force, turning) = (
            a.reactions[0].force - b.reactions[0].force,
            a.reaction().1 - b.reaction().1,
        );
        assert_abs_diff_eq!(force.norm(), 0.0, epsilon = 1e-11 * unit() * LENGTH);
        assert_abs_diff_eq!(turning.norm(), 0.0, epsilon = 1e-11 * couple);
        assert_eq!((a.signs(), b.signs()), ((0, 0), (0, 0)));
    }
}

#[test]
fn nonlinear_spring_has_the_reaction_of_a_hold_at_the_same_place() {
    // A spring that stiffens, U = k (¼ r⁴/a² + ½ r²), and one of finite range, U = −k a² exp(−r²/(2
    // a²)).
    let (k, a) = (30.0 * unit(), 0.1 * LENGTH);
    let stiffens = move |r: f64| {
        let x = r * r / (a * a);
        [
            k * r * r * (0.25 * x + 0.5),
            k * r * (x + 1.0),
            k * (3.0 * x + 1.0),
        ]
    };
    let attracts = move |r: f64| {
        let x = r * r / (a * a);
        let size = k * a * a * (-0.5 * x).exp();
        [-size, size * r / (a * a), size * (1.0 - x) / (a * a)]
    };
    let anchor = Vector3::new(0.9, 0.15, -0.1) * LENGTH;
    let laws: [&dyn Fn(f64) -> [f64; 3]; 2] = [&stiffens, &attracts];
    for law in laws {
        let mut held = horizontal(16);
        let found = held.hold(&spring(|x: &Vector3<f64>| radial(x, &anchor, law)));
        let (force, tip) = (found.reaction().0, found.rod.tip());
        let gradient = radial(&tip, &anchor, law).gradient;
        assert_abs_diff_eq!(
            (force + gradient).norm(),
            0.0,
            epsilon = 1e-11 * force.norm()
        );
        let mut pinned = horizontal(16);
        pinned.hold(&Hold::apex().at(tip));
        // Both searches leave the rounding of the frames, 1e-14, times the stiffness of the rod to
        // stretch.
        assert_abs_diff_eq!(
            (pinned.reaction().0 - force).norm(),
            0.0,
            epsilon = 1e-10 * force.norm()
        );
        let energy = pinned.found.energy + law((tip - anchor).norm())[0];
        assert_relative_eq!(
            held.found.energy,
            energy,
            epsilon = 0.0,
            max_relative = 1e-10
        );
        assert_eq!(held.signs(), (0, 0));
    }
}

#[test]
fn newton_converges_quadratically_for_a_stiffening_spring() {
    // The spring has force and stiffness k r³/a² and 3 k r²/a². From a displaced anchor, steps of
    // 1e-2, 1e-4 and 1e-8 rad reach rounding, where an error of the stiffness by a tenth would take
    // ten.
    let (k, a) = (30.0 * unit(), 0.1 * LENGTH);
    let law = move |r: f64| {
        [
            0.25 * k * r.powi(4) / (a * a),
            k * r.powi(3) / (a * a),
            3.0 * k * r * r / (a * a),
        ]
    };
    let mut held = horizontal(8);
    let at = |height: f64| Vector3::new(1.0, 0.0, height) * LENGTH;
    held.hold(&spring(|x: &Vector3<f64>| radial(x, &at(0.1), law)));
    held.hold(&spring(|x: &Vector3<f64>| radial(x, &at(0.12), law)));
    println!("{} iterations", held.found.iterations);
    assert!(held.found.iterations <= 6, "{}", held.found.iterations);
}

#[test]
fn nonlinear_joint_balances_the_couple_of_an_arc() {
    // The couple is constant: E I a/ℓ = κ (φ − a) + c (φ − a)³ for the angle a of the apex.
    let couple = bending_stiffness() / LENGTH;
    let (linear, cubic, angle) = (0.3 * couple, 0.8 * couple, 2.0);
    let law = |x: f64| {
        [
            x * x * (0.5 * linear + 0.25 * cubic * x * x),
            x * (linear + cubic * x * x),
        ]
    };
    let turned = bisect((0.1, 2.0), 1e-15, |a| couple * a > law(angle - a)[1]);
    let mut held = Held::straight(LENGTH, 0.0, 8, ());
    let energy = |x: &Vector3<f64>| {
        radial(x, &Vector3::zeros(), |r| {
            [law(r)[0], law(r)[1], linear + 3.0 * cubic * r * r]
        })
    };
    held.hold(&joint(0.0, about(Vector3::y_axis(), angle), energy));
    // The tolerances are those of the linear joint, in `held_joints`.
    let arc = Vector3::new(1.0 - turned.cos(), 0.0, turned.sin()) * (LENGTH / turned);
    assert_abs_diff_eq!((held.rod.tip() - arc).norm(), 0.0, epsilon = 1e-12 * LENGTH);
    assert_close("couple", held.reaction().1.y, couple * turned, 1e-12);
    assert_close(
        "energy",
        held.found.energy,
        0.5 * couple * turned * turned + law(angle - turned)[0],
        1e-12,
    );
    assert_eq!(held.signs(), (0, 0));
}

#[test]
fn anisotropic_joint_at_the_base_balances_the_weight() {
    // The base rotates, and an anisotropic joint bears the couple of the weight. An arbitrary
    // rotation has components about all axes.
    let couple = bending_stiffness() / LENGTH;
    let stiffness = Matrix3::from_diagonal(&Vector3::new(2.0, 0.7, 1.2)) * couple;
    let mut held = horizontal(16);
    let frame = about(Vector3::x_axis(), 0.8) * about(Vector3::z_axis(), 0.5) * held.scene.base;
    let energy = |x: &Vector3<f64>| quadratic(x, &stiffness, &Vector3::zeros());
    held.hold(&(Joint::Ball, joint(LENGTH, frame, energy)));
    let weight = -Vector3::z() * (DENSITY * 9.81 * std::f64::consts::PI * RADIUS * RADIUS);
    let needed = held.couple_beyond(0.0, &weight);
    assert_abs_diff_eq!(
        (held.reaction().1 + needed).norm(),
        0.0,
        epsilon = 1e-9 * needed.norm()
    );
    // The couple is the derivative of the energy: it does the work of a small rotation φ of the
    // base.
    let turn = |by: &Vector3<f64>| {
        (frame.inverse() * held.rod.frames()[0] * UnitQuaternion::from_scaled_axis(*by))
            .scaled_axis()
    };
    let value = |by: Vector3<f64>| energy(&turn(&by)).value;
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let h = 1e-4;
        // Differences of order two have an error of h² times the energy.
        let slope = (value(axis * h) - value(axis * -h)) / (2.0 * h);
        let along = held.rod.frames()[0] * axis;
        assert_abs_diff_eq!(
            slope,
            -held.reaction().1.dot(&along),
            epsilon = 1e-7 * couple
        );
    }
    assert_eq!(held.signs(), (0, 0));
}

#[test]
fn stiff_spring_stretches_a_straight_rod_by_the_balance_of_forces() {
    // E A (v − 1) = U′ for the stretch v. The springs are stiffer than the rod.
    let stretching = MODULUS * std::f64::consts::PI * RADIUS * RADIUS;
    let anchor = Vector3::z() * (1.04 * LENGTH);
    for share in [0.1, 20.0] {
        let k = share * stretching / LENGTH;
        let law = move |r: f64| {
            let x = r / (0.01 * LENGTH);
            [
                k * r * r * (0.5 + 0.25 * x * x),
                k * r * (1.0 + x * x),
                k * (1.0 + 3.0 * x * x),
            ]
        };
        let mut held = Held::straight(LENGTH, 0.0, 8, ());
        held.law = Box::new(Timoshenko::circular(YOUNG));
        held.hold(&spring(|x: &Vector3<f64>| radial(x, &anchor, law)));
        let stretch = bisect((1.0, 1.04), 1e-15, |v| {
            stretching * (v - 1.0) > law((1.04 - v) * LENGTH)[1]
        });
        // The error of the search is below 1e-8 of the length, 1e-6 of the extension.
        assert_relative_eq!(
            held.rod.tip().z,
            stretch * LENGTH,
            epsilon = 0.0,
            max_relative = 1e-10
        );
        assert_close(
            "force",
            held.reaction().0.z,
            stretching * (stretch - 1.0),
            1e-8,
        );
        assert_eq!(held.signs(), (0, 0));
    }
}

#[test]
fn negative_stiffness_makes_a_straight_rod_unstable_at_its_own_stiffness() {
    // A lateral force on the apex deflects the rod with the stiffness 3 E I/ℓ³, a couple with E
    // I/ℓ, a twist with C/ℓ.
    let signs = |support: &dyn Support| {
        let mut held = Held::straight(LENGTH, 0.0, 8, ());
        held.stable_only = false;
        held.hold(support);
        assert_abs_diff_eq!(
            (held.rod.tip() - Vector3::z() * LENGTH).norm(),
            0.0,
            epsilon = 1e-14
        );
        assert_eq!(held.inertia(support).negative, held.found.inertia.negative);
        held.found.inertia.negative
    };
    let lateral = |stiffness: f64| {
        let matrix =
            Matrix3::from_diagonal(&Vector3::new(-stiffness, -0.5 * stiffness, 0.0)) * unit();
        signs(&spring(move |x: &Vector3<f64>| {
            quadratic(x, &matrix, &Vector3::zeros())
        }))
    };
    let turning = |stiffness: f64| {
        let matrix = Matrix3::identity() * (-stiffness * bending_stiffness() / LENGTH);
        let energy = move |x: &Vector3<f64>| quadratic(x, &matrix, &Vector3::zeros());
        signs(&joint(0.0, UnitQuaternion::identity(), energy))
    };
    // The elements have the exact stiffness of a straight rod, to rounding.
    let around = [1.0 - 1e-6, 1.0 + 1e-6];
    assert_eq!(around.map(|x| lateral(3.0 * x)), [0, 1]);
    assert_eq!(around.map(|x| lateral(6.0 * x)), [1, 2]);
    assert_eq!(around.map(|x| turning(x / 1.5)), [0, 1]);
    assert_eq!(around.map(turning), [1, 3]);
}

#[test]
fn double_well_moves_the_apex_into_a_well() {
    // U = −½ k x² + ¼ c x⁴ in the direction e1, with wells at ±0.3 ℓ and more than the stiffness of
    // the rod.
    let k = 40.0 * unit();
    let c = k / (0.3 * LENGTH).powi(2);
    let energy = move |x: &Vector3<f64>| Energy {
        value: x.x * x.x * (-0.5 * k + 0.25 * c * x.x * x.x),
        gradient: Vector3::x() * (x.x * (c * x.x * x.x - k)),
        stiffness: Matrix3::from_diagonal(&Vector3::new(3.0 * c * x.x * x.x - k, 0.0, 0.0)),
    };
    let mut held = Held::straight(LENGTH, 0.0, 16, ());
    held.hold(&spring(energy));
    let (tip, force) = (held.rod.tip(), held.reaction().0);
    assert_eq!(held.signs().0, 0);
    assert!((0.25..0.3).contains(&(tip.x.abs() / LENGTH)), "{tip}");
    let mut guided = Held::straight(LENGTH, 0.0, 16, ());
    guided.hold(&Hold::apex().on_plane(Vector3::x() * tip.x, Vector3::x_axis()));
    assert_abs_diff_eq!(
        (guided.reaction().0 - force).norm(),
        0.0,
        epsilon = 1e-10 * force.norm()
    );
}

#[test]
fn joint_that_a_couple_rotates_beyond_pi_is_an_error_that_names_it() {
    // A constant couple bends the rod to an arc, whose angle is the couple times ℓ/(E I).
    let couple = |angle: f64| {
        let frame = horizontal(8).scene.base;
        let couple = Vector3::y() * (angle * unit() * LENGTH * LENGTH);
        joint(0.0, frame, move |x| {
            quadratic(x, &Matrix3::zeros(), &couple)
        })
    };
    let mut held = Held::straight(LENGTH, FRAC_PI_2, 8, ());
    held.hold(&couple(3.0));
    let turn = (held.scene.base.inverse() * held.rod.apex_frame()).angle();
    // Rounding of the rotations and of the stiffness.
    assert_abs_diff_eq!(turn, 3.0, epsilon = 1e-12);
    for angle in [3.2, 4.0, 6.0] {
        Held::straight(LENGTH, FRAC_PI_2, 8, ()).assert_refused(&couple(angle), "discontinuous");
    }
}

#[test]
fn potentials_without_an_energy_are_errors_and_leave_the_rod_unchanged() {
    let k = unit();
    let spin = Matrix3::new(0.0, -k, 0.0, k, 0.0, 0.0, 0.0, 0.0, 0.0);
    let sound = |x: &Vector3<f64>| quadratic(x, &(Matrix3::identity() * k), &Vector3::zeros());
    let apex = Hold::apex();
    // Each support with a part of the message.
    let invalid: [(Box<dyn Support>, &str); 9] = [
        (
            Box::new(spring(|x| Energy {
                gradient: spin * x,
                ..sound(x)
            })),
            "error of the gradient of a potential",
        ),
        (
            Box::new(spring(|x| Energy {
                stiffness: spin,
                ..sound(x)
            })),
            "asymmetry of the stiffness of a potential",
        ),
        (
            Box::new(spring(|x| Energy {
                value: 2.0 * sound(x).value,
                ..sound(x)
            })),
            "error of the gradient",
        ),
        (
            Box::new(spring(|x| Energy {
                stiffness: sound(x).stiffness * 1.1,
                ..sound(x)
            })),
            "error of the stiffness",
        ),
        (
            Box::new(spring(|x| Energy {
                value: f64::NAN,
                ..sound(x)
            })),
            "sum of an energy and its derivatives",
        ),
        (
            Box::new(spring(|x| Energy {
                stiffness: sound(x).stiffness * f64::NAN,
                ..sound(x)
            })),
            "sum of an energy",
        ),
        (
            Box::new(joint(0.0, UnitQuaternion::identity(), |x| Energy {
                gradient: spin * x,
                ..sound(x)
            })),
            "at 0.05 m",
        ),
        (
            Box::new(joint(LENGTH, UnitQuaternion::identity(), sound)),
            "distance of a hold from the base",
        ),
        (
            Box::new((apex, joint(-0.01, UnitQuaternion::identity(), sound))),
            "distance of an elastic place from the apex",
        ),
    ];
    let mut held = horizontal(8);
    held.hold(&());
    for (support, expected) in invalid {
        held.assert_refused(&support, expected);
    }
    // A potential that is valid at the start, and has a wrong stiffness where the rod sags to.
    let changes = |x: &Vector3<f64>| {
        let wrong = if x.z < -0.01 * LENGTH { 1.1 } else { 1.0 };
        Energy {
            stiffness: sound(x).stiffness * wrong,
            ..sound(x)
        }
    };
    let error = horizontal(8)
        .try_hold(&spring(changes))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("error of the stiffness of a potential"),
        "{error}"
    );
    held.hold(&spring(sound));
}
