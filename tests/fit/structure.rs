//! Combinations of parameters that leave every datum unchanged.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::shoots::HOUR;
use approx::assert_relative_eq;
use morphorod::equilibrium::NewtonSolver;
use morphorod::fit::{Estimates, Family, Fit, Parameter, Series, Verdict, View};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::tracking::Track;
use morphorod::tropism::{Oscillator, SettledStatoliths};
use morphorod::{DynLaws, ParameterError, Shoot, ShootParameters, Still};
use nalgebra::{Vector2, Vector3};

/// Names of the parameters: β, η, α, E (Pa), r (m), ρ (kg/m³), force at the tip (N), ℓ0 (m), scale
/// of the camera.
const NAMES: [&str; 9] = [
    "beta", "eta", "alpha", "E", "r", "rho", "force", "l_0", "scale",
];

/// True values of the parameters.
const TRUTH: [f64; 9] = [0.8, 20.0, 0.2, 1e7, 5e-4, 1000.0, 5e-5, 0.05, 1.0];

/// Time step, s.
const STEP: f64 = 200.0;

fn build(p: &[f64]) -> Result<Shoot<DynLaws>, ParameterError> {
    let force = p[6];
    let parameters = ShootParameters {
        gravitropic_sensitivity: p[0],
        proprioceptive_sensitivity: p[1],
        youngs_modulus: p[3],
        radius: p[4],
        density: p[5],
        length: p[7],
        growth_time: 72e3,
        ..ShootParameters::default()
    };
    let oscillator = Oscillator::new(p[2], 2.0 * HOUR);
    let push = ApicalForce(move |_: f64| Vector3::new(0.0, force, 0.0));
    let (gravitropism, proprioception) = parameters.steering(SettledStatoliths);
    let builder = parameters.reduced().elements(4);
    builder
        .tropism((oscillator, gravitropism, proprioception))
        .load((parameters.weight(), push))
        .scene(Still::tilted(FRAC_PI_2))
        .into_dyn()
        .build()
}

/// Fit of the named parameters to the exact tip from above, every 20 min over four hours, with a
/// noise of 0.1 mm.
fn fitted(free: &[&str], force: f64) -> Estimates {
    let mut truth = TRUTH;
    truth[6] = force;
    let mut shoot = build(&truth).unwrap();
    let mut integrator = MethodOfSteps::with_solver(STEP, NewtonSolver::with_tolerance(1e-11));
    let times: Vec<f64> = (1..=12).map(|k| HOUR / 3.0 * f64::from(k)).collect();
    let mut seen = |time: &f64| {
        integrator.advance(&mut shoot, *time).unwrap();
        Vector2::new(shoot.tip().x, shoot.tip().y)
    };
    let track = Track::new(times.clone(), times.iter().map(&mut seen).collect()).unwrap();
    let series = Series::track(&track, View::above())
        .with_noise(1e-4)
        .with_scale("scale");
    let parameter = |(name, value): (&&str, &f64)| {
        if free.contains(name) {
            Parameter::positive(name, [value / 3.0, value * 3.0]).starting(*value)
        } else {
            Parameter::fixed(name, *value)
        }
    };
    let parameters = NAMES.iter().zip(&truth).map(parameter).collect();
    let fit = Fit {
        step: STEP,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    };
    fit.run(&Family { parameters, build }, &[series]).unwrap()
}

/// Checks that all of the parameters are structurally not identifiable, by changes of their
/// logarithms in proportion to the given ones.
fn assert_combination(found: &Estimates, expected: &[(&str, f64)]) {
    assert_eq!(
        found.weak.iter().filter(|weak| weak.structural).count(),
        1,
        "{found}"
    );
    let components = &found.weak[0].components;
    assert_eq!(components.len(), expected.len(), "{found}");
    let largest = expected
        .iter()
        .fold(0.0_f64, |largest, (_, change)| largest.max(change.abs()));
    let sign = components
        .iter()
        .find(|(name, _)| *name == expected[0].0)
        .unwrap()
        .1
        .signum();
    for (name, change) in expected {
        assert_eq!(
            found.get(name).unwrap().verdict,
            Verdict::StructurallyNot,
            "{name}"
        );
        let component = components
            .iter()
            .find(|(other, _)| other == name)
            .unwrap()
            .1;
        // The combination is exact. Differences have relative errors below 1e-6.
        let exact = sign * change / largest * expected[0].1.signum();
        assert_relative_eq!(component, exact, epsilon = 0.0, max_relative = 1e-4);
    }
    // The singular value is rounding, far below the values of combinations with an effect, 1e-5.
    let [largest, least] =
        [f64::max, f64::min].map(|f| found.singular_values.iter().copied().reduce(f).unwrap());
    assert!(least < 1e-9 * largest, "{least:.1e} {largest:.1e}");
}

#[test]
fn radius_with_sensitivities_and_stiffness_is_structurally_not_identifiable() {
    let found = fitted(&["beta", "eta", "alpha", "E", "r"], 0.0);
    assert_combination(
        &found,
        &[("r", 1.0), ("beta", 1.0), ("alpha", 1.0), ("E", -2.0)],
    );
    assert_eq!(found.get("eta").unwrap().verdict, Verdict::Identifiable);
}

#[test]
fn density_with_stiffness_and_loads_is_structurally_not_identifiable() {
    let found = fitted(&["beta", "E", "rho", "force"], TRUTH[6]);
    assert_combination(&found, &[("E", 1.0), ("rho", 1.0), ("force", 1.0)]);
    assert_eq!(found.get("beta").unwrap().verdict, Verdict::Identifiable);
}

#[test]
fn scale_of_a_camera_from_above_with_lengths_is_structurally_not_identifiable() {
    let found = fitted(&["beta", "eta", "alpha", "E", "l_0", "scale"], 0.0);
    let lengths = [
        ("scale", 1.0),
        ("l_0", -1.0),
        ("beta", 1.0),
        ("alpha", 1.0),
        ("E", -3.0),
    ];
    assert_combination(&found, &lengths);
    assert_eq!(found.get("eta").unwrap().verdict, Verdict::Identifiable);
}

/// Only a known force, a ten thousandth of the weight, determines the lengths. Its effect is far
/// below the noise.
#[test]
fn scale_of_a_camera_is_only_practically_not_identifiable_with_a_small_known_force() {
    let found = fitted(&["beta", "eta", "alpha", "E", "l_0", "scale"], 4e-8);
    for name in ["scale", "l_0", "E"] {
        assert_eq!(
            found.get(name).unwrap().verdict,
            Verdict::PracticallyNot,
            "{found}"
        );
    }
    // The limit of combinations without effect is 1e-8.
    let [largest, least] =
        [f64::max, f64::min].map(|f| found.singular_values.iter().copied().reduce(f).unwrap());
    assert!(least > 3e-8 * largest, "{least:.1e} {largest:.1e}");
}

#[test]
fn combinations_with_a_small_effect_are_not_structural() {
    let found = fitted(&["beta", "eta", "alpha", "E", "rho"], TRUTH[6]);
    assert!(found.weak.iter().all(|weak| !weak.structural), "{found}");
}
