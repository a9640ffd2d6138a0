//! Relative periodic orbits from other initial guesses and of shoots with other laws.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::rosettes::{Askew, PLAIN, Plain, excursion, rates, turning, winding};
use super::{mode, shoot};
use crate::fixtures::shoots::{BETA, HOUR, MEMORY, MINUTE, RADIUS, STATOLITHS, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_abs_diff_ne, assert_relative_eq};
use morphorod::cycle::{CycleError, PeriodicSolver, RotatingWaveSolver};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Growing, Oscillator, Perception, Response, Rotation,
    SettledStatoliths, Site, Statoliths, TropismLaw, Variable,
};
use morphorod::{DynLaws, Shoot};
use nalgebra::{Complex, Vector3};

/// Shoot of 6.7 cm after release from a bent shape, whose axis of bending is not a director. After
/// five hours its motion is close to the swing about that axis.
static RELEASED: LazyLock<Shoot<DynLaws>> = LazyLock::new(|| {
    let mut run = PLAIN.shoot.clone();
    run.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0)
        .advance(&mut run, 5.0 * HOUR)
        .unwrap();
    run
});

#[test]
fn run_in_time_is_an_initial_guess_for_whole_and_half_swings() {
    let Plain {
        shoot: plain,
        swing,
        ..
    } = &*PLAIN;
    let (expected, _) = rates(swing, plain);
    for (solver, share) in [(PeriodicSolver::default(), 1.0), (turning(8, PI), 0.5)] {
        let found = solver.from_run(&RELEASED, 95.0 * MINUTE * share).unwrap();
        assert_relative_eq!(
            found.period,
            share * swing.period,
            epsilon = 0.0,
            max_relative = 1e-9
        );
        let (one, other) = (excursion(&found, &RELEASED), excursion(swing, plain));
        assert_relative_eq!(one, other, epsilon = 0.0, max_relative = 1e-8);
        // The rates in the plane and out of it are correct although no director lies in the plane.
        let (found, defect) = rates(&found, &RELEASED);
        assert_abs_diff_eq!(found[..], expected[..], epsilon = 1e-7);
        assert!(defect < 1e-8, "{defect:e}");
    }
}

/// Initial guess from a bent shoot on which its past has no effect yet. It is not on an orbit, but
/// the iteration converges.
#[test]
fn bent_shoot_without_a_past_is_an_initial_guess() {
    let mut rest = PLAIN.shoot.clone();
    rest.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut rest, 0.0).unwrap();
    let found = PeriodicSolver::default()
        .from_run(&rest, 87.0 * MINUTE)
        .unwrap();
    assert_relative_eq!(
        found.period,
        PLAIN.swing.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

/// Rounding errors of the shape must not cause the solver for forced orbits to leave the stationary
/// state.
#[test]
fn forced_orbit_of_a_shoot_without_forcing_is_stationary() {
    let mut still = PLAIN.shoot.clone();
    still.set_intrinsic(|_| Vector3::new(0.0, 3.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut still, HOUR).unwrap();
    let standing = PeriodicSolver::default()
        .forced(&still, 90.0 * MINUTE)
        .unwrap();
    assert!(
        excursion(&standing, &still) < 1e-9,
        "{}",
        excursion(&standing, &still)
    );
}

#[test]
fn shape_of_a_swinging_shoot_is_an_initial_guess_for_a_circle() {
    let solver = RotatingWaveSolver::default();
    let circle = solver.from_mode(&PLAIN.shoot, &PLAIN.root, 0.03).unwrap();
    let found = solver.from_run(&RELEASED, PLAIN.root.value.im).unwrap();
    assert_relative_eq!(
        found.radius(),
        circle.radius(),
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

/// A law with undeclared rotation of its variables has periodic orbits but no relative periodic
/// orbits.
#[test]
fn relative_orbits_of_laws_without_declared_rotation_are_refused() {
    struct Silent;
    impl Perception for Silent {
        type Signal = [f64; 2];
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            Askew(0.0).sense(site, stimuli);
        }
    }
    let law = DirectionalTropism {
        sensitivity: BETA,
        perception: Silent,
    }
    .remembered(MEMORY);
    let silent = shoot(0.0670, 4)
        .tropism((winding(0.0).1, law))
        .into_dyn()
        .build()
        .unwrap();
    let error = turning(8, PI)
        .from_mode(&silent, &PLAIN.root, 0.034)
        .unwrap_err();
    assert!(
        matches!(error, CycleError::Undeclared { variable: 2 }),
        "{error}"
    );
    assert!(
        PeriodicSolver::default()
            .from_mode(&silent, &PLAIN.root, 0.034)
            .is_ok()
    );
}

/// A forced orbit has no angle, an angle must be finite, and a shoot that has not been integrated
/// has no run.
#[test]
fn invalid_angles_and_runs_are_refused_by_name() {
    let Plain {
        shoot: plain, root, ..
    } = &*PLAIN;
    let driven = shoot(0.05, 4)
        .tropism((Oscillator::new(1e-3, 1440.0), steering(STATOLITHS)))
        .into_dyn()
        .build()
        .unwrap();
    let parameter = |error: CycleError, name: &str| matches!(&error, CycleError::Parameter(e) if e.name == name);
    assert!(parameter(
        turning(8, PI).forced(&driven, 1440.0).unwrap_err(),
        "angle of a forced orbit"
    ));
    let error = turning(8, f64::NAN)
        .from_mode(plain, root, 0.034)
        .unwrap_err();
    assert!(parameter(error, "angle of a periodic orbit"));
    let error = PeriodicSolver::default()
        .from_run(plain, 5000.0)
        .unwrap_err();
    assert!(parameter(error, "levels of the history of the run"));
}

/// Law with a memory of the curvature component about the direction of lean. This component is zero
/// on a swing and changes sign in its mirror image.
struct Sidelong {
    declared: bool,
}

impl TropismLaw for Sidelong {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(3);
        let variable = Variable::read_after(MEMORY.delay).relaxing_in(MEMORY.time);
        let turning = |rotation| {
            if self.declared {
                variable.turning(rotation)
            } else {
                variable
            }
        };
        for rotation in [Rotation::First, Rotation::Second, Rotation::Invariant] {
            to.variable(turning(rotation));
        }
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&Vector3::z());
        let (bend, lean) = (site.strain.xy() * RADIUS, up.xy());
        stimuli.copy_from_slice(&[bend.x, bend.y, bend.dot(&lean)]);
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        (0..3).for_each(|k| rates[k] = (stimuli[k] - variables[k]) / MEMORY.time);
    }

    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(-past[1], past[0], 0.0) * (3e4 * past[2] / at.section.radius())
    }
}

