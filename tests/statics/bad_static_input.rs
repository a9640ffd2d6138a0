//! Invalid input is refused without panic, and the rod is unchanged. The error names the parameter
//! or contains numbers.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::messages::names;
use crate::fixtures::rods;
use crate::fixtures::rods::{DENSITY, LENGTH, density_for, weightless};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::{Constitutive, Lignifying, LinearElastic};
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::load::{ApicalForce, Distributed, InternalForce, Load, Pulse, Weight, Whirl};
use morphorod::rod::Rod;
use morphorod::{Environment, Order, ParameterError, Scene, Still};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const NAN: f64 = f64::NAN;
const INF: f64 = f64::INFINITY;

fn upright(elements: usize) -> Rod {
    Rod::uniform(
        LENGTH,
        RADIUS,
        UnitQuaternion::identity(),
        elements,
        Order::default(),
    )
    .expect("a rod")
}

/// Asserts that the error contains the parameter's name, its value and a requirement, as fields and
/// in its message.
fn refused<T: std::fmt::Debug>(answer: Result<T, ParameterError>, name: &str, value: f64) {
    let error = answer.expect_err(name);
    assert_eq!(error.name, name);
    assert!(
        error.value == value || (error.value.is_nan() && value.is_nan()),
        "{name}: {} for {value}",
        error.value
    );
    let said = error.to_string();
    assert!(
        said.contains(name) && said.contains(error.requirement) && !error.requirement.is_empty(),
        "{said}"
    );
    assert!(names(&said, value), "{said} does not name {value}");
}

#[test]
fn rods_refuse_invalid_lengths_radii_nodes_and_frames() {
    let base = UnitQuaternion::identity();
    for bad in [0.0, -0.0, -1.0, NAN, INF, -INF] {
        refused(
            Rod::uniform(bad, RADIUS, base, 4, Order::Two),
            "length",
            bad,
        );
        refused(
            Rod::uniform(LENGTH, bad, base, 4, Order::Eight),
            "radius",
            bad,
        );
        refused(
            Rod::straight(
                &[0.0, LENGTH],
                |s| if s > 0.0 { bad } else { 1.0 },
                base,
                Order::Four,
            ),
            "radius",
            bad,
        );
    }
    refused(
        Rod::uniform(LENGTH, RADIUS, base, 0, Order::Eight),
        "number of elements",
        0.0,
    );
    for nodes in [&[][..], &[0.0]] {
        refused(
            Rod::straight(nodes, |_| RADIUS, base, Order::Six),
            "number of elements",
            0.0,
        );
    }
    refused(
        Rod::straight(&[0.1, 0.2], |_| RADIUS, base, Order::Six),
        "arc length of the first node",
        0.1,
    );
    refused(
        Rod::straight(&[NAN, 0.2], |_| RADIUS, base, Order::Six),
        "arc length of the first node",
        NAN,
    );
    refused(
        Rod::straight(&[0.0, 0.2, 0.2], |_| RADIUS, base, Order::Six),
        "length of an element",
        0.0,
    );
    refused(
        Rod::straight(&[0.0, 0.5, 0.25], |_| RADIUS, base, Order::Six),
        "length of an element",
        -0.25,
    );
    refused(
        Rod::straight(&[0.0, NAN, 0.2], |_| RADIUS, base, Order::Six),
        "length of an element",
        NAN,
    );
    refused(
        Rod::straight(&[0.0, 0.2, INF], |_| RADIUS, base, Order::Six),
        "length of an element",
        INF,
    );
    let broken = UnitQuaternion::new_unchecked(Quaternion::new(1.0, NAN, 0.0, 0.0));
    refused(
        Rod::uniform(LENGTH, RADIUS, broken, 4, Order::Eight),
        "norm of the base frame's quaternion",
        NAN,
    );
}

#[test]
fn force_in_a_rod_of_another_length_is_refused() {
    let rod = |length: f64| {
        Rod::uniform(length, RADIUS, UnitQuaternion::identity(), 4, Order::Eight).unwrap()
    };
    let environment = Still::tilted(1.0).environment(0.0);
    let force = InternalForce::of(&rod(2.0 * LENGTH), &WEIGHT, &environment);
    let mut kept = rod(LENGTH);
    let error = NewtonSolver::default()
        .equilibrate(&mut kept, &YOUNG, &force)
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("length of the rod for which the force is known"),
        "{error}"
    );
    assert_eq!(kept, rod(LENGTH));
}

