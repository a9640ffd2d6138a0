//! The state of a shoot is a plain value, which can be saved, restored, compared, written and read.
//! A run from a restored state repeats the original run to the bit, and an error leaves the state
//! unchanged.

use crate::fixtures::shoots::{
    HOUR, MEMORY, MINUTE, STATOLITHS, WEIGHT, YOUNG, growing, reduced, remembering, righting, rod,
    steering,
};
use morphorod::equilibrium::{EquilibriumError, Unloaded};
use morphorod::growth::GrowthLaw;
use morphorod::integrator::{ConstantHistory, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Whirl};
use morphorod::tropism::{Memory, SettledStatoliths};
use morphorod::{Model, Scene, Shoot, State, Still};
use nalgebra::{UnitQuaternion, Vector3};

/// Advances a shoot from its state at `t1` to `t2` (s) in several ways. Panics unless all final
/// states are equal.
fn assert_repeats<M: Model, I: Integrator>(
    mut shoot: Shoot<M>,
    integrator: impl Fn() -> I,
    t1: f64,
    t2: f64,
) where
    Shoot<M>: Clone,
{
    let mut run = integrator();
    run.advance(&mut shoot, t1).unwrap();
    let kept: State = shoot.state().clone();
    assert!(&kept == shoot.state());
    let copy = shoot.clone();
    run.advance(&mut shoot, t2).unwrap();
    let end = shoot.state().clone();
    assert!(kept != end, "states at two times are equal");
    // The state is restored, and the same integrator is used, which has advanced further in the
    // meantime.
    shoot.restore(&kept).unwrap();
    assert!(&kept == shoot.state());
    run.advance(&mut shoot, t2).unwrap();
    assert!(&end == shoot.state(), "restored");
    // The state is restored, and a new integrator is used.
    shoot.restore(&kept).unwrap();
    let _ = integrator().advance(&mut shoot, t2).unwrap();
    assert!(&end == shoot.state(), "with a fresh integrator");
    // A copy of the whole shoot is advanced.
    let mut copy = copy;
    let _ = integrator().advance(&mut copy, t2).unwrap();
    assert!(&end == copy.state(), "copied");
    // The state is restored into a shoot with the same laws and another state.
    let _ = integrator().advance(&mut copy, t2 + 0.5 * HOUR).unwrap();
    copy.restore(&kept).unwrap();
    let _ = integrator().advance(&mut copy, t2).unwrap();
    assert!(&end == copy.state(), "restored into another shoot");
}

#[test]
fn growing_shoot_resumed_from_a_state_repeats_the_uninterrupted_run() {
    let shoot = || growing().elements(4).into_dyn().build().unwrap();
    // The times are before and after the first point leaves the zone (1.16 h), during the first
    // steps of increasing length, and between multiples of the step.
    for (t1, t2) in [
        (0.0, HOUR),
        (20.0, 200.0),
        (0.9 * HOUR, 1.5 * HOUR),
        (2.0 * HOUR, 3.01 * HOUR),
    ] {
        assert_repeats(shoot(), || MethodOfSteps::new(90.0), t1, t2);
    }
}

#[test]
fn shoot_of_constant_length_resumed_from_a_state_repeats_the_uninterrupted_run() {
    let whirl = Whirl {
        force: 1e-5,
        period: 87.6 * MINUTE,
        turns: 0.5,
    };
    let shoot = || {
        reduced(0.0659, 20.0 * HOUR)
            .elements(4)
            .load((WEIGHT, whirl))
            .tropism(steering(STATOLITHS))
            .into_dyn()
            .build()
    };
    // The load vanishes at 43.8 min. The times are before, at and after this jump.
    for t1 in [43.0 * MINUTE, 43.8 * MINUTE, 44.0 * MINUTE] {
        assert_repeats(
            shoot().unwrap(),
            || MethodOfSteps::new(100.0),
            t1,
            2.0 * HOUR,
        );
    }
    let present = Memory {
        time: 12.0 * MINUTE,
        delay: 0.0,
    };
    let laws = remembering(present, MEMORY).steering(SettledStatoliths);
    let shoot = righting()
        .elements(4)
        .tropism(laws)
        .into_dyn()
        .build()
        .unwrap();
    assert_repeats(shoot, || MethodOfSteps::new(100.0), 0.5 * HOUR, HOUR);
}

