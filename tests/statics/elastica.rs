//! Euler's elastica: the cantilever under a transverse end load and the column, compared with
//! elliptic integrals.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::rods::{bending_stiffness, cases, solve_tight, weightless};
use crate::fixtures::shoots::{RADIUS, YOUNG};
use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, Inertia, NewtonSolver};
use morphorod::load::{ApicalForce, Load};
use morphorod::rod::Rod;
use morphorod::{Order, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Carlson's integrals RF and RD, computed to rounding by duplication. Reference: B. C. Carlson
/// (1979), Numer. Math. 33, 1–16.
fn carlson(mut x: f64, mut y: f64, mut z: f64) -> (f64, f64) {
    let (mut sum, mut factor) = (0.0, 1.0);
    // Each iteration reduces the differences of the arguments by a factor of four. After thirty
    // iterations the arguments are equal to rounding.
    for _ in 0..30 {
        let lambda = (x * y).sqrt() + (x * z).sqrt() + (y * z).sqrt();
        sum += factor / (z.sqrt() * (z + lambda));
        factor *= 0.25;
        (x, y, z) = (
            0.25 * (x + lambda),
            0.25 * (y + lambda),
            0.25 * (z + lambda),
        );
    }
    (1.0 / z.sqrt(), 3.0 * sum + factor / (z * z.sqrt()))
}

/// Legendre's incomplete integrals F(φ, k) and E(φ, k). They are complete for φ = π/2.
pub(super) fn legendre(phi: f64, k: f64) -> (f64, f64) {
    let (sin, cos) = phi.sin_cos();
    let (rf, rd) = carlson(cos * cos, 1.0 - (k * sin).powi(2), 1.0);
    let first = sin * rf;
    (first, first - k * k * sin.powi(3) * rd / 3.0)
}

#[test]
fn elliptic_integrals_match_the_printed_tables() {
    // Abramowitz and Stegun, tables 17.1 and 17.2 (m = 0.5) and 17.5, 17.6 (φ = 30°, α = 60°), to
    // the digits printed.
    let (k, e) = legendre(FRAC_PI_2, 0.5_f64.sqrt());
    assert_abs_diff_eq!(k, 1.854_074_677_301_372, epsilon = 4e-15);
    assert_abs_diff_eq!(e, 1.350_643_881_047_676, epsilon = 4e-15);
    let (f, e) = legendre(PI / 6.0, 0.75_f64.sqrt());
    assert_abs_diff_eq!(f, 0.542_229_11, epsilon = 0.5e-8);
    assert_abs_diff_eq!(e, 0.506_092_07, epsilon = 0.5e-8);
}

/// Length of the rods of this file, m. The results do not depend on it.
const SPAN: f64 = 0.1;

fn straight(elements: usize, base: UnitQuaternion<f64>) -> Rod {
    Rod::uniform(SPAN, RADIUS, base, elements, Order::default()).expect("a rod")
}

/// Force on the apex, in units of E I/ℓ².
fn apical(x: f64, y: f64, z: f64) -> ApicalForce<impl Fn(f64) -> Vector3<f64>> {
    let force = Vector3::new(x, y, z) * (bending_stiffness() / (SPAN * SPAN));
    ApicalForce(move |_| force)
}

/// Projection and deflection of the tip, relative to the length, and end slope (rad) of a
/// cantilever along e1. The transverse end load is P = `load` · E I/ℓ² along −e3. Reference: K. E.
/// Bisshopp and D. C. Drucker (1945), Quart. Appl. Math. 3, 272–275.
pub(super) fn bisshopp_drucker(load: f64) -> [f64; 3] {
    let root = load.sqrt();
    let start = |k: f64| (0.5_f64.sqrt() / k).min(1.0).asin();
    let (mut low, mut high) = (0.5_f64.sqrt(), 1.0);
    while high - low > f64::EPSILON {
        let k = 0.5 * (low + high);
        let span = legendre(FRAC_PI_2, k).0 - legendre(start(k), k).0;
        if span < root { low = k } else { high = k }
    }
    let k = 0.5 * (low + high);
    let (complete, part) = (legendre(FRAC_PI_2, k).1, legendre(start(k), k).1);
    let sine = 2.0 * k * k - 1.0;
    [
        (2.0 * sine).sqrt() / root,
        1.0 - 2.0 / root * (complete - part),
        sine.asin(),
    ]
}

#[test]
fn elliptic_integrals_reproduce_mattiassons_table_of_the_cantilever() {
    // K. Mattiasson (1981), Int. J. Numer. Meth. Engng 17, 145–153, table 1: load, 1 − projection,
    // deflection, end slope.
    for (load, shortening, deflection, slope) in [
        (1.0, 0.05643, 0.30172, 0.46135),
        (2.0, 0.16064, 0.49346, 0.78175),
        (5.0, 0.38763, 0.71379, 1.21537),
        (10.0, 0.55500, 0.81061, 1.43029),
    ] {
        let [x, z, angle] = bisshopp_drucker(load);
        let (found, printed) = (
            Vector3::new(1.0 - x, z, angle),
            Vector3::new(shortening, deflection, slope),
        );
        // Half a unit of the last printed digit bounds each component.
        assert!(
            abs_diff_eq!(found, printed, epsilon = 0.5e-5),
            "load {load}: {found} against {printed}"
        );
    }
}

#[test]
fn cantilever_under_an_end_load_matches_elliptic_integrals() {
    let base = Still::tilted(FRAC_PI_2).base;
    for load in [0.1, 1.0, 2.0, 5.0, 10.0, 20.0] {
        let [x, z, slope] = bisshopp_drucker(load);
        let miss = |elements: usize| {
            let mut rod = straight(elements, base);
            let pull = apical(0.0, 0.0, -load);
            let found =
                solve_tight(&mut rod, &YOUNG, &pull, &weightless()).expect("an equilibrium");
            assert_eq!(found.inertia.negative, 0);
            let end = Still::tilted(FRAC_PI_2 + slope).base;
            let tip = rod.tip() / SPAN - Vector3::new(x, 0.0, -z);
            tip.norm().max(rod.apex_frame().angle_to(&end))
        };
        // At order 8 the error of eight elements decreases by 2⁸ or more with sixteen elements, and
        // again with 32. The rounding of the crate and of the integrals is 1e-14. The modulus of
        // the integrals is accurate to 2e-16. For small loads its error is amplified by 1/load.
        let (coarse, fine) = (miss(8), miss(32));
        let promised = coarse / 256.0 + 1e-14 / load.min(1.0);
        assert!(
            coarse < 1e-8 && fine < promised,
            "load {load}: {coarse:e} with 8 elements, {fine:e} with 32"
        );
    }
}

/// Linear law with the stiffnesses to bending about d1 and d2 and to twist, N m².
struct Section(Vector3<f64>);

impl Constitutive for Section {
    fn respond(&self, _tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let couple = self.0.component_mul(strain);
        ElasticResponse {
            energy: 0.5 * couple.dot(strain),
            couple,
            tangent: Matrix3::from_diagonal(&self.0),
        }
    }
}

/// Inertia of the tangent of the straight column under an axial load, positive downwards, in units
/// of E I/ℓ².
fn axial(solver: &mut NewtonSolver, material: &dyn Constitutive, load: f64) -> Inertia {
    let rod = straight(16, UnitQuaternion::identity());
    let push: &dyn Load = &apical(0.0, 0.0, -load);
    solver
        .inertia(&rod, &material, &push, &weightless())
        .expect("an inertia")
}

/// Load at which the number of negative eigenvalues exceeds `count`, in units of E I/ℓ².
fn critical(material: &dyn Constitutive, count: usize, (mut low, mut high): (f64, f64)) -> f64 {
    let mut solver = NewtonSolver::default();
    while high - low > 1e-11 * high {
        let middle = 0.5 * (low + high);
        if axial(&mut solver, material, middle).negative <= count {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

proptest! {
    #![proptest_config(cases(32))]
    #[test]
    fn column_buckles_at_eulers_loads_about_the_weaker_axis_first(
        ratio in 1.1..8.0_f64, torsion in 0.1..10.0_f64,
    ) {
        // L. Euler (1744), Methodus inveniendi, additamentum I: P = π² E I/(4 ℓ²) for a column
        // clamped at its foot.
        let euler = PI * PI / 4.0;
        let weak = bending_stiffness();
        let stiffness = Vector3::new(ratio * weak, weak, torsion * weak);
        let first = critical(&Section(stiffness), 0, (0.1, 4.0));
        let second = critical(&Section(stiffness), 1, (0.5 * ratio * euler, 2.0 * ratio * euler));
        // The required relative accuracy is 1e-8. The second mode of the weak plane, at 9 times the
        // first load, is above the second load.
        prop_assert!(relative_eq!(first, euler, epsilon = 0.0, max_relative = 1e-8), "{first} against {euler}");
        let expected = ratio * euler;
        prop_assert!(relative_eq!(second, expected, epsilon = 0.0, max_relative = 1e-8), "{second} against {expected}");
    }
}

#[test]
fn each_euler_load_adds_two_negative_eigenvalues_and_tension_adds_none() {
    let mut solver = NewtonSolver::default();
    let euler = |mode: f64| ((2.0 * mode - 1.0) * FRAC_PI_2).powi(2);
    for (mode, negative) in [(1.0, 2), (2.0, 4), (3.0, 6)] {
        // The discretisation error of an eigenvalue with 16 elements of order p = 8 is of order
        // h²ᵖ. It is far below 1e-6.
        assert_eq!(
            axial(&mut solver, &YOUNG, euler(mode) * (1.0 - 1e-6)).negative,
            negative - 2
        );
        assert_eq!(
            axial(&mut solver, &YOUNG, euler(mode) * (1.0 + 1e-6)).negative,
            negative
        );
    }
    for tension in [0.0, 1.0, 100.0, 1e6] {
        let signs = axial(&mut solver, &YOUNG, -tension);
        assert_eq!((signs.negative, signs.neutral), (0, 0), "tension {tension}");
    }
}

#[test]
fn buckled_column_matches_the_elastica() {
    // Reference: A. E. H. Love, Treatise on the Mathematical Theory of Elasticity, section 263.
    // With p the sine of half the slope at the apex, the load is K(p)² E I/ℓ². In units of ℓ, the
    // height is 2 E(p)/K(p) − 1 and the deflection is 2 p/K(p).
    for degrees in [20.0_f64, 60.0, 120.0, 150.0] {
        let p = (0.5 * degrees.to_radians()).sin();
        let (k, e) = legendre(FRAC_PI_2, p);
        let miss = |elements: usize| {
            let mut rod = straight(elements, UnitQuaternion::identity());
            let push = apical(0.0, 0.0, -k * k);
            let found =
                solve_tight(&mut rod, &YOUNG, &push, &weightless()).expect("an equilibrium");
            // The shape is stable, and a rotation about the load is neutral.
            assert_eq!(
                (found.inertia.negative, found.inertia.neutral),
                (0, 1),
                "{degrees}°"
            );
            let (tip, up) = (rod.tip() / SPAN, rod.apex_frame() * Vector3::z());
            let slope = up.xy().norm().atan2(up.z) - degrees.to_radians();
            (tip.xy().norm() - 2.0 * p / k)
                .hypot(tip.z - 2.0 * e / k + 1.0)
                .max(slope.abs())
        };
        // The bound is that of the cantilever. Near the critical load, the amplitude amplifies
        // rounding by 1/p².
        let (coarse, fine) = (miss(16), miss(64));
        let promised = coarse / 256.0 + 1e-14 / (p * p);
        assert!(
            coarse < 1e-9 && fine < promised,
            "{degrees}°: {coarse:e} with 16 elements, {fine:e} with 64"
        );
    }
}

#[test]
fn lateral_force_selects_the_direction_of_buckling() {
    // At 1.6 times the critical load, a lateral force of 1e-4 of the load selects the direction.
    for azimuth in [0.0, 1.0, 2.5, 4.0] {
        let (sin, cos) = f64::sin_cos(azimuth);
        let mut rod = straight(16, UnitQuaternion::identity());
        let push = apical(4e-4 * cos, 4e-4 * sin, -4.0);
        let (law, push): (&dyn Constitutive, &dyn Load) = (&YOUNG, &push);
        let found = NewtonSolver::default()
            .solve(&mut rod, &law, &push, &weightless())
            .expect("an equilibrium");
        assert_eq!(
            (found.inertia.negative, found.inertia.neutral),
            (0, 0),
            "azimuth {azimuth}"
        );
        let (tip, sideways) = (
            rod.tip() / SPAN,
            (rod.tip().y * cos - rod.tip().x * sin) / SPAN,
        );
        // Only the lateral force resists a rotation of the plane of bending. Its pivot is the
        // smallest one, and the inverse of its margin amplifies rounding.
        let promised = 3.0 * found.error + 4.0 * f64::EPSILON / found.inertia.margin;
        assert!(
            sideways.abs() < promised,
            "azimuth {azimuth}: {sideways:e} against {promised:e}"
        );
        assert!(
            promised < 1e-8 && tip.x * cos + tip.y * sin > 0.5,
            "azimuth {azimuth}: {tip:?}, {promised:e}"
        );
    }
}
