//! What tracking pipelines report, against closed forms: waves, chirps, circles, drift, white noise, gaps and outliers.
//!
//! `MORPHOROD_CASES=1000 cargo test --workspace --test tracked_paths -- --nocapture` draws more paths of noise.

use std::f64::consts::{PI, SQRT_2, TAU};

use crate::fixtures::random::{Draw, circle, number, path};
use morphorod::orbit::{Band, OrbitError, PlanePath, Search};
use morphorod::tropism::Handedness;
use nalgebra::{Rotation2, Vector2};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Of the tips of these tests.
const PERIOD: f64 = 90.0 * MINUTE;
const BAND: Band = Band { shortest: 30.0 * MINUTE, longest: 4.0 * HOUR };

#[test]
fn a_wave_and_its_scale() {
    // To and fro along one axis, 24 h of it every 2 min.
    let wave = path(720, 120.0, |t| Vector2::new(3e-3 * (TAU * t / PERIOD + 0.4).cos(), 0.0));
    let found = wave.tracked(&BAND).unwrap();
    let period = found.period.unwrap();
    // A parabola through three scales, a sixteenth of an octave apart: δ² f'''/6 f'' is 1e-3.
    assert!(found.nutates && (period.median / PERIOD - 1.0).abs() < 1e-3, "{period:?}");
    assert!(period.range() < 2e-3 * PERIOD, "{period:?}");
    // At √2 scales from an end the wave that turns the other way is seen, too: by less than e⁻¹/(12 √(2π)) = 1.2 %.
    assert!((found.amplitude.unwrap() / 3e-3 - 1.0).abs() < 0.012, "{:?}", found.amplitude);
    assert!(found.band_power > 0.999, "{}", found.band_power);
    assert_eq!(found.sense, None);
    assert!((found.sampling.unwrap() - 2.0 * 120.0 / period.median).abs() < 1e-12);
    // Power is largest at the scale of period/1.033, which is how periods are told of scales; and not at that of the centre frequency.
    let middle = found.scalogram.times.len() / 2;
    let power: Vec<f64> = found.scalogram.power.iter().map(|row| row[middle]).collect();
    let top = (0..power.len()).max_by(|i, j| power[*i].total_cmp(&power[*j])).unwrap();
    let step = (found.scalogram.periods[1] / found.scalogram.periods[0]).ln();
    assert!((found.scalogram.periods[top] / PERIOD).ln().abs() < 0.51 * step);
    // There it is √π s/δt of the variance, times exp(−(6 − (6 + √38)/2)²) = 0.9933 (from the transform's definition, of a wave).
    let scale = PERIOD / (4.0 * PI / (6.0 + 38.0_f64.sqrt()));
    let expected = 0.9933 * PI.sqrt() * scale / 120.0;
    assert!((power[top] / expected - 1.0).abs() < 0.02, "{} {expected}", power[top]);
}

#[test]
fn the_cone_of_influence_has_the_length_of_torrence_and_compo() {
    // The power of a jump falls by e² over √2 scales: here of one position that is moved, which is a pulse and falls the same.
    let mut wave = path(1001, 60.0, |_| Vector2::zeros());
    let mut positions = wave.positions().to_vec();
    // Three in a row, which the median of five does not take for an outlier.
    (499..502).for_each(|k| positions[k].x = 1e-3);
    wave = PlanePath::new(wave.times().to_vec(), positions).unwrap();
    let found = wave.tracked(&Band { shortest: 1200.0, longest: 12000.0 }).unwrap().scalogram;
    let centre = 500.0 * 60.0;
    for (j, period) in found.periods.iter().enumerate() {
        let scale = period / 1.03304;
        if scale < 1200.0 || *period > 8000.0 {
            continue; // Instants are too far apart to see it, and the pulse is not short; or it is drift in part.
        }
        let at = |t: f64| {
            let k = found.times.partition_point(|other| *other < t);
            let part = (t - found.times[k - 1]) / (found.times[k] - found.times[k - 1]);
            (found.power[j][k - 1].ln() * (1.0 - part) + found.power[j][k].ln() * part).exp()
        };
        let fall = (at(centre) / at(centre + SQRT_2 * scale)).ln();
        assert!((fall - 2.0).abs() < 0.06, "{period}: {fall}");
        // And so far from both ends nothing is told.
        for (t, outside) in found.times.iter().zip(&found.outside_cone[j]) {
            let cone = SQRT_2 * scale;
            if (t - cone).abs() > 1.0 && (60000.0 - t - cone).abs() > 1.0 {
                assert_eq!(*outside, *t > cone && *t < 60000.0 - cone, "{period} {t}");
            }
        }
    }
}