#[test]
fn integrator_used_for_several_shoots_in_turn_gives_independent_results() {
    let with_memory = |minutes: f64| {
        let memory = Memory {
            time: minutes * MINUTE,
            delay: 12.0 * MINUTE,
        };
        righting()
            .elements(4)
            .tropism(remembering(memory, memory).steering(SettledStatoliths))
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut alone = with_memory(30.0);
    let _ = MethodOfSteps::new(90.0)
        .advance(&mut alone, 0.5 * HOUR)
        .unwrap();
    let _ = MethodOfSteps::new(90.0).advance(&mut alone, HOUR).unwrap();
    // One integrator alternately advances two shoots in equal steps, and a third shoot with another
    // mesh.
    let mut run = MethodOfSteps::new(90.0);
    let (mut first, mut second) = (with_memory(6.0), with_memory(30.0));
    for t in [0.5 * HOUR, HOUR] {
        run.advance(&mut growing().into_dyn().build().unwrap(), t)
            .unwrap();
        run.advance(&mut first, t).unwrap();
        run.advance(&mut second, t).unwrap();
    }
    assert!(first.state() != second.state());
    assert!(alone.state() == second.state());
}

#[test]
fn states_that_differ_anywhere_are_not_equal() {
    let mut shoot = righting().elements(4).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut shoot, HOUR).unwrap();
    let kept = shoot.state().clone();
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::x() * 1e-9);
    assert!(&kept != shoot.state());
    shoot.restore(&kept).unwrap();
    assert!(&kept == shoot.state());
    // These states differ only in their history.
    let start = |settled: bool| {
        let mut shoot = righting().elements(4).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::new(90.0);
        let _ = if settled {
            run.start(&mut shoot, &ConstantHistory::Steady)
        } else {
            run.advance(&mut shoot, 0.0)
        }
        .unwrap();
        shoot
    };
    assert_eq!(start(false).rod(), start(true).rod());
    assert_ne!(start(false).state(), start(true).state());
}

#[test]
fn advancing_to_the_present_time_changes_nothing() {
    let mut shoot = growing().elements(4).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut shoot, 1.3 * HOUR).unwrap();
    let kept = shoot.state().clone();
    let statistics = run.advance(&mut shoot, 1.3 * HOUR).unwrap();
    assert_eq!(statistics.steps, 0);
    assert!(&kept == shoot.state());
}

/// Base whose quaternion is NaN after half an hour.
#[derive(Debug, Clone, Copy)]
struct BrokenPot;

impl Scene for BrokenPot {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -9.81)
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        let w = if t <= 1800.0 { 1.0 } else { f64::NAN };
        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, 0.0, 0.0, 0.0))
    }
}

#[test]
fn error_during_a_run_leaves_the_shoot_unchanged() {
    // The load becomes NaN half an hour after the start. The elements of the shoot are subdivided
    // before that time.
    let load = (
        WEIGHT,
        ApicalForce(|t: f64| Vector3::new(1e-6, 0.0, if t < 1800.0 { 0.0 } else { f64::NAN })),
    );
    let mut shoot = growing().load(load).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    for until in [0.0, 1000.0] {
        run.advance(&mut shoot, until).unwrap();
        let kept = shoot.state().clone();
        let error = run.advance(&mut shoot, HOUR).unwrap_err();
        let expected = EquilibriumError::NotFinite {
            what: "force of the load on the rod",
        };
        assert!(
            matches!(&error, IntegrationError::Equilibrium { time, error } if *error == expected && *time >= 1800.0)
        );
        assert!(!error.is_recoverable());
        assert!(&kept == shoot.state());
    }

    // The solver has too few iterations at first: a shoot of two elements has no coarse mesh. With
    // enough iterations the run repeats one without this error.
    let shoot = || righting().elements(2).into_dyn().build().unwrap();
    let mut steady = shoot();
    let _ = MethodOfSteps::new(90.0).advance(&mut steady, HOUR).unwrap();
    let mut retried = shoot();
    let mut run = MethodOfSteps::new(90.0);
    run.solver.max_iterations = 1;
    let before = retried.state().clone();
    let error = run.advance(&mut retried, HOUR).unwrap_err();
    assert!(error.is_recoverable(), "{error}");
    assert!(&before == retried.state());
    run.solver.max_iterations = 200;
    run.advance(&mut retried, HOUR).unwrap();
    assert!(steady.state() == retried.state());

    // The quaternion of the base becomes NaN. One solver uses the base, and the other does not.
    let mut pot = reduced(0.05, 20.0 * HOUR)
        .scene(BrokenPot)
        .into_dyn()
        .build()
        .unwrap();
    let before = pot.state().clone();
    assert!(MethodOfSteps::new(90.0).advance(&mut pot, HOUR).is_err());
    assert!(&before == pot.state());
    let mut pot = rod(YOUNG, 0.05)
        .scene(BrokenPot)
        .into_dyn()
        .build()
        .unwrap();
    let before = pot.state().clone();
    assert!(
        MethodOfSteps::with_solver(90.0, Unloaded)
            .advance(&mut pot, HOUR)
            .is_err(),
        "{:?}",
        pot.tip()
    );
    assert!(&before == pot.state());
}

