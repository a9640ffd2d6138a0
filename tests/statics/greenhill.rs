//! Self-buckling of an upright shoot: Greenhill's length, and the equilibria below and above it.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::rods::{
    DENSITY, GRAVITY, Hanging, Known, bending_stiffness, cases, density_for, sag,
};
use crate::fixtures::shoots::{RADIUS, WEIGHT, YOUNG, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, Inertia, NewtonSolver};
use morphorod::integrator::{Adaptive, Integrator};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Value at the clamp, σ = 1, of the solution of θ'' + α σ θ = 0, θ(0) = 1, θ'(0) = 0, with σ from
/// apex to base. Its series is Σₖ (−α)^k / Π (3 j − 1)(3 j), with j = 1 … k.
fn at_the_clamp(alpha: f64) -> f64 {
    let factor = |k: i32| (3.0 * f64::from(k) - 1.0) * 3.0 * f64::from(k);
    (1..60)
        .rev()
        .fold(1.0, |sum, k| 1.0 - alpha / factor(k) * sum)
}

#[test]
fn greenhill_constant_is_the_first_zero_of_the_series() {
    let (mut low, mut high) = (7.0, 8.0);
    while high - low > 2.0 * f64::EPSILON * high {
        let middle = 0.5 * (low + high);
        if at_the_clamp(middle) > 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    // The rounding error of the sum is about 1e-16, and the slope at the zero is −0.09.
    assert_abs_diff_eq!(low, Weight::GREENHILL, epsilon = 1e-14);
}

struct Shoot {
    radius: f64,
    tissue: LinearElastic,
    density: f64,
    gravity: f64,
}

impl Shoot {
    fn default() -> Self {
        Self {
            radius: RADIUS,
            tissue: YOUNG,
            density: DENSITY,
            gravity: GRAVITY,
        }
    }

    fn scene(&self) -> Still {
        Still {
            gravity: Vector3::new(0.0, 0.0, -self.gravity),
            base: UnitQuaternion::identity(),
        }
    }

    /// Inertia of the straight upright shape.
    fn upright(&self, solver: &mut NewtonSolver, length: f64, elements: usize) -> Inertia {
        let scene = self.scene();
        let rod = Rod::uniform(length, self.radius, scene.base, elements, Order::default())
            .expect("a rod");
        let weight = Weight {
            density: self.density,
        };
        solver
            .inertia(&rod, &self.tissue, &weight, &scene.environment(0.0))
            .expect("an inertia")
    }

    /// Length (m) at which the tangent of the straight upright shape becomes indefinite.
    fn critical_length(&self, guess: f64) -> f64 {
        let mut solver = NewtonSolver::default();
        let (mut low, mut high) = (0.5 * guess, 1.5 * guess);
        assert_eq!(self.upright(&mut solver, low, 16).negative, 0);
        assert_eq!(self.upright(&mut solver, high, 16).negative, 2);
        while high - low > 1e-11 * high {
            let middle = 0.5 * (low + high);
            if self.upright(&mut solver, middle, 16).negative == 0 {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    }

    fn greenhill_length(&self) -> f64 {
        let weight = self.density * self.gravity * PI * self.radius.powi(2);
        (Weight::GREENHILL * self.tissue.youngs_modulus * PI * self.radius.powi(4) / 4.0 / weight)
            .cbrt()
    }
}

proptest! {
    #![proptest_config(cases(64))]
    #[test]
    fn random_upright_shoots_lose_stability_at_greenhills_length(
        (radius, modulus, density, gravity) in (-5.0..-1.0, 4.0..11.0, 1.0..4.0, -2.0..2.0),
        nu in -0.9..0.5,
    ) {
        let power = |x: f64| 10_f64.powf(x);
        let shoot = Shoot {
            radius: power(radius),
            tissue: LinearElastic { youngs_modulus: power(modulus), poissons_ratio: nu },
            density: power(density),
            gravity: power(gravity),
        };
        let exact = shoot.greenhill_length();
        let found = shoot.critical_length(exact);
        // The required relative accuracy is 1e-8.
        prop_assert!(relative_eq!(found, exact, epsilon = 0.0, max_relative = 1e-8), "{found} against {exact}");
    }
}

#[test]
fn default_shoot_buckles_at_7_93341251_cm() {
    let shoot = Shoot::default();
    // The length (Weight::GREENHILL · E r²/(4 ρ g))^(1/3), in metres, was computed in multiple
    // precision. It is accurate to half a unit of the last digit written here.
    assert_abs_diff_eq!(
        shoot.greenhill_length(),
        0.079_334_125_094,
        epsilon = 0.5e-12
    );
    // The required accuracy is 1e-8 of the length.
    assert_abs_diff_eq!(
        shoot.critical_length(0.08),
        0.079_334_125_094,
        epsilon = 1e-8 * 0.08
    );
}

#[test]
fn two_eigenvalues_change_sign_at_each_critical_length() {
    let shoot = Shoot::default();
    let critical = shoot.greenhill_length();
    let mut solver = NewtonSolver {
        stable_only: false,
        ..NewtonSolver::default()
    };
    let scene = shoot.scene();
    for elements in [4, 16, 64, 256] {
        for (ratio, negative) in [(0.5, 0), (1.0 - 1e-6, 0), (1.0 + 1e-6, 2), (1.05, 2)] {
            let mut rod = Rod::uniform(
                ratio * critical,
                RADIUS,
                scene.base,
                elements,
                Order::default(),
            )
            .expect("a rod");
            let straight = rod.clone();
            let weight = Weight { density: DENSITY };
            let found = solver
                .solve(&mut rod, &shoot.tissue, &weight, &scene.environment(0.0))
                .expect("an equilibrium");
            // The two negative directions are rotations about the two horizontal axes. A dead load
            // does not cause buckling in twist.
            assert_eq!(
                (found.inertia.negative, found.inertia.neutral),
                (negative, 0),
                "{elements} elements, {ratio}"
            );
            // The upright shape is an equilibrium by symmetry at every length. Its gradient is
            // exactly zero.
            assert_eq!(
                (found.iterations, rod),
                (1, straight),
                "{elements} elements, {ratio}"
            );
        }
    }
    // The number of buckled modes follows from Sturm's theorem. It is the number of sign changes of
    // the solution at the clamp as the load increases from zero. Each mode buckles in two planes.
    for load in [7.0, 30.0, 60.0, 140.0, 150.0, 280.0, 290.0] {
        let steps = 20_000;
        let signs = (1..=steps).map(|i| at_the_clamp(load * f64::from(i) / f64::from(steps)) > 0.0);
        let modes = signs
            .clone()
            .zip(signs.skip(1))
            .filter(|(a, b)| a != b)
            .count();
        let length = critical * (load / Weight::GREENHILL).cbrt();
        assert_eq!(
            shoot.upright(&mut solver, length, 16).negative,
            2 * modes,
            "load {load}"
        );
    }
}

/// Tolerance of the frames of a shoot with a nearly neutral rotation about the vertical, rad. With
/// a lean of 1.7e-4 rad, the stiffness to that rotation is a million times smaller than to bending.
/// Rounding is amplified to about 1e-10 rad.
const PRECISION: f64 = 1e-10;

/// Tip (outwards, up; m) of a default shoot in equilibrium, from the shooting method of the
/// fixture. Arguments are the length (m) and the tilt (rad).
fn hanging_tip(length: f64, tilt: f64) -> Known<[f64; 2]> {
    let weight = DENSITY * GRAVITY * PI * RADIUS * RADIUS;
    Hanging {
        length,
        tilt,
        stiffness: |_| bending_stiffness(),
        weight: |sigma| weight * sigma,
    }
    .tip(2000)
}

#[test]
fn tip_of_buckled_shoot_matches_shooting() {
    let critical = Shoot::default().greenhill_length();
    for (ratio, elements) in [(1.001, 16), (1.05, 16), (1.05, 64), (1.05, 256), (1.5, 32)] {
        let length = ratio * critical;
        // With a lean of a hundredth of a degree there is one stable shape. On an exactly upright
        // base, a rotation about the vertical is neutral. The solver must find one of these shapes
        // for every rotation of the base about its tangent.
        for (tilt, azimuth, neutral) in [
            (0.01_f64, 0.0, 0),
            (0.01, 0.7, 0),
            (0.0, 0.0, 1),
            (0.0, 0.7, 1),
            (0.0, 2.5, 1),
        ] {
            let mut scene = Still::tilted(tilt.to_radians());
            scene.base *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), azimuth);
            let [coarse, tip] = [elements / 2, elements].map(|elements| {
                let mut rod = Rod::uniform(length, RADIUS, scene.base, elements, Order::default())
                    .expect("a rod");
                let weight = Weight { density: DENSITY };
                let found = NewtonSolver::with_tolerance(PRECISION)
                    .solve(&mut rod, &YOUNG, &weight, &scene.environment(0.0))
                    .expect("an equilibrium");
                let signs = (found.inertia.negative, found.inertia.neutral);
                assert_eq!(
                    signs,
                    (0, neutral),
                    "{ratio}, {elements} elements, tilt {tilt}, azimuth {azimuth}"
                );
                [rod.tip().xy().norm(), rod.tip().z]
            });
            let known = hanging_tip(length, tilt.to_radians());
            // The bound contains the step error of the integration, the rounding of its 2 · 2000
            // additions, and the difference from a mesh with half as many elements. It also
            // contains three times the tolerance of the crate, which covers the uncertainty of its
            // estimate.
            let difference = (tip[0] - known.value[0]).hypot(tip[1] - known.value[1]);
            let mesh = (tip[0] - coarse[0]).hypot(tip[1] - coarse[1]);
            let promised = known.error + mesh + (3.0 * PRECISION + 4000.0 * f64::EPSILON) * length;
            assert!(
                difference < promised,
                "{ratio}, tilt {tilt}: {difference:e} against {promised:e}"
            );
            assert!(
                promised < 1e-7 * length,
                "{ratio}, tilt {tilt}: the bound is too large, {promised:e}"
            );
        }
    }
}

#[test]
fn hanging_straight_shoot_is_stable_at_any_weight() {
    let scene = Still::tilted(PI);
    for load in [1.0, 100.0, 1e4, 1e6] {
        let mut rod = Rod::uniform(0.1, RADIUS, scene.base, 16, Order::default()).expect("a rod");
        let found = sag(&mut rod, density_for(load, 0.1), &scene);
        assert_eq!(
            (found.inertia.negative, found.inertia.neutral),
            (0, 0),
            "load {load}"
        );
        // The rounding of π tilts the base by 1.2e-16 rad.
        let expected = Vector3::z() * -0.1;
        assert!(
            abs_diff_eq!(
                InNorm(rod.tip()),
                InNorm(expected),
                epsilon = 4.0 * f64::EPSILON * 0.1
            ),
            "load {load}: {} against {expected}",
            rod.tip()
        );
    }
}

/// Solves for the equilibrium of an upright default shoot to a tolerance. The length is given in
/// units of the critical length. Returns the error of the tip relative to the length, its estimate,
/// and the number of elements. The reference is the shooting method of the fixture.
fn by_tolerance(order: Order, ratio: f64, tolerance: f64) -> (f64, f64, usize) {
    let length = ratio * Shoot::default().greenhill_length();
    let mut shoot = rod(YOUNG, length)
        .order(order)
        .load(WEIGHT)
        .into_dyn()
        .build()
        .expect("a shoot");
    let found = Adaptive::new(tolerance)
        .advance(&mut shoot, 0.0)
        .expect("an equilibrium");
    // The shoot is upright, or bent in the plane of d1 to either side.
    let known = if ratio < 1.0 {
        [0.0, length]
    } else {
        hanging_tip(length, 0.0).value
    };
    let off = [
        shoot.tip().x.abs() - known[0].abs(),
        shoot.tip().y,
        shoot.tip().z - known[1],
    ];
    (
        Vector3::from(off).norm() / length,
        found.error.expect("an estimate"),
        shoot.rod().elements(),
    )
}

#[test]
fn buckled_shoot_meets_the_tolerance_without_leaving_its_plane() {
    for (order, most) in [(Order::Four, 100), (Order::Eight, 12)] {
        for over in [3e-2, 1e-2, 3e-3, 1e-3] {
            for tolerance in [1e-3, 1e-4, 1e-5] {
                let (error, estimate, elements) = by_tolerance(order, 1.0 + over, tolerance);
                assert!(
                    error <= estimate && estimate <= tolerance,
                    "{order:?}, {over:e}: {error:e}, {estimate:e}"
                );
                // A rotation about the vertical would count as an error and cause refinement to
                // hundreds of elements.
                assert!(
                    elements <= most,
                    "{order:?}, {over:e}, {tolerance:e}: {elements} elements"
                );
            }
        }
    }
}

#[test]
fn adaptive_mesh_detects_buckling_that_a_coarse_mesh_misses() {
    // Three elements of order two remain upright up to 1.4 percent above the critical length. There
    // the tip of the exact shape is displaced sideways by 40 percent of the length. Elements of
    // higher order also remain upright, up to smaller lengths.
    for order in Order::ALL {
        for over in [1e-2, 3e-3, 1e-3, 1e-4, 1e-5] {
            let (error, estimate, _) = by_tolerance(order, 1.0 + over, 1e-3);
            assert!(
                error <= estimate && estimate <= 1e-3,
                "{order:?}, {over:e}: {error:e}, {estimate:e}"
            );
        }
        // Below the critical length the computed shape is upright, to rounding.
        for below in [1e-2, 1e-3, 1e-5] {
            let (error, estimate, elements) = by_tolerance(order, 1.0 - below, 1e-3);
            assert!(
                error < 4000.0 * f64::EPSILON && estimate <= 1e-3 && elements <= 200,
                "{order:?}, {below:e}: {error:e}, {elements}"
            );
        }
    }
}
