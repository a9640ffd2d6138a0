//! Shapes that a weak intrinsic curvature selects among many of almost the same energy.

use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use std::f64::consts::FRAC_PI_2;

use morphorod::equilibrium::{Equilibrium, EquilibriumSolver, NewtonSolver};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

fn solve(solver: &mut NewtonSolver, rod: &mut Rod) -> Equilibrium {
    let environment = Still::upright().environment(0.0);
    solver.solve(rod, &YOUNG, &WEIGHT, &environment).unwrap()
}

/// A shoot on an upright base, longer than its critical length of 79 mm, in equilibrium.
fn buckled(elements: usize, order: Order) -> (Rod, NewtonSolver) {
    let mut rod = Rod::uniform(0.12, RADIUS, Still::upright().base, elements, order).unwrap();
    let mut solver = NewtonSolver::default();
    let _ = solve(&mut solver, &mut rod);
    (rod, solver)
}

/// The shoot buckles in the plane of d1. It then turns to the plane of its intrinsic curvature, by
/// symmetry. Without corrections each step turned it by about 3e-3 rad, so that 300 to more than
/// 1000 iterations were necessary. At the angle π/2 the tangent is neutral in this direction.
#[test]
fn buckled_shoot_turns_to_the_plane_of_its_intrinsic_curvature() {
    let cases = [
        (1.0, 1e-8),
        (FRAC_PI_2, 1e-2),
        (FRAC_PI_2, 1e-6),
        (FRAC_PI_2, 1e-8),
        (3.0, 1e-2),
        (3.0, 1e-4),
        (3.0, 1e-6),
    ];
    for (order, elements) in [(Order::Four, 4), (Order::Four, 32), (Order::Eight, 12)] {
        for (angle, curvature) in cases {
            let (mut rod, mut solver) = buckled(elements, order);
            assert!(rod.tip().x > 0.03 && rod.tip().y == 0.0, "{}", rod.tip());
            rod.set_intrinsic(|_| Vector3::new(-f64::sin(angle), f64::cos(angle), 0.0) * curvature);
            let found = solve(&mut solver, &mut rod);
            let error = (rod.tip().y.atan2(rod.tip().x) - angle).abs();
            println!("{order:?}, {angle} rad, {curvature} 1/m: {error:e} rad, {found:?}");
            assert!(
                found.iterations <= 50 && found.inertia.negative == 0,
                "{found:?}"
            );
            // The intrinsic curvature κ exerts couples of E I κ = 5e-7 κ N m about the vertical.
            // Rounding of the couples of the weight, 2e-16 of 1e-4 N m, therefore rotates the rod
            // by 5e-14/κ rad.
            assert!(found.error <= 1e-9 + 1e-12 / curvature, "{found:?}");
            assert!(
                error <= 2.0 * found.error + 1e-13 / curvature,
                "{error:e} {:e}",
                found.error
            );
        }
    }
}

/// At the angle π/2 the tangent is neutral. A search for any equilibrium ends in the plane of the
/// intrinsic curvature. The shape on the side to which the curvature bends the rod is stable, and
/// that on the other side is a saddle.
#[test]
fn neutral_shape_that_is_not_balanced_is_left_for_any_equilibrium() {
    let (mut rod, mut solver) = buckled(12, Order::Eight);
    rod.set_intrinsic(|_| Vector3::x() * -1e-4);
    solver.stable_only = false;
    let found = solve(&mut solver, &mut rod);
    let tip = rod.tip();
    // Rounding rotates the rod by 1e-13/κ, as above.
    assert!(
        tip.x.abs() < 1e-9 * tip.y.abs() && tip.y.abs() > 0.03,
        "{tip}"
    );
    assert_eq!(
        (found.inertia.negative, found.inertia.neutral),
        (usize::from(tip.y < 0.0), 0),
        "{found:?}"
    );
}
