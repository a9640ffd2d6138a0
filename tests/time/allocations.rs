//! Time steps after the first ones allocate no memory while elements and sparsity pattern are
//! unchanged.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use crate::fixtures::shoots::{
    ETA, HOUR, MEMORY, STATOLITHS, WEIGHT, YOUNG, growing, reduced, rod, steering,
};
use morphorod::constitutive::Timoshenko;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::tropism::{Memory, Oscillator, Proprioception, Response};
use morphorod::{Model, Shoot};
use nalgebra::Vector3;

/// System allocator that counts the allocations of each thread while the thread requests it.
struct Counting;

thread_local! {
    static COUNT: Cell<Option<usize>> = const { Cell::new(None) };
}

fn count_one() {
    COUNT.with(|count| count.set(count.get().map(|n| n + 1)));
}

// SAFETY: every call is forwarded to the system's allocator with the same arguments; counting
// allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count_one();
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count_one();
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count_one();
        unsafe { System.realloc(at, layout, size) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of allocations during `work`.
fn allocations(work: impl FnOnce()) -> usize {
    COUNT.with(|count| count.set(Some(0)));
    work();
    COUNT.with(|count| count.take()).unwrap_or(0)
}

#[test]
fn counter_counts_allocations() {
    assert_eq!(allocations(|| ()), 0);
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1.0)))), 1);
    assert_eq!(
        allocations(|| drop(std::hint::black_box(vec![1.0; 100]))),
        1
    );
}

/// Allocations in calls that advance a shoot by the given numbers of steps, after its history has
/// reached its full length.
fn in_calls(
    mut shoot: Shoot<impl Model>,
    mut run: impl Integrator,
    step: f64,
    calls: &[u32],
) -> Vec<usize> {
    // The first step is a sixty-fourth of `step`, and the following ones double in length. Then the
    // history fills for one delay.
    let mut until = 2.0 * MEMORY.delay + 4.0 * step;
    run.advance(&mut shoot, until).unwrap();
    for _ in 0..4 {
        until += step;
        run.advance(&mut shoot, until).unwrap();
    }
    let call = |steps: &u32| {
        until += f64::from(*steps) * step;
        allocations(|| {
            assert_eq!(
                run.advance(&mut shoot, until).unwrap().steps,
                *steps as usize
            )
        })
    };
    calls.iter().map(call).collect()
}

#[test]
fn step_of_a_shoot_of_constant_length_allocates_no_memory() {
    let (gravitropism, _) = steering(STATOLITHS);
    let push = ApicalForce(|t: f64| Vector3::new(1e-6 * (t / 500.0).sin(), 0.0, 0.0));
    let shoot = |delay: f64| {
        let memory = Memory { delay, ..MEMORY };
        let bend = Proprioception { sensitivity: ETA }.remembered(memory);
        let laws = (Oscillator::new(0.2, 1440.0), gravitropism, bend);
        reduced(0.0659, 20.0 * HOUR)
            .tropism(laws)
            .load((WEIGHT, push))
            .build()
            .unwrap()
    };
    let calls = [1, 1, 2, 5, 20, 100, 1];
    for step in [90.0, 100.0, 720.0] {
        // Steps are explicit with the first delay, and implicit without a delay.
        for delay in [MEMORY.delay, 0.0] {
            let found = in_calls(shoot(delay), MethodOfSteps::new(step), step, &calls);
            assert_eq!(
                found, [0; 7],
                "delay {delay} s, step {step} s: allocations in calls of {calls:?} steps"
            );
        }
    }
}

#[test]
fn step_of_a_shoot_that_shears_and_stretches_allocates_no_memory() {
    let shoot = rod(Timoshenko::circular(YOUNG), 0.0659);
    let growth = Ongoing(UniformGrowth {
        zone_length: 0.07,
        time: 20.0 * HOUR,
    });
    let shoot = shoot
        .growth(growth)
        .tropism(steering(STATOLITHS))
        .load(WEIGHT)
        .build()
        .unwrap();
    let found = in_calls(shoot, MethodOfSteps::new(100.0), 100.0, &[1, 5, 20]);
    assert_eq!(found, [0; 3], "allocations in calls of 1, 5 and 20 steps");
}

#[test]
fn growing_shoot_allocates_less_than_once_in_a_step() {
    // Every step cuts an element and most merge two, which changes the rows of the history and the
    // sparsity pattern.
    let found = in_calls(
        growing().build().unwrap(),
        MethodOfSteps::new(90.0),
        90.0,
        &[100, 100],
    );
    assert!(
        found.iter().all(|n| *n < 100),
        "allocations in calls of 100 steps: {found:?}"
    );
}
