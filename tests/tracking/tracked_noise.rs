//! Tracks with few frames or with noise: detection of outliers, and shares of periods that are
//! absent.

use crate::fixtures::random::{Draw, circle, path};
use morphorod::tracking::{Band, PlaneTrack, Search};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Period of the circular motion of the tip, s.
const PERIOD: f64 = 90.0 * MINUTE;

#[test]
fn outlier_closer_than_the_next_position_is_found_by_local_cubics() {
    // There are twelve frames in a period, and the band begins at 2.25 intervals. The second
    // neighbours are further away than 0.6 of that. They are used all the same, since they are
    // within three intervals.
    let every = 20.0 * MINUTE;
    let band = Band { shortest: 2.25 * every, longest: 8.0 * HOUR };
    let radius = 3e-3;
    let clean = path(145, every, |t| circle(t, 12.0 * every, radius));
    assert!(clean.nutation(&band).unwrap().outliers.is_empty());
    for spoiled in [40, 71, 100] {
        let mut positions = clean.positions().to_vec();
        // Neighbours are 2 sin(π/12) = 0.52 radii apart. The median of five positions has an error
        // of a considerable part of that everywhere, so that it cannot detect such a small outlier.
        // A cubic through the neighbours can.
        positions[spoiled] *= 1.3;
        let spoiled_path = PlaneTrack::new(clean.times().to_vec(), positions).unwrap();
        assert_eq!(spoiled_path.nutation(&band).unwrap().outliers, [spoiled]);
    }
}

#[test]
fn share_of_an_absent_period_in_noise_is_zero() {
    for seed in 1..9 {
        let mut draw = Draw::new(seed);
        let noisy = path(720, 120.0, |t| circle(t, PERIOD, 3e-3) + draw.normal() * 1e-4);
        let share = |period: f64| noisy.share(period, &Search::default()).unwrap();
        // Only the noise is missing, 1e-4 of 3e-3.
        assert!(share(PERIOD) > 0.99, "{seed}");
        // Noise contributes to every period, but less than the error of the contribution. The share
        // is zero, not a small number.
        for period in [24.0 * MINUTE, 37.0 * MINUTE, 200.0 * MINUTE] {
            assert_eq!(share(period), 0.0, "{seed}: {period} s");
        }
    }
}
