//! Oscillations found in synthetic tip tracks with known components, and invalid tracks.
//!
//! `MORPHOROD_CASES=1000 cargo test --workspace --test all tracking::oscillations:: -- --nocapture`
//! draws more tracks.

use std::f64::consts::TAU;

use crate::fixtures::random::{Draw, number};
use crate::fixtures::shoots::MINUTE;
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use morphorod::tracking::{Oscillation, Pattern, Search, Track, TrackingError};
use morphorod::tropism::Handedness;
use nalgebra::{Rotation2, Vector2, Vector3};

/// Elliptic motion with a single period.
#[derive(Debug, Clone, Copy)]
struct Part {
    period: f64,
    major: f64,
    minor: f64,
    direction: f64,
    phase: f64,
    sense: Handedness,
}

impl Part {
    fn at(&self, t: f64) -> Vector2<f64> {
        let (sine, cosine) = (TAU * t / self.period + self.phase).sin_cos();
        let sign = if self.sense == Handedness::Counterclockwise {
            1.0
        } else {
            -1.0
        };
        Rotation2::new(self.direction) * Vector2::new(self.major * cosine, sign * self.minor * sine)
    }

    fn draw(draw: &mut Draw, period: f64) -> Self {
        let major = draw.uniform(1e-3, 1e-2);
        Self {
            period,
            major,
            minor: major * draw.unit(),
            direction: draw.uniform(-3.0, 3.0),
            phase: draw.uniform(0.0, TAU),
            sense: if draw.chance(0.5) {
                Handedness::Counterclockwise
            } else {
                Handedness::Clockwise
            },
        }
    }
}

/// A track with known components and the defects of recorded tracks: uneven times, a gap, lost
/// frames, drift, noise and outliers.
fn tracked(draw: &mut Draw) -> (Vec<Part>, Track) {
    let slow = draw.log(600.0, 3e4);
    let fast = draw.chance(0.6).then(|| slow / draw.uniform(1.5, 5.0));
    let parts: Vec<Part> = [Some(slow), fast]
        .into_iter()
        .flatten()
        .map(|period| Part::draw(draw, period))
        .collect();
    let span = slow * draw.uniform(6.0, 16.0);
    let gap = draw.uniform(10.0, 25.0);
    let step = fast.unwrap_or(slow) / gap;
    let largest = parts.iter().map(|part| part.major).fold(0.0, f64::max);
    let noise = 0.05 * parts.iter().map(|part| part.major).fold(1.0, f64::min);
    let drift: Vec<Vector2<f64>> = (0..3).map(|_| draw.vector(2.0 * largest).xy()).collect();
    let hole = draw.uniform(0.2, 0.7);
    let hole = hole..hole + draw.uniform(0.05, 0.15);
    let (mut times, mut positions) = (Vec::new(), Vec::new());
    for k in 0..(span / step) as usize {
        let t = step * (k as f64 + draw.uniform(-0.05, 0.05));
        let x = t / span;
        if hole.contains(&x) || draw.chance(0.05) {
            continue;
        }
        let mut position =
            drift[0] * x + drift[1] * x * x + drift[2] * x * x * x + draw.normal() * noise;
        position += parts.iter().map(|part| part.at(t)).sum::<Vector2<f64>>();
        if draw.chance(0.02) {
            position += draw.vector(5.0 * largest).xy();
        }
        times.push(t);
        positions.push(position);
    }
    (parts, Track::new(times, positions).unwrap())
}

#[test]
fn components_of_random_realistic_tracks_are_found() {
    let (cases, seed) = (number("MORPHOROD_CASES", 60), number("MORPHOROD_SEED", 1));
    let (mut inside, mut total) = (0, 0);
    for case in 0..cases {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
        let (parts, path) = tracked(&mut draw);
        let found = path.oscillations(&Search::default()).unwrap();
        assert_eq!(
            found.oscillations.len(),
            parts.len(),
            "case {case}: {found:?}\n{parts:?}"
        );
        for part in &parts {
            let off = |o: &Oscillation| (o.period - part.period).abs();
            let nearest = found
                .oscillations
                .iter()
                .min_by(|a, b| off(a).total_cmp(&off(b)))
                .unwrap();
            let ellipse = nearest.ellipse;
            let agrees = abs_diff_eq!(nearest.period, part.period, epsilon = 0.01 * part.period);
            assert!(agrees, "case {case}: {nearest:?} {part:?}");
            for (found, known) in [(ellipse.major, part.major), (ellipse.minor, part.minor)] {
                let agrees = abs_diff_eq!(found, known, epsilon = 0.05 * part.major);
                assert!(agrees, "case {case}: {nearest:?} {part:?}");
            }
            if part.minor > 0.1 * part.major {
                assert_eq!(ellipse.sense, Some(part.sense), "case {case}");
            }
            total += 1;
            // An interval of 1.645 standard errors contains 90 % of a normal distribution.
            inside += usize::from(off(nearest) < 1.645 * nearest.period_error);
        }
    }
    let share = f64::from(inside as u32) / f64::from(total as u32);
    println!(
        "{cases} tracks, {total} periods: {share:.3} of the 90 % intervals contain the period"
    );
    assert!((0.85..0.95).contains(&share), "{share}");
}

