//! What the tests of equilibria share: the default shoot, and two integrators that know nothing of the crate's method.
// Every test file is a crate of its own and uses its own part of this.
#![allow(dead_code)]

use std::f64::consts::PI;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{Equilibrium, EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Environment, Scene, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::ProptestConfig;

/// The default shoot of Agostinelli, DeSimone and Noselli (2021), doi 10.3389/fpls.2021.608005: radius (m), density
/// (kg/m³), Young's modulus (Pa), gravity (m/s²), and the length (m) at which the shoot is sagged and its orbits computed.
pub const RADIUS: f64 = 5e-4;
pub const DENSITY: f64 = 1000.0;
pub const MODULUS: f64 = 1e7;
pub const GRAVITY: f64 = 9.81;
pub const LENGTH: f64 = 0.0659;
/// A tolerance (rad) that leaves no algebraic error to see.
pub const TIGHT: f64 = 1e-14;

/// A property test of `cases` random cases. A failing one is printed, and not written to a file.
pub fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// The default tissue: E = 10 MPa, ν = 0.5.
pub fn young_tissue() -> LinearElastic {
    LinearElastic { youngs_modulus: MODULUS, poissons_ratio: 0.5 }
}

/// E I of the default shoot, N m².
pub fn bending_stiffness() -> f64 {
    MODULUS * PI * RADIUS.powi(4) / 4.0
}

/// The density (kg/m³) that gives a default shoot of the given length (m) the load q̂ = q ℓ³/(E I).
pub fn density_for(q_hat: f64, length: f64) -> f64 {
    q_hat * bending_stiffness() / length.powi(3) / (GRAVITY * PI * RADIUS * RADIUS)
}

/// A Newton solver without visible algebraic error.
pub fn tight() -> NewtonSolver {
    NewtonSolver::with_tolerance(TIGHT)
}

/// Lets a rod of default tissue sag under its weight, with a tight tolerance.
pub fn sag(rod: &mut Rod, density: f64, scene: &Still) -> Equilibrium {
    tight().solve(rod, &young_tissue(), &Weight { density }, &scene.environment(0.0)).expect("sags")
}

/// The environment of a scene without gravity.
pub fn weightless() -> Environment {
    Still::weightless().environment(0.0)
}

/// A number with the error that its own refinement shows.
#[derive(Debug, Clone, Copy)]
pub struct Known<T> {
    pub value: T,
    pub error: f64,
}

/// A rod in a vertical plane under its weight, integrated from the apex to the base by the classical fourth-order
/// method of Runge and Kutta.
///
/// With ψ the angle of the tangent from *downwards* and σ the distance from the apex, B ψ' = M, M' = N sin ψ, where
/// N(σ) is the weight beyond σ; ψ is what the apex is asked for, M(0) = 0. The equation is E I θ'' + q (ℓ − s) sin θ = 0
/// with θ = π − ψ. Measured from downwards, the tiny angles of the apex of a heavy rod keep all their digits.
pub struct Hanging<B, N> {
    pub length: f64,
    /// Angle of the base from upright, rad.
    pub tilt: f64,
    /// Bending stiffness at distance σ from the apex, N m².
    pub stiffness: B,
    /// Weight beyond distance σ from the apex, N.
    pub weight: N,
}

impl<B: Fn(f64) -> f64, N: Fn(f64) -> f64> Hanging<B, N> {
    /// ψ at the base, and the tip seen from the base (outwards, up), for the angle ψ at the apex.
    fn shoot(&self, apex: f64, steps: usize) -> (f64, [f64; 2]) {
        let h = self.length / steps as f64;
        let rate = |sigma: f64, y: &[f64; 4]| {
            let (sin, cos) = y[0].sin_cos();
            [y[1] / (self.stiffness)(sigma), (self.weight)(sigma) * sin, sin, -cos]
        };
        let mut y = [apex, 0.0, 0.0, 0.0];
        let along = |y: &[f64; 4], k: &[f64; 4], f: f64| std::array::from_fn(|i| y[i] + f * k[i]);
        for i in 0..steps {
            let sigma = h * i as f64;
            let k1 = rate(sigma, &y);
            let k2 = rate(sigma + 0.5 * h, &along(&y, &k1, 0.5 * h));
            let k3 = rate(sigma + 0.5 * h, &along(&y, &k2, 0.5 * h));
            let k4 = rate(sigma + h, &along(&y, &k3, h));
            y = std::array::from_fn(|j| y[j] + h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]));
        }
        (y[0], [y[2], y[3]])
    }

    /// The tip for which the base has the given tilt: the solution that hangs lowest, which is the stable one.
    fn tip_with(&self, steps: usize) -> [f64; 2] {
        // ψ = 4 atan(exp v) covers angles from 1e-35 at v = -80 to π at v = 0.
        let apex = |v: f64| 4.0 * v.exp().atan();
        let miss = |v: f64, steps: usize| self.shoot(apex(v), steps).0 - (PI - self.tilt);
        let mut high = -80.0;
        while miss(high, steps / 8) < 0.0 && high < 0.0 {
            high += 0.25;
        }
        // The coarse scan may be off by its own error: widen the bracket by a step on either side.
        let (mut low, mut high) = (high - 0.5, (high + 0.25_f64).min(0.0));
        while high - low > 4.0 * f64::EPSILON * low.abs().max(1e-9) {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if miss(middle, steps) < 0.0 { low = middle } else { high = middle }
        }
        self.shoot(apex(0.5 * (low + high)), steps).1
    }

    /// The tip (outwards, up) in m, extrapolated from two runs after Richardson. Their difference is 15/16 of the
    /// coarser one's error and so bounds that of the extrapolated value.
    pub fn tip(&self, steps: usize) -> Known<[f64; 2]> {
        let (coarse, fine) = (self.tip_with(steps), self.tip_with(2 * steps));
        let value = std::array::from_fn(|i| fine[i] + (fine[i] - coarse[i]) / 15.0);
        Known { value, error: (fine[0] - coarse[0]).hypot(fine[1] - coarse[1]) }
    }
}

