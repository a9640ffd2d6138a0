//! Shoots without periodic orbits. The solvers return an error that states the cause, in bounded
//! time.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::channel;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use crate::fixtures::shoots::{BETA, ETA, HOUR, MEMORY, MINUTE, RADIUS, WEIGHT, YOUNG, steering};
use morphorod::cycle::{
    CycleError, PeriodicOrbit, PeriodicSolver, RotatingWave, RotatingWaveSolver,
};
use morphorod::growth::GrowthLaw;
use morphorod::load::{ApicalForce, Distributed, Weight};
use morphorod::stability::{Root, StabilityError};
use morphorod::tropism::{
    Declaration, Gravitropism, Growing, Memory, Oscillator, Proprioception, Response,
    SettledStatoliths, Site, TropismLaw,
};
use morphorod::{DynLaws, Scene, Section, Shoot};
use nalgebra::{UnitQuaternion, Vector3};

/// Length of the shoot, m. The onset of oscillations is at 6.56 cm.
pub(super) const LENGTH: f64 = 0.067;

pub(super) struct Growth {
    pub(super) time: f64,
    pub(super) elongates: bool,
    /// Relative rate of increase of the REGR, 1/s.
    pub(super) rise: f64,
    /// Whether the REGR decreases linearly to zero at the base.
    pub(super) linear: bool,
}

impl GrowthLaw for Growth {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        let share = if self.linear {
            2.0 * (1.0 - sigma / LENGTH)
        } else {
            1.0
        };
        share * (1.0 + self.rise * t) / self.time
    }
    fn zone_length(&self) -> f64 {
        0.1
    }
    fn elongates(&self) -> bool {
        self.elongates
    }
}

/// Weight, a lateral load (N/m), and a force at the apex (N) that depends on time.
pub(super) type Pull = (Weight, Distributed, ApicalForce<fn(f64) -> Vector3<f64>>);

/// Base with an initial tilt (rad) and a constant rate of rotation (rad/s).
#[derive(Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) tilt: f64,
    pub(super) rate: f64,
}

impl Scene for Place {
    fn gravity(&self, _t: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, -9.81)
    }
    fn base(&self, t: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.tilt + self.rate * t)
    }
}

pub(super) struct Plan {
    pub(super) length: f64,
    pub(super) elements: u32,
    pub(super) growth: Growth,
    pub(super) tropism: Arc<dyn TropismLaw + Send + Sync>,
    pub(super) load: Pull,
    pub(super) place: Place,
    pub(super) section: Section,
}

/// Plain shoot of a given length (m). Its two elements suffice for tests of the kind of the result.
pub(super) fn plan(length: f64) -> Plan {
    Plan {
        length,
        elements: 2,
        growth: Growth {
            time: 20.0 * HOUR,
            elongates: false,
            rise: 0.0,
            linear: false,
        },
        tropism: Arc::new(steering(SettledStatoliths)),
        load: (
            WEIGHT,
            Distributed(Vector3::zeros()),
            ApicalForce(|_| Vector3::zeros()),
        ),
        place: Place::default(),
        section: Section::circle(RADIUS),
    }
}

impl Plan {
    pub(super) fn steered(tropism: impl TropismLaw + Send + Sync + 'static) -> Shoot<DynLaws> {
        Self {
            tropism: Arc::new(tropism),
            ..plan(LENGTH)
        }
        .shoot()
    }

    pub(super) fn shoot(self) -> Shoot<DynLaws> {
        let n = self.elements;
        let nodes: Vec<f64> = (0..=n)
            .map(|i| self.length * f64::from(i) / f64::from(n))
            .collect();
        let section = self.section;
        Shoot::builder(YOUNG)
            .length(self.length)
            .nodes(&nodes)
            .section(move |_| section)
            .growth(self.growth)
            .tropism(self.tropism)
            .load(self.load)
            .scene(self.place)
            .into_dyn()
            .build()
            .unwrap()
    }
}

/// Leading mode of the plain shoot of 6.7 cm.
pub(super) static MODE: LazyLock<Root> = LazyLock::new(|| super::mode(&plan(LENGTH).shoot()));

pub(super) fn memories(time: f64, delay: f64) -> impl TropismLaw + Send + Sync {
    let memory = Memory { time, delay };
    (
        Gravitropism {
            sensitivity: BETA,
            perception: SettledStatoliths,
        }
        .remembered(memory),
        Proprioception { sensitivity: ETA }.remembered(memory),
    )
}

/// Returns the result of a closure. Panics if the closure panics or takes more than 60 s, which is
/// ten times the longest time measured on a busy core.
pub(super) fn within<T: Send + 'static>(
    what: &str,
    answer: impl FnOnce() -> T + Send + 'static,
) -> T {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let _ = sender.send(catch_unwind(AssertUnwindSafe(answer)).ok());
    });
    let answer = receiver.recv_timeout(Duration::from_secs(60));
    answer
        .unwrap_or_else(|_| panic!("{what}: no answer"))
        .unwrap_or_else(|| panic!("{what}: a panic"))
}

