//! Warnings of fits, searches that do not converge, and dependence on given values.

use super::plants::{NAMES, NOISE, TRUTH, family, measured, righting, tips};
use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{HOUR, rod, tissue};
use approx::assert_abs_diff_eq;
use morphorod::fit::{Estimates, Family, Fit, FitError, Loss, Parameter, Series, Warning};
use morphorod::integrator::{Integrator, MethodOfSteps};
use nalgebra::Vector3;

fn fit() -> Fit {
    Fit {
        step: 200.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    }
}

/// Warnings of a fit of β and τr to tips.
fn warnings(times: &[f64], positions: &[Vector3<f64>]) -> Vec<Warning> {
    fit()
        .run(
            &family(&["beta", "tau_r"], 1.0),
            &[Series::tips(times.to_vec(), positions)],
        )
        .unwrap()
        .warnings
}

#[test]
fn a_fit_of_the_true_model_to_white_noise_has_no_warnings() {
    for seed in 1..=5 {
        let (times, positions) = tips(NOISE, seed);
        let found = warnings(&times, &positions);
        assert!(found.is_empty(), "{found:?}");
    }
}

/// The delay is fixed at twice its true value.
#[test]
fn a_wrong_model_is_reported_from_the_scatter_of_the_data() {
    let (times, positions) = tips(NOISE, 1);
    let mut wrong = family(&["beta"], 1.0);
    let k = NAMES.iter().position(|name| *name == "tau_r").unwrap();
    (wrong.parameters[k].start, wrong.parameters[k].bounds) = (2.0 * TRUTH[k], [2.0 * TRUTH[k]; 2]);
    let found = fit()
        .run(&wrong, &[Series::tips(times, &positions)])
        .unwrap();
    let unexplained = |one: &Warning| matches!(one, Warning::Unexplained { series: 0, .. });
    assert!(found.warnings.iter().any(unexplained), "{found}");
    assert!(
        found.to_string().contains("do not rely on these estimates"),
        "{found}"
    );
}

#[test]
fn outliers_are_named_as_the_cause_of_large_residuals() {
    let (times, mut positions) = tips(NOISE, 2);
    positions[3] += Vector3::new(5e-3, 0.0, -5e-3);
    positions[20] -= Vector3::new(5e-3, 0.0, 5e-3);
    let found = warnings(&times, &positions);
    assert!(
        found.contains(&Warning::Outliers {
            series: 0,
            count: 4
        }),
        "{found:?}"
    );
    let robust = Fit {
        loss: Loss::ROBUST,
        ..fit()
    };
    let found = robust
        .run(
            &family(&["beta", "tau_r"], 1.0),
            &[Series::tips(times, &positions)],
        )
        .unwrap()
        .warnings;
    assert!(found.is_empty(), "{found:?}");
}

/// The frames are taken at times that differ from the stated ones by 3 min.
#[test]
fn uncertain_times_are_named_as_the_cause_of_residuals_along_the_motion() {
    let (mut shoot, mut draw) = (righting(&TRUTH).unwrap(), Draw::new(3));
    let mut integrator = MethodOfSteps::new(120.0);
    let times: Vec<f64> = (1..=72).map(|k| HOUR / 12.0 * f64::from(k)).collect();
    let mut tip = |time: &f64| {
        let jitter = 60.0 * if draw.chance(0.5) { 1.0 } else { -1.0 };
        integrator.advance(&mut shoot, time + jitter).unwrap();
        shoot.tip() + Vector3::from_fn(|_, _| 0.2 * NOISE * draw.normal().x)
    };
    let positions: Vec<_> = times.iter().map(&mut tip).collect();
    let found = warnings(&times, &positions);
    let deviation = found.iter().find_map(|one| match one {
        Warning::UncertainTimes { deviation, .. } => Some(*deviation),
        _ => None,
    });
    // The standard error of a deviation from the frames in motion, about twenty, is 20 %.
    assert_abs_diff_eq!(deviation.expect("a warning"), 60.0, epsilon = 40.0);
}

/// The noise of 10 mm is about as large as the motion.
#[test]
fn data_with_little_motion_are_reported() {
    let (times, positions) = tips(0.01, 4);
    let found = warnings(&times, &positions);
    assert!(
        found
            .iter()
            .any(|one| matches!(one, Warning::NoMotion { series: 0, .. })),
        "{found:?}"
    );
}

/// Whether a warning names the unit of the times as a cause.
fn names_times(found: &Estimates) -> bool {
    found
        .warnings
        .iter()
        .any(|warning| warning.to_string().contains("unit of the times"))
}

