//! The motion of material points under growth that varies in space or time, integrated by the
//! crate, compared with closed forms and with a reference integration in this file.

use std::f64::consts::TAU;

use crate::fixtures::shoots::{HOUR, WEIGHT, YOUNG, rod};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::ShootParameters;
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{CosineProfile, GrowthLaw, LinearProfile};
use morphorod::integrator::{Integrator, MethodOfSteps};

/// The motion of a point at the initial distance `sigma` from the apex under the linear profile, in
/// closed form. With c = 2ℓg/σ0 − 1 it is σ = 2ℓg/(1 + c exp(−2t/τg)), from which γ = ∂σ/∂σ0 =
/// (σ/σ0)² exp(−2t/τg). The point leaves the zone at (τg/2) ln c.
fn linear(law: &LinearProfile, sigma: f64, t: f64) -> (f64, f64, f64) {
    let (c, decay) = (
        2.0 * law.zone_length / sigma - 1.0,
        (-2.0 * t / law.time).exp(),
    );
    let now = 2.0 * law.zone_length / (1.0 + c * decay);
    (now, (now / sigma).powi(2) * decay, 0.5 * law.time * c.ln())
}

const LINEAR: LinearProfile = LinearProfile {
    zone_length: 0.03,
    time: 20.0 * HOUR,
};

#[test]
fn integrated_motion_and_exit_times_match_the_linear_profile() {
    // The steps are 1/128 of the fastest growth time τg/2. Each has a relative error of
    // (1/128)⁵/120.
    let promised = |t: f64| 128.0_f64.powi(-4) / 120.0 * (2.0 * t / LINEAR.time).max(1.0);
    let mut worst = [0.0_f64; 4];
    for sigma in [1e-6, 1e-4, 0.004, 0.0123, 0.0299] {
        for t in [0.1, 1.0, 10.0, 40.0, 80.0].map(|h| h * HOUR) {
            let (distance, stretch, exit) = linear(&LINEAR, sigma, t);
            let moved = LINEAR.flow(sigma, 0.0, t);
            if t <= exit {
                worst[0] = worst[0].max((moved.0 / distance - 1.0).abs() / promised(t));
                worst[1] = worst[1].max((moved.1 / stretch - 1.0).abs() / promised(t));
                // The backward flow returns to the initial distance.
                let back = LINEAR.flow(moved.0, t, 0.0).0;
                worst[2] = worst[2].max((back / sigma - 1.0).abs() / promised(t));
                assert_eq!(LINEAR.exit_time(sigma, 0.0, t), None);
            } else {
                let found = LINEAR.exit_time(sigma, 0.0, t).expect("an exit time");
                worst[3] = worst[3].max((found - exit).abs() / LINEAR.time / promised(exit));
            }
        }
    }
    assert!(
        worst.iter().all(|e| *e < 1.0),
        "errors in units of the bound of the method: {worst:?}"
    );
}

#[test]
fn simulated_shoot_with_linear_profile_follows_the_closed_form() {
    let initial = 0.05;
    let mut shoot = rod(YOUNG, initial)
        .merge_tolerance(0.0)
        .growth(LINEAR)
        .into_dyn()
        .build()
        .unwrap();
    let first_nodes: Vec<f64> = shoot
        .rod()
        .centre_line()
        .iter()
        .map(|(s, _)| initial - s)
        .collect();
    let mut run = MethodOfSteps::with_solver(0.05 * HOUR, Unloaded);
    let mut worst = [0.0_f64; 2];
    for t in [5.0, 10.0, 20.0, 40.0].map(|h| h * HOUR) {
        run.advance(&mut shoot, t).unwrap();
        let now = initial + LINEAR.zone_length * t / LINEAR.time;
        worst[0] = worst[0].max((shoot.rod().length() / now - 1.0).abs());
        let line = shoot.rod().centre_line();
        for sigma in &first_nodes[..first_nodes.len() - 1] {
            let (distance, _, exit) = linear(&LINEAR, *sigma, t);
            let exact = if *sigma >= LINEAR.zone_length {
                initial - sigma
            } else if t <= exit {
                now - distance
            } else {
                initial + LINEAR.zone_length * exit / LINEAR.time - LINEAR.zone_length
            };
            let nearest = line
                .iter()
                .map(|(s, _)| (s - exact).abs())
                .fold(f64::INFINITY, f64::min);
            worst[1] = worst[1].max(nearest / now);
        }
    }
    // The stretch varies over an element of an eighth of the zone. The length of the element is a
    // sum over four Gauss points. The error of the sum is (1/8)⁸ · 4!⁴/(9 · 8!³) = 1.6e-17 of the
    // eighth derivative. The error of the motion is 3e-11 in a growth time of τg/2.
    assert!(worst.iter().all(|e| *e < 1e-10), "{worst:?}");
}

