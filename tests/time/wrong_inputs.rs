//! Inputs whose result would be meaningless, or not end: each is an error that names the number, the unit and the
//! remedy.

use crate::fixtures::shoots::{HOUR, MEMORY, RADIUS, WEIGHT, YOUNG};
use crate::time::messages::{Outcome, Wrong, assert_clear, run};
use morphorod::constitutive::{Constitutive, ElasticResponse, LinearElastic, Tissue};
use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::growth::{GrowthLaw, UniformGrowth};
use morphorod::integrator::{ConstantHistory, IntegrationError, Integrator, MethodOfSteps, TimeStepper};
use morphorod::load::{ApicalForce, Cut, InternalForce, Load, Weight};
use morphorod::rod::Rod;
use morphorod::tropism::{Growing, Oscillator, Proprioception, Response, TropismLaw};
use morphorod::{DynLaws, Environment, Laws, Order, Shoot, ShootBuilder, Still};
use nalgebra::{UnitQuaternion, Vector3};

const GROWTH: UniformGrowth = UniformGrowth { zone_length: 0.04, time: 20.0 * HOUR };

/// The laws of [`plain`].
type Inclined = Laws<LinearElastic, UniformGrowth, (), Weight>;

/// A growing shoot of 5 cm on an inclined base.
fn plain() -> ShootBuilder<Inclined> {
    Shoot::builder(YOUNG).length(0.05).radius(RADIUS).growth(GROWTH).load(WEIGHT).scene(Still::tilted(0.5))
}

/// Uniform growth that announces a discontinuity at a time after each one, s, beginning with the start.
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
        if next < self.until { next } else { f64::INFINITY }
    }
}

#[test]
fn discontinuities_without_end_are_refused_before_the_first_step() {
    let build = |until: f64| plain().growth(Announcing { interval: 1e-6, until }).into_dyn();
    let name = "time between discontinuities that a law announces is 1e-6";
    assert_clear(vec![(name, run(build(f64::INFINITY), |_| ()))]);
    // A few of them are steps.
    run(build(5.5e-6), |_| ()).unwrap();
}

#[test]
fn steps_that_do_not_resolve_a_period_are_refused() {
    let oscillator = |period: f64| (Oscillator::new(0.2, 1440.0), Some(Oscillator::new(0.1, period)));
    assert_clear(vec![
        (
            "time step is 120 but must be at most half of the shortest period",
            run(plain().tropism(oscillator(239.0)).into_dyn(), |_| ()),
        ),
        (
            "time step is 3600 but must be at most half of the shortest period",
            run(plain().tropism(oscillator(1440.0)).into_dyn(), |run| run.step = 1e6),
        ),
    ]);
    run(plain().tropism(oscillator(240.0)).into_dyn(), |_| ()).unwrap();
    // An oscillator without effect has no period.
    run(plain().tropism(Oscillator::new(0.0, 1.0)).into_dyn(), |_| ()).unwrap();
}

#[test]
fn tolerances_below_rounding_or_without_a_correct_digit_are_refused() {
    for tolerance in [1e-300, 1e-17, 0.2, 1.0] {
        let words = "but must be from 2.3e-16, the rounding of a number, to 0.1 (rad)";
        assert_clear(vec![
            (words, run(plain().into_dyn(), |run| run.tolerance = tolerance)),
            (words, run(plain().into_dyn(), |run| run.solver.tolerance = tolerance)),
        ]);
    }
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
        let environment = Environment { time: 0.0, gravity: Vector3::z() * gravity };
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
        ("stiffness K1 is 0 at ", {
            let law = LinearElastic { youngs_modulus: 1e-300, ..YOUNG };
            run(Shoot::builder(law).length(0.05).radius(RADIUS).load(WEIGHT).into_dyn(), |_| ())
        }),
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
        if t < self.0 { GROWTH.regr(sigma, t) } else { f64::NAN }
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
        let error = MethodOfSteps::new(120.0).advance(&mut builder.build().unwrap(), HOUR).unwrap_err();
        let IntegrationError::Undefined { what, law, arc_length, time } = error else { panic!("{error}") };
        let message = format!("the {what} of `{law}` is not finite at ");
        assert!(error.to_string().starts_with(&message) || law.contains("dyn"), "{error}");
        (what, law, arc_length, time)
    };
    // The gradient is infinite beyond 3 cm from the base after 1000 s.
    let late = |at: &Growing| {
        let undefined = at.time > 1000.0 && at.apex_distance < 0.02;
        Vector3::new(0.0, if undefined { f64::INFINITY } else { 0.0 }, 0.0)
    };
    let laws = (steering, ByGradient(|_| Vector3::zeros()), Some((Oscillator::new(0.1, 1440.0), ByGradient(late))));
    let (what, law, arc_length, time) = undefined(plain().tropism(laws).into_dyn());
    assert!(what == "growth gradient along d2" && law.ends_with("wrong_inputs::ByGradient"), "{what} {law}");
    assert!((0.029..0.053).contains(&arc_length) && (1000.0..1120.0).contains(&time), "{arc_length} {time}");
    let (what, .., time) = undefined(plain().growth(Ending(1000.0)).tropism(steering).into_dyn());
    assert!(what == "REGR" && (1000.0..1120.0).contains(&time), "{what} {time}");
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
    let error = plain().growth(Shrinking).into_dyn().build().unwrap_err().to_string();
    assert!(error.starts_with("growth rate REGR at t = 0 is -1.388888889e-5 at 0.0"), "{error}");
}

