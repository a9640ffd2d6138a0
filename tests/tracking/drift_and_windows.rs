//! Drift removal and windows of tip tracks, compared with closed forms.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::random::{Draw, circle, path};
use crate::fixtures::shoots::{HOUR, MINUTE};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::tracking::{Search, Track, TrackingError};
use nalgebra::Vector2;

#[test]
fn drift_removal_keeps_fast_oscillations_and_removes_parabolas() {
    let duration = 2000.0 * 60.0;
    let middle = 900..1100;
    // A local quadratic fit with Gaussian weights assigns the fraction (1 + u) e⁻ᵘ of a wave to the
    // drift, in closed form.
    for ratio in [0.4, 0.5, 1.0, 2.0, 4.0] {
        let period = 12000.0;
        let wave = path(2001, 60.0, |t| circle(t, ratio * period, 1.0));
        let left = wave.without_drift(period).unwrap();
        let u: f64 = 1.678347 / (ratio * ratio);
        let expected = 1.0 - (1.0 + u) * (-u).exp();
        for k in middle.clone() {
            let share = left.positions()[k].dot(&wave.positions()[k]);
            // The weights are truncated at four standard deviations, which omits 3e-4 of them.
            assert!(
                abs_diff_eq!(share, expected, epsilon = 5e-4),
                "{ratio}: {share} {expected}"
            );
        }
    }
    // A parabola is removed as drift for any sequence of times. Only rounding errors remain.
    let mut draw = Draw::new(5);
    let mut times: Vec<f64> = (0..500).map(|_| draw.uniform(0.0, duration)).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    let at = |t: &f64| Vector2::new(1.0 + t / duration, 3.0 - (t / duration).powi(2));
    let smooth = Track::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let left = smooth.without_drift(12000.0).unwrap();
    assert!(
        left.positions().iter().all(|p| p.norm() < 1e-10),
        "{left:?}"
    );
    // On a circle with 50 positions the mean of seven consecutive positions has the radius
    // sin(7π/50)/(7 sin(π/50)).
    let mean = path(300, 60.0, |t| circle(t, 3000.0, 1.0))
        .moving_average(7)
        .unwrap();
    let known = (7.0 * PI / 50.0).sin() / (7.0 * (PI / 50.0).sin());
    for p in mean.positions() {
        assert_abs_diff_eq!(p.norm(), known, epsilon = 1e-12);
    }
    assert_eq!(mean.times()[0], 180.0);
    // The track is the sum of the drift and of the remaining motion.
    let wave = path(300, 60.0, |t| circle(t, 3000.0, 1.0));
    let (drift, left) = (
        wave.drift(5000.0).unwrap(),
        wave.without_drift(5000.0).unwrap(),
    );
    for ((whole, a), b) in wave
        .positions()
        .iter()
        .zip(drift.positions())
        .zip(left.positions())
    {
        assert_abs_diff_eq!(InNorm(*whole), InNorm(a + b), epsilon = 1e-15);
    }
    // One or two positions between gaps do not determine a parabola. They count as drift.
    let pairs: Vec<f64> = (0..40)
        .map(|k| f64::from(k / 2) * 1e6 + f64::from(k % 2) * 0.37)
        .collect();
    let pairs = Track::new(
        pairs.clone(),
        pairs.iter().map(|t| circle(*t, 1.1, 1.0)).collect(),
    )
    .unwrap();
    assert!(
        pairs
            .without_drift(100.0)
            .unwrap()
            .positions()
            .iter()
            .all(|p| p.norm() == 0.0)
    );
    let lone = Track::new(vec![0.0, 1e6, 2e6, 3e6], vec![Vector2::new(1.0, 2.0); 4]).unwrap();
    assert!(
        lone.without_drift(100.0)
            .unwrap()
            .positions()
            .iter()
            .all(|p| p.norm() == 0.0)
    );
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(
            matches!(lone.without_drift(period), Err(TrackingError::Parameter(_))),
            "{period}"
        );
    }
    assert_eq!(
        lone.drift(3.1e6).unwrap_err(),
        TrackingError::Insufficient {
            what: "duration of the track (s)",
            value: 3e6,
            needed: 3.1e6
        }
    );
    assert_eq!(
        lone.between(0.0, 2e6).without_drift(100.0).unwrap_err(),
        TrackingError::Insufficient {
            what: "number of positions",
            value: 3.0,
            needed: 4.0
        }
    );
}

