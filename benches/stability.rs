//! Run time of a linearisation, of the number of unstable roots, of an onset, and of a stability
//! boundary with 200 points.
//!
//! Command: `cargo bench --workspace --bench stability`. With three elements of order eight, the
//! relative error of the critical length is 1e-8; `tests/stability/onset.rs` asserts it for four.
//! The example `stability_map` computes twelve boundaries and prints its run time.

#![allow(
    missing_docs,
    reason = "the macros of criterion make undocumented items"
)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use morphorod::ShootParameters;
use morphorod::stability::{
    BoundarySettings, Linearisation, StabilityError, boundary, onset, solve_steady_state,
};

/// Linearisation about an upright shoot of given length, m.
fn at_length(length: f64) -> Result<Linearisation, StabilityError> {
    upright(72e3, length, 3)
}

/// Linearisation about an upright shoot of given growth time, s, and length, m.
fn upright(
    growth_time: f64,
    length: f64,
    elements: usize,
) -> Result<Linearisation, StabilityError> {
    let parameters = ShootParameters {
        length,
        growth_time,
        ..ShootParameters::default()
    };
    let mut shoot = parameters.reduced().elements(elements).build()?;
    solve_steady_state(&mut shoot)?;
    Linearisation::about(&shoot)
}

fn stability(c: &mut Criterion) {
    let mut group = c.benchmark_group("stability, 3 elements");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2));
    group.bench_function("linearisation", |b| b.iter(|| at_length(black_box(0.066))));
    let linear = at_length(0.066).expect("a length below the self-buckling length");
    group.bench_function("number of unstable roots", |b| {
        b.iter(|| black_box(&linear).unstable())
    });
    group.bench_function("onset", |b| {
        b.iter(|| onset(at_length, black_box(0.06), 0.07))
    });
    let settings = BoundarySettings {
        start: [72e3, 0.0656],
        frequency: 0.0012,
        direction: [-1.0, 0.0],
        low: [16e3, 0.02],
        high: [72e3, 0.078],
        step: 0.005,
        points: 200,
    };
    group.bench_function("boundary, 200 points, 4 elements", |b| {
        b.iter(|| {
            let family = |growth_time, length| upright(growth_time, length, 4);
            boundary(family, black_box(&settings))
        });
    });
    group.finish();
}

criterion_group!(benches, stability);
criterion_main!(benches);