#[test]
fn a_chirp_is_followed() {
    // The period grows from 60 to 120 min in 48 h, linearly: the phase is its inverse's integral.
    let (first, rate) = (60.0 * MINUTE, 60.0 * MINUTE / (48.0 * HOUR));
    let chirp = path(1440, 120.0, |t| {
        let (sine, cosine) = (TAU * (1.0 + rate * t / first).ln() / rate).sin_cos();
        Vector2::new(2e-3 * cosine, 1e-3 * sine)
    });
    let found = chirp.tracked(&BAND).unwrap();
    assert!(found.nutates);
    for place in &found.ridge {
        let period = first + rate * place.time;
        // At √2 scales from an end 8 % of the Gaussian lie beyond it, and its middle lies 0.16 scales further in, where the period
        // is 0.3 % off; and the wave that turns the other way is seen by 1.2 %.
        assert!((place.period / period - 1.0).abs() < 0.012, "{place:?} {period}");
        // The same 1.2 %; the chirp goes out of step within the wavelet, which costs (dω/dt s²)²/4 = 0.4 %; and the period that the answer
        // is compared with is 1 % off, which costs up to 0.6 %.
        assert!((place.ellipse.major / 2e-3 - 1.0).abs() < 0.03, "{place:?}");
    }
    let quartiles = found.period.unwrap();
    let known: Vec<f64> = [0.25, 0.5, 0.75]
        .iter()
        .map(|part| {
            let (from, to) = (found.ridge[0].time, found.ridge[found.ridge.len() - 1].time);
            first + rate * (from + part * (to - from))
        })
        .collect();
    for (found, known) in [quartiles.lower, quartiles.median, quartiles.upper].iter().zip(&known) {
        assert!((found / known - 1.0).abs() < 5e-3, "{quartiles:?} {known:?}");
    }
}

#[test]
fn a_circle_turns_its_velocity_once_in_a_period() {
    for (sign, sense) in [(1.0, Handedness::Counterclockwise), (-1.0, Handedness::Clockwise)] {
        // As it is drawn: the velocity is a quarter turn ahead, and goes round as often as the tip.
        let round = path(601, 120.0, |t| circle(sign * t, PERIOD, 4e-3));
        let angles = round.direction().unwrap();
        let turned = (angles[600] - angles[0]) / TAU;
        let ends = 120.0 / PERIOD; // Those two differences are of one side: half a step short on either.
        assert!((turned - sign * (72000.0 / PERIOD - ends)).abs() < 1e-9, "{turned}");
        let ahead = angles[300] - sign * (TAU * 36000.0 / PERIOD + 0.5 * PI);
        assert!((ahead / TAU - (ahead / TAU).round()).abs() < 1e-9, "{ahead}");
        // An ellipse of axes as 1 to 4 with noise of a twentieth of the smaller one.
        let mut draw = Draw::new(7);
        let found = path(720, 120.0, |t| {
            let p = circle(sign * t, PERIOD, 4e-3);
            Rotation2::new(0.7) * Vector2::new(p.x, 0.25 * p.y) + draw.normal() * 5e-5
        });
        let found = found.tracked(&BAND).unwrap();
        assert_eq!(found.sense, Some(sense));
        let known = (found.ridge[found.ridge.len() - 1].time - found.ridge[0].time) / PERIOD;
        // The phases of both ends are those of an ellipse, up to a quarter of a turn off.
        assert!((found.turns - sign * known).abs() < 0.3, "{} {known}", found.turns);
        assert_eq!(found.direction.len(), found.ridge.len());
        assert!((found.direction[found.direction.len() - 1] - found.direction[0] - TAU * found.turns).abs() < 1e-9);
    }
}

