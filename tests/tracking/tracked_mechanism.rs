//! Decision between an internal oscillator and delayed gravitropism, for simulated shoots whose
//! mechanism is known.

// The modules belong to the example `tracked_tip`; the tests use a part of them.
#[allow(dead_code)]
#[path = "../../examples/tracked_tip/criteria.rs"]
mod criteria;
#[allow(dead_code)]
#[path = "../../examples/tracked_tip/evidence.rs"]
mod evidence;
#[allow(dead_code)]
#[path = "../../examples/tracked_tip/mechanism.rs"]
mod mechanism;

use approx::assert_relative_eq;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Pulse;
use morphorod::tracking::Track;
use morphorod::tropism::Oscillator;
use morphorod::{Model, Shoot};
use nalgebra::Vector3;

use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{HOUR, MINUTE, STATOLITHS, WEIGHT, growing, reduced, steering};
use criteria::{period_at_onset, uncertain};
use evidence::{Length, observation, observe, windows};
use mechanism::{Context, Judgement, Level, Observation, Verdict, Wave, judge};

const WINDOW: f64 = 6.0 * HOUR;
/// Standard deviation of the noise of a coordinate, m.
const NOISE: f64 = 5e-5;
/// Delay and memory time of the simulated shoots, s.
const DELAYS: [f64; 2] = [12.0 * MINUTE, 12.0 * MINUTE];

/// Track of a simulated tip with noise, and the lengths of the shoot.
fn track(mut shoot: Shoot<impl Model>, hours: f64) -> (Track, Vec<Length>) {
    let (mut run, mut draw) = (MethodOfSteps::new(180.0), Draw::new(5));
    let (mut times, mut tips, mut lengths) = (vec![], vec![], vec![]);
    for k in 0..=(hours * 10.0) as u32 {
        let t = 0.1 * HOUR * f64::from(k);
        run.advance(&mut shoot, t).unwrap();
        times.push(t);
        tips.push(shoot.tip().xy() + NOISE * draw.normal());
        lengths.push([t, shoot.rod().length()]);
    }
    (Track::new(times, tips).unwrap(), lengths)
}

fn observations(track: &Track, lengths: &[Length]) -> Vec<Observation> {
    observe(&windows(track, &[], WINDOW, HOUR).unwrap(), lengths)
}

/// Judgements with known lengths, with unknown lengths, and with unknown lengths but known delays.
fn judgements((track, lengths): &(Track, Vec<Length>)) -> [Judgement; 3] {
    let context = |delays| Context {
        window: WINDOW,
        delays,
        ..Context::default()
    };
    let [known, unknown] = [observations(track, lengths), observations(track, &[])];
    [
        judge(&known, &context(None)),
        judge(&unknown, &context(None)),
        judge(&unknown, &context(Some(DELAYS))),
    ]
}

fn verdicts(judgements: &[Judgement; 3]) -> [Verdict; 3] {
    judgements.each_ref().map(|judgement| judgement.verdict)
}

fn has_reason(judgement: &Judgement, words: &str) -> bool {
    judgement
        .reasons
        .iter()
        .any(|reason| reason.contains(words))
}

/// The growing shoot for 30 h with an oscillator of the given sensitivity.
fn growing_track(alpha: f64) -> (Track, Vec<Length>) {
    let (gravitropism, proprioception) = steering(STATOLITHS);
    let tropism = (
        Oscillator::new(alpha, 24.0 * MINUTE),
        gravitropism,
        proprioception,
    );
    track(
        growing()
            .elements(4)
            .tropism(tropism)
            .into_dyn()
            .build()
            .unwrap(),
        30.0,
    )
}

#[test]
fn growing_shoot_with_an_oscillator_has_both_mechanisms() {
    for alpha in [0.2, 0.01] {
        let found = judgements(&growing_track(alpha));
        assert_eq!(verdicts(&found), [Verdict::Both; 3], "{alpha}: {found:#?}");
    }
}

#[test]
fn growing_shoot_without_an_oscillator_has_delayed_gravitropism() {
    let found = judgements(&growing_track(0.0));
    assert_eq!(
        verdicts(&found),
        [Verdict::Delayed, Verdict::Undecided, Verdict::Delayed],
        "{found:#?}"
    );
    assert!(
        has_reason(&found[1], "length is unknown"),
        "{:?}",
        found[1].reasons
    );
}

