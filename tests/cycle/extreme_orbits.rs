//! Periodic orbits of extreme shoots, and invalid initial guesses, settings and orbits. The solvers
//! return an orbit, or an error that states the cause, in bounded time.

use std::sync::{Arc, LazyLock};

use super::absent_orbits::{
    Growth, LENGTH, MODE, Place, Plan, both, both_from, memories, plan, refused, within,
};
use super::{assert_complex_eq, planes};
use crate::fixtures::exact_orbit::rate;
use crate::fixtures::shoots::{HOUR, MINUTE, steering};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use morphorod::cycle::{CycleError, PeriodicOrbit, PeriodicSolver, RotatingWaveSolver};
use morphorod::stability::Root;
use morphorod::tropism::{SettledStatoliths, Statoliths, TropismLaw};
use morphorod::{DynLaws, Shoot};
use nalgebra::Complex;

/// Stiff laws. Disturbances that decay immediately must not appear as multipliers. With collocation
/// at Gauss points, statoliths that settle in a millisecond had a multiplier of 0.996 at every
/// material point.
#[test]
fn fast_statoliths_have_the_multipliers_of_settled_ones() {
    let leading = |tropism: fn() -> Arc<dyn TropismLaw + Send + Sync>| {
        within("statoliths", move || {
            let root = super::mode(
                &Plan {
                    elements: 4,
                    ..plan(LENGTH)
                }
                .shoot(),
            );
            let shoot = Plan {
                tropism: tropism(),
                elements: 4,
                ..plan(LENGTH)
            }
            .shoot();
            let orbit = PeriodicSolver::default()
                .from_mode(&shoot, &root, 0.03)
                .unwrap();
            (
                orbit.period,
                planes(&orbit.multipliers(&shoot, 3).unwrap().values),
            )
        })
    };
    let (period, settled) = leading(|| Arc::new(steering(SettledStatoliths)));
    let (same, fast) = leading(|| {
        Arc::new(steering(Statoliths {
            avalanche_time: 1e-3,
        }))
    });
    // The avalanche adds about 1e-3 s to a reaction time of 12 min, a relative change of 1e-6.
    assert_relative_eq!(same, period, epsilon = 0.0, max_relative = 3e-6);
    // Reference values from harmonic balance and from a spectral method, on finer elements. The
    // error due to four elements is less than 1e-8.
    assert_abs_diff_eq!(period / MINUTE, 87.661_715_125, epsilon = 1e-6);
    for (one, known) in [
        (settled[0][0], 0.657_775_328),
        (settled[1][0], 1.166_270_117),
    ] {
        assert_complex_eq("settled", one.value, Complex::from(known), 1e-6);
    }
    for (a, b) in settled.iter().flatten().zip(fast.iter().flatten()) {
        // The relative change of 1e-6 is amplified by the sensitivity of the multipliers, which is
        // less than ten.
        assert_complex_eq("settled and fast", a.value, b.value, 3e-5);
    }
}

/// Panics unless the circle has the exact rate for equal memories. The history must be as long as
/// the delay, also when the period changes between iterations.
fn assert_exact_rate(what: &str, time: f64, delay: f64) {
    let (circle, plane) = both(what, move || Plan::steered(memories(time, delay)));
    let circle = circle.unwrap();
    // With equal memories the rate satisfies ωτr + atan ωτm = π/2 + 2πn for any shape. The
    // tolerance is that of the solver, 1e-11, times the sensitivity of the rate to a small change
    // of the strain.
    let turns = (circle.rate * delay + (circle.rate * time).atan()) / std::f64::consts::TAU - 0.25;
    assert!(
        abs_diff_eq!(turns, turns.round(), epsilon = 1e-9),
        "{what}: {turns}"
    );
    // The periods of a swing and a circle differ by a term of fourth order in the amplitude, about
    // one percent.
    let plane = plane.unwrap();
    let equal = relative_eq!(
        plane.period,
        circle.period(),
        epsilon = 0.0,
        max_relative = 0.02
    );
    assert!(
        equal,
        "{what}: {} against {}",
        plane.period,
        circle.period()
    );
}

