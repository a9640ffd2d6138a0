//! Quantities reported by tracking pipelines, compared with closed forms: waves, chirps, circles,
//! white noise, gaps and outliers.
//!
//! `MORPHOROD_CASES=1000 cargo test --workspace --test all tracked_paths -- --nocapture` draws more
//! random tracks.

use std::f64::consts::{PI, SQRT_2, TAU};

use crate::fixtures::random::{Draw, circle, number, path};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::tracking::{Track, TrackingError};
use morphorod::tropism::Handedness;
use nalgebra::{Rotation2, Vector2};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Period of the motion of the tip in most of these tests, s.
const PERIOD: f64 = 90.0 * MINUTE;
const BAND: [f64; 2] = [30.0 * MINUTE, 4.0 * HOUR];

#[test]
fn planar_wave_has_its_period_amplitude_and_wavelet_power() {
    // An oscillation along one axis, for 24 h with a position every 2 min.
    let wave = path(720, 120.0, |t| {
        Vector2::new(3e-3 * (TAU * t / PERIOD + 0.4).cos(), 0.0)
    });
    let found = wave.nutation(BAND).unwrap();
    let period = found.period.unwrap();
    // The maximum is that of a parabola through three scales, which are a sixteenth of an octave
    // apart. Its error δ² f'''/6 f'' is 1e-3.
    assert!(found.nutates);
    assert_relative_eq!(period, PERIOD, epsilon = 0.0, max_relative = 1e-3);
    let [lower, upper] = found.period_quartiles.unwrap();
    assert!(upper - lower < 2e-3 * PERIOD, "{lower} {upper}");
    // At √2 scales from an end the component with the opposite sense contributes less than e⁻¹/(12
    // √(2π)) = 1.2 %.
    assert_abs_diff_eq!(found.amplitude.unwrap(), 3e-3, epsilon = 0.012 * 3e-3);
    assert!(found.band_power > 0.999, "{}", found.band_power);
    assert_eq!(found.sense, None);
    assert_abs_diff_eq!(
        found.sampling.unwrap(),
        2.0 * 120.0 / period,
        epsilon = 1e-12
    );
    // The power is largest at the scale period/1.033, which is the conversion between scales and
    // periods. It is not largest at the scale of the centre frequency.
    let middle = found.scalogram.times.len() / 2;
    let power: Vec<f64> = found
        .scalogram
        .power
        .iter()
        .map(|row| row[middle])
        .collect();
    let top = (0..power.len())
        .max_by(|i, j| power[*i].total_cmp(&power[*j]))
        .unwrap();
    let step = (found.scalogram.periods[1] / found.scalogram.periods[0]).ln();
    assert_abs_diff_eq!(
        found.scalogram.periods[top].ln(),
        PERIOD.ln(),
        epsilon = 0.51 * step
    );
    // The definition of the transform gives the power of a wave at this scale: √π s/δt times the
    // variance, times exp(−(6 − (6 + √38)/2)²) = 0.9933.
    let scale = PERIOD / (4.0 * PI / (6.0 + 38.0_f64.sqrt()));
    let expected = 0.9933 * PI.sqrt() * scale / 120.0;
    assert_abs_diff_eq!(power[top], expected, epsilon = 0.02 * expected);
}

#[test]
fn cone_of_influence_is_that_of_torrence_and_compo() {
    // The power of a discontinuity falls by e² over √2 scales (Torrence and Compo). The power of a
    // short pulse falls by the same factor.
    let mut wave = path(1001, 60.0, |_| Vector2::zeros());
    let mut positions = wave.positions().to_vec();
    // Three displaced positions in a row, which the median of five does not reject as outliers.
    (499..502).for_each(|k| positions[k].x = 1e-3);
    wave = Track::new(wave.times().to_vec(), positions).unwrap();
    let found = wave.nutation([1200.0, 12000.0]).unwrap().scalogram;
    let centre = 500.0 * 60.0;
    for (j, period) in found.periods.iter().enumerate() {
        let scale = period / 1.03304;
        if scale < 1200.0 || *period > 8000.0 {
            // Below a scale of 1200 s, the times are too far apart and the pulse is not short.
            // Above a period of 8000 s, a part of the pulse is removed as drift.
            continue;
        }
        let at = |t: f64| {
            let k = found.times.partition_point(|other| *other < t);
            let part = (t - found.times[k - 1]) / (found.times[k] - found.times[k - 1]);
            (found.power[j][k - 1].ln() * (1.0 - part) + found.power[j][k].ln() * part).exp()
        };
        let fall = (at(centre) / at(centre + SQRT_2 * scale)).ln();
        assert!(
            abs_diff_eq!(fall, 2.0, epsilon = 0.06),
            "{period} s: {fall}"
        );
        // The cone of influence at both ends has the same width.
        for (t, outside) in found.times.iter().zip(&found.outside_cone[j]) {
            let cone = SQRT_2 * scale;
            if (t - cone).abs() > 1.0 && (60000.0 - t - cone).abs() > 1.0 {
                assert_eq!(*outside, *t > cone && *t < 60000.0 - cone, "{period} {t}");
            }
        }
    }
}

