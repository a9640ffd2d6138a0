//! The error that the solver reports bounds the actual error of random shoots.

use crate::fixtures::rods::{DENSITY, LENGTH, RADIUS, bending_stiffness, cases, young_tissue};
use morphorod::constitutive::Constitutive;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::{ApicalForce, Load, Weight};
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};
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
        let loads = (heavy.then_some(Weight { density: DENSITY }), ApicalForce(move |_: f64| force));
        let environment = Still::upright().environment(0.0);
        let (law, load): (&dyn Constitutive, &dyn Load) = (&young_tissue(), &loads);

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
