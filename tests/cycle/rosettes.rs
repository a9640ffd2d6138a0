//! Relative periodic orbits, x(T) = R(φ) x(0): half swings, rosettes, and initial guesses from runs in time.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::{family, mode, shoot};
use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, STATOLITHS, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_abs_diff_ne, assert_relative_eq};
use morphorod::cycle::{
    Branch, BranchPoint, CircularOrbit, CircularSolver, CycleError, PeriodicOrbit, PeriodicSolver, Special, Turning,
};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, Root};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Growing, Oscillator, Perception, Proprioception, Remembered, Response, Rotation,
    SettledStatoliths, Site, Source, Statoliths, TropismLaw, Variable,
};
use morphorod::{DynLaws, Section, Shoot};
use nalgebra::{Complex, Rotation2, Vector3};

/// Tissue that responds to the vertical in a direction that is rotated by a small angle (rad): the shoot winds.
struct Askew(f64);

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

type Winding = (Remembered<DirectionalTropism<Askew>>, Remembered<Proprioception>);

fn winding(askew: f64) -> Winding {
    (
        DirectionalTropism { sensitivity: BETA, perception: Askew(askew) }.remembered(MEMORY),
        Proprioception { sensitivity: ETA }.remembered(MEMORY),
    )
}

/// The shoot of 6.7 cm, its leading mode and its swing, with which many tests compare.
struct Plain {
    shoot: Shoot<DynLaws>,
    root: Root,
    swing: PeriodicOrbit,
}

impl Plain {
    fn new(elements: u32) -> Self {
        let shoot = shoot(0.0670, elements).into_dyn().build().unwrap();
        let root = mode(&shoot);
        let swing = PeriodicSolver::default().from_mode(&shoot, &root, 0.034).unwrap();
        Self { shoot, root, swing }
    }
}

static PLAIN: LazyLock<Plain> = LazyLock::new(|| Plain::new(4));

/// A solver for orbits that are rotated after a period, with an initial guess of the angle.
fn turning(intervals: usize, angle: f64) -> PeriodicSolver {
    PeriodicSolver { intervals, angle: Some(angle), ..PeriodicSolver::default() }
}

fn excursion(orbit: &PeriodicOrbit, shoot: &Shoot<DynLaws>) -> f64 {
    orbit.largest_excursion(shoot).unwrap().0
}

/// The largest growth rates of disturbances in the plane and out of it (1/h), without the trivial ones, and the larger defect of the
/// trivial multipliers.
fn rates(orbit: &PeriodicOrbit, shoot: &Shoot<DynLaws>) -> ([f64; 2], f64) {
    let mut largest = 0.0_f64;
    let rates = orbit.multipliers(shoot, 16).unwrap().map(|mut set| {
        let defect = |k: &usize| (set[*k].value - 1.0).norm();
        let trivial = (0..set.len()).min_by(|a, b| defect(a).total_cmp(&defect(b))).unwrap();
        largest = largest.max(defect(&trivial));
        set.remove(trivial);
        set[0].root(orbit.period).re * HOUR
    });
    (rates, largest)
}

/// Compares half a swing with the whole one. Known are the length (m), excursion (mm), period (min), and rates in the plane and out of
/// it (1/h), those of `cycles`.
fn assert_half_swing(length: f64, largest: f64, period: f64, known: [f64; 2]) {
    let shoot = shoot(length, 8).into_dyn().build().unwrap();
    let root = mode(&shoot);
    let half = turning(8, PI).from_mode(&shoot, &root, 1e-3 * largest).unwrap();
    // The promises for whole swings: 1e-8 of excursion and period, 1e-6 of the rates.
    assert_abs_diff_eq!(half.angle, PI, epsilon = 1e-9);
    assert_relative_eq!(1e3 * excursion(&half, &shoot), largest, epsilon = 0.0, max_relative = 1e-8);
    assert_relative_eq!(2.0 * half.period / MINUTE, period, epsilon = 0.0, max_relative = 1e-8);
    let (found, defect) = rates(&half, &shoot);
    assert_abs_diff_eq!(found[..], known[..], epsilon = 1e-7);
    assert!(defect < 1e-8, "{defect:e}");
    let whole = PeriodicSolver::default().from_mode(&shoot, &root, 1e-3 * largest).unwrap();
    assert_eq!(whole.angle, 0.0);
    assert!(half.equilibria < 2 * whole.equilibria / 3, "{} {}", half.equilibria, whole.equilibria);
    // Each is an initial guess for the other.
    let back = PeriodicSolver::default().from_orbit(&shoot, &half).unwrap();
    let again = turning(8, PI).from_orbit(&shoot, &whole).unwrap();
    assert_relative_eq!(back.period, whole.period, epsilon = 0.0, max_relative = 1e-9);
    assert_relative_eq!(again.period, half.period, epsilon = 0.0, max_relative = 1e-9);
    assert!(back.iterations <= 3 && again.iterations <= 3, "{} {}", back.iterations, again.iterations);
}

