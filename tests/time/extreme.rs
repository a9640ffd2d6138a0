//! Unusual cases: sudden and rotating scenes, stiff and slow laws, tissue that grows fast or for
//! long, a shoot that collapses, a mesh of one element. The state remains sound and a run with
//! shorter steps or more elements agrees.

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots;
use std::f64::consts::{PI, TAU};

use crate::fixtures::shoots::{
    Clinostat, DAY, HOUR, MEMORY, STATOLITHS, WEIGHT, YOUNG, assert_sound, growing, reduced,
    remembering, righting, rod, steering,
};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Integrator, MethodOfSteps, Statistics};
use morphorod::load::Distributed;
use morphorod::tropism::{
    Gravitropism, Memory, Oscillator, Perception, Proprioception, Response, SettledStatoliths,
    Statoliths,
};
use morphorod::{Model, Scene, Shoot, ShootParameters, Still};
use nalgebra::{UnitQuaternion, Vector3};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Tips at the times (s). Fails unless every state is sound and, if statoliths are the first
/// variables (`piles`), the normal of every pile is a unit vector.
fn sound_tips(
    mut shoot: Shoot<impl Model>,
    step: f64,
    times: &[f64],
    piles: bool,
) -> Vec<Vector3<f64>> {
    let mut run = MethodOfSteps::new(step);
    let tip = |t: &f64| {
        run.advance(&mut shoot, *t).unwrap();
        assert_sound(&shoot);
        for y in (0..shoot.rod().points().len())
            .filter_map(|i| shoot.state().variables(i))
            .filter(|_| piles)
        {
            // The error of a step is far below this bound.
            let norm = Vector3::from_column_slice(&y[..3]).norm();
            assert!(
                abs_diff_eq!(norm, 1.0, epsilon = 1e-4),
                "norm {norm} of {y:?} after {t} s"
            );
        }
        shoot.tip()
    };
    times.iter().map(tip).collect()
}

fn distance(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

fn hours<const N: usize>(hours: [f64; N]) -> [f64; N] {
    hours.map(|h| h * HOUR)
}

/// Documented error of the growing shoot with steps of 90 s, in metres.
const DEFAULT_ERROR: f64 = 1e-5;

/// Base that is tilted by an angle (rad) after 1.5 h.
struct Tilted(f64);

impl Scene for Tilted {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        DOWN
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(
            &Vector3::y_axis(),
            if t > 1.5 * HOUR { self.0 } else { 0.0 },
        )
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < 1.5 * HOUR {
            1.5 * HOUR
        } else {
            f64::INFINITY
        }
    }
}

#[test]
fn sudden_tilt_of_the_base_keeps_the_default_accuracy() {
    let times = hours([1.0, 1.5, 1.6, 2.0, 4.0, 6.0]);
    for degrees in [90.0_f64, 135.0, 180.0] {
        let shoot = || {
            growing()
                .scene(Tilted(degrees.to_radians()))
                .into_dyn()
                .build()
                .unwrap()
        };
        let found = sound_tips(shoot(), 90.0, &times, false);
        let error = distance(&found, &sound_tips(shoot(), 22.5, &times, false));
        assert!(error < DEFAULT_ERROR, "{degrees}°: {error:e} m");
    }
    // The jump takes effect just after its time. A state at that time shows the base after the
    // jump.
    let mut shoot = growing().scene(Tilted(1.0)).into_dyn().build().unwrap();
    let _ = MethodOfSteps::new(90.0)
        .advance(&mut shoot, 1.5 * HOUR)
        .unwrap();
    assert_abs_diff_eq!(shoot.rod().frames()[0].angle(), 1.0, epsilon = 1e-15);
}

#[test]
fn shoot_turned_exactly_upside_down_stays_sound() {
    // Without imperfections, only rounding makes the shoot leave this planar equilibrium, so a
    // finer run is not comparable.
    let laws = steering(STATOLITHS);
    let shoot = reduced(0.065, 20.0 * HOUR)
        .tropism(laws)
        .scene(Tilted(PI))
        .into_dyn()
        .build()
        .unwrap();
    let tips = sound_tips(shoot, 90.0, &hours([1.5, 1.6, 2.0, 4.0, 8.0, 16.0]), true);
    assert!(tips[0].z < -0.0649, "the shoot hangs");
}

