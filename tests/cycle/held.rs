//! Periodic orbits of held shoots.

use super::cycles::{multipliers, plain, swing};
use super::{planes, shoot};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::cycle::{CycleError, PeriodicOrbit, PeriodicSolver, RotatingWaveSolver};
use morphorod::equilibrium::{EquilibriumError, NewtonSolver};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::stability::Linearisation;
use morphorod::support::{Contact, HalfSpace, Hold, Moving, Support};
use morphorod::{DynLaws, Shoot};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Length of the shoots, m.
const LENGTH: f64 = 0.067;

fn held(support: impl Support + Send + Sync + 'static) -> Shoot<DynLaws> {
    shoot(LENGTH, 4)
        .support(support)
        .into_dyn()
        .build()
        .unwrap()
}

/// A spring (N/m) along e1 at the apex.
fn spring(stiffness: f64) -> Hold {
    let along = Matrix3::from_diagonal(&Vector3::new(stiffness, 0.0, 0.0));
    Hold::apex().spring(Vector3::z() * LENGTH, along)
}

/// Component `seen` of the tip (m) at the ends of periods of an orbit in time, after component
/// `about` of the intrinsic strain was disturbed.
fn disturbed(
    shoot: &Shoot<DynLaws>,
    orbit: &PeriodicOrbit,
    (about, seen): (usize, usize),
) -> Vec<f64> {
    let mut shoot = shoot.clone();
    let history = orbit.enter(&mut shoot).unwrap();
    shoot.set_intrinsic(|point| point.intrinsic + Vector3::ith(about, 2e-3));
    let mut run =
        MethodOfSteps::with_solver(orbit.period / 120.0, NewtonSolver::with_tolerance(1e-11));
    run.start(&mut shoot, &history).unwrap();
    let at = |k: u32| {
        run.advance(&mut shoot, f64::from(k) * orbit.period)
            .unwrap();
        shoot.tip()[seen]
    };
    (0..=14).map(at).collect()
}

/// Two leading multipliers: x(k + 2) = a x(k + 1) + b x(k) is fitted to a signal after six periods.
fn leading_two(signal: &[f64]) -> [f64; 2] {
    let (mut normal, mut right) = (nalgebra::Matrix2::zeros(), Vector2::zeros());
    for w in signal[6..].windows(3) {
        let scale = 1.0 / (w[0] * w[0] + w[1] * w[1]);
        let row = Vector2::new(w[1], w[0]);
        normal += row * row.transpose() * scale;
        right += row * (w[2] * scale);
    }
    let fit = normal.try_inverse().unwrap() * right;
    let root = (fit[0] * fit[0] + 4.0 * fit[1]).sqrt();
    [0.5 * (fit[0] + root), 0.5 * (fit[0] - root)]
}