/// Frame (as a matrix), couple (fixed frame) and position along a rod in space.
type Station = (Matrix3<f64>, Vector3<f64>, Vector3<f64>);

/// Integrates equations (1) and (11) from the free apex to the base: R' = R û, m' = n × d3, p' = d3, with
/// `strain(s, couple along the directors)` the elastic law solved for u and `force(s)` the known n(s).
///
/// From the right apex frame it arrives at the clamped base: whatever shape a solver finds can be checked without
/// its method. Returns the frame at the base, and the tip as seen from the base.
pub fn back_to_base(
    length: f64,
    apex: &UnitQuaternion<f64>,
    steps: usize,
    strain: impl Fn(f64, &Vector3<f64>) -> Vector3<f64>,
    force: impl Fn(f64) -> Vector3<f64>,
) -> Known<(Matrix3<f64>, Vector3<f64>)> {
    back_to_base_of_line(length, apex, steps, strain, |_, _| Vector3::z(), force)
}

/// The same for a rod that shears and stretches, p' = R v and m' = n × p', with `line(s, force along the directors)` the elastic
/// law solved for v.
pub fn back_to_base_of_line(
    length: f64,
    apex: &UnitQuaternion<f64>,
    steps: usize,
    strain: impl Fn(f64, &Vector3<f64>) -> Vector3<f64>,
    line: impl Fn(f64, &Vector3<f64>) -> Vector3<f64>,
    force: impl Fn(f64) -> Vector3<f64>,
) -> Known<(Matrix3<f64>, Vector3<f64>)> {
    let rate = |s: f64, (r, m, _): &Station| -> Station {
        let n = force(s);
        let along = r * line(s, &r.tr_mul(&n));
        (r * strain(s, &r.tr_mul(m)).cross_matrix(), n.cross(&along), along)
    };
    let along = |y: &Station, k: &Station, f: f64| -> Station { (y.0 + k.0 * f, y.1 + k.1 * f, y.2 + k.2 * f) };
    let run = |steps: usize| {
        let h = -length / steps as f64;
        let mut y: Station = (apex.to_rotation_matrix().into_inner(), Vector3::zeros(), Vector3::zeros());
        for i in 0..steps {
            let s = length + h * i as f64;
            let k1 = rate(s, &y);
            let k2 = rate(s + 0.5 * h, &along(&y, &k1, 0.5 * h));
            let k3 = rate(s + 0.5 * h, &along(&y, &k2, 0.5 * h));
            let k4 = rate(s + h, &along(&y, &k3, h));
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                y = along(&y, &k, weight * h / 6.0);
            }
        }
        (y.0, -y.2)
    };
    let (coarse, fine) = (run(steps), run(2 * steps));
    let value = (fine.0 + (fine.0 - coarse.0) / 15.0, fine.1 + (fine.1 - coarse.1) / 15.0);
    Known { value, error: (fine.0 - coarse.0).norm().max((fine.1 - coarse.1).norm() / length) }
}
