//! Planar and nonlinear oscillations: senses of rotation that noise leaves undetermined, overtones,
//! and close periods.

use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, circle, path};
use crate::fixtures::shoots::{HOUR, MINUTE};
use morphorod::tracking::{Oscillations, Search, Track};
use morphorod::tropism::Handedness;
use nalgebra::{Rotation2, Vector2};

const BAND: [f64; 2] = [30.0 * MINUTE, 4.0 * HOUR];
/// Period of the oscillation, s.
const PERIOD: f64 = 91.2 * MINUTE;
/// Semi-major axis of the oscillation, m.
const MAJOR: f64 = 54.8e-3;
/// Standard deviation of the noise of a coordinate, m.
const NOISE: f64 = 0.05e-3;

/// Elliptic oscillation, counterclockwise for a positive minor axis, for 24 h with a frame every 2
/// min.
fn swing(draw: &mut Draw, minor: f64) -> Track {
    path(720, 120.0, |t| {
        let (sine, cosine) = (TAU * t / PERIOD).sin_cos();
        Rotation2::new(0.4) * Vector2::new(MAJOR * cosine, minor * sine) + draw.normal() * NOISE
    })
}

#[test]
fn sense_of_a_swing_in_a_plane_is_undetermined_in_noise() {
    for seed in 1..16 {
        let planar = swing(&mut Draw::new(seed), 0.0);
        let found = planar.oscillations(&Search::default()).unwrap();
        // The standard error of an axis is 0.05 mm √(2/720) = 2.6 µm. The minor axis exceeds three
        // standard errors in one of 370 tracks.
        assert_eq!(found.sense(), None, "{seed}: {found:?}");
        let found = planar.nutation(BAND).unwrap();
        assert!(found.nutates, "{seed}");
        assert_eq!((found.sense, found.turns), (None, None), "{seed}");
    }
}

#[test]
fn sense_of_a_thin_ellipse_is_found_if_its_minor_axis_exceeds_the_noise() {
    // The minor axis is eight standard errors of 2.6 µm.
    for (minor, sense) in [
        (21e-6, Handedness::Counterclockwise),
        (-21e-6, Handedness::Clockwise),
    ] {
        for seed in 1..6 {
            let found = swing(&mut Draw::new(seed), minor)
                .oscillations(&Search::default())
                .unwrap();
            assert_eq!(found.sense(), Some(sense), "{seed}: {found:?}");
        }
    }
    // The wavelet uses only a part of the track at each time. The standard error of an axis is then
    // 10 µm.
    let found = swing(&mut Draw::new(1), 0.2e-3).nutation(BAND).unwrap();
    assert_eq!(found.sense, Some(Handedness::Counterclockwise));
    assert!(found.turns.unwrap() > 0.0);
    // Without noise any minor axis is significant.
    let exact = path(720, 120.0, |t| {
        circle(t, PERIOD, MAJOR).component_mul(&Vector2::new(1.0, 1e-6))
    });
    assert_eq!(
        exact.oscillations(&Search::default()).unwrap().sense(),
        Some(Handedness::Counterclockwise)
    );
}

/// Harmonic numbers of the oscillations, in order of decreasing period.
fn orders(found: &Oscillations) -> Vec<Option<u32>> {
    let mut waves = found.oscillations.clone();
    waves.sort_by(|a, b| b.period.total_cmp(&a.period));
    waves.iter().map(|wave| wave.harmonic).collect()
}

#[test]
fn overtones_of_a_nonlinear_swing_are_harmonics() {
    let nonlinear = |noise: f64| {
        let mut draw = Draw::new(1);
        path(720, 120.0, |t| {
            let overtones = [(1.0, 1.0), (3.0, 0.1), (5.0, 0.03), (7.0, 0.01)];
            let along: f64 = overtones
                .iter()
                .map(|(order, size)| size * (order * TAU * t / PERIOD).cos())
                .sum();
            Vector2::new(MAJOR * along, 0.0) + draw.normal() * noise
        })
    };
    for noise in [0.0, NOISE] {
        let found = nonlinear(noise).oscillations(&Search::default()).unwrap();
        assert_eq!(
            orders(&found),
            [None, Some(3), Some(5), Some(7)],
            "{noise}: {found:?}"
        );
    }
}

#[test]
fn oscillation_with_an_incommensurable_period_is_no_harmonic() {
    for (period, seed) in [
        (PERIOD / 3.05, 1),
        (PERIOD / 2.5, 2),
        (24.0 * MINUTE, 3),
        (2.0 * PERIOD, 4),
    ] {
        let mut draw = Draw::new(seed);
        let both = path(720, 120.0, |t| {
            circle(t, PERIOD, 4e-3) + circle(t, period, 1e-3) + draw.normal() * NOISE
        });
        let found = both.oscillations(&Search::default()).unwrap();
        // The standard error of the ratio 3.05 is below 0.001.
        assert_eq!(orders(&found), [None, None], "{period}: {found:?}");
    }
}

#[test]
fn close_periods_that_share_a_ridge_are_reported() {
    let both = |periods: [f64; 2]| {
        let mut draw = Draw::new(5);
        let [first, second] = periods.map(|minutes| minutes * MINUTE);
        path(720, 120.0, |t| {
            circle(t, first, 3e-3) + circle(t, second, 2e-3) + draw.normal() * NOISE
        })
    };
    // The wavelet separates two periods if their ratio is larger than exp(2/6) = 1.40.
    let found = both([80.0, 100.0]).nutation(BAND).unwrap();
    assert_eq!(found.unresolved.len(), 1, "{:?}", found.unresolved);
    for (found, known) in found.unresolved[0].iter().zip([80.0, 100.0]) {
        // The relative standard error of a period is below 1e-4.
        approx::assert_relative_eq!(*found, known * MINUTE, epsilon = 0.0, max_relative = 1e-3);
    }
    for periods in [[60.0, 100.0], [45.0, 90.0]] {
        let found = both(periods).nutation(BAND).unwrap();
        assert!(found.unresolved.is_empty(), "{:?}", found.unresolved);
    }
    assert!(
        swing(&mut Draw::new(1), 0.0)
            .nutation(BAND)
            .unwrap()
            .unresolved
            .is_empty()
    );
}
