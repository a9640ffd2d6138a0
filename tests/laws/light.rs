//! Light: sources, the angle that photo- and gravitropism set, pulses, and perception at the apex.

use std::f64::consts::PI;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{BETA, HOUR, MINUTE, RADIUS, YOUNG, reduced, rod};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::equilibrium::Unloaded;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{
    AtApex, During, Gravitropism, Light, LightSource, LineLight, Memory, ParallelLight,
    Phototropism, PointLight, Proprioception, Response, SettledStatoliths, TropismLaw,
};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Growth time, s.
const GROWTH_TIME: f64 = 20.0 * HOUR;
const MEMORY: Memory = Memory {
    time: 10.0 * MINUTE,
    delay: 5.0 * MINUTE,
};

/// Shoot of constant length (m) without weight.
fn shoot(
    (length, elements): (f64, usize),
    base: UnitQuaternion<f64>,
    laws: impl TropismLaw + Send + Sync + 'static,
) -> Shoot<DynLaws> {
    reduced(length, GROWTH_TIME)
        .elements(elements)
        .tropism(laws)
        .load(())
        .scene(Still {
            base,
            ..Still::upright()
        })
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn photo_and_gravitropism_set_the_angle_of_their_sum() {
    let eta = 4.0;
    for (ratio, degrees) in [(0.3, 90.0), (1.0, 60.0), (1.5, 120.0), (3.0, 150.0)] {
        // The light is in a vertical plane at 35° to that of the tilt.
        let (angle, azimuth) = (f64::to_radians(degrees), f64::to_radians(35.0));
        let horizontal = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let light = ParallelLight((horizontal * angle.sin() + Vector3::z() * angle.cos()) * 2.0);
        let perceived = Light {
            source: light,
            strength: |irradiance: f64| irradiance / 2.0,
        };
        let law = (
            Gravitropism {
                sensitivity: BETA,
                perception: SettledStatoliths,
            }
            .remembered(MEMORY),
            Phototropism {
                sensitivity: ratio * BETA,
                perception: perceived,
            }
            .remembered(MEMORY),
            Proprioception { sensitivity: eta }.remembered(MEMORY),
        );
        let base = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.4);
        let length = 0.04;
        let mut shoot = shoot((length, 40), base, law);
        // The slowest relaxation, by proprioception, is exp(−η t/τg), to 1e-17.
        MethodOfSteps::with_solver(600.0, Unloaded)
            .advance(&mut shoot, 200.0 * HOUR)
            .unwrap();
        let target = Vector3::z() + light.0 * (ratio / 2.0);
        // Bastien, Douady and Moulia (2015). The apex is within exp(−|target| β ℓ/(η r)) < 1e-6 of
        // the angle for the sum of at least 0.95.
        let tangent = shoot.rod().apex_frame() * Vector3::z();
        let set = (ratio * angle.sin()).atan2(1.0 + ratio * angle.cos());
        assert_abs_diff_eq!(
            tangent.dot(&horizontal).atan2(tangent.z),
            set,
            epsilon = 1e-6
        );
        assert_abs_diff_eq!(
            tangent.dot(&Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0)),
            0.0,
            epsilon = 1e-6
        );
        // All along the shoot the angle θ to the sum obeys tan(θ/2) = tan(θ0/2) exp(−ks).
        let k = BETA * target.norm() / (eta * RADIUS);
        let tilt = |frame: UnitQuaternion<f64>| (0.5 * (frame * Vector3::z()).angle(&target)).tan();
        for place in shoot.profile().sample(10) {
            let expected = tilt(base) * (-k * place.arc_length).exp();
            // Elements of order eight and of a length of 1.3/k at most.
            assert_abs_diff_eq!(tilt(place.frame), expected, epsilon = 1e-6);
        }
    }
}

/// Angle of the tip (rad) at a time (s) of an upright shoot that bends towards light from the side
/// of e1.
fn bent(
    source: impl LightSource + Send + Sync + 'static,
    strength: impl Fn(f64) -> f64 + Send + Sync + 'static,
    t: f64,
) -> f64 {
    let law = Phototropism {
        sensitivity: 1.0,
        perception: Light { source, strength },
    }
    .remembered(MEMORY);
    let mut shoot = shoot((0.03, 1), UnitQuaternion::identity(), law);
    MethodOfSteps::with_solver(50.0, Unloaded)
        .advance(&mut shoot, t)
        .unwrap();
    let tangent = shoot.rod().apex_frame() * Vector3::z();
    tangent.x.atan2(tangent.z)
}