#[test]
fn shoot_on_a_clinostat_converges_at_fourth_order() {
    let times = hours([0.5, 1.0, 2.0, 4.0]);
    let run = |step: f64| {
        let shoot = reduced(0.05, 40.0 * HOUR)
            .tropism(steering(STATOLITHS))
            .scene(Clinostat(TAU / HOUR));
        sound_tips(shoot.into_dyn().build().unwrap(), step, &times, true)
    };
    let fine = run(5.0);
    let errors = [90.0, 45.0, 22.5, 11.25].map(|step| distance(&run(step), &fine));
    assert!(
        shoots::order(&errors) >= 3.5,
        "order {} {errors:?}",
        shoots::order(&errors)
    );
    // A growing shoot, too long to stand upright, on a fast clinostat.
    let shoot = growing()
        .scene(Clinostat(TAU / 600.0))
        .into_dyn()
        .build()
        .unwrap();
    let _ = sound_tips(shoot, 30.0, &hours([1.0, 3.0, 6.0]), false);
}

/// Weightlessness for an hour, then tilted gravity.
struct Launch;

impl Scene for Launch {
    fn gravity(&self, t: f64) -> Vector3<f64> {
        if t > HOUR {
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1.0) * DOWN
        } else {
            Vector3::zeros()
        }
    }
    fn base(&self, _t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::identity()
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        if t < HOUR { HOUR } else { f64::INFINITY }
    }
}

#[test]
fn weightless_shoot_grows_and_statoliths_respond_to_late_gravity() {
    let shoot = || {
        growing()
            .load(())
            .scene(Still::weightless())
            .into_dyn()
            .build()
            .unwrap()
    };
    let times = hours([1.0, 4.0, 10.0]);
    let found = sound_tips(shoot(), 90.0, &times, false);
    let error = distance(&found, &sound_tips(shoot(), 22.5, &times, false));
    assert!(error < DEFAULT_ERROR, "{error:e} m");
    // Ten avalanche times after the onset of gravity, the deviation of the piles from their
    // equilibrium has decayed by exp(−10).
    let mut shoot = reduced(0.05, 20.0 * HOUR)
        .tropism(steering(STATOLITHS))
        .scene(Launch)
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut shoot, HOUR + 20.0 * 60.0).unwrap();
    let up = -shoot.model().scene().gravity(shoot.time()).normalize();
    // The first point is next to the clamp, where the directors are those of the base.
    let h = Vector3::from_column_slice(&shoot.state().variables(0).unwrap()[..3]);
    assert_abs_diff_eq!(InNorm(h), InNorm(up), epsilon = 0.01);
}

#[test]
fn fast_statoliths_approach_settled_statoliths_in_proportion_to_the_avalanche_time() {
    let times = hours([2.0, 5.0]);
    let shoot = |avalanche_time: f64| {
        righting()
            .elements(2)
            .tropism(steering(Statoliths { avalanche_time }))
            .into_dyn()
            .build()
            .unwrap()
    };
    let limit = sound_tips(
        righting().elements(2).into_dyn().build().unwrap(),
        30.0,
        &times,
        false,
    );
    let off = [1.0, 0.1, 1e-2, 1e-3]
        .map(|tau| distance(&sound_tips(shoot(tau), 30.0, &times, true), &limit));
    // The pile lags by τa, 1/30 to 1/30000 of the step. The distance is proportional to τa, with
    // 9.4 µm at 1 s. Two ways of integrating one memory differ by 1e-10 m.
    for pair in off.windows(2) {
        assert!(
            abs_diff_eq!(pair[0] / pair[1], 10.0, epsilon = 0.2),
            "{off:?}"
        );
    }
    for tau in [10.0, 1e3, 1e5, 1e6] {
        let _ = sound_tips(shoot(tau), 90.0, &times, true);
    }
}

