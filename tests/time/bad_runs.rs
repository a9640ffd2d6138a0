//! Runs with invalid settings, or through invalid states, end in an error that names the cause and
//! leave the shoot unchanged. None panics, hangs or returns NaN.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use crate::fixtures::messages::names;
use crate::fixtures::shoots::{
    BETA, ETA, HOUR, RADIUS, WEIGHT, YOUNG, assert_sound, growing, reduced, remembering, righting,
    rod, steering,
};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use morphorod::equilibrium::{EquilibriumError, Unloaded};
use morphorod::growth::UniformGrowth;
use morphorod::integrator::{Adaptive, IntegrationError, Integrator, MethodOfSteps};
use morphorod::load::{ApicalForce, Weight};
use morphorod::tropism::{
    Declaration, Growing, Memory, Oscillator, Proprioception, Response, SettledStatoliths, Site,
    TropismLaw, Variable,
};
use morphorod::{ShootParameters, Still};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Asserts that the error contains the name of the parameter and its value.
fn assert_refused(
    answer: Result<morphorod::integrator::Statistics, IntegrationError>,
    words: &str,
    value: f64,
) {
    let error = answer.expect_err(words);
    let text = error.to_string();
    assert!(text.contains(words), "{text}");
    assert!(names(&text, value), "{text}");
    assert!(matches!(error, IntegrationError::Parameter(_)), "{error:?}");
    assert!(!error.is_recoverable());
}

#[test]
fn invalid_steps_end_times_and_tolerances_are_refused_by_name() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let _ = MethodOfSteps::new(90.0).advance(&mut shoot, 600.0).unwrap();
    let kept = shoot.state().clone();
    for step in [0.0, -0.0, -90.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        assert_refused(
            MethodOfSteps::new(step).advance(&mut shoot, 1200.0),
            "time step",
            step,
        );
    }
    for until in [599.9, 0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        assert_refused(
            MethodOfSteps::new(90.0).advance(&mut shoot, until),
            "time to advance to",
            until,
        );
    }
    for tolerance in [0.0, -1e-9, f64::INFINITY, f64::NAN] {
        let mut run = MethodOfSteps::new(90.0);
        run.tolerance = tolerance;
        assert_refused(run.advance(&mut shoot, 1200.0), "tolerance", tolerance);
        let mut run = MethodOfSteps::new(90.0);
        run.solver.tolerance = tolerance;
        let error = run.advance(&mut shoot, 1200.0).unwrap_err();
        assert!(
            error.to_string().contains("tolerance of the equilibrium"),
            "{error}"
        );
    }
    assert!(&kept == shoot.state());
}

#[test]
fn laws_that_depend_on_time_alone_permit_any_step_up_to_half_a_period() {
    let mut clock = righting()
        .tropism(Oscillator::new(0.2, 1440.0))
        .into_dyn()
        .build()
        .unwrap();
    let cost = MethodOfSteps::new(720.0).advance(&mut clock, HOUR).unwrap();
    assert_eq!(cost.equilibria, cost.steps + 1);
    assert_refused(
        MethodOfSteps::new(720.5).advance(&mut clock, 2.0 * HOUR),
        "shortest period of the laws",
        1440.0,
    );
}

#[test]
fn corrections_that_do_not_converge_are_a_recoverable_error() {
    let present = Memory {
        time: 720.0,
        delay: 0.0,
    };
    let laws = (Proprioception { sensitivity: ETA }.remembered(present),);
    let mut shoot = righting().tropism(laws).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.max_corrections = 1;
    let before = shoot.state().clone();
    let error = run.advance(&mut shoot, HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::NotConverged { .. }) && error.is_recoverable(),
        "{error}"
    );
    assert!(&before == shoot.state());
}

