//! Memories of stimuli. Declared linear memories are integrated with fixed weights and without
//! calls of the law. All other variables are integrated by collocation. Both methods compute the
//! same response to the sensed stimuli.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::fixtures::in_norm::InNorm;
use crate::fixtures::shoots::{BETA, HOUR, MEMORY, STATOLITHS, gravitropism, righting, steering};
use approx::assert_abs_diff_eq;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{
    Declaration, DirectionalTropism, Gravitropism, Growing, KernelTerm, MemoryKernel, Perception,
    Response, SettledStatoliths, Site, Size, Source, TropismLaw, Variable,
};
use nalgebra::Vector3;

/// A law that does not declare some properties of its variables. It counts the calls of its rates.
struct Silent<L> {
    law: L,
    /// Returns a variable without these properties.
    silenced: fn(&Variable) -> Variable,
    calls: Arc<AtomicUsize>,
}

impl<L: TropismLaw> TropismLaw for Silent<L> {
    fn declare(&self, to: &mut Declaration) {
        let declared = Declaration::of(&self.law);
        to.stimuli(declared.size().stimuli);
        for variable in declared.variables() {
            to.variable((self.silenced)(variable));
        }
    }
    fn size(&self) -> Size {
        self.law.size()
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.law.sense(site, stimuli);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.law.rates(variables, stimuli, rates);
    }
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.law.initial(stimuli, variables);
    }
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        self.law.gradient(at, past, now)
    }
}

/// A variable that is not declared as a memory.
fn computed(variable: &Variable) -> Variable {
    Variable {
        remembers: Source::Computed,
        ..*variable
    }
}

/// Tip (m) and variables of a righting shoot after two hours.
fn righted(law: impl TropismLaw + Send + Sync + 'static) -> (Vector3<f64>, Vec<f64>) {
    let mut shoot = righting().tropism(law).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(180.0);
    // One output time is inside a step. The steps therefore have several sizes.
    for until in [0.1, 1.03, 2.0] {
        run.advance(&mut shoot, until * HOUR).unwrap();
    }
    let points = 0..shoot.rod().points().len();
    let variables = points
        .flat_map(|i| shoot.state().variables(i).unwrap().to_vec())
        .collect();
    (shoot.tip(), variables)
}

#[test]
fn undeclared_memories_give_the_same_shoot_as_declared_ones() {
    let calls = Arc::new(AtomicUsize::new(0));
    let (tip, variables) = righted(steering(SettledStatoliths));
    let (other_tip, other_variables) = righted(Silent {
        law: steering(SettledStatoliths),
        silenced: computed,
        calls: calls.clone(),
    });
    // The same weights are applied in another order, in fifty steps. The tolerance of the variables
    // is four machine epsilons per step, relative to the larger of their size and 1. The tip is at
    // a distance of 5 cm.
    assert_abs_diff_eq!(InNorm(tip), InNorm(other_tip), epsilon = 1e-15);
    for (y, other) in variables.iter().zip(&other_variables) {
        assert_abs_diff_eq!(
            y,
            other,
            epsilon = 50.0 * 4.0 * f64::EPSILON * y.abs().max(1.0)
        );
    }
    assert!(calls.load(Ordering::Relaxed) > 0);
}

#[test]
fn undeclared_memories_of_statoliths_cost_a_bounded_number_of_calls() {
    // The variables of statoliths are iterated to a relative tolerance of 1e-12, with declared or
    // undeclared memories.
    let calls = Arc::new(AtomicUsize::new(0));
    let (tip, _) = righted(steering(STATOLITHS));
    let (other, _) = righted(Silent {
        law: steering(STATOLITHS),
        silenced: computed,
        calls: calls.clone(),
    });
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = 1e-12 * 0.05);
    // At most four sweeps over three nodes at 32 points. Two hours take 50 steps, seven initial
    // steps, and some additional steps around the two output times.
    let per_point = calls.load(Ordering::Relaxed) as f64 / (32.0 * 60.0);
    assert!(per_point < 12.0, "{per_point} calls at a point in a step");
}

#[test]
fn declared_stimulus_of_statoliths_saves_calls() {
    let calls = |silenced: fn(&Variable) -> Variable| {
        let calls = Arc::new(AtomicUsize::new(0));
        let (tip, _) = righted(Silent {
            law: steering(STATOLITHS),
            silenced,
            calls: calls.clone(),
        });
        (tip, calls.load(Ordering::Relaxed) as f64)
    };
    let (tip, declared) = calls(computed);
    let (other, undeclared) = calls(|variable| Variable {
        approaches: Source::Computed,
        ..computed(variable)
    });
    // The tolerance of the iteration, at a distance of 5 cm.
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = 1e-12 * 0.05);
    println!("{declared} and {undeclared} calls");
    assert!(
        declared < 0.9 * undeclared,
        "{declared} and {undeclared} calls"
    );
}

