//! Fourth order in time over whole runs, including the start, jumps and exits from the growth zone:
//! the slope over three halvings of the step, against a run with a much shorter step on elements of
//! the same size.

use std::f64::consts::FRAC_PI_2;

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    ETA, HOUR, MINUTE, STATOLITHS, Steering, WEIGHT, growing, order, reduced, remembering,
    righting, steering,
};
use approx::assert_abs_diff_eq;
use morphorod::equilibrium::{NewtonSolver, Unloaded};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Pulse, Whirl};
use morphorod::tropism::{Memory, Proprioception, Response, SettledStatoliths, Site};
use morphorod::{DynLaws, Shoot, Still};
use nalgebra::Vector3;

/// Smallest accepted order. The scheme is of fourth order, but three halvings of usual steps do not
/// reach the limit to all digits.
pub(super) const LEAST: f64 = 3.5;

/// Largest distance (m) of the tip at the times (s) from that of a run with the step `fine`, for
/// each step.
pub(super) fn errors<I: Integrator>(
    shoot: impl Fn() -> Shoot<DynLaws>,
    integrator: impl Fn(f64) -> I,
    times: &[f64],
    steps: [f64; 4],
    fine: f64,
) -> [f64; 4] {
    let run = |step: f64| -> Vec<Vector3<f64>> {
        let (mut shoot, mut run) = (shoot(), integrator(step));
        let tip = |t: &f64| {
            run.advance(&mut shoot, *t).unwrap();
            shoot.tip()
        };
        times.iter().map(tip).collect()
    };
    let best = run(fine);
    steps.map(|step| {
        run(step)
            .iter()
            .zip(&best)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max)
    })
}

fn assert_fourth_order(name: &str, errors: [f64; 4]) {
    let slope = order(&errors);
    println!("{name}: {slope:.2} {errors:?}");
    assert!(
        slope >= LEAST,
        "{name}: order {slope:.2}, errors {errors:?}"
    );
    // Errors near rounding would have a meaningless slope.
    assert!(errors[3] > 1e-11, "{name}: {errors:?}");
}

const HOURS: [f64; 5] = [HOUR, 2.0 * HOUR, 4.0 * HOUR, 6.0 * HOUR, 8.0 * HOUR];
/// Steps (s): a half, a quarter, an eighth and a sixteenth of the delay of 12 min.
const STEPS: [f64; 4] = [360.0, 180.0, 90.0, 45.0];

#[test]
fn righting_shoot_has_fourth_order() {
    let shoot = || righting().elements(4).into_dyn().build().unwrap();
    assert_fourth_order(
        "righting",
        errors(shoot, MethodOfSteps::new, &HOURS, STEPS, 6.0),
    );
}

#[test]
fn righting_shoot_with_statoliths_has_fourth_order() {
    let shoot = || {
        righting()
            .elements(4)
            .tropism(steering(STATOLITHS))
            .into_dyn()
            .build()
            .unwrap()
    };
    assert_fourth_order(
        "statoliths",
        errors(shoot, MethodOfSteps::new, &HOURS, STEPS, 6.0),
    );
}

#[test]
fn growing_shoot_has_fourth_order() {
    let shoot = || growing().merge_tolerance(1e-6).into_dyn().build().unwrap();
    // The oscillator of 24 min requires shorter steps. Merging with a tolerance of 1e-6 changes the
    // tip by 1e-12 m.
    let steps = [180.0, 90.0, 45.0, 22.5];
    let times = [1.0, 2.0, 4.0, 6.0, 8.0, 10.0].map(|h| h * HOUR);
    assert_fourth_order(
        "growing",
        errors(shoot, MethodOfSteps::new, &times, steps, 7.5),
    );
}

/// Memory and reaction times in minutes.
fn minutes(time: f64, delay: f64) -> Memory {
    Memory {
        time: time * MINUTE,
        delay: delay * MINUTE,
    }
}

fn laws(gravity: Memory, bend: Memory) -> Steering {
    remembering(gravity, bend).steering(SettledStatoliths)
}

#[test]
fn iterated_steps_have_fourth_order_with_and_without_delays() {
    for (gravity, bend) in [
        (minutes(12.0, 0.0), minutes(12.0, 0.0)),
        (minutes(12.0, 0.0), minutes(12.0, 12.0)),
        (minutes(12.0, 12.0), minutes(12.0, 0.0)),
        (minutes(9.0, 1.7), minutes(12.0, 12.0)),
    ] {
        let shoot = || {
            righting()
                .elements(4)
                .tropism(laws(gravity, bend))
                .into_dyn()
                .build()
                .unwrap()
        };
        let found = errors(shoot, MethodOfSteps::new, &HOURS, STEPS, 6.0);
        assert_fourth_order(&format!("{gravity:?} {bend:?}"), found);
    }
}

