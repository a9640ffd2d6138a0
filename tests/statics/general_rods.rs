//! Rods without a closed form: tapered rods, rods in space under several loads, and rods of
//! nonlinear tissue. The balance of couples is checked by integrations that use no elements.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods;
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::rods::{
    DENSITY, GRAVITY, Hanging, LENGTH, MODULUS, back_to_base, bending_stiffness, cases, sag,
    solve_tight,
};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG, tissue};
use morphorod::constitutive::{Constitutive, ElasticResponse, Lignifying, LinearElastic, Tissue};
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::load::{ApicalForce, Distributed, Load, Weight};
use morphorod::rod::Rod;
use morphorod::{Environment, Order, ParameterError, Scene, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

/// Radius at the apex over that at the base.
const TAPER: f64 = 0.6;

/// Radius (m) of a conical shoot at the distance σ (m) from its apex.
fn conical(sigma: f64) -> f64 {
    RADIUS * (TAPER + (1.0 - TAPER) * sigma / LENGTH)
}

/// Volume (m³) of the truncated cone between the apex and the distance σ (m).
fn conical_volume(sigma: f64) -> f64 {
    let (tip, here) = (conical(0.0), conical(sigma));
    PI * sigma * (tip * tip + tip * here + here * here) / 3.0
}

fn cone(elements: usize, order: Order, scene: &Still) -> Rod {
    let nodes = Rod::equal_nodes(LENGTH, elements);
    Rod::straight(&nodes, |s| conical(LENGTH - s), scene.base, order).expect("a rod")
}

#[test]
fn tip_of_tapered_shoot_matches_shooting_and_converges_at_full_order() {
    // Three times the default weight gives a strongly bent shape.
    let (scene, density) = (Still::tilted(FRAC_PI_2), 3.0 * DENSITY);
    let hanging = Hanging {
        length: LENGTH,
        tilt: FRAC_PI_2,
        stiffness: |sigma: f64| MODULUS * PI * conical(sigma).powi(4) / 4.0,
        weight: |sigma: f64| density * GRAVITY * conical_volume(sigma),
    };
    let known = hanging.tip(4000);
    let settled = |elements: usize, order: Order| {
        let mut rod = cone(elements, order, &scene);
        let _ = sag(&mut rod, density, &scene);
        rod
    };
    let finest = settled(128, Order::default());
    // The bound is the step error of the integration and the rounding of its 2 · 4000 additions.
    let certain = known.error / LENGTH + 8000.0 * f64::EPSILON;
    assert_abs_diff_eq!(
        InNorm(finest.tip().xz()),
        InNorm(Vector2::from(known.value)),
        epsilon = certain * LENGTH
    );
    for order in Order::ALL {
        let error = |k: i32| (settled(1 << k, order).tip() - finest.tip()).norm() / LENGTH;
        let errors: Vec<f64> = (1..8)
            .map(error)
            .filter(|e| (1e-13..1e-3).contains(e))
            .collect();
        // Only the two finest halvings are used. Coarse meshes do not resolve the taper, and their
        // error changes sign.
        let [.., first, _, last] = errors[..] else {
            panic!("{order:?}: {errors:?}")
        };
        let observed = (first / last).log2() / 2.0;
        let expected = order.exponent() as f64;
        assert!(
            abs_diff_eq!(observed, expected, epsilon = 0.3),
            "{order:?}: observed {observed} against {expected}, from {errors:?}"
        );
    }
    // A Gauss rule with two or more points integrates r², a polynomial of degree two, exactly. The
    // remaining error is the rounding of 128 elements.
    let rounding = 128.0 * f64::EPSILON;
    assert_relative_eq!(
        finest.volume(),
        conical_volume(LENGTH),
        epsilon = 0.0,
        max_relative = rounding
    );
    assert_relative_eq!(
        finest.length(),
        LENGTH,
        epsilon = 0.0,
        max_relative = rounding
    );
}

/// Relative error of a solved rod, and a bound on it. The balance equations are integrated from the
/// apex of the rod to its base. The error is the larger of the errors of the base frame and of the
/// tip.
fn imbalance(
    rod: &Rod,
    environment: &Environment,
    load: &dyn Load,
    uncertain: f64,
    strain: impl Fn(f64, &Vector3<f64>) -> Vector3<f64>,
) -> (f64, f64) {
    let length = rod.length();
    let area = PI * RADIUS * RADIUS;
    let force = |s: f64| {
        let beyond = length - s;
        load.force(&morphorod::load::Cut::new(s, beyond, area), environment)
    };
    let run = |apex: &UnitQuaternion<f64>| back_to_base(length, apex, 400, &strain, force);
    let known = run(&rod.apex_frame());
    let base = rod.frames()[0].to_rotation_matrix().into_inner();
    let missed = (known.value.0 - base)
        .norm()
        .max((known.value.1 - rod.tip()).norm() / length);
    // Amplification of an error of the apex frame by the integration to the base, from small
    // rotations about three axes.
    let growth = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
        let other = run(&(rod.apex_frame() * UnitQuaternion::from_scaled_axis(axis * 1e-6)));
        (other.value.0 - known.value.0)
            .norm()
            .max((other.value.1 - known.value.1).norm() / length)
            / 1e-6
    });
    let growth = growth.iter().copied().fold(1.0, f64::max);
    (
        missed,
        known.error + 3.0 * growth * uncertain + 800.0 * 4.0 * f64::EPSILON,
    )
}

