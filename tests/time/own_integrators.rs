//! Integrators outside the crate: the parts of a time step, and the integrators of the example
//! `own_integrator`.

#[path = "../../examples/own_integrator/heun.rs"]
mod heun;
#[path = "../../examples/own_integrator/kinematic.rs"]
mod kinematic;

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::fixtures::shoots::{
    HOUR, RADIUS, STATOLITHS, WEIGHT, YOUNG, elongating, growing, order, remembering, righting,
    rod, steering,
};
use approx::assert_abs_diff_eq;
use heun::Heun;
use kinematic::Kinematic;
use morphorod::equilibrium::NewtonSolver;
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{
    ConstantHistory, IntegrationError, Integrator, MethodOfSteps, Statistics, TimeStep, TimeStepper,
};
use morphorod::load::{Cut, Load};
use morphorod::support::Hold;
use morphorod::tropism::{Memory, Oscillator, SettledStatoliths};
use morphorod::{DynLaws, Environment, Model, Order, ParameterError, Shoot, Still};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

fn tight() -> NewtonSolver {
    NewtonSolver::with_tolerance(1e-11)
}

/// A growing shoot that rights itself, whose tissue leaves the growth zone.
fn leaving() -> Shoot<DynLaws> {
    let builder = elongating(0.05, 0.04, 20.0 * HOUR).elements(4);
    let builder = builder
        .tropism(steering(STATOLITHS))
        .scene(Still::tilted(FRAC_PI_2));
    builder.into_dyn().build().unwrap()
}

/// A lateral force of 20 µN on the apex from 1000 s to 4000 s.
struct Switched;

impl Load for Switched {
    fn force(&self, _cut: &Cut, environment: &Environment) -> Vector3<f64> {
        if (1000.0..4000.0).contains(&environment.time) {
            Vector3::y() * 2e-5
        } else {
            Vector3::zeros()
        }
    }

    fn next_discontinuity(&self, t: f64) -> f64 {
        [1000.0, 4000.0]
            .into_iter()
            .find(|time| *time > t)
            .unwrap_or(f64::INFINITY)
    }
}

/// A shoot of constant length with discontinuities of the load.
fn pushed() -> Shoot<DynLaws> {
    righting()
        .elements(4)
        .load((WEIGHT, Switched))
        .into_dyn()
        .build()
        .unwrap()
}

#[test]
fn heuns_method_of_the_example_has_second_order() {
    for (name, shoot, steps) in [
        (
            "leaving",
            leaving as fn() -> Shoot<DynLaws>,
            [120.0, 60.0, 30.0, 15.0],
        ),
        ("pushed", pushed, [240.0, 120.0, 60.0, 30.0]),
    ] {
        let mut exact = shoot();
        MethodOfSteps::new(15.0)
            .advance(&mut exact, 2.0 * HOUR)
            .unwrap();
        let errors = steps.map(|step| {
            let mut shoot = shoot();
            Heun::new(step, tight())
                .advance(&mut shoot, 2.0 * HOUR)
                .unwrap();
            (shoot.tip() - exact.tip()).norm()
        });
        let slope = order(&errors);
        println!("{name}: {slope:.2} {errors:?}");
        // Three halvings of usual steps do not reach the limit to all digits.
        assert!((1.8..2.6).contains(&slope), "{name}: {slope} {errors:?}");
    }
}

#[test]
fn kinematics_of_a_weightless_shoot_converge_to_the_closed_form_at_second_order() {
    // While the whole shoot grows, u1* = A sin ωt and u2* = A (1 − cos ωt) with A = α/(r τg ω).
    let (length, time, law) = (0.03, 20.0 * HOUR, Oscillator::new(0.2, 1440.0));
    let (rate, end) = (TAU / law.period, 900.0);
    let (sin, cos) = (rate * end).sin_cos();
    let strain = Vector3::new(sin, 1.0 - cos, 0.0) * (law.sensitivity / (RADIUS * time * rate));
    let exact = UnitQuaternion::from_scaled_axis(strain * (length * (end / time).exp()));
    let errors = [60.0, 30.0, 15.0, 7.5].map(|step| {
        let growth = UniformGrowth {
            zone_length: 0.07,
            time,
        };
        let builder = rod(YOUNG, length).elements(8).order(Order::Two);
        let builder = builder
            .growth(growth)
            .tropism(law)
            .scene(Still::weightless());
        let mut shoot = builder.into_dyn().build().unwrap();
        let cost = Kinematic::new(step).advance(&mut shoot, end).unwrap();
        assert_eq!(
            (cost.steps, cost.factorisations, cost.evaluations),
            ((end / step) as usize, 0, 0)
        );
        shoot.rod().apex_frame().angle_to(&exact)
    });
    println!("kinematics: {:.3} {errors:?}", order(&errors));
    assert!((order(&errors) - 2.0).abs() < 0.02, "{errors:?}");
}

