//! Shoots that grow do not pass through poles that are much thinner than the motion of the shoot in
//! a step.

use std::f64::consts::TAU;

use crate::fixtures::shoots::{WEIGHT, rod, tissue};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder};
use morphorod::tropism::Oscillator;
use morphorod::{Along, DynLaws, Order, Shoot, Still};
use nalgebra::Vector3;

/// An angle between −π and π.
fn wrapped(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

/// The angle by which the direction from a pole to the centre line turns along the shoot, and this
/// direction at the base and at the tip, rad.
fn turns(shoot: &Shoot<DynLaws>, pole: &Cylinder) -> [f64; 3] {
    let axis = pole.along.normalize();
    let first = axis.cross(&Vector3::z()).normalize();
    let second = axis.cross(&first);
    // Neighbouring places are less than a radius of the pole apart.
    let line = shoot.rod().centre_line_at(8001);
    let directions = line
        .iter()
        .map(|place| place - pole.through)
        .map(|way| way.dot(&second).atan2(way.dot(&first)));
    let directions: Vec<f64> = directions.collect();
    let sum = directions
        .windows(2)
        .map(|pair| wrapped(pair[1] - pair[0]))
        .sum();
    [sum, directions[0], directions[directions.len() - 1]]
}

/// Contacts with poles, with the radius of the contact (m) and the coefficient of friction.
fn contacts(poles: &[Cylinder], (radius, friction): (f64, f64)) -> Vec<Contact<Cylinder>> {
    poles
        .iter()
        .map(|pole| Contact {
            obstacle: *pole,
            radius,
            friction,
        })
        .collect()
}

/// Fails if a part of a shoot passes one of the poles in steps of a length (s) until a time (s). In
/// each step the tip moves around a pole by less than 2 rad.
fn assert_on_its_side(mut shoot: Shoot<DynLaws>, poles: &[Cylinder], (step, end): (f64, f64)) {
    let (mut run, mut touching) = (MethodOfSteps::new(step), 0);
    let mut before: Vec<[f64; 3]> = poles.iter().map(|pole| turns(&shoot, pole)).collect();
    while shoot.time() < end {
        let _ = run.step(&mut shoot, end).unwrap();
        touching += usize::from(!shoot.reactions().is_empty());
        for (pole, before) in poles.iter().zip(&mut before) {
            let after = turns(&shoot, pole);
            let [sum, base, tip] = [0, 1, 2].map(|i| after[i] - before[i]);
            assert!(
                wrapped(tip).abs() < 2.0,
                "the tip moves around a pole at {} s",
                shoot.time()
            );
            let passed = sum - wrapped(tip) + wrapped(base);
            assert!(
                passed.abs() < 1.0,
                "the shoot passes a pole at {} s",
                shoot.time()
            );
            *before = after;
        }
    }
    assert!(touching > 5, "{touching}");
}

/// The radius of the pole is 2e-4 of the length. In a step the contact slides along the shoot by
/// many radii.
#[test]
fn nutating_shoot_does_not_pass_a_thin_pole_on_which_it_rubs() {
    let pole = Cylinder {
        through: Vector3::new(0.015766, -0.000495, 0.016564),
        along: Vector3::new(-0.3362, -0.6892, 0.6419),
        radius: 9.44e-6,
    };
    let builder = rod(tissue(4.09e7), 0.04375).order(Order::Eight).elements(3);
    let builder = builder
        .growth(UniformGrowth {
            zone_length: 0.0538,
            time: 5.57e4,
        })
        .load(WEIGHT);
    let builder = builder
        .tropism(Oscillator::new(0.5275, 2623.0))
        .scene(Still::tilted(0.692));
    let shoot = builder
        .support(contacts(&[pole], (4.4e-7, 0.3)))
        .into_dyn()
        .build()
        .unwrap();
    assert_on_its_side(shoot, &[pole], (262.75, 12_600.0));
}

/// The base moves, too, so that contacts are followed from the start of each step.
#[test]
fn nutating_shoot_whose_base_moves_does_not_pass_a_thin_pole() {
    let thin = Cylinder {
        through: Vector3::new(0.036733, 0.0001334, 0.007261),
        along: Vector3::new(0.1713, -0.9842, 0.0448),
        radius: 9.42e-6,
    };
    let thick = Cylinder {
        through: Vector3::new(0.042121, 0.0001328, 0.006271),
        along: Vector3::new(-0.1736, -0.9709, -0.1651),
        radius: 2.993e-4,
    };
    let by = Vector3::new(-1.0654e-3, 7.572e-4, 7.701e-4);
    let path = move |t: f64| by * (4.0225e-4 * t).sin();
    let builder = rod(tissue(2.237e7), 0.049566)
        .order(Order::Four)
        .elements(7);
    let builder = builder
        .growth(UniformGrowth {
            zone_length: 0.0231,
            time: 1.158e5,
        })
        .load(WEIGHT);
    let builder = builder.tropism(Oscillator::new(0.3456, 4044.0));
    let builder = builder.scene(Along {
        scene: Still::tilted(1.33154),
        path,
    });
    let shoot = builder
        .support(contacts(&[thin, thick], (5e-7, 0.0)))
        .into_dyn()
        .build()
        .unwrap();
    assert_on_its_side(shoot, &[thin, thick], (491.9, 5000.0));
}