/// Growth that is uniform in space and varies with the time of day, REGR = (1 − c cos(2πt/P))/τg.
/// The crate integrates it. The closed form is σ = σ0 exp((t − c P/(2π) sin(2πt/P))/τg).
#[derive(Debug, Clone, Copy)]
struct Daily {
    zone: f64,
    time: f64,
    period: f64,
    swing: f64,
}

impl Daily {
    fn exponent(&self, t: f64) -> f64 {
        (t - self.swing * self.period / TAU * (TAU * t / self.period).sin()) / self.time
    }
}

impl GrowthLaw for Daily {
    fn regr(&self, _sigma: f64, t: f64) -> f64 {
        (1.0 - self.swing * (TAU * t / self.period).cos()) / self.time
    }

    fn zone_length(&self) -> f64 {
        self.zone
    }
}

#[test]
fn growth_with_a_daily_rhythm_matches_the_closed_form() {
    for swing in [0.5, -0.9, 1.0] {
        let law = Daily {
            zone: 0.03,
            time: 20.0 * HOUR,
            period: 24.0 * HOUR,
            swing,
        };
        let initial = 0.05;
        let mut shoot = rod(YOUNG, initial).growth(law).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::with_solver(0.1 * HOUR, Unloaded);
        for t in [6.0, 24.0, 72.0].map(|h| h * HOUR) {
            let exact = initial + law.zone * law.exponent(t);
            let traced = law.length(initial, t);
            // With 64 intervals of eight Gauss points over three days, only rounding errors remain.
            assert!(
                relative_eq!(traced, exact, epsilon = 0.0, max_relative = 1e-12),
                "swing {swing}, {t}: {traced} against {exact}"
            );
            run.advance(&mut shoot, t).unwrap();
            // The error is 3e-11 in every growth time, as for a steady rate. The fastest growth
            // time is τg/2, reached once a day.
            let found = shoot.rod().length();
            assert!(
                relative_eq!(found, exact, epsilon = 0.0, max_relative = 1e-10),
                "swing {swing}, {t}: {found} against {exact}"
            );
            let sigma = law.zone * (-law.exponent(t) - 0.1).exp();
            let point = law.trace(initial, initial - sigma, t);
            let (place, stretch) = (exact - sigma * law.exponent(t).exp(), law.exponent(t).exp());
            assert!(
                relative_eq!(point.stretch, stretch, epsilon = 0.0, max_relative = 1e-10),
                "swing {swing}, {t}: {point:?} against the stretch {stretch}"
            );
            assert!(
                abs_diff_eq!(point.arc_length, place, epsilon = 1e-10 * exact),
                "swing {swing}, {t}: {point:?} against the place {place}"
            );
        }
    }
}

