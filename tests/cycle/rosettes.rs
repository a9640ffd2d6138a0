//! Relative periodic orbits, x(T) = R(φ) x(0), that are half swings or rosettes.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::{family, mode, planes, shoot};
use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, STATOLITHS, steering};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::{
    Bifurcation, BranchPoint, Continuation, CycleError, PeriodicOrbit, PeriodicSolver,
    RotatingWave, RotatingWaveSolver,
};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, Root};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Perception, Proprioception, Remembered, Response, Site, Source,
};
use morphorod::{DynLaws, Section, Shoot};
use nalgebra::Rotation2;

/// Perception of the vertical, rotated by a small angle (rad) about the axis of the shoot. The
/// shoot winds.
pub(super) struct Askew(pub(super) f64);

impl Perception for Askew {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&-site.environment.gravity.normalize());
        let turned = Rotation2::new(self.0) * up.xy();
        stimuli.copy_from_slice(turned.as_slice());
    }
}

pub(super) type Winding = (
    Remembered<DirectionalTropism<Askew>>,
    Remembered<Proprioception>,
);

pub(super) fn winding(askew: f64) -> Winding {
    (
        DirectionalTropism {
            sensitivity: BETA,
            perception: Askew(askew),
        }
        .remembered(MEMORY),
        Proprioception { sensitivity: ETA }.remembered(MEMORY),
    )
}

/// Shoot of 6.7 cm, its leading mode and its swing, the reference of many tests.
pub(super) struct Plain {
    pub(super) shoot: Shoot<DynLaws>,
    pub(super) root: Root,
    pub(super) swing: PeriodicOrbit,
}

impl Plain {
    pub(super) fn new(elements: u32) -> Self {
        let shoot = shoot(0.0670, elements).into_dyn().build().unwrap();
        let root = mode(&shoot);
        let swing = PeriodicSolver::default()
            .from_mode(&shoot, &root, 0.034)
            .unwrap();
        Self { shoot, root, swing }
    }
}

pub(super) static PLAIN: LazyLock<Plain> = LazyLock::new(|| Plain::new(4));

/// Solver for relative periodic orbits with an initial guess of the angle (rad).
pub(super) fn turning(intervals: usize, angle: f64) -> PeriodicSolver {
    PeriodicSolver {
        intervals,
        angle: Some(angle),
        ..PeriodicSolver::default()
    }
}

pub(super) fn excursion(orbit: &PeriodicOrbit, shoot: &Shoot<DynLaws>) -> f64 {
    orbit.largest_excursion(shoot).unwrap().0
}

/// Largest growth rates of disturbances in the plane and out of it (1/h), without the trivial ones,
/// and the larger error of the trivial multipliers.
pub(super) fn rates(orbit: &PeriodicOrbit, shoot: &Shoot<DynLaws>) -> ([f64; 2], f64) {
    let found = orbit.multipliers(shoot, 1).unwrap();
    (
        planes(&found.values).map(|set| set[0].value.norm().ln() / orbit.period * HOUR),
        found.trivial,
    )
}