#[test]
fn steps_are_corrected_only_if_they_exceed_the_shortest_delay() {
    let shoot = || {
        righting()
            .elements(4)
            .tropism(laws(minutes(9.0, 7.0), minutes(12.0, 12.0)))
            .into_dyn()
            .build()
            .unwrap()
    };
    let run = |step: f64| {
        let mut shoot = shoot();
        let cost = MethodOfSteps::new(step)
            .advance(&mut shoot, 4.0 * HOUR)
            .unwrap();
        (shoot.tip(), cost.equilibria - cost.steps - 1)
    };
    let (near, corrections) = run(60.0);
    assert_eq!(corrections, 0);
    assert_eq!(run(420.0).1, 0);
    // A longer step has a larger error in time.
    let (far, corrections) = run(600.0);
    assert!(corrections > 10, "{corrections}");
    assert_abs_diff_eq!(InNorm(far), InNorm(near), epsilon = 1e-4);
}

#[test]
fn jumps_of_a_load_or_of_its_slope_keep_fourth_order() {
    let pulse = Pulse {
        peak: Vector3::new(2e-5, 1e-5, 0.0),
        start: 20.0 * MINUTE,
        duration: 12.0 * MINUTE,
    };
    // Two turns of 87.6 min end at 10512 s, which is not a multiple of any step. The force then
    // drops from 1e-5 N to zero.
    let whirl = Whirl {
        force: 1e-5,
        period: 87.6 * MINUTE,
        turns: 2.0,
    };
    // The pulse is a half sine of 12 min: the longest step is a fourth of it.
    let steps = [180.0, 90.0, 45.0, 22.5];
    let upright = || reduced(0.0659, 20.0 * HOUR).elements(4);
    let found = errors(
        || upright().load((WEIGHT, pulse)).into_dyn().build().unwrap(),
        MethodOfSteps::new,
        &HOURS,
        steps,
        3.0,
    );
    assert_fourth_order("pulse", found);
    let found = errors(
        || upright().load((WEIGHT, whirl)).into_dyn().build().unwrap(),
        MethodOfSteps::new,
        &HOURS,
        STEPS,
        6.0,
    );
    assert_fourth_order("whirl", found);
    let sluggish = || {
        upright()
            .tropism(steering(STATOLITHS))
            .load((WEIGHT, pulse))
            .into_dyn()
            .build()
            .unwrap()
    };
    assert_fourth_order(
        "pulse, statoliths",
        errors(sluggish, MethodOfSteps::new, &HOURS, steps, 3.0),
    );
    let iterated = || {
        upright()
            .tropism(laws(minutes(12.0, 0.0), minutes(12.0, 0.0)))
            .load((WEIGHT, pulse))
    };
    let found = errors(
        || iterated().into_dyn().build().unwrap(),
        MethodOfSteps::new,
        &HOURS,
        steps,
        3.0,
    );
    assert_fourth_order("pulse, no delay", found);
}

/// Exact solution for a weightless shoot with proprioception alone. At each point it obeys u̇ =
/// −(η/τg) y(t − τr), τm ẏ = u − y, with u = u1 + i u2. A solution is u = u0 exp(λt), y = u/(1 +
/// λτm), if −λ (1 + λτm) exp(λτr) is η/τg.
struct Circling {
    memory: Memory,
    /// −Re λ and Im λ, 1/s.
    decay: f64,
    rate: f64,
    growth_time: f64,
}

impl Circling {
    /// Undamped solution: λ = iω with ω τr + atan(ω τm) = π/2 and τg = η/(ω √(1 + ω² τm²)).
    fn undamped(memory: Memory) -> Self {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..200 {
            let rate = 0.5 * (low + high);
            let lag = rate * memory.delay + (rate * memory.time).atan();
            if lag < FRAC_PI_2 {
                low = rate
            } else {
                high = rate
            }
        }
        let growth_time = ETA / (low * (1.0 + (low * memory.time).powi(2)).sqrt());
        Self {
            memory,
            decay: 0.0,
            rate: low,
            growth_time,
        }
    }

    /// Damped solution, for zero delay: λ = (−1 + iκ)/(2τm) and τg = 4 η τm/(1 + κ²).
    fn damped(time: f64, turns: f64) -> Self {
        let memory = Memory { time, delay: 0.0 };
        let growth_time = 4.0 * ETA * time / (1.0 + turns * turns);
        Self {
            memory,
            decay: 0.5 / time,
            rate: 0.5 * turns / time,
            growth_time,
        }
    }

