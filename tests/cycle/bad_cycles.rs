//! Limit cycles of shoots that have none, and input that makes no sense: an error of a type that says so, in bounded time; and nothing
//! that is found is not a number or is no orbit.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::channel;
use std::time::Duration;

use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, WEIGHT, YOUNG, steering};
use morphorod::constitutive::LinearElastic;
use morphorod::cycle::{CircularOrbit, CircularSolver, CycleError, PeriodicOrbit, PeriodicSolver, Turning};
use morphorod::growth::GrowthLaw;
use morphorod::load::{ApicalForce, Distributed, Weight};
use morphorod::stability::{Linearisation, Root, StabilityError};
use morphorod::tropism::{
    Declaration, Gravitropism, Growing, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Site,
    Statoliths, TropismLaw,
};
use morphorod::{Laws, Scene, Section, Shoot};
use nalgebra::{Complex, UnitQuaternion, Vector3};

/// Beyond the onset at 6.56 cm.
const LENGTH: f64 = 0.067;

/// The shoot of these tests: laws behind pointers, so that all shoots are of one type and the solvers are compiled once.
type Any = Laws<LinearElastic, Growth, Box<dyn TropismLaw + Send>, Pull, Place>;

struct Growth {
    time: f64,
    elongates: bool,
    /// REGR rises by this share in a second.
    rise: f64,
    /// REGR falls to zero at the base.
    linear: bool,
}

impl GrowthLaw for Growth {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        let share = if self.linear { 2.0 * (1.0 - sigma / LENGTH) } else { 1.0 };
        share * (1.0 + self.rise * t) / self.time
    }
    fn zone_length(&self) -> f64 {
        0.1
    }
    fn elongates(&self) -> bool {
        self.elongates
    }
}

/// Weight, a lateral load, and a force at the apex that goes round, N.
type Pull = (Weight, Distributed, ApicalForce<fn(f64) -> Vector3<f64>>);

/// The base is tilted, and turns at a rate (rad/s).
#[derive(Clone, Copy, Default)]
struct Place {
    tilt: f64,
    rate: f64,
}

impl Scene for Place {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -9.81)
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.tilt + self.rate * t)
    }
}

struct Plan {
    length: f64,
    elements: u32,
    growth: Growth,
    tropism: Box<dyn TropismLaw + Send>,
    load: Pull,
    place: Place,
    section: Section,
}

fn plan(length: f64) -> Plan {
    Plan {
        length,
        elements: 4,
        growth: Growth { time: 20.0 * HOUR, elongates: false, rise: 0.0, linear: false },
        tropism: Box::new(steering(SettledStatoliths)),
        load: (WEIGHT, Distributed(Vector3::zeros()), ApicalForce(|_| Vector3::zeros())),
        place: Place::default(),
        section: Section::circle(RADIUS),
    }
}

impl Plan {
    fn steered(tropism: impl TropismLaw + Send + 'static) -> Shoot<Any> {
        Self { tropism: Box::new(tropism), ..plan(LENGTH) }.shoot()
    }

    fn shoot(self) -> Shoot<Any> {
        let n = self.elements;
        let nodes: Vec<f64> = (0..=n).map(|i| self.length * f64::from(i) / f64::from(n)).collect();
        let section = self.section;
        Shoot::builder(YOUNG)
            .length(self.length)
            .nodes(&nodes)
            .section(move |_| section)
            .growth(self.growth)
            .tropism(self.tropism)
            .load(self.load)
            .scene(self.place)
            .build()
            .unwrap()
    }
}

/// The mode of the plain shoot.
fn mode() -> Root {
    Linearisation::about(&plan(LENGTH).shoot()).unwrap().rightmost().unwrap()
}

fn memories(time: f64, delay: f64) -> impl TropismLaw + Send {
    let memory = Memory { time, delay };
    (
        Gravitropism { sensitivity: BETA, perception: SettledStatoliths }.remembered(memory),
        Proprioception { sensitivity: ETA }.remembered(memory),
    )
}