/// A perception that does not declare which of its variables are the signal.
struct Computed<P>(P);

impl<P: Perception> Perception for Computed<P> {
    type Signal = P::Signal;

    fn declare(&self, to: &mut Declaration) -> Source {
        self.0.declare(to);
        Source::Computed
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.0.sense(site, stimuli);
    }
    fn signal(&self, variables: &[f64], stimuli: &[f64]) -> P::Signal {
        self.0.signal(variables, stimuli)
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.0.rates(variables, stimuli, rates);
    }
    fn steady(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.0.steady(stimuli, variables);
    }
    fn initial(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.0.initial(stimuli, variables);
    }
    fn delay(&self) -> f64 {
        self.0.delay()
    }
}

#[test]
fn memories_of_a_computed_signal_give_the_same_shoot_as_those_of_a_declared_one() {
    let (tip, _) = righted(steering(STATOLITHS));
    let (other, _) = righted(steering(Computed(STATOLITHS)));
    // Variables of statoliths are iterated to a relative tolerance of 1e-12, and the tip is at a
    // distance of 5 cm.
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = 1e-12 * 0.05);
}

#[test]
fn memories_of_a_computed_memory_give_the_same_shoot_as_those_of_a_declared_one() {
    let once = || gravitropism(STATOLITHS);
    let (tip, _) = righted(
        DirectionalTropism {
            sensitivity: BETA,
            perception: once(),
        }
        .remembered(MEMORY),
    );
    let computed = DirectionalTropism {
        sensitivity: BETA,
        perception: Computed(once()),
    };
    let (other, _) = righted(computed.remembered(MEMORY));
    // The tolerance of the iteration, as above.
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = 1e-12 * 0.05);
}

/// Oscillating memories of a stimulus, of a variable that is iterated, and of a computed signal.
#[test]
fn oscillations_integrated_in_closed_form_give_the_same_shoot_as_iterated_ones() {
    let oscillation = KernelTerm {
        amplitude: 2e-3,
        time: 900.0,
        frequency: 1.5e-3,
        phase: -0.4,
    };
    let kernel = || MemoryKernel {
        terms: vec![KernelTerm::decay(1e-3, 300.0), oscillation],
        delay: 400.0,
    };
    fn gravitropism<P>(perception: P) -> Gravitropism<P> {
        Gravitropism {
            sensitivity: BETA,
            perception,
        }
    }
    let silent = |variable: &Variable| Variable {
        turns: None,
        ..computed(variable)
    };
    let (tip, variables) = righted(gravitropism(SettledStatoliths).filtered(kernel()));
    let law = gravitropism(SettledStatoliths).filtered(kernel());
    let (other, other_variables) = righted(Silent {
        law,
        silenced: silent,
        calls: Arc::default(),
    });
    // Collocation replaces the partner of an oscillating variable by a cubic. The error of four
    // Lobatto points in fifty steps is of the order of 50 (ωh)⁷/1e6, with h = 180 s.
    let error = 50.0 * (1.5e-3_f64 * 180.0).powi(7) / 1e6;
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = error * 0.05);
    assert_abs_diff_eq!(variables[..], other_variables[..], epsilon = error);
    let (tip, variables) = righted(gravitropism(STATOLITHS).filtered(kernel()));
    let law = gravitropism(STATOLITHS).filtered(kernel());
    let (other, other_variables) = righted(Silent {
        law,
        silenced: silent,
        calls: Arc::default(),
    });
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = error * 0.05);
    assert_abs_diff_eq!(variables[..], other_variables[..], epsilon = error);
    let (other, _) = righted(gravitropism(Computed(STATOLITHS)).filtered(kernel()));
    assert_abs_diff_eq!(InNorm(tip), InNorm(other), epsilon = error * 0.05);
}

/// A law whose variable is the declared memory only while its stimulus is at most 1.
struct Saturating;

impl TropismLaw for Saturating {
    fn declare(&self, to: &mut Declaration) {
        let x = to.stimuli(1);
        to.memories(1, x, 720.0, Some(720.0));
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        // The stimulus is the time in hours.
        stimuli[0] = site.environment.time / HOUR;
    }
    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        rates[0] = (x[0].min(1.0) - y[0]) / 720.0;
    }
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::y() * past[0]
    }
}

#[test]
fn law_that_stops_being_its_declared_memory_is_refused() {
    let mut shoot = righting().tropism(Saturating).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(180.0);
    run.advance(&mut shoot, HOUR).unwrap();
    let before = shoot.state().clone();
    let error = run.advance(&mut shoot, 2.0 * HOUR).unwrap_err().to_string();
    assert!(error.contains("declared a memory"), "{error}");
    assert!(shoot.state() == &before);
}