/// A pulse of light of an irradiance (W/m²), from a time (s) on, of a duration (s).
fn pulse(irradiance: f64, from: f64, duration: f64) -> During<ParallelLight> {
    During {
        source: ParallelLight(Vector3::x() * irradiance),
        from,
        until: from + duration,
    }
}

/// Strength of the stimulus for an irradiance of 1 W/m²: small, so that the shoot bends by 1e-6
/// rad, and the direction of the light relative to the tissue does not change.
const WEAK: f64 = 1e-5;

#[test]
fn response_to_a_pulse_of_light_has_its_closed_form() {
    let (from, duration) = (400.0, 777.0);
    for t in [500.0, 900.0, 1600.0, 3000.0, 9000.0] {
        // τm ẏ = x − y gives ∫ y = T − τm exp(−(t − T)/τm) + τm exp(−t/τm), with t from the start
        // of the pulse on.
        let since = t - MEMORY.delay - from;
        let integral = |t: f64| {
            if t > 0.0 {
                t + MEMORY.time * (-t / MEMORY.time).exp_m1()
            } else {
                0.0
            }
        };
        let dose = integral(since) - integral(since - duration);
        let expected = 0.03 / (RADIUS * GROWTH_TIME) * 3.0 * WEAK * dose;
        // Cubics in steps of a twelfth of the memory time have an error of (1/12)⁴/384.
        let largest = 0.03 / (RADIUS * GROWTH_TIME) * 3.0 * WEAK * duration;
        let found = bent(
            pulse(3.0, from, duration),
            |irradiance| WEAK * irradiance,
            t,
        );
        assert_abs_diff_eq!(found, expected, epsilon = 1e-6 * largest);
    }
}

#[test]
fn pulses_of_equal_dose_bend_a_shoot_equally_unless_the_strength_saturates() {
    let late = 5.0 * HOUR;
    let pulses = [(1.0, 600.0), (4.0, 150.0), (0.125, 4800.0)];
    for (irradiance, duration) in pulses {
        // The memory has decayed to exp(−20), and the angle is φ ℓ f(I) T/(r τg).
        let expected = |strength: f64| 0.03 / (RADIUS * GROWTH_TIME) * strength * duration;
        let linear = bent(
            pulse(irradiance, 0.0, duration),
            |irradiance| WEAK * irradiance,
            late,
        );
        assert_relative_eq!(
            linear,
            expected(WEAK * irradiance),
            epsilon = 0.0,
            max_relative = 1e-6
        );
        assert_relative_eq!(
            linear,
            expected(WEAK * 600.0 / duration),
            epsilon = 0.0,
            max_relative = 1e-6
        );
        let saturating = |irradiance: f64| WEAK * irradiance / (1.0 + irradiance);
        let found = bent(pulse(irradiance, 0.0, duration), saturating, late);
        assert_relative_eq!(
            found,
            expected(saturating(irradiance)),
            epsilon = 0.0,
            max_relative = 1e-6
        );
    }
}

#[test]
fn light_of_points_and_lines_has_its_closed_forms() {
    let (at, place) = (Vector3::new(0.3, -0.2, 0.9), Vector3::new(-0.1, 0.1, 0.2));
    let point = PointLight {
        position: at,
        power: 5.0,
    };
    let towards = at - place;
    let expected = towards.normalize() * (5.0 / (4.0 * PI * towards.norm_squared()));
    assert_abs_diff_eq!(
        InNorm(point.light(0.0, &place)),
        InNorm(expected),
        epsilon = 1e-15
    );
    // A long line: P'/(2π d), at a right angle to it. The ends at 1e4 times the distance contribute
    // 1e-8.
    let line = LineLight {
        ends: [at - Vector3::y() * 1e4, at + Vector3::y() * 1e4],
        power: 3.0 * 2e4,
    };
    let across = Vector3::new(towards.x, 0.0, towards.z);
    let expected = across / across.norm_squared() * (3.0 / (2.0 * PI));
    assert_abs_diff_eq!(
        InNorm(line.light(0.0, &place)),
        InNorm(expected),
        epsilon = 1e-7
    );
    // A short line: the sum of its points, by the midpoint rule with an error of 1e-7.
    let line = LineLight {
        ends: [at, at + Vector3::new(0.5, 0.3, -0.4)],
        power: 5.0,
    };
    let parts = 2000;
    let part = |i: usize| {
        let position = line.ends[0].lerp(&line.ends[1], (i as f64 + 0.5) / f64::from(parts));
        PointLight {
            position,
            power: 5.0 / f64::from(parts),
        }
        .light(0.0, &place)
    };
    let sum: Vector3<f64> = (0..parts as usize).map(part).sum();
    assert_abs_diff_eq!(
        InNorm(line.light(0.0, &place)),
        InNorm(sum),
        epsilon = 1e-6 * sum.norm()
    );
}

