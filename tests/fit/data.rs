//! Angles of the tip, unknown starts, ambiguous frames, and comparison of families.

use std::f64::consts::FRAC_PI_2;

use super::plants::{NAMES, NOISE, TRUTH, family, measured_of, righting, tips};
use crate::fixtures::random::Draw;
use crate::fixtures::shoots::{HOUR, rod, tissue};
use approx::assert_abs_diff_eq;
use morphorod::fit::{Family, Fit, FitError, Parameter, Series, View, Warning};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Pulse;
use morphorod::{DynLaws, ParameterError, Shoot};
use nalgebra::Vector3;

fn fit() -> Fit {
    Fit {
        step: 200.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    }
}

/// Angles (rad) of the tip of the true shoot, from the horizontal, with noise of 0.01 rad.
fn angles() -> (Vec<f64>, Vec<f64>) {
    let (mut shoot, mut draw) = (righting(&TRUTH).unwrap(), Draw::new(5));
    let mut integrator = MethodOfSteps::new(120.0);
    let times: Vec<f64> = (1..=36).map(|k| HOUR / 6.0 * f64::from(k)).collect();
    let mut angle = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        let tangent = shoot.rod().apex_frame() * Vector3::z();
        tangent.z.atan2(tangent.x) + 0.01 * draw.normal().x
    };
    let angles = times.iter().map(&mut angle).collect();
    (times, angles)
}

#[test]
fn sensitivity_and_delay_are_recovered_from_angles_of_the_tip() {
    let (times, angles) = angles();
    // Angles are compared up to whole turns.
    let turned: Vec<f64> = angles
        .iter()
        .map(|angle| angle - angle.signum() * std::f64::consts::TAU)
        .collect();
    for angles in [&angles, &turned] {
        let series = Series::angles(times.clone(), angles, View::side());
        let found = fit()
            .run(&family(&["beta", "tau_r"], 1.3), &[series])
            .unwrap();
        for (name, truth) in [("beta", 0.8), ("tau_r", 720.0)] {
            let estimate = found.get(name).unwrap();
            // Four standard errors: one draw in 4000 fails.
            assert_abs_diff_eq!(
                (estimate.value / truth).ln() / estimate.error,
                0.0,
                epsilon = 4.0
            );
        }
    }
    let degrees: Vec<f64> = angles.iter().map(|angle| angle.to_degrees()).collect();
    let found = fit()
        .run(
            &family(&["beta"], 1.0),
            &[Series::angles(times, &degrees, View::side())],
        )
        .unwrap_err();
    assert!(
        matches!(found, FitError::Series { series: 0, .. }) && found.to_string().contains("rad"),
        "{found}"
    );
}

#[test]
fn sensitivity_and_delay_are_recovered_from_the_height_of_the_tip() {
    let (times, positions) = tips(NOISE, 11);
    let heights: Vec<f64> = positions.iter().map(|p| p.z).collect();
    let series = Series::coordinates(times, &heights, View::matrix(&[Vector3::z()]).unwrap())
        .with_noise(NOISE);
    let found = fit()
        .run(&family(&["beta", "tau_r"], 1.3), &[series])
        .unwrap();
    for (name, truth) in [("beta", 0.8), ("tau_r", 720.0)] {
        let estimate = found.get(name).unwrap();
        // Four standard errors: one draw in 4000 fails.
        assert_abs_diff_eq!(
            (estimate.value / truth).ln() / estimate.error,
            0.0,
            epsilon = 4.0
        );
        // The height has 36 of the 108 coordinates, and most of the motion.
        assert!(estimate.error < 0.03, "{found}");
    }
}

/// Righting shoot with an initial curvature (1/m), which is the last parameter.
fn bent(p: &[f64]) -> Result<Shoot<DynLaws>, ParameterError> {
    let mut shoot = righting(p)?;
    let curvature = p[NAMES.len()];
    shoot.set_intrinsic(|_| Vector3::new(0.0, curvature, 0.0));
    Ok(shoot)
}

#[test]
fn an_unknown_initial_curvature_is_estimated_as_a_parameter() {
    let truth: Vec<f64> = TRUTH.iter().copied().chain([12.0]).collect();
    let (times, frames) = measured_of(bent(&truth).unwrap(), 1, NOISE, 3);
    let data = [Series::tips(
        times,
        &frames.iter().map(|frame| frame[0]).collect::<Vec<_>>(),
    )
    .with_noise(NOISE)];
    let with = |bend: Parameter| {
        let mut parameters = family(&["beta", "eta"], 1.2).parameters;
        parameters.push(bend);
        fit()
            .run(
                &Family {
                    parameters,
                    build: bent,
                },
                &data,
            )
            .unwrap()
    };
    let found = with(Parameter::linear("bend", [-40.0, 40.0]));
    let [beta, bend] = ["beta", "bend"].map(|name| found.get(name).unwrap());
    // Four standard errors: one draw in 4000 fails.
    assert_abs_diff_eq!((beta.value / 0.8).ln() / beta.error, 0.0, epsilon = 4.0);
    assert_abs_diff_eq!((bend.value - 12.0) / bend.error, 0.0, epsilon = 4.0);
    assert!(found.reduced_chi_squared() < 1.5, "{found}");

    // A straight initial shape is a wrong model.
    let straight = with(Parameter::fixed("bend", 0.0));
    assert!(straight.reduced_chi_squared() > 5.0, "{straight}");
    assert!(found.compare(&straight).unwrap() > 100.0);
    assert_abs_diff_eq!(
        straight.compare(&found).unwrap(),
        -found.compare(&straight).unwrap(),
        epsilon = 1e-9
    );
}

