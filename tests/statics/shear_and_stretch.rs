//! Equilibria of rods that shear and stretch, compared with closed forms and with integrations that
//! use no elements.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{back_to_base_of_line, cases, solve_tight, weightless};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::constitutive::{Constitutive, Graded, LinearElastic, Timoshenko, Tissue};
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::load::{ApicalForce, Distributed, Load, Weight};
use morphorod::profile::Profile;
use morphorod::rod::Rod;
use morphorod::{Environment, Order, Scene, Section, Still};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Tissue with E I = 1/4 N m² and E A = 1 N for a radius of 1 m. The rods are stubby.
const SOFT: LinearElastic = LinearElastic {
    youngs_modulus: 1.0 / PI,
    poissons_ratio: 0.3,
};
const RADIUS: f64 = 1.0;
const BENDING: f64 = 0.25;

/// A law with E I = ¼ N m² and the given shear stiffness κ G A and stretching stiffness E A, N, of
/// a section of 1 m radius.
fn law(shear: f64, stretch: f64) -> Timoshenko<LinearElastic> {
    Timoshenko {
        law: SOFT,
        youngs_modulus: stretch / PI,
        shear_modulus: shear / (0.8 * PI),
        shear_factor: 0.8,
    }
}

fn apical(force: Vector3<f64>) -> impl Load {
    ApicalForce(move |_: f64| force)
}

fn straight(length: f64, base: UnitQuaternion<f64>, elements: usize) -> Rod {
    Rod::uniform(length, RADIUS, base, elements, Order::default()).expect("a rod")
}

/// A base whose tangent points along e1.
fn horizontal() -> UnitQuaternion<f64> {
    Still::tilted(FRAC_PI_2).base
}

/// The limit of f(x)/x for x → 0 of an odd function, by Richardson extrapolation from `x` and
/// `x`/2. The error is of fourth order in x.
fn slope_at_zero(x: f64, f: impl Fn(f64) -> f64) -> f64 {
    let central = |x: f64| (f(x) - f(-x)) / (2.0 * x);
    (4.0 * central(0.5 * x) - central(x)) / 3.0
}

#[test]
fn weight_stretches_a_hanging_rod_and_compresses_a_standing_one_by_the_closed_form() {
    let (length, density, gravity) = (0.7, 0.02, 9.81);
    let (young, tissue) = (SOFT.youngs_modulus, Timoshenko::circular(SOFT));
    // Change of length (m) in closed form, ρ g ℓ²/(2 E).
    let change = density * gravity * length * length / (2.0 * young);
    assert!(
        change > 0.2 * length,
        "the stretch is too small for a test: {change}"
    );
    for (angle, sign) in [(PI, 1.0), (0.0, -1.0)] {
        let base = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let environment = Still::upright().environment(0.0);
        for order in Order::ALL {
            let mut rod = Rod::uniform(length, RADIUS, base, 3, order).expect("a rod");
            let weight = Weight { density };
            let found =
                solve_tight(&mut rod, &tissue, &weight, &environment).expect("an equilibrium");
            assert_eq!(found.inertia.negative, 0);
            // The stretch is linear along the rod, and one Gauss point integrates it exactly. The
            // remaining error is the rounding of three elements.
            let expected = length + sign * change;
            let rounding = 16.0 * f64::EPSILON * length;
            assert!(
                abs_diff_eq!(rod.tip().norm(), expected, epsilon = rounding),
                "{order:?}: {} against {expected}",
                rod.tip()
            );
            assert_abs_diff_eq!(rod.centre_line_length(), expected, epsilon = rounding);
            assert_abs_diff_eq!(rod.length(), length, epsilon = rounding);
            // The elastic energy is ∫ n3²/(2 E A) ds = (ρ g)² A ℓ³/(6 E). The work of the weight
            // through the stretch is twice this energy.
            let energy = (density * gravity).powi(2) * PI * length.powi(3) / (6.0 * young);
            let fall = sign * density * gravity * PI * length * length / 2.0;
            // Rules with two or more Gauss points integrate the square of the force exactly.
            if order != Order::Two {
                assert_abs_diff_eq!(
                    found.energy,
                    -energy - fall,
                    epsilon = 64.0 * f64::EPSILON * fall.abs()
                );
            }
            let profile = Profile::of(&rod, &tissue, &weight, &environment);
            let foot = profile.at(0.0).expect("a number");
            let stretch = Vector3::z() * (1.0 + 2.0 * sign * change / length);
            assert_abs_diff_eq!(
                InNorm(foot.line_strain),
                InNorm(stretch),
                epsilon = 16.0 * f64::EPSILON
            );
            assert!(
                foot.position.norm() < 16.0 * f64::EPSILON,
                "{}",
                foot.position
            );
            assert_abs_diff_eq!(foot.tangent().norm(), 1.0, epsilon = 1e-15);
            assert!((rod.line_strain(0, 0).expect("a point").z - 1.0) * sign > 0.0);
        }
    }
}