#[test]
fn tissues_refuse_invalid_parameters() {
    let tissue = |youngs_modulus, poissons_ratio| LinearElastic {
        youngs_modulus,
        poissons_ratio,
    };
    for bad in [0.0, -1e7, NAN, INF] {
        refused(tissue(bad, 0.5).check(), "Young's modulus", bad);
        let law = |mature_modulus, time| Lignifying {
            young: YOUNG,
            mature_modulus,
            time,
        };
        refused(
            law(bad, 1.0).check(),
            "Young's modulus of mature tissue",
            bad,
        );
        refused(law(2e9, bad).check(), "lignification time", bad);
        refused(
            Lignifying {
                young: tissue(bad, 0.5),
                mature_modulus: 2e9,
                time: 1.0,
            }
            .check(),
            "Young's modulus",
            bad,
        );
    }
    for bad in [-1.0, -1.5, 0.500_001, 1.0, NAN, INF, -INF] {
        refused(tissue(1e7, bad).check(), "Poisson's ratio", bad);
    }
    for fine in [-0.999, 0.0, 0.3, 0.5] {
        assert_eq!(tissue(1e7, fine).check(), Ok(()));
    }
}

#[test]
fn loads_and_scenes_refuse_invalid_parameters() {
    assert_eq!(Weight { density: 0.0 }.check(), Ok(()));
    for bad in [-1000.0, NAN, INF] {
        refused(Weight { density: bad }.check(), "density", bad);
        // Loads inside a tuple, an option or a box are checked as well.
        refused(
            (Distributed(Vector3::x()), Some(Weight { density: bad })).check(),
            "density",
            bad,
        );
        refused(
            (Box::new(Weight { density: bad }) as Box<dyn Load>).check(),
            "density",
            bad,
        );
    }
    for bad in [0.0, -1000.0, NAN, INF] {
        let pulse = Pulse {
            peak: Vector3::x(),
            start: 0.0,
            duration: bad,
        };
        refused(pulse.check(), "duration of the apical pulse", bad);
        refused(
            Whirl {
                force: 1.0,
                period: bad,
                turns: 1.0,
            }
            .check(),
            "period of the rotating force",
            bad,
        );
        refused(
            Whirl {
                force: 1.0,
                period: 1.0,
                turns: bad,
            }
            .check(),
            "number of turns of the rotating force",
            bad,
        );
    }
    for bad in [NAN, INF] {
        let force = Vector3::new(0.0, bad, 0.0);
        refused(Distributed(force).check(), "distributed load", bad);
        refused(
            ApicalForce(move |_: f64| force).check(),
            "apical force at t = 0",
            bad,
        );
        refused(
            Pulse {
                peak: force,
                start: 0.0,
                duration: 1.0,
            }
            .check(),
            "peak of the apical pulse",
            bad,
        );
        refused(
            Pulse {
                peak: Vector3::x(),
                start: bad,
                duration: 1.0,
            }
            .check(),
            "start of the apical pulse",
            bad,
        );
        refused(
            Whirl {
                force: bad,
                period: 1.0,
                turns: 1.0,
            }
            .check(),
            "size of the rotating force",
            bad,
        );
        refused(
            Still {
                gravity: force,
                ..Still::upright()
            }
            .check(),
            "gravity",
            bad,
        );
    }
    // Opposite infinities must not cancel.
    let torn = Vector3::new(INF, -INF, 0.0);
    assert!(
        Distributed(torn).check().is_err()
            && Still {
                gravity: torn,
                ..Still::upright()
            }
            .check()
            .is_err()
    );
    assert_eq!(().check(), Ok(()));
}

/// Solves, expects an error and returns it. Asserts that the frames and the tip of the rod are
/// unchanged bit for bit.
fn fails(
    solver: &mut impl EquilibriumSolver,
    rod: &mut Rod,
    material: &dyn Constitutive,
    load: &dyn Load,
    environment: &Environment,
) -> EquilibriumError {
    let before = rod.clone();
    let error = solver
        .solve(rod, &material, &load, environment)
        .expect_err("an error");
    // NaN strains are not equal to themselves. Only the frames and the tip are therefore compared.
    assert_eq!(
        (rod.frames(), rod.tip()),
        (before.frames(), before.tip()),
        "{error}"
    );
    error
}