#[test]
fn the_bounding_box_of_a_tip_that_drifts_is_no_amplitude() {
    let mut draw = Draw::new(3);
    // 40 mm of growth, slower and slower, and a day's course; circles of 1 mm.
    let drift =
        |t: f64| Vector2::new(0.04 * (1.0 - (-t / (20.0 * HOUR)).exp()), 3e-3 * (TAU * t / (24.0 * HOUR)).sin());
    let tip = path(1440, 120.0, |t| drift(t) + circle(t, PERIOD, 1e-3) + draw.normal() * 5e-5);
    let across: Vec<f64> = tip.positions().iter().map(|p| p.x).collect();
    let span = across.iter().fold(f64::MIN, |a, b| a.max(*b)) - across.iter().fold(f64::MAX, |a, b| a.min(*b));
    let found = tip.tracked(&BAND).unwrap();
    let amplitude = found.amplitude.unwrap();
    assert!(span / amplitude > 20.0, "{span} {amplitude}");
    // The largest of an envelope is above its mean by noise in the band: of 0.05 mm, a wavelet of s = 45 positions leaves
    // 2 · 0.05/√(2 √π · 45) = 0.008 mm a scale; three times that.
    assert!((amplitude / 1e-3 - 1.0).abs() < 0.03, "{amplitude}");
    assert!((found.period.unwrap().median / PERIOD - 1.0).abs() < 3e-3);
    assert_eq!(found.sense, Some(Handedness::Counterclockwise));
    // 400 lines of the spectrum beyond the band: the error of their median is 1/√400 or so.
    assert!((found.noise_floor.unwrap() / 5e-5 - 1.0).abs() < 0.1, "{:?}", found.noise_floor);
    // The day's course is drift: it is removed to 4 parts in 1000, which are 1e-2 mm.
    assert!(found.band_power > 0.98, "{}", found.band_power);
}

#[test]
fn white_noise_does_not_nutate() {
    let (cases, seed) = (number("MORPHOROD_CASES", 100), number("MORPHOROD_SEED", 1));
    let mut taken = [0; 4];
    let mut floors = 0.0;
    for case in 0..cases {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(case));
        // Even times; times at random, as uneven as can be; noise along a line; a third of the frames lost, in a tip that drifts.
        let even = path(300, 300.0, |_| draw.normal());
        let mut times: Vec<f64> = (0..300).map(|_| draw.uniform(0.0, 90000.0)).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let uneven = PlanePath::new(times.clone(), times.iter().map(|_| draw.normal()).collect()).unwrap();
        let line = path(300, 300.0, |_| Vector2::new(1.0, 2.0) * draw.normal().x);
        let kept: Vec<f64> = (0..300).map(|k| 300.0 * f64::from(k)).filter(|_| draw.chance(0.67)).collect();
        let drifting = |t: &f64| draw.normal() + Vector2::new(20.0 * t / 90000.0, 5.0 * (t / 90000.0).powi(2));
        let positions = kept.iter().map(drifting).collect();
        let lost = PlanePath::new(kept, positions).unwrap();
        for (taken, path) in taken.iter_mut().zip([&even, &uneven, &line, &lost]) {
            let found = path.tracked(&Band { shortest: 1800.0, longest: 14400.0 }).unwrap();
            *taken += u64::from(found.nutates);
            assert_eq!(found.nutates, found.period.is_some() && found.amplitude.is_some());
            assert!(found.nutates || found.sense.is_none());
        }
        floors += even.tracked(&Band { shortest: 1800.0, longest: 14400.0 }).unwrap().noise_floor.unwrap();
    }
    println!("of {cases} paths of noise {taken:?} are taken for nutation");
    // Fewer than one of a hundred is measured in a thousand of each kind.
    assert!(taken.iter().all(|taken| *taken as f64 <= 0.05 * cases as f64), "{taken:?}");
    // The same floor in even frames as was put in; the mean of 100 medians of 99 lines is good to a percent.
    assert!((floors / cases as f64 - 1.0).abs() < 0.03, "{}", floors / cases as f64);
}