#[test]
fn given_history_with_nan_or_infinity_is_refused() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let before = shoot.state().clone();
    for value in [f64::NAN, f64::INFINITY] {
        let past = |t: f64, _: &Site, y: &mut [f64]| y.fill(if t < -100.0 { value } else { 0.0 });
        let error = MethodOfSteps::new(90.0)
            .start(&mut shoot, &past)
            .unwrap_err();
        assert!(error.to_string().contains("history"), "{error}");
        assert!(&before == shoot.state());
    }
}

#[test]
fn equilibrium_that_does_not_converge_is_an_error_with_its_residual() {
    // One element cannot represent the shape of a shoot a million times as dense as water. The
    // solver is limited to three iterations.
    let mut shoot = righting()
        .elements(1)
        .load(Weight { density: 1e9 })
        .into_dyn()
        .build()
        .unwrap();
    let before = shoot.state().clone();
    let mut run = MethodOfSteps::new(90.0);
    run.solver.max_iterations = 3;
    let error = run.advance(&mut shoot, HOUR).unwrap_err();
    let IntegrationError::Equilibrium {
        time,
        error: EquilibriumError::NoConvergence {
            residual, force, ..
        },
    } = error
    else {
        panic!("{error}")
    };
    // Total weight of the shoot, ρ g π r² ℓ, in newtons.
    let weight = 1e9 * 9.81 * std::f64::consts::PI * 25e-8 * 0.05;
    assert!(time == 0.0 && residual.is_finite(), "{time} {residual}");
    assert_relative_eq!(force, weight, epsilon = 0.0, max_relative = 0.1);
    assert!(&before == shoot.state());
}

#[test]
fn step_below_the_rounding_of_time_does_not_hang() {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut shoot = rod(YOUNG, 0.05).elements(1).into_dyn().build().unwrap();
        let mut run = MethodOfSteps::with_solver(HOUR, Unloaded);
        run.advance(&mut shoot, HOUR).unwrap();
        // An hour plus 1e-13 s rounds to an hour; 1e-11 s are 22 units in its last place.
        run.step = 1e-13;
        let _ = sender.send(
            run.advance(&mut shoot, HOUR + 1e-11)
                .map(|statistics| statistics.steps),
        );
    });
    let answer = receiver
        .recv_timeout(Duration::from_secs(5))
        .expect("the run hangs");
    assert!(answer.is_err() || answer.is_ok_and(|steps| steps <= 100));
}

/// Factor between 1e-12 and 1e12, as a wrong unit may introduce.
fn positive() -> impl Strategy<Value = f64> {
    (-12.0..12.0_f64).prop_map(|p| 10.0_f64.powf(p))
}

/// One factor for each parameter. Most factors are 1.
fn factors() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(
        prop_oneof![4 => Just(1.0), 1 => positive(), 1 => (-1.0..1.0_f64).prop_map(|p| 10.0_f64.powf(p))],
        12,
    )
}

