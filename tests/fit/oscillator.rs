//! Tests of the score test for an internal oscillator.

use std::f64::consts::TAU;

use super::plants::{NOISE, TRUTH, family, measured_of, oscillating};
use crate::fixtures::random::number;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::fit::{Estimates, Fit, Loss, Scan, Series, Verdict, Warning};
use morphorod::tropism::{Handedness, Oscillator};
use nalgebra::Vector3;

/// Fit without an oscillator to the tip of a shoot that has an oscillator of the given sensitivity.
fn null(sensitivity: f64, handedness: Handedness, seed: u64) -> (Fit, Estimates) {
    let oscillator = Oscillator {
        sensitivity,
        period: 1500.0,
        phase: 1.0,
        handedness,
    };
    let (times, frames) = measured_of(oscillating(&TRUTH, oscillator).unwrap(), 1, NOISE, seed);
    let tips: Vec<_> = frames.iter().map(|frame| frame[0]).collect();
    let data = [Series::tips(times, &tips)];
    let fit = Fit {
        step: 300.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    };
    let null = fit
        .run(&family(&["beta", "eta", "tau_r"], 1.0), &data)
        .unwrap();
    (fit, null)
}

/// Scan for periods from 21 to 60 min.
fn scan(sensitivity: f64, handedness: Handedness, seed: u64) -> Scan {
    let (fit, null) = null(sensitivity, handedness, seed);
    fit.scan_oscillator(oscillating, &null, [1260.0, 3600.0])
        .unwrap()
}

#[test]
fn period_phase_and_handedness_of_a_weak_oscillator_are_found() {
    for handedness in [Handedness::Counterclockwise, Handedness::Clockwise] {
        let found = scan(0.05, handedness, 1);
        assert!(found.false_alarm < 1e-6, "{}", found.false_alarm);
        let best = found.best.oscillator;
        assert_eq!(best.handedness, handedness);
        // Near this period T the periods of the scan differ by T²/(2 · 6 h) = 52 s.
        assert_abs_diff_eq!(best.period, 1500.0, epsilon = 60.0);
        // The sensitivity is lower by up to a tenth between two periods of the scan.
        assert_relative_eq!(best.sensitivity, 0.05, epsilon = 0.0, max_relative = 0.3);
        // Oscillators of neighbouring periods are compared by their phases in the middle of the
        // track.
        let middle = |oscillator: Oscillator| TAU * 10_800.0 / oscillator.period + oscillator.phase;
        let truth = Oscillator {
            sensitivity: 0.05,
            period: 1500.0,
            phase: 1.0,
            handedness,
        };
        assert_abs_diff_eq!(
            (0.5 * (middle(best) - middle(truth))).sin(),
            0.0,
            epsilon = 0.2
        );
    }
}

#[test]
fn shoots_without_an_oscillator_give_no_more_alarms_than_stated() {
    let draws = number("MORPHOROD_CASES", 4);
    let mut alarms = 0.0;
    for seed in 1..=draws {
        let found = scan(0.0, Handedness::Counterclockwise, seed);
        alarms += f64::from(u8::from(found.false_alarm < 0.05));
        // A score has the distribution of χ² with two degrees of freedom, whose mean is 2. The
        // lines of a scan are correlated: their mean differs by more than the tolerance in one of
        // 2000 sets of four draws.
        let mean =
            found.lines.iter().map(|line| line.score).sum::<f64>() / found.lines.len() as f64;
        assert_abs_diff_eq!(mean, 2.0, epsilon = 1.5);
    }
    // The bound is the stated share and three standard errors of the share of the draws. It permits
    // one of four draws.
    let stated = 0.05 * draws as f64;
    assert!(
        alarms <= stated + 3.0 * stated.sqrt(),
        "{alarms} of {draws}"
    );
}