#[test]
fn moving_light_bends_the_shoot_by_the_mean_of_its_directions() {
    // Light from the horizon that turns once in 40 min. The memory filters it by 1/(1 − iωτ), and
    // the tip follows a circle, which the integral of the direction describes.
    let period = 40.0 * MINUTE;
    let source = move |t: f64, _: &Vector3<f64>| {
        let (sin, cos) = (2.0 * PI * t / period).sin_cos();
        Vector3::new(cos, sin, 0.0)
    };
    let late = 10.0 * HOUR;
    let angle = |t: f64| bent(source, |irradiance| WEAK * irradiance, t);
    let (first, half) = (angle(late), angle(late + 0.5 * period));
    // The component along e1 of the angle is φ ℓ/(r τg) ∫ Re [exp(iω(t − τr))/(1 + iωτm)] dt.
    let rate = nalgebra::Complex::new(0.0, 2.0 * PI / period);
    let response = |t: f64| (rate * (t - MEMORY.delay)).exp() / (rate * (rate * MEMORY.time + 1.0));
    let expected =
        0.03 / (RADIUS * GROWTH_TIME) * WEAK * (response(late) - response(late + 0.5 * period)).re;
    // Cubics through stimuli at 1/48 of the period have an error of (2π/48)⁴ 3/128.
    assert_relative_eq!(first - half, expected, epsilon = 0.0, max_relative = 1e-4);
}

#[test]
fn apex_that_perceives_for_all_points_bends_the_shoot_to_an_arc() {
    // All points receive the same signal, so that the curvature is uniform. It is steady if the
    // apex is upright.
    let perception = AtApex(SettledStatoliths);
    let law = Gravitropism {
        sensitivity: BETA,
        perception,
    }
    .remembered(MEMORY);
    let (length, tilt) = (0.03, 1.0);
    let mut shoot = shoot((length, 3), Still::tilted(tilt).base, law);
    MethodOfSteps::new(150.0)
        .advance(&mut shoot, 100.0 * HOUR)
        .unwrap();
    // The arc of radius ℓ/tilt ends in the vertical.
    let radius = length / tilt;
    let tip = Vector3::new(radius * (1.0 - tilt.cos()), 0.0, radius * tilt.sin());
    // The signal decays as exp(−β ℓ t/(r τg)), to 1e-80.
    let found = Vector3::new(shoot.tip().x.abs(), shoot.tip().y, shoot.tip().z);
    assert_abs_diff_eq!(InNorm(found), InNorm(tip), epsilon = 1e-10);
    // The light of a lamp is that at the tip.
    let lamp = PointLight {
        position: Vector3::new(0.2, 0.0, 0.1),
        power: 1.0,
    };
    let light = Light {
        source: lamp,
        strength: |_: f64| 1.0,
    };
    let law = Phototropism {
        sensitivity: BETA,
        perception: AtApex(light),
    }
    .remembered(MEMORY);
    let mut shoot = self::shoot((length, 3), UnitQuaternion::identity(), law);
    MethodOfSteps::new(150.0)
        .advance(&mut shoot, 100.0 * HOUR)
        .unwrap();
    let tangent = shoot.rod().apex_frame() * Vector3::z();
    assert_abs_diff_eq!(
        tangent.angle(&(lamp.position - shoot.tip())),
        0.0,
        epsilon = 1e-7
    );
}

#[test]
fn light_out_of_range_is_refused() {
    let refused =
        |source: &dyn Fn() -> Result<(), morphorod::ParameterError>| source().unwrap_err().name;
    let position = Vector3::repeat(f64::NAN);
    assert_eq!(
        refused(&|| PointLight {
            position,
            power: 1.0
        }
        .check()),
        "position of a point light"
    );
    assert_eq!(
        refused(&|| pulse(1.0, 10.0, -5.0).check()),
        "time at which a light is switched on"
    );
    let line = LineLight {
        ends: [Vector3::zeros(); 2],
        power: 1.0,
    };
    assert_eq!(refused(&|| line.check()), "length of a line light");
    assert_eq!(
        refused(&|| ParallelLight(position).check()),
        "irradiance of parallel light"
    );
    // A shoot with such a law is not built.
    let light = Light {
        source: line,
        strength: |irradiance: f64| irradiance,
    };
    let law = Phototropism {
        sensitivity: 1.0,
        perception: light,
    }
    .remembered(MEMORY);
    assert!(rod(YOUNG, 0.03).tropism(law).into_dyn().build().is_err());
}
