//! Equilibria of the default shoot of 6.59 cm on a horizontal base under its weight.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{DENSITY, LENGTH, TIGHT, sag, tight};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

/// Tip (outwards, across, up; m), from the boundary value problem E I θ'' + q (ℓ − s) sin θ = 0,
/// θ(0) = π/2, θ'(ℓ) = 0. Two codes that are independent of this crate agree in all printed digits.
fn exact_tip() -> Vector3<f64> {
    Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89)
}

fn straight(elements: usize, order: Order) -> Rod {
    Rod::uniform(
        LENGTH,
        RADIUS,
        Still::tilted(FRAC_PI_2).base,
        elements,
        order,
    )
    .expect("a rod")
}

/// Error of the tip relative to the length.
fn error(rod: &Rod) -> f64 {
    (rod.tip() - exact_tip()).norm() / LENGTH
}

/// Error of the tip relative to the length, with equal elements and negligible algebraic error.
fn mesh_error(elements: usize, order: Order) -> f64 {
    let mut rod = straight(elements, order);
    let _ = sag(&mut rod, DENSITY, &Still::tilted(FRAC_PI_2));
    error(&rod)
}

#[test]
fn tip_of_horizontal_rod_converges_at_the_order_of_the_elements() {
    for order in Order::ALL {
        let errors: Vec<f64> = (0..8).map(|k| mesh_error(1 << k, order)).collect();
        // Above 1e-3 the leading term does not dominate yet. Below 1e-13 rounding dominates.
        let used: Vec<f64> = errors
            .iter()
            .copied()
            .filter(|e| (1e-13..1e-3).contains(e))
            .collect();
        let [first, .., last] = used[used.len() - 4..] else {
            panic!("{order:?} has too few errors: {errors:?}")
        };
        let observed = (first / last).log2() / 3.0;
        // The next term of the error, h² times the leading one, changes the mean observed order
        // over three halvings by 0.1 to 0.2.
        let expected = order.exponent() as f64;
        assert!(
            abs_diff_eq!(observed, expected, epsilon = 0.3),
            "{order:?}: observed {observed} against {expected}, from {errors:?}"
        );
    }
}

#[test]
fn sixteen_elements_of_default_order_reach_1e_9_and_thirty_two_reach_rounding() {
    // The required accuracy is 1e-9 of the length with at most 16 elements. The leading term of the
    // error is 7e-5 with one element and decreases by 2⁸ with every halving. With 16 elements it is
    // 7e-5/2³² = 2e-14.
    assert!(mesh_error(16, Order::default()) < 1e-9);
    assert!(mesh_error(8, Order::default()) < 1e-10);
    // The rounding of 32 chained frames and chords is a few units of 2.2e-16 each.
    assert!(mesh_error(32, Order::default()) < 32.0 * f64::EPSILON);
}

#[test]
fn very_short_elements_do_not_increase_the_error() {
    let coarse = mesh_error(8, Order::default());
    // A sliver, a very short element, arises where a boundary passes close to a node. It adds only
    // rounding. The frames at its ends differ by their rounding 1e-16, which its stiffness converts
    // into a couple that acts over the sliver alone. Its pivots are small compared with its
    // stiffness, and must not be counted as neutral.
    for sliver in [1e-3, 1e-6, 1e-9, 1e-11, 1e-13] {
        let mut nodes = Rod::equal_nodes(LENGTH, 8);
        nodes.insert(5, nodes[4] + sliver * LENGTH);
        let scene = Still::tilted(FRAC_PI_2);
        let mut rod =
            Rod::straight(&nodes, |_| RADIUS, scene.base, Order::default()).expect("a rod");
        let found = sag(&mut rod, DENSITY, &scene);
        assert_eq!(
            (found.inertia.negative, found.inertia.neutral),
            (0, 0),
            "sliver of {sliver:e}"
        );
        // Splitting an element can only reduce the discretisation error. The bound allows ten
        // percent more for the uneven mesh.
        assert!(
            error(&rod) < 1.1 * coarse,
            "sliver of {sliver:e}: {:e} against {coarse:e}",
            error(&rod)
        );
    }
}