/// Makes a step of the crate's integrator by its parts: an implicit step is corrected until the
/// strain changes by less than the default tolerance.
fn make<M: Model>(mut step: TimeStep<M, NewtonSolver>) -> Result<Statistics, IntegrationError> {
    step.integrate_intrinsic()?;
    loop {
        let _ = step.equilibrate()?;
        step.sense()?;
        step.integrate_variables()?;
        if step.is_explicit() || step.integrate_intrinsic()? <= 1e-8 {
            return step.finish();
        }
    }
}

#[test]
fn parts_of_a_step_are_those_of_the_crates_integrator() {
    let memory = |delay: f64| Memory { time: 720.0, delay };
    let soon = remembering(memory(0.0), memory(60.0)).steering(SettledStatoliths);
    let spring = Hold::apex().spring(Vector3::new(0.01, 0.0, 0.06), Matrix3::identity() * 1e-3);
    for (name, builder) in [
        ("growing", growing().elements(4).into_dyn()),
        ("implicit", righting().elements(4).tropism(soon).into_dyn()),
        ("held", growing().elements(4).support(spring).into_dyn()),
    ] {
        let mut own = builder.build().unwrap();
        let (mut run, mut parts) = (MethodOfSteps::new(180.0), TimeStepper::default());
        let (mut exact, mut solver) = (own.clone(), NewtonSolver::with_tolerance(1e-8));
        run.start(&mut exact, &ConstantHistory::Empty).unwrap();
        parts
            .start(&mut own, &mut solver, &ConstantHistory::Empty)
            .unwrap();
        assert!(own.state() == exact.state(), "{name}");
        while exact.time() < 2.0 * HOUR {
            let cost = run.step(&mut exact, 2.0 * HOUR).unwrap();
            let step = parts.begin(&mut own, &mut solver, exact.time()).unwrap();
            assert_eq!(make(step).unwrap(), cost, "{name}");
            assert!(own.state() == exact.state(), "{name}, {} s", own.time());
        }
        // A disturbance between two steps is a discontinuity: both compute the shape after it.
        exact.set_intrinsic(|point| point.intrinsic * 1.1);
        own.set_intrinsic(|point| point.intrinsic * 1.1);
        let now = exact.time();
        let cost = run.advance(&mut exact, now).unwrap();
        assert_eq!(
            parts.prepare(&mut own, &mut solver, now).unwrap(),
            cost,
            "{name}"
        );
        assert!(
            own.state() == exact.state() && cost.equilibria == 1,
            "{name}"
        );
        assert_eq!(
            parts.prepare(&mut own, &mut solver, now).unwrap(),
            Statistics::default()
        );
        for time in [f64::NAN, f64::INFINITY, now - 1.0] {
            refused(
                parts.prepare(&mut own, &mut solver, time),
                "time to advance to",
            );
        }
    }
}

#[test]
fn steps_of_a_recorded_grid_cannot_be_made_by_their_parts() {
    let mut shoot = leaving();
    let (mut run, mut solver) = (MethodOfSteps::new(180.0), tight());
    run.record();
    run.advance(&mut shoot, 600.0).unwrap();
    let before = shoot.state().clone();
    refused(
        run.workspace
            .begin(&mut shoot, &mut solver, 700.0)
            .map(|_| ()),
        "grid",
    );
    assert!(*shoot.state() == before && run.take_grid().steps() > 0);
}