/// Multiplies each parameter by its factor in `f`. Asserts that four runs of two steps each end in
/// a sound state, or in an error that leaves the shoot unchanged.
fn assert_error_or_sound(f: &[f64], tilt: f64) {
    let memory = Memory {
        time: 720.0 * f[5],
        delay: 720.0 * f[6],
    };
    // A zone much shorter than the shoot would require very many elements.
    let zone = 0.07 * f[2].max(f[0] / 20.0);
    let parameters = ShootParameters {
        length: 0.068 * f[0],
        radius: RADIUS * f[1],
        zone_length: zone,
        youngs_modulus: 1e7 * f[3],
        growth_time: 144e3 * f[4],
        oscillator_sensitivity: 0.2 * f[7],
        gravitropic_sensitivity: BETA * f[8],
        avalanche_time: 120.0 * f[9],
        proprioceptive_sensitivity: ETA * f[10],
        density: 1000.0 * f[11],
        ..remembering(memory, memory)
    };
    let built = parameters
        .reduced()
        .elements(4)
        .growth(parameters.growth())
        .tropism(parameters.tropism())
        .scene(Still::tilted(tilt))
        .into_dyn()
        .build();
    let Ok(mut shoot) = built else { return };
    let mut run = MethodOfSteps::new(90.0_f64.min(memory.delay));
    run.solver.max_iterations = 50;
    for _ in 0..4 {
        let before = shoot.state().clone();
        match run.advance(&mut shoot, before.time() + 2.0 * run.step) {
            // Runs with very many elements are skipped because they are slow.
            Ok(_) if shoot.rod().elements() > 300 => return,
            Ok(_) => assert_sound(&shoot),
            Err(_) => {
                assert!(&before == shoot.state(), "an error that changed the shoot");
                return;
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn parameters_of_any_size_end_in_an_error_or_a_sound_state(f in factors(), tilt in -3.2..3.2) {
        assert_error_or_sound(&f, tilt);
    }
}

#[test]
fn statoliths_too_fast_to_integrate_end_in_an_error_or_a_sound_state() {
    // Failures that the test above found in thirty thousand cases. The factors are those of length,
    // radius, zone, E, τg, τm, τr, α, β, τa, η, ρ.
    const CASES: [([f64; 12], f64); 4] = [
        // Avalanche time of 0.7 ns with steps of 90 s.
        (
            [
                4.327, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 6.0085e-12, 1.0, 1.0,
            ],
            2.9312,
        ),
        // Avalanche times of 17 s and 1 s in shoots that grow and move very fast.
        (
            [
                2.19, 1.0, 1.0, 0.34253, 0.0037213, 0.29317, 1.0, 1.0, 1.0, 0.13767, 1.0, 1.0,
            ],
            3.1248,
        ),
        (
            [
                1.0, 1.0, 7.3675e-7, 1.0, 0.0011395, 4.5013, 1.0, 1.0, 1.0, 0.0094158, 1.0, 0.16481,
            ],
            0.11319,
        ),
        // Short avalanche time and fast growth. The interval was halved without end.
        (
            [
                1.0,
                1.0,
                1.0,
                1.0,
                3.243867516078684e-5,
                1.0,
                1.0,
                1.0,
                579.2,
                1.2118742811624113e-11,
                0.0090924,
                1.0,
            ],
            -3.125542999163488,
        ),
    ];
    for (f, tilt) in CASES {
        let (sender, receiver) = mpsc::channel();
        let worker = std::thread::spawn(move || {
            assert_error_or_sound(&f, tilt);
            let _ = sender.send(());
        });
        match receiver.recv_timeout(Duration::from_secs(5)) {
            Ok(()) => (),
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("{f:?} hangs"),
            Err(_) => panic!(
                "{f:?}: {:?}",
                worker.join().map_err(|e| e.downcast::<String>())
            ),
        }
    }
}

#[test]
fn growth_far_faster_than_a_step_is_refused_at_once() {
    // The zone is renewed 700,000 times in a step, and each renewal creates four mature elements.
    let growth = UniformGrowth {
        zone_length: 0.07,
        time: 1.3e-4,
    };
    let mut shoot = rod(YOUNG, 0.068)
        .elements(4)
        .growth(growth)
        .into_dyn()
        .build()
        .unwrap();
    let before = shoot.state().clone();
    let error = MethodOfSteps::new(90.0).step(&mut shoot, HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::GrowsTooFast { step: 90.0, .. }),
        "{error}"
    );
    assert!(error.is_recoverable() && &before == shoot.state());
    // A short step creates only a few mature elements.
    let _ = MethodOfSteps::new(2e-4).advance(&mut shoot, 1e-3).unwrap();
    // The adaptive integrator chooses the step and fails when the allowed steps are used up.
    let mut run = Adaptive::new(1e-3);
    run.max_work = 3000;
    // A call permits 1000 growth zones, which take 0.13 s.
    let answer = run.advance(&mut shoot, 0.1);
    assert!(
        matches!(answer, Err(IntegrationError::ToleranceNotMet { .. })),
        "{answer:?}"
    );
}

#[test]
fn failed_run_continues_like_an_undisturbed_one_once_the_cause_is_removed() {
    let mut shoot = growing().elements(4).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(90.0);
    run.advance(&mut shoot, 1.1 * HOUR).unwrap();
    let mut other = shoot.clone();
    run.solver.max_iterations = 0;
    assert!(run.advance(&mut shoot, 2.0 * HOUR).is_err());
    run.solver.max_iterations = 200;
    run.advance(&mut shoot, 2.0 * HOUR).unwrap();
    let _ = MethodOfSteps::new(90.0)
        .advance(&mut other, 2.0 * HOUR)
        .unwrap();
    assert!(shoot.state() == other.state());
    // Length (m) of the reference in `growing_shoot` after two hours.
    assert_abs_diff_eq!(shoot.rod().length(), 0.071470872419, epsilon = 1e-12);
}

/// Number of evaluations of the load until `Adaptive` returns an error.
fn evaluations(youngs_modulus: f64, growth_time: f64) -> usize {
    let count = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let load = ApicalForce(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        Vector3::zeros()
    });
    let parameters = ShootParameters {
        length: 0.05,
        youngs_modulus,
        growth_time,
        ..ShootParameters::default()
    };
    let mut shoot = parameters
        .reduced()
        .tropism(steering(SettledStatoliths).1)
        .scene(Still::tilted(0.5))
        .load((WEIGHT, load))
        .into_dyn()
        .build()
        .unwrap();
    Adaptive::new(1e-4).advance(&mut shoot, 4000.0).unwrap_err();
    count.load(Ordering::Relaxed)
}

#[test]
fn shoots_with_absurd_constants_are_refused_soon() {
    for (youngs_modulus, growth_time) in [(1e-290, 72e3), (1e-5, 72e3), (1e7, 1e-300), (1e7, 1e-5)]
    {
        let evaluations = evaluations(youngs_modulus, growth_time);
        println!(
            "E = {youngs_modulus:e} Pa, τg = {growth_time:e} s: {evaluations} evaluations of the load"
        );
        // A run with realistic constants evaluates the load 20,000 times.
        assert!(
            evaluations < 100_000,
            "E = {youngs_modulus:e}, τg = {growth_time:e}: {evaluations}"
        );
    }
}

/// Law whose rate is a discontinuous function of its own variable. The implicit step has no
/// solution at the discontinuity.
#[derive(Debug)]
struct Relay {
    calls: Arc<AtomicUsize>,
}

impl TropismLaw for Relay {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(Variable::read_after(0.0));
    }

    fn sense(&self, _site: &Site, stimuli: &mut [f64]) {
        stimuli[0] = 1.0;
    }

    fn rates(&self, variables: &[f64], _stimuli: &[f64], rates: &mut [f64]) {
        self.calls.fetch_add(1, Ordering::Relaxed);
        rates[0] = if variables[0] < 1.0 { 1.0 } else { -1e3 };
    }

    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::y() * past[0]
    }
}

#[test]
fn failures_of_the_variables_do_not_refine_the_elements() {
    let calls = Arc::new(AtomicUsize::new(0));
    let mut shoot = reduced(0.05, 72e3)
        .tropism(Relay {
            calls: Arc::clone(&calls),
        })
        .load(())
        .into_dyn()
        .build()
        .unwrap();
    let mut integrator = Adaptive::new(1e-5);
    integrator.max_work = 6000;
    let error = integrator.advance(&mut shoot, HOUR).unwrap_err();
    assert!(
        matches!(error, IntegrationError::Variables { .. }),
        "{error}"
    );
    // One series of trials takes 12,510 evaluations. Each refinement of the elements would repeat
    // the series with more elements.
    let calls = calls.load(Ordering::Relaxed);
    assert!(calls < 25_000, "{calls}");
}
