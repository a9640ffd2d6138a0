//! Settings and methods whose result would be meaningless, or not end: each is an error that names
//! the number, the unit and the remedy.

use crate::fixtures::shoots::{HOUR, WEIGHT, YOUNG, growing, righting, rod, tissue};
use crate::time::messages::{Wrong, assert_clear, assert_says, run};
use morphorod::constitutive::{Constitutive, ElasticResponse, LinearElastic, Tissue};
use morphorod::equilibrium::{Equilibrium, EquilibriumError, EquilibriumSolver, NewtonSolver};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{
    ConstantHistory, HistoryFunction, IntegrationError, Integrator, MethodOfSteps, Statistics,
    TimeStepper,
};
use morphorod::load::{InternalForce, Weight};
use morphorod::rod::Rod;
use morphorod::tropism::{Growing, TropismLaw};
use morphorod::{Laws, Model, Shoot, ShootBuilder, Still};
use nalgebra::{UnitQuaternion, Vector3};

pub(super) const GROWTH: UniformGrowth = UniformGrowth {
    zone_length: 0.04,
    time: 20.0 * HOUR,
};

/// The laws of [`plain`].
pub(super) type Inclined = Laws<LinearElastic, UniformGrowth, (), Weight>;

/// A growing shoot of 5 cm on an inclined base.
pub(super) fn plain() -> ShootBuilder<Inclined> {
    rod(YOUNG, 0.05)
        .growth(GROWTH)
        .load(WEIGHT)
        .scene(Still::tilted(0.5))
}

#[test]
fn tolerances_below_rounding_or_without_a_correct_digit_are_refused() {
    for tolerance in [1e-300, 1e-17, 0.2, 1.0] {
        let words = "but must be from 2.3e-16, the rounding of a number, to 0.1 (rad)";
        assert_clear(vec![
            (
                words,
                run(plain().into_dyn(), |run| run.tolerance = tolerance),
            ),
            (
                words,
                run(plain().into_dyn(), |run| run.solver.tolerance = tolerance),
            ),
        ]);
    }
}

#[test]
fn merge_tolerance_in_degrees_is_refused() {
    for degrees in [0.2, 5.0] {
        let answer = growing().merge_tolerance(degrees).into_dyn().build();
        assert_says(
            answer,
            &format!("merge tolerance is {degrees} but must be from 0 to 0.1 (rad)"),
        );
    }
}

#[test]
fn element_that_rotates_by_pi_names_its_intrinsic_strain_or_the_load() {
    /// A gradient of 1.2e6 1/m.
    #[derive(Clone, Copy)]
    struct Steep;
    impl TropismLaw for Steep {
        fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
            Vector3::x() * 1.2e6
        }
    }

    let soft = rod(tissue(10.0), 0.05)
        .load(WEIGHT)
        .scene(Still::tilted(0.5));
    assert_clear(vec![
        (
            "its intrinsic strain alone rotates it by",
            run(plain().tropism(Steep).into_dyn(), |_| ()),
        ),
        (
            "check the tropism laws, their sensitivities",
            run(plain().tropism(Steep).into_dyn(), |_| ()),
        ),
        (
            "check the units of length, radius, stiffness and load",
            run(soft.into_dyn(), |_| ()),
        ),
    ]);
}

#[test]
fn strain_in_1_per_mm_is_named() {
    // It folds the elements, and on fine elements the rod is not slender.
    let bent = |elements: usize, curvature: f64| {
        let mut shoot = righting().elements(elements).into_dyn().build().unwrap();
        shoot.set_intrinsic(|_| Vector3::y() * curvature);
        MethodOfSteps::new(60.0)
            .advance(&mut shoot, HOUR)
            .unwrap_err()
    };
    let folded = bent(8, 2e4);
    assert!(
        matches!(
            folded,
            IntegrationError::Equilibrium {
                error: EquilibriumError::Folded { .. },
                ..
            }
        ),
        "{folded}"
    );
    assert!(
        folded.to_string().contains("a strain that was set (1/m)"),
        "{folded}"
    );
    let thick = bent(64, 2500.0);
    assert!(
        matches!(thick, IntegrationError::NotSlender { .. }),
        "{thick}"
    );
    assert!(
        thick
            .to_string()
            .contains("strains and histories that were set"),
        "{thick}"
    );
}

#[test]
fn numbers_of_things_are_given_with_the_needed_number() {
    let mut shoot = plain().into_dyn().build().unwrap();
    let (mut parts, mut solver) = (TimeStepper::default(), NewtonSolver::default());
    let mut step = parts.begin(&mut shoot, &mut solver, 60.0).unwrap();
    let needed = step.points().len();
    let error = step
        .change_intrinsic(&[Vector3::zeros()])
        .unwrap_err()
        .to_string();
    let expected = format!(
        "number of changes of strain is 1 but must be {needed}, that of the points in the growth zone"
    );
    assert_eq!(error, expected);
}

/// An integrator whose calls end at a wrong time: that which it computes from the present time and
/// the requested one.
struct Elsewhere<F>(F, MethodOfSteps);

