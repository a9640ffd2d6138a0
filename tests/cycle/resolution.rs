//! Number of intervals in a period, which is increased until the requested accuracy is reached, and
//! the estimate of the remaining error.

use std::f64::consts::PI;

use super::cycles::plain;
use super::{family, mode};
use crate::fixtures::shoots::MINUTE;
use approx::assert_relative_eq;
use morphorod::cycle::{Continuation, CycleError, PeriodicOrbit, PeriodicSolver};
use morphorod::{DynLaws, Shoot};

/// Swing with a given initial number of intervals and a given accuracy.
fn found(
    shoot: &Shoot<DynLaws>,
    intervals: usize,
    accuracy: f64,
) -> Result<PeriodicOrbit, CycleError> {
    let solver = PeriodicSolver {
        intervals,
        accuracy,
        ..PeriodicSolver::default()
    };
    solver.from_mode(shoot, &mode(shoot), 0.8 * shoot.rod().length())
}

/// This shoot almost buckles during its swing. An earlier version converged on twelve intervals to
/// a period with a relative error of 3e-5.
#[test]
fn swing_that_almost_buckles_is_refined_to_its_known_values() {
    let shoot = plain(0.074, 4);
    let orbit = found(&shoot, 12, 1e-6).unwrap();
    assert!(orbit.error > 0.0 && orbit.error <= 1e-6, "{}", orbit.error);
    // Period (min) and excursion (mm) as in `cycles`, computed by two other methods. The accuracy
    // is 1e-6, and the error due to four elements is smaller.
    assert_relative_eq!(
        orbit.period / MINUTE,
        88.25818623,
        epsilon = 0.0,
        max_relative = 1e-6
    );
    let (excursion, _) = orbit.largest_excursion(&shoot).unwrap();
    assert_relative_eq!(
        1e3 * excursion,
        56.7601829,
        epsilon = 0.0,
        max_relative = 1e-6
    );
    assert!(orbit.multipliers(&shoot, 1).unwrap().trivial < 1e-4);
}

/// Two elements suffice, since all periods are computed on the same mesh.
#[test]
fn error_of_the_period_is_less_than_its_estimate() {
    for (length, intervals) in [(0.067, 8), (0.074, 12), (0.076, 16)] {
        let shoot = plain(length, 2);
        let coarse = found(&shoot, intervals, 1.0).unwrap();
        let fine = found(&shoot, 4 * intervals, 1e-7).unwrap();
        let error = (coarse.period / fine.period - 1.0).abs();
        let estimate = coarse.error;
        assert!(
            error < estimate + fine.error,
            "{length}: {error:e} {estimate:e}"
        );
        // The estimate includes the error of the shape, which is larger at the time of the fastest
        // motion. Its ratio to the error of the period is unbounded in general and several tens in
        // these cases.
        assert!(estimate < 1e-2, "{length}: {error:e} {estimate:e}");
    }
}

#[test]
fn multipliers_of_an_orbit_that_its_intervals_do_not_resolve_are_refused() {
    let shoot = plain(0.076, 2);
    let coarse = found(&shoot, 12, 1.0).unwrap();
    let refused = coarse.multipliers(&shoot, 1);
    assert!(
        matches!(refused, Err(CycleError::Unresolved { intervals: 12, error }) if error > 1e-2),
        "{refused:?}"
    );
}

/// One collocation point in each interval, hence order two. The solver uses at most 256 intervals
/// when it refines.
#[test]
fn orbit_whose_accuracy_needs_too_many_intervals_is_an_error() {
    let shoot = plain(0.067, 1);
    let solver = PeriodicSolver {
        intervals: 130,
        stages: 1,
        ..PeriodicSolver::default()
    };
    let refused = solver.from_mode(&shoot, &mode(&shoot), 0.034);
    assert!(
        matches!(refused, Err(CycleError::Unresolved { intervals: 130, error }) if error > 1e-6),
        "{refused:?}"
    );
}

/// The branch starts with a sufficient number of intervals and doubles it where the accuracy
/// requires it.
#[test]
fn branch_of_swings_refines_its_intervals() {
    let solver = PeriodicSolver {
        intervals: 6,
        angle: Some(PI),
        ..PeriodicSolver::default()
    };
    let first = plain(0.070, 2);
    let swing = solver.from_mode(&first, &mode(&first), 0.04).unwrap();
    let shoots = family(|length| Ok(plain(length, 2)));
    let branch =
        Continuation::from_orbit(solver, shoots, &swing, 0.070, 1e-3, 0.070..=0.074).unwrap();
    let points: Vec<_> = branch
        .largest_step(0.5)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert!(
        points
            .iter()
            .all(|point| point.orbit.error <= 1e-6 && point.trivial < 1e-4)
    );
    let last = points.last().unwrap();
    assert_eq!(last.parameter, 0.074);
    let again = found(&plain(0.074, 2), 32, 1e-6).unwrap();
    // The accuracy of both periods is 1e-6.
    assert_relative_eq!(
        2.0 * last.period,
        again.period,
        epsilon = 0.0,
        max_relative = 1e-6
    );
}
