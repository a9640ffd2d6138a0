//! Cycles that come back turned by an angle: half swings, rosettes, and starts from runs in time.

use std::f64::consts::PI;

use crate::fixtures::exact_orbit::GROWTH_TIME;
use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, Reduced, STATOLITHS, reduced, steering};
use morphorod::cycle::{Branch, CircularSolver, CycleError, PeriodicOrbit, PeriodicSolver, Special, Turning};
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::{Linearisation, Root};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Growing, Oscillator, Perception, Proprioception, Remembered, Response, Rotation,
    SettledStatoliths, Site, Source, Statoliths, TropismLaw, Variable,
};
use morphorod::{Model, Section, Shoot, ShootBuilder};
use nalgebra::{Complex, Rotation2, Vector3};

/// A shoot that steers all along, with equal elements.
fn shoot(length: f64, elements: u32) -> ShootBuilder<Reduced> {
    let nodes: Vec<f64> = (0..=elements).map(|i| length * f64::from(i) / f64::from(elements)).collect();
    reduced(length, GROWTH_TIME).growth(Ongoing(UniformGrowth { zone_length: 1.0, time: GROWTH_TIME })).nodes(&nodes)
}

/// Tissue that answers to the vertical in a direction that is turned a little: it winds.
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

fn mode(shoot: &Shoot<impl Model>) -> Root {
    Linearisation::about(shoot).unwrap().rightmost().unwrap()
}

fn turning(intervals: usize, angle: f64) -> PeriodicSolver {
    PeriodicSolver { intervals, angle: Some(angle), ..PeriodicSolver::default() }
}

fn excursion(orbit: &PeriodicOrbit, shoot: &Shoot<impl Model>) -> f64 {
    orbit.largest_excursion(shoot).unwrap().0
}