#[test]
fn circle_with_a_delay_of_two_periods_has_the_exact_rate() {
    assert_exact_rate("a long delay", 12.0 * MINUTE, 200.0 * MINUTE);
}

#[test]
fn circle_with_a_memory_of_a_millisecond_has_the_exact_rate() {
    assert_exact_rate("no memory", 1e-3, 24.0 * MINUTE);
}

/// The state would need one history level for each step of the delay.
#[test]
fn delays_of_very_many_periods_are_refused() {
    let (_, plane) = both("a delay without end", || {
        Plan::steered(memories(12.0 * MINUTE, 1e9))
    });
    assert_eq!(refused(plane), "longest delay, in periods");
}

#[test]
fn invalid_initial_guesses_are_refused_by_name() {
    within("initial guesses", || {
        let (shoot, root) = (plan(LENGTH).shoot(), &*MODE);
        let circle =
            |root: &Root, radius| RotatingWaveSolver::default().from_mode(&shoot, root, radius);
        let swing =
            |root: &Root, amplitude| PeriodicSolver::default().from_mode(&shoot, root, amplitude);
        // No orbit has an amplitude above the length of the shoot.
        for amplitude in [f64::NAN, f64::INFINITY, 0.0, -0.02, 10.0, 1e300] {
            assert_eq!(
                refused(circle(root, amplitude)),
                "amplitude of the initial guess"
            );
            assert_eq!(
                refused(swing(root, amplitude)),
                "amplitude of the initial guess"
            );
        }
        assert!(matches!(
            circle(root, 1e-9),
            Err(CycleError::Stationary { .. })
        ));
        assert!(matches!(
            swing(root, 1e-9),
            Err(CycleError::Stationary { .. })
        ));
        let with_rate = |rate: f64| {
            let mut root = root.clone();
            root.value.im = rate;
            root
        };
        for rate in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(
                refused(circle(&with_rate(rate), 0.02)),
                "rate of the initial guess"
            );
        }
        for rate in [1e-300, 1e-12, 1e12] {
            assert!(circle(&with_rate(rate), 0.02).is_err());
        }
        for strain in [vec![], root.strain[1..].to_vec()] {
            let mut other = root.clone();
            other.strain = strain;
            assert_eq!(
                refused(circle(&other, 0.02)),
                "number of strains of the initial guess"
            );
        }
        let of_another = super::mode(
            &Plan {
                elements: 8,
                ..plan(LENGTH)
            }
            .shoot(),
        );
        assert_eq!(
            refused(swing(&of_another, 0.02)),
            "number of strains of the mode"
        );
        let mut odd = root.clone();
        odd.strain[3].x = Complex::new(f64::NAN, 0.0);
        assert_eq!(refused(swing(&odd, 0.02)), "strain of the mode");
        for rate in [0.0, f64::NAN, -1e-3] {
            assert_eq!(
                refused(swing(&with_rate(rate), 0.02)),
                "frequency of the mode"
            );
        }
        for rate in [1e-12, 1e12] {
            assert!(swing(&with_rate(rate), 0.02).is_err());
        }
    });
}

#[test]
fn invalid_settings_are_refused_by_name() {
    within("settings", || {
        let (shoot, root) = (plan(LENGTH).shoot(), &*MODE);
        for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let solver = RotatingWaveSolver {
                tolerance,
                ..RotatingWaveSolver::default()
            };
            assert_eq!(
                refused(solver.from_mode(&shoot, root, 0.02)),
                "tolerance of a rotating wave"
            );
            let solver = PeriodicSolver {
                tolerance,
                ..PeriodicSolver::default()
            };
            assert_eq!(
                refused(solver.from_mode(&shoot, root, 0.02)),
                "tolerance of a periodic orbit"
            );
        }
        let of = |intervals, stages| {
            let solver = PeriodicSolver {
                intervals,
                stages,
                ..PeriodicSolver::default()
            };
            solver.from_mode(&shoot, root, 0.03)
        };
        for intervals in [0, 1001, usize::MAX] {
            assert_eq!(refused(of(intervals, 6)), "intervals in a period");
        }
        for stages in [0, 17, usize::MAX] {
            assert_eq!(refused(of(16, stages)), "points in an interval");
        }
        let circle = RotatingWaveSolver::default()
            .from_mode(&shoot, root, 0.02)
            .unwrap();
        let (other, swing) = &*SWING;
        for count in [0, 39, usize::MAX] {
            assert_eq!(
                refused(swing.multipliers(other, count)),
                "number of multipliers"
            );
        }
        for count in [0, 20, usize::MAX] {
            assert_eq!(refused(circle.roots(&shoot, count)), "number of roots");
        }
        let message = swing.multipliers(other, 39).unwrap_err().to_string();
        assert_eq!(
            message,
            "number of multipliers is 39 but must be from 1 to 38"
        );
    });
}

