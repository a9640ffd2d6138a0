//! Laws, loads and supports whose result would be meaningless, or that contradict themselves: each
//! is an error that names the law, the number, the unit and the remedy.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, YOUNG, righting, rod, tissue};
use crate::time::messages::{Outcome, assert_clear, assert_says, run};
use morphorod::constitutive::{Constitutive, ElasticResponse, Lignifying, LineResponse, Tissue};
use morphorod::equilibrium::{EquilibriumSolver, NewtonSolver};
use morphorod::growth::{GrowthLaw, UniformGrowth};
use morphorod::integrator::{Adaptive, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Cut, Load, Whirl};
use morphorod::rod::Rod;
use morphorod::support::{Hold, Support};
use morphorod::tropism::{Declaration, Growing, Oscillator, Proprioception, Response, TropismLaw};
use morphorod::{DynLaws, Environment, Model, Order, ParameterError, Shoot, ShootBuilder};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::wrong_methods::{GROWTH, plain};

/// Uniform growth that announces a discontinuity at a time after each one, s, beginning with the
/// start.
struct Announcing {
    interval: f64,
    until: f64,
}

impl GrowthLaw for Announcing {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        GROWTH.regr(sigma, t)
    }
    fn zone_length(&self) -> f64 {
        GROWTH.zone_length
    }
    fn next_discontinuity(&self, t: f64) -> f64 {
        let next = self.interval * ((t / self.interval + 1e-6).floor() + 1.0);
        if next < self.until {
            next
        } else {
            f64::INFINITY
        }
    }
}

#[test]
fn discontinuities_without_end_are_refused_before_the_first_step() {
    let build = |until: f64| {
        plain()
            .growth(Announcing {
                interval: 1e-6,
                until,
            })
            .into_dyn()
    };
    let name = "time between discontinuities that a law announces is 1e-6";
    assert_clear(vec![(name, run(build(f64::INFINITY), |_| ()))]);
    // A few of them are steps.
    run(build(5.5e-6), |_| ()).unwrap();
}

#[test]
fn steps_that_do_not_resolve_a_period_are_refused() {
    let oscillator = |period: f64| {
        (
            Oscillator::new(0.2, 1440.0),
            Some(Oscillator::new(0.1, period)),
        )
    };
    assert_clear(vec![
        (
            "shortest period of the laws is 239 but must be 240, or more, twice the time step",
            run(plain().tropism(oscillator(239.0)).into_dyn(), |_| ()),
        ),
        (
            "shortest period of the laws is 1440 but must be 7200, or more, twice the time step",
            run(plain().tropism(oscillator(1440.0)).into_dyn(), |run| {
                run.step = 1e6
            }),
        ),
    ]);
    run(plain().tropism(oscillator(240.0)).into_dyn(), |_| ()).unwrap();
    // An oscillator without effect has no period.
    run(
        plain().tropism(Oscillator::new(0.0, 1.0)).into_dyn(),
        |_| (),
    )
    .unwrap();
    // A load has a period while it acts, also as a part of a sum.
    let whirl = |force: f64, turns: f64| {
        (
            WEIGHT,
            Some(Whirl {
                force,
                period: 200.0,
                turns,
            }),
        )
    };
    let words = "shortest period of the laws is 200 but must be 240, or more, twice the time step";
    assert_clear(vec![(
        words,
        run(plain().load(whirl(1e-6, 40.0)).into_dyn(), |_| ()),
    )]);
    run(plain().load(whirl(0.0, 40.0)).into_dyn(), |_| ()).unwrap();
    let mut shoot = plain().load(whirl(1e-6, 0.5)).into_dyn().build().unwrap();
    MethodOfSteps::new(20.0).advance(&mut shoot, 100.0).unwrap();
    MethodOfSteps::new(120.0).advance(&mut shoot, HOUR).unwrap();
}

#[test]
fn adaptive_steps_resolve_the_period_of_a_load() {
    // The memories would choose steps of 720 s, at whose ends the force of this load is always
    // along e1.
    let load = Whirl {
        force: 1e-5,
        period: 60.0,
        turns: 100.0,
    };
    let laws = Proprioception { sensitivity: 20.0 }.remembered(MEMORY);
    let mut shoot = plain()
        .tropism(laws)
        .load((WEIGHT, load))
        .into_dyn()
        .build()
        .unwrap();
    let mut exact = shoot.clone();
    MethodOfSteps::new(6.0).advance(&mut exact, HOUR).unwrap();
    Adaptive::new(1e-4).advance(&mut shoot, HOUR).unwrap();
    let distance = (shoot.tip() - exact.tip()).norm() / 0.05;
    // The reference has ten steps in a turn, whose errors cancel over a turn.
    assert!(distance < 1e-4, "{distance}");
}

