//! The force at which a leaning column snaps to the other side, by elliptic integrals.
//!
//! With ω the angle of the tangent from the direction of the total force, reversed, the rod is a
//! pendulum: B ω″ = −F sin ω, ω(0) = γ, ω′(ℓ) = 0, where tan γ = H/P for the lateral force H and
//! the weight P, and F² = H² + P². With the amplitude ω(ℓ) = 2 asin k the first integral gives
//!
//! ```text
//! ℓ √(F/B) = ∫ dφ/√(1 − k² sin² φ)  from φ₀ to π/2,  k sin φ₀ = sin(γ/2).
//! ```

use std::f64::consts::FRAC_PI_2;

/// The elliptic integral of the first kind from `from` to π/2 by the rule of Simpson. The integrand
/// is smooth, and 400 intervals give an error of 1e-13 up to k = 0.9.
fn integral(from: f64, k: f64) -> f64 {
    const HALVES: i32 = 200;
    let h = (FRAC_PI_2 - from) / f64::from(2 * HALVES);
    let value = |i: i32| 1.0 / (1.0 - (k * (from + h * f64::from(i)).sin()).powi(2)).sqrt();
    let pairs: f64 = (0..HALVES)
        .map(|i| value(2 * i) + 4.0 * value(2 * i + 1) + value(2 * i + 2))
        .sum();
    pairs * h / 3.0
}

/// The angle γ of a shape that leans by the amplitude k, for a weight in units of B/ℓ²; by
/// bisection.
fn angle(weight: f64, k: f64) -> f64 {
    let excess = |gamma: f64| {
        let start = ((0.5 * gamma).sin() / k).clamp(-1.0, 1.0).asin();
        (weight / gamma.cos()).sqrt() - integral(start, k)
    };
    // The force is against the lean, and less than the amplitude.
    let (mut low, mut high) = (-1.999 * k.asin().min(0.785), 1.999 * k.asin().min(0.785));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 {
            high = middle
        } else {
            low = middle
        }
    }
    0.5 * (low + high)
}

/// The largest lateral force against which a column with a weight on its apex leans, in units of
/// B/ℓ²: the smallest γ among all amplitudes, by golden section.
pub fn fold_force(weight: f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.05, 0.9);
    for _ in 0..60 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if angle(weight, a) < angle(weight, b) {
            high = b
        } else {
            low = a
        }
    }
    -weight * angle(weight, 0.5 * (low + high)).tan()
}
