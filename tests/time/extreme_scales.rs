//! Times, stiffnesses and sizes far from those of plants. Each case is compared with its limit, or
//! with the same case on another mesh or in other units.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{
    DAY, HOUR, MINUTE, RADIUS, WEIGHT, YOUNG, assert_sound, elongating, growing, reduced,
    remembering, righting, rod, tips,
};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::{EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::integrator::{Adaptive, ConstantHistory, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Distributed, Pulse, Weight, Whirl};
use morphorod::rod::Rod;
use morphorod::tropism::{Memory, SettledStatoliths};
use morphorod::{DynLaws, Order, Scene, Shoot, ShootParameters, Still};
use nalgebra::Vector3;

fn tip_at(mut shoot: Shoot<DynLaws>, step: f64, time: f64) -> Vector3<f64> {
    let tip = tips(&mut shoot, step, &[time]).0[0];
    assert_sound(&shoot);
    tip
}

#[test]
fn delay_longer_than_the_run_leaves_the_shoot_unchanged() {
    let rest = tip_at(
        righting().tropism(()).into_dyn().build().unwrap(),
        90.0,
        0.0,
    );
    for delay in [10.5 * HOUR, 1e3 * HOUR, 1e12] {
        let memory = Memory { time: 720.0, delay };
        let laws = remembering(memory, memory).steering(SettledStatoliths);
        let tip = tip_at(
            righting().tropism(laws).into_dyn().build().unwrap(),
            90.0,
            10.0 * HOUR,
        );
        // The bound follows from the tolerance of the equilibria.
        assert!(
            abs_diff_eq!(InNorm(tip), InNorm(rest), epsilon = 1e-11),
            "{delay} s: {tip:?} against {rest:?}"
        );
    }
}

#[test]
fn response_of_a_very_slow_memory_is_inversely_proportional_to_its_time() {
    // While the shape is nearly constant, an initially empty memory is y = x t/τ, and the intrinsic
    // strain is proportional to x (t − d)²/(2τ).
    let moved = |time: f64| {
        let memory = Memory { time, delay: 720.0 };
        let laws = remembering(memory, memory).steering(SettledStatoliths);
        tip_at(
            righting().tropism(laws).into_dyn().build().unwrap(),
            90.0,
            5.0 * HOUR,
        )
    };
    let rest = tip_at(
        righting().tropism(()).into_dyn().build().unwrap(),
        90.0,
        0.0,
    );
    let [first, second] = [1e9, 1e10].map(|time| (moved(time) - rest) * time);
    // The relative effect of the change of shape is 1e-4.
    assert!(first.z > 0.0, "{first:?}");
    assert_abs_diff_eq!(InNorm(first), InNorm(second), epsilon = 1e-3 * first.norm());
}

#[test]
fn diverging_feedback_ends_in_a_sound_state_or_an_error() {
    for growth_time in [10.0 * HOUR, HOUR, 10.0 * MINUTE, MINUTE, 1.0] {
        let mut shoot = reduced(0.05, growth_time)
            .scene(Still::tilted(0.1))
            .elements(8)
            .into_dyn()
            .build()
            .unwrap();
        let before = shoot.state().clone();
        match MethodOfSteps::new(60.0).advance(&mut shoot, 5.0 * HOUR) {
            Ok(_) => assert_sound(&shoot),
            Err(error) => {
                assert!(
                    growth_time <= HOUR && before == *shoot.state(),
                    "τg = {growth_time} s: {error}"
                );
            }
        }
    }
}

#[test]
fn circular_orbit_is_unchanged_after_a_year() {
    let whirl = Whirl {
        force: 1e-5,
        period: 87.6 * MINUTE,
        turns: 2.0,
    };
    let mut shoot = reduced(0.0659, 20.0 * HOUR)
        .elements(2)
        .load((WEIGHT, whirl))
        .into_dyn()
        .build()
        .unwrap();
    let mut run = MethodOfSteps::new(360.0);
    let mut place = |time: f64| {
        let _ = run.advance(&mut shoot, time).unwrap();
        assert_sound(&shoot);
        (shoot.tip().xy().norm(), shoot.tip().z)
    };
    // The first call ends with a step of another length, because the rotating force ends between
    // two multiples of the step.
    let _ = place(30.0 * DAY);
    let (half, year) = (place(180.0 * DAY), place(365.0 * DAY));
    assert_relative_eq!(half.0, year.0, epsilon = 0.0, max_relative = 1e-9);
    assert_relative_eq!(half.1, year.1, epsilon = 0.0, max_relative = 1e-9);
    assert!(year.0 > 0.01, "the tip circles");
}

#[test]
fn mature_tissue_a_million_times_as_stiff_acts_like_rigid_tissue() {
    let stiff = |ratio: f64, elements: usize| {
        let parameters = ShootParameters {
            length: 0.1,
            zone_length: 0.05,
            growth_time: 20.0 * HOUR,
            mature_modulus: ratio * YOUNG.youngs_modulus,
            lignification_time: HOUR,
            ..ShootParameters::default()
        };
        let shoot = parameters
            .shoot()
            .elements(elements)
            .load((WEIGHT, Distributed(Vector3::new(0.0, -1e-6, 0.0))))
            .scene(Still::tilted(0.5))
            .into_dyn()
            .build()
            .unwrap();
        tip_at(shoot, 90.0, 10.0 * HOUR)
    };
    let (coarse, fine) = (stiff(1e6, 6), stiff(1e6, 12));
    assert_abs_diff_eq!(InNorm(coarse), InNorm(fine), epsilon = 1e-6);
    // The compliance of mature tissue is 1e-6 of that of young tissue.
    assert_abs_diff_eq!(InNorm(coarse), InNorm(stiff(1e9, 6)), epsilon = 1e-6);
    // The stiffness affects the tip position.
    assert!((coarse - stiff(1.0, 6)).norm() > 1e-4);
}

#[test]
fn twisted_rods_of_all_poissons_ratios_converge() {
    // A force perpendicular to the plane of its bend twists the rod.
    let rod = |poissons_ratio: f64, elements: usize| {
        let tissue = LinearElastic {
            poissons_ratio,
            ..YOUNG
        };
        let mut shoot = rod(tissue, 0.06)
            .elements(elements)
            .load((WEIGHT, ApicalForce(|_| Vector3::new(0.0, 3e-4, 0.0))))
            .scene(Still::tilted(FRAC_PI_2))
            .into_dyn()
            .build()
            .unwrap();
        shoot.set_intrinsic(|_| Vector3::x() * 20.0);
        shoot
    };
    let twisted =
        |poissons_ratio: f64, elements: usize| tip_at(rod(poissons_ratio, elements), 60.0, 0.0);
    // The number of Newton iterations increases as ν approaches −1, and is 700 here. The twist in a
    // step is proportional to the square of the size of the step.
    let limit = twisted(-1.0 + 1e-8, 16);
    for ratio in [0.5, 0.0, -0.9, -0.99, -0.999_999] {
        let (coarse, fine) = (twisted(ratio, 8), twisted(ratio, 16));
        // The bound is the tolerance of equilibria relative to the length.
        assert!(
            abs_diff_eq!(InNorm(coarse), InNorm(fine), epsilon = 1e-9 * 0.06),
            "ν = {ratio}: {coarse:?} against {fine:?}"
        );
        // The torsional stiffness K3 is proportional to 1/(1 + ν). The limit has no twist, and the
        // distance to it is proportional to 1 + ν.
        let share = (fine - limit).norm() / (1.0 + ratio);
        assert!((1.8e-3..4.2e-3).contains(&share), "ν = {ratio}: {share:e}");
    }
    let mut shoot = rod(-1.0 + 1e-9, 8);
    let before = shoot.state().clone();
    let error = MethodOfSteps::new(60.0)
        .advance(&mut shoot, 0.0)
        .unwrap_err();
    assert!(
        error.is_recoverable() && before == *shoot.state(),
        "{error}"
    );
}

/// Equilibrium of a rod clamped upright, from a straight initial guess, and its number of unstable
/// directions.
fn upright(length: f64, stable_only: bool) -> (Rod, Result<usize, EquilibriumError>) {
    let mut rod = Rod::uniform(length, RADIUS, Still::upright().base, 8, Order::Eight).unwrap();
    let mut solver = NewtonSolver {
        tolerance: 1e-13,
        stable_only,
        ..NewtonSolver::default()
    };
    let found = solver.solve(
        &mut rod,
        &YOUNG,
        &WEIGHT,
        &Still::upright().environment(0.0),
    );
    (rod, found.map(|found| found.inertia.negative))
}

#[test]
fn stability_is_correct_a_millionth_of_the_length_from_buckling() {
    // Greenhill's length of the default shoot, (7.83734744 E I/q)^⅓.
    let critical = 0.079_334_125_094;
    for (share, unstable) in [(1e-3, 2), (1e-6, 2), (-1e-6, 0), (-1e-3, 0)] {
        let length = critical * (1.0 + share);
        let (rod, found) = upright(length, false);
        assert_eq!(found.unwrap(), unstable, "{share:e}");
        assert!(
            rod.tip().xy().norm() < 1e-12 * length,
            "symmetry is preserved"
        );
        // The stable equilibrium leans by an angle of the order of the square root of the
        // relative excess length.
        let (rod, found) = upright(length, true);
        assert_eq!(found.unwrap(), 0, "{share:e}");
        let lean = rod.tip().xy().norm() / length;
        let expected = if share > 0.0 { f64::sqrt(share) } else { 0.0 };
        assert!(
            abs_diff_eq!(lean, expected, epsilon = 3.0 * expected),
            "{share:e}: {lean:e} against {expected:e}"
        );
        assert!(share < 0.0 || lean > 0.3 * expected, "{share:e}: {lean:e}");
    }
}

#[test]
fn rod_bent_into_circles_of_twice_its_radius_closes() {
    // Eight turns of a circle of twice the radius of the section.
    let (radius, turns) = (1e-3, 8.0);
    let length = turns * 2.0 * PI * 2.0 * radius;
    let mut shoot = Shoot::builder(YOUNG)
        .length(length)
        .radius(radius)
        .elements(4)
        .into_dyn()
        .build()
        .unwrap();
    shoot.set_intrinsic(|_| Vector3::new(0.0, 0.5 / radius, 0.0));
    let found = Adaptive::new(1e-10)
        .start(&mut shoot, &ConstantHistory::Empty)
        .unwrap();
    assert!(
        shoot.tip().norm() < 1e-10 * length,
        "{:e} {found:?}",
        shoot.tip().norm() / length
    );
}

#[test]
fn one_element_and_a_hundred_thousand_elements_give_the_same_shape() {
    let hanging = |elements: usize| {
        tip_at(
            righting()
                .elements(elements)
                .tropism(())
                .into_dyn()
                .build()
                .unwrap(),
            60.0,
            0.0,
        )
    };
    let reference = hanging(64);
    let (one, many) = (hanging(1), hanging(100_000));
    assert_abs_diff_eq!(InNorm(one), InNorm(reference), epsilon = 2e-4 * 0.05);
    // Rounding errors add up over the nodes.
    assert_abs_diff_eq!(InNorm(many), InNorm(reference), epsilon = 1e-10 * 0.05);
    let grown = |elements: usize| {
        tip_at(
            growing().elements(elements).into_dyn().build().unwrap(),
            90.0,
            5.0 * HOUR,
        )
    };
    let (one, eight) = (grown(1), grown(8));
    assert_abs_diff_eq!(InNorm(one), InNorm(eight), epsilon = 5e-3 * 0.07);
}

#[test]
fn shoots_of_a_hundred_times_the_weight_converge() {
    // The shoots hang, are horizontal or are nearly upright. At a hundred times the weight, q ℓ³/(E
    // I) is about 200.
    for tilt in [3.0, FRAC_PI_2, 0.3] {
        let heavy = |elements: usize| {
            let shoot = reduced(0.05, 20.0 * HOUR)
                .scene(Still::tilted(tilt))
                .load(Weight { density: 1e5 })
                .elements(elements)
                .into_dyn()
                .build()
                .unwrap();
            tip_at(shoot, 90.0, 10.0 * HOUR)
        };
        let (coarse, fine) = (heavy(16), heavy(32));
        assert!(
            abs_diff_eq!(InNorm(coarse), InNorm(fine), epsilon = 1e-6),
            "tilt {tilt}: {coarse:?} against {fine:?}"
        );
    }
}

#[test]
fn shoots_scaled_to_kilometres_and_nanometres_have_the_same_shape() {
    let grown = |unit: f64| {
        let parameters = ShootParameters {
            length: 0.068 * unit,
            radius: RADIUS * unit,
            zone_length: 0.07 * unit,
            // The ratio of weight to stiffness is ρ g ℓ³/(E r²).
            youngs_modulus: 1e7 * unit,
            mature_modulus: 2e9 * unit,
            ..ShootParameters::default()
        };
        let shoot = parameters
            .shoot()
            .elements(4)
            .scene(Still::tilted(0.2))
            .into_dyn()
            .build()
            .unwrap();
        tip_at(shoot, 90.0, 5.0 * HOUR) / unit
    };
    let metre = grown(1.0);
    for unit in [1e5, 1e-7, 3e8, 1e-11] {
        let found = grown(unit);
        // The tolerance of equilibria is an angle, and rounding may change the number of
        // iterations.
        assert!(
            abs_diff_eq!(InNorm(found), InNorm(metre), epsilon = 1e-9 * 0.07),
            "{unit:e}: {found:?} against {metre:?}"
        );
    }
}

/// Runs of a scene with coinciding stops, in several units of time. The pulse begins one or three
/// delays after the start of the run.
#[test]
fn unit_of_time_changes_neither_the_steps_nor_the_shape() {
    for (delays, duration) in [
        ([720.0, 720.0], 300.0),
        ([720.0, 600.0], 720.0),
        ([240.0, 137.0], 60.0),
    ] {
        let run = |unit: f64| {
            let memory = |delay: f64| Memory {
                time: 720.0 * unit,
                delay: delay * unit,
            };
            let pulse = Pulse {
                peak: Vector3::y() * 1e-5,
                start: 720.0 * unit,
                duration: duration * unit,
            };
            let [gravity, bending] = delays.map(memory);
            let laws = remembering(gravity, bending).steering(SettledStatoliths);
            let mut shoot = elongating(0.05, 0.04, 72e3 * unit)
                .tropism(laws)
                .scene(Still::tilted(0.5))
                .load((WEIGHT, pulse))
                .into_dyn()
                .build()
                .unwrap();
            let statistics = MethodOfSteps::new(120.0 * unit)
                .advance(&mut shoot, 7200.0 * unit)
                .unwrap();
            (statistics.steps, shoot.tip())
        };
        let (steps, tip) = run(1.0);
        for unit in [1e-2, 1e-4, 3e-5, 1e-6, 1e4] {
            let (same, other) = run(unit);
            assert_eq!(same, steps, "{delays:?}, {unit:e}");
            // Rounding of the times moves the tip of a shoot of 5 cm by less than 1e-13 m.
            assert_abs_diff_eq!(InNorm(other), InNorm(tip), epsilon = 1e-13);
        }
    }
}
