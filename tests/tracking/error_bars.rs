//! Standard errors and detection of oscillations in noise that is not white, with slow drift, gaps
//! and outliers.
//!
//! `MORPHOROD_CASES=200 cargo test --workspace --test all tracking::error_bars:: -- --nocapture`
//! draws more tracks.

use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::MINUTE;
use morphorod::tracking::{Search, Track};
use nalgebra::Vector2;

/// Time between two frames, s.
const FRAME: f64 = 4.0 * MINUTE;
/// Number of frames, which cover 24 h.
const FRAMES: u32 = 360;
/// Semi-axes of the motion of the tip, m.
const AXES: [f64; 2] = [3e-3, 2e-3];
/// Standard deviation of the noise of a coordinate, m.
const NOISE: f64 = 0.3e-3;
/// Amplitudes of the slow drift in both coordinates, m, and its number of periods during the track.
const DRIFT: ([f64; 2], f64) = ([30e-3, 20e-3], 0.83);
/// Probability of an outlier, and its largest distance in a coordinate, m.
const OUTLIERS: (f64, f64) = (0.02, 15e-3);

/// Deviations of a track from uniform frames with white noise.
#[derive(Default)]
struct Scene {
    /// Correlation of the noise in successive frames.
    correlation: f64,
    drifts: bool,
    /// Whether the track has two gaps of three hours, and a tenth of the other frames is lost at
    /// random.
    gaps: bool,
    outliers: bool,
    /// Whether the oscillation is omitted.
    still: bool,
}

impl Scene {
    fn draw(&self, draw: &mut Draw, period: f64) -> Track {
        let (phase, drift_phase) = (draw.uniform(0.0, TAU), draw.uniform(0.0, TAU));
        let mut noise = draw.normal();
        let (mut times, mut positions) = (Vec::new(), Vec::new());
        for k in 0..FRAMES {
            let (t, part) = (FRAME * f64::from(k), f64::from(k) / f64::from(FRAMES));
            noise = noise * self.correlation
                + draw.normal() * (1.0 - self.correlation * self.correlation).sqrt();
            let spoiled = draw.chance(OUTLIERS.0) && self.outliers;
            let off = draw.vector(OUTLIERS.1).xy();
            let dark =
                (0.2..0.325).contains(&part) || (0.6..0.725).contains(&part) || draw.chance(0.1);
            if self.gaps && dark {
                continue;
            }
            let mut position = noise * NOISE;
            if !self.still {
                let (sine, cosine) = (TAU * t / period + phase).sin_cos();
                position += Vector2::new(AXES[0] * cosine, AXES[1] * sine);
            }
            if self.drifts {
                let (sine, cosine) = (TAU * DRIFT.1 * part + drift_phase).sin_cos();
                position += Vector2::new(DRIFT.0[0] * cosine, DRIFT.0[1] * sine);
            }
            times.push(t);
            positions.push(if spoiled { position + off } else { position });
        }
        Track::new(times, positions).unwrap()
    }

    /// Checks that nominal 90 % intervals of the period and of both axes contain the true values in
    /// 85 to 95 % of the tracks, and that no other oscillation is found.
    fn check(&self) {
        let (cases, seed) = (number("MORPHOROD_CASES", 30), number("MORPHOROD_SEED", 1));
        let (mut inside, mut spurious) = ([0_u32; 3], 0);
        for case in 0..cases {
            let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
            let period = draw.uniform(70.0, 110.0) * MINUTE;
            let found = self
                .draw(&mut draw, period)
                .oscillations(&Search::default())
                .unwrap()
                .oscillations;
            // The oscillation has ten times the amplitude of the noise, and is the largest one.
            let largest = found[0];
            assert!(
                (largest.period / period - 1.0).abs() < 0.02,
                "case {case}: {found:?}"
            );
            let known = [
                (largest.period, period, largest.period_error),
                (largest.ellipse.major, AXES[0], largest.axis_error),
                (largest.ellipse.minor, AXES[1], largest.axis_error),
            ];
            for (inside, (value, truth, error)) in inside.iter_mut().zip(known) {
                // An interval of 1.645 standard errors contains 90 % of a normal distribution.
                *inside += u32::from((value - truth).abs() < 1.645 * error);
            }
            spurious += usize::from(found.len() > 1);
        }
        println!(
            "{cases} tracks: intervals of period and axes contain {inside:?} true values; {spurious} tracks with others"
        );
        // Two standard deviations of the share in a sample of this size are added to the permitted
        // range. The default number of tracks detects only intervals that are too narrow.
        let spread = 2.0 * (0.9 * 0.1 / cases as f64).sqrt();
        for inside in inside {
            let share = f64::from(inside) / cases as f64;
            assert!((share - 0.9).abs() < 0.05 + spread, "{share}");
        }
        // The nominal probability of a false detection is 1e-4 for each track.
        assert!(spurious as f64 <= 0.02 * cases as f64, "{spurious}");
    }
}

#[test]
fn intervals_in_white_noise_contain_the_truth_as_often_as_stated() {
    Scene::default().check();
}

#[test]
fn intervals_in_autocorrelated_noise_contain_the_truth_as_often_as_stated() {
    Scene {
        correlation: 0.8,
        ..Scene::default()
    }
    .check();
}

#[test]
fn intervals_under_a_slow_sinusoidal_drift_contain_the_truth_as_often_as_stated() {
    Scene {
        drifts: true,
        ..Scene::default()
    }
    .check();
}

#[test]
fn intervals_with_gaps_and_lost_frames_contain_the_truth_as_often_as_stated() {
    Scene {
        gaps: true,
        ..Scene::default()
    }
    .check();
}

#[test]
fn intervals_with_outliers_contain_the_truth_as_often_as_stated() {
    Scene {
        outliers: true,
        ..Scene::default()
    }
    .check();
}

#[test]
fn autocorrelated_noise_is_not_reported_as_oscillation_or_nutation() {
    let (cases, seed) = (number("MORPHOROD_CASES", 30), number("MORPHOROD_SEED", 1));
    let band = [20.0 * MINUTE, 240.0 * MINUTE];
    let (mut oscillating, mut nutating) = (0, 0);
    for case in 0..cases {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
        let noise = Scene {
            correlation: 0.8,
            still: true,
            gaps: case % 2 == 1,
            ..Scene::default()
        };
        let noise = noise.draw(&mut draw, 90.0 * MINUTE);
        oscillating += usize::from(
            !noise
                .oscillations(&Search::default())
                .unwrap()
                .oscillations
                .is_empty(),
        );
        nutating += usize::from(noise.nutation(band).unwrap().nutates);
    }
    println!("of {cases} tracks of noise, {oscillating} oscillate and {nutating} nutate");
    // The nominal probabilities of a false detection are 1e-4 and 2e-4 for noise with a known
    // spectrum. The spectrum is estimated, which increases them.
    assert!(oscillating as f64 <= 0.02 * cases as f64, "{oscillating}");
    assert!(nutating as f64 <= 0.05 * cases as f64, "{nutating}");
}
