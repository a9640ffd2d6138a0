//! Verdicts on oscillators, and minima from random starts, in tables. `MORPHOROD_LONG=1` and
//! `--nocapture` compute and print them; by default the tests have one shoot of each kind and half
//! the duration.

use std::collections::BTreeMap;
use std::f64::consts::PI;

// The family of growing shoots belongs to the example.
#[allow(dead_code)]
#[path = "../../examples/fit/plants.rs"]
mod plants;

use super::plants::NOISE;
use crate::fixtures::random::{Draw, long};
use crate::fixtures::shoots::HOUR;
use morphorod::fit::{Estimates, Family, Fit, Scan, Series, View, Warning};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tracking::Track;
use morphorod::tropism::Handedness;
use nalgebra::Vector2;
use plants::{OSCILLATOR, PARAMETERS, Plant, index};

/// Interval of the frames, s.
const INTERVAL: f64 = 300.0;

/// Duration, s.
fn duration() -> f64 {
    HOUR * if long() { 10.0 } else { 5.0 }
}

const FREE: [&str; 5] = ["beta", "eta", "tau_m", "tau_r", "l_0"];

/// Defect of the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    None,
    Repeated,
    Jitter,
    Autoregressive,
    Outliers,
}

fn shoot(handedness: Handedness) -> Plant {
    Plant {
        constant: false,
        mature_modulus: None,
        proprioceptive: None,
        handedness,
    }
}

/// Values of all parameters of the example, with changes by their names.
fn values(changes: &[(&str, f64)]) -> Vec<f64> {
    let mut values: Vec<f64> = PARAMETERS.iter().map(|(_, value, _)| *value).collect();
    for (name, value) in changes {
        values[index(name).unwrap()] = *value;
    }
    values
}

/// Times of the frames, s.
fn frames() -> Vec<f64> {
    (1..=(duration() / INTERVAL) as u32)
        .map(|k| INTERVAL * f64::from(k))
        .collect()
}

/// Tip from above at increasing times (s), without noise.
fn path(plant: Plant, values: &[f64], times: &[f64]) -> Vec<Vector2<f64>> {
    let mut shoot = plant.build(values, plant.oscillator(values)).unwrap();
    let mut integrator = MethodOfSteps::new(100.0);
    let tip = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        Vector2::new(shoot.tip().x, shoot.tip().y)
    };
    times.iter().map(tip).collect()
}

/// Noisy track of a shoot, with a defect.
fn track(plant: Plant, values: &[f64], kind: Kind, draw: &mut Draw) -> Series {
    let times = frames();
    let jitter = if kind == Kind::Jitter {
        0.1 * INTERVAL
    } else {
        0.0
    };
    let shaken: Vec<f64> = times
        .iter()
        .map(|time| time + jitter * draw.normal().x)
        .collect();
    let mut points = path(plant, values, &shaken);
    let mut slow = NOISE * draw.normal();
    for point in &mut points {
        let white = NOISE * draw.normal();
        slow = if kind == Kind::Autoregressive {
            slow * 0.8 + white * 0.6
        } else {
            white
        };
        *point += slow;
        if kind == Kind::Outliers && draw.chance(0.05) {
            *point += 30.0 * NOISE * draw.normal();
        }
    }
    if kind == Kind::Repeated {
        (2..points.len())
            .step_by(3)
            .for_each(|k| points[k] = points[k - 1]);
    }
    Series::track(&Track::new(times, points).unwrap(), View::above())
}

/// A random shoot with an oscillator whose effect has the given ratio to the noise, or without one
/// for zero: the scan at the fit without an oscillator, from the values of the example.
fn scanned(seed: u64, ratio: f64, kind: Kind) -> (f64, Estimates, Scan) {
    let mut draw = Draw::new(seed);
    let hand = if draw.chance(0.5) {
        Handedness::Clockwise
    } else {
        Handedness::Counterclockwise
    };
    let (plant, period) = (shoot(hand), draw.log(900.0, 7200.0));
    let tilt = if draw.chance(0.5) {
        draw.uniform(0.1, 0.5)
    } else {
        0.0
    };
    // An upright shoot without an oscillator and without a push does not move.
    let push = if tilt == 0.0 && (ratio == 0.0 || draw.chance(0.5)) {
        1e-5
    } else {
        0.0
    };
    let mut truth = values(&[
        ("tilt", tilt),
        ("push_x", 2.0 * push),
        ("push_y", push),
        ("l_0", 0.05),
        ("E", 1.2e7),
    ]);
    let given = truth.clone();
    truth[..4]
        .iter_mut()
        .for_each(|value| *value *= draw.log(0.67, 1.5));
    truth[OSCILLATOR].copy_from_slice(&[0.0, period, draw.uniform(-PI, PI)]);
    if ratio > 0.0 {
        let silent = path(plant, &truth, &frames());
        truth[OSCILLATOR.start] = 1e-4;
        let squares = path(plant, &truth, &frames())
            .into_iter()
            .zip(&silent)
            .map(|(a, b)| (a - b).norm_squared());
        let size = (squares.sum::<f64>() / silent.len() as f64).sqrt();
        truth[OSCILLATOR.start] = (1e-4 * ratio * NOISE / size).min(0.5);
    }
    let data = [track(plant, &truth, kind, &mut draw)];
    let fit = Fit {
        step: 150.0,
        ..Fit::default()
    };
    let null = fit
        .run(&plant.family(&given, &FREE, 1.0, vec![]), &data)
        .unwrap();
    let scan = fit
        .scan_oscillator(|p, o| plant.build(p, o), &null, null.resolved_periods())
        .unwrap();
    (period, null, scan)
}

