//! Laws that have discontinuities, in every spelling: `<` or `<=`, at the start of a run, inside it and at its end.

use crate::fixtures::shoots::{HOUR, WEIGHT, order, righting, steering};
use morphorod::integrator::{Integrator, Iterated, MethodOfSteps};
use morphorod::load::{Cut, Load};
use morphorod::tropism::{Declaration, Growing, Site, TropismLaw, Variable};
use morphorod::{Environment, Scene, Shoot, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

use morphorod::tropism::SettledStatoliths;

/// Whether something is the case at a time, from one time until another.
type Spelling = fn(t: f64, from: f64, until: f64) -> bool;

const SPELLINGS: [Spelling; 4] = [
    |t, from, until| t >= from && t < until,
    |t, from, until| t > from && t <= until,
    |t, from, until| t >= from && t <= until,
    // Off by the rounding of a difference.
    |t, from, until| t - from >= 0.0 && t - from < until - from,
];

/// A base that leans by half a radian for a while, or for good.
struct Pot {
    leans: Spelling,
    from: f64,
    until: f64,
}

impl Scene for Pot {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        Still::upright().gravity(t)
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        Still::tilted(if (self.leans)(t, self.from, self.until) { 0.5 } else { 0.0 }).base
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        [self.from, self.until].into_iter().filter(|time| *time > t).fold(f64::INFINITY, f64::min)
    }
}

/// The tip after some time (s), and the scene's shoot there.
fn tip(scene: impl Scene, mut run: impl Integrator, end: f64) -> Vector3<f64> {
    let mut shoot = righting().scene(scene).build().unwrap();
    run.advance(&mut shoot, end).unwrap();
    shoot.tip()
}

#[test]
fn a_pot_that_is_turned_for_half_an_hour() {
    // The second case is turned as the run starts; times that no step meets, and whose difference is rounded.
    for (from, until) in [(1800.0, 3600.0), (0.0, 1800.0), (1234.567, 3034.5670000000005)] {
        let steps = [120.0, 60.0, 30.0, 15.0];
        let best = tip(Turned::tilted(0.5, from, until), MethodOfSteps::new(3.75), 3.0 * HOUR);
        let mut errors = Vec::new();
        for step in steps {
            let expected = tip(Turned::tilted(0.5, from, until), MethodOfSteps::new(step), 3.0 * HOUR);
            for leans in SPELLINGS {
                let found = tip(Pot { leans, from, until }, MethodOfSteps::new(step), 3.0 * HOUR);
                assert!((found - expected).norm() < 1e-12, "{from} s, {step} s");
            }
            errors.push((expected - best).norm());
        }
        // Fourth order; the last error is far from rounding and from the error of the reference, 256 times smaller.
        assert!(order(&errors) > 3.5 && errors[3] > 1e-13, "{from} s: {errors:?}");
    }
}

#[test]
fn a_base_that_leans_from_the_start_on_is_read_after_it() {
    // The first equilibrium stands upright, where nothing moves: a later turn gives the same, later.
    let after = |from: f64| tip(Turned::tilted(0.5, from, f64::INFINITY), Iterated::new(22.5), from + HOUR);
    // Rounding of the times, at 7e-6 m/s, and of the tip.
    assert!((after(0.0) - after(1e-3)).norm() < 1e-14, "{} against {}", after(0.0), after(1e-3));
    assert!((after(0.0) - after(777.7)).norm() < 1e-14, "{} against {}", after(0.0), after(777.7));
    let mut shoot = righting().scene(Turned::tilted(0.5, 0.0, f64::INFINITY)).into_dyn().build().unwrap();
    MethodOfSteps::new(90.0).advance(&mut shoot, 0.0).unwrap();
    assert!((shoot.rod().frames()[0].angle() - 0.5).abs() < 1e-15, "a state at a discontinuity shows what follows");
}

#[test]
fn a_state_at_a_discontinuity_shows_what_follows_it() {
    for leans in SPELLINGS {
        let mut shoot = righting().scene(Pot { leans, from: 1800.0, until: 3600.0 }).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::new(90.0);
        for (time, angle) in [(1800.0, 0.5), (3600.0, 0.0)] {
            run.advance(&mut shoot, time).unwrap();
            assert!(shoot.time() == time && (shoot.rod().frames()[0].angle() - angle).abs() < 1e-15);
        }
    }
}