proptest! {
    #![proptest_config(cases(24))]
    #[test]
    fn shoot_under_weight_wind_and_apical_force_satisfies_the_balance_equations(
        turn in prop::array::uniform3(-2.0..2.0_f64),
        (push, wind) in (prop::array::uniform3(-3.0..3.0_f64), prop::array::uniform3(-3.0..3.0_f64)),
        (first, second) in (prop::array::uniform3(-2.0..2.0_f64), prop::array::uniform3(-2.0..2.0_f64)),
    ) {
        let base = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let environment = Still::upright().environment(0.0);
        let unit = bending_stiffness() / LENGTH.powi(2);
        let apical = Vector3::from(push) * unit;
        let loads = (
            WEIGHT,
            ApicalForce(move |_: f64| apical),
            Distributed(Vector3::from(wind) * (unit / LENGTH)),
        );
        // The intrinsic strain varies along the rod.
        let intrinsic = move |s: f64| {
            let phase = 3.0 * s / LENGTH;
            (Vector3::from(first) * phase.cos() + Vector3::from(second) * phase.sin()) / LENGTH
        };
        let solve = |elements: usize| {
            let mut rod = Rod::uniform(LENGTH, RADIUS, base, elements, Order::default()).expect("a rod");
            rod.set_intrinsic(|point| intrinsic(LENGTH - point.apex_distance));
            let (law, load): (&dyn Constitutive, &dyn Load) = (&YOUNG, &loads);
            let mut solver = NewtonSolver::with_tolerance(1e-12);
            let found = solver.solve(&mut rod, &law, &load, &environment).expect("an equilibrium");
            assert_eq!(found.inertia.negative, 0);
            (rod, found)
        };
        let ((coarse, _), (rod, found)) = (solve(12), solve(24));
        // The error of the finer mesh is at most the sum of three terms: its difference from the
        // coarser mesh, the error estimate of the solver, and amplified rounding.
        let uncertain = coarse.apex_frame().angle_to(&rod.apex_frame()) + found.error
            + 4.0 * f64::EPSILON / found.inertia.margin;
        let stiffness = YOUNG.stiffness(RADIUS);
        let strain = |s: f64, couple: &Vector3<f64>| intrinsic(s) + couple.component_div(&stiffness);
        let (missed, promised) = imbalance(&rod, &environment, &loads, uncertain, strain);
        prop_assert!(missed < promised, "{missed:e} against {promised:e}");
        prop_assert!(promised < 1e-5, "the bound is too large: {promised:e}");
    }
}

/// Isotropic tissue that stiffens under strain. Its energy per length (J/m) is
/// W = ½ K |e|² + ¼ c |e|⁴, with the same coefficients for bending and twist.
struct Stiffening {
    /// Linear stiffness K, N m².
    linear: f64,
    /// Cubic stiffness c, N m⁴.
    cubic: f64,
    /// Whether the tangent contains only half of its term 2 c e eᵀ, which violates the contract of
    /// the trait.
    crude_tangent: bool,
}