/// The answer, if it comes within 60 s without a panic: three times what the slowest takes on one busy core, 20 s.
fn within<T: Send + 'static>(what: &str, answer: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let _ = sender.send(catch_unwind(AssertUnwindSafe(answer)).ok());
    });
    let answer = receiver.recv_timeout(Duration::from_secs(60));
    answer.unwrap_or_else(|_| panic!("{what}: no answer")).unwrap_or_else(|| panic!("{what}: a panic"))
}

type Answers = (Result<CircularOrbit, CycleError>, Result<PeriodicOrbit, CycleError>);

/// A shoot and what it is called.
type Case = (&'static str, fn() -> Shoot<Any>);

/// What both solvers say of a shoot from the mode of the plain one, or from its own. An orbit that is found has numbers, and its roots
/// or multipliers are numbers or are refused.
fn both(what: &str, shoot: impl FnOnce() -> Shoot<Any> + Send + 'static, own: bool) -> Answers {
    within(what, move || {
        let shoot = shoot();
        let root = if own { Linearisation::about(&shoot).unwrap().rightmost().unwrap() } else { mode() };
        let circle = CircularSolver::default().solve(&shoot, &Turning::of_mode(&root, 0.02));
        if let Ok(orbit) = &circle {
            assert!([orbit.rate, orbit.radius(), orbit.height()].iter().all(|x| x.is_finite()), "{orbit:?}");
            if let Ok(roots) = orbit.roots(&shoot, 12) {
                assert!(roots.roots.iter().all(|root| root.value.norm().is_finite() && root.difference.is_finite()));
            }
        }
        let plane = PeriodicSolver::default().from_mode(&shoot, &root, 0.02);
        if let Ok(orbit) = &plane {
            assert!(orbit.period.is_finite() && orbit.largest_excursion(&shoot).unwrap().0.is_finite());
            if let Ok(sets) = orbit.multipliers(&shoot, 12) {
                assert!(sets.iter().flatten().all(|one| one.value.norm().is_finite() && one.residual.is_finite()));
            }
        }
        (circle, plane)
    })
}

fn is_none_near(error: &CycleError) -> bool {
    matches!(error, CycleError::Stationary { .. } | CycleError::NotConverged { .. })
}

fn is_forced(error: &CycleError) -> bool {
    matches!(error, CycleError::Stability(StabilityError::Forced { change }) if *change > 0.0)
}

/// The name of the parameter that is refused.
fn refused<T: std::fmt::Debug>(answer: Result<T, CycleError>) -> &'static str {
    match answer {
        Err(CycleError::Parameter(error)) => error.name,
        other => panic!("{other:?}"),
    }
}

#[test]
fn below_the_onset_there_is_none() {
    for length in [0.03, 0.06, 0.0655] {
        let (circle, plane) = both("below the onset", move || plan(length).shoot(), false);
        let errors = [circle.unwrap_err(), plane.unwrap_err()];
        assert!(errors.iter().all(is_none_near), "{length}: {errors:?}");
    }
}

/// Laws that cannot go round together: without proprioception, weight, gravitropism; with memories of one kind or none.
#[test]
fn where_nothing_swings_there_is_none() {
    let cases: [Case; 3] = [
        ("no proprioception", || {
            Plan::steered(Gravitropism { sensitivity: BETA, perception: SettledStatoliths }.remembered(MEMORY))
        }),
        ("no delay", || Plan::steered(memories(24.0 * MINUTE, 0.0))),
        ("a short delay", || Plan::steered(memories(12.0 * MINUTE, 1.0))),
    ];
    for (what, shoot) in cases {
        let (circle, plane) = both(what, shoot, false);
        let errors = [circle.unwrap_err(), plane.unwrap_err()];
        assert!(errors.iter().all(is_none_near), "{what}: {errors:?}");
    }
    // Nothing steers: any strain stays. Once the solver of the variables, of which there are none, panicked, and the strain that stays
    // was an orbit.
    let (circle, plane) = both("no tropism", || Plan::steered(()), false);
    assert!(matches!(circle, Err(CycleError::NotConverged { .. })), "{circle:?}");
    assert!(matches!(plane, Err(CycleError::Stationary { .. })), "{plane:?}");
}