    /// Largest error of the strain after `t` s, relative to its size at t = 0.
    fn error(&self, mut run: impl Integrator, t: f64) -> f64 {
        const STRAIN: f64 = 10.0;
        let mut shoot = reduced(0.03, self.growth_time)
            .elements(2)
            .tropism(Proprioception { sensitivity: ETA }.remembered(self.memory))
            .load(())
            .scene(Still::weightless())
            .into_dyn()
            .build()
            .unwrap();
        shoot.set_intrinsic(|_| Vector3::x() * STRAIN);
        let strain = |t: f64| {
            let (sin, cos) = (self.rate * t).sin_cos();
            (
                STRAIN * (-self.decay * t).exp() * cos,
                STRAIN * (-self.decay * t).exp() * sin,
            )
        };
        let (a, b) = (
            1.0 - self.decay * self.memory.time,
            self.rate * self.memory.time,
        );
        let past = |t: f64, _: &Site, y: &mut [f64]| {
            let (u1, u2) = strain(t);
            y.copy_from_slice(&[
                (a * u1 + b * u2) / (a * a + b * b),
                (a * u2 - b * u1) / (a * a + b * b),
            ]);
        };
        let _ = run.start(&mut shoot, &past).unwrap();
        run.advance(&mut shoot, t).unwrap();
        let exact = Vector3::new(strain(t).0, strain(t).1, 0.0);
        shoot
            .rod()
            .points()
            .iter()
            .map(|p| (p.intrinsic - exact).norm() / STRAIN)
            .fold(0.0, f64::max)
    }
}

#[test]
fn weightless_shoot_converges_to_the_closed_form_at_fourth_order() {
    // Equal kernels of 12 min: x tan x = 1 with x = ωτr = 0.860333589019380, a period of
    // 87.6383587116423 min and a critical growth time of 3.52449410960937 h.
    let equal = Circling::undamped(minutes(12.0, 12.0));
    assert_abs_diff_eq!(equal.rate * 720.0, 0.860333589019380, epsilon = 1e-14);
    assert_abs_diff_eq!(equal.growth_time / HOUR, 3.52449410960937, epsilon = 1e-13);
    for circling in [
        equal,
        Circling::undamped(minutes(5.0, 17.0)),
        Circling::undamped(minutes(30.0, 8.0)),
    ] {
        let found = STEPS
            .map(|step| circling.error(MethodOfSteps::with_solver(step, Unloaded), 5.3 * HOUR));
        assert_fourth_order(&format!("circling {:?}", circling.memory), found);
    }
    let present = Circling::damped(30.0 * MINUTE, 9.0);
    let found =
        STEPS.map(|step| present.error(MethodOfSteps::with_solver(step, Unloaded), 1.3 * HOUR));
    assert_fourth_order("circling without delay", found);
}

#[test]
fn delays_that_no_step_divides_keep_fourth_order() {
    // The delays propagate kinks to 550 s and 71 s after the start. The integrator steps onto them,
    // with equal steps around.
    let memory = |delay: f64| Memory { time: 726.0, delay };
    for (gravity, bend) in [(550.0, 550.0), (550.0, 71.0)] {
        let shoot = || {
            righting()
                .tropism(laws(memory(gravity), memory(bend)))
                .into_dyn()
                .build()
                .unwrap()
        };
        let found = errors(
            shoot,
            MethodOfSteps::new,
            &[2560.0, 7680.0],
            [160.0, 80.0, 40.0, 20.0],
            5.0,
        );
        // Rounding errors are 1e-16 m.
        assert!(
            order(&found) >= LEAST,
            "delays {gravity} s and {bend} s: {found:?}"
        );
        // With steps across the kinks, the errors with both delays at 550 s were 1.3e-7, 2.5e-8,
        // 3.4e-9, 3.5e-11 m.
        assert!(found[2] < 1e-9, "{found:?}");
    }
}

#[test]
fn memories_far_shorter_than_a_step_keep_fourth_order() {
    // The variable y reaches its stimulus almost at once, so the response jumps after one delay.
    for time in [1e-6, 1e-4] {
        let memory = Memory { time, delay: 720.0 };
        let shoot = || {
            righting()
                .tropism(laws(memory, memory))
                .into_dyn()
                .build()
                .unwrap()
        };
        let found = errors(
            shoot,
            MethodOfSteps::new,
            &[HOUR, 2.0 * HOUR],
            [240.0, 120.0, 60.0, 30.0],
            5.0,
        );
        assert_fourth_order("a short memory", found);
        // The error of the rise is a small part of its area, β ℓ²/(r τg) times the memory time.
        assert!(found[3] < 1e-9 * 0.05, "{time} s: {found:?}");
    }
}