/// The growth rates of the disturbances that are not trivial and grow most or decay least, in the plane and out of it (1/h), and the larger
/// defect of the trivial multipliers.
fn rates(orbit: &PeriodicOrbit, shoot: &Shoot<impl Model>) -> ([f64; 2], f64) {
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

#[test]
fn half_a_swing_is_a_swing() {
    // Excursion (mm), period (min), rates in the plane and out of it (1/h): those of tests/cycles.rs.
    let known = [
        (0.0659, 16.766135125, 87.639390134, -0.0627567395, 0.0213561488),
        (0.0670, 34.194086156, 87.661715125, -0.2867102380, 0.1052756418),
    ];
    for (length, largest, period, inside, outside) in known {
        let shoot = shoot(length, 8).into_dyn().build().unwrap();
        let root = mode(&shoot);
        let half = turning(8, PI).from_mode(&shoot, &root, 1e-3 * largest).unwrap();
        // The promises for whole swings: 1e-8 of excursion and period, 1e-6 of the rates.
        assert!((half.angle - PI).abs() < 1e-9, "{length}: {:e}", half.angle - PI);
        let off = 1e3 * excursion(&half, &shoot) / largest - 1.0;
        assert!(off.abs() < 1e-8, "{length}: excursion off by {off:e}");
        let off = 2.0 * half.period / MINUTE / period - 1.0;
        assert!(off.abs() < 1e-8, "{length}: period off by {off:e}");
        let (found, defect) = rates(&half, &shoot);
        assert!((found[0] - inside).abs() < 1e-7 && (found[1] - outside).abs() < 1e-7, "{length}: {found:?}");
        assert!(defect < 1e-8, "{length}: {defect:e}");
        let whole = PeriodicSolver::default().from_mode(&shoot, &root, 1e-3 * largest).unwrap();
        assert_eq!(whole.angle, 0.0);
        assert!(half.equilibria < 2 * whole.equilibria / 3, "{length}: {} {}", half.equilibria, whole.equilibria);
        // From one to the other and back.
        let back = PeriodicSolver::default().from_orbit(&shoot, &half).unwrap();
        let again = turning(8, PI).from_orbit(&shoot, &whole).unwrap();
        assert!((back.period / whole.period - 1.0).abs() < 1e-9 && back.iterations <= 3, "{}", back.iterations);
        assert!((again.period / half.period - 1.0).abs() < 1e-9 && again.iterations <= 3, "{}", again.iterations);
    }
}

/// Variables that turn as a vector, normals of statoliths, are turned back as well.
#[test]
fn half_a_swing_with_statoliths_is_a_swing() {
    let shoot = shoot(0.0670, 4).tropism(steering(STATOLITHS)).into_dyn().build().unwrap();
    let root = mode(&shoot);
    let half = turning(8, PI).from_mode(&shoot, &root, 0.04).unwrap();
    let whole = PeriodicSolver::default().from_mode(&shoot, &root, 0.04).unwrap();
    // One and the same problem on one and the same grid, solved to 1e-10 each.
    assert!((2.0 * half.period / whole.period - 1.0).abs() < 1e-9, "{} {}", half.period, whole.period);
    assert!((excursion(&half, &shoot) / excursion(&whole, &shoot) - 1.0).abs() < 1e-8);
    assert!(whole.period > 90.0 * MINUTE, "slower than without statoliths");
}

/// A swing of tissue that winds turns its plane. Near the onset the two senses of turning have amplitudes z₊ and z₋ with
/// ż± = z± (σ± − a |z±|² − 2a |z∓|²): cross coefficients twice the self coefficients (docs/cycles.md), and Im a/Re a = κ, that of dσ/dℓ, since the
/// period of circles does not depend on their radius. Then |z±|² = (2 Re σ∓ − Re σ±)/(3 Re a), and the phases go on at Im σ± − κ Re σ±:
/// the plane turns by half their difference.
#[test]
fn a_winding_shoot_turns_its_plane_of_swing() {
    let length = 0.0657;
    let plane = {
        let shoot = shoot(length, 4).tropism(winding(0.0)).into_dyn().build().unwrap();
        turning(12, 0.0).from_mode(&shoot, &mode(&shoot), 0.009).unwrap()
    };
    assert!(plane.angle.abs() < 1e-9, "{}", plane.angle);
    let rosette = |askew: f64| {
        let shoot = shoot(length, 4).tropism(winding(askew)).into_dyn().build().unwrap();
        let orbit = turning(12, 0.0).from_orbit(&shoot, &plane).unwrap();
        (shoot, orbit)
    };
    let askew = 1e-3;
    let (mut there, orbit) = rosette(askew);
    // The mirror image.
    let (_, back) = rosette(-askew);
    assert!((orbit.angle + back.angle).abs() < 1e-9 && (orbit.period / back.period - 1.0).abs() < 1e-9);

    let roots = Linearisation::about(&there).unwrap().roots(1e-7).unwrap();
    let sense = |root: &Root| (root.strain[0].y / root.strain[0].x).im;
    // Re[(1, −i) exp(iωt)] turns counterclockwise.
    let left = roots.iter().find(|root| sense(root) < -0.99).unwrap().value;
    let right = roots.iter().find(|root| sense(root) > 0.99).unwrap().value;
    let kappa = 1.177927160 / 1.119568989;
    let expected = 0.5 * ((left.im - right.im) - kappa * (left.re - right.re));
    let found = orbit.angle / orbit.period;
    // Relative: μ over the frequency, 2e-3.
    assert!((found / expected - 1.0).abs() < 4e-3, "{} {}", found * HOUR, expected * HOUR);

    // The same in time: a period later the tip has turned by the angle.
    let history = orbit.enter(&mut there).unwrap();
    let mut run = MethodOfSteps::new(orbit.period / 240.0);
    run.start(&mut there, &history).unwrap();
    let before = there.tip();
    run.advance(&mut there, orbit.period).unwrap();
    let expected = Rotation2::new(orbit.angle) * before.xy();
    // The step leaves 3e-9 of the length; the angle moves the tip by 2e-4 of it.
    assert!((there.tip().xy() - expected).norm() < 1e-8 * length);
    assert!((expected - before.xy()).norm() > 1e-4 * length);
    // A state of a run is a start.
    let again = turning(12, orbit.angle).from_run(&there, orbit.period).unwrap();
    assert!(again.iterations <= 3, "{}", again.iterations);
    assert!((again.angle - orbit.angle).abs() < 1e-8, "{} {}", again.angle, orbit.angle);
}

/// Where circles of the sense in which the shoot does not wind lose their stability, with a pair of twice their rate, rosettes end.
#[test]
fn rosettes_end_at_the_torus_of_circles() {
    let length = 0.0657;
    let family = |askew: f64| Ok(shoot(length, 4).tropism(winding(askew)).into_dyn().build()?);
    let straight = family(0.0).unwrap();
    let root = mode(&straight);
    let within = 0.0..=0.005;
    // Both senses; only one has such a place.
    let mut tori = Vec::new();
    for sense in [1.0, -1.0] {
        let mut start = Turning::of_mode(&root, 0.009);
        start.rate *= sense;
        start.strain.iter_mut().for_each(|strain| strain.y *= sense);
        let circle = CircularSolver::default().solve(&straight, &start).unwrap();
        let branch = Branch::from_orbit(CircularSolver::default(), family, &circle, 0.0, 5e-4, within.clone()).unwrap();
        let points: Vec<_> = branch.largest_step(0.3).unwrap().map(Result::unwrap).collect();
        assert_eq!(points.last().unwrap().parameter, 0.005);
        tori.extend(points.into_iter().filter(|point| point.special.is_some()));
    }
    let [torus] = &tori[..] else { panic!("{}", tori.len()) };
    assert_eq!(torus.special, Some(Special::Torus));
    let pair = torus.exponents[0][0];
    assert!((pair.im.abs() / torus.orbit.rate.abs() - 2.0).abs() < 0.01, "{pair} {}", torus.orbit.rate);

    let swing = turning(12, 0.0).from_mode(&straight, &root, 0.009).unwrap();
    let branch = Branch::from_orbit(turning(12, 0.0), family, &swing, 0.0, 5e-4, within).unwrap();
    // Beyond the circle there are the same rosettes, a quarter of a turn later: they are not told again.
    let rosettes: Vec<_> = branch.largest_step(0.1).unwrap().map(Result::unwrap).collect();
    assert!(rosettes.windows(2).all(|pair| pair[0].parameter < pair[1].parameter));
    // The disturbance that takes a swing out of its plane grows here, too, and nothing is special on the way.
    assert!(rosettes.iter().all(|point| point.special.is_none() && point.unstable() == 1));
    assert!(rosettes.iter().all(|point| point.trivial < 1e-8));
    let last = rosettes.last().unwrap();
    assert!(last.parameter < torus.parameter && last.parameter > 0.98 * torus.parameter, "{}", last.parameter);
    // From a swing that is √(4/3) times as wide as the circle there to the circle.
    assert!(last.excursion < 1.08 * torus.excursion && last.excursion > torus.excursion, "{}", last.excursion);
}

#[test]
fn a_run_in_time_is_a_start() {
    let plain = shoot(0.0670, 4).into_dyn().build().unwrap();
    let root = mode(&plain);
    let circle = CircularSolver::default().solve(&plain, &Turning::of_mode(&root, 0.03)).unwrap();
    let swing = PeriodicSolver::default().from_mode(&plain, &root, 0.034).unwrap();
    let (expected, _) = rates(&swing, &plain);
    // Bent about some axis and let go; after five hours it is near the swing about that axis.
    let mut run = plain.clone();
    run.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut run, 5.0 * HOUR).unwrap();
    for (solver, share) in [(PeriodicSolver::default(), 1.0), (turning(8, PI), 0.5)] {
        let found = solver.from_run(&run, 95.0 * MINUTE * share).unwrap();
        assert!((found.period / swing.period / share - 1.0).abs() < 1e-9, "{}", found.period);
        assert!((excursion(&found, &run) / excursion(&swing, &plain) - 1.0).abs() < 1e-8);
        // In that plane and out of it, though it is no director's.
        let (found, defect) = rates(&found, &run);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
        assert!(defect < 1e-8, "{defect:e}");
    }
    // At rest, with a past that has left nothing behind, it is on no orbit yet; but near enough.
    let mut rest = plain.clone();
    rest.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut rest, 0.0).unwrap();
    let found = PeriodicSolver::default().from_run(&rest, 87.0 * MINUTE).unwrap();
    assert!((found.period / swing.period - 1.0).abs() < 1e-9, "{}", found.period);
    // A shoot that stands still and that nothing drives goes on standing, whatever rounding its shape has.
    let mut still = shoot(0.0670, 4).into_dyn().build().unwrap();
    still.set_intrinsic(|_| Vector3::new(0.0, 3.0, 0.0));
    MethodOfSteps::new(120.0).advance(&mut still, HOUR).unwrap();
    let standing = PeriodicSolver::default().forced(&still, 90.0 * MINUTE).unwrap();
    assert!(excursion(&standing, &still) < 1e-9, "{}", excursion(&standing, &still));
    // Its shape alone is a start for a circle.
    let start = Turning::of_rod(run.rod(), root.value.im);
    let found = CircularSolver::default().solve(&run, &start).unwrap();
    assert!((found.radius() / circle.radius() - 1.0).abs() < 1e-9);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let plain = shoot(0.0670, 4).into_dyn().build().unwrap();
    let root = mode(&plain);
    let from = |shoot: &Shoot<_>| turning(8, PI).from_mode(shoot, &root, 0.034);
    // A section with two principal axes.
    let flat = shoot(0.0670, 4).section(|_| Section::ellipse(1.01 * RADIUS, RADIUS)).into_dyn().build().unwrap();
    assert!(matches!(from(&flat), Err(CycleError::NoAxis { .. })), "{:?}", from(&flat));
    // A circle comes back turned after any time.
    let circular = mode(&shoot(0.0670, 4).tropism(winding(1e-3)).into_dyn().build().unwrap());
    let error = turning(16, 0.0).from_mode(&plain, &circular, 0.03).unwrap_err();
    assert!(matches!(error, CycleError::Circle), "{error}");
    // How its variables turn is not declared.
    struct Silent;
    impl Perception for Silent {
        type Signal = [f64; 2];
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            Askew(0.0).sense(site, stimuli);
        }
    }
    let law = DirectionalTropism { sensitivity: BETA, perception: Silent }.remembered(MEMORY);
    let silent = shoot(0.0670, 4).tropism((winding(0.0).1, law)).into_dyn().build().unwrap();
    let error = turning(8, PI).from_mode(&silent, &root, 0.034).unwrap_err();
    assert!(matches!(error, CycleError::Undeclared { variable: 2 }), "{error}");
    assert!(PeriodicSolver::default().from_mode(&silent, &root, 0.034).is_ok());
    // What is driven has no axis; an angle is a number; a shoot that has not moved is no run.
    let driven =
        shoot(0.05, 4).tropism((Oscillator::new(1e-3, 1440.0), steering(STATOLITHS))).into_dyn().build().unwrap();
    let parameter = |error: CycleError, name: &str| matches!(&error, CycleError::Parameter(e) if e.name == name);
    assert!(parameter(turning(8, PI).forced(&driven, 1440.0).unwrap_err(), "angle of a cycle that is driven"));
    let error = turning(8, f64::NAN).from_mode(&plain, &root, 0.034).unwrap_err();
    assert!(parameter(error, "angle of a periodic orbit"));
    let error = PeriodicSolver::default().from_run(&plain, 5000.0).unwrap_err();
    assert!(parameter(error, "levels of the history of the run"));
}

