//! Outliers. `oscillations` and `nutation` report the same outliers, which include neither fast
//! initial transients nor noise.

use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, circle, path};
use crate::fixtures::shoots::{HOUR, MINUTE};
use morphorod::tracking::{Search, Track};
use nalgebra::Vector2;

const BAND: [f64; 2] = [10.0 * MINUTE, 4.0 * HOUR];

/// Outliers of a track. Asserts that `oscillations` and `nutation` agree.
fn outliers(path: &Track) -> Vec<usize> {
    let found = path.oscillations(&Search::default()).unwrap().outliers;
    assert_eq!(path.nutation(BAND).unwrap().outliers, found);
    found
}

/// A tip that starts at a distance of 30 mm and approaches a circle of radius 2 mm with a decaying
/// oscillation. Its time constant is `time`, s, and the standard deviation of the noise is `noise`,
/// m.
fn transient(time: f64, noise: f64) -> Track {
    let mut draw = Draw::new(2);
    path(720, 120.0, |t| {
        let (sine, cosine) = (TAU * t / (3.0 * time)).sin_cos();
        let approach = Vector2::new(cosine, 0.7 * sine) * (30e-3 * (-t / time).exp());
        approach + circle(t, 90.0 * MINUTE, 2e-3) + draw.normal() * noise
    })
}

#[test]
fn transient_at_the_start_is_no_outlier() {
    for minutes in [4.0, 8.0, 15.0, 60.0] {
        for noise in [0.0, 1e-5, 1e-4] {
            let found = outliers(&transient(minutes * MINUTE, noise));
            assert!(
                found.is_empty(),
                "{minutes} min, noise of {noise} m: {found:?}"
            );
        }
    }
}

#[test]
fn white_noise_has_no_outliers_whatever_the_motion() {
    // The period grows from 24 to 100 min and the amplitude by a factor of ten. Four oscillations
    // do not describe such a track.
    let (first, rate) = (24.0 * MINUTE, 76.0 / (24.0 * 60.0));
    for seed in 1..6 {
        let mut draw = Draw::new(seed);
        let growing = path(720, 120.0, |t| {
            let (sine, cosine) = (TAU * (1.0 + rate * t / first).ln() / rate).sin_cos();
            Vector2::new(cosine, sine) * (1e-3 + 9e-3 * (t / 86400.0).powi(4))
                + draw.normal() * 5e-5
        });
        let found = outliers(&growing);
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
}

#[test]
fn displaced_positions_are_the_only_outliers_of_a_track() {
    let track = transient(15.0 * MINUTE, 1e-4);
    let displaced = [40, 41, 200, 333, 500, 718, 719];
    let mut positions = track.positions().to_vec();
    for (k, i) in displaced.into_iter().enumerate() {
        // The displacements of 4 mm are forty standard deviations of the noise. Two pairs of
        // displaced positions are neighbours, and one of these pairs is at the end.
        positions[i] += circle(k as f64, 2.6, 4e-3);
    }
    assert_eq!(
        outliers(&Track::new(track.times().to_vec(), positions).unwrap()),
        displaced
    );
}

#[test]
fn huge_outliers_do_not_hide_small_ones_or_the_motion() {
    let mut draw = Draw::new(7);
    let clean = path(900, 60.0, |t| {
        circle(t, 24.0 * MINUTE, 1e-3) + draw.normal() * 2e-5
    });
    for size in [1e3, 1e36, 1e150, f64::MAX] {
        let mut positions = clean.positions().to_vec();
        positions[100] = Vector2::new(size, size);
        positions[250].x += 1.5e-3;
        positions[333] = Vector2::new(-size, 0.0);
        let track = Track::new(clean.times().to_vec(), positions).unwrap();
        assert_eq!(outliers(&track), [100, 250, 333], "{size:e} m");
        let found = track.nutation([10.0 * MINUTE, HOUR]).unwrap();
        assert!(
            found.nutates && (found.period.unwrap() / (24.0 * MINUTE) - 1.0).abs() < 0.01,
            "{size:e} m"
        );
        assert_eq!(
            track
                .oscillations(&Search::default())
                .unwrap()
                .oscillations
                .len(),
            1,
            "{size:e} m"
        );
    }
    assert!(
        clean
            .oscillations(&Search {
                drift: usize::MAX - 3,
                ..Search::default()
            })
            .is_err()
    );
}