/// A push on the apex for a while.
struct Push(Spelling);

impl Load for Push {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        if (self.0)(environment.time, 600.0, 2400.0) { Vector3::x() * 2e-6 } else { Vector3::zeros() }
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        [600.0, 2400.0].into_iter().find(|time| *time > t).unwrap_or(f64::INFINITY)
    }
}

/// A lamp at the side of e1 that is on for a while.
struct Lamp(Spelling);

impl TropismLaw for Lamp {
    fn declare(&self, to: &mut Declaration) {
        to.stimulus_pair();
        for _ in 0..2 {
            to.variable(Variable::read_after(720.0).relaxing_in(720.0));
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = if (self.0)(site.environment.time, 600.0, 2400.0) { 1.0 } else { 0.0 };
        let seen = site.along_directors(&Vector3::x()) * light;
        stimuli.copy_from_slice(&[seen.x, seen.y]);
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        (0..2).for_each(|j| rates[j] = (x[j] - y[j]) / 720.0);
    }
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(-past[1], past[0], 0.0) * (0.8 / at.section.radius())
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        Push(self.0).next_discontinuity(t)
    }
}

#[test]
fn loads_and_laws_that_are_switched_on_and_off() {
    let run = |spelling: Spelling, step: f64| {
        let laws = (steering(SettledStatoliths), Lamp(spelling));
        let mut shoot = righting().tropism(laws).load((WEIGHT, Push(spelling))).into_dyn().build().unwrap();
        MethodOfSteps::new(step).advance(&mut shoot, 2.0 * HOUR).unwrap();
        shoot.tip()
    };
    let best = run(SPELLINGS[0], 3.75);
    let errors = [120.0, 60.0, 30.0, 15.0].map(|step| {
        let expected = run(SPELLINGS[0], step);
        for spelling in &SPELLINGS[1..] {
            assert!((run(*spelling, step) - expected).norm() < 1e-12, "{step} s");
        }
        (expected - best).norm()
    });
    assert!(order(&errors) > 3.5 && errors[3] > 1e-13, "{errors:?}");
}

/// Announces what it is told to.
struct Announces<F>(F);

impl<F: Fn(f64) -> f64> Load for Announces<F> {
    fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        (self.0)(t)
    }
}

#[test]
fn announcements_that_make_no_sense() {
    fn refused(announce: impl Fn(f64) -> f64) -> String {
        let mut shoot = righting().load((WEIGHT, Announces(announce))).build().unwrap();
        let before = shoot.state().clone();
        let error = MethodOfSteps::new(90.0).advance(&mut shoot, 900.0).unwrap_err().to_string();
        assert!(shoot.state() == &before);
        assert!(error.contains("that the load announces") || error.contains("that a law announces"), "{error}");
        error
    }
    // Without end, not a number, the same for ever, one that has passed.
    assert!(refused(f64::next_up).contains("without end"));
    assert!(refused(|_| f64::NAN).contains("NaN"));
    assert!(refused(|_| 200.0).contains("200"));
    assert!(refused(|t| if t < 300.0 { 300.0 } else { t - 1.0 }).contains("299"));
    // Two that are one up to rounding are one.
    let two = |t: f64| [300.0, 300.0_f64.next_up()].into_iter().find(|time| *time > t).unwrap_or(f64::INFINITY);
    let mut shoot: Shoot<_> = righting().load((WEIGHT, Announces(two))).into_dyn().build().unwrap();
    let statistics = MethodOfSteps::new(90.0).advance(&mut shoot, 900.0).unwrap();
    let mut once = righting()
        .load((WEIGHT, Announces(|t: f64| if t < 300.0 { 300.0 } else { f64::INFINITY })))
        .into_dyn()
        .build()
        .unwrap();
    assert_eq!(statistics, MethodOfSteps::new(90.0).advance(&mut once, 900.0).unwrap());
}