/// Test of pseudoscalars. An earlier version treated them as invariant under reflection.
#[test]
fn variables_of_opposite_sign_in_the_mirror_image_change_only_rates_out_of_the_plane() {
    // Rates in the plane and out of it, for a law that declares the rotation of its variables and
    // for a law that does not.
    let [known, unknown] = [true, false].map(|declared| {
        let shoot = shoot(0.067, 4)
            .tropism((steering(SettledStatoliths), Sidelong { declared }))
            .into_dyn()
            .build()
            .unwrap();
        let swing = PeriodicSolver::default()
            .from_mode(&shoot, &mode(&shoot), 0.034)
            .unwrap();
        rates(&swing, &shoot).0
    });
    let plain = [-0.286710238, 0.105275642];
    assert_abs_diff_eq!(known[0], plain[0], epsilon = 1e-6);
    assert_abs_diff_ne!(known[1], plain[1], epsilon = 1e-3);
    assert_abs_diff_eq!(known[1], unknown[1], epsilon = 1e-7);
}

/// Law of a shoot beside a wall: tissue with a memory of the wall bends away from it.
struct Wall;

impl TropismLaw for Wall {
    fn declare(&self, to: &mut Declaration) {
        to.with_position().stimuli(1);
        to.variable(
            Variable::read_after(30.0)
                .relaxing_in(60.0)
                .turning(Rotation::Invariant),
        );
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli[0] = (site.position.x - 0.01).max(0.0).powi(4);
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        rates[0] = (stimuli[0] - variables[0]) / 60.0;
    }

    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(0.0, -1e10 * past[0], 0.0)
    }
}

/// A single shape can be unaffected by the wall. The check of the axis must compare several shapes.
#[test]
fn relative_orbits_beside_a_wall_on_one_side_are_refused() {
    let walled = shoot(0.067, 4)
        .tropism((steering(SettledStatoliths), Wall))
        .into_dyn()
        .build()
        .unwrap();
    let mut root = mode(&walled);
    // With this phase the first half of the swing lies on the free side of the wall.
    let turn = Complex::from_polar(1.0, 1.2);
    root.strain
        .iter_mut()
        .for_each(|strain| *strain = strain.map(|s| s * turn));
    for angle in [PI, 0.0] {
        let found = turning(12, angle).from_mode(&walled, &root, 0.034);
        assert!(
            matches!(found, Err(CycleError::NotInvariant { .. })),
            "{angle}: {found:?}"
        );
    }
    assert!(
        PeriodicSolver::default()
            .from_mode(&walled, &root, 0.034)
            .is_ok()
    );
}

