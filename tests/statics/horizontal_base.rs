//! The default shoot of 6.59 cm, clamped horizontally, sags under its weight.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::rods::{DENSITY, LENGTH, RADIUS, TIGHT, sag, tight, young_tissue};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

/// The tip, m (outwards, across, up): the two-point problem E I θ'' + q (ℓ − s) sin θ = 0, θ(0) = π/2, θ'(ℓ) = 0
/// solved to all digits printed by two independent codes, none of them this crate.
fn exact_tip() -> Vector3<f64> {
    Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89)
}

fn straight(elements: usize, order: Order) -> Rod {
    Rod::uniform(LENGTH, RADIUS, Still::tilted(FRAC_PI_2).base, elements, order).expect("a rod")
}

/// Error of the tip relative to the length.
fn error(rod: &Rod) -> f64 {
    (rod.tip() - exact_tip()).norm() / LENGTH
}

/// Error of the tip with equal elements and no algebraic error.
fn mesh_error(elements: usize, order: Order) -> f64 {
    let mut rod = straight(elements, order);
    let _ = sag(&mut rod, DENSITY, &Still::tilted(FRAC_PI_2));
    error(&rod)
}

#[test]
fn every_order_converges_as_it_promises() {
    for order in Order::ALL {
        let errors: Vec<f64> = (0..8).map(|k| mesh_error(1 << k, order)).collect();
        // Above 1e-3 the leading term does not dominate yet; below 1e-13 rounding does.
        let used: Vec<f64> = errors.iter().copied().filter(|e| (1e-13..1e-3).contains(e)).collect();
        let [first, .., last] = used[used.len() - 4..] else { panic!("{order:?} has too few errors: {errors:?}") };
        let observed = (first / last).log2() / 3.0;
        // The next term of the error, h² times the leading one, moves the mean over three halvings by a tenth or two.
        assert!((observed - order.exponent() as f64).abs() < 0.3, "{order:?}: observed {observed} from {errors:?}");
    }
}

#[test]
fn few_elements_of_the_default_order_reach_a_billionth_and_a_few_more_reach_rounding() {
    // One billionth of the length with at most 16 elements is what is asked for; the leading term of the error, 7e-5 on
    // one element, falls by 2⁸ a halving: 7e-5/2³² = 2e-14 at 16.
    assert!(mesh_error(16, Order::default()) < 1e-9);
    assert!(mesh_error(8, Order::default()) < 1e-10);
    // Rounding of 32 chained frames and chords, each a few units of 2.2e-16.
    assert!(mesh_error(32, Order::default()) < 32.0 * f64::EPSILON);
}

#[test]
fn unequal_elements_and_slivers_do_no_harm() {
    let coarse = mesh_error(8, Order::default());
    // Slivers arise where a boundary passes close to a node. A sliver adds only rounding: the frames at its ends differ
    // by their rounding 1e-16, which its stiffness turns into a couple that acts over the sliver alone. Its pivots are
    // small beside its stiffness, and must not be taken for neutral.
    for sliver in [1e-3, 1e-6, 1e-9, 1e-11, 1e-13] {
        let mut nodes = Rod::equal_nodes(LENGTH, 8);
        nodes.insert(5, nodes[4] + sliver * LENGTH);
        let scene = Still::tilted(FRAC_PI_2);
        let mut rod = Rod::straight(&nodes, |_| RADIUS, scene.base, Order::default()).expect("a rod");
        let found = sag(&mut rod, DENSITY, &scene);
        assert_eq!((found.inertia.negative, found.inertia.neutral), (0, 0), "sliver of {sliver:e}");
        // Splitting an element can only lessen the discretisation error; a tenth covers that it does so unevenly.
        assert!(error(&rod) < 1.1 * coarse, "sliver of {sliver:e}: {:e} against {coarse:e}", error(&rod));
    }
}

#[test]
fn a_straight_first_guess_needs_few_iterations_on_every_mesh() {
    // Newton's method squares an error of a few tenths four times to pass 1e-14; the numbers were (4, 4, 4) when this
    // was written and must not depend on the mesh.
    for order in Order::ALL {
        for elements in [2, 8, 32, 128] {
            let found = sag(&mut straight(elements, order), DENSITY, &Still::tilted(FRAC_PI_2));
            let counts = (found.iterations, found.factorisations, found.evaluations);
            assert!(counts <= (5, 5, 5), "{order:?}, {elements} elements: {counts:?}");
        }
    }
}