impl Stiffening {
    /// Strain (1/m) under a couple (N m), from K e + c e³ = m by Newton's method. The iteration
    /// starts above the root and converges monotonically.
    fn strain(&self, couple: &Vector3<f64>) -> Vector3<f64> {
        let size = couple.norm();
        let mut e = (size / self.linear).min((size / self.cubic).cbrt());
        for _ in 0..60 {
            e -= (self.linear * e + self.cubic * e.powi(3) - size)
                / (self.linear + 3.0 * self.cubic * e * e);
        }
        if size > 0.0 {
            couple * (e / size)
        } else {
            Vector3::zeros()
        }
    }
}

impl Constitutive for Stiffening {
    fn respond(&self, _tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let square = strain.norm_squared();
        let secant = self.linear + self.cubic * square;
        let cubic = if self.crude_tangent {
            self.cubic
        } else {
            2.0 * self.cubic
        };
        ElasticResponse {
            energy: 0.5 * self.linear * square + 0.25 * self.cubic * square * square,
            couple: strain * secant,
            tangent: Matrix3::identity() * secant + strain * strain.transpose() * cubic,
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("linear stiffness", self.linear, "N m²")?;
        ParameterError::not_negative("cubic stiffness", self.cubic, "N m⁴")
    }
}

/// Tissue whose cubic part equals the linear part at a radius of curvature of 3 cm.
fn stiffening(crude_tangent: bool) -> Stiffening {
    let linear = bending_stiffness();
    Stiffening {
        linear,
        cubic: linear * 0.03 * 0.03,
        crude_tangent,
    }
}

#[test]
fn user_written_stiffening_tissue_satisfies_the_balance_equations() {
    let scene = Still::tilted(FRAC_PI_2);
    let environment = scene.environment(0.0);
    let unit = bending_stiffness() / LENGTH.powi(2);
    let loads = (
        Weight {
            density: 2.0 * DENSITY,
        },
        ApicalForce(move |_: f64| Vector3::new(0.0, 2.0, -1.0) * unit),
    );
    let solve = |law: &Stiffening, elements: usize| {
        let mut rod =
            Rod::uniform(LENGTH, RADIUS, scene.base, elements, Order::default()).expect("a rod");
        let found = solve_tight(&mut rod, law, &loads, &environment).expect("an equilibrium");
        assert_eq!((found.inertia.negative, found.inertia.neutral), (0, 0));
        (rod, found)
    };
    let law = stiffening(false);
    let ((coarse, _), (rod, found)) = (solve(&law, 16), solve(&law, 32));
    let uncertain = coarse.apex_frame().angle_to(&rod.apex_frame()) + found.error;
    let (missed, promised) = imbalance(&rod, &environment, &loads, uncertain, |_, couple| {
        law.strain(couple)
    });
    assert!(
        missed < promised && promised < 1e-9,
        "{missed:e} against {promised:e}"
    );
    // Newton's method converges quadratically only with the exact tangent. With the crude tangent
    // it converges linearly, and the same shape takes many more iterations.
    let (other, crude) = solve(&stiffening(true), 32);
    assert!(found.iterations <= 8, "{} iterations", found.iterations);
    assert!(
        crude.iterations >= 2 * found.iterations,
        "{} against {}",
        crude.iterations,
        found.iterations
    );
    assert_abs_diff_eq!(
        InNorm(other.tip()),
        InNorm(rod.tip()),
        epsilon = 1e-11 * LENGTH
    );
    // The rod is stiffer than with the linear part alone.
    let (soft, _) = solve(&Stiffening { cubic: 0.0, ..law }, 32);
    assert!(soft.tip().z < rod.tip().z - 0.01 * LENGTH);
}

#[test]
fn strain_converges_to_the_couple_over_the_stiffness_at_order_p_plus_1() {
    let base = Still::tilted(FRAC_PI_2).base;
    let force = Vector3::new(0.0, 2.0, -3.0) * (bending_stiffness() / LENGTH.powi(2));
    let tissue = LinearElastic {
        youngs_modulus: MODULUS,
        poissons_ratio: 0.3,
    };
    let stiffness = tissue.stiffness(RADIUS);
    for order in Order::ALL {
        let p = order.points();
        let error = |elements: usize| {
            let mut rod = Rod::uniform(LENGTH, RADIUS, base, elements, order).expect("a rod");
            let pull = ApicalForce(move |_: f64| force);
            let _ =
                solve_tight(&mut rod, &tissue, &pull, &rods::weightless()).expect("an equilibrium");
            // A dead load on the apex gives the couple (p(ℓ) − p(s)) × F at s.
            let misfit = |(i, point): (usize, &morphorod::rod::MaterialPoint)| {
                let (position, frame) = rod.at(LENGTH - point.apex_distance).expect("on the rod");
                let couple = frame.inverse() * (rod.tip() - position).cross(&force);
                (rod.strain(i / p, i % p).expect("a point") - couple.component_div(&stiffness))
                    .norm()
                    * LENGTH
            };
            rod.points()
                .iter()
                .enumerate()
                .map(misfit)
                .fold(0.0, f64::max)
        };
        let errors = [8, 16, 32].map(error);
        let observed = (errors[0] / errors[2]).log2() / 2.0;
        let expected = (p + 1) as f64;
        assert!(
            abs_diff_eq!(observed, expected, epsilon = 0.3),
            "{order:?}: observed {observed} against {expected}, from {errors:?}"
        );
    }
}

/// Tip position (m), at t = 6 days, of the default shoot on a horizontal base. Its tissue left the
/// growth zone at the time `exit` (s).
fn sagged(law: &dyn Constitutive, exit: f64) -> Vector3<f64> {
    let scene = Still::tilted(FRAC_PI_2);
    let mut rod = Rod::uniform(LENGTH, RADIUS, scene.base, 8, Order::default()).expect("a rod");
    rod.set_mature(exit);
    let weight = Weight { density: DENSITY };
    let _ =
        solve_tight(&mut rod, law, &weight, &scene.environment(518_400.0)).expect("an equilibrium");
    rod.tip()
}

#[test]
fn stiffnesses_match_a_circular_section_and_grow_with_lignification() {
    // With I = π r⁴/4, J = 2 I, μ = E/(2 (1 + ν)), r = 0.5 mm and E = 10 MPa, the bending stiffness
    // E I is 4.908738521234052e-7 N m².
    let bending = 4.908_738_521_234_052e-7;
    for (nu, torsion) in [(0.5, bending / 1.5), (0.0, bending), (-0.5, 2.0 * bending)] {
        let stiffness = LinearElastic {
            youngs_modulus: MODULUS,
            poissons_ratio: nu,
        }
        .stiffness(RADIUS);
        let expected = Vector3::new(bending, bending, torsion);
        assert!(
            abs_diff_eq!(
                InNorm(stiffness),
                InNorm(expected),
                epsilon = 8.0 * f64::EPSILON * bending
            ),
            "ν = {nu}: {stiffness} against {expected}"
        );
    }
    // Equation (13) has E0 = 10 MPa, E1 = 200 E0 and a lignification time of 6 days. The cases are
    // growing tissue, tissue at its exit from the growth zone, and tissue 6 days after its exit.
    let law = Lignifying {
        young: YOUNG,
        mature_modulus: 200.0 * MODULUS,
        time: 518_400.0,
    };
    for (exit, modulus) in [
        (f64::INFINITY, 1.0),
        (518_400.0, 1.0),
        (0.0, 200.0 - 199.0 * (-1_f64).exp()),
    ] {
        let tissue = tissue(modulus * MODULUS);
        let (lignified, linear) = (sagged(&law, exit), sagged(&tissue, exit));
        // The two problems differ only by the rounding of the modulus.
        assert!(
            abs_diff_eq!(
                InNorm(lignified),
                InNorm(linear),
                epsilon = 64.0 * f64::EPSILON * LENGTH
            ),
            "{modulus}: {lignified} against {linear}"
        );
    }
}

#[test]
fn law_with_nan_energy_is_refused_and_leaves_the_rod() {
    struct Broken;
    impl Constitutive for Broken {
        fn respond(&self, _: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
            ElasticResponse {
                energy: f64::NAN,
                couple: *strain,
                tangent: Matrix3::identity(),
            }
        }
    }
    let mut rod = Rod::uniform(
        LENGTH,
        RADIUS,
        UnitQuaternion::identity(),
        4,
        Order::default(),
    )
    .expect("a rod");
    let before = rod.clone();
    let answer = solve_tight(&mut rod, &Broken, &(), &rods::weightless());
    assert!(
        matches!(answer, Err(EquilibriumError::NotFinite { .. })),
        "{answer:?}"
    );
    assert_eq!(rod, before);
}