/// Law with a constant variable that does not affect growth. The numerical value of the variable is
/// large.
struct Pressure;

impl TropismLaw for Pressure {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(
            Variable::read_after(1.0)
                .relaxing_in(600.0)
                .turning(Rotation::Invariant),
        );
    }

    fn sense(&self, _site: &Site, stimuli: &mut [f64]) {
        stimuli[0] = 1e6;
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        rates[0] = (stimuli[0] - variables[0]) / 600.0;
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

/// The variable is 1 MPa, expressed in Pa.
#[test]
fn period_does_not_depend_on_a_constant_variable_in_a_small_unit() {
    let pressed = shoot(0.067, 4)
        .tropism((steering(SettledStatoliths), Pressure))
        .into_dyn()
        .build()
        .unwrap();
    let found = PeriodicSolver::default()
        .from_mode(&pressed, &PLAIN.root, 0.034)
        .unwrap();
    assert_relative_eq!(
        found.period,
        PLAIN.swing.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

/// Statoliths that settle in a microsecond. Their rates are differences of large numbers.
#[test]
fn half_a_swing_with_very_fast_statoliths_has_the_period_of_settled_ones() {
    let fast = shoot(0.067, 4)
        .tropism(steering(Statoliths {
            avalanche_time: 1e-6,
        }))
        .into_dyn()
        .build()
        .unwrap();
    let found = turning(8, PI).from_mode(&fast, &PLAIN.root, 0.034).unwrap();
    assert_relative_eq!(
        2.0 * found.period,
        PLAIN.swing.period,
        epsilon = 0.0,
        max_relative = 1e-8
    );
}

#[test]
fn mode_that_is_straight_at_its_start_leads_to_the_same_swing() {
    let mut straight = PLAIN.root.clone();
    straight
        .strain
        .iter_mut()
        .for_each(|strain| *strain = strain.map(|s| s * Complex::i()));
    let found = PeriodicSolver::default()
        .from_mode(&PLAIN.shoot, &straight, 0.034)
        .unwrap();
    assert_relative_eq!(
        found.period,
        PLAIN.swing.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

/// Shoot of 6.7 cm on two elements. They suffice to compare relative periodic orbits with the swing
/// on the same mesh.
static COARSE: LazyLock<Plain> = LazyLock::new(|| Plain::new(2));

/// Returns the number of half swings in the period of the relative periodic orbit that is found
/// from a guess of the angle (rad), or `None` if the solver finds no orbit. Panics unless this
/// number is an integer and the angle is that number of half rotations.
fn half_swings(guess: f64) -> Option<f64> {
    let Plain { shoot, root, swing } = &*COARSE;
    let found = turning(8, guess).from_mode(shoot, root, 0.034).ok()?;
    let halves = 2.0 * found.period / swing.period;
    assert!(
        abs_diff_eq!(halves, halves.round(), epsilon = 1e-8),
        "{guess}: {halves} half swings"
    );
    // The sine vanishes if the difference is an integer number of full rotations.
    let excess = found.angle - PI * halves.round();
    assert!(
        abs_diff_eq!((0.5 * excess).sin(), 0.0, epsilon = 0.5e-8),
        "{guess}: angle {}, {halves}",
        found.angle
    );
    Some(halves)
}

#[test]
fn guesses_of_the_angle_near_half_a_turn_lead_to_half_a_swing() {
    for guess in [3.1, 3.2, -PI] {
        let halves = half_swings(guess);
        assert!(
            halves.is_some_and(|halves| abs_diff_eq!(halves, 1.0, epsilon = 1e-8)),
            "{guess}: {halves:?}"
        );
    }
}

/// Iterations from these guesses pass through decreasing periods, which need more intervals of the
/// history. An earlier version panicked there, because it kept a linearisation of the previous
/// size. The test accepts errors but no wrong orbits.
#[test]
fn guesses_of_the_angle_far_from_half_a_turn_lead_to_no_wrong_orbit() {
    for guess in [0.6, 1.6, 2.8, 3.4] {
        half_swings(guess);
    }
}