#[test]
fn patterns_are_named_and_their_loops_are_counted() {
    let times: Vec<f64> = (0..900).map(|k| 60.0 * f64::from(k)).collect();
    let part = |period: f64, major: f64, minor: f64, sense| Part {
        period: period * MINUTE,
        major,
        minor,
        direction: 0.3,
        phase: 1.0,
        sense,
    };
    let (left, right) = (Handedness::Counterclockwise, Handedness::Clockwise);
    let read = |parts: &[Part]| {
        let at = |t: &f64| parts.iter().map(|part| part.at(*t)).sum();
        let path = Track::new(times.clone(), times.iter().map(at).collect()).unwrap();
        path.oscillations(&Search::default()).unwrap()
    };
    let name = |parts: &[Part]| read(parts).pattern();
    assert_eq!(name(&[]), Pattern::None);
    for (minor, roundness, pattern) in [
        (1e-4, 0.01, Pattern::Pendular),
        (5e-3, 0.5, Pattern::Elliptic),
    ] {
        let found = read(&[part(90.0, 1e-2, minor, left)]);
        assert_eq!(found.pattern(), pattern);
        assert_abs_diff_eq!(
            found.oscillations[0].ellipse.roundness(),
            roundness,
            epsilon = 1e-9
        );
    }
    assert_eq!(name(&[part(90.0, 1e-2, 9.9e-3, right)]), Pattern::Circular);
    let same = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, left)]);
    assert!(
        matches!(same, Pattern::Epitrochoid { loops, ratio }
        if abs_diff_eq!(loops, 3.65, epsilon = 1e-6) && abs_diff_eq!(ratio, 0.2, epsilon = 1e-6)),
        "{same:?}"
    );
    let opposite = name(&[part(93.0, 1e-2, 1e-2, left), part(20.0, 2e-3, 2e-3, right)]);
    let named = matches!(opposite, Pattern::Hypotrochoid { loops, .. } if abs_diff_eq!(loops, 5.65, epsilon = 1e-6));
    assert!(named, "{opposite:?}");
    assert_eq!(read(&[part(93.0, 1e-2, 1e-2, right)]).sense(), Some(right));
    // An ellipse is the sum of two circles with opposite senses.
    let ellipse = read(&[part(90.0, 1e-2, 5e-3, right)]).oscillations[0].ellipse;
    assert_abs_diff_eq!(
        0.5 * (ellipse.major - ellipse.minor),
        2.5e-3,
        epsilon = 1e-9
    );
    assert_abs_diff_eq!(
        0.5 * (ellipse.major + ellipse.minor),
        7.5e-3,
        epsilon = 1e-9
    );
    assert_abs_diff_eq!(ellipse.direction, 0.3, epsilon = 1e-9);
}

#[test]
fn share_of_a_period_is_its_fraction_of_the_power() {
    let times: Vec<f64> = (0..400).map(|k| 60.0 * f64::from(k)).collect();
    let circle = |t: f64, minutes: f64, size: f64| {
        let (sine, cosine) = (TAU * t / (minutes * MINUTE)).sin_cos();
        Vector2::new(cosine, sine) * size
    };
    let at = |t: &f64| circle(*t, 88.0, 3e-3) + circle(*t, 24.0, 4e-3);
    let path = Track::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let share = |minutes: f64| path.share(minutes * MINUTE, &Search::default()).unwrap();
    // The powers of the circles are proportional to 4² and 3².
    assert_abs_diff_eq!(share(24.0), 0.64, epsilon = 1e-6);
    assert_abs_diff_eq!(share(88.0), 0.36, epsilon = 1e-6);
    assert!(share(40.0) < 1e-9, "{}", share(40.0));
    let still = Track::new(times.clone(), vec![Vector2::new(1.0, 2.0); times.len()]).unwrap();
    assert_eq!(still.share(1440.0, &Search::default()), Ok(0.0));
}