#[test]
fn growth_time_in_hours_ends_at_once() {
    // 20 instead of 72,000 s: 1800 growth zones in ten hours, which would take hours.
    let build = |time: f64| {
        plain()
            .growth(UniformGrowth { time, ..GROWTH })
            .into_dyn()
            .build()
            .unwrap()
    };
    let words = "from 0 s to 36000 s the shoot would grow by 1800 lengths of its growth zone";
    let (mut shoot, end) = (build(20.0), 10.0 * HOUR);
    let before = shoot.state().clone();
    let mut steps = MethodOfSteps::new(120.0);
    assert_says(steps.advance(&mut shoot, end), words);
    assert_says(
        steps.advance_showing(&mut shoot, end, [HOUR, end], |_| ()),
        words,
    );
    assert_says(Adaptive::new(1e-4).advance(&mut shoot, end), words);
    assert!(*shoot.state() == before);
    // A few steps, and a search that ends early, are permitted.
    steps.step(&mut shoot, end).unwrap();
    steps
        .advance_until(&mut shoot, end, |shoot| shoot.rod().length() - 0.06)
        .unwrap();
    // A year of growth may be one call: 438 growth zones.
    let mut year = MethodOfSteps {
        max_work: 50,
        ..MethodOfSteps::new(60.0)
    };
    let error = year
        .advance(&mut build(20.0 * HOUR), 365.0 * 24.0 * HOUR)
        .unwrap_err();
    assert!(
        matches!(error, IntegrationError::WorkLimit { .. }),
        "{error}"
    );
}

/// A load by its force on the part beyond a cut.
struct ByCut(fn(&Cut) -> Vector3<f64>);

impl Load for ByCut {
    fn force(&self, cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        (self.0)(cut)
    }
}

#[test]
fn quantities_that_are_not_finite_are_named() {
    let build = |load: fn(&Cut) -> Vector3<f64>| -> Outcome {
        plain().load(ByCut(load)).into_dyn().build()?;
        Ok(())
    };
    let solve = |load: &dyn Load, gravity: f64| -> Outcome {
        let mut rod = Rod::uniform(0.05, RADIUS, UnitQuaternion::identity(), 2, Order::Four)?;
        let environment = Environment {
            time: 0.0,
            gravity: Vector3::z() * gravity,
        };
        let _ = NewtonSolver::default().solve(&mut rod, &YOUNG, &load, &environment)?;
        Ok(())
    };
    assert_clear(vec![
        (
            "force of the load on the whole shoot is minus infinity",
            build(|cut| Vector3::new(0.0, 0.0, -1e-6 / cut.arc_length)),
        ),
        (
            "part beyond a place is not a number at 0.0",
            build(|cut| Vector3::z() * if cut.arc_length > 0.03 { f64::NAN } else { 0.0 }),
        ),
        ("the gravity is not finite", solve(&WEIGHT, f64::NAN)),
        ("the force of the load on the rod is not finite", {
            solve(&ApicalForce(|_: f64| Vector3::repeat(f64::NAN)), -9.81)
        }),
        (
            "stiffness K1 is 0 at ",
            run(rod(tissue(1e-300), 0.05).load(WEIGHT).into_dyn(), |_| ()),
        ),
    ]);
}

/// A tropism law by its gradient.
#[derive(Clone, Copy)]
struct ByGradient(fn(&Growing) -> Vector3<f64>);

impl TropismLaw for ByGradient {
    fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        (self.0)(at)
    }
}

/// Growth whose rate is not a number after a time (s).
struct Ending(f64);

impl GrowthLaw for Ending {
    fn regr(&self, sigma: f64, t: f64) -> f64 {
        if t < self.0 {
            GROWTH.regr(sigma, t)
        } else {
            f64::NAN
        }
    }
    fn zone_length(&self) -> f64 {
        GROWTH.zone_length
    }
    fn elongates(&self) -> bool {
        false
    }
}