/// Whether a warning names the defect of the data.
fn is_named(kind: Kind, warnings: &[Warning]) -> bool {
    let names = |one: &Warning| match kind {
        Kind::None => false,
        Kind::Repeated => matches!(one, Warning::RepeatedFrames { .. }),
        Kind::Jitter => matches!(one, Warning::UncertainTimes { .. }),
        Kind::Autoregressive => matches!(one, Warning::Correlated { .. }),
        Kind::Outliers => matches!(one, Warning::Outliers { .. }),
    };
    warnings.iter().any(names)
}

#[test]
fn oscillators_are_found_and_false_alarms_are_rare_or_named() {
    let count = if long() { 40 } else { 1 };
    for kind in [
        Kind::None,
        Kind::Repeated,
        Kind::Jitter,
        Kind::Autoregressive,
        Kind::Outliers,
    ] {
        if !long() && kind != Kind::Repeated {
            continue;
        }
        let (mut found, mut wrong, mut false_alarms, mut unnamed) =
            (BTreeMap::<u32, [u32; 2]>::new(), 0, 0, 0);
        for seed in 0..count {
            // Amplitudes from 1 to 30 times the noise.
            let ratio = 30_f64.powf((seed as f64 + 0.5) / count as f64);
            let (period, _, scan) = scanned(seed, ratio, kind);
            let best = scan.best.oscillator.period;
            // Periods T of a scan differ by T²/2 over the duration.
            let right =
                scan.false_alarm < 0.01 && (best - period).abs() < period * period / duration();
            wrong += u32::from(!right && ratio > 3.0);
            let bin = found.entry(ratio.log2() as u32).or_default();
            *bin = [bin[0] + u32::from(right), bin[1] + 1];
            let (_, null, scan) = scanned(1000 + seed, 0.0, kind);
            let alarm = scan.false_alarm < 0.01;
            false_alarms += u32::from(alarm);
            unnamed += u32::from(alarm && !is_named(kind, &null.warnings));
        }
        println!(
            "{kind:?}: {wrong} wrong above 3 × noise, {false_alarms} false alarms, {unnamed} without the cause"
        );
        for (bin, [right, all]) in found {
            println!(
                "  amplitude {} to {} × noise: {right} of {all} found",
                1 << bin,
                2 << bin
            );
        }
        // Two of 40 false alarms at a level of 0.01 have a probability of 6 %.
        assert!(
            unnamed <= 2 && (kind != Kind::None || wrong <= 2),
            "{kind:?}: {wrong} {unnamed}"
        );
    }
}

/// Starts within a factor e of the truth, for a circumnutating shoot.
#[test]
fn default_searches_from_random_starts_reach_the_global_minimum() {
    let plant = shoot(Handedness::Counterclockwise);
    let changes = [
        ("beta", 1.1),
        ("eta", 14.0),
        ("tau_m", 900.0),
        ("tau_r", 600.0),
        ("push_x", 2e-5),
        ("push_y", 1e-5),
    ];
    let truth = values(&changes);
    let data = [track(plant, &truth, Kind::None, &mut Draw::new(3))];
    let fit = Fit {
        step: 150.0,
        ..Fit::default()
    };
    let Family { parameters, build } = plant.family(&truth, &FREE, 1.0, vec![]);
    let one = Fit {
        starts: 1,
        windows: vec![1.0],
        ..fit.clone()
    };
    let best = one
        .run(
            &Family {
                parameters: parameters.clone(),
                build: &build,
            },
            &data,
        )
        .unwrap();
    let mut draw = Draw::new(5);
    let (count, mut global, mut silent) = (if long() { 100 } else { 1 }, 0, 0);
    for _ in 0..count {
        let mut parameters = parameters.clone();
        for one in parameters.iter_mut().filter(|one| !one.is_fixed()) {
            one.start =
                (one.start * draw.uniform(-1.0, 1.0).exp()).clamp(one.bounds[0], one.bounds[1]);
        }
        let found = fit
            .run(
                &Family {
                    parameters,
                    build: &build,
                },
                &data,
            )
            .unwrap();
        // A local minimum has a noise that is larger by far more than its accuracy, 1 %.
        let same = found.noise[0] < 1.02 * best.noise[0];
        global += u32::from(same);
        silent += u32::from(!same && found.warnings.is_empty());
    }
    println!(
        "{global} of {count} starts reach the global minimum, {silent} another one without a warning"
    );
    assert!(
        100 * global >= 95 * count && silent == 0,
        "{global} {silent} of {count}"
    );
}
