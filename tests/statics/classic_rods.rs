//! Rods in space with closed forms or published tables: arcs, helices, and the 45° bend of Bathe
//! and Bolourchi.

use std::f64::consts::{FRAC_PI_4, PI};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{back_to_base, cases, solve_tight, weightless};
use crate::fixtures::shoots::YOUNG;
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver, Unloaded};
use morphorod::load::{ApicalForce, Load, Weight};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Straight rod of 1 m length with the given intrinsic strain, 1/m.
fn with_strain(elements: usize, order: Order, strain: impl Fn(f64) -> Vector3<f64>) -> Rod {
    let mut rod =
        Rod::uniform(1.0, 0.01, UnitQuaternion::identity(), elements, order).expect("a rod");
    rod.set_intrinsic(|point| strain(1.0 - point.apex_distance));
    rod
}

/// The shapes without load from the `Unloaded` solver and from Newton's method.
fn relaxed(rod: &Rod) -> [Rod; 2] {
    let (mut direct, mut newton) = (rod.clone(), rod.clone());
    let _ = Unloaded
        .solve(&mut direct, &YOUNG, &(), &weightless())
        .expect("an equilibrium");
    let found = solve_tight(&mut newton, &YOUNG, &(), &weightless()).expect("an equilibrium");
    assert_eq!((found.inertia.negative, found.inertia.neutral), (0, 0));
    [direct, newton]
}

/// Point ∫ exp(û s) e3 ds, from 0 to `s`, of a helix about u.
fn helix(u: &Vector3<f64>, s: f64) -> Vector3<f64> {
    let (size, axis) = (u.norm(), u.normalize());
    let along = axis * axis.z;
    let (sin, cos) = (size * s).sin_cos();
    along * s
        + (Vector3::z() - along) * (sin / size)
        + axis.cross(&Vector3::z()) * ((1.0 - cos) / size)
}

/// A bound on the error of the Gauss rule with p points for ∫ cos x over 0 … h, Abramowitz and
/// Stegun, 25.4.30: h^(2p+1) (p!)⁴ / ((2p + 1) ((2p)!)³), here per unit of h.
fn gauss_error(p: usize, h: f64) -> f64 {
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    h.powi(2 * p as i32) * factorial(p).powi(4) / ((2 * p + 1) as f64 * factorial(2 * p).powi(3))
}

proptest! {
    #![proptest_config(cases(48))]
    #[test]
    fn constant_intrinsic_strain_gives_an_arc_or_a_helix(
        direction in prop::array::uniform3(-1.0..1.0_f64), turns in 0.01..2.0_f64, pick in 0..4_usize,
    ) {
        let order = Order::ALL[pick];
        let elements = 16;
        let direction = Vector3::from(direction);
        prop_assume!(direction.norm() > 0.1);
        let u = direction.normalize() * (2.0 * PI * turns);
        for rod in relaxed(&with_strain(elements, order, |_| u)) {
            for (i, frame) in rod.frames().iter().enumerate() {
                // The rotation vector is linear in s, which every order represents. The error is a
                // few units of rounding for each element. Newton's method with a tight tolerance
                // adds an error of the same size.
                let exact = UnitQuaternion::from_scaled_axis(u * (i as f64 / elements as f64));
                let (angle, rounding) = (frame.angle_to(&exact), 8.0 * (elements as f64) * f64::EPSILON + 2e-14);
                prop_assert!(abs_diff_eq!(angle, 0.0, epsilon = rounding), "{order:?}, frame {i}: {angle:e}");
            }
            // The centre line is the Gauss quadrature of the tangent.
            let bound = gauss_error(order.points(), u.norm() / elements as f64) + 2e-14;
            let (tip, expected) = (rod.tip(), helix(&u, 1.0));
            prop_assert!(
                abs_diff_eq!(InNorm(tip), InNorm(expected), epsilon = bound),
                "{order:?}: {tip} against {expected} within {bound:e}"
            );
        }
    }
}