#[test]
fn comparison_prefers_the_smaller_of_two_families_with_equal_residuals() {
    let (times, positions) = tips(NOISE, 4);
    let data = [Series::tips(times, &positions).with_noise(NOISE)];
    let small = fit().run(&family(&["beta"], 1.0), &data).unwrap();
    let large = fit().run(&family(&["beta", "E"], 1.0), &data).unwrap();
    // The larger family decreases χ² by a draw of χ² with one degree of freedom, and costs ln 108 =
    // 4.7.
    assert!(small.compare(&large).unwrap() > 0.0);
    let other = [data[0].clone().with_noise(2.0 * NOISE)];
    let other = fit().run(&family(&["beta"], 1.0), &other).unwrap();
    assert_eq!(small.compare(&other).unwrap_err(), FitError::OtherData);
}

/// Shoot of the given modulus (Pa) with a sideways pulse of the given size (N) from 10 to 30 min.
fn pushed(modulus: f64, peak: f64) -> Result<Shoot<DynLaws>, ParameterError> {
    let pulse = Pulse {
        peak: Vector3::new(0.0, peak, 0.0),
        start: 600.0,
        duration: 1200.0,
    };
    rod(tissue(modulus), 0.05)
        .elements(4)
        .load(pulse)
        .scene(morphorod::Still::tilted(FRAC_PI_2))
        .into_dyn()
        .build()
}

/// Exact positions (m) of the tip at times (s), for a modulus of 10 MPa and a given size of the
/// pulse (N).
fn pushed_tips(peak: f64, times: &[f64]) -> Vec<Vector3<f64>> {
    let mut shoot = pushed(1e7, peak).unwrap();
    let mut integrator = MethodOfSteps::new(100.0);
    let tip = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        shoot.tip()
    };
    times.iter().map(tip).collect()
}

/// Frames every 10 s, between time steps of 200 s. The speed of the tip is discontinuous at both
/// ends of the pulse.
#[test]
fn frames_between_the_steps_are_accurate_near_a_discontinuity() {
    let times: Vec<f64> = (0..=240).map(|k| 10.0 * f64::from(k)).collect();
    let tips = pushed_tips(1e-5, &times);
    let parameters = vec![Parameter::positive("E", [1e6, 1e8])];
    let data = [Series::tips(times.clone(), &tips).with_noise(NOISE)];
    let family = Family {
        parameters,
        build: |p: &[f64]| pushed(p[0], 1e-5),
    };
    let fit = Fit {
        step: 200.0,
        ..fit()
    };
    let found = fit.run(&family, &data).unwrap();
    // Centre lines of one point are tips.
    let lines = [
        Series::centre_lines(times, tips.iter().map(|tip| vec![*tip]).collect()).with_noise(NOISE),
    ];
    assert_eq!(fit.run(&family, &lines).unwrap().residuals, found.residuals);
    let largest = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(0.0_f64, |largest, x| largest.max(x.abs()))
    };
    let error = largest(&mut found.residuals.iter().map(|(.., r)| *r));
    // The pulse is half a sine wave, and the deflection is proportional to it within 1e-4.
    // Interpolation of degree five in six steps has an error of (π/6)⁶ · 17/720 of its height. A
    // polynomial across the discontinuity would have one of several per cent.
    assert!(
        error < 5e-4 * largest(&mut tips.iter().map(|p| p.y)),
        "{error:.1e}"
    );
}

/// A frame at the end of a pulse shows the shoot either before or after the end of the force.
#[test]
fn frames_at_a_discontinuity_are_reported() {
    let parameters = vec![Parameter::positive("E", [1e6, 1e8])];
    let build = |p: &[f64]| pushed(p[0], 1e-4);
    let times = [300.0, 700.0, 900.0, 1200.0, 1500.0, 1800.0, 2400.0];
    let tips = pushed_tips(1e-4, &times);
    let data = [Series::tips(times.to_vec(), &tips).with_noise(NOISE)];
    let found = fit()
        .run(
            &Family {
                parameters: parameters.clone(),
                build,
            },
            &data,
        )
        .unwrap();
    assert!(
        found.warnings.contains(&Warning::AmbiguousFrames {
            series: 0,
            frames: vec![5]
        }),
        "{found}"
    );
    // A pulse without force has no discontinuity.
    let build = |p: &[f64]| pushed(p[0], 0.0);
    let found = fit().run(&Family { parameters, build }, &data).unwrap();
    assert!(
        !found
            .warnings
            .iter()
            .any(|one| matches!(one, Warning::AmbiguousFrames { .. })),
        "{found}"
    );
}
