//! The problem that all solve: a rod with a clamped horizontal base that bends under its own weight, in three dimensions.

use std::time::Instant;

use nalgebra::Vector3;

/// Length and radius, m; Young's modulus, Pa; Poisson's ratio; gravity, m/s².
pub const LENGTH: f64 = 0.0659;
pub const RADIUS: f64 = 5e-4;
pub const MODULUS: f64 = 1e7;
pub const POISSON: f64 = 0.5;
pub const GRAVITY: f64 = 9.81;
/// The density of the shoots of the paper, kg/m³.
pub const DENSITY: f64 = 1000.0;

/// The load q̂ = q ℓ³/(E I) of a density, kg/m³: what alone the shape depends on, in units of the length.
pub fn load_of(density: f64) -> f64 {
    // q/(E I) = ρ g π r² / (E π r⁴/4).
    4.0 * density * GRAVITY / (MODULUS * RADIUS * RADIUS) * LENGTH.powi(3)
}

/// The tip (outwards, across, up) under the load of [`DENSITY`], over the length: `tests/statics/horizontal_base.rs` says how it is known.
pub fn exact_tip() -> Vector3<f64> {
    Vector3::new(0.057_253_565_806_158_82, 0.0, -0.030_426_176_324_779_89) / LENGTH
}

/// One way to find the tip, over the length, from a straight first guess; none if it does not converge. What can be prepared
/// once for many rods is prepared.
pub struct Candidate {
    pub peer: String,
    pub setting: String,
    pub solve: Box<dyn FnMut() -> Option<Vector3<f64>>>,
}

/// What a candidate has shown.
pub struct Run {
    pub peer: String,
    pub setting: String,
    /// Distance of the tip from where it is, over the length; not a number if it did not converge.
    pub error: f64,
    /// The shortest of all runs, s.
    pub seconds: f64,
}

/// Runs all in turns, so that other work on the machine meets all alike, and keeps the shortest time of each.
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
    let named = candidates.iter().map(|one| (one.peer.clone(), one.setting.clone()));
    named.zip(numbers).map(|((peer, setting), (error, seconds))| Run { peer, setting, error, seconds }).collect()
}
