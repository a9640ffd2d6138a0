//! Shoots and meshes that a stability analysis must refuse: forced shoots, coarse meshes and
//! invalid delays.

use std::f64::consts::PI;
use std::sync::{Arc, Mutex};

use super::edges::analyse;
use crate::fixtures::shoots::{HOUR, WEIGHT, gravitropism, reduced, remembering, steering};
use approx::assert_abs_diff_eq;
use morphorod::growth::{GrowthLaw, Ongoing};
use morphorod::load::ApicalForce;
use morphorod::stability::{Linearisation, StabilityError, solve_steady_state};
use morphorod::tropism::{
    Declaration, Growing, Memory, SettledStatoliths, Site, TropismLaw, Variable,
};
use morphorod::{Scene, ShootParameters, Still};
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn gravity_and_loads_that_depend_on_time_are_refused_as_forced() {
    /// Gravity that rotates once per hour, as on a clinostat.
    struct Clinostat;
    impl Scene for Clinostat {
        fn gravity(&self, t: f64) -> Vector3<f64> {
            UnitQuaternion::from_scaled_axis(Vector3::x() * (2.0 * PI * t / 3600.0))
                * Vector3::new(0.0, 0.0, -9.81)
        }
        fn base(&self, _t: f64) -> UnitQuaternion<f64> {
            UnitQuaternion::identity()
        }
    }
    let laws = || steering(SettledStatoliths);
    let answer = analyse(laws(), WEIGHT, Clinostat, 20.0, 0.05, 3);
    assert!(
        matches!(answer, Err(StabilityError::NotAutonomous { .. })),
        "{answer:?}"
    );
    let pull = ApicalForce(|t: f64| Vector3::new(1e-7 * (2.0 * PI * t / 1440.0).sin(), 0.0, 0.0));
    let answer = analyse(laws(), (WEIGHT, pull), Still::upright(), 20.0, 0.05, 3);
    assert!(
        matches!(answer, Err(StabilityError::NotAutonomous { .. })),
        "{answer:?}"
    );
    // This force acts along the shoot and does not bend the upright shape.
    let pull = ApicalForce(|t: f64| Vector3::new(0.0, 0.0, 1e-7 * (2.0 * PI * t / 1440.0).sin()));
    let answer = analyse(laws(), (WEIGHT, pull), Still::upright(), 20.0, 0.05, 3);
    assert!(
        matches!(answer, Err(StabilityError::NotAutonomous { .. })),
        "{answer:?}"
    );
    // This force varies by 1e-11 of its magnitude.
    let pull = ApicalForce(|t: f64| {
        Vector3::new(
            0.0,
            0.0,
            1e-3 * (1.0 + 1e-11 * (2.0 * PI * t / 1440.0).sin()),
        )
    });
    let answer = analyse(laws(), ((), pull), Still::upright(), 20.0, 0.05, 3);
    assert!(
        matches!(answer, Err(StabilityError::NotAutonomous { .. })),
        "{answer:?}"
    );
    let steady = ApicalForce(|_| Vector3::new(0.0, 0.0, 1e-7));
    assert!(analyse(laws(), (WEIGHT, steady), Still::upright(), 20.0, 0.05, 3).is_ok());
}

#[test]
fn tilted_shoot_without_proprioception_has_no_steady_state() {
    let build = |tilt: f64| {
        reduced(0.05, 20.0 * HOUR)
            .tropism(gravitropism(SettledStatoliths))
            .load(())
            .scene(Still::tilted(tilt))
            .build()
            .unwrap()
    };
    let error = solve_steady_state(&mut build(1.0)).unwrap_err();
    assert_eq!(error, StabilityError::NoProprioception);
    solve_steady_state(&mut build(0.0)).unwrap();
}

