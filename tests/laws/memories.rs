//! Linear memories that are declared are integrated by fixed weights, without asking the law; others by collocation. Both
//! are the exact response to the stimuli that were sensed.

use std::cell::Cell;

use crate::fixtures::shoots::{HOUR, STATOLITHS, righting, steering};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::tropism::{Declaration, Growing, SettledStatoliths, Site, Size, Source, TropismLaw, Variable};
use nalgebra::Vector3;

/// A law that keeps to itself which of its variables are memories. Counts how often it is asked for rates.
struct Silent<'a, L> {
    law: L,
    asked: &'a Cell<usize>,
}

impl<L: TropismLaw> TropismLaw for Silent<'_, L> {
    fn declare(&self, to: &mut Declaration) {
        let declared = Declaration::of(&self.law);
        to.stimuli(declared.size().stimuli);
        for variable in declared.variables() {
            to.variable(Variable { remembers: Source::Computed, ..*variable });
        }
    }
    fn size(&self) -> Size {
        self.law.size()
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.law.sense(site, stimuli);
    }
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.asked.set(self.asked.get() + 1);
        self.law.rates(variables, stimuli, rates);
    }
    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        self.law.at_rest(stimuli, variables);
    }
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        self.law.gradient(at, past, now)
    }
}

/// The tip (m) of a righting shoot and its variables after two hours.
fn righted(law: impl TropismLaw) -> (Vector3<f64>, Vec<f64>) {
    let mut shoot = righting().tropism(law).build().unwrap();
    let mut run = MethodOfSteps::new(180.0);
    // A time inside a step, so that steps of several sizes are among those taken.
    for until in [0.1, 1.03, 2.0] {
        run.advance(&mut shoot, until * HOUR).unwrap();
    }
    let points = 0..shoot.rod().points().len();
    let variables = points.flat_map(|i| shoot.state().variables(i).unwrap().to_vec()).collect();
    (shoot.tip(), variables)
}

#[test]
fn declared_or_not_memories_give_the_same() {
    let asked = Cell::new(0);
    let (tip, variables) = righted(steering(SettledStatoliths));
    let (other_tip, other_variables) = righted(Silent { law: steering(SettledStatoliths), asked: &asked });
    // The same weights, applied in another order, in fifty steps: rounding of each, 4 units of 1.1e-16, on a tip that is 5 cm
    // away and on variables up to 100/m (bending) and 1 (direction).
    assert!((tip - other_tip).norm() < 1e-15, "{tip:?}, {other_tip:?}");
    for (y, other) in variables.iter().zip(&other_variables) {
        assert!((y - other).abs() < 50.0 * 4.0 * f64::EPSILON * y.abs().max(1.0), "{y}, {other}");
    }
    assert!(asked.get() > 0);
}

#[test]
fn a_memory_beside_variables_of_other_kinds_is_the_same() {
    // Statoliths are iterated to 1e-12 of themselves, with what remembers them or without it being known.
    let asked = Cell::new(0);
    let (tip, _) = righted(steering(STATOLITHS));
    let (other, _) = righted(Silent { law: steering(STATOLITHS), asked: &asked });
    assert!((tip - other).norm() < 1e-12 * 0.05, "{tip:?}, {other:?}");
    // Seven or eight sweeps over three nodes at 32 points, in the 50 steps of two hours with the seven of the start and the
    // ones around the two ends: a sweep more would be noticed.
    let per_point = asked.get() as f64 / (32.0 * 60.0);
    assert!(per_point < 30.0, "{per_point} calls at a point in a step");
}

/// Declares a memory, and is one while its stimulus is small.
struct Saturating;

impl TropismLaw for Saturating {
    fn declare(&self, to: &mut Declaration) {
        let x = to.stimuli(1);
        to.memories(1, x, 720.0, Some(720.0));
    }
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        // The age of the shoot, in hours.
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
fn a_memory_that_ceases_to_be_one_is_refused_when_it_does() {
    let mut shoot = righting().tropism(Saturating).into_dyn().build().unwrap();
    let mut run = MethodOfSteps::new(180.0);
    run.advance(&mut shoot, HOUR).unwrap();
    let before = shoot.state().clone();
    let error = run.advance(&mut shoot, 2.0 * HOUR).unwrap_err().to_string();
    assert!(error.contains("declared a memory"), "{error}");
    assert!(shoot.state() == &before);
}