#[test]
fn statoliths_with_avalanche_times_below_a_millisecond_need_no_shorter_steps() {
    fn run(
        perception: impl Perception<Signal = [f64; 2]> + Send + Sync + 'static,
    ) -> (Vector3<f64>, Statistics) {
        let (gravitropism, proprioception) = steering(perception);
        let laws = (Oscillator::new(0.2, 1440.0), gravitropism, proprioception);
        let mut shoot = growing().tropism(laws).into_dyn().build().unwrap();
        let spent = MethodOfSteps::new(90.0)
            .advance(&mut shoot, 10.0 * HOUR)
            .unwrap();
        (shoot.tip(), spent)
    }
    let (limit, counts) = run(SettledStatoliths);
    for tau in [1e-9, 1e-6, 1e-3] {
        let (tip, spent) = run(Statoliths {
            avalanche_time: tau,
        });
        // Two ways of integrating one memory differ by an error of the step, 1e-7 m.
        assert!(
            abs_diff_eq!(InNorm(tip), InNorm(limit), epsilon = 1e-6),
            "τa = {tau} s: {tip:?} against {limit:?}"
        );
        assert_eq!(
            (spent.steps, spent.halvings),
            (counts.steps, 0),
            "τa = {tau} s"
        );
    }
}

#[test]
fn memory_far_shorter_than_the_step_costs_little_accuracy() {
    let quick = Memory {
        time: 1.0,
        delay: 720.0,
    };
    let laws = remembering(quick, quick).steering(SettledStatoliths);
    let run = |step: f64| {
        let shoot = righting()
            .elements(4)
            .tropism(laws)
            .into_dyn()
            .build()
            .unwrap();
        sound_tips(shoot, step, &hours([1.0, 2.0, 4.0, 6.0]), false)
    };
    // The memory fills in 1 s, while the first step is 1.4 s. The bound is 5 % of the motion in 1
    // s, (β/(r τg)) ℓ²/2 · 1 s = 2.8e-5 m.
    let error = distance(&run(90.0), &run(11.25));
    assert!(error < 1.4e-6, "{error:e} m");
}

#[test]
fn strong_fast_oscillator_keeps_the_default_accuracy() {
    let (gravitropism, proprioception) = steering(STATOLITHS);
    let shoot = || {
        growing()
            .tropism((Oscillator::new(0.3, 1200.0), gravitropism, proprioception))
            .into_dyn()
            .build()
            .unwrap()
    };
    let times = hours([1.0, 4.0, 10.0]);
    let error = distance(
        &sound_tips(shoot(), 90.0, &times, false),
        &sound_tips(shoot(), 22.5, &times, false),
    );
    assert!(error < DEFAULT_ERROR, "{error:e} m");
}

#[test]
fn ten_growth_times_have_the_exact_length_and_a_converged_tip() {
    // The zone is renewed ten times. Every point that is in it at the end was initially within ℓg
    // exp(−10) of the apex.
    let shoot = |elements: usize| {
        let (gravitropism, proprioception) = steering(STATOLITHS);
        rod(YOUNG, 0.01)
            .elements(elements)
            .growth(UniformGrowth {
                zone_length: 0.03,
                time: 20.0 * HOUR,
            })
            .tropism((Oscillator::new(0.02, DAY), gravitropism, proprioception))
            .load(Distributed(Vector3::new(0.0, -1e-7, 0.0)))
            .into_dyn()
            .build()
            .unwrap()
    };
    let mut coarse = shoot(8);
    let _ = MethodOfSteps::new(360.0)
        .advance(&mut coarse, 200.0 * HOUR)
        .unwrap();
    assert_sound(&coarse);
    let exact = 0.03 * (1.0 + 10.0 - 3.0_f64.ln());
    assert_relative_eq!(
        coarse.rod().length(),
        exact,
        epsilon = 0.0,
        max_relative = 1e-12
    );
    let mut fine = shoot(12);
    let _ = MethodOfSteps::new(180.0)
        .advance(&mut fine, 200.0 * HOUR)
        .unwrap();
    // Merging may rotate a frame by 1e-4 rad; the shoot is 30 cm long.
    assert_abs_diff_eq!(
        InNorm(coarse.tip()),
        InNorm(fine.tip()),
        epsilon = 1e-4 * exact
    );
}