#[test]
fn period_and_amplitude_of_a_chirp_are_followed() {
    // The period grows linearly from 60 to 120 min in 48 h. The phase is the integral of the
    // angular frequency.
    let (first, rate) = (60.0 * MINUTE, 60.0 * MINUTE / (48.0 * HOUR));
    let chirp = path(1440, 120.0, |t| {
        let (sine, cosine) = (TAU * (1.0 + rate * t / first).ln() / rate).sin_cos();
        Vector2::new(2e-3 * cosine, 1e-3 * sine)
    });
    let found = chirp.nutation(BAND).unwrap();
    assert!(found.nutates);
    for place in &found.ridge {
        let period = first + rate * place.time;
        // At √2 scales from an end 8 % of the Gaussian are outside the track. This moves its centre
        // by 0.16 scales, where the period differs by 0.3 %. The component with the opposite sense
        // contributes 1.2 %.
        assert!(
            abs_diff_eq!(place.period, period, epsilon = 0.012 * period),
            "{place:?} {period}"
        );
        // The opposite sense contributes 1.2 % again. The frequency changes within the wavelet,
        // which reduces the amplitude by (dω/dt s²)²/4 = 0.4 %. The error of 1 % of the period
        // changes it by up to 0.6 %.
        assert!(
            abs_diff_eq!(place.ellipse.major, 2e-3, epsilon = 0.03 * 2e-3),
            "{place:?}"
        );
    }
    let [lower, upper] = found.period_quartiles.unwrap();
    let quartiles = [lower, found.period.unwrap(), upper];
    let known: Vec<f64> = [0.25, 0.5, 0.75]
        .iter()
        .map(|part| {
            let (from, to) = (found.ridge[0].time, found.ridge[found.ridge.len() - 1].time);
            first + rate * (from + part * (to - from))
        })
        .collect();
    for (found, known) in quartiles.iter().zip(&known) {
        assert!(
            relative_eq!(found, known, epsilon = 0.0, max_relative = 5e-3),
            "{quartiles:?} {known:?}"
        );
    }
}

#[test]
fn velocity_of_circular_motion_turns_once_in_a_period() {
    for (sign, sense) in [
        (1.0, Handedness::Counterclockwise),
        (-1.0, Handedness::Clockwise),
    ] {
        // The velocity is π/2 ahead of the position, and rotates at the same rate.
        let round = path(601, 120.0, |t| circle(sign * t, PERIOD, 4e-3));
        let angles = round.direction().unwrap();
        let turned = (angles[600] - angles[0]) / TAU;
        // The one-sided differences at both ends reduce the rotation by the angle of half a step
        // each.
        let ends = 120.0 / PERIOD;
        assert_abs_diff_eq!(turned, sign * (72000.0 / PERIOD - ends), epsilon = 1e-9);
        let ahead = angles[300] - sign * (TAU * 36000.0 / PERIOD + 0.5 * PI);
        assert_abs_diff_eq!(ahead / TAU, (ahead / TAU).round(), epsilon = 1e-9);
        // The track is an ellipse with axes in the ratio 1 to 4. The standard deviation of the
        // noise is a twentieth of the minor axis.
        let mut draw = Draw::new(7);
        let found = path(720, 120.0, |t| {
            let p = circle(sign * t, PERIOD, 4e-3);
            Rotation2::new(0.7) * Vector2::new(p.x, 0.25 * p.y) + draw.normal() * 5e-5
        });
        let found = found.nutation(BAND).unwrap();
        assert_eq!(found.sense, Some(sense));
        let known = (found.ridge[found.ridge.len() - 1].time - found.ridge[0].time) / PERIOD;
        // The direction of the velocity on an ellipse differs from its phase by up to a quarter of
        // a turn.
        assert_abs_diff_eq!(found.turns.unwrap(), sign * known, epsilon = 0.3);
        assert_eq!(found.direction.len(), found.ridge.len());
        let turned = found.direction[found.direction.len() - 1] - found.direction[0];
        assert_abs_diff_eq!(turned, TAU * found.turns.unwrap(), epsilon = 1e-9);
    }
}