#[test]
fn straight_initial_guess_needs_few_iterations_on_every_mesh() {
    // Newton's method squares the error in each iteration. Elements of lower order and rods of two
    // elements take (3, 3, 5) iterations, factorisations and evaluations. Others start from a
    // coarse mesh and take (2, 2, 2).
    for order in Order::ALL {
        for elements in [2, 8, 32, 128] {
            let found = sag(
                &mut straight(elements, order),
                DENSITY,
                &Still::tilted(FRAC_PI_2),
            );
            let straight = order != Order::Eight || elements == 2;
            let (tangents, gradients) = if straight { (3, 5) } else { (2, 2) };
            assert!(
                found.iterations <= tangents && found.factorisations <= tangents,
                "{order:?}, {elements}: {found:?}"
            );
            assert!(
                found.evaluations <= gradients,
                "{order:?}, {elements}: {found:?}"
            );
        }
    }
}

#[test]
fn small_load_change_and_straight_guess_need_one_factorisation() {
    let scene = Still::tilted(FRAC_PI_2);
    for elements in [4, 5, 8, 16] {
        let mut solver = NewtonSolver::default();
        let mut solve = |rod: &mut Rod, density: f64| {
            let found = solver
                .solve(rod, &YOUNG, &Weight { density }, &scene.environment(0.0))
                .expect("an equilibrium");
            assert!(
                found.error <= 1e-11 && found.inertia.negative == 0,
                "{found:?}"
            );
            (found.iterations, found.factorisations, found.evaluations)
        };
        let mut rod = straight(elements, Order::default());
        // The initial guess is the equilibrium on a mesh with a quarter of the elements. Newton's
        // step squares its error, and one chord step follows.
        assert_eq!(solve(&mut rod, DENSITY), (1, 1, 1), "{elements} elements");
        // A thousandth more load gives a step of about 1e-3 rad with an error of 1e-6. Two chord
        // steps reduce it below 1e-11.
        let (iterations, factorisations, evaluations) = solve(&mut rod, 1.001 * DENSITY);
        assert!(
            (iterations, factorisations) == (1, 1) && evaluations <= 2,
            "{iterations}, {evaluations}"
        );
    }
}

#[test]
fn equilibrium_as_initial_guess_takes_one_iteration() {
    let scene = Still::tilted(FRAC_PI_2);
    let mut rod = straight(16, Order::default());
    let _ = sag(&mut rod, DENSITY, &scene);
    let before = rod.clone();
    let again = sag(&mut rod, DENSITY, &scene);
    assert_eq!(again.iterations, 1);
    // The correction is the rounding of frames and couples.
    assert_abs_diff_eq!(
        InNorm(rod.tip()),
        InNorm(before.tip()),
        epsilon = 16.0 * f64::EPSILON * LENGTH
    );
}

#[test]
fn reported_error_bounds_the_actual_error_of_the_horizontal_rod() {
    let scene = Still::tilted(FRAC_PI_2);
    let mut exact = straight(8, Order::default());
    let _ = sag(&mut exact, DENSITY, &scene);
    // Several loads are used, so that the last step is at different stages of its convergence.
    for percent in [60, 80, 100, 120, 140, 160, 180, 200] {
        let density = DENSITY * f64::from(percent) / 100.0;
        let mut loose = straight(8, Order::default());
        let found = NewtonSolver::with_tolerance(1e-3)
            .solve(
                &mut loose,
                &YOUNG,
                &Weight { density },
                &scene.environment(0.0),
            )
            .expect("converges");
        let mut settled = loose.clone();
        let _ = sag(&mut settled, density, &scene);
        let left = loose
            .frames()
            .iter()
            .zip(settled.frames())
            .map(|(a, b)| a.angle_to(b))
            .fold(0.0, f64::max);
        assert!(found.error <= 1e-3);
        // An estimate from the ratio of two steps is accurate to a small factor, three here, above
        // rounding.
        assert!(
            left < 3.0 * found.error + 16.0 * f64::EPSILON,
            "{percent} %: {left:e}, reported {:e}",
            found.error
        );
    }
}

#[test]
fn tip_error_is_bounded_by_the_tolerance() {
    let reach = |mut solver: NewtonSolver| {
        let mut rod = straight(32, Order::default());
        let scene = Still::tilted(FRAC_PI_2);
        let weight = Weight { density: DENSITY };
        let found = solver
            .solve(&mut rod, &YOUNG, &weight, &scene.environment(0.0))
            .expect("converges");
        assert!(found.error <= solver.tolerance);
        error(&rod)
    };
    // Errors of the frames equal to the tolerance displace the tip by at most the tolerance times
    // the length. The factor of three covers the uncertainty of the estimate.
    assert!(reach(NewtonSolver::default()) < 3.0 * NewtonSolver::default().tolerance);
    assert!(reach(NewtonSolver::with_tolerance(1e-6)) < 3e-6);
    assert!(reach(tight()) < 3.0 * TIGHT);
}
