//! The circular limit cycle of the reduced model, exactly: a planar shape that turns rigidly about the vertical.
#![allow(dead_code)] // Every test uses a part of it.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::shoots::{BETA, ETA, HOUR, MEMORY, RADIUS, WEIGHT, YOUNG};

/// Growth time τg, s.
pub const GROWTH_TIME: f64 = 20.0 * HOUR;

/// The turning rate (rad/s) at which the memories, complex numbers in the turning frame, act in the plane of the shape:
/// ωτr + atan(ωτm) = π/2.
pub fn rate() -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let rate = 0.5 * (low + high);
        if rate * MEMORY.delay + (rate * MEMORY.time).atan() < FRAC_PI_2 { low = rate } else { high = rate }
    }
    low
}

/// A shape that turns at that rate if the angle at its base is zero: this angle, rad, then the couple's bracket, radius and height of the
/// tip (m), for an angle of its apex, rad. With G = 1/(ω √(1 + ω²τm²)) it solves, under weight and elasticity of equations (10) and
/// (12) of doi 10.3389/fpls.2021.608005,
/// E I d/ds[(1 − ηG/τg) θ' − (βG/(r τg)) p(θ)] + q (ℓ − s) sin θ = 0, the bracket zero at s = ℓ, where tissue that leans by θ perceives
/// p(θ); sin θ in the paper.
pub fn shape(length: f64, apex: f64, perceived: impl Fn(f64) -> f64) -> [f64; 4] {
    let gain = 1.0 / (rate() * (1.0 + (rate() * MEMORY.time).powi(2)).sqrt() * GROWTH_TIME);
    let stiffness = YOUNG.stiffness(RADIUS).x;
    let weight = WEIGHT.density * 9.81 * PI * RADIUS * RADIUS;
    // From the apex to the base; also sums up the sine and the cosine.
    let slope = |z: f64, [theta, b]: [f64; 2]| {
        let bend = (b + BETA * gain / RADIUS * perceived(theta)) / (1.0 - ETA * gain);
        [-bend, weight / stiffness * z * theta.sin(), theta.sin(), theta.cos()]
    };
    let (mut y, h) = ([apex, 0.0, 0.0, 0.0], length / 1000.0);
    for i in 0..1000 {
        let z = h * f64::from(i);
        let at = |k: [f64; 4], c: f64| [y[0] + c * k[0], y[1] + c * k[1]];
        let k1 = slope(z, [y[0], y[1]]);
        let k2 = slope(z + 0.5 * h, at(k1, 0.5 * h));
        let k3 = slope(z + 0.5 * h, at(k2, 0.5 * h));
        let k4 = slope(z + h, at(k3, h));
        for (j, y) in y.iter_mut().enumerate() {
            *y += h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]);
        }
    }
    y
}

/// Radius and height (m) of the tip's orbit.
pub fn exact_orbit(length: f64) -> (f64, f64) {
    let base = |apex: f64| shape(length, apex, f64::sin)[0];
    // The upright shape is a solution too; the orbit's apex leans by more.
    let mut low = 0.02;
    while base(low + 0.05).signum() == base(low).signum() {
        low += 0.05;
        assert!(low < 3.0, "no orbit at {length} m");
    }
    let mut high = low + 0.05;
    for _ in 0..60 {
        let apex = 0.5 * (low + high);
        if base(apex).signum() == base(low).signum() { low = apex } else { high = apex }
    }
    let [_, _, radius, height] = shape(length, low, f64::sin);
    (radius, height)
}
