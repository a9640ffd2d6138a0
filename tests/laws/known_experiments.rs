//! Experiments on gravitropism with closed forms: tilted shoots, clinostats, centrifuges, and
//! overshoot.

use std::f64::consts::{FRAC_PI_2, TAU};

use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::equilibrium::Unloaded;
use morphorod::integrator::{ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::stability::solve_steady_state;
use morphorod::tropism::{AtApex, Memory, SettledStatoliths, TropismLaw};
use morphorod::{DynLaws, Scene, Shoot, Still};
use nalgebra::{Complex, UnitQuaternion, Vector3};

use crate::fixtures::shoots::{
    BETA, ETA, HOUR, MEMORY, RADIUS, STATOLITHS, WEIGHT, gravitropism, reduced, remembering,
};

/// Growth time τg, s.
const GROWTH: f64 = 20.0 * HOUR;

/// Shoot of constant length (m) without weight.
fn shoot(
    length: f64,
    law: impl TropismLaw + Send + Sync + 'static,
    scene: impl Scene + Send + Sync + 'static,
) -> Shoot<DynLaws> {
    reduced(length, GROWTH)
        .elements(8)
        .tropism(law)
        .load(())
        .scene(scene)
        .into_dyn()
        .build()
        .unwrap()
}

/// Tangent at a place, as the angle from the vertical and the azimuth, rad.
fn direction(shoot: &Shoot<DynLaws>, s: f64) -> [f64; 2] {
    let tangent = shoot.rod().at(s).unwrap().1 * Vector3::z();
    [
        tangent.x.hypot(tangent.y).atan2(tangent.z),
        tangent.y.atan2(tangent.x),
    ]
}

#[test]
fn steady_tilt_decays_along_the_shoot_at_any_tilt_of_the_base_and_with_any_weight() {
    // tan(θ/2) = tan(θ0/2) exp(−s/Lc), Lc = ηr/β (Bastien and others 2013).
    for tilt in [0.4, FRAC_PI_2, 2.6, 3.1] {
        for load in [0.0, 1.0] {
            let length = 0.04;
            let builder = reduced(length, GROWTH).elements(8).load(Weight {
                density: load * WEIGHT.density,
            });
            let mut shoot = builder
                .scene(Still::tilted(tilt))
                .into_dyn()
                .build()
                .unwrap();
            solve_steady_state(&mut shoot).unwrap();
            for s in [0.01, 0.02, 0.04] {
                let expected =
                    2.0 * ((0.5 * tilt).tan() * (-s * BETA / (ETA * RADIUS)).exp()).atan();
                // Eight elements of order eight. The shape between nodes is a polynomial.
                assert_abs_diff_eq!(direction(&shoot, s)[0], expected, epsilon = 1e-8);
            }
        }
    }
}

/// Base that is tilted and rotates about its own tangent.
struct Clinostat {
    /// Angle from the vertical, rad.
    tilt: f64,
    /// Rate of rotation, rad/s, counterclockwise as seen against the tangent.
    rate: f64,
}

impl Scene for Clinostat {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Vector3::z() * -9.81
    }

    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        Still::tilted(self.tilt).base
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.rate * t)
    }
}

/// The tissue rotates about the tangent of a shape that is fixed in space. In complex notation, i
/// is the rotation about the tangent by a right angle. The curvature U obeys −iΩU = M̂ (kη T −
/// ηU)/τg with T = t × e3, M̂ = exp(iΩτr)/(1 − iΩτm) and k = β/(ηr). Hence U = kcT, c = 1/(1 −
/// iΩτg/(ηM̂)): the angle from the vertical obeys θ' = −k Re(c) sin θ, the azimuth φ' = −k Im(c).
/// Oliveri and others (2024), Phys. Rev. E 110:014405, study these equilibria.
#[test]
fn shoot_on_a_clinostat_has_the_shape_of_the_closed_form() {
    let short = Memory {
        time: 0.1,
        delay: 0.0,
    };
    let cases = [
        (FRAC_PI_2, 1.0, short),
        (FRAC_PI_2, -3.0, short),
        (2.2, 8.0, short),
        (1.0, 2.0, MEMORY),
    ];
    for (tilt, turns, memory) in cases {
        // Rotation by `turns` rad in the time τg/η of proprioception.
        let rate = turns * ETA / GROWTH;
        let law = remembering(memory, memory).steering(SettledStatoliths);
        let mut shoot = shoot(0.04, law, Clinostat { tilt, rate });
        // The transient decays as exp(−ηt/τg), with powers of t.
        MethodOfSteps::with_solver(TAU / rate.abs() / 120.0, Unloaded)
            .advance(&mut shoot, 40.0 * GROWTH / ETA)
            .unwrap();
        let lag =
            Complex::new(0.0, rate * memory.delay).exp() / Complex::new(1.0, -rate * memory.time);
        let share = (Complex::new(1.0, 0.0) - Complex::new(0.0, turns) / lag).inv();
        for s in [0.013, 0.027, 0.04] {
            let k = share * (s * BETA / (ETA * RADIUS));
            let angle = 2.0 * ((0.5 * tilt).tan() * (-k.re).exp()).atan();
            let [found, azimuth] = direction(&shoot, s);
            assert_abs_diff_eq!(found, angle, epsilon = 1e-6);
            assert_abs_diff_eq!(azimuth, -k.im, epsilon = 1e-6);
        }
    }
}