/// The critical length is 6.56 cm.
#[test]
fn shoot_of_constant_length_oscillates_only_above_the_critical_length() {
    let kicked = |length: f64, peak: f64| {
        let kick = Pulse {
            peak: Vector3::new(2.0, 1.0, 0.0) * peak,
            start: 0.0,
            duration: 12.0 * MINUTE,
        };
        let shoot = reduced(length, 20.0 * HOUR)
            .elements(4)
            .load((WEIGHT, kick))
            .into_dyn()
            .build()
            .unwrap();
        judgements(&track(shoot, 30.0))
    };
    let below = kicked(0.064, 1e-5);
    assert_eq!(verdicts(&below), [Verdict::Undecided; 3], "{below:#?}");
    assert!(
        below.iter().all(|found| has_reason(found, "decays")),
        "{below:#?}"
    );
    let above = kicked(0.067, 1e-7);
    assert_eq!(
        verdicts(&above),
        [Verdict::Delayed, Verdict::Undecided, Verdict::Delayed],
        "{above:#?}"
    );
}

/// The shoot grows from 3 cm to 5.5 cm, far below the critical length.
#[test]
fn short_growing_shoot_follows_its_oscillator() {
    let (gravitropism, proprioception) = steering(STATOLITHS);
    let tropism = (
        Oscillator::new(0.2, 24.0 * MINUTE),
        gravitropism,
        proprioception,
    );
    let growth = UniformGrowth {
        zone_length: 0.07,
        time: 40.0 * HOUR,
    };
    let shoot = growing()
        .length(0.03)
        .growth(growth)
        .elements(4)
        .tropism(tropism)
        .into_dyn()
        .build()
        .unwrap();
    let path = track(shoot, 24.0);
    let found = judgements(&path);
    assert_eq!(
        verdicts(&found),
        [Verdict::Oscillator, Verdict::Undecided, Verdict::Oscillator],
        "{found:#?}"
    );
    // The first seven hours have no two windows without overlap. The mean length changes by less
    // than 3 % between the first and the last window.
    let early = (path.0.between(0.0, 7.0 * HOUR), path.1);
    let found = &judgements(&early)[0];
    assert_eq!(found.verdict, Verdict::Undecided, "{found:#?}");
    assert!(
        has_reason(found, "too short") && has_reason(found, "length changes"),
        "{:?}",
        found.reasons
    );
}

#[test]
fn tracks_at_other_levels_of_gravity_decide() {
    let wave = |amplitude: f64| Wave {
        period: [5400.0, 10.0],
        amplitude: [amplitude, 1e-5],
        harmonic: false,
    };
    let observed = |time: f64, amplitude: Option<f64>| Observation {
        time,
        length: None,
        limit: 1e-4,
        waves: amplitude.map(wave).into_iter().collect(),
    };
    let track: Vec<Observation> = (0..20)
        .map(|k| observed(HOUR * f64::from(k), Some(1e-2)))
        .collect();
    let at = |gravity: f64, amplitude: Option<f64>| {
        let levels = vec![Level {
            gravity,
            observation: observed(0.0, amplitude),
        }];
        judge(
            &track,
            &Context {
                window: WINDOW,
                delays: None,
                gravity: Some(1.0),
                levels,
            },
        )
        .verdict
    };
    assert_eq!(at(0.0, Some(5e-3)), Verdict::Oscillator);
    assert_eq!(at(0.0, None), Verdict::Delayed);
    assert_eq!(at(0.8, Some(1e-2)), Verdict::Undecided);
}

/// On the main branch of the stability map, the period at onset is 87.6383587116 min. Without
/// memory, the product of ω and the delay is π/2.
#[test]
fn period_at_onset_is_that_of_the_linear_theory() {
    assert_relative_eq!(
        period_at_onset(DELAYS),
        87.6383587116423 * MINUTE,
        epsilon = 0.0,
        max_relative = 1e-12
    );
    assert_relative_eq!(
        period_at_onset([600.0, 0.0]),
        2400.0,
        epsilon = 0.0,
        max_relative = 1e-12
    );
}

#[test]
fn windows_are_not_shortened_by_lost_frames_and_outliers() {
    let times: Vec<f64> = (0..600)
        .filter(|k| k % 15 != 0 && !(200..260).contains(k))
        .map(|k| 120.0 * f64::from(k))
        .collect();
    let positions = times
        .iter()
        .map(|t| nalgebra::Vector2::new((t / 900.0).sin(), (t / 900.0).cos()))
        .collect();
    let track = Track::new(times, positions).unwrap();
    let found = windows(&track, &[0, 14, 15, 300], WINDOW, HOUR).unwrap();
    assert!(found.iter().all(|(_, window)| window.duration() >= WINDOW));
    let found = observation(
        0.0,
        None,
        &track.oscillations(&Default::default()).unwrap(),
        track.times().len(),
    );
    assert_relative_eq!(
        found.waves[0].amplitude[0],
        1.0,
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

#[test]
fn numbers_have_the_digits_of_their_errors() {
    assert_eq!(uncertain(93.18912, 0.0803), "93.189 ± 0.080");
    assert_eq!(uncertain(1234.5, 37.0), "1234 ± 37");
    assert_eq!(uncertain(-1e-5, 0.002), "0.0000 ± 0.0020");
    assert_eq!(uncertain(0.25, 1e-9), "0.2500 (error < 0.0001)");
}