/// The tip stays far from all positions of the simulated tip.
#[test]
fn a_shoot_that_is_farther_from_the_data_than_a_constant_is_reported() {
    let mut draw = Draw::new(4);
    let times: Vec<f64> = (1..=30).map(|k| 600.0 * f64::from(k)).collect();
    let base = Vector3::new(0.04, 0.0, 0.01);
    let positions: Vec<_> = times
        .iter()
        .map(|_| base + Vector3::from_fn(|_, _| NOISE * draw.normal().x))
        .collect();
    let found = fit()
        .run(
            &family(&["beta", "tau_r"], 1.0),
            &[Series::tips(times, &positions)],
        )
        .unwrap();
    // The noise over a distance of millimetres.
    let is_far = |one: &Warning| matches!(one, Warning::NoMotion { ratio, .. } if *ratio < 0.1);
    assert!(
        found.warnings.iter().any(is_far) && names_times(&found),
        "{found}"
    );
}

/// The bounds permit growth and memory times that are wrong by a factor of five.
#[test]
fn frame_intervals_that_are_wrong_by_a_factor_of_ten_are_named_as_a_cause() {
    let (times, positions) = tips(NOISE, 3);
    // With steps of 200 s for both factors the verdicts are the same, and the test takes six times
    // as long.
    for (factor, step) in [(10.0, 1000.0), (0.1, 200.0)] {
        let times = times.iter().map(|time| factor * time).collect();
        let fit = Fit { step, ..fit() };
        let found = fit.run(
            &family(&["beta", "eta", "tau_m", "tau_r"], 1.0),
            &[Series::tips(times, &positions)],
        );
        let found = found.unwrap();
        assert!(names_times(&found), "{found}");
    }
}

/// With wider bounds the model of constant length explains the data as well as with the right
/// times. The table of dependences then shows the exponents of the unit of time.
#[test]
fn wrong_frame_intervals_that_the_bounds_permit_are_in_the_table_of_dependences() {
    let (times, positions) = tips(NOISE, 3);
    for factor in [10.0, 0.1] {
        let Family {
            mut parameters,
            build,
        } = family(&["beta", "eta", "tau_m", "tau_r"], 1.0);
        for parameter in parameters.iter_mut().filter(|one| !one.is_fixed()) {
            parameter.bounds = parameter
                .bounds
                .map(|bound| bound * (bound / parameter.start));
        }
        let times = times.iter().map(|time| factor * time).collect();
        let fit = Fit {
            starts: 8,
            windows: vec![0.25, 1.0],
            step: 200.0 * factor,
            ..fit()
        };
        let found = fit
            .run(
                &Family { parameters, build },
                &[Series::tips(times, &positions)],
            )
            .unwrap();
        let all = fit.dependences(righting, &found).unwrap();
        let of_time = &all
            .iter()
            .find(|one| one.given == "unit of time")
            .unwrap()
            .slopes;
        for (name, exponent) in [
            ("beta", -1.0),
            ("eta", -1.0),
            ("tau_m", 1.0),
            ("tau_r", 1.0),
        ] {
            // The standard error of τm is 1 %.
            let truth = TRUTH[NAMES.iter().position(|other| *other == name).unwrap()];
            let wrong = (found.get(name).unwrap().value / truth).ln() / factor.ln();
            assert_abs_diff_eq!(wrong, exponent, epsilon = 0.03);
            let slope = of_time.iter().find(|(other, _)| other == name).unwrap().1;
            assert_abs_diff_eq!(slope, exponent, epsilon = 0.03);
        }
    }
}

/// A plant circles about a point beside the upright shoot of the family, which has no tropism and
/// does not move.
#[test]
fn a_shoot_at_rest_is_reported_without_an_error() {
    let upright = |p: &[f64]| rod(tissue(p[0]), 0.05).build();
    let times: Vec<f64> = (1..=40).map(|k| 300.0 * f64::from(k)).collect();
    let circle = |t: &f64| {
        Vector3::new(
            0.002 + 0.001 * (t / 900.0).cos(),
            0.001 * (t / 900.0).sin(),
            0.05,
        )
    };
    let data = [Series::tips(
        times.clone(),
        &times.iter().map(circle).collect::<Vec<_>>(),
    )];
    let family = Family {
        parameters: vec![Parameter::positive("E", [1e6, 1e8])],
        build: upright,
    };
    let found = Fit {
        step: 300.0,
        ..Fit::default()
    }
    .run(&family, &data)
    .unwrap();
    assert!(
        found
            .warnings
            .iter()
            .any(|one| matches!(one, Warning::NoMotion { series: 0, .. })),
        "{found}"
    );
}