/// Asserts that a call returned the error of a parameter whose name contains some words.
fn refused<T>(answer: Result<T, IntegrationError>, words: &str) {
    match answer {
        Err(IntegrationError::Parameter(ParameterError { name, .. })) => {
            assert!(name.contains(words), "{name}")
        }
        Err(error) => panic!("{error}, not {words}"),
        Ok(_) => panic!("{words} was accepted"),
    }
}

#[test]
fn parts_in_another_order_are_refused_and_a_dropped_step_is_undone() {
    let mut shoot = leaving();
    let (mut parts, mut solver) = (TimeStepper::default(), tight());
    parts.prepare(&mut shoot, &mut solver, HOUR).unwrap();
    let before = shoot.state().clone();
    let missing = |answer: Result<(), IntegrationError>, name: &str| {
        let error = answer.unwrap_err();
        assert!(
            matches!(error, IntegrationError::Incomplete { time: 60.0, missing } if missing == name),
            "{error}"
        );
    };
    let mut step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
    missing(step.equilibrate().map(|_| ()), "intrinsic strain");
    missing(step.sense(), "equilibrium");
    step.integrate_intrinsic().unwrap();
    missing(step.integrate_variables(), "stimuli");
    let _ = step.equilibrate().unwrap();
    missing(step.set_variables(|_, _| ()), "stimuli");
    step.sense().unwrap();
    missing(step.finish().map(|_| ()), "variables of the laws");
    assert!(*shoot.state() == before);
    let step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
    assert!(step.shoot().time() == 60.0 && step.times() == [0.0, 60.0] && step.is_explicit());
    drop(step);
    assert!(*shoot.state() == before);
    // All parts in their order, some of them twice.
    let mut step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
    for _ in 0..2 {
        step.integrate_intrinsic().unwrap();
        let _ = step.equilibrate().unwrap();
        step.sense().unwrap();
        step.integrate_variables().unwrap();
    }
    step.finish().unwrap();
    shoot.restore(&shoot.state().clone()).unwrap();
    assert_eq!(shoot.time(), 60.0);
}

/// A part that fails has changed the state already.
#[test]
fn step_with_a_part_that_failed_ends_only_after_its_repetition() {
    let mut shoot = leaving();
    let (mut parts, mut solver) = (TimeStepper::default(), tight());
    parts.prepare(&mut shoot, &mut solver, HOUR).unwrap();
    let before = shoot.state().clone();
    for case in ["variables of the laws", "intrinsic strain", "none"] {
        let mut step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
        step.integrate_intrinsic().unwrap();
        let _ = step.equilibrate().unwrap();
        step.sense().unwrap();
        step.integrate_variables().unwrap();
        let changes = vec![Vector3::x() * 1e5; step.points().len()];
        match case {
            "intrinsic strain" => assert!(step.change_intrinsic(&changes).is_err()),
            _ => assert!(
                step.set_variables(|_, values| values.fill(f64::NAN))
                    .is_err()
            ),
        }
        if case == "none" {
            step.integrate_variables().unwrap();
            step.finish().unwrap();
            assert_eq!(shoot.time(), 60.0);
            continue;
        }
        let error = step.finish().unwrap_err();
        assert!(
            matches!(error, IntegrationError::Incomplete { missing, .. } if missing == case),
            "{case}: {error}"
        );
        assert!(*shoot.state() == before);
    }
}