#[test]
fn straight_initial_guess_converges_to_a_closed_circle() {
    // The straight shape of a rod whose intrinsic shape is a circle is far from equilibrium.
    // Without a load, no force defines a scale.
    for order in Order::ALL {
        for elements in [4, 16] {
            let u = Vector3::new(0.0, 2.0 * PI, 0.0);
            for rod in relaxed(&with_strain(elements, order, |_| u)) {
                let turned = rod.apex_frame().angle();
                assert!(
                    turned < 8.0 * (elements as f64) * f64::EPSILON + 2e-14,
                    "{order:?}: {turned:e}"
                );
                // The tip is the integral of a sine over a whole period. The sum over equal
                // elements is exact for it.
                assert!(
                    rod.tip().norm() < 1e-13,
                    "{order:?}, {elements} elements: {:?}",
                    rod.tip()
                );
            }
        }
    }
}

#[test]
fn bends_that_cancel_within_an_element_converge() {
    // The frames at the ends of an element are almost equal, although the rotations between them
    // are large.
    for order in [Order::Four, Order::Six, Order::Eight] {
        let p = order.points();
        for seed in 0..200 {
            let mut rod = with_strain(2, order, |_| Vector3::zeros());
            let value = |i: usize| 3.0 * ((7 * seed + i) as f64 * 2.399_963).sin();
            let bends: Vec<Vector3<f64>> = (0..p)
                .map(|g| Vector3::new(value(3 * g), value(3 * g + 1), value(3 * g + 2)))
                .collect();
            let mean = bends.iter().sum::<Vector3<f64>>() / p as f64;
            let mut bends = bends.iter().cycle();
            rod.set_intrinsic(|_| bends.next().unwrap() - mean * (1.0 - 1e-9));
            let _ = relaxed(&rod);
        }
    }
}

#[test]
fn intrinsic_strain_with_rotating_direction_gives_a_helix() {
    // In frames that are rotated back by ks about d3, a rod of constant strain w = (a, 0, b + k)
    // has u = (a cos ks, a sin ks, b). The frames are exp(ŵ s) exp(−k s ê3), and the centre line is
    // the helix of w. The rotation vector is not a polynomial.
    let (a, b, k) = (3.0, 0.5, 2.0);
    let w = Vector3::new(a, 0.0, b + k);
    for order in Order::ALL {
        let errors: Vec<f64> = [4, 8, 16, 32]
            .iter()
            .map(|&elements| {
                let strain = |s: f64| Vector3::new(a * (k * s).cos(), a * (k * s).sin(), b);
                let [direct, newton] = relaxed(&with_strain(elements, order, strain));
                // The two methods minimise the same discrete energy, to rounding and to the tight
                // tolerance of 1e-14.
                let apart = direct
                    .frames()
                    .iter()
                    .zip(newton.frames())
                    .map(|(a, b)| a.angle_to(b))
                    .fold(0.0, f64::max);
                assert!(apart < 1e-13, "{order:?}, {elements} elements: {apart:e}");
                let exact = UnitQuaternion::from_scaled_axis(w)
                    * UnitQuaternion::from_scaled_axis(Vector3::z() * -k);
                (direct.tip() - helix(&w, 1.0))
                    .norm()
                    .max(direct.apex_frame().angle_to(&exact))
            })
            // Errors of at most 1e-14 are rounding of the frames.
            .filter(|error| *error > 1e-14)
            .collect();
        let halvings = errors.len() - 1;
        assert!(halvings >= 2, "{order:?}: {errors:?}");
        let observed = (errors[0] / errors[halvings]).log2() / halvings as f64;
        // The next term of the error, h² times the leading one with h up to 1 rad, changes the mean
        // observed order by 0.1 to 0.2.
        let expected = order.exponent() as f64;
        assert!(
            abs_diff_eq!(observed, expected, epsilon = 0.3),
            "{order:?}: observed {observed} against {expected}, from {errors:?}"
        );
    }
}