#[test]
fn exceeded_iteration_limit_reports_the_residual_and_leaves_the_rod() {
    let scene = Still::tilted(1.0);
    let weight = Weight {
        density: density_for(100.0, LENGTH),
    };
    let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, 16, Order::default()).expect("a rod");
    for bound in [1, 2, 5] {
        for stable_only in [true, false] {
            let mut solver = NewtonSolver {
                max_iterations: bound,
                stable_only,
                ..NewtonSolver::default()
            };
            let error = fails(
                &mut solver,
                &mut rod,
                &YOUNG,
                &weight,
                &scene.environment(0.0),
            );
            assert!(error.is_recoverable());
            let EquilibriumError::NoConvergence {
                iterations,
                step,
                residual,
                force,
                contact: None,
            } = error
            else {
                panic!("{error}")
            };
            assert_eq!(iterations, bound);
            assert!(
                step > 0.0 && step.is_finite() && residual > 0.0 && residual.is_finite(),
                "{step} {residual}"
            );
            // The largest force is the weight beyond the first Gauss point, 0.07 of an element from
            // the base.
            let total = 100.0 * rods::bending_stiffness() / LENGTH.powi(2);
            assert!(
                force < total && force > 0.99 * total,
                "{force} against {total}"
            );
        }
    }
    // A solver without the limit finds the same equilibrium from this rod as from a new one.
    let mut fresh = Rod::uniform(LENGTH, RADIUS, scene.base, 16, Order::default()).expect("a rod");
    let mut solver = NewtonSolver::default();
    let again = solver.solve(&mut rod, &YOUNG, &weight, &scene.environment(0.0));
    let first = NewtonSolver::default().solve(&mut fresh, &YOUNG, &weight, &scene.environment(0.0));
    assert_eq!((again, rod), (first, fresh));
}

#[test]
fn invalid_solver_settings_are_refused() {
    for bad in [0.0, -1e-9, NAN, INF] {
        let error = fails(
            &mut NewtonSolver::with_tolerance(bad),
            &mut upright(4),
            &YOUNG,
            &(),
            &weightless(),
        );
        let EquilibriumError::Parameter(parameter) = error else {
            panic!("{error}")
        };
        refused::<()>(Err(parameter), "tolerance of the equilibrium", bad);
    }
    let mut idle = NewtonSolver {
        max_iterations: 0,
        ..NewtonSolver::default()
    };
    let error = fails(&mut idle, &mut upright(4), &YOUNG, &(), &weightless());
    assert!(
        matches!(error, EquilibriumError::NoConvergence { iterations: 0, .. }),
        "{error}"
    );
}

#[test]
fn infinite_and_nan_inputs_are_refused_as_not_finite() {
    let weight = Weight { density: DENSITY };
    for bad in [NAN, INF, -INF] {
        for gravity in [Vector3::new(bad, 0.0, 0.0), Vector3::new(0.0, 0.0, bad)] {
            let environment = Environment { time: 0.0, gravity };
            let error = fails(
                &mut NewtonSolver::default(),
                &mut upright(4),
                &YOUNG,
                &weight,
                &environment,
            );
            assert!(
                matches!(error, EquilibriumError::NotFinite { .. }) && !error.is_recoverable(),
                "{error}"
            );
            let inertia =
                NewtonSolver::default().inertia(&upright(4), &YOUNG, &weight, &environment);
            assert!(
                matches!(inertia, Err(EquilibriumError::NotFinite { .. })),
                "{inertia:?}"
            );
        }
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let mut rod = upright(4);
            let mut points = 0..;
            rod.set_intrinsic(|_| {
                if points.next() == Some(5) {
                    axis * bad
                } else {
                    Vector3::zeros()
                }
            });
            let environment = Still::upright().environment(0.0);
            let error = fails(
                &mut NewtonSolver::default(),
                &mut rod,
                &YOUNG,
                &weight,
                &environment,
            );
            assert!(
                matches!(error, EquilibriumError::NotFinite { .. }),
                "{error}"
            );
            let error = fails(&mut Unloaded, &mut rod, &YOUNG, &(), &weightless());
            assert!(
                matches!(error, EquilibriumError::NotFinite { .. }),
                "{error}"
            );
        }
    }
}