#[test]
fn cantilever_under_small_loads_matches_timoshenko_beam() {
    // Timoshenko's deflections are P ℓ³/(3 E I) + P ℓ/(κ G A), and q ℓ⁴/(8 E I) + q ℓ²/(2 κ G A).
    let (length, shear) = (2.0_f64, 0.7);
    let law = law(shear, 1.3);
    let sag = |load: &dyn Load| {
        let mut rod = straight(length, horizontal(), 4);
        let _ = solve_tight(&mut rod, &law, load, &weightless()).expect("an equilibrium");
        rod.tip().z
    };
    // The rotations are at most x ℓ²/(2 E I) = 1.6e-3. The error of the Richardson extrapolation is
    // of the order of their fourth power, 7e-12.
    let x = 2e-4;
    let tip = slope_at_zero(x, |force| sag(&apical(Vector3::z() * force)));
    let expected = length.powi(3) / (3.0 * BENDING) + length / shear;
    assert_relative_eq!(tip, expected, epsilon = 0.0, max_relative = 1e-10);
    let tip = slope_at_zero(x, |force| sag(&Distributed(Vector3::z() * force)));
    let expected = length.powi(4) / (8.0 * BENDING) + length * length / (2.0 * shear);
    assert_relative_eq!(tip, expected, epsilon = 0.0, max_relative = 1e-10);
}

/// The smallest pivot of a straight column under a load P on its top.
fn margin(column: &Rod, law: &dyn Constitutive, load: f64) -> f64 {
    let push = apical(Vector3::z() * -load);
    let push: &dyn Load = &push;
    let inertia = NewtonSolver::default().inertia(column, &law, &push, &weightless());
    inertia.expect("an inertia").margin
}