/// A square section with sides of 1 in, E = 10⁷ psi, ν = 0 and the torsion constant J (in⁴).
struct SquareSection {
    torsion_constant: f64,
}

impl SquareSection {
    const YOUNGS_MODULUS: f64 = 1e7;

    fn stiffness(&self) -> Vector3<f64> {
        let bending = Self::YOUNGS_MODULUS / 12.0;
        Vector3::new(
            bending,
            bending,
            0.5 * Self::YOUNGS_MODULUS * self.torsion_constant,
        )
    }
}

impl Constitutive for SquareSection {
    fn respond(&self, _tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let couple = self.stiffness().component_mul(strain);
        let tangent = Matrix3::from_diagonal(&self.stiffness());
        ElasticResponse {
            energy: 0.5 * couple.dot(strain),
            couple,
            tangent,
        }
    }
}

/// Square section whose torsion constant is its polar second moment, as in the papers.
const POLAR: SquareSection = SquareSection {
    torsion_constant: 1.0 / 6.0,
};

/// Arc of 45° and radius 100 in, clamped with its tangent along e3 and curved towards e1. A force
/// (lb) along e2 pulls at its end.
fn bend(section: &SquareSection, force: f64, elements: usize, order: Order) -> Rod {
    let length = 100.0 * FRAC_PI_4;
    let mut rod =
        Rod::uniform(length, 0.5, UnitQuaternion::identity(), elements, order).expect("a rod");
    rod.set_intrinsic(|_| Vector3::new(0.0, 0.01, 0.0));
    let pull = ApicalForce(|_: f64| Vector3::new(0.0, force, 0.0));
    let found = solve_tight(&mut rod, section, &pull, &weightless()).expect("an equilibrium");
    assert_eq!((found.inertia.negative, found.inertia.neutral), (0, 0));
    rod
}

/// Coordinates of the tip (in), in the order of the tables: towards the centre of the arc, along
/// the tangent of the base, out of the plane.
fn tabulated(rod: &Rod) -> Vector3<f64> {
    let tip = rod.tip();
    Vector3::new(tip.x, tip.z, tip.y)
}

#[test]
fn bend_of_45_degrees_matches_published_tables() {
    // K.-J. Bathe and S. Bolourchi (1979), Int. J. Numer. Meth. Engng 14, 961–986, the original
    // problem with eight elements.
    // J. C. Simo and L. Vu-Quoc (1986), Comput. Meth. Appl. Mech. Engng 58, 79–116, example 7.5,
    // with eight linear elements.
    // GXBeam.jl (T. McDonnell and A. Ning), test suite, 600 lb, 16 elements: displacement
    // (−13.5774, −23.5453, 53.4580).
    let start = Vector3::new(1.0 - FRAC_PI_4.cos(), FRAC_PI_4.sin(), 0.0) * 100.0;
    let tables = [
        (
            "Bathe and Bolourchi",
            8,
            600.0,
            Vector3::new(15.9, 47.2, 53.4),
            0.05,
        ),
        (
            "Simo and Vu-Quoc",
            8,
            600.0,
            Vector3::new(15.79, 47.23, 53.37),
            0.005,
        ),
        (
            "Simo and Vu-Quoc",
            8,
            300.0,
            Vector3::new(22.33, 58.84, 40.08),
            0.005,
        ),
        (
            "GXBeam",
            16,
            600.0,
            start + Vector3::new(-13.577_384, -23.545_303, 53.458_008),
            5e-7,
        ),
    ];
    for (who, elements, force, printed, half_unit) in tables {
        let converged = tabulated(&bend(&POLAR, force, 16, Order::default()));
        // The elements of the tables have constant strain, as have the elements of lowest order of
        // the crate. Another interpolation may double the error.
        let coarse = (tabulated(&bend(&POLAR, force, elements, Order::Two)) - converged).norm();
        // The rods of the tables also stretch and shear, by at most n/(E A) and n/(κ G A) per
        // length, with κ = 5/6.
        let shear = force * 100.0 * FRAC_PI_4 * (1e-7 + 1.0 / (5e6 * 5.0 / 6.0));
        let (difference, granted) = (
            (printed - converged).norm(),
            2.0 * coarse + shear + 3_f64.sqrt() * half_unit,
        );
        // The bound on the norm contains the rounding of three printed coordinates.
        assert!(
            difference < granted,
            "{who}, {force} lb: {difference} against {granted}"
        );
    }
}