/// Tissue that remembers how far it bends about the direction in which it leans: zero on a swing, and another sign in its mirror image.
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

#[test]
fn what_changes_its_sign_in_a_mirror_leads_out_of_the_plane() {
    // By a law that says how its variables turn and by one that does not: the multipliers in the plane and out of it.
    let [known, unknown] = [true, false].map(|declared| {
        let shoot =
            shoot(0.067, 4).tropism((steering(SettledStatoliths), Sidelong { declared })).into_dyn().build().unwrap();
        let swing = PeriodicSolver::default().from_mode(&shoot, &mode(&shoot), 0.034).unwrap();
        rates(&swing, &shoot).0
    });
    let plain = [-0.286710238, 0.105275642];
    assert!((known[0] - plain[0]).abs() < 1e-6, "nothing changes in the plane: {known:?}");
    assert!((known[1] - plain[1]).abs() > 1e-3, "but out of it: {known:?}");
    assert!((known[1] - unknown[1]).abs() < 1e-7, "{known:?} {unknown:?}");
}

/// A wall beside the shoot, on one side: tissue that remembers it gives way.
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

#[test]
fn a_wall_on_one_side_breaks_the_axis() {
    let walled = shoot(0.067, 4).tropism((steering(SettledStatoliths), Wall)).into_dyn().build().unwrap();
    let mut root = mode(&walled);
    // A first half on the free side, whatever the phase.
    let turn = Complex::from_polar(1.0, 1.2);
    root.strain.iter_mut().for_each(|strain| *strain = strain.map(|s| s * turn));
    for angle in [PI, 0.0] {
        let found = turning(12, angle).from_mode(&walled, &root, 0.034);
        assert!(matches!(found, Err(CycleError::NoAxis { .. })), "{angle}: {found:?}");
    }
    assert!(PeriodicSolver::default().from_mode(&walled, &root, 0.034).is_ok());
}

