//! Checkpoints. A valid checkpoint restores every bit, and each kind of invalid checkpoint is
//! refused with its own error.

use crate::fixtures::shoots::{HOUR, growing, righting};
use morphorod::checkpoint::{CheckpointError, from_bytes, to_bytes};
use morphorod::integrator::{Adaptive, Integrator, MethodOfSteps};
use morphorod::{Model, Shoot, State, StateError};

/// State with a history, small enough for a test that damages each bit.
fn small() -> State {
    let mut shoot = righting()
        .elements(1)
        .order(morphorod::Order::Two)
        .into_dyn()
        .build()
        .unwrap();
    MethodOfSteps::new(720.0).advance(&mut shoot, HOUR).unwrap();
    shoot.state().clone()
}

fn refused(bytes: &[u8]) -> CheckpointError {
    from_bytes::<State>(bytes).unwrap_err()
}

#[test]
fn infinities_and_all_bits_are_kept() {
    let odd = (
        f64::INFINITY,
        f64::NEG_INFINITY,
        -0.0,
        f64::MIN_POSITIVE / 3.0,
        0.1 + 0.2,
    );
    let back: (f64, f64, f64, f64, f64) = from_bytes(&to_bytes(&odd).unwrap()).unwrap();
    let bits = |x: (f64, f64, f64, f64, f64)| [x.0, x.1, x.2, x.3, x.4].map(f64::to_bits);
    assert_eq!(bits(back), bits(odd));
    // Points of this shoot never leave the growth zone, and their exit times are infinite.
    let state = small();
    assert!(
        state
            .rod()
            .points()
            .iter()
            .any(|point| point.exit_time == f64::INFINITY)
    );
    assert!(from_bytes::<State>(&to_bytes(&state).unwrap()).unwrap() == state);
}

#[test]
fn damage_of_any_single_bit_is_detected() {
    let sound = to_bytes(&small()).unwrap();
    for bit in 0..8 * sound.len() {
        let mut bytes = sound.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let error = refused(&bytes);
        let expected = match bit / 8 {
            0..9 => matches!(error, CheckpointError::Foreign),
            9..13 => matches!(error, CheckpointError::State(StateError::Format { .. })),
            13..21 => matches!(error, CheckpointError::Length { .. }),
            _ => matches!(error, CheckpointError::Damaged),
        };
        assert!(expected, "bit {bit}: {error}");
    }
}

#[test]
fn truncated_foreign_and_newer_files_are_refused_with_distinct_errors() {
    let sound = to_bytes(&small()).unwrap();
    for length in 0..sound.len() {
        match refused(&sound[..length]) {
            CheckpointError::Foreign => assert!(length < 9),
            CheckpointError::Length { found, .. } => assert!(length >= 9 && found == length as u64),
            error => panic!("{length}: {error}"),
        }
    }
    let longer = [&sound[..], &[0]].concat();
    assert!(matches!(refused(&longer), CheckpointError::Length { .. }));
    assert_eq!(
        refused(b"PK\x03\x04 something else"),
        CheckpointError::Foreign
    );
    // A checkpoint of a later version.
    let mut newer = sound.clone();
    newer[9] += 1;
    let error = refused(&newer);
    assert!(
        matches!(error, CheckpointError::State(StateError::Format { found }) if found == u32::from(newer[9])),
        "{error}"
    );
    // A valid checkpoint of another type.
    assert!(matches!(
        refused(&to_bytes(&"a state").unwrap()),
        CheckpointError::Content(_)
    ));
    assert!(matches!(
        refused(&to_bytes(&(small(), 1.0)).unwrap()),
        CheckpointError::Content(_)
    ));
}

/// Final state of a run that stops after `stop` steps and continues in a new shoot from the bytes
/// of its state.
fn resumed<M: Model>(
    make: impl Fn() -> Shoot<M>,
    run: &(impl Integrator + Clone),
    end: f64,
    stop: usize,
) -> State {
    let mut shoot = make();
    let mut first = run.clone();
    for _ in 0..stop {
        if shoot.time() < end {
            first.step(&mut shoot, end).unwrap();
        }
    }
    let bytes = to_bytes(shoot.state()).unwrap();
    let mut shoot = make();
    shoot.restore(&from_bytes(&bytes).unwrap()).unwrap();
    let mut second = run.clone();
    while shoot.time() < end {
        second.step(&mut shoot, end).unwrap();
    }
    shoot.state().clone()
}

#[test]
fn run_resumed_from_a_checkpoint_repeats_the_uninterrupted_run() {
    let make = || growing().elements(4).into_dyn().build().unwrap();
    let end = 2.0 * HOUR;
    let steps = MethodOfSteps::new(90.0);
    let whole = resumed(make, &steps, end, 0);
    // Fifty quasi-random numbers of steps are computed from the fractional parts of multiples of
    // the golden ratio.
    for k in 1..=50_u32 {
        let stop = (f64::from(k) * 0.618_034).fract() * 90.0;
        assert!(
            resumed(make, &steps, end, stop as usize) == whole,
            "after {stop} steps"
        );
    }
    let adaptive = Adaptive::new(1e-4);
    let whole = resumed(make, &adaptive, end, 0);
    for stop in [1, 7, 30] {
        assert!(
            resumed(make, &adaptive, end, stop) == whole,
            "after {stop} steps, with a tolerance"
        );
    }
}