#[test]
fn windows_show_changes_of_the_period_and_gaps() {
    // The period is 24 min for 10 h, then 88 min. There are no frames between 20 and 24 h.
    let motion = |t: f64| {
        if t < 10.0 * HOUR {
            circle(t, 24.0 * MINUTE, 1e-3)
        } else {
            circle(t, 88.0 * MINUTE, 2e-3)
        }
    };
    let all = path(3601, 30.0, motion);
    let kept: Vec<usize> = (0..3601)
        .filter(|k| !(20.0 * HOUR..24.0 * HOUR).contains(&all.times()[*k]))
        .collect();
    let times: Vec<f64> = kept.iter().map(|k| all.times()[*k]).collect();
    let tip = Track::new(times, kept.iter().map(|k| all.positions()[*k]).collect()).unwrap();
    let windows: Vec<_> = tip.windows(4.0 * HOUR, HOUR).unwrap().collect();
    // Windows begin every hour from 0 to 26 h. The last one ends with the track.
    assert_eq!(windows.len(), 27);
    for (k, (middle, _)) in windows.iter().enumerate() {
        assert_abs_diff_eq!(*middle, (2.0 + k as f64) * HOUR, epsilon = 1e-6);
    }
    let share = |k: usize| {
        windows[k]
            .1
            .share(24.0 * MINUTE, &Search::default())
            .unwrap()
    };
    assert!(
        share(0) > 0.999 && share(6) > 0.999 && share(11) < 1e-3,
        "{} {} {}",
        share(0),
        share(6),
        share(11)
    );
    // The window from 20 to 24 h has one position, at its end.
    let alone = &windows[20].1;
    assert_eq!(alone.times(), [24.0 * HOUR]);
    let error = alone.share(24.0 * MINUTE, &Search::default()).unwrap_err();
    assert!(
        matches!(error, TrackingError::Insufficient { value: 1.0, .. }),
        "{error}"
    );
    assert_eq!(
        tip.windows(HOUR, 0.5 * HOUR)
            .unwrap()
            .filter(|(_, window)| window.times().is_empty())
            .count(),
        6
    );
    let (_, empty) = tip
        .windows(HOUR, 0.5 * HOUR)
        .unwrap()
        .find(|(_, window)| window.times().is_empty())
        .unwrap();
    let error = empty.oscillations(&Search::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the number of positions is 0 but must be at least 14"
    );
    assert_eq!(
        tip.windows(31.0 * HOUR, HOUR).err().unwrap(),
        TrackingError::Insufficient {
            what: "duration of the track (s), that of a window,",
            value: 30.0 * HOUR,
            needed: 31.0 * HOUR
        }
    );
    for (length, every) in [
        (0.0, 1.0),
        (1.0, 0.0),
        (f64::NAN, 1.0),
        (1.0, f64::INFINITY),
        (-1.0, 1.0),
    ] {
        assert!(
            matches!(tip.windows(length, every), Err(TrackingError::Parameter(_))),
            "{length} {every}"
        );
    }
    let none = Track::new(vec![], vec![]).unwrap();
    assert!(none.windows(1.0, 1.0).is_err());
}

#[test]
fn settings_that_the_sampling_does_not_resolve_are_refused() {
    let times: Vec<f64> = (0..600).map(|k| 120.0 * f64::from(k)).collect();
    let at = |t: &f64| nalgebra::Vector2::new((t / 900.0).cos(), (t / 900.0).sin());
    let track = Track::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let refused = |error: morphorod::tracking::TrackingError, words: &str| {
        assert!(error.to_string().contains(words), "{error}");
    };
    let search = Search {
        least_turns: 1000.0,
        ..Search::default()
    };
    refused(
        track.oscillations(&search).unwrap_err(),
        "least number of turns is 1000",
    );
    refused(
        track.share(900.0, &search).unwrap_err(),
        "least number of turns is 1000",
    );
    // A period in minutes.
    refused(
        track.share(94.0, &Search::default()).unwrap_err(),
        "period of a share is 94",
    );
    refused(
        track.windows(7200.0, 1e-6).map(|_| ()).unwrap_err(),
        "time from one window to the next is 1e-6",
    );
}