#[test]
fn gaps_lost_frames_and_outliers_do_not_spoil_it() {
    for seed in 1..20 {
        let mut draw = Draw::new(seed);
        let (mut times, mut positions, mut spoiled) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..1440 {
            let t = 120.0 * (f64::from(k) + draw.uniform(-0.3, 0.3));
            // Five hours without a frame, twice; and every tenth one lost.
            if (9.0 * HOUR..14.0 * HOUR).contains(&t) || (30.0 * HOUR..35.0 * HOUR).contains(&t) || draw.chance(0.1) {
                continue;
            }
            let mut position = circle(-t, PERIOD, 3e-3) + draw.normal() * 1e-4 + Vector2::x() * (1e-7 * t);
            if draw.chance(0.02) {
                position += Rotation2::new(draw.uniform(0.0, TAU)) * Vector2::x() * 0.05;
                spoiled.push(times.len());
            }
            times.push(t);
            positions.push(position);
        }
        let found = PlanePath::new(times, positions).unwrap().tracked(&BAND).unwrap();
        assert!(found.nutates && found.sense == Some(Handedness::Clockwise));
        let period = found.period.unwrap();
        assert!((period.median / PERIOD - 1.0).abs() < 3e-3 && period.range() < 0.02 * PERIOD, "{seed}: {period:?}");
        // Noise as in the test of drift, of twice the size in thrice the amplitude; and the wave that turns the other way at gaps.
        assert!((found.amplitude.unwrap() / 3e-3 - 1.0).abs() < 0.04, "{seed}: {:?}", found.amplitude);
        // Some frames in a row are lost by chance.
        let long: Vec<[f64; 2]> = found.gaps.iter().copied().filter(|[from, to]| to - from > 4.0 * HOUR).collect();
        assert_eq!(long.len(), 2, "{seed}: {:?}", found.gaps);
        assert!(spoiled.iter().all(|k| found.outliers.contains(k)), "{seed}: {spoiled:?} {:?}", found.outliers);
        // No place of the ridge lies in the cone of either.
        for place in &found.ridge {
            let near = |edge: f64| (place.time - edge).abs() < SQRT_2 * place.period / 1.034;
            assert!(!long.iter().flatten().any(|edge| near(*edge)), "{place:?}");
        }
    }
}

#[test]
fn drift_and_what_is_no_drift() {
    let duration = 2000.0 * 60.0;
    let middle = 900..1100;
    // The closed form of a Gaussian's local parabola: (1 + u) e⁻ᵘ is drift.
    for ratio in [0.4, 0.5, 1.0, 2.0, 4.0] {
        let period = 12000.0;
        let wave = path(2001, 60.0, |t| circle(t, ratio * period, 1.0));
        let left = wave.without_drift(period).unwrap();
        let u: f64 = 1.678347 / (ratio * ratio);
        let expected = 1.0 - (1.0 + u) * (-u).exp();
        for k in middle.clone() {
            let share = left.positions()[k].dot(&wave.positions()[k]);
            // Weights end at four standard deviations: 3e-4 of them.
            assert!((share - expected).abs() < 5e-4, "{ratio}: {share} {expected}");
        }
    }
    // A parabola is drift, whatever the times; what is left is rounding.
    let mut draw = Draw::new(5);
    let mut times: Vec<f64> = (0..500).map(|_| draw.uniform(0.0, duration)).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    let at = |t: &f64| Vector2::new(1.0 + t / duration, 3.0 - (t / duration).powi(2));
    let smooth = PlanePath::new(times.clone(), times.iter().map(at).collect()).unwrap();
    let left = smooth.without_drift(12000.0).unwrap();
    assert!(left.positions().iter().all(|p| p.norm() < 1e-10), "{left:?}");
    // The mean of seven positions in a row, of a circle of 50: sin(7π/50)/(7 sin(π/50)) of its radius.
    let mean = path(300, 60.0, |t| circle(t, 3000.0, 1.0)).moving_average(7).unwrap();
    let known = (7.0 * PI / 50.0).sin() / (7.0 * (PI / 50.0).sin());
    assert!(mean.positions().iter().all(|p| (p.norm() - known).abs() < 1e-12) && mean.times()[0] == 180.0);
    // Both parts are the whole.
    let wave = path(300, 60.0, |t| circle(t, 3000.0, 1.0));
    let (drift, left) = (wave.drift(5000.0).unwrap(), wave.without_drift(5000.0).unwrap());
    for ((whole, a), b) in wave.positions().iter().zip(drift.positions()).zip(left.positions()) {
        assert!((whole - a - b).norm() < 1e-15);
    }
    // Two positions between gaps have no parabola: they are their own drift, as one alone is.
    let pairs: Vec<f64> = (0..40).map(|k| f64::from(k / 2) * 1e6 + f64::from(k % 2) * 0.37).collect();
    let pairs = PlanePath::new(pairs.clone(), pairs.iter().map(|t| circle(*t, 1.1, 1.0)).collect()).unwrap();
    assert!(pairs.without_drift(100.0).unwrap().positions().iter().all(|p| p.norm() == 0.0));
    let lone = PlanePath::new(vec![0.0, 1e6, 2e6, 3e6], vec![Vector2::new(1.0, 2.0); 4]).unwrap();
    assert!(lone.without_drift(100.0).unwrap().positions().iter().all(|p| p.norm() == 0.0));
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(lone.without_drift(period), Err(OrbitError::Parameter(_))), "{period}");
    }
    assert_eq!(
        lone.between(0.0, 2e6).without_drift(100.0).unwrap_err(),
        OrbitError::TooFew { positions: 3, needed: 4 }
    );
}