/// A strong oscillator with four periods in the record is no slow noise, and the range of periods
/// is that of the data.
#[test]
fn a_strong_slow_oscillator_is_found_among_the_periods_that_the_data_resolve() {
    let truth = Oscillator {
        sensitivity: 0.05,
        period: 5400.0,
        phase: 1.0,
        handedness: Handedness::Clockwise,
    };
    let (times, frames) = measured_of(oscillating(&TRUTH, truth).unwrap(), 1, NOISE, 1);
    let tips: Vec<_> = frames.iter().map(|frame| frame[0]).collect();
    let fit = Fit {
        step: 300.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    };
    let null = fit
        .run(
            &family(&["beta", "eta", "tau_r"], 1.0),
            &[Series::tips(times, &tips)],
        )
        .unwrap();
    let periods = null.resolved_periods();
    // Two frames of 10 min, and half of the time from the first to the last of 36 frames.
    assert_eq!(periods, [1200.0, 10_500.0]);
    let found = fit.scan_oscillator(oscillating, &null, periods).unwrap();
    assert!(
        found.false_alarm < 1e-6 && found.periods == periods,
        "{found}"
    );
    assert_eq!(
        found.best.oscillator.handedness,
        Handedness::Clockwise,
        "{found}"
    );
    // Near this period T the periods of the scan differ by T²/(2 · 6 h) = 675 s.
    assert_abs_diff_eq!(found.best.oscillator.period, 5400.0, epsilon = 700.0);
    // The fit without an oscillator does not explain the data.
    assert!(!found.warnings.is_empty(), "{found}");
}

/// The model of the fit without an oscillator is wrong. Its parameters are uncertain, but each has
/// an effect.
#[test]
fn a_strong_oscillator_makes_no_other_parameter_structurally_unidentifiable() {
    let (_, null) = null(0.5, Handedness::Clockwise, 1);
    // The estimated noise includes the oscillation.
    assert!(null.noise[0] > 3.0 * NOISE, "{}", null.noise[0]);
    assert!(
        null.parameters
            .iter()
            .all(|estimate| estimate.verdict != Verdict::StructurallyNot),
        "{null}"
    );
}

/// Every twelfth frame is an outlier of 5 mm.
#[test]
fn outliers_neither_create_an_oscillator_nor_hide_it_from_the_robust_loss() {
    let scan = |sensitivity: f64, loss: Loss| {
        let truth = Oscillator {
            sensitivity,
            period: 1500.0,
            phase: 1.0,
            handedness: Handedness::Clockwise,
        };
        let (times, frames) = measured_of(oscillating(&TRUTH, truth).unwrap(), 1, NOISE, 2);
        let mut tips: Vec<_> = frames.iter().map(|frame| frame[0]).collect();
        for (k, outlier) in [(5, 3e-3), (17, -3e-3), (29, 3e-3)] {
            tips[k] += Vector3::new(outlier, outlier, -outlier);
        }
        let fit = Fit {
            step: 300.0,
            starts: 1,
            loss,
            windows: vec![1.0],
            ..Fit::default()
        };
        let null = fit
            .run(
                &family(&["beta", "eta", "tau_r"], 1.0),
                &[Series::tips(times, &tips)],
            )
            .unwrap();
        fit.scan_oscillator(oscillating, &null, [1260.0, 3600.0])
            .unwrap()
    };
    let found = scan(0.05, Loss::ROBUST);
    assert!(found.false_alarm < 1e-3, "{found}");
    // Near this period T the periods of the scan differ by T²/(2 · 6 h) = 52 s.
    assert_abs_diff_eq!(found.best.oscillator.period, 1500.0, epsilon = 60.0);
    for loss in [Loss::Squares, Loss::ROBUST] {
        let none = scan(0.0, loss);
        assert!(none.false_alarm > 0.01, "{none}");
        let is_named = none
            .warnings
            .iter()
            .any(|one| matches!(one, Warning::Outliers { .. }));
        assert!(is_named == (loss == Loss::Squares), "{none}");
    }
}

/// In frames every 10 min, periods of 1500 s and of 1000 s in the opposite sense cannot be
/// distinguished.
#[test]
fn periods_shorter_than_two_frames_are_refused() {
    let (times, frames) = measured_of(
        oscillating(&TRUTH, Oscillator::new(0.0, 1500.0)).unwrap(),
        1,
        NOISE,
        1,
    );
    let data = [Series::tips(
        times,
        &frames.iter().map(|frame| frame[0]).collect::<Vec<_>>(),
    )];
    let fit = Fit {
        step: 300.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    };
    let null = fit.run(&family(&["beta"], 1.0), &data).unwrap();
    let error = fit
        .scan_oscillator(oscillating, &null, [1000.0, 3600.0])
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("shortest period of a scan is 1000"),
        "{error}"
    );
}