#[test]
fn column_buckles_at_the_loads_of_haringx_and_reissner() {
    // The normal and the shear force of a section are components along the directors, so that P (1
    // + P/S − P/A) is Euler's load π² E I/(4 ℓ²). Without stretch this is the formula of J. A.
    // Haringx (1948, Philips Res. Rep. 3, 401–449). It is not that of F. Engesser (1891), P =
    // P_E/(1 + P_E/S). With shear and stretch it is that of E. Reissner (1982, Ingenieur-Archiv 52,
    // 115–119).
    let length = 2.0_f64;
    let euler = PI * PI * BENDING / (4.0 * length * length);
    let column = straight(length, UnitQuaternion::identity(), 16);
    for (shear, stretch) in [
        (f64::INFINITY, f64::INFINITY),
        (0.3, f64::INFINITY),
        (0.05, f64::INFINITY),
        (f64::INFINITY, 1.0),
        (0.4, 1.5),
        (0.4, 0.8),
        (1.0, 1.0),
    ] {
        let c: f64 = 1.0 / shear - 1.0 / stretch;
        // The expected load is the smaller root of c P² + P = P_E, computed without cancellation.
        let expected = 2.0 * euler / (1.0 + (1.0 + 4.0 * c * euler).sqrt());
        let (mut low, mut high) = (0.5 * expected, 1.2 * expected);
        while high - low > 1e-13 * expected {
            let middle = 0.5 * (low + high);
            if margin(&column, &law(shear, stretch), middle) > 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        // The error of sixteen elements of order eight in an eigenvalue is of order h¹⁶ and below
        // rounding. The elimination of 16 frames (48 unknowns) leaves a rounding error of 1e-14
        // times the number of elements squared.
        assert!(
            relative_eq!(low, expected, epsilon = 0.0, max_relative = 1e-11),
            "S {shear}, A {stretch}: {low} against {expected}"
        );
        if shear < 0.1 {
            let engesser = euler / (1.0 + euler / shear);
            assert!(
                (low / engesser - 1.0).abs() > 0.1,
                "{low} equals {engesser}"
            );
        }
    }
}

#[test]
fn column_that_is_soft_in_compression_is_crushed_without_buckling() {
    // With 4 P_E (1/A − 1/S) > 1 the quadratic has no root. The column is stable until its length
    // is zero.
    let (length, shear, stretch) = (2.0_f64, 10.0, 0.3);
    let euler = PI * PI * BENDING / (4.0 * length * length);
    assert!(4.0 * euler * (1.0 / stretch - 1.0 / shear) > 1.0);
    let (law, column) = (
        law(shear, stretch),
        straight(length, UnitQuaternion::identity(), 16),
    );
    for share in [0.1, 0.3, 0.5, 0.7, 0.9, 0.999] {
        assert!(margin(&column, &law, share * stretch) > 0.0, "{share}");
    }
    let push = |share: f64| {
        let mut rod = column.clone();
        let load = apical(Vector3::z() * (-share * stretch));
        let answer = solve_tight(&mut rod, &law, &load, &weightless());
        (rod, answer)
    };
    let (rod, answer) = push(0.999);
    assert!(answer.is_ok(), "{answer:?}");
    assert_abs_diff_eq!(rod.tip().z, 0.001 * length, epsilon = 1e-12);
    for share in [1.0, 1.001, 30.0] {
        let (rod, answer) = push(share);
        let Err(error @ EquilibriumError::Crushed { stretch: left, .. }) = answer else {
            panic!("{answer:?}")
        };
        // The error of the remaining stretch is the rounding of a difference.
        assert_abs_diff_eq!(left, 1.0 - share, epsilon = 1e-12 * share);
        assert!(!error.is_recoverable(), "{error}");
        assert_eq!(rod, column);
    }
}

/// Helix about e3 of a wire of 1 m radius. Arguments are the radius of the coil (m), the pitch
/// angle (rad), the number of turns and the number of elements per turn.
fn spring(coil: f64, pitch: f64, turns: usize, elements: usize) -> Rod {
    let (sin, cos) = pitch.sin_cos();
    let strain = Vector3::new(0.0, cos * cos / coil, sin * cos / coil);
    let base = UnitQuaternion::rotation_between(&strain, &Vector3::z()).expect("no half turn");
    let length = TAU * coil / cos * turns as f64;
    let mut rod = straight(length, base, elements * turns);
    rod.set_intrinsic(|_| strain);
    let _ = Unloaded
        .solve(&mut rod, &SOFT, &(), &weightless())
        .expect("a helix");
    rod
}

#[test]
fn helical_spring_deflects_by_castiglianos_theorem() {
    // The force acts on the end of the wire, at the distance a from the axis. Castigliano's theorem
    // is applied with M = (r(ℓ) − r(s)) × P e3 on a helix of whole turns. The torsion is P a cos α
    // (1 − cos φ). The bending components are P a sin α (1 − cos φ) and P a sin φ. The shear is P
    // cos α and the tension is P sin α. The mean squares of 1 − cos φ and sin φ are 3/2 and 1/2. A
    // force on the axis would give the torsion P a cos α throughout, and hence the textbook
    // deflection 8 P D³ n/(G d⁴).
    let (coil, turns) = (3.0_f64, 3);
    for pitch in [6.5_f64, 20.0] {
        let (sin, cos) = pitch.to_radians().sin_cos();
        let rest = spring(coil, pitch.to_radians(), turns, 12);
        let length = rest.length();
        // A helix of three turns rises by ℓ sin α.
        assert_abs_diff_eq!(
            InNorm(rest.tip()),
            InNorm(Vector3::z() * (length * sin)),
            epsilon = 1e-9 * length
        );
        let torsion = SOFT.stiffness(RADIUS).z;
        let wire = Timoshenko::circular(SOFT);
        let (shear, stretch) = (wire.shear_factor * wire.shear_modulus * PI, 1.0);
        let bend = coil
            * coil
            * length
            * (1.5 * (cos * cos / torsion + sin * sin / BENDING) + 0.5 / BENDING);
        let line = length * (cos * cos / shear + sin * sin / stretch);
        assert!(
            line > 0.02 * bend,
            "the share of shear and stretch is too small for a test: {}",
            line / bend
        );
        let give = |law: &dyn Constitutive| {
            // The tip rises by about a thousandth of the radius of the coil.
            slope_at_zero(1e-3 * coil / bend, |force| {
                let mut rod = rest.clone();
                let pull = apical(Vector3::z() * force);
                let _ = solve_tight(&mut rod, law, &pull, &weightless()).expect("an equilibrium");
                rod.tip().z
            })
        };
        // The error of the tip above is 1e-9 of the length for elements of order eight that rotate
        // by 30°. The error of a difference of two positions is smaller.
        for (found, expected) in [(give(&wire), bend + line), (give(&SOFT), bend)] {
            assert!(
                relative_eq!(found, expected, epsilon = 0.0, max_relative = 2e-9),
                "{pitch}°: {found} against {expected}"
            );
        }
    }
}

#[test]
fn spring_pulled_to_twice_its_length_satisfies_the_balance_equations() {
    let (wire, pitch) = (Timoshenko::circular(SOFT), 5_f64.to_radians());
    let rest = spring(4.0, pitch, 3, 24);
    let (length, strain) = (rest.length(), rest.points()[0].intrinsic);
    let force = Vector3::z() * 8e-4;
    let mut rod = rest.clone();
    let found =
        solve_tight(&mut rod, &wire, &apical(force), &weightless()).expect("an equilibrium");
    assert!(
        rod.tip().z > 2.0 * rest.tip().z && found.inertia.negative == 0,
        "{} {}",
        rod.tip(),
        rest.tip()
    );
    let stiffness = SOFT.stiffness(RADIUS);
    let line = |_: f64, force: &Vector3<f64>| {
        Vector3::z()
            + force.component_div(&Vector3::new(
                wire.shear_factor * wire.shear_modulus,
                wire.shear_factor * wire.shear_modulus,
                wire.youngs_modulus,
            )) / PI
    };
    let bend = |_: f64, couple: &Vector3<f64>| strain + couple.component_div(&stiffness);
    let known = back_to_base_of_line(length, &rod.apex_frame(), 4000, bend, line, |_| force);
    let base = rod.frames()[0].to_rotation_matrix().into_inner();
    // The bound contains the error of the integration and that of the mesh. At 15° per element, the
    // mesh error is 2⁻⁸ of that of the helix above.
    let granted = known.error + 1e-11;
    assert_abs_diff_eq!(InNorm(known.value.0), InNorm(base), epsilon = granted);
    assert_abs_diff_eq!(
        InNorm(known.value.1),
        InNorm(rod.tip()),
        epsilon = granted * length
    );
}

/// Law whose stiffnesses decrease by half from the base to the apex.
fn softening(length: f64) -> Graded<Timoshenko<LinearElastic>, impl Fn(&Tissue) -> f64> {
    Graded {
        law: law(0.5, 0.8),
        factor: move |tissue: &Tissue| 1.0 + tissue.initial_apex_distance / length,
    }
}

proptest! {
    #![proptest_config(cases(16))]
    #[test]
    fn rotated_scenes_with_several_loads_satisfy_the_balance_equations(
        turn in prop::array::uniform3(-2.0..2.0_f64),
        (push, wind) in (prop::array::uniform3(-0.06..0.06_f64), prop::array::uniform3(-0.04..0.04_f64)),
        bent in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let (length, bent) = (2.0, Vector3::from(bent));
        let law = softening(length);
        let solve = |turn: UnitQuaternion<f64>, elements: usize| {
            let loads = (apical(turn * Vector3::from(push)), Distributed(turn * Vector3::from(wind)));
            let mut rod = straight(length, turn * horizontal(), elements);
            rod.set_intrinsic(|point| bent * point.apex_distance);
            let _ = solve_tight(&mut rod, &law, &loads, &weightless()).expect("an equilibrium");
            rod
        };
        let rod = solve(UnitQuaternion::identity(), 24);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let turned = solve(turn, 24);
        // The bound is the rounding of 24 elements, amplified by the inverse of the tangent.
        let image = turn * rod.tip();
        let tip = turned.tip();
        prop_assert!(abs_diff_eq!(InNorm(image), InNorm(tip), epsilon = 1e-12), "{image} against {tip}");
        let stiffness = SOFT.stiffness(RADIUS);
        let factor = |s: f64| 1.0 + (length - s) / length;
        let known = back_to_base_of_line(
            length,
            &rod.apex_frame(),
            1000,
            |s, couple| bent * (length - s) + couple.component_div(&stiffness) / factor(s),
            |s, force| Vector3::z() + force.component_div(&Vector3::new(0.5, 0.5, 0.8)) / factor(s),
            |s| Vector3::from(push) + Vector3::from(wind) * (length - s),
        );
        let base = rod.frames()[0].to_rotation_matrix().into_inner();
        let missed = (known.value.0 - base).norm().max((known.value.1 - rod.tip()).norm());
        // At these loads, the integration to the base amplifies an error of the apex by less than a
        // factor of 100. The change from a mesh with half as many elements bounds the error of the
        // mesh.
        let mesh = (solve(UnitQuaternion::identity(), 12).tip() - rod.tip()).norm();
        let granted = known.error + 100.0 * (mesh + 1e-14);
        prop_assert!(missed < granted && granted < 1e-8, "{missed:e} against {granted:e}");
    }
}

#[test]
fn tips_converge_at_order_2p_and_profiles_at_order_p_plus_2() {
    let environment = Still::tilted(FRAC_PI_2).environment(0.0);
    let (length, weight) = (2.0, Weight { density: 0.004 });
    let law = softening(length);
    let solve = |order: Order, elements: usize| {
        let taper = |s: f64| Section::ellipse(RADIUS * (1.2 - 0.2 * s), RADIUS);
        let nodes = Rod::equal_nodes(length, elements);
        let mut rod = Rod::straight(&nodes, taper, horizontal(), order).expect("a rod");
        let _ = solve_tight(&mut rod, &law, &weight, &environment).expect("an equilibrium");
        rod
    };
    let finest = solve(Order::Eight, 64);
    assert!(
        (finest.tip() - Vector3::x() * length).norm() > 0.2 * length,
        "{}",
        finest.tip()
    );
    // A third of the length is not an end of an element on any mesh.
    let at = length / 3.0;
    let place = |rod: &Rod| {
        Profile::of(rod, &law, &weight, &environment)
            .at(at)
            .expect("a number")
            .position
    };
    let reference = place(&finest);
    for order in Order::ALL {
        let p = order.points() as f64;
        let rods: Vec<Rod> = (2..7).map(|k| solve(order, 1 << k)).collect();
        let observed = |error: &dyn Fn(&Rod) -> f64, expected: f64| {
            let errors: Vec<f64> = rods
                .iter()
                .map(error)
                .filter(|e| (2e-13..1e-2).contains(e))
                .collect();
            let [.., first, last] = errors[..] else {
                panic!("{order:?}: {errors:?}")
            };
            let observed = (first / last).log2();
            // The relative position of the place within its element changes from mesh to mesh. The
            // observed order therefore varies.
            assert!(
                observed > expected - 0.5,
                "{order:?}: observed {observed} against {expected}, from {errors:?}"
            );
        };
        observed(&|rod| (rod.tip() - finest.tip()).norm(), 2.0 * p);
        observed(
            &|rod| (place(rod) - reference).norm(),
            (p + 2.0).min(2.0 * p),
        );
        observed(
            &|rod| (rod.at(at).expect("a number").0 - reference).norm(),
            p + 1.0,
        );
    }
}

#[test]
fn infinite_shear_and_stretching_stiffness_reproduces_the_inextensible_rod() {
    let rigid = Timoshenko {
        law: SOFT,
        youngs_modulus: f64::INFINITY,
        shear_modulus: f64::INFINITY,
        shear_factor: 1.0,
    };
    let load = (
        apical(Vector3::new(0.01, 0.02, -0.05)),
        Weight { density: 1e-3 },
    );
    let solve = |law: &dyn Constitutive| {
        let mut rod = straight(2.0, horizontal(), 6);
        let found = solve_tight(&mut rod, law, &load, &Still::upright().environment(0.0))
            .expect("an equilibrium");
        (rod, found)
    };
    let ((with, found), (without, other)) = (solve(&rigid), solve(&SOFT));
    assert_eq!(
        (with.tip(), with.frames(), found),
        (without.tip(), without.frames(), other)
    );
    assert_eq!(
        (with.line_strain(0, 0), without.line_strain(5, 3)),
        (Some(Vector3::z()), Some(Vector3::z()))
    );
    assert_eq!(
        (with.line_strain(6, 0), with.line_strain(0, 4)),
        (None, None)
    );
    assert_eq!(with.centre_line_length(), with.length());
}

#[test]
fn invalid_parameters_are_refused() {
    let sound = Timoshenko::circular(SOFT);
    assert!(sound.check().is_ok());
    assert_abs_diff_eq!(sound.shear_factor, 7.8 / 8.8, epsilon = 1e-15);
    for bad in [0.0, -1.0, f64::NAN] {
        for law in [
            Timoshenko {
                youngs_modulus: bad,
                ..sound
            },
            Timoshenko {
                shear_modulus: bad,
                ..sound
            },
            Timoshenko {
                shear_factor: bad,
                ..sound
            },
            Timoshenko {
                law: LinearElastic {
                    youngs_modulus: bad,
                    ..SOFT
                },
                ..sound
            },
        ] {
            assert!(law.check().is_err(), "{law:?}");
        }
    }
    // A factor that is not positive is refused when a shoot is built.
    let broken = Graded {
        law: sound,
        factor: |tissue: &Tissue| tissue.initial_apex_distance - 0.1,
    };
    let error = morphorod::Shoot::builder(broken)
        .length(1.0)
        .radius(0.1)
        .into_dyn()
        .build()
        .unwrap_err();
    assert!(error.to_string().contains("stiffness"), "{error}");
    let environment: Environment = weightless();
    let mut rod = straight(2.0, horizontal(), 4);
    let before = rod.clone();
    let error = solve_tight(
        &mut rod,
        &sound,
        &apical(Vector3::x() * f64::NAN),
        &environment,
    )
    .unwrap_err();
    assert!(
        matches!(error, EquilibriumError::NotFinite { .. }) && rod == before,
        "{error}"
    );
}
