//! An oscillation whose amplitude grows or decays is found as one oscillation, and not as two of
//! nearly the same period.

use std::f64::consts::TAU;

use crate::fixtures::random::long;
use morphorod::tracking::{Search, Track};
use nalgebra::{Rotation2, Vector2};

const MINUTE: f64 = 60.0;
/// Duration of the tracks, s.
const LONG: f64 = 240.0 * MINUTE;
/// Time between two positions, s.
const STEP: f64 = 90.0;
/// Period of a second, circular oscillation of constant amplitude, s.
const FAST: f64 = 24.0 * MINUTE;
/// Radius of the second oscillation, m.
const RADIUS: f64 = 5e-3;

/// Sum of an elliptic oscillation, which grows by a factor e^`swells` over the duration, and of the
/// second oscillation.
fn swelling(period: f64, swells: f64, phase: f64) -> Track {
    let times: Vec<f64> = (0..=(LONG / STEP) as u32)
        .map(|k| STEP * f64::from(k))
        .collect();
    let at = |t: &f64| {
        let (sine, cosine) = (TAU * t / period + phase).sin_cos();
        let (fast, beside) = (TAU * t / FAST).sin_cos();
        let slow = Rotation2::new(0.4)
            * Vector2::new(cosine, 0.3 * sine)
            * (swells * (t / LONG - 0.5)).exp();
        slow * 8e-3 + Vector2::new(beside, fast) * RADIUS
    };
    Track::new(times.clone(), times.iter().map(at).collect()).unwrap()
}

#[test]
fn oscillation_with_growing_amplitude_is_found_as_one() {
    let (many, two) = (
        Search::default(),
        Search {
            most: 2,
            ..Search::default()
        },
    );
    let mut furthest = (0.0_f64, 0.0_f64);
    // The long form of the test covers more phases and periods.
    let phases: &[f64] = if long() {
        &[0.0, 0.125, 0.25, 0.375]
    } else {
        &[0.125, 0.375]
    };
    let turns: &[f64] = if long() {
        &[2.5, 2.6, 2.7, 2.8, 3.0, 3.2, 3.5, 4.0]
    } else {
        &[2.5, 2.7, 3.0, 3.5]
    };
    for turns in turns {
        for swells in [-1.0, 1.0, 1.5] {
            for phase in phases.iter().map(|part| part * TAU) {
                let path = swelling(LONG / turns, swells, phase);
                let found = path.oscillations(&many).unwrap().oscillations;
                let largest = path
                    .positions()
                    .iter()
                    .map(Vector2::norm)
                    .fold(0.0, f64::max);
                // Components that cancel each other are larger than their sum.
                let size = found
                    .iter()
                    .map(|wave| wave.ellipse.major)
                    .fold(0.0, f64::max)
                    / largest;
                // If the search is limited to two oscillations, no components can cancel.
                let off =
                    (path.share(FAST, &many).unwrap() - path.share(FAST, &two).unwrap()).abs();
                furthest = (furthest.0.max(size), furthest.1.max(off));
            }
        }
    }
    println!(
        "largest component {:.3} of the track, shares differ by {:.3}",
        furthest.0, furthest.1
    );
    // The sidebands of the growing oscillation that the track resolves remain. They contain about a
    // twentieth of the power at most.
    assert!(furthest.0 < 1.0 && furthest.1 < 0.06, "{furthest:?}");
}