#[test]
fn amplitude_of_a_drifting_tip_is_that_of_its_circles() {
    let mut draw = Draw::new(3);
    // The track is the sum of a drift that approaches 40 mm, a daily oscillation of 3 mm, circles
    // of radius 1 mm, and noise.
    let drift = |t: f64| {
        Vector2::new(
            0.04 * (1.0 - (-t / (20.0 * HOUR)).exp()),
            3e-3 * (TAU * t / (24.0 * HOUR)).sin(),
        )
    };
    let tip = path(1440, 120.0, |t| {
        drift(t) + circle(t, PERIOD, 1e-3) + draw.normal() * 5e-5
    });
    let across: Vec<f64> = tip.positions().iter().map(|p| p.x).collect();
    let span = across.iter().fold(f64::MIN, |a, b| a.max(*b))
        - across.iter().fold(f64::MAX, |a, b| a.min(*b));
    let found = tip.nutation(BAND).unwrap();
    let amplitude = found.amplitude.unwrap();
    assert!(span / amplitude > 20.0, "{span} {amplitude}");
    // The maximum of the envelope exceeds its mean because of noise in the band. A wavelet with s =
    // 45 positions reduces noise of 0.05 mm to 2 · 0.05/√(2 √π · 45) = 0.008 mm at each scale. The
    // tolerance is about three times that.
    assert_abs_diff_eq!(amplitude, 1e-3, epsilon = 0.03 * 1e-3);
    assert_relative_eq!(
        found.period.unwrap(),
        PERIOD,
        epsilon = 0.0,
        max_relative = 3e-3
    );
    assert_eq!(found.sense, Some(Handedness::Counterclockwise));
    // The spectrum has 400 lines beyond the band. The relative error of their median is about
    // 1/√400.
    assert_abs_diff_eq!(found.noise_floor.unwrap(), 5e-5, epsilon = 0.1 * 5e-5);
    // The daily oscillation is classified as drift. A fraction of 0.4 % remains, which is 1e-2 mm.
    assert!(found.band_power > 0.98, "{}", found.band_power);
}

#[test]
fn white_noise_is_not_reported_as_nutation() {
    // If a defect let the method report nutation for one track in ten, more than three of 60 would
    // be reported with a probability of 86 %.
    let (cases, seed) = (number("MORPHOROD_CASES", 60), number("MORPHOROD_SEED", 1));
    let band = [1800.0, 14400.0];
    let mut reported = [0; 4];
    let mut floors = 0.0;
    for case in 0..cases {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
        // The four kinds are noise at even times, at random times, along a line, and added to a
        // drift with a third of the frames lost.
        let even = path(300, 300.0, |_| draw.normal());
        let mut times: Vec<f64> = (0..300).map(|_| draw.uniform(0.0, 90000.0)).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let uneven =
            Track::new(times.clone(), times.iter().map(|_| draw.normal()).collect()).unwrap();
        let line = path(300, 300.0, |_| Vector2::new(1.0, 2.0) * draw.normal().x);
        let kept: Vec<f64> = (0..300)
            .map(|k| 300.0 * f64::from(k))
            .filter(|_| draw.chance(0.67))
            .collect();
        let drifting =
            |t: &f64| draw.normal() + Vector2::new(20.0 * t / 90000.0, 5.0 * (t / 90000.0).powi(2));
        let positions = kept.iter().map(drifting).collect();
        let lost = Track::new(kept, positions).unwrap();
        for (kind, path) in [even, uneven, line, lost].iter().enumerate() {
            let found = path.nutation(band).unwrap();
            reported[kind] += u64::from(found.nutates);
            assert_eq!(
                found.nutates,
                found.period.is_some() && found.amplitude.is_some()
            );
            assert!(found.nutates || found.sense.is_none());
            if kind == 0 {
                floors += found.noise_floor.unwrap();
            }
        }
    }
    println!("nutation is reported for {reported:?} of {cases} tracks of noise");
    // The measured rate is at most one track of 200 of each kind. The bound is 5 %.
    assert!(
        reported
            .iter()
            .all(|reported| *reported as f64 <= 0.05 * cases as f64),
        "{reported:?}"
    );
    // For even times the floor is the standard deviation of the noise. The mean of 60 medians of 99
    // lines has an error of one percent.
    assert_abs_diff_eq!(floors / cases as f64, 1.0, epsilon = 0.03);
}

