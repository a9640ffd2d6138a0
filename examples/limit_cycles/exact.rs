//! Circular orbit of a shoot with settled statoliths, from an ordinary differential equation.
//!
//! The kernels of gravitropism and proprioception are equal, or there is no proprioception (η = 0).
//! In a frame that rotates with the shoot at the rate ω, the memories multiply their stimulus by the
//! same complex number. The shape is plane at the rate at which this number is real. With
//! G = 1/(ω √(1 + ω²τm²)) and the angle θ from the vertical, the shape satisfies
//!
//!   E I d/ds[(1 − ηG/τg) θ' − (βG/(r τg)) sin θ] + q (ℓ − s) sin θ = 0,  θ(0) = 0,
//!
//! and the bracket vanishes at s = ℓ.

use std::f64::consts::FRAC_PI_2;

use morphorod::ShootParameters;
use morphorod::tropism::Memory;

/// Returns the rate of rotation ω, rad/s, from ωτr + atan(ωτm) = π/2.
pub fn rate(memory: &Memory) -> f64 {
    zero(0.0, FRAC_PI_2 / memory.delay, |rate| {
        rate * memory.delay + (rate * memory.time).atan() - FRAC_PI_2
    })
}

/// Returns radius and height of the orbit of the tip, m, or `None` below the onset of oscillations.
pub fn exact_orbit(shoot: &ShootParameters) -> Option<[f64; 2]> {
    let memory = shoot.gravitropic_memory;
    let omega = rate(&memory);
    let gain = 1.0 / (omega * (1.0 + (omega * memory.time).powi(2)).sqrt() * shoot.growth_time);
    // q/(E I) with q = ρ g π r² and I = π r⁴/4.
    let weight = 4.0 * shoot.density * 9.81 / (shoot.youngs_modulus * shoot.radius.powi(2));
    // Integrate θ, the bracket, ∫ sin θ and ∫ cos θ from the apex, where θ is `angle`, to the base
    // (Runge–Kutta method of order four).
    let from_apex = |angle: f64| {
        let slope = |z: f64, [theta, bracket, ..]: [f64; 4]| {
            let bend = (bracket
                + shoot.gravitropic_sensitivity * gain / shoot.radius * theta.sin())
                / (1.0 - shoot.proprioceptive_sensitivity * gain);
            [-bend, weight * z * theta.sin(), theta.sin(), theta.cos()]
        };
        let (mut y, h) = ([angle, 0.0, 0.0, 0.0], shoot.length / 400.0);
        for k in 0..400 {
            let z = h * f64::from(k);
            let along =
                |slope: [f64; 4], part: f64| [0, 1, 2, 3].map(|i| y[i] + part * h * slope[i]);
            let a = slope(z, y);
            let b = slope(z + 0.5 * h, along(a, 0.5));
            let c = slope(z + 0.5 * h, along(b, 0.5));
            let d = slope(z + h, along(c, 1.0));
            y = [0, 1, 2, 3].map(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        y
    };
    // The upright shape is a solution as well. The search for the orbit therefore begins at a
    // positive angle.
    let at_base = |angle: f64| from_apex(angle)[0];
    let angles = (0..60).map(|k| 0.02 + 0.05 * f64::from(k));
    let low = angles
        .into_iter()
        .find(|angle| at_base(*angle) * at_base(angle + 0.05) < 0.0)?;
    let [_, _, radius, height] = from_apex(zero(low, low + 0.05, at_base));
    Some([radius, height])
}

/// Returns a zero of a function between two arguments at which its signs differ, by bisection.
fn zero(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low).signum();
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == sign {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}
