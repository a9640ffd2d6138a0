//! Errors, verdicts and intervals of estimates.

use super::plants::{NAMES, NOISE, TRUTH, family, measured, oscillating, tips};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::fit::{Estimates, Family, Fit, Parameter, Series, Verdict};
use morphorod::tropism::Oscillator;

fn fit() -> Fit {
    Fit {
        step: 200.0,
        starts: 1,
        windows: vec![1.0],
        ..Fit::default()
    }
}

/// Fit of the named parameters to centre lines of eight points.
fn lines(free: &[&str], noise: f64) -> Estimates {
    let (times, frames) = measured(8, noise, 4);
    fit()
        .run(
            &family(free, 1.0),
            &[Series::centre_lines(times, frames).with_noise(noise)],
        )
        .unwrap()
}

/// In the model of constant length, β and η appear only over τg.
#[test]
fn sensitivities_and_the_growth_time_together_are_structurally_not_identifiable() {
    for noise in [NOISE, 0.1 * NOISE] {
        let found = lines(&["beta", "eta", "tau_m", "tau_r", "tau_g"], noise);
        for name in ["beta", "eta", "tau_g"] {
            assert_eq!(
                found.get(name).unwrap().verdict,
                Verdict::StructurallyNot,
                "{name}"
            );
        }
        for name in ["tau_m", "tau_r"] {
            assert_eq!(
                found.get(name).unwrap().verdict,
                Verdict::Identifiable,
                "{name}"
            );
        }
        assert_eq!(found.weak.len(), 1);
        let words = found.weak[0].to_string();
        assert!(
            words.starts_with("beta, eta and tau_g are known only in combination"),
            "{words}"
        );
        // The combination is exact. Extrapolated differences have an error of 1e-7.
        for (_, component) in &found.weak[0].components {
            assert_relative_eq!(*component, 1.0, epsilon = 0.0, max_relative = 1e-4);
        }
        // Their quotients are known.
        let [_, ratio] = found.derived(|p| (p[0] / p[4]).ln());
        let [_, product] = found.derived(|p| (p[0] * p[4]).ln());
        assert!(ratio < 0.05 && product.is_infinite(), "{ratio} {product}");
    }
}

/// The data are exact tips in four frames with an assumed noise of 2 mm. Every combination has an
/// effect, but some effects are small.
#[test]
fn parameters_that_hardly_change_the_data_are_practically_not_identifiable() {
    let (times, positions) = tips(0.0, 0);
    let early = Series::tips(times[..4].to_vec(), &positions[..4]).with_noise(20.0 * NOISE);
    let found = fit()
        .run(&family(&["beta", "eta", "tau_m", "tau_r"], 1.0), &[early])
        .unwrap();
    assert_eq!(
        found.get("eta").unwrap().verdict,
        Verdict::PracticallyNot,
        "{found}"
    );
    assert!(
        found
            .parameters
            .iter()
            .all(|estimate| estimate.verdict != Verdict::StructurallyNot),
        "{found}"
    );
    assert!(
        found
            .weak
            .iter()
            .any(|weak| weak.components.iter().any(|(name, _)| name == "eta")),
        "{found}"
    );
}

/// The path is nearly linear in the parameters within the interval.
#[test]
fn profile_likelihood_gives_the_interval_of_the_covariance_for_accurate_data() {
    let (times, positions) = tips(NOISE, 6);
    let (family, data) = (
        family(&["beta", "eta"], 1.0),
        [Series::tips(times, &positions).with_noise(NOISE)],
    );
    let found = fit().run(&family, &data).unwrap();
    let interval = found.get("beta").unwrap().interval();
    let profile = fit().profile(family.build, &found, "beta").unwrap();
    for (linear, profile) in interval.iter().zip(profile) {
        // The ends have an error of 2 % of the half width. The relative effect of nonlinearity is
        // about the relative size of the half width, 1 %.
        let half = 0.5 * (interval[1] - interval[0]);
        assert_abs_diff_eq!(*linear, profile, epsilon = 0.05 * half);
    }
}

#[test]
fn a_prior_determines_a_combination_without_effect_on_the_data() {
    let Family {
        mut parameters,
        build,
    } = family(&["beta", "eta", "tau_g"], 1.0);
    let k = NAMES.iter().position(|name| *name == "tau_g").unwrap();
    parameters[k] = parameters[k].clone().with_prior(TRUTH[k], 0.1);
    let (times, positions) = tips(NOISE, 7);
    let found = fit()
        .run(
            &Family { parameters, build },
            &[Series::tips(times, &positions)],
        )
        .unwrap();
    // The data determine β/τg to 1e-3. The relative errors of β and τg are therefore that of the
    // prior.
    for name in ["beta", "tau_g"] {
        assert_eq!(found.get(name).unwrap().verdict, Verdict::Identifiable);
        assert_relative_eq!(
            found.get(name).unwrap().error,
            0.1,
            epsilon = 0.0,
            max_relative = 0.01
        );
    }
}

#[test]
fn an_estimate_at_a_bound_is_reported() {
    let Family {
        mut parameters,
        build,
    } = family(&["beta", "eta"], 1.0);
    (parameters[0].bounds, parameters[0].start) = ([0.1, 0.7], 0.5);
    let (times, positions) = tips(NOISE, 8);
    let found = fit()
        .run(
            &Family { parameters, build },
            &[Series::tips(times, &positions).with_noise(NOISE)],
        )
        .unwrap();
    assert_eq!(found.get("beta").unwrap().verdict, Verdict::AtBound);
    assert_relative_eq!(
        found.get("beta").unwrap().value,
        0.7,
        epsilon = 0.0,
        max_relative = 1e-12
    );
    // The model is wrong, because β cannot reach its true value.
    assert!(found.reduced_chi_squared() > 2.0, "{found}");
}

#[test]
fn fixed_parameters_and_parameters_at_a_bound_have_no_standard_errors() {
    let (times, positions) = tips(NOISE, 8);
    let data = [Series::tips(times, &positions).with_noise(NOISE)];
    let none = fit().run(&family(&[], 1.0), &data).unwrap();
    assert!(
        none.parameters
            .iter()
            .all(|estimate| estimate.verdict == Verdict::Fixed),
        "{none}"
    );
    let Family {
        mut parameters,
        build,
    } = family(&["beta"], 1.0);
    (parameters[0].bounds, parameters[0].start) = ([0.1, 0.7], 0.5);
    let one = fit().run(&Family { parameters, build }, &data).unwrap();
    assert_eq!(one.get("beta").unwrap().verdict, Verdict::AtBound);
    // Both fits have the same data. The true values explain them far better.
    assert!(none.compare(&one).unwrap() > 10.0);
}

/// An oscillator without amplitude has no phase. No other parameter is free.
#[test]
fn a_single_parameter_without_effect_is_structurally_not_identifiable() {
    let Family { mut parameters, .. } = family(&[], 1.0);
    parameters.push(Parameter::linear("phase", [-3.0, 3.0]));
    let build = |p: &[f64]| {
        oscillating(
            p,
            Oscillator {
                phase: p[NAMES.len()],
                ..Oscillator::new(0.0, 1500.0)
            },
        )
    };
    let (times, positions) = tips(NOISE, 8);
    let data = [Series::tips(times, &positions).with_noise(NOISE)];
    let found = fit().run(&Family { parameters, build }, &data).unwrap();
    assert_eq!(
        found.get("phase").unwrap().verdict,
        Verdict::StructurallyNot
    );
    assert_eq!(found.weak[0].to_string(), "phase has no effect on the data");
}
