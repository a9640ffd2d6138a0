//! A shoot that winds round a pole, as in the example `twining`.

use std::f64::consts::{PI, TAU};

use crate::fixtures::shoots::{HOUR, WEIGHT, YOUNG, rod};
use morphorod::constitutive::Lignifying;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder, Obstacle};
use morphorod::tropism::Oscillator;
use morphorod::{Order, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Radius of the shoot and length of its growth zone, m, and period of its oscillator, s.
const RADIUS: f64 = 0.5e-3;
const ZONE: f64 = 8e-3;
const PERIOD: f64 = 4.0 * HOUR;

#[test]
fn shoot_of_coarse_elements_winds_round_a_pole_in_one_call() {
    // Each element in contact turns by up to 0.7 rad. If the tangent at a contact inside an element
    // is not that of the centre line, the call ends with an error at 15600 s.
    let (curvature, time, pole) = (400.0, ZONE / (6.28e-3 / HOUR), 1.25e-3);
    let torsion = TAU / PERIOD * time / ZONE;
    let phase = PI - TAU / PERIOD * time * 2.5_f64.ln();
    let base = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), f64::atan2(curvature, torsion));
    let obstacle = Cylinder {
        through: Vector3::x() * (pole + RADIUS + 1.5e-3),
        along: Vector3::z(),
        radius: pole,
    };
    let wood = Lignifying {
        young: YOUNG,
        mature_modulus: 3e7,
        time: 12.0 * HOUR,
    };
    let mut shoot = rod(wood, 0.4 * ZONE)
        .growth(UniformGrowth {
            zone_length: ZONE,
            time,
        })
        .tropism(Oscillator {
            phase,
            ..Oscillator::new(curvature * TAU * RADIUS * time / PERIOD, PERIOD)
        })
        .load(WEIGHT)
        .scene(Still {
            base,
            ..Still::upright()
        })
        .support(Contact {
            obstacle,
            radius: RADIUS,
            friction: 0.0,
        })
        .order(Order::Four)
        .elements(4)
        .merge_tolerance(1e-2)
        .build()
        .unwrap();
    // The integral of the oscillator from t = 0 has a constant part, which this curvature removes.
    let strain = Vector3::new(phase.sin(), -phase.cos(), 0.0) * curvature;
    shoot.set_intrinsic(|_| strain);
    let cost = MethodOfSteps {
        retries: 10,
        ..MethodOfSteps::new(600.0)
    }
    .advance(&mut shoot, 9.0 * HOUR)
    .unwrap();
    // 60 steps take 380 iterations.
    assert!(cost.iterations < 600, "{}", cost.iterations);
    let places = |from: f64, to: f64| -> Vec<Vector3<f64>> {
        let at = |i: i32| shoot.rod().at(from + (to - from) * f64::from(i) / 400.0);
        (0..=400).filter_map(|i| Some(at(i)?.0)).collect()
    };
    let length = shoot.rod().length();
    let depth = |place: &Vector3<f64>| RADIUS - obstacle.distance(place, 0.0).value;
    assert!(places(0.0, length).iter().map(depth).fold(0.0, f64::max) < 1e-9 * length);
    // Angle about the axis of the pole from the lowest to the highest contact.
    let contacts: Vec<f64> = shoot
        .reactions()
        .iter()
        .map(|reaction| reaction.arc_length)
        .collect();
    let (low, high) = (
        contacts.iter().copied().fold(length, f64::min),
        contacts.iter().copied().fold(0.0, f64::max),
    );
    let around: Vec<_> = places(low, high)
        .iter()
        .map(|place| (place - obstacle.through).xy())
        .collect();
    let turns = around
        .windows(2)
        .map(|ends| ends[0].perp(&ends[1]).atan2(ends[0].dot(&ends[1])))
        .sum::<f64>()
        / TAU;
    // Steps of 120 and 300 s give 2.94.
    assert!((turns - 2.94).abs() < 0.01, "{turns}");
}