#[test]
fn bend_of_45_degrees_satisfies_the_balance_equations() {
    // The torsion constants are the polar moment, and that of a square under Saint-Venant's
    // torsion, 0.1406 a⁴ (Timoshenko and Goodier, Theory of Elasticity, section 109).
    for section in [
        POLAR,
        SquareSection {
            torsion_constant: 0.1406,
        },
    ] {
        for force in [300.0, 450.0, 600.0] {
            let rod = bend(&section, force, 16, Order::default());
            let stiffness = section.stiffness();
            let strain = |_: f64, couple: &Vector3<f64>| {
                couple.component_div(&stiffness) + Vector3::new(0.0, 0.01, 0.0)
            };
            let known = back_to_base(rod.length(), &rod.apex_frame(), 500, strain, |_| {
                Vector3::new(0.0, force, 0.0)
            });
            let (base, tip) = known.value;
            // The bound is the step error of the integration, and rounding of a few units in each
            // of 1000 steps.
            let promised = known.error + 1000.0 * 4.0 * f64::EPSILON;
            assert!(
                abs_diff_eq!(
                    InNorm(base),
                    InNorm(Matrix3::identity()),
                    epsilon = promised
                ),
                "{force} lb: {base}"
            );
            assert!(
                abs_diff_eq!(
                    InNorm(tip),
                    InNorm(rod.tip()),
                    epsilon = promised * rod.length()
                ),
                "{force} lb: {tip} against {}",
                rod.tip()
            );
        }
    }
}

#[test]
fn coil_is_found_from_a_straight_initial_guess_in_few_iterations() {
    // The strains rotate an element by 1.9 to 2.9 rad. With the first strain, eight elements form
    // 3.7 turns. Each coil is solved with and without weight.
    for (u, elements) in [
        (Vector3::new(0.0, 20.0, 11.6), 8),
        (Vector3::new(17.0, 9.0, 3.0), 8),
        (Vector3::new(3.0, 60.0, 3.0), 32),
    ] {
        for order in [Order::Four, Order::Six, Order::Eight] {
            for load in [None, Some(Weight { density: 100.0 })] {
                let mut rod = with_strain(elements, order, |_| u);
                let found =
                    solve_tight(&mut rod, &YOUNG, &load, &Still::upright().environment(0.0))
                        .unwrap();
                assert!(
                    found.iterations <= 6,
                    "{} iterations for {u:?} at {order:?} with {load:?}",
                    found.iterations
                );
                assert_eq!(found.inertia.negative, 0);
            }
        }
    }
}

#[test]
fn coil_that_no_element_resolves_is_refused_with_a_clear_message() {
    let mut rod = with_strain(4, Order::Eight, |_| Vector3::new(0.0, 20.0, 11.6));
    let kept = rod.clone();
    let load = Weight { density: 100.0 };
    let error = NewtonSolver::default()
        .solve(&mut rod, &YOUNG, &load, &Still::upright().environment(0.0))
        .unwrap_err();
    assert!(
        matches!(error, EquilibriumError::Folded { element: 0, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("take more elements"), "{error}");
    assert_eq!(rod, kept);
    // An axial force straightens the rod, and the elements then resolve it.
    let pull: &dyn Load = &ApicalForce(|_| Vector3::z() * 1e3);
    let law: &dyn Constitutive = &YOUNG;
    let _ = NewtonSolver::default()
        .solve(&mut rod, &law, &pull, &Still::upright().environment(0.0))
        .unwrap();
    assert_abs_diff_eq!(rod.tip().z, 1.0, epsilon = 0.1);
}