#[test]
fn growth_gradient_that_is_not_finite_names_law_component_and_place() {
    let steering = Proprioception { sensitivity: 20.0 }.remembered(MEMORY);
    let undefined = |builder: ShootBuilder<DynLaws>| {
        let error = MethodOfSteps::new(120.0)
            .advance(&mut builder.build().unwrap(), HOUR)
            .unwrap_err();
        let IntegrationError::Undefined {
            what,
            law,
            arc_length,
            time,
        } = error
        else {
            panic!("{error}")
        };
        let message = format!("the {what} of `{law}` is not finite at ");
        assert!(
            error.to_string().starts_with(&message) || law.contains("dyn"),
            "{error}"
        );
        (what, law, arc_length, time)
    };
    // The gradient is infinite beyond 3 cm from the base after 1000 s.
    let late = |at: &Growing| {
        let undefined = at.time > 1000.0 && at.apex_distance < 0.02;
        Vector3::new(0.0, if undefined { f64::INFINITY } else { 0.0 }, 0.0)
    };
    let laws = (
        steering,
        ByGradient(|_| Vector3::zeros()),
        Some((Oscillator::new(0.1, 1440.0), ByGradient(late))),
    );
    let (what, law, arc_length, time) = undefined(plain().tropism(laws).into_dyn());
    assert!(
        what == "growth gradient along d2" && law.ends_with("wrong_laws::ByGradient"),
        "{what} {law}"
    );
    assert!(
        (0.029..0.053).contains(&arc_length) && (1000.0..1120.0).contains(&time),
        "{arc_length} {time}"
    );
    let (what, .., time) = undefined(plain().growth(Ending(1000.0)).tropism(steering).into_dyn());
    assert!(
        what == "REGR" && (1000.0..1120.0).contains(&time),
        "{what} {time}"
    );
}

#[test]
fn tissue_that_shrinks_is_refused() {
    struct Shrinking;
    impl GrowthLaw for Shrinking {
        fn regr(&self, _sigma: f64, _t: f64) -> f64 {
            -1.0 / 72e3
        }
        fn zone_length(&self) -> f64 {
            0.04
        }
    }
    let error = plain()
        .growth(Shrinking)
        .into_dyn()
        .build()
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("growth rate REGR at t = 0 is -1.388888889e-5 at 0.0"),
        "{error}"
    );
}

/// Builds a shoot with an elastic law.
fn with_law(
    law: impl Constitutive + Send + Sync + 'static,
) -> Result<Shoot<impl Model>, ParameterError> {
    rod(law, 0.05).into_dyn().build()
}

#[test]
fn modulus_of_mature_tissue_in_gigapascals_is_refused() {
    let law = |mature_modulus| Lignifying {
        young: YOUNG,
        mature_modulus,
        time: HOUR,
    };
    assert_says(
        with_law(law(2.0)),
        "mature tissue is 2 but must be at least that of young tissue (Pa)",
    );
    assert!(with_law(law(YOUNG.youngs_modulus)).is_ok());
}

/// Linear tissue with an energy offset (J/m), and with a response of the centre line near the base
/// only.
struct Careless {
    offset: f64,
    stretches: bool,
}

impl Constitutive for Careless {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let response = YOUNG.respond(tissue, strain);
        ElasticResponse {
            energy: response.energy + self.offset,
            ..response
        }
    }
    fn line_response(&self, tissue: &Tissue, _force: &Vector3<f64>) -> Option<LineResponse> {
        let strain = Vector3::z();
        let near = self.stretches && tissue.initial_apex_distance > 0.025;
        near.then(|| LineResponse {
            strain,
            energy: 0.0,
            compliance: Matrix3::zeros(),
        })
    }
}

#[test]
fn elastic_law_whose_energy_is_not_a_number_or_that_stretches_in_parts_is_refused() {
    let law = |offset, stretches| with_law(Careless { offset, stretches });
    assert!(law(0.0, false).is_ok() && law(1.0, false).is_ok());
    assert_says(
        law(f64::NAN, false),
        "elastic energy without elastic strain is not a number at ",
    );
    assert_says(
        law(0.0, true),
        "number of responses of the centre line to a force is 0 at ",
    );
}

/// A law that declares one more stimulus at every second call.
#[derive(Default)]
struct Changing(AtomicUsize);

impl TropismLaw for Changing {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1 + self.0.fetch_add(1, Ordering::SeqCst) % 2);
    }
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

#[test]
fn declaration_that_changes_is_refused() {
    assert_says(
        righting().tropism(Changing::default()).into_dyn().build(),
        "number of declarations of the tropism laws",
    );
}

