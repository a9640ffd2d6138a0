//! Run time of the equilibrium of a rod with a horizontal base, from two initial guesses.
//!
//! Command: `cargo bench --workspace --bench statics`. The initial guesses are the straight shape
//! and the equilibrium for a slightly smaller load. The error of the tip, relative to the length,
//! is 1.2e-9 with four elements of order eight, and 4.4e-12 with eight;
//! `tests/statics/horizontal_base.rs` asserts both.

#![allow(
    missing_docs,
    reason = "the macros of criterion make undocumented items"
)]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::load::Weight;
use morphorod::rod::Rod;
use morphorod::{Order, Scene, Still};

fn statics(c: &mut Criterion) {
    let scene = Still::tilted(FRAC_PI_2);
    let environment = scene.environment(0.0);
    let young = LinearElastic {
        youngs_modulus: 1e7,
        poissons_ratio: 0.5,
    };
    let mut group = c.benchmark_group("horizontal base");
    for elements in [4, 5, 8, 16] {
        let straight = Rod::uniform(0.0659, 5e-4, scene.base, elements, Order::Eight)
            .expect("valid parameters");
        let mut solver = NewtonSolver::default();
        group.bench_function(
            format!("from the straight shape, {elements} elements"),
            |b| {
                b.iter(|| {
                    let mut rod = straight.clone();
                    let found = solver.solve(
                        &mut rod,
                        &young,
                        &Weight {
                            density: black_box(1000.0),
                        },
                        &environment,
                    );
                    (found, rod)
                });
            },
        );
        let mut bent = straight.clone();
        let _ = solver
            .solve(&mut bent, &young, &Weight { density: 1000.0 }, &environment)
            .expect("an equilibrium");
        group.bench_function(
            format!("from a similar equilibrium, {elements} elements"),
            |b| {
                b.iter(|| {
                    let mut rod = bent.clone();
                    let found = solver.solve(
                        &mut rod,
                        &young,
                        &Weight {
                            density: black_box(1001.0),
                        },
                        &environment,
                    );
                    (found, rod)
                });
            },
        );
    }
    group.finish();
}

criterion_group!(benches, statics);
criterion_main!(benches);