/// Growth with a daily rhythm does not bend a straight upright shoot. The response of the shoot to
/// a disturbance differs from that at the mean growth rate.
#[test]
fn growth_rate_that_depends_on_time_is_refused_as_forced() {
    #[derive(Debug, Clone)]
    struct Days;
    impl GrowthLaw for Days {
        fn regr(&self, _sigma: f64, time: f64) -> f64 {
            (1.0 + 0.5 * (2.0 * PI * time / (24.0 * HOUR)).sin()) / (20.0 * HOUR)
        }
        fn zone_length(&self) -> f64 {
            0.1
        }
    }
    let shoot = reduced(0.05, 20.0 * HOUR)
        .growth(Ongoing(Days))
        .into_dyn()
        .build()
        .unwrap();
    let answer = Linearisation::about(&shoot).map(|_| ());
    assert!(
        matches!(answer, Err(StabilityError::NotAutonomous { .. })),
        "{answer:?}"
    );
}

#[test]
fn coarse_meshes_do_not_report_an_unstable_shoot_as_stable() {
    // β, η, τm and τr (s) of both laws, τg (h), length (m). An analysis on a finer mesh returns
    // dozens of unstable roots, or an error that the mesh is too coarse.
    let cases = [
        (
            2.280_986,
            1.754_145_65,
            [951.073, 1974.152],
            11_348.48 / HOUR,
            0.042_481_8,
        ),
        (2.0, 5.0, [720.0, 1440.0], 2.0, 0.07),
        (20.0, 15.0, [720.0, 720.0], 24.0, 0.075),
        (3.0, 0.0, [720.0, 720.0], 2.0, 0.075),
    ];
    for (beta, eta, [time, delay], hours, length) in cases {
        for elements in [1, 2, 3, 4] {
            let memory = Memory { time, delay };
            let parameters = ShootParameters {
                gravitropic_sensitivity: beta,
                proprioceptive_sensitivity: eta,
                ..remembering(memory, memory)
            };
            let laws = parameters.steering(SettledStatoliths);
            let answer = analyse(laws, WEIGHT, Still::upright(), hours, length, elements)
                .unwrap()
                .unstable();
            let noticed = matches!(
                answer,
                Err(StabilityError::UnderResolved { .. })
                    | Err(StabilityError::InfinitelyMany { .. })
            );
            assert!(noticed, "β {beta}, {elements} elements: {answer:?}");
        }
    }
}

#[test]
fn twisted_stationary_shoot_is_linearised_and_invalid_delays_are_refused() {
    /// Law with a stationary twist of 10/m. The test changes its delay (s) after the shoot has been
    /// built.
    struct Twist {
        delay: Arc<Mutex<f64>>,
    }
    impl TropismLaw for Twist {
        fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::z() * (-5.0 * past[0])
        }
        fn declare(&self, to: &mut Declaration) {
            to.stimuli(1);
            to.variable(Variable::read_after(*self.delay.lock().unwrap()));
        }
        fn sense(&self, site: &Site, stimuli: &mut [f64]) {
            stimuli[0] = site.strain.z - 10.0;
        }
        fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
            variables[0] = stimuli[0];
        }
        fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
            rates[0] = (x[0] - y[0]) / 720.0;
        }
    }
    let delay = Arc::new(Mutex::new(720.0));
    let shoot = || {
        reduced(0.05, 20.0 * HOUR)
            .tropism(Twist {
                delay: Arc::clone(&delay),
            })
            .load(())
            .into_dyn()
            .build()
    };
    let mut twisted = shoot().unwrap();
    solve_steady_state(&mut twisted).unwrap();
    assert_abs_diff_eq!(twisted.rod().strain(0, 0).unwrap().z, 10.0, epsilon = 1e-6);
    assert!(Linearisation::about(&twisted).is_ok());
    for invalid in [f64::NAN, -100.0] {
        *delay.lock().unwrap() = 720.0;
        let mut built_before = shoot().unwrap();
        solve_steady_state(&mut built_before).unwrap();
        // The delay becomes invalid after the shoot was built. No shoot can be built with an
        // invalid delay.
        *delay.lock().unwrap() = invalid;
        assert!(
            matches!(
                Linearisation::about(&built_before),
                Err(StabilityError::Parameter(_))
            ),
            "{invalid}"
        );
        assert!(shoot().is_err(), "{invalid}");
    }
}
