//! Laws with discontinuities, coded with `<` or `<=`, at the start of a run, inside it and at its
//! end.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{HOUR, WEIGHT, order, righting, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::{Cut, Load};
use morphorod::tropism::{Declaration, Growing, SettledStatoliths, Site, TropismLaw, Variable};
use morphorod::{Environment, Scene, Still, Turned};
use nalgebra::{UnitQuaternion, Vector3};

/// Function that returns whether t lies between two times, coded with `<` or `<=`.
type Spelling = fn(t: f64, from: f64, until: f64) -> bool;

const SPELLINGS: [Spelling; 4] = [
    |t, from, until| t >= from && t < until,
    |t, from, until| t > from && t <= until,
    |t, from, until| t >= from && t <= until,
    // The end has the rounding error of a difference.
    |t, from, until| t - from >= 0.0 && t - from < until - from,
];

/// Base that is tilted by 0.5 rad between the times `from` and `until` (s).
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
        Still::tilted(if (self.leans)(t, self.from, self.until) {
            0.5
        } else {
            0.0
        })
        .base
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        [self.from, self.until]
            .into_iter()
            .filter(|time| *time > t)
            .fold(f64::INFINITY, f64::min)
    }
}

/// Tip of the righting shoot in a scene at the time `end` (s).
fn tip(
    scene: impl Scene + Send + Sync + 'static,
    mut run: impl Integrator,
    end: f64,
) -> Vector3<f64> {
    let mut shoot = righting().scene(scene).into_dyn().build().unwrap();
    run.advance(&mut shoot, end).unwrap();
    shoot.tip()
}

#[test]
fn base_tilted_for_half_an_hour_keeps_fourth_order_however_the_condition_is_coded() {
    // In the second case the base is tilted at the start of the run. In the third case the times
    // coincide with no step, and their difference is rounded.
    for (from, until) in [
        (1800.0, 3600.0),
        (0.0, 1800.0),
        (1234.567, 3034.5670000000005),
    ] {
        let steps = [120.0, 60.0, 30.0, 15.0];
        let best = tip(
            Turned::tilted(0.5, from, until),
            MethodOfSteps::new(3.75),
            3.0 * HOUR,
        );
        let mut errors = Vec::new();
        for step in steps {
            let expected = tip(
                Turned::tilted(0.5, from, until),
                MethodOfSteps::new(step),
                3.0 * HOUR,
            );
            for leans in SPELLINGS {
                let found = tip(
                    Pot { leans, from, until },
                    MethodOfSteps::new(step),
                    3.0 * HOUR,
                );
                assert!(
                    abs_diff_eq!(InNorm(found), InNorm(expected), epsilon = 1e-12),
                    "from {from} s, steps of {step} s: {found:?} against {expected:?}"
                );
            }
            errors.push((expected - best).norm());
        }
        // The order is four. The last error is far above rounding and above the error of the
        // reference, which is 256 times smaller.
        assert!(
            order(&errors) > 3.5 && errors[3] > 1e-13,
            "{from} s: {errors:?}"
        );
    }
}

#[test]
fn base_tilted_at_the_start_acts_like_one_tilted_later() {
    // The first equilibrium is upright and stationary, so a later tilt gives the same motion with a
    // time shift.
    let after = |from: f64| {
        tip(
            Turned::tilted(0.5, from, f64::INFINITY),
            MethodOfSteps::new(22.5),
            from + HOUR,
        )
    };
    // The bound covers rounding of the times, at a tip speed of 7e-6 m/s, and rounding of the tip.
    let at_start = after(0.0);
    assert_abs_diff_eq!(InNorm(at_start), InNorm(after(1e-3)), epsilon = 1e-14);
    assert_abs_diff_eq!(InNorm(at_start), InNorm(after(777.7)), epsilon = 1e-14);
    // A state at a discontinuity shows the scene after it.
    let mut shoot = righting()
        .scene(Turned::tilted(0.5, 0.0, f64::INFINITY))
        .into_dyn()
        .build()
        .unwrap();
    MethodOfSteps::new(90.0).advance(&mut shoot, 0.0).unwrap();
    assert_abs_diff_eq!(shoot.rod().frames()[0].angle(), 0.5, epsilon = 1e-15);
}

