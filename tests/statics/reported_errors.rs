//! The error that the solver reports bounds the actual error of random shoots. A search that fails
//! reports a wrong elastic law.

use crate::fixtures::rods::{LENGTH, bending_stiffness, cases};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG};
use morphorod::check::Quantity;
use morphorod::constitutive::{Constitutive, ElasticResponse, LinearElastic, Tissue};
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::load::{ApicalForce, Load};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

proptest! {
    #![proptest_config(cases(256))]
    #[test]
    fn reported_error_bounds_the_actual_error_of_random_shoots(
        turn in prop::array::uniform3(-3.0..3.0_f64),
        bend in prop::array::uniform3(-1.0..1.0_f64),
        pull in prop::array::uniform3(-1.0..1.0_f64),
        (size, exponent) in (-2.5..0.5_f64, -11.0..-2.0_f64),
        (loaded, heavy) in (any::<bool>(), any::<bool>()),
    ) {
        let size = 10_f64.powf(size);
        let base = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let mut rod = Rod::uniform(LENGTH, RADIUS, base, 12, Order::default()).expect("a rod");
        let strain = Vector3::from(bend) * (size / LENGTH);
        rod.set_intrinsic(|_| strain);
        let unit = 3.0 * bending_stiffness() / (LENGTH * LENGTH);
        let force = if loaded { Vector3::from(pull) * (size * unit) } else { Vector3::zeros() };
        let loads = (heavy.then_some(WEIGHT), ApicalForce(move |_: f64| force));
        let environment = Still::upright().environment(0.0);
        let (law, load): (&dyn Constitutive, &dyn Load) = (&YOUNG, &loads);

        let tolerance = 10_f64.powf(exponent);
        let found = NewtonSolver::with_tolerance(tolerance).solve(&mut rod, &law, &load, &environment);
        let found = found.expect("an equilibrium");
        prop_assert!(found.error <= tolerance, "{:e} is more than {tolerance:e}", found.error);
        let mut settled = rod.clone();
        let best = NewtonSolver::with_tolerance(1e-12).solve(&mut settled, &law, &load, &environment);
        let best = best.expect("an equilibrium");
        let left = rod.frames().iter().zip(settled.frames()).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
        // The factor of ten is used because an estimate from the last two steps gives only the
        // order of magnitude. The bound also contains the error of the better solution, and
        // rounding amplified by the softest direction.
        let bound = 10.0 * (found.error + best.error) + 8.0 * f64::EPSILON / best.inertia.margin;
        prop_assert!(left < bound, "the actual error is {left:e}, {:e} is reported", found.error);
    }
}

#[test]
fn solver_that_fails_reports_the_wrong_tangent() {
    // With 0.3 of the tangent Newton's steps are three times as long as they should be.
    struct Soft(LinearElastic);
    impl Constitutive for Soft {
        fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
            let response = self.0.respond(tissue, strain);
            let tangent = Matrix3::from_diagonal(
                &response.tangent.diagonal().map(|stiffness| 0.3 * stiffness),
            );
            ElasticResponse {
                tangent,
                ..response
            }
        }
    }
    let mut rod = Rod::uniform(0.05, 5e-4, UnitQuaternion::identity(), 4, Order::Eight).unwrap();
    let (law, load) = (Soft(YOUNG), WEIGHT);
    let environment = Still::upright().environment(0.0);
    let force = (load, ApicalForce(|_: f64| Vector3::new(1e-3, 0.0, 0.0)));
    let found = NewtonSolver::default().solve(&mut rod, &law, &force, &environment);
    let Err(EquilibriumError::Law(error)) = found else {
        panic!("{found:?}")
    };
    assert_eq!(error.quantity, Quantity::Tangent(0, 0));
}