#[test]
fn half_a_swing_at_6_59_cm_has_the_values_of_the_whole_swing() {
    assert_half_swing(0.0659, 16.766135125, 87.639390134, [-0.0627567395, 0.0213561488]);
}

#[test]
fn half_a_swing_at_6_70_cm_has_the_values_of_the_whole_swing() {
    assert_half_swing(0.0670, 34.194086156, 87.661715125, [-0.2867102380, 0.1052756418]);
}

/// The rotation of a half swing applies to variables that rotate as vectors, here the normals of statoliths.
#[test]
fn half_a_swing_with_statoliths_is_half_of_the_whole_swing() {
    let shoot = shoot(0.0670, 4).tropism(steering(STATOLITHS)).into_dyn().build().unwrap();
    let root = mode(&shoot);
    let half = turning(8, PI).from_mode(&shoot, &root, 0.04).unwrap();
    let whole = PeriodicSolver::default().from_mode(&shoot, &root, 0.04).unwrap();
    // Both are the same problem on the same grid, each solved to 1e-10.
    assert_relative_eq!(2.0 * half.period, whole.period, epsilon = 0.0, max_relative = 1e-9);
    assert_relative_eq!(excursion(&half, &shoot), excursion(&whole, &shoot), epsilon = 0.0, max_relative = 1e-8);
    assert!(whole.period > 90.0 * MINUTE, "slower than without statoliths");
}

/// Near the onset, circles of the two senses of rotation have amplitudes z₊ and z₋ with ż± = z± (σ± − a |z±|² − 2a |z∓|²). The cross
/// coefficients are twice the self coefficients (docs/cycles.md). Im a/Re a = κ is that of dσ/dℓ, since the period of circles does not
/// depend on their radius. Then |z±|² = (2 Re σ∓ − Re σ±)/(3 Re a), and the phases change at the rates Im σ± − κ Re σ±. The plane of
/// the swing rotates at half their difference.
#[test]
fn plane_of_swing_of_a_winding_shoot_rotates_at_the_predicted_rate() {
    let length = 0.0657;
    let plane = {
        let shoot = shoot(length, 4).tropism(winding(0.0)).into_dyn().build().unwrap();
        turning(12, 0.0).from_mode(&shoot, &mode(&shoot), 0.009).unwrap()
    };
    assert_abs_diff_eq!(plane.angle, 0.0, epsilon = 1e-9);
    let rosette = |askew: f64| {
        let shoot = shoot(length, 4).tropism(winding(askew)).into_dyn().build().unwrap();
        let orbit = turning(12, 0.0).from_orbit(&shoot, &plane).unwrap();
        (shoot, orbit)
    };
    let askew = 1e-3;
    let (mut there, orbit) = rosette(askew);
    // The mirror image.
    let (_, back) = rosette(-askew);
    assert_abs_diff_eq!(orbit.angle, -back.angle, epsilon = 1e-9);
    assert_relative_eq!(orbit.period, back.period, epsilon = 0.0, max_relative = 1e-9);

    let roots = Linearisation::about(&there).unwrap().roots(1e-7).unwrap();
    let sense = |root: &Root| (root.strain[0].y / root.strain[0].x).im;
    // Re[(1, −i) exp(iωt)] rotates counterclockwise.
    let left = roots.iter().find(|root| sense(root) < -0.99).unwrap().value;
    let right = roots.iter().find(|root| sense(root) > 0.99).unwrap().value;
    let kappa = 1.177927160 / 1.119568989;
    let expected = 0.5 * ((left.im - right.im) - kappa * (left.re - right.re));
    // The relative error is the growth rate over the frequency, 2e-3.
    assert_relative_eq!(orbit.angle / orbit.period, expected, epsilon = 0.0, max_relative = 4e-3);

    // The same in time: after a period the tip has rotated by the angle.
    let history = orbit.enter(&mut there).unwrap();
    let mut run = MethodOfSteps::new(orbit.period / 240.0);
    run.start(&mut there, &history).unwrap();
    let before = there.tip();
    run.advance(&mut there, orbit.period).unwrap();
    let expected = Rotation2::new(orbit.angle) * before.xy();
    // The step leaves 3e-9 of the length. The rotation moves the tip by 2e-4 of it.
    assert_abs_diff_eq!(there.tip().xy(), expected, epsilon = 1e-8 * length);
    assert!((expected - before.xy()).norm() > 1e-4 * length);
    // The state of a run is an initial guess.
    let again = turning(12, orbit.angle).from_run(&there, orbit.period).unwrap();
    assert!(again.iterations <= 3, "{}", again.iterations);
    assert_abs_diff_eq!(again.angle, orbit.angle, epsilon = 1e-8);
}

