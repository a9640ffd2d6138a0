//! Tracks with few frames or with noise: detection of outliers, and shares of periods that the
//! motion does not contain.

use crate::fixtures::random::{Draw, circle, path};
use morphorod::tracking::{Search, Track};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Period of the circular motion of the tip, s.
const PERIOD: f64 = 90.0 * MINUTE;

#[test]
fn outlier_closer_than_the_next_position_is_found_by_local_cubics() {
    // There are twelve frames in a period, and the band begins at 2.25 intervals. The second
    // neighbours are further away than 0.6 of that. The fit still uses them, because they are
    // within three intervals.
    let every = 20.0 * MINUTE;
    let band = [2.25 * every, 8.0 * HOUR];
    let radius = 3e-3;
    let clean = path(145, every, |t| circle(t, 12.0 * every, radius));
    assert!(clean.nutation(band).unwrap().outliers.is_empty());
    for spoiled in [40, 71, 100] {
        let mut positions = clean.positions().to_vec();
        // Neighbours are 2 sin(π/12) = 0.52 radii apart. The error of the median of five positions
        // is a considerable part of this distance. The median therefore cannot detect such a small
        // outlier, but a cubic through the neighbours can.
        positions[spoiled] *= 1.3;
        let spoiled_path = Track::new(clean.times().to_vec(), positions).unwrap();
        assert_eq!(spoiled_path.nutation(band).unwrap().outliers, [spoiled]);
    }
}

#[test]
fn share_of_an_absent_period_in_noise_is_zero() {
    for seed in 1..9 {
        let mut draw = Draw::new(seed);
        let noisy = path(720, 120.0, |t| {
            circle(t, PERIOD, 3e-3) + draw.normal() * 1e-4
        });
        let share = |period: f64| noisy.share(period, &Search::default()).unwrap();
        // The remainder is the share of the noise, whose amplitude is 1e-4 m compared with 3e-3 m.
        assert!(share(PERIOD) > 0.99, "{seed}");
        // Noise contributes to every period, but less than the error of the contribution. The
        // reported share is exactly zero.
        for period in [24.0 * MINUTE, 37.0 * MINUTE, 200.0 * MINUTE] {
            assert_eq!(share(period), 0.0, "{seed}: {period} s");
        }
    }
}

/// Frames are recorded in pairs or bursts. Aliases of the period at the spacing of the pairs or
/// bursts fit almost as well as the period itself.
#[test]
fn periods_of_tracks_with_frames_in_pairs_or_bursts_are_no_aliases() {
    // Number of groups, time between groups (s), number of frames in a group, time between these
    // (s).
    for (groups, between, frames, apart) in [
        (600, 120.0, 2, 10.0),
        (600, 120.0, 2, 0.1),
        (600, 120.0, 2, 1e-6),
        (60, 1200.0, 10, 2.0),
    ] {
        let mut draw = Draw::new(1);
        let offsets = |start: f64| (0..frames).map(move |k| start + apart * f64::from(k));
        let times: Vec<f64> = (0..groups)
            .flat_map(|group| offsets(between * f64::from(group)))
            .collect();
        let positions = times
            .iter()
            .map(|t| circle(*t, PERIOD, 5e-3) + draw.normal() * 1e-4)
            .collect();
        let found = Track::new(times, positions)
            .unwrap()
            .oscillations(&Search::default())
            .unwrap();
        let [largest] = found.oscillations[..] else {
            panic!("{groups} groups, {apart} s: {found:?}")
        };
        // The chance of a larger deviation than four standard errors is 1e-4.
        assert!(
            (largest.period - PERIOD).abs() < 4.0 * largest.period_error,
            "{groups} groups, {apart} s: {largest:?}"
        );
    }
}