#[test]
fn element_that_rotates_by_pi_names_its_intrinsic_strain_or_the_load() {
    let steep = ByGradient(|_| Vector3::x() * 1.2e6);
    let soft = LinearElastic { youngs_modulus: 10.0, ..YOUNG };
    let soft = Shoot::builder(soft).length(0.05).radius(RADIUS).load(WEIGHT).scene(Still::tilted(0.5));
    assert_clear(vec![
        ("its intrinsic strain alone rotates it by", run(plain().tropism(steep).into_dyn(), |_| ())),
        ("check the tropism laws, their sensitivities", run(plain().tropism(steep).into_dyn(), |_| ())),
        ("check the units of length, radius, stiffness and load", run(soft.into_dyn(), |_| ())),
    ]);
}

#[test]
fn numbers_of_things_are_given_with_the_needed_number() {
    let mut shoot = plain().into_dyn().build().unwrap();
    let (mut parts, mut solver) = (TimeStepper::default(), NewtonSolver::default());
    let mut step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
    let needed = step.points().len();
    let error = step.change_intrinsic(&[Vector3::zeros()]).unwrap_err().to_string();
    let expected =
        format!("number of changes of strain is 1 but must be {needed}, that of the points in the growth zone");
    assert_eq!(error, expected);
}

/// A tenth of an elastic law.
struct Tenth<'a, C>(&'a C);

impl<C: Constitutive> Constitutive for Tenth<'_, C> {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let ElasticResponse { energy, couple, tangent } = self.0.respond(tissue, strain);
        ElasticResponse { energy: 0.1 * energy, couple: 0.1 * couple, tangent: 0.1 * tangent }
    }
}

/// Newton's method for a tenth of the stiffness.
struct Soft;

impl EquilibriumSolver for Soft {
    fn equilibrate(
        &mut self,
        rod: &mut Rod,
        material: &impl Constitutive,
        force: &InternalForce,
    ) -> Result<Equilibrium, EquilibriumError> {
        NewtonSolver::default().equilibrate(rod, &Tenth(material), force)
    }
}

#[test]
fn first_shape_of_a_shoot_that_is_not_in_equilibrium_is_refused() {
    fn start(solver: impl EquilibriumSolver) -> Result<f64, IntegrationError> {
        let mut shoot = plain().into_dyn().build().unwrap();
        match MethodOfSteps::with_solver(120.0, solver).start(&mut shoot, &ConstantHistory::Empty) {
            Err(IntegrationError::Equilibrium { error: EquilibriumError::Unbalanced { rotation }, .. }) => Ok(rotation),
            Err(error) => Err(error),
            Ok(_) => Ok(0.0),
        }
    }
    // A solver that leaves the frames parallel to the base, and one that rotates the others by up to an angle (rad).
    let idle = Wrong(|rod: &mut Rod, _: &mut Equilibrium| {
        let frames = rod.node_frames();
        rod.set_shape(&vec![frames[0]; frames.len()], &[]).unwrap();
    });
    let rotated = |angle: f64| {
        Wrong(move |rod: &mut Rod, _: &mut Equilibrium| {
            let mut frames = rod.node_frames();
            let last = (frames.len() - 1) as f64;
            for (i, frame) in frames.iter_mut().enumerate() {
                *frame *= UnitQuaternion::from_scaled_axis(Vector3::x() * (angle * i as f64 / last));
            }
            rod.set_shape(&frames, &[]).unwrap();
        })
    };
    let turned = start(rotated(0.2)).unwrap();
    for rotation in [start(idle).unwrap(), start(Soft).unwrap(), turned] {
        assert!(rotation > 0.1, "{rotation}");
    }
    // Newton's method returns to its own shape.
    assert!((turned - 0.2).abs() < 1e-6, "{turned}");
    // An inaccurate solver is accepted, and so is a thread of 50 m whose weight is 1e9 times its stiffness over ℓ².
    assert_eq!(start(rotated(0.05)).unwrap(), 0.0);
    run(plain().length(50.0).into_dyn(), |run| run.step = 3600.0).unwrap();
}
