//! Righting response of a horizontal shoot: reduced model, h = −ĝ, ℓ = 5 cm, τg = 20 h,
//! horizontal base.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, remembering, righting, tips,
};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_abs_diff_ne, assert_relative_eq};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::tropism::{Memory, SettledStatoliths, Site};
use nalgebra::Vector3;

/// Tip (x along the base tangent, z up, m) at full hours: the reduced model of doi
/// 10.3389/fpls.2021.608005, integrated by two independent codes to an error below 1e-8 m.
const TABLE: [(f64, f64, f64); 4] = [
    (0.0, 0.048402645, -0.011718344),
    (4.0, 0.016944722, 0.041497416),
    (8.0, 0.019158574, 0.041342058),
    (24.0, 0.019177114, 0.041339853),
];

/// Error of the table, m: its own error and one unit of its last digit.
const TABLE_ERROR: f64 = 2e-8;

#[test]
fn tip_matches_the_table() {
    let mut shoot = righting().elements(8).into_dyn().build().unwrap();
    let times = TABLE.map(|row| row.0 * HOUR);
    let (tips, _) = tips(&mut shoot, 90.0, &times);
    for ((hour, x, z), tip) in TABLE.into_iter().zip(tips) {
        let error = (tip - Vector3::new(x, 0.0, z)).norm();
        assert!(error < TABLE_ERROR, "after {hour} h: {error:e} m");
        // The scene is planar. The rounding unit of 5 cm is 1e-17 m.
        assert!(
            abs_diff_eq!(tip.y, 0.0, epsilon = 1e-14),
            "the shoot leaves its plane by {:e} m",
            tip.y
        );
    }
}

/// Tip of the stationary shape, m: θ' = −k sin θ with θ(0) = π/2 and k = β/(ηr), for any weight and
/// stiffness, has its tip at ((2/k) atan tanh(kℓ/2), ln cosh(kℓ)/k). With ℓ = 5 cm, r = 0.5 mm:
/// (0.0191771143042, 0.0413398528227) m.
fn stationary_tip(length: f64) -> Vector3<f64> {
    let k = BETA / (ETA * RADIUS);
    Vector3::new(
        2.0 / k * (0.5 * k * length).tanh().atan(),
        0.0,
        (k * length).cosh().ln() / k,
    )
}

#[test]
fn righting_shoot_reaches_the_stationary_shape_for_any_memories() {
    assert_abs_diff_eq!(
        InNorm(stationary_tip(0.05)),
        InNorm(Vector3::new(0.0191771143042, 0.0, 0.0413398528227)),
        epsilon = 1e-13
    );
    let own = |time: f64, delay: f64| Memory {
        time: time * MINUTE,
        delay: delay * MINUTE,
    };
    for (gravity, bend) in [
        (MEMORY, MEMORY),
        (own(5.0, 17.0), own(20.0, 8.0)),
        (own(30.0, 5.0), own(3.0, 12.0)),
    ] {
        let mut shoot = righting()
            .tropism(remembering(gravity, bend).steering(SettledStatoliths))
            .into_dyn()
            .build()
            .unwrap();
        // The slowest mode decays in about an hour and has vanished after 100 h. 8 elements of
        // order 8 are exact to 1e-11 m. 1e-10 m is 2e-9 of the length.
        let (tips, _) = tips(&mut shoot, 180.0, &[100.0 * HOUR]);
        let (tip, exact) = (tips[0], stationary_tip(0.05));
        assert!(
            abs_diff_eq!(InNorm(tip), InNorm(exact), epsilon = 1e-10),
            "{gravity:?} {bend:?}: {tip:?} against {exact:?}"
        );
    }
}

/// Steady history of the righting shoot: upward direction and bending strains at each point, as in
/// the first equilibrium.
fn as_it_is(_t: f64, site: &Site, variables: &mut [f64]) {
    let up = site.along_directors(&site.environment.up());
    variables.copy_from_slice(&[up.x, up.y, site.strain.x, site.strain.y]);
}

#[test]
fn given_history_that_is_zero_or_constant_acts_like_the_empty_or_steady_history() {
    let times = [0.5 * HOUR, 2.0 * HOUR, 6.0 * HOUR];
    let start = righting().into_dyn().build().unwrap();
    let tips_after = |past: usize| {
        let mut run = MethodOfSteps::with_solver(90.0, NewtonSolver::default());
        let mut shoot = start.clone();
        let _ = match past {
            0 => run.start(&mut shoot, &ConstantHistory::Empty),
            1 => run.start(&mut shoot, &|_: f64, _: &Site, y: &mut [f64]| y.fill(0.0)),
            2 => run.start(&mut shoot, &ConstantHistory::Steady),
            _ => run.start(&mut shoot, &as_it_is),
        }
        .unwrap();
        times.map(|t| {
            run.advance(&mut shoot, t).unwrap();
            shoot.tip()
        })
    };
    let [empty, zero, steady, constant] = [0, 1, 2, 3].map(tips_after);
    for i in 0..times.len() {
        // Interpolation of a constant is exact. Rounding may change the number of Newton
        // iterations. Their tolerance is 1e-11 rad over 5 cm.
        assert_abs_diff_eq!(InNorm(empty[i]), InNorm(zero[i]), epsilon = 1e-12);
        assert_abs_diff_eq!(InNorm(steady[i]), InNorm(constant[i]), epsilon = 1e-12);
    }
    // A steady history bends the shoot from the beginning, an empty one only after the delay.
    assert_abs_diff_ne!(InNorm(steady[0]), InNorm(empty[0]), epsilon = 1e-4);
}

