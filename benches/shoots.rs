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
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::{ShootParameters, Still};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;

/// Simulates the growing shoot of video 2, with all laws. Returns the tip, so that the compiler
/// cannot remove the computation.
fn growing_shoot(hours: f64, elements: usize, step: f64) -> Vector3<f64> {
    let builder = ShootParameters::default().shoot().elements(elements);
    let mut shoot = builder.build().expect("valid parameters");
    MethodOfSteps::new(step)
        .advance(&mut shoot, hours * HOUR)
        .expect("a stable shoot");
    shoot.tip()
}

/// Simulates the righting of a horizontal shoot of constant length.
fn righting(hours: f64, elements: usize, step: f64) -> Vector3<f64> {
    let parameters = ShootParameters {
        length: 0.05,
        growth_time: 20.0 * HOUR,
        ..ShootParameters::default()
    };
    let mut shoot = parameters
        .reduced()
        .elements(elements)
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