#[test]
fn a_neighbour_needs_one_tangent_and_a_straight_guess_three() {
    let scene = Still::tilted(FRAC_PI_2);
    for elements in [4, 5, 8, 16] {
        let mut solver = NewtonSolver::default();
        let mut solve = |rod: &mut Rod, density: f64| {
            let found = solver
                .solve(rod, &young_tissue(), &Weight { density }, &scene.environment(0.0))
                .expect("an equilibrium");
            assert!(found.error <= 1e-11 && found.inertia.negative == 0, "{found:?}");
            (found.iterations, found.factorisations, found.evaluations)
        };
        let mut rod = straight(elements, Order::default());
        // Newton's steps of some 1, 1e-1 and 1e-3 rad; chord steps, each a thousandth of the one before, go on from there.
        let (iterations, factorisations, evaluations) = solve(&mut rod, DENSITY);
        assert!((iterations, factorisations) <= (3, 3) && evaluations <= 5, "{iterations}, {evaluations}");
        // A thousandth more load: a step of some 1e-3 rad, whose error of 1e-6 two chord steps bring below 1e-11.
        let (iterations, factorisations, evaluations) = solve(&mut rod, 1.001 * DENSITY);
        assert!((iterations, factorisations) == (1, 1) && evaluations <= 2, "{iterations}, {evaluations}");
    }
}

#[test]
fn a_shoot_at_rest_is_recognised_at_once() {
    let scene = Still::tilted(FRAC_PI_2);
    let mut rod = straight(16, Order::default());
    let _ = sag(&mut rod, DENSITY, &scene);
    let before = rod.clone();
    let again = sag(&mut rod, DENSITY, &scene);
    assert_eq!(again.iterations, 1);
    // Nothing is left to correct but the rounding of frames and couples.
    let moved = (rod.tip() - before.tip()).norm() / LENGTH;
    assert!(moved < 16.0 * f64::EPSILON, "moved by {moved:e}");
}

#[test]
fn the_reported_error_is_the_error_that_is_left() {
    let scene = Still::tilted(FRAC_PI_2);
    let mut exact = straight(8, Order::default());
    let _ = sag(&mut exact, DENSITY, &scene);
    // Loads of any size, so that the last step is caught at any stage of its convergence.
    for percent in [60, 80, 100, 120, 140, 160, 180, 200] {
        let density = DENSITY * f64::from(percent) / 100.0;
        let mut loose = straight(8, Order::default());
        let found = NewtonSolver::with_tolerance(1e-3)
            .solve(&mut loose, &young_tissue(), &Weight { density }, &scene.environment(0.0))
            .expect("converges");
        let mut settled = loose.clone();
        let _ = sag(&mut settled, density, &scene);
        let left = loose.frames().iter().zip(settled.frames()).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
        assert!(found.error <= 1e-3);
        // An estimate from the ratio of two steps is good to a small factor, three here, until rounding.
        assert!(left < 3.0 * found.error + 16.0 * f64::EPSILON, "{percent} %: {left:e}, reported {:e}", found.error);
    }
}

#[test]
fn tolerance_buys_accuracy_and_the_default_is_enough() {
    let reach = |mut solver: NewtonSolver| {
        let mut rod = straight(32, Order::default());
        let scene = Still::tilted(FRAC_PI_2);
        let weight = Weight { density: DENSITY };
        let found = solver.solve(&mut rod, &young_tissue(), &weight, &scene.environment(0.0)).expect("converges");
        assert!(found.error <= solver.tolerance);
        error(&rod)
    };
    // A frame wrong by the tolerance moves the tip by at most the tolerance times the length; three for the estimate.
    assert!(reach(NewtonSolver::default()) < 3.0 * NewtonSolver::default().tolerance);
    assert!(reach(NewtonSolver::with_tolerance(1e-6)) < 3e-6);
    assert!(reach(tight()) < 3.0 * TIGHT);
}