#[test]
fn unloaded_solver_refuses_a_load_that_begins_during_a_run() {
    let push = ApicalForce(|t: f64| Vector3::new(if t < 1800.0 { 0.0 } else { 1e-9 }, 0.0, 0.0));
    let mut shoot = reduced(0.05, 20.0 * HOUR)
        .load(push)
        .scene(Still::tilted(1.0))
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::with_solver(90.0, Unloaded);
    run.advance(&mut shoot, 1200.0).unwrap();
    let kept = shoot.state().clone();
    let error = run.advance(&mut shoot, HOUR).unwrap_err();
    assert!(
        matches!(
            error,
            IntegrationError::Equilibrium {
                error: EquilibriumError::Parameter(_),
                ..
            }
        ),
        "{error}"
    );
    assert!(&kept == shoot.state());
}

/// Name of a format, and a function that writes a state in this format and reads it again.
type Format = (&'static str, fn(&State) -> State);

/// Text and binary formats. Binary formats contain neither names nor lengths of fields, so that
/// every field must be written in order. The feature `float_roundtrip` of `serde_json` preserves
/// all digits in text.
const FORMATS: [Format; 3] = [
    ("serde_json", |state| {
        serde_json::from_str(&serde_json::to_string(state).unwrap()).unwrap()
    }),
    ("postcard", |state| {
        postcard::from_bytes(&bytes(state)).unwrap()
    }),
    ("bincode", |state| {
        let config = bincode::config::standard();
        let written = bincode::serde::encode_to_vec(state, config).unwrap();
        let (read, length) = bincode::serde::decode_from_slice(&written, config).unwrap();
        assert_eq!(length, written.len(), "a part of the state is not read");
        read
    }),
];

/// Bytes that represent all bits of a state. Equal states may differ in the sign of a zero.
fn bytes(state: &State) -> Vec<u8> {
    postcard::to_allocvec(state).unwrap()
}

/// Writes and reads the state of a shoot in all formats, and advances a shoot from each result by
/// `further` seconds.
fn assert_reads<M: Model>(shoot: &Shoot<M>, build: impl Fn() -> Shoot<M>, further: f64) {
    let (kept, t) = (shoot.state(), shoot.state().time());
    let on = |kept: &State| {
        let mut shoot = build();
        shoot.restore(kept).unwrap();
        let _ = MethodOfSteps::new(90.0)
            .advance(&mut shoot, t + further)
            .unwrap();
        bytes(shoot.state())
    };
    let end = on(kept);
    for (format, write_and_read) in FORMATS {
        let read = write_and_read(kept);
        assert!(
            &read == kept && bytes(&read) == bytes(kept),
            "{format} at {t} s"
        );
        assert!(on(&read) == end, "{format} from {t} s on");
    }
}

#[test]
fn state_written_and_read_again_is_the_same_in_every_format() {
    let build = || growing().elements(4).into_dyn().build().unwrap();
    let mut shoot = build();
    // The first state is that before the start of an integrator.
    assert_reads(&shoot, build, HOUR);
    let mut run = MethodOfSteps::new(90.0);
    // The exit time of tissue in the zone is infinite, and JSON has no infinity. After 1.16 h some
    // tissue has left the zone.
    for (t, some_has_left) in [(0.0, false), (0.5 * HOUR, false), (1.7 * HOUR, true)] {
        run.advance(&mut shoot, t).unwrap();
        let (inside, outside): (Vec<f64>, _) = shoot
            .rod()
            .points()
            .iter()
            .map(|point| point.exit_time)
            .partition(|exit| *exit == f64::INFINITY);
        assert!(!inside.is_empty() && outside.is_empty() != some_has_left);
        assert_reads(&shoot, build, HOUR);
    }
}

/// Growth that has not begun, for which the exit time of tissue behind the zone is −∞.
#[derive(Debug, Clone, Copy)]
struct Dormant;

impl GrowthLaw for Dormant {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        0.0
    }
    fn zone_length(&self) -> f64 {
        0.07
    }
}

#[test]
fn infinitely_early_exit_times_are_written_and_read() {
    let shoot = || {
        rod(YOUNG, 0.1)
            .growth(Dormant)
            .tropism(steering(STATOLITHS))
    };
    let build = || {
        shoot()
            .scene(Still::tilted(0.1))
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut shoot = build();
    assert_eq!(shoot.rod().points()[0].exit_time, f64::NEG_INFINITY);
    assert_reads(&shoot, build, 600.0);
    let _ = MethodOfSteps::new(90.0).advance(&mut shoot, 600.0).unwrap();
    assert_reads(&shoot, build, 600.0);
}