#[test]
fn memory_that_is_faster_than_the_steps_is_read_with_its_transient() {
    // The memory reaches its stimulus long before the end of a step, and acts half an hour later.
    let run = |step: f64| {
        let memory = Memory {
            time: 0.5,
            delay: 1800.0,
        };
        let (law, _) = laws(memory, memory);
        let mut shoot = reduced(0.05, 10.0 * HOUR)
            .tropism(law)
            .into_dyn()
            .scene(Still::tilted(1.2))
            .build()
            .unwrap();
        let mut steps = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-12));
        steps.tolerance = 1e-12;
        steps.advance(&mut shoot, 2.0 * HOUR).unwrap();
        shoot.tip()
    };
    let exact = run(2.0);
    // With cubics between levels the errors are 1e-6 of the length at all three steps.
    for (step, bound) in [(150.0, 1e-8), (75.0, 2e-9), (37.5, 1e-9)] {
        let error = (run(step) - exact).norm();
        assert!(error < bound, "step of {step} s: {error:e} m");
    }
}

/// A fast memory acts on the strain one delay after the start, and a slower memory without a delay
/// perceives the strain. The transient in it is shorter than the steps.
#[test]
fn transient_in_the_strain_is_interpolated() {
    let fast = Memory {
        time: 5.0,
        delay: 390.0,
    };
    let slow = Memory {
        time: 127.0,
        delay: 0.0,
    };
    let run = |step: f64| {
        let mut shoot = reduced(0.05, 10.0 * HOUR)
            .tropism(laws(fast, slow))
            .scene(Still::tilted(1.0))
            .build()
            .unwrap();
        let mut steps = MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-12));
        steps.tolerance = 1e-12;
        steps.advance(&mut shoot, 960.0).unwrap();
        shoot.tip()
    };
    let exact = run(0.5);
    let errors = [60.0, 30.0, 15.0, 7.5].map(|step| (run(step) - exact).norm() / 0.05);
    println!("{errors:?}, order {:.2}", order(&errors));
    // With cubics, the errors were 1.4e-5, 1.1e-5, 4e-6 and 7e-7, which is an order of 1.4. The
    // steps near the transient do not become shorter with the others, so that the order is below
    // four.
    assert!(
        errors[1] < 3e-6 && errors[2] < 6e-7 && order(&errors) > 2.0,
        "{errors:?}"
    );
}

/// A memory with each ratio of step to time constant and each delay, beside a memory of 600 s
/// without a delay. The order is that of the method. With two steps in a time constant the first
/// errors are not yet in its asymptotic range. For faster memories the steps near the transient do
/// not become shorter with the others: the error is small, but of no order.
#[test]
fn order_holds_for_every_time_constant_above_the_step_and_every_delay() {
    let steps = [120.0, 60.0, 30.0, 15.0];
    let slow = Memory {
        time: 600.0,
        delay: 0.0,
    };
    for time in [12_000.0, 1200.0, 240.0, 60.0, 24.0, 6.0] {
        for delay in [0.0, 0.3, 1.0, 2.5, 10.0].map(|ratio| ratio * steps[0]) {
            let fast = Memory { time, delay };
            let shoot = || {
                reduced(0.05, 10.0 * HOUR)
                    .tropism(laws(fast, slow))
                    .scene(Still::tilted(1.0))
            };
            let make = || shoot().into_dyn().build().unwrap();
            let times = [0.25, 0.5, 0.75, 1.0].map(|hours| hours * HOUR);
            let precise = |step: f64| {
                let mut steps =
                    MethodOfSteps::with_solver(step, NewtonSolver::with_tolerance(1e-12));
                steps.tolerance = 1e-12;
                steps
            };
            let found = errors(make, precise, &times, steps, (0.25 * time).min(3.0))
                .map(|error| error / 0.05);
            println!("{time} s, {delay} s: {:.2} {found:?}", order(&found));
            if time >= 2.0 * steps[0] {
                let least = if time >= 10.0 * steps[0] { LEAST } else { 3.0 };
                assert!(order(&found) >= least, "{time} s, {delay} s: {found:?}");
            } else {
                // A memory at its steady value in place of the fast one would have an error of
                // 1e-4.
                assert!(
                    found[0] < 5e-5 && found[3] < 1e-6,
                    "{time} s, {delay} s: {found:?}"
                );
            }
        }
    }
}