#[test]
fn growth_is_refused() {
    let growth = || Growth { elongates: true, ..plan(LENGTH).growth };
    let (circle, plane) = both("growth", move || Plan { growth: growth(), ..plan(LENGTH) }.shoot(), false);
    assert!(matches!(circle, Err(CycleError::Elongates)), "{circle:?}");
    assert!(matches!(plane, Err(CycleError::Elongates)), "{plane:?}");
}

/// An oscillator, a force that goes round, a clinostat and growth that rises: of none of them the problem knows the period.
#[test]
fn what_depends_on_time_is_refused() {
    /// Sees as much of the oscillation as is there: nothing on a straight shoot.
    struct Moody;
    impl TropismLaw for Moody {
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(2);
            to.with_present();
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli.copy_from_slice(site.strain.xy().as_slice());
        }
        fn gradient(&self, at: &Growing, _past: &[f64], now: &[f64]) -> Vector3<f64> {
            Vector3::new(now[0], now[1], 0.0) * (at.time / HOUR).sin()
        }
    }
    let cases: [Case; 5] = [
        ("an oscillator", || Plan::steered((Oscillator::new(0.2, 24.0 * MINUTE), steering(SettledStatoliths)))),
        ("a mood", || Plan::steered((Moody, steering(SettledStatoliths)))),
        ("a force", || {
            let force =
                ApicalForce((|t| Vector3::new((t / 800.0).cos(), (t / 800.0).sin(), 0.0) * 1e-6) as fn(f64) -> _);
            Plan { load: (WEIGHT, Distributed(Vector3::zeros()), force), ..plan(LENGTH) }.shoot()
        }),
        ("a clinostat", || Plan { place: Place { tilt: 0.0, rate: 1e-3 }, ..plan(LENGTH) }.shoot()),
        ("growth", || Plan { growth: Growth { rise: 1e-6, ..plan(LENGTH).growth }, ..plan(LENGTH) }.shoot()),
    ];
    for (what, shoot) in cases {
        let (circle, plane) = both(what, shoot, false);
        let errors = [circle.unwrap_err(), plane.unwrap_err()];
        assert!(errors.iter().all(is_forced), "{what}: {errors:?}");
        assert!(errors[0].to_string().contains("forced"), "{}", errors[0]);
    }
}

#[test]
fn no_circle_without_an_axis() {
    let cases: [Case; 3] = [
        ("a tilt", || Plan { place: Place { tilt: 0.3, rate: 0.0 }, ..plan(LENGTH) }.shoot()),
        ("an ellipse", || Plan { section: Section::ellipse(5.0e-4, 5.2e-4), ..plan(LENGTH) }.shoot()),
        ("a lateral load", || {
            let aside = Distributed(Vector3::new(1e-5, 0.0, 0.0));
            Plan { load: (WEIGHT, aside, plan(LENGTH).load.2), ..plan(LENGTH) }.shoot()
        }),
    ];
    for (what, shoot) in cases {
        let (circle, _) = both(what, shoot, false);
        assert!(matches!(circle, Err(CycleError::NoAxis { defect, .. }) if defect > 1e-8), "{what}: {circle:?}");
    }
}

/// Twist is no unknown of either search; laws that twist were followed without it.
#[test]
fn laws_that_twist_or_answer_what_is_no_number_are_refused() {
    struct Odd(Vector3<f64>);
    impl TropismLaw for Odd {
        fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
            self.0
        }
    }
    for odd in [Vector3::repeat(f64::NAN), Vector3::new(0.0, 0.0, f64::NAN), Vector3::new(f64::INFINITY, 0.0, 0.0)] {
        let (circle, plane) =
            both("not a number", move || Plan::steered((steering(SettledStatoliths), Odd(odd))), false);
        for error in [circle.unwrap_err(), plane.unwrap_err()] {
            let what = matches!(error, CycleError::Stability(StabilityError::NotFinite { .. }));
            assert!(what, "{odd:?}: {error:?}");
        }
    }
    let twist = || Plan::steered((steering(SettledStatoliths), Odd(Vector3::new(0.0, 0.0, 1.0))));
    let (circle, plane) = both("twist", twist, false);
    assert!(matches!(circle, Err(CycleError::Twists { .. })), "{circle:?}");
    assert!(matches!(plane, Err(CycleError::Twists { twist, .. }) if twist == 1.0), "{plane:?}");
}