/// Plain shoot of 6.7 cm and its swing.
static SWING: LazyLock<(Shoot<DynLaws>, PeriodicOrbit)> = LazyLock::new(|| {
    let shoot = plan(LENGTH).shoot();
    let swing = PeriodicSolver::default()
        .from_mode(&shoot, &MODE, 0.03)
        .unwrap();
    (shoot, swing)
});

/// A tolerance below the rounding error cannot be reached, and the solver must report this.
#[test]
fn circular_solver_reports_when_its_bounds_are_reached() {
    within("bounds", || {
        let shoot = plan(LENGTH).shoot();
        let solver = RotatingWaveSolver {
            tolerance: 1e-30,
            ..RotatingWaveSolver::default()
        };
        assert!(matches!(
            solver.from_mode(&shoot, &MODE, 0.02),
            Err(CycleError::NotConverged { iterations: 40, .. })
        ));
        let none = RotatingWaveSolver {
            max_iterations: 0,
            ..RotatingWaveSolver::default()
        };
        assert!(matches!(
            none.from_mode(&shoot, &MODE, 0.02),
            Err(CycleError::NotConverged { iterations: 0, .. })
        ));
    });
}

/// The work is that of all grids. With the reported number of equilibria the search succeeds, with
/// fewer it ends by an error before the next iteration.
#[test]
fn search_for_an_orbit_ends_at_its_limit_of_work() {
    within("limit of work", || {
        let (shoot, swing) = &*SWING;
        let limited = |max_work| {
            PeriodicSolver {
                max_work,
                ..PeriodicSolver::default()
            }
            .from_mode(shoot, &MODE, 0.03)
        };
        assert_eq!(limited(swing.equilibria).unwrap().period, swing.period);
        let Err(CycleError::WorkLimit { work, residual }) = limited(swing.equilibria / 2) else {
            panic!("no limit")
        };
        assert!(work >= swing.equilibria / 2 && work < swing.equilibria && residual.is_finite());
    });
}

/// The delay is shorter than the single interval. Delayed values therefore lie in the interval that
/// is being solved, and the solver iterates until delayed and computed values agree.
#[test]
fn swing_on_a_single_interval_of_twelve_points_has_its_period() {
    within("one interval", || {
        let (shoot, fine) = &*SWING;
        let solver = PeriodicSolver {
            intervals: 1,
            stages: 12,
            accuracy: 1e-2,
            ..PeriodicSolver::default()
        };
        let whole = solver.from_mode(shoot, &MODE, 0.03).unwrap();
        assert_relative_eq!(
            whole.period,
            fine.period,
            epsilon = 0.0,
            max_relative = 1e-3
        );
    });
}

/// Multipliers close to the rounding error of the return map are not resolved.
#[test]
fn many_multipliers_converge_or_end_where_the_map_is_rounding() {
    within("multipliers", || {
        let (shoot, swing) = &*SWING;
        let found = swing.multipliers(shoot, 12).unwrap();
        for set in &planes(&found.values) {
            assert!(set.len() >= 12 || found.radius == 1e-3, "{}", set.len());
            assert!(
                set.iter()
                    .all(|one| one.value.norm() > 1e-3 && one.residual < 1e-6),
                "{set:?}"
            );
        }
    });
}