/// A support that holds the apex and reports that it is absent.
struct Absent;

impl Support for Absent {
    fn is_absent(&self) -> bool {
        true
    }
    fn holds(&self, _time: f64) -> Vec<Hold> {
        vec![Hold::apex().at(Vector3::z() * 0.04)]
    }
}

#[test]
fn absent_support_with_a_hold_is_refused() {
    assert_says(
        righting().support(Absent).into_dyn().build(),
        "conditions of a support that `is_absent` is 1",
    );
    assert!(
        righting()
            .support((Vec::<Hold>::new(), ()))
            .into_dyn()
            .build()
            .is_ok()
    );
}

/// Growth by day and, wrongly, shrinkage by night.
struct Tides;

impl GrowthLaw for Tides {
    fn regr(&self, _sigma: f64, t: f64) -> f64 {
        (std::f64::consts::TAU * t / (24.0 * HOUR)).cos() / (20.0 * HOUR)
    }
    fn zone_length(&self) -> f64 {
        0.03
    }
}

#[test]
fn growth_that_becomes_negative_is_an_error() {
    let mut shoot = rod(YOUNG, 0.05).growth(Tides).into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(300.0);
    integrator.advance(&mut shoot, 6.0 * HOUR).unwrap();
    assert_says(
        integrator.advance(&mut shoot, 12.0 * HOUR),
        "mean growth rate of the zone is -",
    );
}

/// A law whose tissue leaves the zone regardless of the time from which it is followed.
struct Hasty;

impl GrowthLaw for Hasty {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        1.0 / (20.0 * HOUR)
    }
    fn zone_length(&self) -> f64 {
        0.03
    }
    fn exit_time(&self, sigma: f64, _from: f64, _until: f64) -> Option<f64> {
        Some(20.0 * HOUR * (0.03 / sigma).ln())
    }
}

#[test]
fn exit_times_that_contradict_the_rate_name_the_check() {
    let mut shoot = rod(YOUNG, 0.05).growth(Hasty).into_dyn().build().unwrap();
    assert_says(
        MethodOfSteps::new(300.0).advance(&mut shoot, HOUR),
        "`check::growth_law`",
    );
}

/// A law whose growth zone becomes longer with each call.
#[derive(Default)]
struct Spreading(AtomicUsize);

impl GrowthLaw for Spreading {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        1e-5
    }
    fn zone_length(&self) -> f64 {
        0.03 + 1e-6 * self.0.fetch_add(1, Ordering::SeqCst) as f64
    }
}

#[test]
fn growth_zone_that_changes_is_refused() {
    let mut shoot = rod(YOUNG, 0.05)
        .growth(Spreading::default())
        .into_dyn()
        .build()
        .unwrap();
    assert_says(
        MethodOfSteps::new(300.0).advance(&mut shoot, HOUR),
        "`zone_length`, which is constant (m)",
    );
}

/// A law with a shortest period (s).
struct Periodic(f64);

impl TropismLaw for Periodic {
    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::x()
    }
    fn shortest_period(&self) -> f64 {
        self.0
    }
}

impl Load for Periodic {
    fn force(&self, _cut: &Cut, _environment: &Environment) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn shortest_period(&self, _t: f64) -> f64 {
        self.0
    }
}

#[test]
fn periods_that_are_not_positive_are_refused() {
    for (period, words) in [
        (0.0, "is 0"),
        (-1.0, "is -1"),
        (f64::NAN, "is not a number"),
    ] {
        let words =
            format!("shortest period of the laws {words} but must be positive, and infinite");
        let sum = (Oscillator::new(0.1, 1440.0), Periodic(period));
        assert_clear(vec![
            (
                words.as_str(),
                run(plain().tropism(Periodic(period)).into_dyn(), |_| ()),
            ),
            (words.as_str(), run(plain().tropism(sum).into_dyn(), |_| ())),
        ]);
        let mut shoots = [
            plain().tropism(Periodic(period)).into_dyn(),
            plain().load(Periodic(period)).into_dyn(),
        ];
        for shoot in &mut shoots {
            let mut shoot = shoot.clone().build().unwrap();
            let error = Adaptive::new(1e-3)
                .advance(&mut shoot, HOUR)
                .unwrap_err()
                .to_string();
            assert!(error.contains(&words), "{error}");
        }
    }
}