/// Stiff laws: what dies out at once must not come back as a multiplier. With Gauss points statoliths that settle in a millisecond had
/// one of 0.996 at every material point.
#[test]
fn fast_statoliths_are_settled_ones() {
    let leading = |tropism: fn() -> Box<dyn TropismLaw + Send>| {
        within("statoliths", move || {
            let shoot = Plan { tropism: tropism(), ..plan(LENGTH) }.shoot();
            let orbit = PeriodicSolver::default().from_mode(&shoot, &mode(), 0.03).unwrap();
            (orbit.period, orbit.multipliers(&shoot, 16).unwrap().map(|set| [set[0].value, set[1].value]))
        })
    };
    let (period, settled) = leading(|| Box::new(steering(SettledStatoliths)));
    let (same, fast) = leading(|| Box::new(steering(Statoliths { avalanche_time: 1e-3 })));
    // The avalanche adds about its time to a reaction of 12 min: 1e-6 of it.
    assert!((same / period - 1.0).abs() < 3e-6, "{same} {period}");
    // By harmonic balance and by spectral steps, on finer elements: this mesh puts the numbers off by less than 1e-8.
    assert!((period / MINUTE - 87.661_715_125).abs() < 1e-6, "{}", period / MINUTE);
    for (one, known) in [(settled[0][1], 0.657_775_328), (settled[1][0], 1.166_270_117)] {
        assert!((one - known).norm() < 1e-6, "{one} {known}");
    }
    for (a, b) in settled.iter().flatten().zip(fast.iter().flatten()) {
        // The same, times the error of Arnoldi's method with 16 vectors, below 1e-5.
        assert!((a - b).norm() < 3e-5, "{a} {b}");
    }
}

/// A delay of two periods and one of a memory that hardly lasts: the past is kept as long as it is read, though the period moves.
#[test]
fn the_past_is_as_long_as_the_delay() {
    for (what, time, delay) in [("a long delay", 12.0 * MINUTE, 200.0 * MINUTE), ("no memory", 1e-3, 24.0 * MINUTE)] {
        let (circle, plane) = both(what, move || Plan::steered(memories(time, delay)), false);
        let circle = circle.unwrap();
        // With equal memories the rate obeys ωτr + atan ωτm = π/2 + 2πn, whatever the shape. The tolerance is the solver's 1e-11 times
        // the digits that a small change of the strain costs the rate.
        let turns = (circle.rate * delay + (circle.rate * time).atan()) / std::f64::consts::TAU - 0.25;
        assert!((turns - turns.round()).abs() < 1e-9, "{what}: {turns}");
        // A swing in the plane takes as long as a circle, but for the fourth power of the amplitude: a percent.
        if let Ok(plane) = plane {
            assert!((plane.period / circle.period() - 1.0).abs() < 0.02, "{what}: {}", plane.period);
        }
    }
    // A delay without end would need a state without end.
    let (_, plane) = both("a delay without end", || Plan::steered(memories(12.0 * MINUTE, 1e9)), false);
    assert_eq!(refused(plane), "longest delay, in periods");
}