#[test]
fn gaps_lost_frames_and_outliers_do_not_change_period_and_amplitude() {
    for seed in 1..20 {
        let mut draw = Draw::new(seed);
        let (mut times, mut positions, mut outliers) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..1440 {
            let t = 120.0 * (f64::from(k) + draw.uniform(-0.3, 0.3));
            // There are two gaps of five hours, and a tenth of the frames is lost at random.
            if (9.0 * HOUR..14.0 * HOUR).contains(&t)
                || (30.0 * HOUR..35.0 * HOUR).contains(&t)
                || draw.chance(0.1)
            {
                continue;
            }
            let mut position =
                circle(-t, PERIOD, 3e-3) + draw.normal() * 1e-4 + Vector2::x() * (1e-7 * t);
            if draw.chance(0.02) {
                position += Rotation2::new(draw.uniform(0.0, TAU)) * Vector2::x() * 0.05;
                outliers.push(times.len());
            }
            times.push(t);
            positions.push(position);
        }
        let found = Track::new(times, positions)
            .unwrap()
            .nutation(BAND)
            .unwrap();
        assert!(found.nutates && found.sense == Some(Handedness::Clockwise));
        let period = found.period.unwrap();
        assert!(
            relative_eq!(period, PERIOD, epsilon = 0.0, max_relative = 3e-3),
            "{seed}: {period:?}"
        );
        let [lower, upper] = found.period_quartiles.unwrap();
        assert!(upper - lower < 0.02 * PERIOD, "{seed}: {lower} {upper}");
        // The noise is twice as large as in the test with drift, and the amplitude three times as
        // large. The component with the opposite sense contributes near gaps.
        let amplitude = found.amplitude.unwrap();
        assert!(
            abs_diff_eq!(amplitude, 3e-3, epsilon = 0.04 * 3e-3),
            "{seed}: {amplitude}"
        );
        // Random losses of consecutive frames also produce short gaps.
        let long: Vec<[f64; 2]> = found
            .gaps
            .iter()
            .copied()
            .filter(|[from, to]| to - from > 4.0 * HOUR)
            .collect();
        assert_eq!(long.len(), 2, "{seed}: {:?}", found.gaps);
        assert!(
            outliers.iter().all(|k| found.outliers.contains(k)),
            "{seed}: {outliers:?} {:?}",
            found.outliers
        );
        // No point of the ridge lies in the cone of influence of a gap.
        for place in &found.ridge {
            let near = |edge: f64| (place.time - edge).abs() < SQRT_2 * place.period / 1.034;
            assert!(!long.iter().flatten().any(|edge| near(*edge)), "{place:?}");
        }
    }
}
#[test]
fn still_tips_and_periods_outside_the_band_are_not_nutation() {
    let still = [
        path(500, 120.0, |_| Vector2::new(0.3, -0.2)),
        path(500, 120.0, |_| Vector2::zeros()),
        path(500, 120.0, |t| {
            Vector2::new(0.3 + 1e-7 * t, -0.2 + 1e-12 * t * t)
        }),
    ];
    for path in still {
        let found = path.nutation(BAND).unwrap();
        assert!(
            !found.nutates
                && found.period.is_none()
                && found.amplitude.is_none()
                && found.sense.is_none()
        );
        assert!(
            found.ridge.is_empty() && found.turns.is_none() && found.band_power == 0.0,
            "{found:?}"
        );
    }
    // Oscillations with periods below or above the band are not reported.
    for period in [12.0 * MINUTE, 7.0 * HOUR] {
        let found = path(1440, 60.0, |t| circle(t, period, 1e-3))
            .nutation(BAND)
            .unwrap();
        assert!(!found.nutates, "{period}: {:?}", found.period);
    }
}