/// Length of the shoots whose branches over the angle of winding are followed, m.
const WINDING: f64 = 0.0657;
/// Largest angle of winding, rad.
const LARGEST_ANGLE: f64 = 0.005;

/// Two elements suffice, as circles and rosettes on the same mesh are compared.
fn winding_shoots() -> impl FnMut(f64) -> Result<Shoot<DynLaws>, CycleError> + Clone {
    family(|askew| Ok(shoot(WINDING, 2).tropism(winding(askew)).into_dyn().build()?))
}

/// Bifurcations on the branch of circles of one sense of rotation, over the angle of winding.
fn bifurcations_of_circles(sense: f64) -> Vec<BranchPoint<CircularOrbit>> {
    let straight = winding_shoots()(0.0).unwrap();
    let mut start = Turning::of_mode(&mode(&straight), 0.009);
    start.rate *= sense;
    start.strain.iter_mut().for_each(|strain| strain.y *= sense);
    let solver = CircularSolver::default();
    let circle = solver.solve(&straight, &start).unwrap();
    let branch = Branch::from_orbit(solver, winding_shoots(), &circle, 0.0, 5e-4, 0.0..=LARGEST_ANGLE).unwrap();
    let points: Vec<_> = branch.largest_step(0.3).unwrap().map(Result::unwrap).collect();
    assert_eq!(points.last().unwrap().parameter, LARGEST_ANGLE);
    points.into_iter().filter(|point| point.special.is_some()).collect()
}

/// Bifurcations of circles of both senses of rotation, which two tests read.
static BIFURCATIONS: LazyLock<Vec<BranchPoint<CircularOrbit>>> =
    LazyLock::new(|| [1.0, -1.0].map(bifurcations_of_circles).concat());

/// Circles that rotate against the sense of winding lose their stability, those that rotate with it do not.
#[test]
fn circles_against_the_winding_lose_stability_with_a_pair_of_twice_their_rate() {
    let [torus] = &BIFURCATIONS[..] else { panic!("{}", BIFURCATIONS.len()) };
    assert_eq!(torus.special, Some(Special::Torus));
    let pair = torus.exponents[0][0];
    assert_abs_diff_eq!(pair.im.abs() / torus.orbit.rate.abs(), 2.0, epsilon = 0.01);
}

/// Beyond the circle there are the same rosettes, a quarter of a turn later: the branch must not return them again.
#[test]
fn branch_of_rosettes_ends_at_the_torus_bifurcation_of_circles() {
    let straight = winding_shoots()(0.0).unwrap();
    let solver = turning(10, 0.0);
    let swing = solver.from_mode(&straight, &mode(&straight), 0.009).unwrap();
    // The branch ends at an angle of 0.0035 and starts a good half of the way from the swing to there.
    let start = 0.002;
    let rosette = solver.from_orbit(&winding_shoots()(start).unwrap(), &swing).unwrap();
    let branch = Branch::from_orbit(solver, winding_shoots(), &rosette, start, 5e-4, 0.0..=LARGEST_ANGLE);
    let rosettes: Vec<_> = branch.unwrap().largest_step(0.1).unwrap().map(Result::unwrap).collect();
    assert!(rosettes.windows(2).all(|pair| pair[0].parameter < pair[1].parameter));
    // The disturbance that moves a swing out of its plane grows here, too, and there is no bifurcation on the branch.
    assert!(rosettes.iter().all(|point| point.special.is_none() && point.unstable() == 1));
    assert!(rosettes.iter().all(|point| point.trivial < 1e-8));
    let torus = &BIFURCATIONS[0];
    let last = rosettes.last().unwrap();
    assert!(last.parameter < torus.parameter && last.parameter > 0.98 * torus.parameter, "{}", last.parameter);
    // A swing is √(4/3) times as wide as the circle. The branch ends next to the circle.
    assert!(last.excursion < 1.08 * torus.excursion && last.excursion > torus.excursion, "{}", last.excursion);
}

