//! Closed forms of the onset and of the amplitude of waves.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Root of an increasing function between two values.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// Gain kτ and period over the delay at the onset. The memory time and the growth time are relative
/// to the delay; the growth time is infinite for a zone of constant length. A growth time of at
/// most 1 + `memory` has no onset, and the period is very long.
pub fn onset_of(memory: f64, growth_time: f64) -> [f64; 2] {
    let x = bisect(1e-9, FRAC_PI_2, |x| {
        x + (x * memory).atan() - (x * growth_time).atan()
    });
    [
        x * x * (x * memory).hypot(1.0) / x.hypot(1.0 / growth_time),
        TAU / x,
    ]
}

/// Gain kτ at which the waves of a zone of constant length without memory have an amplitude (rad):
/// π/2 over the arithmetic-geometric mean of 1 and cos²(A/2).
pub fn gain_of(amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos().powi(2));
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    FRAC_PI_2 / a
}

/// Amplitude (rad) at a gain kτ; `None` below the onset.
pub fn amplitude_of(gain: f64) -> Option<f64> {
    (gain > FRAC_PI_2).then(|| bisect(0.0, PI, |amplitude| gain_of(amplitude) - gain))
}