#[test]
fn starts_that_make_no_sense() {
    within("starts", || {
        let (shoot, root) = (plan(LENGTH).shoot(), mode());
        let start = Turning::of_mode(&root, 0.02);
        let solve = |start: &Turning| CircularSolver::default().solve(&shoot, start);
        let swing = |root: &Root, amplitude| PeriodicSolver::default().from_mode(&shoot, root, amplitude);
        for amplitude in [f64::NAN, f64::INFINITY] {
            assert_eq!(refused(solve(&Turning::of_mode(&root, amplitude))), "strain of the start");
        }
        for amplitude in [f64::NAN, f64::INFINITY, 0.0, -0.02] {
            assert_eq!(refused(swing(&root, amplitude)), "amplitude of the start");
        }
        for amplitude in [0.0, 1e-9] {
            assert!(matches!(solve(&Turning::of_mode(&root, amplitude)), Err(CycleError::Stationary { .. })));
        }
        assert!(matches!(swing(&root, 1e-9), Err(CycleError::Stationary { .. })));
        // Such a shape has no equilibrium on these elements.
        for amplitude in [10.0, 1e300] {
            assert!(matches!(solve(&Turning::of_mode(&root, amplitude)), Err(CycleError::Equilibrium(_))));
            assert!(matches!(swing(&root, amplitude), Err(CycleError::Equilibrium(_))));
        }
        for rate in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(solve(&Turning { rate, ..start.clone() })), "rate of the start");
        }
        for rate in [1e-300, 1e-12, 1e12] {
            assert!(solve(&Turning { rate, ..start.clone() }).is_err());
        }
        for strain in [vec![], start.strain[1..].to_vec()] {
            assert_eq!(refused(solve(&Turning { strain, ..start.clone() })), "number of strains of the start");
        }
        let of_another = Linearisation::about(&Plan { elements: 8, ..plan(LENGTH) }.shoot()).unwrap().rightmost();
        assert_eq!(refused(swing(&of_another.unwrap(), 0.02)), "number of strains of the mode");
        let mut odd = root.clone();
        odd.strain[3].x = Complex::new(f64::NAN, 0.0);
        assert_eq!(refused(swing(&odd, 0.02)), "strain of the mode");
        for rate in [0.0, f64::NAN, -1e-3] {
            let mut still = root.clone();
            still.value.im = rate;
            assert_eq!(refused(swing(&still, 0.02)), "frequency of the mode");
        }
        for rate in [1e-12, 1e12] {
            let mut strange = root.clone();
            strange.value.im = rate;
            assert!(swing(&strange, 0.02).is_err());
        }
    });
}

#[test]
fn settings_that_make_no_sense() {
    within("settings", || {
        let (shoot, root) = (plan(LENGTH).shoot(), mode());
        let start = Turning::of_mode(&root, 0.02);
        for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let solver = CircularSolver { tolerance, ..CircularSolver::default() };
            assert_eq!(refused(solver.solve(&shoot, &start)), "tolerance of a circular orbit");
            let solver = PeriodicSolver { tolerance, ..PeriodicSolver::default() };
            assert_eq!(refused(solver.from_mode(&shoot, &root, 0.02)), "tolerance of a periodic orbit");
        }
        // Below rounding: never reached, and never said to be.
        let solver = CircularSolver { tolerance: 1e-30, ..CircularSolver::default() };
        assert!(matches!(solver.solve(&shoot, &start), Err(CycleError::NotConverged { iterations: 40, .. })));
        let none = CircularSolver { max_iterations: 0, ..CircularSolver::default() };
        assert!(matches!(none.solve(&shoot, &start), Err(CycleError::NotConverged { iterations: 0, .. })));
        let of = |intervals, stages| {
            let solver = PeriodicSolver { intervals, stages, ..PeriodicSolver::default() };
            solver.from_mode(&shoot, &root, 0.03)
        };
        for intervals in [0, 1001, usize::MAX] {
            assert_eq!(refused(of(intervals, 6)), "intervals in a period");
        }
        for stages in [0, 17, usize::MAX] {
            assert_eq!(refused(of(16, stages)), "points in an interval");
        }
        let fine = of(16, 6).unwrap();
        // One interval with twelve points, its delay inside: it goes on until what is read and what is made agree.
        let whole = of(1, 12).unwrap();
        assert!((whole.period / fine.period - 1.0).abs() < 1e-3, "{}", whole.period);
        for vectors in [0, 401, usize::MAX] {
            assert_eq!(refused(fine.multipliers(&shoot, vectors)), "number of vectors");
            let circle = CircularSolver::default().solve(&shoot, &start).unwrap();
            assert_eq!(refused(circle.roots(&shoot, vectors)), "number of vectors");
        }
        // As many as the map has directions above rounding, and no more.
        let sets = fine.multipliers(&shoot, 400).unwrap();
        assert!(sets.iter().flatten().all(|one| one.value.norm().is_finite() && one.residual < 1e-6));
    });
}

