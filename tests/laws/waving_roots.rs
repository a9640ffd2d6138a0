//! Roots that wave because of a delayed response to gravity, compared with closed forms. In a zone
//! of constant length the angle of the tip obeys θ̇ = −k M[sin θ]. In a growing zone (θ − θ0)/τg is
//! added, with the angle θ0 at its end. M is the memory, with the delay τ and the memory time τm.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::PeriodicSolver;
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, onset};
use morphorod::tropism::{AtApex, Gravitropism, Memory, Response, SettledStatoliths};
use morphorod::{DynLaws, Order, Shoot, Still};
use nalgebra::{Complex, Vector3};

use crate::fixtures::secant::zero_near;
use crate::fixtures::shoots::{HOUR, YOUNG};

/// Length of the growth zone, m.
const ZONE: f64 = 1e-3;
/// Radius, m.
const RADIUS: f64 = 0.07e-3;
/// Delay τ, s.
const DELAY: f64 = HOUR;
/// Growth time τg, s.
const GROWTH: f64 = 4.0 * HOUR;

/// Root with the gain kτ, a memory time (s), and a base that points down or leans by an angle
/// (rad). Its perception is at the apex, hence the curvature is uniform and one Gauss point
/// describes it.
fn root(gain: f64, memory: f64, grows: bool, lean: f64) -> Shoot<DynLaws> {
    let sensitivity = -gain / DELAY * RADIUS * GROWTH / ZONE;
    let law = Gravitropism {
        sensitivity,
        perception: AtApex(SettledStatoliths),
    };
    let zone = UniformGrowth {
        zone_length: ZONE,
        time: GROWTH,
    };
    let builder = Shoot::builder(YOUNG)
        .length(ZONE)
        .radius(RADIUS)
        .elements(1)
        .order(Order::Two);
    let builder = builder
        .tropism(law.remembered(Memory {
            time: memory,
            delay: DELAY,
        }))
        .scene(Still::tilted(PI - lean));
    if grows {
        builder.growth(zone).into_dyn().build()
    } else {
        builder.growth(Ongoing(zone)).into_dyn().build()
    }
    .unwrap()
}

/// Zero of an increasing function between two values.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// Angle of the apex from the downward direction, rad.
fn angle(shoot: &Shoot<DynLaws>) -> f64 {
    let tangent = shoot.rod().apex_frame() * Vector3::z();
    tangent.x.atan2(-tangent.z)
}

#[test]
fn waves_begin_at_the_gain_and_with_the_period_of_the_delay_equation() {
    for ratio in [1e-3, 0.1, 0.5, 1.0, 3.0] {
        // λ (1 + λτm) + k exp(−λτ) = 0 with λ = iω and x = ωτ.
        let x = bisect(1e-6, FRAC_PI_2, |x| x + (x * ratio).atan() - FRAC_PI_2);
        let family = |gain: f64| Linearisation::about(&root(gain, ratio * DELAY, false, 0.0));
        let found = onset(family, 0.5, 2.0).unwrap();
        // The matrix contains differences with a relative error of 1e-9.
        assert_relative_eq!(
            found.parameters[0],
            x * (x * ratio).hypot(1.0),
            max_relative = 1e-8
        );
        assert_relative_eq!(found.period() / DELAY, TAU / x, max_relative = 1e-8);
    }
}

#[test]
fn waves_without_memory_have_a_period_of_four_delays_at_any_amplitude() {
    // A short memory time acts as an additional delay, with a relative error of the square of its
    // ratio to the delay.
    let memory = 1e-4 * DELAY;
    for amplitude in [0.3_f64, 0.8, 1.4] {
        // kτ is the complete elliptic integral K with the complementary modulus cos²(A/2) (Kaplan
        // and Yorke 1974), here by the arithmetic-geometric mean.
        let (mut a, mut b) = (1.0, (0.5 * amplitude).cos().powi(2));
        for _ in 0..20 {
            (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
        }
        let gain = FRAC_PI_2 / a / (1.0 + memory / DELAY);
        let shoot = root(gain, memory, false, 0.0);
        let mode = Linearisation::about(&shoot).unwrap().rightmost().unwrap();
        let excursion = ZONE * (1.0 - amplitude.cos()) / amplitude;
        let solver = PeriodicSolver {
            accuracy: 1e-8,
            ..PeriodicSolver::default()
        };
        let orbit = solver.from_mode(&shoot, &mode, excursion).unwrap();
        let (_, rod) = orbit.largest_excursion(&shoot).unwrap();
        let found = (rod.apex_frame() * Vector3::z()).angle(&-Vector3::z());
        // Grid in time 1e-8, memory 1e-8. Near the onset the amplitude amplifies errors of the gain
        // by 1/A².
        assert_relative_eq!(orbit.period / (DELAY + memory), 4.0, max_relative = 1e-7);
        assert_abs_diff_eq!(found, amplitude, epsilon = 1e-6);
    }
}

#[test]
fn growing_root_waves_with_the_root_of_its_characteristic_equation() {
    // λ² (1 + λτm) + k (λ + 1/τg) exp(−λτ) = 0, in units of the delay. The memory time is 0.1.
    let (memory, rate) = (0.1, DELAY / GROWTH);
    let x = bisect(1e-6, FRAC_PI_2, |x| {
        x + (x * memory).atan() - (x / rate).atan()
    });
    let onset = x * x * (x * memory).hypot(1.0) / x.hypot(rate);
    for gain in [0.8 * onset, onset, 1.05 * onset] {
        let residual =
            |l: Complex<f64>| l * l * (l * memory + 1.0) + (l + rate) * gain * (-l).exp();
        let lambda = zero_near(residual, Complex::new(0.0, x));
        assert!(residual(lambda).norm() < 1e-12, "{lambda}");
        // The angle oscillates about zero; the amplitude is so small that sin θ = θ to 1e-9.
        let mut shoot = root(gain, memory * DELAY, true, 3e-5);
        let step = DELAY / 40.0;
        let mut run = MethodOfSteps::with_solver(step, Unloaded);
        let mut angles = Vec::new();
        for k in 0..=60 {
            // A real root close to −0.3 has decayed after 80 delays.
            run.advance(&mut shoot, 80.0 * DELAY + 4.0 * step * f64::from(k))
                .unwrap();
            angles.push(angle(&shoot));
        }
        // θ(t + h) + e^{2 Re λ h} θ(t − h) = 2 e^{Re λ h} cos(Im λ h) θ(t).
        let size = angles
            .iter()
            .fold(0.0_f64, |size, angle| size.max(angle.abs()));
        let factor = (lambda * 0.1).exp();
        let worst = angles.windows(3).map(|three| {
            (three[2] + factor.norm_sqr() * three[0] - 2.0 * factor.re * three[1]).abs() / size
        });
        assert_abs_diff_eq!(worst.fold(0.0, f64::max), 0.0, epsilon = 1e-6);
    }
}
