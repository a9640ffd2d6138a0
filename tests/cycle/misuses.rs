//! Orbits that are asked about another shoot, and angles in degrees.

use super::absent_orbits::{LENGTH, Plan, plan};
use crate::fixtures::shoots::WEIGHT;
use morphorod::cycle::{Continuation, CycleError, PeriodicSolver, RotatingWaveSolver};
use morphorod::load::Weight;

#[test]
fn angle_in_degrees_is_refused() {
    let shoot = plan(LENGTH).shoot();
    let root = super::mode(&shoot);
    let solver = PeriodicSolver {
        angle: Some(180.0),
        ..PeriodicSolver::default()
    };
    let error = solver.from_mode(&shoot, &root, 0.02).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("angle of a periodic orbit is 180 but must be from −2π to 2π"),
        "{error}"
    );
}

#[test]
fn orbit_of_another_shoot_is_named() {
    let shoot = plan(LENGTH).shoot();
    let root = super::mode(&shoot);
    let (_, lateral, apical) = plan(LENGTH).load;
    let lighter = Plan {
        load: (
            Weight {
                density: 0.5 * WEIGHT.density,
            },
            lateral,
            apical,
        ),
        ..plan(LENGTH)
    }
    .shoot();
    let named = |error: CycleError| {
        let text = error.to_string();
        assert!(
            matches!(error, CycleError::Parameter(_))
                && text.contains("the shoot whose orbit this is"),
            "{text}"
        );
    };
    named(
        RotatingWaveSolver::default()
            .from_mode(&shoot, &root, 0.02)
            .unwrap()
            .roots(&lighter, 2)
            .unwrap_err(),
    );
    named(
        PeriodicSolver::default()
            .from_mode(&shoot, &root, 0.02)
            .unwrap()
            .multipliers(&lighter, 2)
            .unwrap_err(),
    );
}

#[test]
fn first_step_of_a_branch_beyond_its_range_is_refused() {
    let shoot = plan(LENGTH).shoot();
    let orbit = RotatingWaveSolver::default()
        .from_mode(&shoot, &super::mode(&shoot), 0.02)
        .unwrap();
    for step in [0.0, f64::NAN, 0.02] {
        let family = super::family(|length| Ok(plan(length).shoot()));
        let range = LENGTH - 0.005..=LENGTH + 0.005;
        let branch = Continuation::from_orbit(
            RotatingWaveSolver::default(),
            family,
            &orbit,
            LENGTH,
            step,
            range,
        );
        let text = branch.err().unwrap().to_string();
        assert!(
            text.contains("but must be positive or negative, and at most the length of the range"),
            "{text}"
        );
    }
}

#[test]
fn period_in_minutes_is_questioned() {
    let error = CycleError::NotConverged {
        what: "the orbit",
        iterations: 8,
        residual: 0.21,
    }
    .to_string();
    assert!(
        error.contains("8 iterations; check the units of the initial guess (a period in s"),
        "{error}"
    );
}
