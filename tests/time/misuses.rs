//! Misuses of shoots and their laws: each is an error that names the cause, where the value enters.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::fixtures::shoots::{HOUR, RADIUS, YOUNG, growing, righting};
use morphorod::constitutive::{Constitutive, ElasticResponse, Lignifying, LineResponse, Tissue};
use morphorod::equilibrium::{EquilibriumError, NewtonSolver};
use morphorod::growth::GrowthLaw;
use morphorod::integrator::{HistoryFunction, IntegrationError, Integrator, MethodOfSteps, Statistics, TimeStepper};
use morphorod::support::{Hold, Support};
use morphorod::tropism::{Declaration, Growing, TropismLaw};
use morphorod::{Model, ParameterError, Shoot};
use nalgebra::{Matrix3, Vector3};

/// Panics unless the text of an error contains the words.
fn assert_says<T>(answer: Result<T, impl std::fmt::Display>, words: &str) {
    let error = answer.err().expect("a misuse").to_string();
    assert!(error.contains(words), "“{error}” instead of “{words}”");
}

/// Builds a shoot with an elastic law.
fn with_law(law: impl Constitutive + Send + Sync + 'static) -> Result<Shoot<impl Model>, ParameterError> {
    Shoot::builder(law).length(0.05).radius(RADIUS).into_dyn().build()
}

#[test]
fn merge_tolerance_in_degrees_is_refused() {
    for degrees in [0.2, 5.0] {
        let answer = growing().merge_tolerance(degrees).into_dyn().build();
        assert_says(answer, &format!("merge tolerance is {degrees} but must be from 0 to 0.1 (rad)"));
    }
}

#[test]
fn modulus_of_mature_tissue_in_gigapascals_is_refused() {
    let law = |mature_modulus| Lignifying { young: YOUNG, mature_modulus, time: HOUR };
    assert_says(with_law(law(2.0)), "mature tissue is 2 but must be at least that of young tissue (Pa)");
    assert!(with_law(law(YOUNG.youngs_modulus)).is_ok());
}

/// Linear tissue with an energy offset (J/m), and with a response of the centre line near the base only.
struct Careless {
    offset: f64,
    stretches: bool,
}

impl Constitutive for Careless {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let response = YOUNG.respond(tissue, strain);
        ElasticResponse { energy: response.energy + self.offset, ..response }
    }
    fn line_response(&self, tissue: &Tissue, _force: &Vector3<f64>) -> Option<LineResponse> {
        let strain = Vector3::z();
        let near = self.stretches && tissue.initial_apex_distance > 0.025;
        near.then(|| LineResponse { strain, energy: 0.0, compliance: Matrix3::zeros() })
    }
}

#[test]
fn elastic_law_whose_energy_is_not_a_number_or_that_stretches_in_parts_is_refused() {
    let law = |offset, stretches| with_law(Careless { offset, stretches });
    assert!(law(0.0, false).is_ok() && law(1.0, false).is_ok());
    assert_says(law(f64::NAN, false), "elastic energy without elastic strain is not a number at ");
    assert_says(law(0.0, true), "number of responses of the centre line to a force is 0 at ");
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
    assert_says(righting().support(Absent).into_dyn().build(), "conditions of a support that `is_absent` is 1");
    assert!(righting().support((Vec::<Hold>::new(), ())).into_dyn().build().is_ok());
}

/// An integrator that makes no step.
struct Idle;

impl Integrator for Idle {
    fn start(
        &mut self,
        shoot: &mut Shoot<impl Model>,
        history: &impl HistoryFunction,
    ) -> Result<Statistics, IntegrationError> {
        TimeStepper::default().start(shoot, &mut NewtonSolver::default(), history)
    }
    fn advance_at_most(
        &mut self,
        _shoot: &mut Shoot<impl Model>,
        _until: f64,
        _max_steps: usize,
    ) -> Result<Statistics, IntegrationError> {
        Ok(Statistics::default())
    }
}

#[test]
fn integrator_that_makes_no_step_ends() {
    let mut shoot = righting().into_dyn().build().unwrap();
    let words = "length of a step of the integrator is 0 but must be positive";
    assert_says(Idle.advance_until(&mut shoot, HOUR, |_| -1.0), words);
    assert_says(Idle.advance_showing(&mut shoot, HOUR, [600.0], |_| ()), words);
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
    let mut shoot = Shoot::builder(YOUNG).length(0.05).radius(RADIUS).growth(Tides).into_dyn().build().unwrap();
    let mut integrator = MethodOfSteps::new(300.0);
    integrator.advance(&mut shoot, 6.0 * HOUR).unwrap();
    assert_says(integrator.advance(&mut shoot, 12.0 * HOUR), "mean growth rate of the zone is -");
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
fn messages_name_what_was_set_or_written() {
    let mut shoot = Shoot::builder(YOUNG).length(0.05).radius(RADIUS).growth(Hasty).into_dyn().build().unwrap();
    assert_says(MethodOfSteps::new(300.0).advance(&mut shoot, HOUR), "`check::growth_law`");
    // A curvature in 1/mm instead of 1/m folds the elements, and on fine elements the rod is not slender.
    let bent = |elements: usize, curvature: f64| {
        let mut shoot = righting().elements(elements).into_dyn().build().unwrap();
        shoot.set_intrinsic(|_| Vector3::y() * curvature);
        MethodOfSteps::new(60.0).advance(&mut shoot, HOUR).unwrap_err()
    };
    let folded = bent(8, 2e4);
    assert!(matches!(folded, IntegrationError::Equilibrium { error: EquilibriumError::Folded { .. }, .. }), "{folded}");
    assert!(folded.to_string().contains("a strain that was set (1/m)"), "{folded}");
    let thick = bent(64, 2500.0);
    assert!(matches!(thick, IntegrationError::NotSlender { .. }), "{thick}");
    assert!(thick.to_string().contains("strains and histories that were set"), "{thick}");
}