/// The shoot of 6.7 cm, bent about an axis that is no director's and released. After five hours it is near the swing about that axis.
static RELEASED: LazyLock<Shoot<DynLaws>> = LazyLock::new(|| {
    let mut run = PLAIN.shoot.clone();
    run.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut run, 5.0 * HOUR).unwrap();
    run
});

#[test]
fn run_in_time_is_an_initial_guess_for_whole_and_half_swings() {
    let Plain { shoot: plain, swing, .. } = &*PLAIN;
    let (expected, _) = rates(swing, plain);
    for (solver, share) in [(PeriodicSolver::default(), 1.0), (turning(8, PI), 0.5)] {
        let found = solver.from_run(&RELEASED, 95.0 * MINUTE * share).unwrap();
        assert_relative_eq!(found.period, share * swing.period, epsilon = 0.0, max_relative = 1e-9);
        let (one, other) = (excursion(&found, &RELEASED), excursion(swing, plain));
        assert_relative_eq!(one, other, epsilon = 0.0, max_relative = 1e-8);
        // The rates in that plane and out of it are found although no director lies in the plane.
        let (found, defect) = rates(&found, &RELEASED);
        assert_abs_diff_eq!(found[..], expected[..], epsilon = 1e-7);
        assert!(defect < 1e-8, "{defect:e}");
    }
}

/// A bent shoot whose past has no effect yet is on no orbit, but near enough.
#[test]
fn bent_shoot_without_a_past_is_an_initial_guess() {
    let mut rest = PLAIN.shoot.clone();
    rest.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut rest, 0.0).unwrap();
    let found = PeriodicSolver::default().from_run(&rest, 87.0 * MINUTE).unwrap();
    assert_relative_eq!(found.period, PLAIN.swing.period, epsilon = 0.0, max_relative = 1e-9);
}

/// Rounding errors of the shape must not make the solver for forced orbits leave the stationary state.
#[test]
fn forced_orbit_of_a_shoot_without_forcing_is_stationary() {
    let mut still = PLAIN.shoot.clone();
    still.set_intrinsic(|_| Vector3::new(0.0, 3.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut still, HOUR).unwrap();
    let standing = PeriodicSolver::default().forced(&still, 90.0 * MINUTE).unwrap();
    assert!(excursion(&standing, &still) < 1e-9, "{}", excursion(&standing, &still));
}

#[test]
fn shape_of_a_swinging_shoot_is_an_initial_guess_for_a_circle() {
    let solver = CircularSolver::default();
    let circle = solver.solve(&PLAIN.shoot, &Turning::of_mode(&PLAIN.root, 0.03)).unwrap();
    let found = solver.solve(&RELEASED, &Turning::of_rod(RELEASED.rod(), PLAIN.root.value.im)).unwrap();
    assert_relative_eq!(found.radius(), circle.radius(), epsilon = 0.0, max_relative = 1e-9);
}

/// A section with two principal axes.
#[test]
fn relative_orbits_of_shoots_without_an_axis_of_symmetry_are_refused() {
    let flat = shoot(0.0670, 4).section(|_| Section::ellipse(1.01 * RADIUS, RADIUS)).into_dyn().build().unwrap();
    let found = turning(8, PI).from_mode(&flat, &PLAIN.root, 0.034);
    assert!(matches!(found, Err(CycleError::NoAxis { .. })), "{found:?}");
}

/// The leading mode of a shoot that winds: it rotates.
fn circular_mode() -> Root {
    mode(&shoot(0.0670, 4).tropism(winding(1e-3)).into_dyn().build().unwrap())
}

/// A circle is rotated after any time: its period as a relative orbit is not determined.
#[test]
fn circles_are_refused_as_relative_orbits() {
    let error = turning(16, 0.0).from_mode(&PLAIN.shoot, &circular_mode(), 0.03).unwrap_err();
    assert!(matches!(error, CycleError::Circle), "{error}");
}

#[test]
fn circle_found_as_a_periodic_orbit_is_refused_as_a_relative_one() {
    let Plain { shoot, root, .. } = &*PLAIN;
    let circle = CircularSolver::default().solve(shoot, &Turning::of_mode(root, 0.03)).unwrap();
    let orbit = PeriodicSolver::default().from_mode(shoot, &circular_mode(), 0.03).unwrap();
    assert_relative_eq!(orbit.period, circle.period(), epsilon = 0.0, max_relative = 1e-8);
    let error = turning(16, 0.0).from_orbit(shoot, &orbit).unwrap_err();
    assert!(matches!(error, CycleError::Circle), "{error}");
}

/// A law that does not declare how its variables rotate has periodic orbits, but no relative ones.
#[test]
fn relative_orbits_of_laws_without_declared_rotation_are_refused() {
    struct Silent;
    impl Perception for Silent {
        type Signal = [f64; 2];
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            Askew(0.0).sense(site, stimuli);
        }
    }
    let law = DirectionalTropism { sensitivity: BETA, perception: Silent }.remembered(MEMORY);
    let silent = shoot(0.0670, 4).tropism((winding(0.0).1, law)).into_dyn().build().unwrap();
    let error = turning(8, PI).from_mode(&silent, &PLAIN.root, 0.034).unwrap_err();
    assert!(matches!(error, CycleError::Undeclared { variable: 2 }), "{error}");
    assert!(PeriodicSolver::default().from_mode(&silent, &PLAIN.root, 0.034).is_ok());
}

