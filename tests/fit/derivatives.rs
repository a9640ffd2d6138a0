//! Runs on the grid of another run, and derivatives by their differences.

use crate::fixtures::shoots::{HOUR, MINUTE, remembering};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::equilibrium::NewtonSolver;
use morphorod::integrator::{Grid, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::ApicalForce;
use morphorod::tropism::Memory;
use morphorod::{DynLaws, Shoot, ShootParameters};
use nalgebra::{DVector, Vector3};

/// β, η, τm (s), τr (s), τg (s), ℓg (m), α, τe (s), E (Pa), ρ (kg/m³), ℓ0 (m).
const PARAMETERS: [f64; 11] = [
    0.8,
    20.0,
    720.0,
    720.0,
    20.0 * HOUR,
    0.03,
    0.2,
    1440.0,
    1e7,
    1000.0,
    0.0327,
];

/// A growing shoot whose tissue leaves the growth zone, lignifies, and is merged.
fn shoot(p: &[f64]) -> Shoot<DynLaws> {
    let memory = Memory {
        time: p[2],
        delay: p[3],
    };
    let parameters = ShootParameters {
        gravitropic_sensitivity: p[0],
        proprioceptive_sensitivity: p[1],
        growth_time: p[4],
        zone_length: p[5],
        oscillator_sensitivity: p[6],
        oscillator_period: p[7],
        youngs_modulus: p[8],
        mature_modulus: 200.0 * p[8],
        lignification_time: 24.0 * HOUR,
        density: p[9],
        length: p[10],
        ..remembering(memory, memory)
    };
    let push = ApicalForce(|_: f64| Vector3::new(2e-5, 1e-5, 0.0));
    let builder = parameters.shoot().elements(4);
    builder
        .load((parameters.weight(), push))
        .into_dyn()
        .build()
        .unwrap()
}

/// Tips every ten minutes over four hours, and the shoot at the end.
fn run(
    p: &[f64],
    integrator: &mut MethodOfSteps,
) -> Result<(DVector<f64>, Shoot<DynLaws>), IntegrationError> {
    let (mut shoot, mut tips) = (shoot(p), Vec::new());
    for k in 1..=24 {
        integrator.advance(&mut shoot, 10.0 * MINUTE * f64::from(k))?;
        tips.extend(shoot.tip().iter());
    }
    Ok((DVector::from_vec(tips), shoot))
}

/// Integrator whose equilibria are accurate to rounding.
fn integrator() -> MethodOfSteps {
    MethodOfSteps::with_solver(150.0, NewtonSolver::with_tolerance(1e-11))
}

/// Shoot at the end of a recorded run, and its grid.
fn recorded() -> (Shoot<DynLaws>, Grid) {
    let mut recording = integrator();
    recording.record();
    let (_, end) = run(&PARAMETERS, &mut recording).unwrap();
    (end, recording.take_grid())
}

#[test]
fn runs_that_record_a_grid_or_follow_it_equal_a_free_run_bit_by_bit() {
    let (_, free) = run(&PARAMETERS, &mut integrator()).unwrap();
    let (recorded, grid) = recorded();
    let mut following = integrator();
    following.follow(grid);
    let (_, followed) = run(&PARAMETERS, &mut following).unwrap();
    assert_eq!(recorded.state(), free.state());
    assert_eq!(followed.state(), free.state());
}

#[test]
fn differences_on_a_grid_are_derivatives_with_respect_to_every_parameter() {
    let (_, grid) = recorded();
    for k in 0..PARAMETERS.len() {
        let difference = |h: f64| {
            let at = |change: f64| {
                let mut p = PARAMETERS;
                p[k] *= change.exp();
                let mut following = integrator();
                following.follow(grid.clone());
                run(&p, &mut following).unwrap().0
            };
            (at(h) - at(-h)) / (2.0 * h)
        };
        // The first step is that of fits. The reference is Richardson's extrapolation of two larger
        // ones. Its error is of fourth order, (ω T h)⁴ = 1e-12 for the phase of the oscillator
        // after four hours.
        let [used, coarse, fine] = [1e-5, 5e-5, 2.5e-5].map(difference);
        let extrapolated = (fine * 4.0 - coarse) / 3.0;
        // The tolerance is the required accuracy. The error is 1e-7 for the phase and smaller for
        // all others.
        assert_abs_diff_eq!(
            (used - &extrapolated).norm() / extrapolated.norm(),
            0.0,
            epsilon = 1e-6
        );
    }
}

/// In a free run the number of steps before the first response depends on the reaction time.
#[test]
fn the_reaction_time_moves_the_steps_of_a_followed_grid_smoothly() {
    let (_, grid) = recorded();
    let at = |change: f64| {
        let mut p = PARAMETERS;
        p[3] += change;
        let mut following = integrator();
        following.follow(grid.clone());
        run(&p, &mut following).unwrap().0
    };
    let slopes = [0.02, 0.01].map(|change| (at(change) - at(-change)) / (2.0 * change));
    // The difference is of second order, (0.02 s/τr)² = 8e-10, times the curvature of the path over
    // four hours, below 1e3.
    assert_relative_eq!(
        slopes[0].norm(),
        slopes[1].norm(),
        epsilon = 0.0,
        max_relative = 1e-6
    );
    assert_abs_diff_eq!(
        (&slopes[0] - &slopes[1]).norm() / slopes[1].norm(),
        0.0,
        epsilon = 1e-6
    );
}

#[test]
fn errors_of_a_grid_that_does_not_fit_leave_the_shoot_unchanged() {
    let (_, grid) = recorded();
    let mut p = PARAMETERS;
    p[4] *= 0.5;
    let mut following = integrator();
    following.follow(grid.clone());
    assert!(matches!(
        run(&p, &mut following),
        Err(IntegrationError::Grid { .. })
    ));

    let mut following = integrator();
    following.follow(grid);
    let (_, mut end) = run(&PARAMETERS, &mut following).unwrap();
    let before = end.state().clone();
    let error = following.advance(&mut end, 5.0 * HOUR).unwrap_err();
    assert!(
        matches!(
            error,
            IntegrationError::Grid {
                problem: "it has no further step",
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(*end.state(), before);
}
