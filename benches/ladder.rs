//! Run time of a sequence of scenes, from a bare rod to the full shoot and its stability. Each
//! scene adds one mechanism.
//!
//! Command: `cargo bench --workspace --bench ladder`. Each scene has four elements and simulates
//! two hours with time steps of 90 s (86 steps, including the shorter ones at the start).
//! `tests/time/ladder.rs` asserts the numbers of operations and allocated bytes. A second group
//! computes equilibria with 8 to 65,536 elements, whose cost is proportional to this number.

#![allow(
    missing_docs,
    reason = "the macros of criterion make undocumented items"
)]

use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::rod::Rod;
use morphorod::stability::{Linearisation, solve_steady_state};
use morphorod::tropism::SettledStatoliths;
use morphorod::{Laws, Model, Order, Scene, Shoot, ShootBuilder, ShootParameters, Still};

const HOUR: f64 = 3600.0;

/// Rod without weight, growth and tropisms.
fn rod() -> ShootBuilder<Laws<LinearElastic>> {
    let paper = ShootParameters::default();
    Shoot::builder(paper.young())
        .length(paper.length)
        .radius(paper.radius)
        .elements(4)
        .scene(Still::tilted(0.1))
}

fn scenes(c: &mut Criterion) {
    let mut group = c.benchmark_group("ladder, 2 h");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    fn bench_scene<M: Model + Clone>(
        group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
        name: &str,
        builder: ShootBuilder<M>,
    ) {
        let shoot = builder.build().expect("valid parameters");
        let mut integrator = MethodOfSteps::new(90.0);
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut shoot = shoot.clone();
                integrator
                    .advance(&mut shoot, 2.0 * HOUR)
                    .expect("a stable shoot");
                shoot.tip()
            });
        });
    }
    let paper = ShootParameters::default();
    let (gravity, bend) = paper.steering(SettledStatoliths);
    let weighted = || rod().load(paper.weight());
    let growing = || weighted().growth(paper.growth());
    bench_scene(&mut group, "1 rod", rod());
    bench_scene(&mut group, "2 with weight", weighted());
    bench_scene(&mut group, "3 with growth", growing());
    bench_scene(
        &mut group,
        "4 with gravitropism",
        growing().tropism(gravity),
    );
    bench_scene(
        &mut group,
        "5 with proprioception",
        growing().tropism((gravity, bend)),
    );
    bench_scene(
        &mut group,
        "6 with an oscillator",
        growing().tropism((paper.oscillator(), gravity, bend)),
    );
    bench_scene(
        &mut group,
        "7 with statoliths",
        growing().tropism(paper.tropism()),
    );
    bench_scene(
        &mut group,
        "8 with lignification",
        paper.shoot().elements(4).scene(Still::tilted(0.1)),
    );
    let steady = || {
        let mut shoot = paper
            .reduced()
            .elements(4)
            .build()
            .expect("valid parameters");
        solve_steady_state(&mut shoot).expect("a steady state");
        Linearisation::about(&shoot)
            .and_then(|linear| linear.unstable())
            .expect("a resolved number of roots")
    };
    group.bench_function("9 number of unstable roots", |b| b.iter(steady));
    group.finish();
}

fn equilibria(c: &mut Criterion) {
    let scene = Still::tilted(FRAC_PI_2);
    let environment = scene.environment(0.0);
    let paper = ShootParameters::default();
    let mut group = c.benchmark_group("equilibrium, by number of elements");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    for elements in [8_u32, 64, 512, 4096, 65536] {
        let straight = Rod::uniform(0.0659, 5e-4, scene.base, elements as usize, Order::Eight)
            .expect("valid parameters");
        let mut solver = NewtonSolver::default();
        group.throughput(Throughput::Elements(u64::from(elements)));
        group.bench_with_input(
            BenchmarkId::from_parameter(elements),
            &straight,
            |b, straight| {
                b.iter(|| {
                    let mut rod = straight.clone();
                    let found =
                        solver.solve(&mut rod, &paper.young(), &paper.weight(), &environment);
                    (found, rod)
                });
            },
        );
    }
    group.finish();
}

criterion_group!(benches, scenes, equilibria);
criterion_main!(benches);