#[test]
fn step_evaluates_one_tangent_and_one_gradient() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let cost = MethodOfSteps::new(180.0)
        .advance(&mut shoot, 24.0 * HOUR)
        .unwrap();
    assert_eq!(cost.equilibria, cost.steps + 1);
    // The equilibrium at which the response begins, after one delay, takes a chord step more,
    // because its initial guess does not include the response.
    assert_eq!(
        (cost.iterations, cost.factorisations),
        (cost.equilibria, cost.equilibria),
        "{cost:?}"
    );
    assert!(cost.evaluations <= cost.equilibria + 1, "{cost:?}");
}

#[test]
fn response_begins_after_the_delay() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(100.0);
    run.advance(&mut shoot, MEMORY.delay).unwrap();
    // The memories are empty before t = 0, and the response depends on older memories only.
    assert!(
        shoot
            .rod()
            .points()
            .iter()
            .all(|point| point.intrinsic.norm() == 0.0)
    );
    run.advance(&mut shoot, MEMORY.delay + 1.0).unwrap();
    assert!(
        shoot
            .rod()
            .points()
            .iter()
            .all(|point| point.intrinsic.norm() > 0.0)
    );
}

#[test]
fn steady_history_bends_the_shoot_at_a_constant_rate_for_one_delay() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(100.0);
    let _ = run.start(&mut shoot, &ConstantHistory::Steady).unwrap();
    let past: Vec<Vec<f64>> = (0..32)
        .map(|i| shoot.state().variables(i).unwrap().to_vec())
        .collect();
    run.advance(&mut shoot, MEMORY.delay).unwrap();
    for (point, y) in shoot.rod().points().iter().zip(past) {
        // Equations (7) and (8) with constant memories: u* = (t/τg) (−β h2/r − η u1, β h1/r − η
        // u2).
        let gradient = [
            -BETA / RADIUS * y[1] - ETA * y[2],
            BETA / RADIUS * y[0] - ETA * y[3],
        ];
        let exact = Vector3::new(gradient[0], gradient[1], 0.0) * (MEMORY.delay / (20.0 * HOUR));
        // Sums of about ten terms have rounding errors of a few ulp.
        assert_abs_diff_eq!(
            InNorm(point.intrinsic),
            InNorm(exact),
            epsilon = 1e-14 * exact.norm()
        );
    }
}

#[test]
fn varying_given_history_bends_the_shoot_as_in_the_closed_form() {
    // Let y = y0 exp(t/σ) on [−τr, 0] in the memory of h1 alone. Until t = τr the intrinsic strain
    // is u2* = (β y0/(r τg)) σ (exp((t − τr)/σ) − exp(−τr/σ)).
    let (scale, y0) = (6.0 * MINUTE, 0.3);
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(100.0);
    let past = |t: f64, _: &Site, y: &mut [f64]| {
        y.copy_from_slice(&[y0 * (t / scale).exp(), 0.0, 0.0, 0.0])
    };
    let _ = run.start(&mut shoot, &past).unwrap();
    for t in [4.0 * MINUTE, 12.0 * MINUTE] {
        run.advance(&mut shoot, t).unwrap();
        let memory = ((t - MEMORY.delay) / scale).exp() - (-MEMORY.delay / scale).exp();
        let exact = BETA * y0 / (RADIUS * 20.0 * HOUR) * scale * memory;
        // The history is sampled 64 times over τr = 2σ and interpolated by cubics, with an error of
        // h⁴/384 times the fourth derivative. Slopes from five samples have an error of h⁴/20 times
        // the fifth derivative at the end: (2/64)⁴/20 = 5e-8.
        for point in shoot.rod().points() {
            assert_relative_eq!(point.intrinsic.y, exact, epsilon = 0.0, max_relative = 5e-8);
            assert_eq!(point.intrinsic.x, 0.0);
        }
    }
}

#[test]
fn steps_that_do_not_divide_the_delays_are_as_accurate_as_those_that_do() {
    let times = [2.0 * HOUR, 4.0 * HOUR, 8.0 * HOUR];
    let own = |time: f64, delay: f64| Memory {
        time: time * MINUTE,
        delay: delay * MINUTE,
    };
    for (gravity, bend) in [(MEMORY, MEMORY), (own(5.0, 17.3), own(20.0, 8.9))] {
        let laws = remembering(gravity, bend).steering(SettledStatoliths);
        let run = |step: f64| {
            tips(
                &mut righting()
                    .elements(4)
                    .tropism(laws)
                    .into_dyn()
                    .build()
                    .unwrap(),
                step,
                &times,
            )
            .0
        };
        // 12 min is a multiple of 90 s, but not of 97 s or 113 s. The order is four for all steps,
        // with the same constant up to a factor of 2 by which the error varies along the run. The
        // reference uses steps of 20 s, with an error 400 times smaller.
        let fine = run(20.0);
        let error = |step: f64| {
            run(step)
                .iter()
                .zip(&fine)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f64::max)
        };
        let (divisor, others) = (error(90.0), [error(97.0), error(113.0)]);
        // The error is of fourth order with steps of an eighth of the memory time: (1/8)⁴/384 of
        // the motion of 4 cm is 2.5e-8 m. It is up to four times larger for two laws with different
        // memories.
        assert!(divisor < 1e-7, "{divisor:e}");
        for (step, other) in [97.0_f64, 113.0].into_iter().zip(others) {
            assert!(
                other < 2.0 * divisor * (step / 90.0).powi(4),
                "{step} s: {other:e} against {divisor:e}"
            );
        }
    }
}