impl<F: Fn(f64, f64) -> f64> Integrator for Elsewhere<F> {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        self.1.start(shoot, history)
    }
    fn advance_at_most(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        until: f64,
        max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        let until = (self.0)(shoot.time(), until);
        self.1.advance_at_most(shoot, until, max_steps)
    }
}

#[test]
fn integrator_that_makes_no_step_ends() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let mut idle = Elsewhere(|now, _| now, MethodOfSteps::new(HOUR));
    let words = "length of a step of the integrator is 0 but must be positive";
    assert_says(idle.advance_until(&mut shoot, HOUR, |_| -1.0), words);
    assert_says(
        idle.advance_showing(&mut shoot, HOUR, [600.0], |_| ()),
        words,
    );
}

#[test]
fn integrator_that_does_not_reach_a_requested_time_or_passes_it_is_refused() {
    fn check(wrong: impl Fn(f64, f64) -> f64 + Copy) {
        let words = "time that the integrator reached is ";
        let mut run = Elsewhere(wrong, MethodOfSteps::new(HOUR));
        let shoot = || righting().into_dyn().build().unwrap();
        assert_says(
            run.advance_showing(&mut shoot(), HOUR, [600.0], |_| ()),
            words,
        );
        assert_says(run.advance_showing(&mut shoot(), HOUR, [], |_| ()), words);
        assert_says(
            run.advance_until(&mut shoot(), HOUR, |shoot| shoot.time() - 600.0),
            words,
        );
    }
    check(|now, until| now + (until - now) / 3.0);
    check(|now, until| if until > now { until + 1.0 } else { until });
}

#[test]
fn counts_of_any_size_are_added() {
    let mut counts = Statistics::default();
    (counts.steps, counts.evaluations, counts.factorisations) = (usize::MAX, usize::MAX, 1);
    counts += counts;
    assert_eq!((counts.steps, counts.work()), (usize::MAX, usize::MAX));
    let boastful = Wrong(|_: &mut Rod, found: &mut Equilibrium| found.iterations = usize::MAX);
    let mut shoot = plain().into_dyn().build().unwrap();
    let counts = MethodOfSteps::with_solver(120.0, boastful)
        .advance(&mut shoot, 600.0)
        .unwrap();
    assert!(counts.steps > 1 && counts.iterations == usize::MAX);
}

/// A tenth of an elastic law.
struct Tenth<'a, C>(&'a C);

impl<C: Constitutive> Constitutive for Tenth<'_, C> {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let ElasticResponse {
            energy,
            couple,
            tangent,
        } = self.0.respond(tissue, strain);
        ElasticResponse {
            energy: 0.1 * energy,
            couple: 0.1 * couple,
            tangent: 0.1 * tangent,
        }
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
            Err(IntegrationError::Equilibrium {
                error: EquilibriumError::Unbalanced { rotation, .. },
                ..
            }) => Ok(rotation),
            Err(error) => Err(error),
            Ok(_) => Ok(0.0),
        }
    }
    // A solver that leaves the frames parallel to the base, and one that rotates the others by up
    // to an angle (rad).
    let idle = Wrong(|rod: &mut Rod, _: &mut Equilibrium| {
        let frames = rod.node_frames();
        rod.set_shape(&vec![frames[0]; frames.len()], &[]).unwrap();
    });
    let rotated = |angle: f64| {
        Wrong(move |rod: &mut Rod, _: &mut Equilibrium| {
            let mut frames = rod.node_frames();
            let last = (frames.len() - 1) as f64;
            for (i, frame) in frames.iter_mut().enumerate() {
                *frame *=
                    UnitQuaternion::from_scaled_axis(Vector3::x() * (angle * i as f64 / last));
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
    // An inaccurate solver is accepted, and so is a thread of 50 m whose weight is 1e9 times its
    // stiffness over ℓ².
    assert_eq!(start(rotated(0.05)).unwrap(), 0.0);
    run(plain().length(50.0).into_dyn(), |run| run.step = 3600.0).unwrap();
}

#[test]
fn shape_that_leaves_equilibrium_later_is_refused_unless_its_error_is_reported() {
    // From the tenth call on the shape is that of a straight rod.
    let late = |reported: f64| {
        let mut calls = 0;
        Wrong(move |rod: &mut Rod, found: &mut Equilibrium| {
            calls += 1;
            if calls >= 10 {
                let frames = rod.node_frames();
                rod.set_shape(&vec![frames[0]; frames.len()], &[]).unwrap();
                found.error = reported;
            }
        })
    };
    let advance = |reported: f64| {
        let mut shoot = plain().into_dyn().build().unwrap();
        let before = shoot.state().clone();
        let result = MethodOfSteps::with_solver(120.0, late(reported)).advance(&mut shoot, HOUR);
        assert_eq!(result.is_err(), *shoot.state() == before);
        result
    };
    let error = advance(1e-9).unwrap_err();
    let IntegrationError::Equilibrium {
        time,
        error: EquilibriumError::Unbalanced { rotation, reported },
    } = error
    else {
        panic!("{error}")
    };
    assert!(time > 0.0 && rotation > 0.1 && reported == 1e-9, "{error}");
    assert_says(advance(1e-9), "and the solver reports an error of 1e-9 rad");
    advance(1.0).unwrap();
}