/// Compares half a swing with the whole swing. The reference values are those of `cycles`: length
/// (m), excursion (mm), period (min), and rates in the plane and out of it (1/h).
fn assert_half_swing(length: f64, largest: f64, period: f64, known: [f64; 2]) {
    let shoot = shoot(length, 8).into_dyn().build().unwrap();
    let root = mode(&shoot);
    let half = turning(8, PI)
        .from_mode(&shoot, &root, 1e-3 * largest)
        .unwrap();
    // Required accuracy of whole swings: 1e-8 of excursion and period, 1e-6 of the rates.
    assert_abs_diff_eq!(half.angle, PI, epsilon = 1e-9);
    assert_relative_eq!(
        1e3 * excursion(&half, &shoot),
        largest,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_relative_eq!(
        2.0 * half.period / MINUTE,
        period,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    let (found, defect) = rates(&half, &shoot);
    assert_abs_diff_eq!(found[..], known[..], epsilon = 1e-7);
    assert!(defect < 1e-8, "{defect:e}");
    let whole = PeriodicSolver::default()
        .from_mode(&shoot, &root, 1e-3 * largest)
        .unwrap();
    assert_eq!(whole.angle, 0.0);
    assert!(
        half.equilibria < 2 * whole.equilibria / 3,
        "{} {}",
        half.equilibria,
        whole.equilibria
    );
    // Each orbit is an initial guess for the other.
    let back = PeriodicSolver::default().from_orbit(&shoot, &half).unwrap();
    let again = turning(8, PI).from_orbit(&shoot, &whole).unwrap();
    assert_relative_eq!(
        back.period,
        whole.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert_relative_eq!(
        again.period,
        half.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert!(
        back.iterations <= 3 && again.iterations <= 3,
        "{} {}",
        back.iterations,
        again.iterations
    );
}

#[test]
fn half_a_swing_at_6_59_cm_has_the_values_of_the_whole_swing() {
    assert_half_swing(
        0.0659,
        16.766135125,
        87.639390134,
        [-0.0627567395, 0.0213561488],
    );
}

#[test]
fn half_a_swing_at_6_70_cm_has_the_values_of_the_whole_swing() {
    assert_half_swing(
        0.0670,
        34.194086156,
        87.661715125,
        [-0.2867102380, 0.1052756418],
    );
}

/// The rotation of a half swing applies to variables that rotate as vectors, here the normals of
/// statoliths.
#[test]
fn half_a_swing_with_statoliths_is_half_of_the_whole_swing() {
    let shoot = shoot(0.0670, 4)
        .tropism(steering(STATOLITHS))
        .into_dyn()
        .build()
        .unwrap();
    let root = mode(&shoot);
    let half = turning(8, PI).from_mode(&shoot, &root, 0.04).unwrap();
    let whole = PeriodicSolver::default()
        .from_mode(&shoot, &root, 0.04)
        .unwrap();
    // The two problems are identical on the same grid, and each is solved to a tolerance of 1e-10.
    assert_relative_eq!(
        2.0 * half.period,
        whole.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );
    assert_relative_eq!(
        excursion(&half, &shoot),
        excursion(&whole, &shoot),
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert!(
        whole.period > 90.0 * MINUTE,
        "slower than without statoliths"
    );
}

/// Near the onset, the amplitudes z₊ and z₋ of circles of the two senses of rotation satisfy ż± =
/// z± (σ± − a |z±|² − 2a |z∓|²). The cross coefficients are twice the self coefficients
/// (docs/cycles.md). The ratio κ = Im a/Re a equals that of dσ/dℓ, since the period of circles does
/// not depend on their radius. Then |z±|² = (2 Re σ∓ − Re σ±)/(3 Re a), and the phases change at
/// the rates Im σ± − κ Re σ±. The plane of the swing rotates at half their difference.
#[test]
fn plane_of_swing_of_a_winding_shoot_rotates_at_the_predicted_rate() {
    let length = 0.0657;
    let plane = {
        let shoot = shoot(length, 4)
            .tropism(winding(0.0))
            .into_dyn()
            .build()
            .unwrap();
        turning(12, 0.0)
            .from_mode(&shoot, &mode(&shoot), 0.009)
            .unwrap()
    };
    assert_abs_diff_eq!(plane.angle, 0.0, epsilon = 1e-9);
    let rosette = |askew: f64| {
        let shoot = shoot(length, 4)
            .tropism(winding(askew))
            .into_dyn()
            .build()
            .unwrap();
        let orbit = turning(12, 0.0).from_orbit(&shoot, &plane).unwrap();
        (shoot, orbit)
    };
    let askew = 1e-3;
    let (mut there, orbit) = rosette(askew);
    // The orbit at the opposite angle is the mirror image.
    let (_, back) = rosette(-askew);
    assert_abs_diff_eq!(orbit.angle, -back.angle, epsilon = 1e-9);
    assert_relative_eq!(
        orbit.period,
        back.period,
        epsilon = 0.0,
        max_relative = 1e-9
    );

    let roots = Linearisation::about(&there).unwrap().roots(1e-7).unwrap();
    let sense = |root: &Root| (root.strain[0].y / root.strain[0].x).im;
    // Re[(1, −i) exp(iωt)] rotates counterclockwise.
    let left = roots.iter().find(|root| sense(root) < -0.99).unwrap().value;
    let right = roots.iter().find(|root| sense(root) > 0.99).unwrap().value;
    let kappa = 1.177927160 / 1.119568989;
    let expected = 0.5 * ((left.im - right.im) - kappa * (left.re - right.re));
    // The relative error is the growth rate over the frequency, 2e-3.
    assert_relative_eq!(
        orbit.angle / orbit.period,
        expected,
        epsilon = 0.0,
        max_relative = 4e-3
    );

    // In an integration in time, the tip rotates by the angle in each period.
    let history = orbit.enter(&mut there).unwrap();
    let mut run = MethodOfSteps::new(orbit.period / 240.0);
    run.start(&mut there, &history).unwrap();
    let before = there.tip();
    run.advance(&mut there, orbit.period).unwrap();
    let expected = Rotation2::new(orbit.angle) * before.xy();
    // The error due to the step size is 3e-9 of the length. The rotation moves the tip by 2e-4 of
    // the length.
    assert_abs_diff_eq!(
        InNorm(there.tip().xy()),
        InNorm(expected),
        epsilon = 1e-8 * length
    );
    assert!((expected - before.xy()).norm() > 1e-4 * length);
    // The state of a run is an initial guess.
    let again = turning(12, orbit.angle)
        .from_run(&there, orbit.period)
        .unwrap();
    assert!(again.iterations <= 3, "{}", again.iterations);
    assert_abs_diff_eq!(again.angle, orbit.angle, epsilon = 1e-8);
}

/// Length of the shoots on branches over the angle of winding, m.
const WINDING: f64 = 0.0657;
/// Largest angle of winding, rad.
const LARGEST_ANGLE: f64 = 0.005;

/// Family of shoots over the angle of winding (rad). Two elements suffice, since circles and
/// rosettes are compared on the same mesh.
fn winding_shoots() -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    family(|askew| {
        Ok(shoot(WINDING, 2)
            .tropism(winding(askew))
            .into_dyn()
            .build()?)
    })
}

/// Bifurcations on the branch of circles of one sense of rotation, along the angle of winding.
fn bifurcations_of_circles(sense: f64) -> Vec<BranchPoint<RotatingWave>> {
    let straight = winding_shoots()(0.0).unwrap();
    let mut root = mode(&straight);
    if sense < 0.0 {
        root.value = root.value.conj();
        root.strain
            .iter_mut()
            .for_each(|strain| *strain = strain.map(|x| x.conj()));
    }
    let solver = RotatingWaveSolver::default();
    let circle = solver.from_mode(&straight, &root, 0.009).unwrap();
    let branch = Continuation::from_orbit(
        solver,
        winding_shoots(),
        &circle,
        0.0,
        5e-4,
        0.0..=LARGEST_ANGLE,
    )
    .unwrap();
    let points: Vec<_> = branch
        .largest_step(0.3)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(points.last().unwrap().parameter, LARGEST_ANGLE);
    points
        .into_iter()
        .filter(|point| point.bifurcation.is_some())
        .collect()
}

/// Bifurcations of circles of both senses of rotation, shared by two tests.
static BIFURCATIONS: LazyLock<Vec<BranchPoint<RotatingWave>>> =
    LazyLock::new(|| [1.0, -1.0].map(bifurcations_of_circles).concat());

/// Circles of one sense of rotation lose their stability along the branch, and those of the other
/// sense remain stable.
#[test]
fn circles_of_one_sense_lose_stability_with_a_pair_of_twice_their_rate() {
    let [torus] = &BIFURCATIONS[..] else {
        panic!("{}", BIFURCATIONS.len())
    };
    assert_eq!(torus.bifurcation, Some(Bifurcation::Torus));
    let pair = torus.exponents.iter().next().unwrap();
    assert_abs_diff_eq!(pair.im.abs() / torus.orbit.rate.abs(), 2.0, epsilon = 0.01);
}

/// The same rosettes exist beyond the circle, with a plane rotated by a quarter of a full rotation.
/// The branch must not return them again.
#[test]
fn branch_of_rosettes_ends_at_the_torus_bifurcation_of_circles() {
    let straight = winding_shoots()(0.0).unwrap();
    let solver = turning(10, 0.0);
    // The branch starts at a swing in a plane, which is mirror symmetric. The parameter is at the
    // limit of the range.
    let swing = solver
        .from_mode(&straight, &mode(&straight), 0.009)
        .unwrap();
    let branch = Continuation::from_orbit(
        solver,
        winding_shoots(),
        &swing,
        0.0,
        5e-4,
        0.0..=LARGEST_ANGLE,
    );
    let rosettes: Vec<_> = branch
        .unwrap()
        .largest_step(0.1)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert!(
        rosettes
            .windows(2)
            .all(|pair| pair[0].parameter < pair[1].parameter)
    );
    // As for planar swings, one disturbance out of the plane grows. The branch has no bifurcation.
    assert!(
        rosettes
            .iter()
            .all(|point| point.bifurcation.is_none() && point.unstable() == 1)
    );
    assert!(rosettes.iter().all(|point| point.trivial < 1e-8));
    let torus = &BIFURCATIONS[0];
    let last = rosettes.last().unwrap();
    assert!(
        last.parameter < torus.parameter && last.parameter > 0.98 * torus.parameter,
        "{}",
        last.parameter
    );
    // The excursion of a swing is √(4/3) times the radius of the circle. The branch ends near the
    // circle.
    assert!(
        last.excursion < 1.08 * torus.excursion && last.excursion > torus.excursion,
        "{}",
        last.excursion
    );
}

/// Shoot with a slightly elliptic section, which has no axis of symmetry.
#[test]
fn relative_orbits_of_shoots_without_an_axis_of_symmetry_are_refused() {
    let flat = shoot(0.0670, 4)
        .section(|_| Section::ellipse(1.01 * RADIUS, RADIUS))
        .into_dyn()
        .build()
        .unwrap();
    let found = turning(8, PI).from_mode(&flat, &PLAIN.root, 0.034);
    assert!(
        matches!(found, Err(CycleError::NotInvariant { .. })),
        "{found:?}"
    );
}

/// Leading mode of a winding shoot. The mode is circular.
fn circular_mode() -> Root {
    mode(
        &shoot(0.0670, 4)
            .tropism(winding(1e-3))
            .into_dyn()
            .build()
            .unwrap(),
    )
}

/// A circle satisfies x(T) = R(φ) x(0) for any T. Its period as a relative periodic orbit is not
/// determined.
#[test]
fn circles_are_refused_as_relative_orbits() {
    let error = turning(16, 0.0)
        .from_mode(&PLAIN.shoot, &circular_mode(), 0.03)
        .unwrap_err();
    assert!(matches!(error, CycleError::RotatingWave), "{error}");
}

#[test]
fn circle_found_as_a_periodic_orbit_is_refused_as_a_relative_one() {
    let Plain { shoot, root, .. } = &*PLAIN;
    let circle = RotatingWaveSolver::default()
        .from_mode(shoot, root, 0.03)
        .unwrap();
    let orbit = PeriodicSolver::default()
        .from_mode(shoot, &circular_mode(), 0.03)
        .unwrap();
    assert_relative_eq!(
        orbit.period,
        circle.period(),
        epsilon = 0.0,
        max_relative = 1e-8
    );
    let error = turning(16, 0.0).from_orbit(shoot, &orbit).unwrap_err();
    assert!(matches!(error, CycleError::RotatingWave), "{error}");
}