pub(super) type Answers = (
    Result<RotatingWave, CycleError>,
    Result<PeriodicOrbit, CycleError>,
);

/// Name of a shoot and a function that builds it.
type Case = (&'static str, fn() -> Shoot<DynLaws>);

/// Results of both solvers for a shoot, with the mode of the plain shoot as initial guess. Checks
/// that the numbers of an orbit are finite. Roots and multipliers are either finite or an error.
pub(super) fn both(what: &str, shoot: impl FnOnce() -> Shoot<DynLaws> + Send + 'static) -> Answers {
    both_from(what, shoot, |_| MODE.clone())
}

/// Results of both solvers, as for `both`, with another mode as initial guess.
pub(super) fn both_from(
    what: &str,
    shoot: impl FnOnce() -> Shoot<DynLaws> + Send + 'static,
    mode: fn(&Shoot<DynLaws>) -> Root,
) -> Answers {
    within(what, move || {
        let shoot = shoot();
        let root = mode(&shoot);
        let circle = RotatingWaveSolver::default().from_mode(&shoot, &root, 0.02);
        if let Ok(orbit) = &circle {
            assert!(
                [orbit.rate, orbit.radius(), orbit.height()]
                    .iter()
                    .all(|x| x.is_finite()),
                "{orbit:?}"
            );
            if let Ok(roots) = orbit.roots(&shoot, 2) {
                assert!(
                    roots
                        .roots
                        .iter()
                        .all(|root| root.value.norm().is_finite() && root.residual.is_finite())
                );
            }
        }
        let plane = PeriodicSolver::default().from_mode(&shoot, &root, 0.02);
        if let Ok(orbit) = &plane {
            assert!(
                orbit.period.is_finite() && orbit.largest_excursion(&shoot).unwrap().0.is_finite()
            );
            if let Ok(found) = orbit.multipliers(&shoot, 2) {
                assert!(
                    found
                        .values
                        .iter()
                        .all(|one| one.value.norm().is_finite() && one.residual.is_finite())
                );
            }
        }
        (circle, plane)
    })
}

fn is_none_near(error: &CycleError) -> bool {
    matches!(
        error,
        CycleError::Stationary { .. } | CycleError::NotConverged { .. }
    )
}

fn is_forced(error: &CycleError) -> bool {
    matches!(error, CycleError::Stability(StabilityError::NotAutonomous { change }) if *change > 0.0)
}

/// Name of the rejected parameter. Panics for any other result.
pub(super) fn refused<T: std::fmt::Debug>(answer: Result<T, CycleError>) -> &'static str {
    match answer {
        Err(CycleError::Parameter(error)) => error.name,
        other => panic!("{other:?}"),
    }
}

/// Panics unless both solvers report that there is no orbit near the initial guess.
fn assert_none_found(what: &str, shoot: impl FnOnce() -> Shoot<DynLaws> + Send + 'static) {
    let (circle, plane) = both(what, shoot);
    let errors = [circle.unwrap_err(), plane.unwrap_err()];
    assert!(errors.iter().all(is_none_near), "{what}: {errors:?}");
}

#[test]
fn far_below_the_onset_no_orbit_is_found() {
    assert_none_found("3 cm", || plan(0.03).shoot());
    assert_none_found("6 cm", || plan(0.06).shoot());
}

#[test]
fn just_below_the_onset_no_orbit_is_found() {
    assert_none_found("6.55 cm", || plan(0.0655).shoot());
}

#[test]
fn without_proprioception_no_orbit_is_found() {
    assert_none_found("no proprioception", || {
        Plan::steered(
            Gravitropism {
                sensitivity: BETA,
                perception: SettledStatoliths,
            }
            .remembered(MEMORY),
        )
    });
}

#[test]
fn without_delay_no_orbit_is_found() {
    assert_none_found("no delay", || Plan::steered(memories(24.0 * MINUTE, 0.0)));
}

#[test]
fn with_a_short_delay_no_orbit_is_found() {
    assert_none_found("a short delay", || {
        Plan::steered(memories(12.0 * MINUTE, 1.0))
    });
}

/// Without tropism any strain is stationary. Two earlier errors are tested: a panic in the solver
/// for the variables when a shoot has none, and a stationary strain that was returned as an orbit.
#[test]
fn without_tropism_no_orbit_is_found() {
    let (circle, plane) = both("no tropism", || Plan::steered(()));
    assert!(
        matches!(circle, Err(CycleError::NotConverged { .. })),
        "{circle:?}"
    );
    assert!(
        matches!(plane, Err(CycleError::Stationary { .. })),
        "{plane:?}"
    );
}