#[test]
fn short_coarse_tracks_and_invalid_bands_are_refused() {
    let short = path(100, 120.0, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(
        short.nutation(BAND).unwrap_err(),
        TrackingError::Insufficient {
            what: "duration of the track (s), three times the longest period of the band,",
            value: 99.0 * 120.0,
            needed: 12.0 * HOUR
        }
    );
    let message = short.nutation(BAND).unwrap_err().to_string();
    let expected = "the duration of the track (s), three times the longest period of the band, is 11880 but must be at \
        least 43200";
    assert_eq!(message, expected);
    let few = path(5, 4.0 * HOUR, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(
        few.nutation(BAND).unwrap_err(),
        TrackingError::Insufficient {
            what: "number of positions",
            value: 5.0,
            needed: 8.0
        }
    );
    let coarse = path(200, 20.0 * MINUTE, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(
        coarse.nutation(BAND).unwrap_err(),
        TrackingError::Insufficient {
            what: "shortest period of the band (s), two sampling intervals,",
            value: 1800.0,
            needed: 2400.0
        }
    );
    let fine = path(720, 120.0, |t| circle(t, PERIOD, 1e-3));
    for (shortest, longest) in [
        (0.0, 1e4),
        (-1.0, 1e4),
        (f64::NAN, 1e4),
        (1e3, 1e3),
        (1e4, 1e3),
        (1e3, f64::NAN),
        (1e3, f64::INFINITY),
    ] {
        let error = fine.nutation([shortest, longest]).unwrap_err();
        assert!(error.to_string().contains("period of the band"), "{error}");
    }
    let error = fine.between(0.0, 60.0).direction().unwrap_err();
    assert_eq!(
        error,
        TrackingError::Insufficient {
            what: "number of positions",
            value: 1.0,
            needed: 2.0
        }
    );
}

/// Tracks with huge or tiny lengths and intervals, bursts, single positions or few distinct values
/// give finite numbers or an error.
#[test]
fn random_tracks_give_finite_numbers_or_errors() {
    for seed in 0..number("MORPHOROD_CASES", 100) {
        let mut draw = Draw::new(seed + 1);
        let size = draw.log(1e-300, 1e300);
        let steps = draw.log(1e-250, 1e250);
        let levels = draw.log(1.0, 1e6).floor();
        let mut t = draw.uniform(-1.0, 1.0) * draw.log(1.0, 1e12) * steps;
        let (mut times, mut positions) = (Vec::new(), Vec::new());
        for _ in 0..draw.log(1.0, 400.0) as usize {
            t += if draw.chance(0.05) {
                draw.log(1.0, 1e3) * steps
            } else {
                draw.uniform(0.2, 1.0) * steps
            };
            times.push(t);
            let wave = Vector2::new((t / steps).sin(), (t / steps / 7.0).cos());
            let position = if draw.chance(0.3) {
                draw.vector(1.0).xy()
            } else {
                wave
            };
            positions.push((position * levels).map(f64::round) / levels * size);
        }
        times.dedup();
        positions.truncate(times.len());
        let Ok(path) = Track::new(times, positions) else {
            continue;
        };
        let shortest = draw.log(0.1, 1e2) * steps;
        let Ok(found) = path.nutation([shortest, shortest * draw.log(1.01, 100.0)]) else {
            continue;
        };
        let numbers = [
            found.amplitude,
            found.noise_floor,
            found.sampling,
            found.turns,
            Some(found.band_power),
        ];
        assert!(
            numbers.iter().flatten().all(|x| x.is_finite()),
            "{seed}: {numbers:?}"
        );
        assert!(
            (0.0..=1.0).contains(&found.band_power),
            "{seed}: {}",
            found.band_power
        );
        assert!(
            found
                .scalogram
                .power
                .iter()
                .flatten()
                .chain(&found.direction)
                .all(|x| x.is_finite()),
            "{seed}"
        );
        assert!(
            found
                .ridge
                .iter()
                .all(|p| p.period.is_finite() && p.ellipse.major.is_finite()),
            "{seed}"
        );
    }
}
