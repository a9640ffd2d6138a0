//! Branches that begin at the onset of oscillations for sensitivities of proprioception from zero
//! to nearly the largest one. Without proprioception infinitely many roots accumulate at zero,
//! beside the root that crosses the axis.

use std::f64::consts::TAU;
use std::time::Instant;

use super::family;
use crate::fixtures::exact_orbit::{GROWTH_TIME, rate};
use crate::fixtures::random::long;
use crate::fixtures::shoots::{BETA, MEMORY, RADIUS, WEIGHT, YOUNG};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::{
    BranchPoint, Continuation, CycleError, OrbitSolver, PeriodicSolver, RotatingWaveSolver,
};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::stability::{Linearisation, onset};
use morphorod::tropism::{Gravitropism, Proprioception, Response, SettledStatoliths};
use morphorod::{DynLaws, Shoot};

/// Upright shoot of the reduced model with a sensitivity of proprioception and a length (m).
fn shoot(eta: f64, length: f64) -> Result<Shoot<DynLaws>, CycleError> {
    let builder = Shoot::builder(YOUNG)
        .length(length)
        .radius(RADIUS)
        .elements(4)
        .growth(Ongoing(UniformGrowth {
            zone_length: 1.0,
            time: GROWTH_TIME,
        }))
        .tropism((
            Gravitropism {
                sensitivity: BETA,
                perception: SettledStatoliths,
            }
            .remembered(MEMORY),
            Proprioception { sensitivity: eta }.remembered(MEMORY),
        ))
        .load(WEIGHT);
    Ok(builder.into_dyn().build()?)
}

/// First points of the branches of some amplitudes (lengths of the shoot) from the onset, with
/// their distance from the onset (m) and the length at the onset.
fn first_points<S: OrbitSolver, const N: usize>(
    solver: S,
    eta: f64,
    amplitudes: [f64; N],
) -> [(BranchPoint<S::Orbit>, f64, f64); N] {
    let found = onset(
        |length| Linearisation::about(&shoot(eta, length).unwrap()),
        0.03,
        0.0785,
    )
    .unwrap();
    let [length] = found.parameters;
    amplitudes.map(|share| {
        let shoots = family(move |length| shoot(eta, length));
        let branch =
            Continuation::from_onset(solver.clone(), shoots, &found, share * length, 0.02..=0.079);
        let point = branch
            .unwrap_or_else(|error| panic!("η = {eta}, {share}: {error}"))
            .next()
            .unwrap()
            .unwrap();
        let beyond = point.parameter - length;
        (point, beyond, length)
    })
}

/// The amplitude is prescribed. The distance from the onset is proportional to its square, with a
/// relative error of the square of the angle of the apex, below 2e-3. The period follows from the
/// kernels.
fn assert_begins<S: OrbitSolver>(solver: S, eta: f64, unstable: usize) {
    let amplitudes = [0.0101, 0.02];
    let points = first_points(solver, eta, amplitudes);
    for ((point, _, length), share) in points.iter().zip(amplitudes) {
        assert_relative_eq!(
            point.excursion,
            share * length,
            epsilon = 0.0,
            max_relative = 1e-3
        );
        // The error of four elements, and for swings the change of the period with the amplitude.
        assert_relative_eq!(
            point.period,
            TAU / rate(),
            epsilon = 0.0,
            max_relative = 1e-6
        );
        assert_eq!(point.unstable(), unstable, "η = {eta}, {share}");
    }
    let [(_, near, _), (_, far, _)] = points;
    assert_abs_diff_eq!(
        near / far,
        (amplitudes[0] / amplitudes[1]).powi(2),
        epsilon = 2e-3
    );
}

/// Begins branches of five amplitudes (lengths of the shoot) at onsets for sensitivities from 0 to
/// 80: twenty of them with `MORPHOROD_LONG=1`, otherwise two.
fn assert_begin_with_any_amplitude<S: OrbitSolver>(kind: &str, solver: S) {
    let number = if long() { 20_u32 } else { 2 };
    let (mut begun, mut slowest) = (0, 0.0_f64);
    for k in 0..number {
        let eta = 80.0 * f64::from(k) / f64::from(number - 1);
        for share in [0.0101, 0.02, 0.04, 0.07, 0.1] {
            let start = Instant::now();
            let [(point, _, length)] = first_points(solver.clone(), eta, [share]);
            slowest = slowest.max(start.elapsed().as_secs_f64());
            begun += 1;
            // The amplitude is that of the linear mode, with a relative error of the square of the
            // angle of the apex.
            assert_relative_eq!(
                point.excursion,
                share * length,
                epsilon = 0.0,
                max_relative = 4.0 * share * share
            );
        }
    }
    println!("{kind}: {begun} branches, the slowest begins after {slowest:.2} s");
}

#[test]
fn branches_of_any_amplitude_begin_at_onsets() {
    assert_begin_with_any_amplitude("circles", RotatingWaveSolver::default());
    assert_begin_with_any_amplitude("swings", PeriodicSolver::default());
}

#[test]
fn circles_begin_at_onsets_with_any_proprioception() {
    for eta in [0.0, 0.01, 1.0, 2.0, 5.0, 30.0, 80.0] {
        assert_begins(RotatingWaveSolver::default(), eta, 0);
    }
}

#[test]
fn swings_begin_at_onsets_with_any_proprioception() {
    for eta in [0.0, 2.0, 80.0] {
        assert_begins(PeriodicSolver::default(), eta, 1);
    }
}
