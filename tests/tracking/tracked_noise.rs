//! Paths of few frames, or with noise: what is an outlier, and what is no wave.

use crate::fixtures::random::{Draw, circle, path};
use morphorod::orbit::{Band, PlanePath, Search};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Of the tip's circles.
const PERIOD: f64 = 90.0 * MINUTE;

#[test]
fn an_outlier_less_than_a_step_away_is_told_by_the_smooth_path() {
    // Twelve frames in a period, and a band that begins at 2.25 intervals: 0.6 of that is nearer than the neighbours but one, which
    // count all the same, as they are within three intervals.
    let every = 20.0 * MINUTE;
    let band = Band { shortest: 2.25 * every, longest: 8.0 * HOUR };
    let radius = 3e-3;
    let clean = path(145, every, |t| circle(t, 12.0 * every, radius));
    assert!(clean.tracked(&band).unwrap().outliers.is_empty());
    for spoiled in [40, 71, 100] {
        let mut positions = clean.positions().to_vec();
        // Neighbours are 2 sin(π/12) = 0.52 radii apart. The median of five is off by as much as a part of that everywhere, so that it
        // takes nothing so near for a spike; a parabola through them is not.
        positions[spoiled] *= 1.3;
        let spoiled_path = PlanePath::new(clean.times().to_vec(), positions).unwrap();
        assert_eq!(spoiled_path.tracked(&band).unwrap().outliers, [spoiled]);
    }
}

#[test]
fn a_period_that_noise_alone_fits_has_no_share() {
    for seed in 1..20 {
        let mut draw = Draw::new(seed);
        let noisy = path(720, 120.0, |t| circle(t, PERIOD, 3e-3) + draw.normal() * 1e-4);
        let share = |period: f64| noisy.share(period, &Search::default()).unwrap();
        // All but the noise, 1e-4 in 3e-3.
        assert!(share(PERIOD) > 0.99, "{seed}");
        // Of noise every period has a bit, of the size of its error: none, and not a small one.
        for period in [24.0 * MINUTE, 37.0 * MINUTE, 200.0 * MINUTE] {
            assert_eq!(share(period), 0.0, "{seed}: {period} s");
        }
    }
}