#[test]
fn state_at_a_discontinuity_shows_the_scene_after_it() {
    for leans in SPELLINGS {
        let mut shoot = righting()
            .scene(Pot {
                leans,
                from: 1800.0,
                until: 3600.0,
            })
            .into_dyn()
            .build()
            .unwrap();
        let mut run = MethodOfSteps::new(90.0);
        for (time, angle) in [(1800.0, 0.5), (3600.0, 0.0)] {
            run.advance(&mut shoot, time).unwrap();
            assert_eq!(shoot.time(), time);
            assert_abs_diff_eq!(shoot.rod().frames()[0].angle(), angle, epsilon = 1e-15);
        }
    }
}

/// Force on the apex between 600 and 2400 s.
struct Push(Spelling);

impl Load for Push {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        if (self.0)(environment.time, 600.0, 2400.0) {
            Vector3::x() * 2e-6
        } else {
            Vector3::zeros()
        }
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        [600.0, 2400.0]
            .into_iter()
            .find(|time| *time > t)
            .unwrap_or(f64::INFINITY)
    }
}

/// Lamp in the direction e1 that is on between 600 and 2400 s.
struct Lamp(Spelling);

impl TropismLaw for Lamp {
    fn declare(&self, to: &mut Declaration) {
        to.stimulus_pair();
        for _ in 0..2 {
            to.variable(Variable::read_after(720.0).relaxing_in(720.0));
        }
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = if (self.0)(site.environment.time, 600.0, 2400.0) {
            1.0
        } else {
            0.0
        };
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
fn switched_loads_and_laws_keep_fourth_order_however_the_condition_is_coded() {
    let run = |spelling: Spelling, step: f64| {
        let laws = (steering(SettledStatoliths), Lamp(spelling));
        let mut shoot = righting()
            .tropism(laws)
            .load((WEIGHT, Push(spelling)))
            .into_dyn()
            .build()
            .unwrap();
        MethodOfSteps::new(step)
            .advance(&mut shoot, 2.0 * HOUR)
            .unwrap();
        shoot.tip()
    };
    let best = run(SPELLINGS[0], 3.75);
    let errors = [120.0, 60.0, 30.0, 15.0].map(|step| {
        let expected = run(SPELLINGS[0], step);
        for spelling in &SPELLINGS[1..] {
            let found = run(*spelling, step);
            assert!(
                abs_diff_eq!(InNorm(found), InNorm(expected), epsilon = 1e-12),
                "steps of {step} s: {found:?} against {expected:?}"
            );
        }
        (expected - best).norm()
    });
    assert!(order(&errors) > 3.5 && errors[3] > 1e-13, "{errors:?}");
}

/// Load without force that announces discontinuities by a given function.
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
fn invalid_announcements_of_discontinuities_are_errors() {
    fn refused(announce: impl Fn(f64) -> f64 + Send + Sync + 'static) -> String {
        let mut shoot = righting()
            .load((WEIGHT, Announces(announce)))
            .into_dyn()
            .build()
            .unwrap();
        let before = shoot.state().clone();
        let error = MethodOfSteps::new(90.0)
            .advance(&mut shoot, 900.0)
            .unwrap_err()
            .to_string();
        assert!(shoot.state() == &before);
        assert!(
            error.contains("next discontinuity of the load")
                || error.contains("that a law announces"),
            "{error}"
        );
        error
    }
    // Announced times: infinitely many, NaN, the same time for every t, a time before t.
    assert!(refused(f64::next_up).contains("without end"));
    assert!(refused(|_| f64::NAN).contains("not a number"));
    assert!(refused(|_| 200.0).contains("200"));
    assert!(refused(|t| if t < 300.0 { 300.0 } else { t - 1.0 }).contains("299"));
    // Two announced times that differ by rounding count as one.
    let two = |t: f64| {
        [300.0, 300.0_f64.next_up()]
            .into_iter()
            .find(|time| *time > t)
            .unwrap_or(f64::INFINITY)
    };
    let mut shoot = righting()
        .load((WEIGHT, Announces(two)))
        .into_dyn()
        .build()
        .unwrap();
    let statistics = MethodOfSteps::new(90.0).advance(&mut shoot, 900.0).unwrap();
    let mut once = righting()
        .load((
            WEIGHT,
            Announces(|t: f64| if t < 300.0 { 300.0 } else { f64::INFINITY }),
        ))
        .into_dyn()
        .build()
        .unwrap();
    assert_eq!(
        statistics,
        MethodOfSteps::new(90.0).advance(&mut once, 900.0).unwrap()
    );
}
