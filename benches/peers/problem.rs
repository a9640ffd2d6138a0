//! Benchmark problem: a rod with a clamped horizontal base that bends under its own weight, in
//! three dimensions.

use std::time::Instant;

use nalgebra::Vector3;

/// Length, m.
pub const LENGTH: f64 = 0.0659;
/// Radius, m.
pub const RADIUS: f64 = 5e-4;
/// Young's modulus, Pa.
pub const MODULUS: f64 = 1e7;
/// Poisson's ratio.
pub const POISSON: f64 = 0.5;
/// Gravitational acceleration, m/s².
pub const GRAVITY: f64 = 9.81;
/// Density of the shoots in the paper, kg/m³.
pub const DENSITY: f64 = 1000.0;

/// Dimensionless load q̂ = q ℓ³/(E I) for a density, kg/m³. It determines the shape relative to the
/// length.
pub fn load_of(density: f64) -> f64 {
    // q/(E I) = ρ g π r² / (E π r⁴/4).
    4.0 * density * GRAVITY / (MODULUS * RADIUS * RADIUS) * LENGTH.powi(3)
}

/// Position of the tip (outwards, transverse, up) for [`DENSITY`], divided by the length; see
/// `tests/statics/horizontal_base.rs`.
pub fn exact_tip() -> Vector3<f64> {
    Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89) / LENGTH
}

/// Program with one setting. `solve` returns the tip divided by the length, from a straight initial
/// guess, or `None` if it does not converge. Preparations that are independent of the rod are made
/// in advance.
pub struct Candidate {
    pub peer: String,
    pub setting: String,
    pub solve: Box<dyn FnMut() -> Option<Vector3<f64>>>,
}

/// Result of a candidate.
pub struct Run {
    pub peer: String,
    pub setting: String,
    /// Distance of the tip from the exact position, divided by the length. NaN if the candidate
    /// does not converge.
    pub error: f64,
    /// Shortest run time, s.
    pub seconds: f64,
}

/// Measures the candidates in alternation, so that other programs affect all of them equally, and
/// keeps the shortest run times.
pub fn race(candidates: &mut [Candidate], rounds: usize, exact: Vector3<f64>) -> Vec<Run> {
    let mut seconds = vec![f64::INFINITY; candidates.len()];
    let mut errors = vec![f64::NAN; candidates.len()];
    for _ in 0..rounds {
        for (k, one) in candidates.iter_mut().enumerate() {
            let clock = Instant::now();
            let tip = (one.solve)();
            seconds[k] = seconds[k].min(clock.elapsed().as_secs_f64());
            errors[k] = tip.map_or(f64::NAN, |tip| (tip - exact).norm());
        }
    }
    let numbers = errors.into_iter().zip(seconds);
    let named = candidates
        .iter()
        .map(|one| (one.peer.clone(), one.setting.clone()));
    named
        .zip(numbers)
        .map(|((peer, setting), (error, seconds))| Run {
            peer,
            setting,
            error,
            seconds,
        })
        .collect()
}