/// The response reads a past in which the shoot was straight, up to twice the delay. The rotation
/// of the apex is then exactly (βℓ/(r τg)) sin θ0 (τr − τm (1 − exp(−τr/τm))): the sine law,
/// without the magnitude of gravity (Chauvet and others 2016, Sci. Rep. 6:35431).
#[test]
fn rate_of_bending_obeys_the_sine_law_at_any_magnitude_of_gravity() {
    let length = 0.03;
    let span = MEMORY.delay - MEMORY.time * (1.0 - (-MEMORY.delay / MEMORY.time).exp());
    for level in [0.01, 0.1, 1.0, 3.0, 100.0] {
        for tilt in [0.3, 1.0, FRAC_PI_2, 2.5] {
            let scene = Still {
                gravity: Vector3::z() * (-9.81 * level),
                ..Still::tilted(tilt)
            };
            let expected = BETA * length / (RADIUS * GROWTH) * tilt.sin() * span;
            let at_apex = gravitropism(AtApex(STATOLITHS));
            for mut shoot in [
                shoot(length, gravitropism(SettledStatoliths), scene),
                shoot(length, at_apex, scene),
            ] {
                MethodOfSteps::with_solver(36.0, Unloaded)
                    .advance(&mut shoot, 2.0 * MEMORY.delay)
                    .unwrap();
                // The memory is integrated in closed form, the rest with an error of order four,
                // 2e-8 here.
                assert_relative_eq!(
                    tilt - direction(&shoot, length)[0],
                    expected,
                    max_relative = 1e-6
                );
            }
        }
    }
}

/// Angle of the apex over that of the base after the time T τg/η, in the linear theory without
/// delay: the inverse Laplace transform of exp(−B/(λ + 1))/λ is 1 − Σ (−1)^m B^(m+1)/(m + 1)! P(m +
/// 1, T), with the regularised incomplete gamma function P.
fn linear_angle(b: f64, t: f64) -> f64 {
    let (mut angle, mut power) = (1.0, b);
    let (mut term, mut sum) = ((-t).exp(), (-t).exp());
    for m in 0..60 {
        angle -= power * (1.0 - sum) * if m % 2 == 0 { 1.0 } else { -1.0 };
        power *= b / f64::from(m + 2);
        term *= t / f64::from(m + 1);
        sum += term;
    }
    angle
}

#[test]
fn apex_passes_the_vertical_beyond_a_balance_number_of_2_796() {
    // The first minimum is at the first zero of the Bessel function J1, 2 √(BT) = 3.8317.
    let lowest = |b: f64| 3.831_705_970_207_512_f64.powi(2) / (4.0 * b);
    // Published as 2.8 (Bastien and others 2013, PNAS 110:755–760).
    assert!(linear_angle(2.796, lowest(2.796)) > 0.0 && linear_angle(2.797, lowest(2.797)) < 0.0);
    for b in [1.0, 2.796_479_559_688, 6.0] {
        // 3e-8 of the time τg/η of proprioception.
        let memory = Memory {
            time: 1e-4,
            delay: 0.0,
        };
        let length = b * ETA * RADIUS / BETA;
        // sin θ = θ to 2e-7. Without delay a step is iterated to an absolute tolerance, so that
        // smaller tilts have larger relative errors.
        let tilt = 1e-3;
        let law = remembering(memory, memory).steering(SettledStatoliths);
        let mut shoot = shoot(length, law, Still::tilted(tilt));
        let mut run = MethodOfSteps::with_solver(0.005 * GROWTH / ETA, Unloaded);
        // The memories begin at the stimuli, since a step does not resolve their time.
        run.start(&mut shoot, &ConstantHistory::Steady).unwrap();
        for time in [0.3, lowest(b), 4.0] {
            if time * GROWTH / ETA < shoot.time() {
                continue;
            }
            run.advance(&mut shoot, time * GROWTH / ETA).unwrap();
            let tangent = shoot.rod().apex_frame() * Vector3::z();
            let expected = linear_angle(b, time);
            assert_abs_diff_eq!(tangent.x.atan2(tangent.z) / tilt, expected, epsilon = 1e-6);
        }
    }
}