#[test]
fn unloaded_solver_refuses_every_load() {
    let environment = Still::upright().environment(0.0);
    let weight = DENSITY * rods::GRAVITY * std::f64::consts::PI * RADIUS * RADIUS * LENGTH;
    let error = fails(
        &mut Unloaded,
        &mut upright(4),
        &YOUNG,
        &WEIGHT,
        &environment,
    );
    let EquilibriumError::Parameter(ParameterError { value: force, .. }) = error else {
        panic!("{error}")
    };
    // The force is the whole weight at the base, up to four roundings.
    assert_relative_eq!(
        force,
        weight,
        epsilon = 0.0,
        max_relative = 8.0 * f64::EPSILON
    );
    let pull = ApicalForce(|_: f64| Vector3::new(0.0, 0.0, 1e-150));
    let error = fails(&mut Unloaded, &mut upright(4), &YOUNG, &pull, &environment);
    assert!(matches!(error, EquilibriumError::Parameter(_)), "{error}");
    // A weight without gravity is not a load.
    assert!(
        Unloaded
            .solve(&mut upright(4), &YOUNG, &WEIGHT, &weightless())
            .is_ok()
    );
}

#[test]
fn solvers_do_not_panic_at_extreme_magnitudes() {
    let normalised = |rod: &Rod| {
        rod.frames()
            .iter()
            .all(|f| abs_diff_eq!(f.norm(), 1.0, epsilon = 1e-12))
    };
    const SIZES: [f64; 7] = [1e-300, 1e-150, 1e-20, 1.0, 1e20, 1e150, 1e300];
    for length in SIZES {
        for radius in SIZES {
            for modulus in SIZES {
                for gravity in [0.0, 1e-300, 9.81, 1e300] {
                    for strain in [0.0, 1e-300, 1.0, 1e300] {
                        let base = Still::tilted(1.0).base;
                        let mut rod =
                            Rod::uniform(length, radius, base, 3, Order::default()).expect("a rod");
                        rod.set_intrinsic(|_| Vector3::new(strain, 0.0, strain));
                        let before = rod.clone();
                        let tissue = LinearElastic {
                            youngs_modulus: modulus,
                            poissons_ratio: 0.3,
                        };
                        let environment = Environment {
                            time: 0.0,
                            gravity: Vector3::new(0.0, 0.0, -gravity),
                        };
                        let mut solver = NewtonSolver {
                            max_iterations: 20,
                            ..NewtonSolver::default()
                        };
                        let answer =
                            solver.solve(&mut rod, &tissue, &Weight { density: 1.0 }, &environment);
                        // The frames have unit norm in every case, and an error leaves the rod
                        // unchanged.
                        assert!(normalised(&rod), "{answer:?}");
                        assert!(answer.is_ok() || rod == before, "{answer:?}");
                        let answer = Unloaded.solve(&mut rod, &tissue, &(), &environment);
                        assert!(normalised(&rod), "{answer:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn rod_of_one_element_and_one_material_point_is_solved() {
    for order in Order::ALL {
        let scene = Still::tilted(1.0);
        let mut rod = Rod::uniform(0.01, RADIUS, scene.base, 1, order).expect("a rod");
        let found = rods::sag(&mut rod, DENSITY, &scene);
        assert_eq!(found.inertia.positive, 3 * order.points());
        // The tip of a short shoot with q ℓ³/(E I) = 0.0157 sags by less than 0.0157/8 of its
        // length.
        let straight = scene.base * Vector3::z() * 0.01;
        assert_abs_diff_eq!(
            InNorm(rod.tip()),
            InNorm(straight),
            epsilon = 0.0157 / 8.0 * 0.01
        );
    }
}

#[test]
fn search_that_ends_at_rounding_or_without_finite_couples_is_described() {
    let ended = |step: f64, residual: f64| {
        EquilibriumError::NoConvergence {
            iterations: 7,
            step,
            residual,
            force: 1.0,
            contact: None,
        }
        .to_string()
    };
    assert!(
        ended(f64::NAN, f64::INFINITY)
            .contains("no step was accepted, and the unbalanced couples are not finite;")
    );
    assert!(ended(1e-3, 1e-9).contains(
        "by 0.001 rad, the largest unbalanced couple is 1e-9 N m, and the largest force 1 N;"
    ));
    assert!(
        ended(9e-17, 1e-17)
            .contains("N; this step is rounding: perhaps the tolerance is too small")
    );
}