#[test]
fn invalid_arguments_of_steps_are_refused_and_leave_the_shoot_unchanged() {
    let mut shoot = pushed();
    let (mut parts, mut solver) = (TimeStepper::default(), tight());
    parts.prepare(&mut shoot, &mut solver, HOUR).unwrap();
    let before = shoot.state().clone();
    for bad in [0.0, -60.0, f64::NAN, f64::INFINITY] {
        refused(
            parts.begin(&mut shoot, &mut solver, bad).map(|_| ()),
            "end of the step",
        );
        refused(parts.next_end(&shoot, 60.0, bad), "end of the steps");
    }
    for bad in [0.0, -60.0, f64::NAN, f64::INFINITY] {
        refused(parts.next_end(&shoot, bad, 60.0), "time step");
    }
    // The force begins at 1000 s.
    refused(
        parts.begin(&mut shoot, &mut solver, 1001.0).map(|_| ()),
        "end of the step",
    );
    assert_eq!(parts.next_end(&shoot, 5000.0, 9000.0).unwrap(), 1000.0);
    assert_eq!(parts.next_end(&shoot, 300.0, 9000.0).unwrap(), 300.0);
    assert_eq!(parts.next_end(&shoot, 300.0, 200.0).unwrap(), 200.0);
    assert!(*shoot.state() == before);
    let mut step = parts.begin(&mut shoot, &mut solver, 100.0).unwrap();
    let points = step.points();
    let number = points.len();
    refused(
        step.intrinsic_rate(points.end, 50.0),
        "index of a material point",
    );
    for bad in [-1.0, 101.0, f64::NAN] {
        refused(step.intrinsic_rate(points.start, bad), "time of a rate");
    }
    assert!(
        step.growth_interval(points.end).is_none() && step.growth_interval(usize::MAX).is_none()
    );
    refused(
        step.change_intrinsic(&vec![Vector3::zeros(); number + 1]),
        "number of changes",
    );
    let mut changes = vec![Vector3::zeros(); number];
    changes[1].y = f64::NAN;
    assert!(matches!(
        step.change_intrinsic(&changes),
        Err(IntegrationError::NotFinite {
            what: "change of the intrinsic strain",
            ..
        })
    ));
    changes[1].y = 1e4;
    assert!(matches!(
        step.change_intrinsic(&changes),
        Err(IntegrationError::NotSlender { .. })
    ));
    step.integrate_intrinsic().unwrap();
    let _ = step.equilibrate().unwrap();
    step.sense().unwrap();
    let first = points.start;
    let error = step
        .set_variables(|at, y| y[0] = if at.point == first + 2 { f64::NAN } else { 0.0 })
        .unwrap_err();
    assert!(
        matches!(error, IntegrationError::Variables { point, .. } if point == first + 2),
        "{error}"
    );
    drop(step);
    assert!(*shoot.state() == before);
    // An error in a later step of a call undoes the call.
    let failed = parts.undo_on_error(&mut shoot, |parts, shoot| {
        for end in [60.0, 120.0, 1200.0] {
            let mut step = parts.begin(shoot, &mut solver, end)?;
            step.integrate_intrinsic()?;
            let _ = step.equilibrate()?;
            step.sense()?;
            step.integrate_variables()?;
            step.finish()?;
        }
        Ok(())
    });
    refused(failed, "end of the step");
    assert!(*shoot.state() == before);
}

#[test]
fn step_that_growth_forbids_is_refused() {
    let mut shoot = leaving();
    let (mut parts, mut solver) = (TimeStepper::default(), tight());
    parts.prepare(&mut shoot, &mut solver, HOUR).unwrap();
    let before = shoot.state().clone();
    let end = 100.0 * HOUR;
    assert!(parts.next_end(&shoot, end, end).unwrap() < end);
    refused(
        parts.begin(&mut shoot, &mut solver, end).map(|_| ()),
        "end of the step",
    );
    assert!(*shoot.state() == before);
}

/// A step that is longer than the shortest delay needs corrections, which Heun's method of the
/// example lacks.
#[test]
fn methods_of_the_example_refuse_steps_longer_than_a_delay() {
    let mut shoot = righting().elements(4).into_dyn().build().unwrap();
    let before = shoot.state().clone();
    refused(
        Heun::new(1000.0, tight()).advance(&mut shoot, HOUR),
        "time step",
    );
    assert!(*shoot.state() == before);
}

#[test]
fn shape_at_a_discontinuity_is_that_after_it() {
    let (mut own, mut exact) = (pushed(), pushed());
    Heun::new(250.0, tight()).advance(&mut own, 1000.0).unwrap();
    MethodOfSteps::new(250.0)
        .advance(&mut exact, 1000.0)
        .unwrap();
    // Before the force the shoot is in its plane. The force moves the tip across it by about a
    // millimetre, in proportion to quantities that both methods compute to 1e-3.
    assert!((own.tip().y).abs() > 1e-3);
    assert_abs_diff_eq!(own.tip().y, exact.tip().y, epsilon = 1e-5);
}