#[test]
fn elongating_shoots_are_refused() {
    let growth = || Growth {
        elongates: true,
        ..plan(LENGTH).growth
    };
    let (circle, plane) = both("growth", move || {
        Plan {
            growth: growth(),
            ..plan(LENGTH)
        }
        .shoot()
    });
    assert!(matches!(circle, Err(CycleError::Elongates)), "{circle:?}");
    assert!(matches!(plane, Err(CycleError::Elongates)), "{plane:?}");
}

/// Shoots with an oscillator, an oscillating gain, a rotating force, a clinostat or increasing
/// growth. Solvers for autonomous shoots reject them, because they depend explicitly on time.
#[test]
fn time_dependent_shoots_are_refused() {
    /// Law with a response to the strain whose gain oscillates in time. It has no effect on a
    /// straight shoot.
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
        ("an oscillator", || {
            Plan::steered((
                Oscillator::new(0.2, 24.0 * MINUTE),
                steering(SettledStatoliths),
            ))
        }),
        ("an oscillating gain", || {
            Plan::steered((Moody, steering(SettledStatoliths)))
        }),
        ("a force", || {
            let force = ApicalForce(
                (|t| Vector3::new((t / 800.0).cos(), (t / 800.0).sin(), 0.0) * 1e-6)
                    as fn(f64) -> _,
            );
            Plan {
                load: (WEIGHT, Distributed(Vector3::zeros()), force),
                ..plan(LENGTH)
            }
            .shoot()
        }),
        ("a clinostat", || {
            Plan {
                place: Place {
                    tilt: 0.0,
                    rate: 1e-3,
                },
                ..plan(LENGTH)
            }
            .shoot()
        }),
        ("growth", || {
            Plan {
                growth: Growth {
                    rise: 1e-6,
                    ..plan(LENGTH).growth
                },
                ..plan(LENGTH)
            }
            .shoot()
        }),
    ];
    for (what, shoot) in cases {
        let (circle, plane) = both(what, shoot);
        let errors = [circle.unwrap_err(), plane.unwrap_err()];
        assert!(errors.iter().all(is_forced), "{what}: {errors:?}");
        assert!(
            errors[0].to_string().contains("not autonomous"),
            "{}",
            errors[0]
        );
    }
}

fn assert_no_axis(what: &str, shoot: impl FnOnce() -> Shoot<DynLaws> + Send + 'static) {
    let (circle, _) = both(what, shoot);
    assert!(
        matches!(circle, Err(CycleError::NotInvariant { change, .. }) if change > 1e-8),
        "{what}: {circle:?}"
    );
}

#[test]
fn circles_of_tilted_shoots_are_refused() {
    assert_no_axis("a tilt", || {
        Plan {
            place: Place {
                tilt: 0.3,
                rate: 0.0,
            },
            ..plan(LENGTH)
        }
        .shoot()
    });
}

#[test]
fn circles_of_shoots_with_elliptic_sections_are_refused() {
    assert_no_axis("an ellipse", || {
        Plan {
            section: Section::ellipse(5.0e-4, 5.2e-4),
            ..plan(LENGTH)
        }
        .shoot()
    });
}

#[test]
fn circles_of_laterally_loaded_shoots_are_refused() {
    assert_no_axis("a lateral load", || {
        let aside = Distributed(Vector3::new(1e-5, 0.0, 0.0));
        Plan {
            load: (WEIGHT, aside, plan(LENGTH).load.2),
            ..plan(LENGTH)
        }
        .shoot()
    });
}

/// Law with a constant gradient.
struct Constant(Vector3<f64>);

impl TropismLaw for Constant {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        self.0
    }
}

#[test]
fn laws_with_non_finite_gradients_are_refused() {
    for odd in [
        Vector3::repeat(f64::NAN),
        Vector3::new(0.0, 0.0, f64::NAN),
        Vector3::new(f64::INFINITY, 0.0, 0.0),
    ] {
        let (circle, plane) = both("not a number", move || {
            Plan::steered((steering(SettledStatoliths), Constant(odd)))
        });
        for error in [circle.unwrap_err(), plane.unwrap_err()] {
            let what = matches!(
                error,
                CycleError::Stability(StabilityError::NotFinite { .. })
            );
            assert!(what, "{odd:?}: {error:?}");
        }
    }
}

/// Laws whose gradient has a twist component are rejected, because the twist is not an unknown of
/// either solver. An earlier version ignored this component.
#[test]
fn laws_with_a_gradient_of_twist_are_refused() {
    let twist = || {
        Plan::steered((
            steering(SettledStatoliths),
            Constant(Vector3::new(0.0, 0.0, 1.0)),
        ))
    };
    let (circle, plane) = both("twist", twist);
    assert!(
        matches!(circle, Err(CycleError::Twists { .. })),
        "{circle:?}"
    );
    assert!(
        matches!(plane, Err(CycleError::Twists { twist }) if twist == 1.0),
        "{plane:?}"
    );
}