#[test]
fn completed_parts_of_a_fit_increase_up_to_the_last_search() {
    let (times, positions) = tips(NOISE, 6);
    let parts = std::sync::Mutex::new(vec![]);
    let show = |part: f64| parts.lock().unwrap().push(part);
    let fit = Fit {
        starts: 3,
        windows: vec![0.5, 1.0],
        ..fit()
    };
    fit.run_showing(
        &family(&["beta"], 1.2),
        &[Series::tips(times, &positions)],
        show,
    )
    .unwrap();
    // Three searches in a half and two in all data, out of 4.5 with the last one.
    let parts = parts.into_inner().unwrap();
    assert_eq!(parts.len(), 5);
    for (found, expected) in parts.iter().zip([0.5, 1.0, 1.5, 2.5, 3.5]) {
        assert_abs_diff_eq!(*found, expected / 4.5, epsilon = 1e-12);
    }
}

#[test]
fn a_search_that_does_not_converge_returns_its_last_point() {
    let (times, positions) = tips(NOISE, 5);
    let data = [Series::tips(times, &positions).with_noise(NOISE)];
    let names = ["beta", "eta", "tau_r"];
    let converged = fit().run(&family(&names, 1.6), &data).unwrap();
    // There is no earlier search in a part of the data.
    let estimates = Fit {
        iterations: 1,
        windows: vec![],
        ..fit()
    }
    .run(&family(&names, 1.6), &data)
    .unwrap();
    assert_eq!(
        estimates.warnings[0],
        Warning::NotConverged { iterations: 1 }
    );
    assert!(
        estimates.chi_squared > 2.0 * converged.chi_squared,
        "{estimates}"
    );
    let Family {
        mut parameters,
        build,
    } = family(&names, 1.6);
    for (parameter, value) in parameters.iter_mut().zip(estimates.values()) {
        parameter.start = value;
    }
    let again = fit().run(&Family { parameters, build }, &data).unwrap();
    for name in names {
        let [a, b] = [&converged, &again].map(|found| found.get(name).unwrap());
        // The two searches end within 1e-3 standard errors of the minimum.
        assert_abs_diff_eq!(a.value.ln(), b.value.ln(), epsilon = 4e-3 * a.error);
    }
}

/// Slope of an estimate with respect to a given value.
fn slope(found: &Estimates, given: &str, name: &str) -> f64 {
    let all = fit().dependences(righting, found).unwrap();
    let of = &all.iter().find(|one| one.given == given).unwrap().slopes;
    of.iter().find(|(other, _)| other == name).unwrap().1
}

/// In the model of constant length, β and η appear only over τg. Time and length have the exponents
/// of their units, because the weight, which fixes a unit of force per length, balances the free
/// modulus.
#[test]
fn dependence_on_given_values_follows_from_scaling() {
    let (times, positions) = tips(0.0, 0);
    let data = [Series::tips(times, &positions).with_noise(NOISE)];
    let found = fit()
        .run(
            &family(&["beta", "eta", "tau_m", "tau_r", "E", "l_0"], 1.0),
            &data,
        )
        .unwrap();
    for (given, name, exponent) in [
        ("tau_g", "beta", 1.0),
        ("tau_g", "eta", 1.0),
        ("tau_g", "tau_r", 0.0),
        ("unit of time", "tau_m", 1.0),
        ("unit of time", "tau_r", 1.0),
        ("unit of time", "beta", -1.0),
        ("unit of time", "eta", -1.0),
        ("unit of length", "l_0", 1.0),
        ("unit of length", "beta", -1.0),
        ("unit of length", "E", 3.0),
        ("unit of length", "eta", 0.0),
    ] {
        // The error of a path with other steps, 1e-6, is divided by the change of the unit, 1e-3,
        // and by the smallest relative singular value, about 1e-1.
        assert_abs_diff_eq!(slope(&found, given, name), exponent, epsilon = 0.03);
    }
}

#[test]
fn two_plants_in_one_centre_line_are_refused() {
    let (times, mut frames) = measured(8, NOISE, 4);
    let first = frames[5].clone();
    frames[5].extend(first);
    let found = fit()
        .run(
            &family(&["beta"], 1.0),
            &[Series::centre_lines(times, frames)],
        )
        .unwrap_err();
    assert!(
        matches!(
            found,
            FitError::Frame {
                series: 0,
                frame: 5,
                ..
            }
        ),
        "{found}"
    );
    assert!(
        found.to_string().contains("are they of one plant"),
        "{found}"
    );
}

#[test]
fn lengths_in_centimetres_are_recognised() {
    let (times, positions) = tips(NOISE, 9);
    for factor in [10.0, 0.1] {
        let scaled: Vec<_> = positions.iter().map(|p| p * factor).collect();
        let found = fit()
            .run(
                &family(&["beta"], 1.0),
                &[Series::tips(times.clone(), &scaled)],
            )
            .unwrap_err();
        assert!(matches!(found, FitError::Unit { .. }), "{found}");
    }
}
