//! A swing that swells or fades is read as one oscillation, and not as two of nearly the same period.

use std::f64::consts::TAU;

use morphorod::orbit::{PlanePath, Search};
use nalgebra::{Rotation2, Vector2};

const MINUTE: f64 = 60.0;
/// Duration of the paths, s, and the time between two positions.
const LONG: f64 = 240.0 * MINUTE;
const STEP: f64 = 90.0;
/// An oscillator beside the swing: its period (s) and radius (m).
const FAST: f64 = 24.0 * MINUTE;
const RADIUS: f64 = 5e-3;

/// A swing in an ellipse that is e^`swells` times as large at the end as in the beginning, and an oscillator beside it.
fn swelling(period: f64, swells: f64, phase: f64) -> PlanePath {
    let times: Vec<f64> = (0..=(LONG / STEP) as u32).map(|k| STEP * f64::from(k)).collect();
    let at = |t: &f64| {
        let (sine, cosine) = (TAU * t / period + phase).sin_cos();
        let (fast, beside) = (TAU * t / FAST).sin_cos();
        let swing = Rotation2::new(0.4) * Vector2::new(cosine, 0.3 * sine) * (swells * (t / LONG - 0.5)).exp();
        swing * 8e-3 + Vector2::new(beside, fast) * RADIUS
    };
    PlanePath::new(times.clone(), times.iter().map(at).collect()).unwrap()
}

#[test]
fn a_swing_that_swells_is_one() {
    let (many, two) = (Search::default(), Search { most: 2, ..Search::default() });
    let mut furthest = (0.0_f64, 0.0_f64);
    for turns in [2.5, 2.6, 2.7, 2.8, 3.0, 3.2, 3.5, 4.0] {
        for swells in [-1.0, 1.0, 1.5] {
            for phase in [0.0, 0.125, 0.25, 0.375].map(|part| part * TAU) {
                let path = swelling(LONG / turns, swells, phase);
                let found = path.oscillations(&many).unwrap().oscillations;
                let largest = path.positions().iter().map(Vector2::norm).fold(0.0, f64::max);
                // Waves that cancel are larger than what they add up to.
                let size = found.iter().map(|wave| wave.ellipse.major).fold(0.0, f64::max) / largest;
                // With two oscillations at most there are none that could cancel.
                let off = (path.share(FAST, &many).unwrap() - path.share(FAST, &two).unwrap()).abs();
                furthest = (furthest.0.max(size), furthest.1.max(off));
            }
        }
    }
    println!("largest wave {:.3} of the path, shares {:.3} apart", furthest.0, furthest.1);
    // Sidebands of a swell that are further off than the path resolves stay; they hold a twentieth of the motion at most.
    assert!(furthest.0 < 1.0 && furthest.1 < 0.06, "{furthest:?}");
}
