//! Run time of complete simulations: the growing shoot of the paper's video 2, and the righting of
//! a horizontal shoot.
//!
//! Command: `cargo bench --workspace --bench shoots`. Tests of the same scenes in `tests/` assert
//! the errors.

#![allow(
    missing_docs,
    reason = "the macros of criterion make undocumented items"
)]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use morphorod::constitutive::{Lignifying, LinearElastic};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Statoliths,
};
use morphorod::{Shoot, Still};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;
const YOUNG: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};
const MEMORY: Memory = Memory {
    time: 720.0,
    delay: 720.0,
};
const PROPRIOCEPTION: Proprioception = Proprioception { sensitivity: 20.0 };

/// Simulates the growing shoot of video 2, with all laws. Returns the tip, so that the compiler
/// cannot remove the computation.
fn growing_shoot(hours: f64, elements: usize, step: f64) -> Vector3<f64> {
    let statoliths = Statoliths {
        avalanche_time: 120.0,
    };
    let mut shoot = Shoot::builder(Lignifying {
        young: YOUNG,
        mature_modulus: 2e9,
        time: 6.0 * 24.0 * HOUR,
    })
    .length(0.068)
    .radius(5e-4)
    .elements(elements)
    .growth(UniformGrowth {
        zone_length: 0.07,
        time: 40.0 * HOUR,
    })
    .tropism((
        Oscillator::new(0.2, 1440.0),
        Gravitropism {
            sensitivity: 0.8,
            perception: statoliths,
        }
        .remembered(MEMORY),
        PROPRIOCEPTION.remembered(MEMORY),
    ))
    .load(Weight { density: 1000.0 })
    .build()
    .expect("valid parameters");
    MethodOfSteps::new(step)
        .advance(&mut shoot, hours * HOUR)
        .expect("a stable shoot");
    shoot.tip()
}

/// Simulates the righting of a horizontal shoot of constant length.
fn righting(hours: f64, elements: usize, step: f64) -> Vector3<f64> {
    let mut shoot = Shoot::builder(YOUNG)
        .length(0.05)
        .radius(5e-4)
        .elements(elements)
        .growth(Ongoing(UniformGrowth {
            zone_length: 0.07,
            time: 20.0 * HOUR,
        }))
        .tropism((
            Gravitropism {
                sensitivity: 0.8,
                perception: SettledStatoliths,
            }
            .remembered(MEMORY),
            PROPRIOCEPTION.remembered(MEMORY),
        ))
        .load(Weight { density: 1000.0 })
        .scene(Still::tilted(FRAC_PI_2))
        .build()
        .expect("valid parameters");
    MethodOfSteps::new(step)
        .advance(&mut shoot, hours * HOUR)
        .expect("a stable shoot");
    shoot.tip()
}

fn shoots(c: &mut Criterion) {
    let mut group = c.benchmark_group("shoots");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(4));
    for (elements, step) in [(4, 180.0), (5, 144.0), (8, 144.0), (8, 90.0)] {
        group.bench_function(
            format!("growing shoot, 40 h, {elements} elements, {step} s"),
            |b| {
                b.iter(|| growing_shoot(black_box(40.0), elements, step));
            },
        );
    }
    group.bench_function("righting, 24 h, 8 elements, 180 s", |b| {
        b.iter(|| righting(black_box(24.0), 8, 180.0))
    });
    group.finish();
}

criterion_group!(benches, shoots);
criterion_main!(benches);
