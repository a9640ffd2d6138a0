//! Recovery of known parameters from synthetic data.

use super::plants::{NAMES, NOISE, TRUTH, family, measured, righting, tips};
use approx::assert_relative_eq;
use morphorod::fit::{Family, Fit, Loss, Parameter, Series, Verdict, View};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tracking::Track;
use nalgebra::{Vector2, Vector3};

const FREE: [&str; 4] = ["beta", "eta", "tau_m", "tau_r"];

/// Settings with a time step whose error, 3e-7 m, is far below the noise.
fn fit() -> Fit {
    Fit {
        step: 200.0,
        starts: 1,
        ..Fit::default()
    }
}

#[test]
fn parameters_of_a_righting_shoot_are_recovered_from_its_tip() {
    let (times, positions) = tips(NOISE, 1);
    let found = fit()
        .run(&family(&FREE, 1.6), &[Series::tips(times, &positions)])
        .unwrap();
    for name in FREE {
        let (estimate, truth) = (
            found.get(name).unwrap(),
            TRUTH[NAMES.iter().position(|n| *n == name).unwrap()],
        );
        assert_eq!(estimate.verdict, Verdict::Identifiable);
        // Four standard errors: one draw in 4000 fails.
        assert_relative_eq!(
            estimate.value,
            truth,
            epsilon = 0.0,
            max_relative = 4.0 * estimate.error
        );
    }
    // The noise is estimated from 108 coordinates. Its standard error is 1/√(2·104) = 7 %.
    assert_relative_eq!(found.noise[0], NOISE, epsilon = 0.0, max_relative = 0.28);
}

#[test]
fn exact_data_of_centre_lines_give_exact_parameters() {
    // The points are between the points of the line with which the search for the nearest point
    // begins.
    let (times, lines) = measured(7, 0.0, 1);
    let found = fit()
        .run(
            &family(&FREE, 0.7),
            &[Series::centre_lines(times, lines).with_noise(NOISE)],
        )
        .unwrap();
    for name in FREE {
        let truth = TRUTH[NAMES.iter().position(|n| *n == name).unwrap()];
        // The search ends within 1e-3 standard errors, which are 1e-2. The time steps of fit and
        // data cause a relative error of 1e-5.
        assert_relative_eq!(
            found.get(name).unwrap().value,
            truth,
            epsilon = 0.0,
            max_relative = 1e-4
        );
    }
}

#[test]
fn outliers_have_little_influence_with_a_robust_loss() {
    let (times, mut positions) = tips(NOISE, 2);
    let ends = |positions: &[Vector3<f64>], loss| {
        let data = [Series::tips(times.clone(), positions).with_noise(NOISE)];
        let found = Fit { loss, ..fit() }
            .run(&family(&["beta", "tau_r"], 1.2), &data)
            .unwrap();
        (
            found.get("tau_r").unwrap().value,
            found.get("tau_r").unwrap().error,
        )
    };
    let (clean, error) = ends(&positions, Loss::Squares);
    positions[3] += Vector3::new(3e-3, 0.0, -3e-3);
    positions[20] -= Vector3::new(3e-3, 0.0, 3e-3);
    let (robust, _) = ends(&positions, Loss::ROBUST);
    let (squares, _) = ends(&positions, Loss::Squares);
    // The influence of each of the two outliers is at most that of a residual of 1.345 standard
    // deviations.
    assert_relative_eq!(robust, clean, epsilon = 0.0, max_relative = 2.0 * error);
    assert!(
        (squares - clean).abs() > 3.0 * (robust - clean).abs(),
        "{squares} {robust} {clean}"
    );
}

/// A camera from the side with an unknown magnification and origin.
#[test]
fn scale_and_offset_of_a_camera_are_estimated_with_the_parameters() {
    let (times, positions) = tips(NOISE, 3);
    let image = |p: &Vector3<f64>| Vector2::new(2.5 * p.x + 0.01, 2.5 * p.z - 0.02);
    let track = Track::new(times, positions.iter().map(image).collect()).unwrap();
    let series = Series::track(&track, View::side())
        .with_scale("scale")
        .with_offset(&["x_0", "z_0"]);
    let mut parameters = family(&["beta", "tau_r"], 1.3).parameters;
    parameters.push(Parameter::positive("scale", [0.5, 10.0]).starting(2.0));
    parameters.push(Parameter::linear("x_0", [-0.1, 0.1]));
    parameters.push(Parameter::linear("z_0", [-0.1, 0.1]));
    let found = fit()
        .run(
            &Family {
                parameters,
                build: righting,
            },
            &[series],
        )
        .unwrap();
    // The noise is that of the image. The standard error of its estimate is 9 %.
    assert_relative_eq!(
        found.noise[0],
        2.5 * NOISE,
        epsilon = 0.0,
        max_relative = 0.4
    );
    for (name, truth) in [("beta", 0.8), ("tau_r", 720.0), ("scale", 2.5)] {
        let estimate = found.get(name).unwrap();
        assert_eq!(estimate.verdict, Verdict::Identifiable);
        // Four standard errors: one draw in 4000 fails.
        assert_relative_eq!(
            estimate.value,
            truth,
            epsilon = 0.0,
            max_relative = 4.0 * estimate.error
        );
    }
}

/// A frame every 5 s. The same noise-free shoot in frames every 10 min has the same minimum.
#[test]
fn parameters_are_recovered_from_frames_that_are_far_closer_than_the_steps() {
    let mut shoot = righting(&TRUTH).unwrap();
    let mut integrator = MethodOfSteps::new(5.0);
    let times: Vec<f64> = (1..=2000).map(|k| 5.0 * f64::from(k)).collect();
    let mut tip = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        shoot.tip()
    };
    let exact: Vec<_> = times.iter().map(&mut tip).collect();
    let found = fit()
        .run(
            &family(&FREE, 1.3),
            &[Series::tips(times.clone(), &exact).with_noise(NOISE)],
        )
        .unwrap();
    for name in FREE {
        let truth = TRUTH[NAMES.iter().position(|n| *n == name).unwrap()];
        // Interpolation at a third of the memory time has an error of 1e-4 of the motion.
        assert_relative_eq!(
            found.get(name).unwrap().value,
            truth,
            epsilon = 0.0,
            max_relative = 2e-3
        );
    }
    assert_eq!(found.residuals.len(), 6000);
    assert!(
        found
            .residuals
            .windows(2)
            .all(|pair| pair[0].1 <= pair[1].1)
    );
}