#[test]
fn several_elements_may_leave_the_growth_zone_in_one_step() {
    let shoot = |elements: usize| {
        growing()
            .length(0.05)
            .elements(elements)
            .growth(UniformGrowth {
                zone_length: 0.03,
                time: 600.0,
            })
            .tropism((
                Oscillator::new(0.01, 1440.0),
                Gravitropism {
                    sensitivity: 0.01,
                    perception: STATOLITHS,
                }
                .remembered(MEMORY),
                Proprioception { sensitivity: 0.2 }.remembered(MEMORY),
            ))
            .into_dyn()
            .build()
            .unwrap()
    };
    let times = [300.0, 600.0, 1200.0, 2400.0];
    let fine = sound_tips(shoot(32), 22.5, &times, false);
    for elements in [1, 4, 16] {
        let mut last = shoot(elements);
        let _ = MethodOfSteps::new(90.0).advance(&mut last, 2400.0).unwrap();
        // Tissue that leaves the zone in one step is stretched by up to exp(0.15). Its length is a
        // sum over the four Gauss points of an element, with a relative error of (0.15)⁸ · 1.6e-17
        // · 8!, repeated about a hundred times.
        assert!(
            relative_eq!(
                last.rod().length(),
                0.17,
                epsilon = 0.0,
                max_relative = 1e-11
            ),
            "{elements} elements: {} m",
            last.rod().length()
        );
        let error = distance(&sound_tips(shoot(elements), 90.0, &times, false), &fine);
        // Steps of 90 s are long for a shoot that grows e-fold in 600 s.
        assert!(error < DEFAULT_ERROR, "{elements} elements: {error:e} m");
    }
}

#[test]
fn zone_of_one_element_is_accurate_to_the_order_of_the_element() {
    let times = hours([1.0, 4.0, 10.0]);
    let one = sound_tips(
        growing().elements(1).into_dyn().build().unwrap(),
        90.0,
        &times,
        false,
    );
    let many = sound_tips(
        growing().elements(8).into_dyn().build().unwrap(),
        90.0,
        &times,
        false,
    );
    // The error is of eighth order: 1e-9 of the length with four elements, and 4⁸ times as much
    // with one. Feedback increases it further.
    let error = distance(&one, &many);
    assert!(error < 5e-4 * 0.0855, "{error:e} m");
}

#[test]
fn collapsing_soft_shoot_stays_sound_or_ends_in_a_recoverable_error() {
    let shoot = |modulus: f64| {
        let parameters = ShootParameters {
            youngs_modulus: modulus,
            ..ShootParameters::default()
        };
        let builder = parameters.reduced().growth(parameters.growth());
        builder
            .tropism(steering(STATOLITHS))
            .load((WEIGHT, Distributed(Vector3::new(1e-5, 3e-6, 0.0))))
            .into_dyn()
            .build()
            .unwrap()
    };
    // These shoots are two and five times softer than one that is just stable upright. They bend
    // down and remain bent.
    for modulus in [5e6, 2e6] {
        let tips = sound_tips(
            shoot(modulus),
            90.0,
            &hours([0.0, 0.5, 1.0, 2.0, 4.0, 8.0]),
            false,
        );
        assert!(tips.iter().all(|tip| tip.z < 0.04), "{tips:?}");
    }
    // Shoots as soft as these may snap to a shape that the solver does not find. The error is then
    // recoverable.
    for modulus in [1e6, 1e5, 1e4] {
        let mut soft = shoot(modulus);
        let mut run = MethodOfSteps::new(90.0);
        for hour in 0..5 {
            let before = soft.state().clone();
            match run.advance(&mut soft, f64::from(hour) * HOUR) {
                Ok(_) => assert_sound(&soft),
                Err(error) => {
                    assert!(error.is_recoverable(), "{error}");
                    assert!(&before == soft.state());
                    break;
                }
            }
        }
    }
}