/// The spring neither bends nor loads a swing across it. Disturbances out of its plane stretch the
/// spring.
#[test]
fn spring_across_the_plane_of_a_swing_changes_only_disturbances_out_of_the_plane() {
    let free = plain(LENGTH, 4);
    let alone = swing(&free, 0.034, 16);
    let supported = held(spring(5e-5));
    let orbit = swing(&supported, 0.034, 16);
    // Both orbits solve their equations to 1e-10.
    assert_relative_eq!(
        orbit.period,
        alone.period,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    let (excursion, rod) = orbit.largest_excursion(&supported).unwrap();
    assert_relative_eq!(
        excursion,
        alone.largest_excursion(&free).unwrap().0,
        epsilon = 0.0,
        max_relative = 1e-8
    );
    assert_abs_diff_eq!(rod.tip().x, 0.0, epsilon = 1e-10);
    let ([inside, outside], _) = multipliers(&free, &alone);
    let found = orbit.multipliers(&supported, 2).unwrap();
    assert!(found.trivial < 1e-4, "{}", found.trivial);
    let sets = planes(&found.values);
    assert_relative_eq!(
        sets[0][0].value.re,
        inside.re,
        epsilon = 0.0,
        max_relative = 1e-6
    );
    // Out of the plane the free shoot has the trivial multiplier of a rotation, which the spring
    // changes. It reduces the unstable one.
    assert!(sets[1][0].value.re < outside.re && sets[1][1].value.re < 0.95);
    let in_time = leading_two(&disturbed(&supported, &orbit, (1, 0)));
    for (k, in_time) in in_time.into_iter().enumerate() {
        let value = sets[1][k].value;
        assert_eq!(value.im, 0.0);
        // The disturbance of 1e-3 of the curvature has a nonlinear effect of its square, and time
        // steps have an error of 1e-5 of the logarithm.
        assert_relative_eq!(in_time, value.re, epsilon = 0.0, max_relative = 1e-3);
    }
}

#[test]
fn swing_of_a_shoot_with_an_elastic_joint_decays_in_time_by_its_multiplier() {
    let joint = Hold::place(0.5 * LENGTH).elastic_joint(nalgebra::UnitQuaternion::identity(), 2e-7);
    let shoot = held(joint);
    let orbit = swing(&shoot, 0.025, 16);
    let found = orbit.multipliers(&shoot, 1).unwrap();
    // The joint is symmetric about the vertical, so that a rotation of the swing has the multiplier
    // 1.
    assert!(found.trivial < 1e-4, "{}", found.trivial);
    let [inside, outside] = planes(&found.values).map(|set| set[0].value);
    assert!(
        inside.re < 1.0 && outside.re > 1.0,
        "a swing is unstable out of its plane: {inside} {outside}"
    );
    let (_, rod) = orbit.largest_excursion(&shoot).unwrap();
    let plane = if rod.tip().x.abs() > rod.tip().y.abs() {
        (1, 0)
    } else {
        (0, 1)
    };
    let signal = disturbed(&shoot, &orbit, plane);
    // At equal phases a shift in time is constant. The error of the period, by time steps, shifts
    // the orbit by equal amounts in each period. Second differences eliminate both.
    let decay = |k: usize| signal[k + 1] - 2.0 * signal[k] + signal[k - 1];
    let in_time = (decay(13) / decay(9)).powf(0.25);
    assert_relative_eq!(in_time, inside.re, epsilon = 0.0, max_relative = 1e-3);
}

#[test]
fn forced_orbits_of_shoots_with_moving_holds_are_the_limits_of_runs_in_time() {
    let period = 5400.0;
    let anchor = move |t: f64| {
        Vector3::new(
            2e-3 * (std::f64::consts::TAU * t / period).sin(),
            0.0,
            LENGTH,
        )
    };
    let spring = move |t: f64| {
        let lateral = Matrix3::from_diagonal(&Vector3::new(1e-3, 1e-3, 0.0));
        Hold::apex().spring(anchor(t), lateral)
    };
    let guide = move |t: f64| Hold::apex().on_line(anchor(t), Vector3::z_axis());
    let solver = PeriodicSolver {
        intervals: 8,
        ..PeriodicSolver::default()
    };
    for mut shoot in [held(Moving(spring)), held(Moving(guide))] {
        let orbit = solver.forced(&shoot, period).unwrap();
        let shapes = orbit.shapes(&shoot).unwrap();
        let mut run = MethodOfSteps::new(90.0);
        // Disturbances decay by exp(-0.9) in a period.
        run.advance(&mut shoot, 16.0 * period).unwrap();
        for (time, rod) in shapes {
            run.advance(&mut shoot, 16.0 * period + time).unwrap();
            let [there, here] = [&rod, shoot.rod()].map(|rod| rod.at(0.6 * LENGTH).unwrap().0);
            // The place moves by 0.7 mm. Time steps have a relative error of 5e-5.
            assert_abs_diff_eq!((there - here).norm(), 0.0, epsilon = 1e-7);
        }
    }
    let other = solver.forced(&held(Moving(spring)), 1.1 * period);
    assert!(
        matches!(other, Err(CycleError::NotInvariant { .. })),
        "{other:?}"
    );
}

#[test]
fn rotating_waves_relative_orbits_and_orbits_that_touch_an_obstacle_are_refused() {
    let supported = held(spring(5e-5));
    let root = Linearisation::about(&supported)
        .unwrap()
        .rightmost()
        .unwrap();
    let wave = RotatingWaveSolver::default()
        .from_mode(&supported, &root, 0.02)
        .map(|_| ());
    let half = PeriodicSolver {
        angle: Some(std::f64::consts::PI),
        ..PeriodicSolver::default()
    };
    let half = half.from_mode(&supported, &root, 0.02).map(|_| ());
    for answer in [wave, half] {
        let refused = matches!(&answer, Err(CycleError::Parameter(error)) if error.name == "number of supports");
        assert!(refused, "{answer:?}");
    }
    // Walls that the upright shoot does not touch, and its swing of 3 cm does.
    let wall = |normal: Vector3<f64>| {
        let obstacle = HalfSpace {
            through: -normal * 0.01,
            normal,
        };
        Contact {
            obstacle,
            radius: 5e-4,
            friction: 0.0,
        }
    };
    let narrow = held(vec![
        wall(Vector3::x()),
        wall(-Vector3::x()),
        wall(Vector3::y()),
        wall(-Vector3::y()),
    ]);
    let answer = PeriodicSolver::default().from_mode(&narrow, &root, 0.03);
    let touches = matches!(&answer, Err(CycleError::Equilibrium(EquilibriumError::Parameter(error)))
        if error.name == "number of contacts with obstacles" && error.value == 1.0);
    assert!(touches, "{answer:?}");
}