#[test]
fn right_handed_rotation_about_the_viewing_axis_is_counterclockwise() {
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    for axis in [
        Vector3::z(),
        Vector3::x(),
        Vector3::new(1.0, -2.0, 0.5),
        -Vector3::z(),
    ] {
        let about = nalgebra::Unit::new_normalize(axis);
        let start = axis.cross(&Vector3::new(0.3, 0.8, 0.1));
        let at = |t: &f64| nalgebra::Rotation3::from_axis_angle(&about, TAU * t / 20.0) * start;
        let positions: Vec<_> = times.iter().map(at).collect();
        let path = Track::seen_along(&axis, times.clone(), &positions).unwrap();
        let found = path.oscillations(&Search::default()).unwrap();
        assert_eq!(
            found.sense(),
            Some(Handedness::Counterclockwise),
            "{axis:?}"
        );
        assert_relative_eq!(
            found.oscillations[0].ellipse.major,
            start.norm(),
            epsilon = 0.0,
            max_relative = 1e-9
        );
    }
}

#[test]
fn moving_average_uses_the_given_number_of_positions() {
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    let path = Track::new(
        times,
        (0..10).map(|k| Vector2::x() * f64::from(k * k)).collect(),
    )
    .unwrap();
    let mean = path.moving_average(3).unwrap();
    assert_eq!((mean.times()[0], mean.positions().len()), (1.0, 8));
    assert_abs_diff_eq!(mean.positions()[0].x, 5.0 / 3.0, epsilon = 1e-14);
    assert!(matches!(
        path.moving_average(11),
        Err(TrackingError::Insufficient {
            value: 10.0,
            needed: 11.0,
            ..
        })
    ));
    assert!(path.moving_average(0).is_err());
}

#[test]
fn invalid_tracks_and_search_settings_are_refused() {
    let times = |n: u32| -> Vec<f64> { (0..n).map(f64::from).collect() };
    let up = Vector3::z();
    let error = Track::seen_along(&up, times(3), &[Vector3::zeros(); 2]).unwrap_err();
    assert!(
        matches!(error, TrackingError::Position { index: 2, .. }),
        "{error}"
    );
    let mut repeated = times(5);
    repeated[3] = 2.0;
    let error = Track::seen_along(&up, repeated, &[Vector3::zeros(); 5]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "position number 3 has a time that is not later than the one before it"
    );
    let mut lost = vec![Vector3::zeros(); 5];
    lost[4].y = f64::NAN;
    let error = Track::seen_along(&up, times(5), &lost).unwrap_err();
    assert_eq!(error.to_string(), "position number 4 is not finite");
    let mut never = times(5);
    never[1] = f64::INFINITY;
    let error = Track::new(never, vec![Vector2::zeros(); 5]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "position number 1 has a time that is not finite"
    );
    let still = |n: u32| Track::new(times(n), vec![Vector2::zeros(); n as usize]).unwrap();
    let search = Search::default();
    assert!(matches!(
        still(10).oscillations(&search),
        Err(TrackingError::Insufficient { .. })
    ));
    assert!(matches!(
        still(0).oscillations(&search),
        Err(TrackingError::Insufficient { .. })
    ));
    assert!(still(50).between(30.0, 20.0).oscillations(&search).is_err());
    assert_eq!(still(50).between(10.0, 20.0).times().len(), 11);
    // A tip that does not move has no period, which is a valid result.
    let found = still(50).oscillations(&search).unwrap();
    assert!(found.oscillations.is_empty() && found.noise == 0.0 && found.outliers.is_empty());
    for least_turns in [0.0, f64::NAN, -1.0] {
        let error = still(50)
            .oscillations(&Search {
                least_turns,
                ..search
            })
            .unwrap_err();
        assert!(
            error.to_string().contains("least number of turns"),
            "{error}"
        );
    }
    for period in [0.0, -5.0, f64::NAN, 60.0] {
        assert!(still(50).share(period, &search).is_err(), "{period}");
    }
    assert!(Track::seen_along(&Vector3::zeros(), times(50), &[Vector3::zeros(); 50]).is_err());
}

#[test]
fn amplitudes_of_any_size_are_found() {
    let times: Vec<f64> = (0..200).map(|k| 60.0 * f64::from(k)).collect();
    for size in [1e-300, 1e-160, 1e170, 1e300] {
        let at = |t: &f64| {
            let (sine, cosine) = (TAU * t / 2400.0).sin_cos();
            Vector2::new(cosine, 0.5 * sine) * size
        };
        let path = Track::new(times.clone(), times.iter().map(at).collect()).unwrap();
        let found = path.oscillations(&Search::default()).unwrap().oscillations;
        assert_eq!(found.len(), 1, "{size}: {found:?}");
        assert_relative_eq!(
            found[0].ellipse.major,
            size,
            epsilon = 0.0,
            max_relative = 1e-9
        );
        assert_relative_eq!(
            found[0].ellipse.minor,
            0.5 * size,
            epsilon = 0.0,
            max_relative = 1e-9
        );
        assert_relative_eq!(found[0].period, 2400.0, epsilon = 0.0, max_relative = 1e-9);
    }
}