/// Clockwise is the mirror image: the same radius, the opposite rate, the same roots.
#[test]
fn clockwise_is_the_mirror_image() {
    within("clockwise", || {
        let shoot = plan(LENGTH).shoot();
        let start = Turning::of_mode(&mode(), 0.02);
        let mirror = |u: &Vector3<f64>| Vector3::new(u.x, -u.y, u.z);
        let mirrored = Turning { rate: -start.rate, strain: start.strain.iter().map(mirror).collect() };
        let [one, other] = [&start, &mirrored].map(|start| CircularSolver::default().solve(&shoot, start).unwrap());
        // Both are known to the tolerance, 1e-11 of the gradient; the radius follows with a factor of order one.
        assert!((one.rate / other.rate + 1.0).abs() < 1e-9, "{} {}", one.rate, other.rate);
        assert!((one.radius() - other.radius()).abs() < 1e-9 * LENGTH);
        let [a, b] = [&one, &other].map(|orbit| orbit.roots(&shoot, 12).unwrap().roots);
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            // Differences of 1e-9 in the linearisation.
            assert!((a.value - b.value).norm() < 1e-7 * one.rate, "{a:?} {b:?}");
        }
    });
}

/// The orbit of one shoot is none of another.
#[test]
fn orbits_of_other_shoots_are_refused() {
    within("other shoots", || {
        let (shoot, root) = (plan(LENGTH).shoot(), mode());
        let circle = CircularSolver::default().solve(&shoot, &Turning::of_mode(&root, 0.02)).unwrap();
        let plane = PeriodicSolver::default().from_mode(&shoot, &root, 0.03).unwrap();
        let others: [(&str, Shoot<Any>); 5] = [
            ("longer", plan(0.068).shoot()),
            ("finer", Plan { elements: 8, ..plan(LENGTH) }.shoot()),
            ("with statoliths", Plan::steered(steering(Statoliths { avalanche_time: 2.0 * MINUTE }))),
            ("with other memories", Plan::steered(memories(12.0 * MINUTE, 15.0 * MINUTE))),
            ("forced", Plan { place: Place { tilt: 0.0, rate: 1e-3 }, ..plan(LENGTH) }.shoot()),
        ];
        for (what, other) in &others {
            assert!(circle.roots(other, 12).is_err(), "{what}");
            assert!(plane.multipliers(other, 4).is_err(), "{what}");
            assert!(plane.largest_excursion(other).is_err(), "{what}");
            assert!(plane.shapes(other).is_err(), "{what}");
        }
        for period in [0.0, f64::NAN, -1.0, 1e-300, 1.0, 1e9] {
            let mut changed = plane.clone();
            changed.period = period;
            assert!(changed.multipliers(&shoot, 4).is_err(), "{period}");
        }
        // Its negative is not among them: a shape in one plane turns the other way as well.
        for rate in [0.0, f64::NAN, 2.0 * circle.rate] {
            let mut changed = circle.clone();
            changed.rate = rate;
            assert!(changed.roots(&shoot, 12).is_err(), "{rate}");
        }
    });
}

/// REGR that falls to zero at the base: no Gauss point lies there, and the circle is one.
#[test]
fn growth_that_ends_at_the_base() {
    let growth = || Growth { linear: true, time: 14.0 * HOUR, ..plan(LENGTH).growth };
    let (circle, plane) = both("linear", move || Plan { growth: growth(), ..plan(LENGTH) }.shoot(), true);
    match circle {
        // With equal memories the period does not depend on where tissue grows.
        Ok(orbit) => assert!((orbit.period() / 60.0 - 87.638_358_711_642_3).abs() < 1e-7, "{}", orbit.period()),
        Err(error) => assert!(is_none_near(&error), "{error:?}"),
    }
    if let Err(error) = plane {
        assert!(is_none_near(&error), "{error:?}");
    }
}