/// Something that rests and steers nothing, in a unit in which its number is large.
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

#[test]
fn orbits_do_not_depend_on_units_angles_or_fast_laws() {
    let plain = shoot(0.067, 4).into_dyn().build().unwrap();
    let root = mode(&plain);
    let swing = PeriodicSolver::default().from_mode(&plain, &root, 0.034).unwrap();
    // A variable of a megapascal, in pascals.
    let pressed = shoot(0.067, 4).tropism((steering(SettledStatoliths), Pressure)).into_dyn().build().unwrap();
    let found = PeriodicSolver::default().from_mode(&pressed, &root, 0.034).unwrap();
    assert!((found.period / swing.period - 1.0).abs() < 1e-9, "{} {}", found.period, swing.period);
    // Statoliths that settle in a microsecond: their rates are differences of large numbers.
    let fast = Statoliths { avalanche_time: 1e-6 };
    let fast = shoot(0.067, 4).tropism(steering(fast)).into_dyn().build().unwrap();
    let found = turning(8, PI).from_mode(&fast, &root, 0.034).unwrap();
    assert!((2.0 * found.period / swing.period - 1.0).abs() < 1e-8, "{} {}", 2.0 * found.period, swing.period);
    // A mode that is straight at its start.
    let mut straight = root.clone();
    straight.strain.iter_mut().for_each(|strain| *strain = strain.map(|s| s * Complex::i()));
    let found = PeriodicSolver::default().from_mode(&plain, &straight, 0.034).unwrap();
    assert!((found.period / swing.period - 1.0).abs() < 1e-9);
    // Guesses of the angle, with periods on the way that need more of the past than the first.
    let mut halves = 0;
    for guess in [0.6, 1.6, 2.8, 3.4, 3.1, 3.2, -PI] {
        let Ok(found) = turning(8, guess).from_mode(&plain, &root, 0.034) else { continue };
        let swings = found.period / swing.period;
        assert!((2.0 * swings - (2.0 * swings).round()).abs() < 1e-8, "{guess}: {swings}");
        assert!((found.angle.sin()).abs() < 1e-8, "{guess}: {}", found.angle);
        halves += usize::from((2.0 * swings - 1.0).abs() < 1e-8);
    }
    assert!(halves >= 3, "only {halves} of the guesses near π lead to half a swing");
    // A circle that is found as an orbit comes back turned after any time.
    let circle = CircularSolver::default().solve(&plain, &Turning::of_mode(&root, 0.03)).unwrap();
    let round = mode(&shoot(0.067, 4).tropism(winding(1e-3)).into_dyn().build().unwrap());
    let orbit = PeriodicSolver::default().from_mode(&plain, &round, 0.03).unwrap();
    assert!((orbit.period / circle.period() - 1.0).abs() < 1e-8, "{}", orbit.period);
    let error = turning(16, 0.0).from_orbit(&plain, &orbit).unwrap_err();
    assert!(matches!(error, CycleError::Circle), "{error}");
}