#[test]
fn windows_tell_what_changes() {
    // 24 min for 10 h, then 88 min; no frames between 20 and 24 h.
    let swing = |t: f64| if t < 10.0 * HOUR { circle(t, 24.0 * MINUTE, 1e-3) } else { circle(t, 88.0 * MINUTE, 2e-3) };
    let all = path(3601, 30.0, swing);
    let kept: Vec<usize> = (0..3601).filter(|k| !(20.0 * HOUR..24.0 * HOUR).contains(&all.times()[*k])).collect();
    let times: Vec<f64> = kept.iter().map(|k| all.times()[*k]).collect();
    let tip = PlanePath::new(times, kept.iter().map(|k| all.positions()[*k]).collect()).unwrap();
    let windows: Vec<_> = tip.windows(4.0 * HOUR, HOUR).unwrap().collect();
    // The last one ends with the path: from 0 to 26 h.
    assert_eq!(windows.len(), 27);
    assert!(windows.iter().enumerate().all(|(k, (t, _))| (t - (2.0 + k as f64) * HOUR).abs() < 1e-6));
    let share = |k: usize| windows[k].1.clone().unwrap().share(24.0 * MINUTE, &Search::default()).unwrap();
    assert!(share(0) > 0.999 && share(6) > 0.999 && share(11) < 1e-3, "{} {} {}", share(0), share(6), share(11));
    // The one from 20 to 24 h has one position, at its end.
    let alone = windows[20].1.clone().unwrap();
    assert_eq!(alone.times(), [24.0 * HOUR]);
    let error = alone.share(24.0 * MINUTE, &Search::default()).unwrap_err();
    assert!(matches!(error, OrbitError::TooFew { positions: 1, .. }), "{error}");
    assert_eq!(tip.windows(HOUR, 0.5 * HOUR).unwrap().filter(|(_, window)| window.is_err()).count(), 6);
    let (_, empty) = tip.windows(HOUR, 0.5 * HOUR).unwrap().find(|(_, window)| window.is_err()).unwrap();
    // Frames every 30 s: the last one before the gap is at 20 h less 30 s.
    assert_eq!(empty.unwrap_err().to_string(), "there is no position from 72000 s to 75600 s");
    assert_eq!(
        tip.windows(31.0 * HOUR, HOUR).err().unwrap(),
        OrbitError::TooShort { duration: 30.0 * HOUR, needed: 31.0 * HOUR }
    );
    for (length, every) in [(0.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (-1.0, 1.0)] {
        assert!(matches!(tip.windows(length, every), Err(OrbitError::Parameter(_))), "{length} {every}");
    }
    let none = PlanePath::new(vec![], vec![]).unwrap();
    assert!(none.windows(1.0, 1.0).is_err());
}

#[test]
fn what_does_not_move_has_no_period() {
    let still = [
        path(500, 120.0, |_| Vector2::new(0.3, -0.2)),
        path(500, 120.0, |_| Vector2::zeros()),
        path(500, 120.0, |t| Vector2::new(0.3 + 1e-7 * t, -0.2 + 1e-12 * t * t)),
    ];
    for path in still {
        let found = path.tracked(&BAND).unwrap();
        assert!(!found.nutates && found.period.is_none() && found.amplitude.is_none() && found.sense.is_none());
        assert!(found.ridge.is_empty() && found.turns == 0.0 && found.band_power == 0.0, "{found:?}");
    }
    // A swing beyond the band is none in it, on either side.
    for period in [12.0 * MINUTE, 7.0 * HOUR] {
        let found = path(1440, 60.0, |t| circle(t, period, 1e-3)).tracked(&BAND).unwrap();
        assert!(!found.nutates, "{period}: {:?}", found.period);
    }
}

#[test]
fn what_cannot_be_tracked() {
    let short = path(100, 120.0, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(short.tracked(&BAND).unwrap_err(), OrbitError::TooShort { duration: 99.0 * 120.0, needed: 12.0 * HOUR });
    let message = short.tracked(&BAND).unwrap_err().to_string();
    assert_eq!(message, "a path of 11880 s is too short: 43200 s are needed");
    let few = path(5, 4.0 * HOUR, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(few.tracked(&BAND).unwrap_err(), OrbitError::TooFew { positions: 5, needed: 8 });
    let coarse = path(200, 20.0 * MINUTE, |t| circle(t, PERIOD, 1e-3));
    assert_eq!(coarse.tracked(&BAND).unwrap_err(), OrbitError::TooCoarse { interval: 1200.0, period: 1800.0 });
    let fine = path(720, 120.0, |t| circle(t, PERIOD, 1e-3));
    for (shortest, longest) in
        [(0.0, 1e4), (-1.0, 1e4), (f64::NAN, 1e4), (1e3, 1e3), (1e4, 1e3), (1e3, f64::NAN), (1e3, f64::INFINITY)]
    {
        let error = fine.tracked(&Band { shortest, longest }).unwrap_err();
        assert!(error.to_string().contains("period of the band"), "{error}");
    }
    assert!(matches!(fine.between(0.0, 60.0).direction(), Err(OrbitError::TooFew { positions: 1, needed: 2 })));
}

/// Any path gives numbers or an error: huge and tiny ones, bursts, single positions, few values.
#[test]
fn no_path_makes_what_is_no_number() {
    for seed in 0..number("MORPHOROD_CASES", 200) {
        let mut draw = Draw::new(seed + 1);
        let size = draw.log(1e-300, 1e300);
        let steps = draw.log(1e-6, 1e6);
        let levels = draw.log(1.0, 1e6).floor();
        let mut t = draw.uniform(-1e6, 1e6);
        let (mut times, mut positions) = (Vec::new(), Vec::new());
        for _ in 0..draw.log(1.0, 400.0) as usize {
            t += if draw.chance(0.05) { draw.log(1.0, 1e3) * steps } else { draw.uniform(0.2, 1.0) * steps };
            times.push(t);
            let swing = Vector2::new((t / steps).sin(), (t / steps / 7.0).cos());
            let position = if draw.chance(0.3) { draw.vector(1.0).xy() } else { swing };
            positions.push((position * levels).map(f64::round) / levels * size);
        }
        times.dedup();
        positions.truncate(times.len());
        let Ok(path) = PlanePath::new(times, positions) else { continue };
        let shortest = draw.log(0.1, 1e2) * steps;
        let Ok(found) = path.tracked(&Band { shortest, longest: shortest * draw.log(1.01, 100.0) }) else { continue };
        let numbers = [found.amplitude, found.noise_floor, found.sampling, Some(found.turns), Some(found.band_power)];
        assert!(numbers.iter().flatten().all(|x| x.is_finite()), "{seed}: {numbers:?}");
        assert!((0.0..=1.0).contains(&found.band_power), "{seed}: {}", found.band_power);
        assert!(found.scalogram.power.iter().flatten().chain(&found.direction).all(|x| x.is_finite()), "{seed}");
        assert!(found.ridge.iter().all(|p| p.period.is_finite() && p.ellipse.major.is_finite()), "{seed}");
    }
}
