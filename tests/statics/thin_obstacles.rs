//! Poles that are thinner than the distance of the places at which contact is evaluated.

use crate::fixtures::rods::RADIUS;
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumError, Held, NewtonSolver};
use morphorod::rod::Rod;
use morphorod::support::{Contact, Cylinder};
use morphorod::{Order, Scene, Still};
use nalgebra::Vector3;

const LENGTH: f64 = 0.05;

/// An upright weightless rod that bends towards a pole of a radius (m) across it.
fn bent_towards_a_pole(radius: f64, elements: usize) -> Result<Held, EquilibriumError> {
    bent(NewtonSolver::default(), radius, elements)
}

/// As [`bent_towards_a_pole`], with any solver.
fn bent(mut solver: NewtonSolver, radius: f64, elements: usize) -> Result<Held, EquilibriumError> {
    let still = Still { base: Still::tilted(0.0).base, ..Still::weightless() };
    let tissue = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
    let mut rod = Rod::uniform(LENGTH, RADIUS, still.base, elements, Order::Eight).unwrap();
    rod.set_intrinsic(|_| Vector3::y() * 30.0);
    let pole = Cylinder { through: Vector3::new(0.08, 0.0, 0.6) * LENGTH, along: Vector3::y(), radius };
    let support = Contact { obstacle: pole, radius: 0.0, friction: 0.0 };
    solver.solve_held(&mut rod, &tissue, &(), &support, &still.environment(0.0))
}

#[test]
fn rod_touches_a_pole_that_is_thinner_than_the_distance_of_its_stations() {
    // The distance of the stations is 0.05 of the length with eight elements.
    let thick = bent_towards_a_pole(2e-2 * LENGTH, 8).unwrap();
    for radius in [1e-2, 4e-3] {
        let held = bent_towards_a_pole(radius * LENGTH, 8).unwrap();
        assert_eq!(held.reactions.len(), 1);
        // The shape changes by about the radius.
        let moved = (held.rod.tip() - thick.rod.tip()).norm();
        assert!(moved < 0.05 * LENGTH, "{moved}");
    }
}

#[test]
fn rod_never_passes_through_a_thin_pole() {
    // The free shape is on the other side: its tip has x = 0.62 of the length, that of the rod at the pole 0.33.
    // The smallest radius takes 450 iterations.
    for radius in [2e-3, 2e-4, 1e-4, 2e-5] {
        for elements in [4, 8, 32] {
            let held = bent_towards_a_pole(radius * LENGTH, elements).unwrap();
            assert!(held.rod.tip().x < 0.4 * LENGTH, "{radius} {elements}");
        }
    }
    // The search does not reach the thinnest pole in the permitted number of iterations.
    let solver = NewtonSolver { max_iterations: 100, ..NewtonSolver::default() };
    let thinnest = bent(solver, 2e-5 * LENGTH, 8);
    assert!(thinnest.is_err_and(|error| matches!(error, EquilibriumError::NoConvergence { .. })));
}