/// A forced orbit has no angle, an angle is finite, and a shoot that has not moved is no run.
#[test]
fn invalid_angles_and_runs_are_refused_by_name() {
    let Plain { shoot: plain, root, .. } = &*PLAIN;
    let driven =
        shoot(0.05, 4).tropism((Oscillator::new(1e-3, 1440.0), steering(STATOLITHS))).into_dyn().build().unwrap();
    let parameter = |error: CycleError, name: &str| matches!(&error, CycleError::Parameter(e) if e.name == name);
    assert!(parameter(turning(8, PI).forced(&driven, 1440.0).unwrap_err(), "angle of a cycle that is driven"));
    let error = turning(8, f64::NAN).from_mode(plain, root, 0.034).unwrap_err();
    assert!(parameter(error, "angle of a periodic orbit"));
    let error = PeriodicSolver::default().from_run(plain, 5000.0).unwrap_err();
    assert!(parameter(error, "levels of the history of the run"));
}

/// Tissue that remembers how far it bends about the direction in which it leans: zero on a swing, and of opposite sign in its mirror image.
struct Sidelong {
    declared: bool,
}

impl TropismLaw for Sidelong {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(3);
        let variable = Variable::read_after(MEMORY.delay).relaxing_in(MEMORY.time);
        let turning = |rotation| if self.declared { variable.turning(rotation) } else { variable };
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

/// Pseudoscalars were once taken for quantities that a reflection leaves unchanged.
#[test]
fn variables_of_opposite_sign_in_the_mirror_image_change_only_rates_out_of_the_plane() {
    // The rates in the plane and out of it, for a law that declares how its variables rotate and for one that does not.
    let [known, unknown] = [true, false].map(|declared| {
        let shoot =
            shoot(0.067, 4).tropism((steering(SettledStatoliths), Sidelong { declared })).into_dyn().build().unwrap();
        let swing = PeriodicSolver::default().from_mode(&shoot, &mode(&shoot), 0.034).unwrap();
        rates(&swing, &shoot).0
    });
    let plain = [-0.286710238, 0.105275642];
    assert_abs_diff_eq!(known[0], plain[0], epsilon = 1e-6);
    assert_abs_diff_ne!(known[1], plain[1], epsilon = 1e-3);
    assert_abs_diff_eq!(known[1], unknown[1], epsilon = 1e-7);
}

/// A wall beside the shoot, on one side: tissue that remembers the wall bends away.
struct Wall;

impl TropismLaw for Wall {
    fn declare(&self, to: &mut Declaration) {
        to.with_position().stimuli(1);
        to.variable(Variable::read_after(30.0).relaxing_in(60.0).turning(Rotation::Invariant));
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

/// One shape does not show the wall; the check of the axis must compare several.
#[test]
fn relative_orbits_beside_a_wall_on_one_side_are_refused() {
    let walled = shoot(0.067, 4).tropism((steering(SettledStatoliths), Wall)).into_dyn().build().unwrap();
    let mut root = mode(&walled);
    // The first half of the swing lies on the free side, whatever the phase.
    let turn = Complex::from_polar(1.0, 1.2);
    root.strain.iter_mut().for_each(|strain| *strain = strain.map(|s| s * turn));
    for angle in [PI, 0.0] {
        let found = turning(12, angle).from_mode(&walled, &root, 0.034);
        assert!(matches!(found, Err(CycleError::NoAxis { .. })), "{angle}: {found:?}");
    }
    assert!(PeriodicSolver::default().from_mode(&walled, &root, 0.034).is_ok());
}

/// A constant variable that affects no growth, in a unit in which its number is large.
struct Pressure;

impl TropismLaw for Pressure {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(Variable::read_after(1.0).relaxing_in(600.0).turning(Rotation::Invariant));
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

/// A variable of a megapascal, in pascals.
#[test]
fn period_does_not_depend_on_a_constant_variable_in_a_small_unit() {
    let pressed = shoot(0.067, 4).tropism((steering(SettledStatoliths), Pressure)).into_dyn().build().unwrap();
    let found = PeriodicSolver::default().from_mode(&pressed, &PLAIN.root, 0.034).unwrap();
    assert_relative_eq!(found.period, PLAIN.swing.period, epsilon = 0.0, max_relative = 1e-9);
}

/// Statoliths that settle in a microsecond: their rates are differences of large numbers.
#[test]
fn half_a_swing_with_very_fast_statoliths_has_the_period_of_settled_ones() {
    let fast = shoot(0.067, 4).tropism(steering(Statoliths { avalanche_time: 1e-6 })).into_dyn().build().unwrap();
    let found = turning(8, PI).from_mode(&fast, &PLAIN.root, 0.034).unwrap();
    assert_relative_eq!(2.0 * found.period, PLAIN.swing.period, epsilon = 0.0, max_relative = 1e-8);
}

#[test]
fn mode_that_is_straight_at_its_start_leads_to_the_same_swing() {
    let mut straight = PLAIN.root.clone();
    straight.strain.iter_mut().for_each(|strain| *strain = strain.map(|s| s * Complex::i()));
    let found = PeriodicSolver::default().from_mode(&PLAIN.shoot, &straight, 0.034).unwrap();
    assert_relative_eq!(found.period, PLAIN.swing.period, epsilon = 0.0, max_relative = 1e-9);
}

/// The same shoot on two elements. They suffice to compare relative orbits with the swing on the same mesh.
static COARSE: LazyLock<Plain> = LazyLock::new(|| Plain::new(2));

/// Solves with a guess of the angle (rad) for a relative orbit. An orbit that is found lasts a number of half swings, and its angle is
/// that number of half turns. Returns this number.
fn half_swings(guess: f64) -> Option<f64> {
    let Plain { shoot, root, swing } = &*COARSE;
    let found = turning(8, guess).from_mode(shoot, root, 0.034).ok()?;
    let halves = 2.0 * found.period / swing.period;
    assert!(abs_diff_eq!(halves, halves.round(), epsilon = 1e-8), "{guess}: {halves} half swings");
    assert!(abs_diff_eq!(found.angle.sin(), 0.0, epsilon = 1e-8), "{guess}: angle {}", found.angle);
    Some(halves)
}

#[test]
fn guesses_of_the_angle_near_half_a_turn_lead_to_half_a_swing() {
    for guess in [3.1, 3.2, -PI] {
        let halves = half_swings(guess);
        assert!(halves.is_some_and(|halves| abs_diff_eq!(halves, 1.0, epsilon = 1e-8)), "{guess}: {halves:?}");
    }
}

/// Iterations from such guesses pass ever shorter periods, which need more intervals of the past. A linearisation of the earlier size was
/// once kept there, with a panic. Errors are accepted here, wrong orbits are not.
#[test]
fn guesses_of_the_angle_far_from_half_a_turn_lead_to_no_wrong_orbit() {
    for guess in [0.6, 1.6, 2.8, 3.4] {
        half_swings(guess);
    }
}