#[test]
fn integrated_motion_matches_the_cosine_profile() {
    // ∫ REGR from the apex is (σ − ℓg/(2π) sin(2πσ/ℓg))/τg. The reference is the 3/8 rule with
    // 40000 steps, whose error is 1e-14.
    let law = CosineProfile {
        zone_length: 0.03,
        time: 20.0 * HOUR,
    };
    let speed = |x: f64| (x - law.zone_length / TAU * (TAU * x / law.zone_length).sin()) / law.time;
    for (sigma, t) in [
        (0.002, 40.0 * HOUR),
        (0.012, 10.0 * HOUR),
        (0.02, 8.0 * HOUR),
    ] {
        let (mut x, h) = (sigma, t / 40000.0);
        for _ in 0..40000 {
            let k1 = speed(x);
            let k2 = speed(x + h * k1 / 3.0);
            let k3 = speed(x + h * (k2 - k1 / 3.0));
            let k4 = speed(x + h * (k1 - k2 + k3));
            x += h / 8.0 * (k1 + 3.0 * (k2 + k3) + k4);
        }
        // The speed does not depend on time. The stretch ∂σ/∂σ0 is therefore the ratio of the
        // speeds at the two ends.
        let (distance, stretch) = law.flow(sigma, 0.0, t);
        // The error is 3e-11 per growth time of τg/2, for at most two growth times.
        assert_relative_eq!(distance, x, epsilon = 0.0, max_relative = 1e-10);
        assert_relative_eq!(
            stretch,
            speed(x) / speed(sigma),
            epsilon = 0.0,
            max_relative = 1e-10
        );
        let exit = law.exit_time(sigma, 0.0, 40.0 * law.time).unwrap();
        assert_relative_eq!(
            law.flow(sigma, 0.0, exit).0,
            law.zone_length,
            epsilon = 0.0,
            max_relative = 1e-12
        );
        // The elongation of the whole zone is the same for all profiles of mean 1/τg.
        assert_abs_diff_eq!(
            law.length(0.05, t) - 0.05,
            law.zone_length * t / law.time,
            epsilon = 1e-14
        );
    }
}

/// Growth that begins at half an hour, so that tissue behind the zone has no finite exit time.
struct Late;

impl GrowthLaw for Late {
    fn regr(&self, _sigma: f64, t: f64) -> f64 {
        if t < 1800.0 {
            0.0
        } else {
            1.0 / (20.0 * 3600.0)
        }
    }
    fn zone_length(&self) -> f64 {
        0.07
    }
}

#[test]
fn tissue_without_a_finite_exit_time_keeps_an_infinite_age() {
    let mut shoot = rod(ShootParameters::default().lignifying(), 0.1)
        .elements(16)
        .growth(Late)
        .load(WEIGHT)
        .into_dyn()
        .build()
        .unwrap();
    let mut steps = MethodOfSteps::new(90.0);
    let mut merges = 0;
    for hours in [0.4, 1.0, 3.0, 8.0] {
        merges += steps.advance(&mut shoot, hours * 3600.0).unwrap().merges;
        let kept = shoot.state().clone();
        shoot.restore(&kept).unwrap();
        // The part behind the zone existed before the start and has an infinite age.
        for place in shoot.profile().sample(101) {
            let (s, old) = (place.arc_length, place.tissue.age == f64::INFINITY);
            assert!(
                old == (s < 0.03) || abs_diff_eq!(s, 0.03, epsilon = 1e-9),
                "{hours} h, {s} m: {}",
                place.tissue.age
            );
        }
    }
    assert!(merges > 10, "{merges}");
}

#[test]
fn pointers_forward_the_closed_forms_of_a_law() {
    struct Known;
    impl GrowthLaw for Known {
        fn regr(&self, _: f64, _: f64) -> f64 {
            1e-5
        }
        fn zone_length(&self) -> f64 {
            0.03
        }
        fn length(&self, _: f64, _: f64) -> f64 {
            42.0
        }
    }
    let boxed: Box<dyn GrowthLaw> = Box::new(Known);
    let lengths = [&Known as &dyn GrowthLaw, &boxed, &&boxed].map(|law| law.length(0.03, HOUR));
    assert_eq!(lengths, [42.0; 3]);
}