/// The mirror image of a circle has the same radius, the opposite rate and the same roots.
#[test]
fn clockwise_circle_is_the_mirror_image_of_the_counterclockwise_one() {
    within("clockwise", || {
        let shoot = plan(LENGTH).shoot();
        let mut mirrored = MODE.clone();
        mirrored.value = mirrored.value.conj();
        mirrored
            .strain
            .iter_mut()
            .for_each(|strain| *strain = strain.map(|x| x.conj()));
        let circle = |root: &Root| {
            RotatingWaveSolver::default()
                .from_mode(&shoot, root, 0.02)
                .unwrap()
        };
        let [one, other] = [circle(&MODE), circle(&mirrored)];
        // The tolerance of the solver is 1e-11 of the largest gradient, and the rates have errors
        // of this order. The error of the radius is larger by a factor of order one.
        assert_relative_eq!(one.rate, -other.rate, epsilon = 0.0, max_relative = 1e-9);
        assert_abs_diff_eq!(one.radius(), other.radius(), epsilon = 1e-9 * LENGTH);
        let [a, b] = [&one, &other].map(|orbit| orbit.roots(&shoot, 2).unwrap().roots);
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            // The error due to finite differences in the linearisation is 1e-9.
            assert_complex_eq("root", a.value, b.value, 1e-7 * one.rate);
        }
    });
}

#[test]
fn orbits_of_other_shoots_are_refused() {
    within("other shoots", || {
        let (shoot, plane) = &*SWING;
        let circle = RotatingWaveSolver::default()
            .from_mode(shoot, &MODE, 0.02)
            .unwrap();
        let others: [(&str, Shoot<DynLaws>); 5] = [
            ("longer", plan(0.068).shoot()),
            (
                "finer",
                Plan {
                    elements: 8,
                    ..plan(LENGTH)
                }
                .shoot(),
            ),
            (
                "with statoliths",
                Plan::steered(steering(Statoliths {
                    avalanche_time: 2.0 * MINUTE,
                })),
            ),
            (
                "with other memories",
                Plan::steered(memories(12.0 * MINUTE, 15.0 * MINUTE)),
            ),
            (
                "forced",
                Plan {
                    place: Place {
                        tilt: 0.0,
                        rate: 1e-3,
                    },
                    ..plan(LENGTH)
                }
                .shoot(),
            ),
        ];
        for (what, other) in &others {
            assert!(circle.roots(other, 2).is_err(), "{what}");
            assert!(plane.multipliers(other, 2).is_err(), "{what}");
            assert!(plane.largest_excursion(other).is_err(), "{what}");
            assert!(plane.shapes(other).is_err(), "{what}");
        }
        for period in [0.0, f64::NAN, -1.0, 1e-300, 1.0, 1e9] {
            let mut changed = plane.clone();
            changed.period = period;
            assert!(changed.multipliers(shoot, 2).is_err(), "{period}");
        }
        // The opposite rate is accepted, because a planar shape can rotate in either sense.
        for rate in [0.0, f64::NAN, 2.0 * circle.rate] {
            let mut changed = circle.clone();
            changed.rate = rate;
            assert!(changed.roots(shoot, 2).is_err(), "{rate}");
        }
    });
}

/// REGR that decreases linearly to zero at the base. No Gauss point lies at the base, hence the
/// REGR is positive at all Gauss points.
#[test]
fn circle_with_growth_that_vanishes_at_the_base_has_the_exact_period() {
    let growth = || Growth {
        linear: true,
        time: 14.0 * HOUR,
        ..plan(LENGTH).growth
    };
    let (circle, plane) = both_from(
        "linear",
        move || {
            Plan {
                growth: growth(),
                ..plan(LENGTH)
            }
            .shoot()
        },
        super::mode,
    );
    // With equal memories the period does not depend on the distribution of growth.
    assert_abs_diff_eq!(
        circle.unwrap().period() / MINUTE,
        std::f64::consts::TAU / rate() / MINUTE,
        epsilon = 1e-7
    );
    assert!(plane.is_ok(), "{plane:?}");
}
