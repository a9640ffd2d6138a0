//! Tests of exponential collocation against closed forms.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::Vector3;

use super::super::picard::TOLERANCE;
use super::*;
use crate::tropism::{Growing, Perception, Statoliths, Variable};

/// Law with one stimulus x, one variable y and a given rate ẏ(y, x).
struct RateLaw<F> {
    variable: Variable,
    rate: F,
}

impl<F: Fn(f64, f64) -> f64> TropismLaw for RateLaw<F> {
    fn declare(&self, to: &mut Declaration) {
        to.stimuli(1);
        to.variable(self.variable);
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        rates[0] = (self.rate)(variables[0], stimuli[0]);
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

/// Returns the memory τ ẏ = x − y, declared as a memory, which is integrated in closed form.
fn memory(tau: f64) -> RateLaw<impl Fn(f64, f64) -> f64> {
    let remembers = crate::tropism::Source::Stimulus(0);
    RateLaw {
        variable: Variable {
            remembers,
            ..Variable::unread().relaxing_in(tau)
        },
        rate: move |y, x| (x - y) / tau,
    }
}

/// Returns the same memory, declared as a variable that relaxes, which is integrated by iteration.
fn iterated_memory(tau: f64) -> RateLaw<impl Fn(f64, f64) -> f64> {
    RateLaw {
        variable: Variable::unread().relaxing_in(tau),
        ..memory(tau)
    }
}

/// Returns a law without relaxation.
fn free<F: Fn(f64, f64) -> f64>(rate: F) -> RateLaw<F> {
    RateLaw {
        variable: Variable::unread(),
        rate,
    }
}

/// Levels of the stimuli, in units of the step.
const LEVELS: Levels = Levels {
    count: ORDER,
    times: [-2.0, -1.0, 0.0, 1.0, f64::NAN],
    transient: None,
};

/// Integrates y from y(0) = `start` over `steps` steps of `size` with the stimulus `x(t)`. Returns
/// `None` if a step fails, and the number of halvings.
fn integrated(
    law: &RateLaw<impl Fn(f64, f64) -> f64>,
    size: f64,
    steps: usize,
    x: impl Fn(f64) -> f64,
    start: f64,
) -> (Option<f64>, usize) {
    let mut collocation = ExponentialCollocation::default();
    let (declaration, mut y) = (Declaration::of(law), [start]);
    for step in 0..steps {
        let stimuli = LEVELS.times.map(|time| [x((step as f64 + time) * size)]);
        collocation.prepare(&declaration, size, LEVELS);
        collocation.begin_step();
        let mut rates = [f64::NAN];
        law.rates(&y, &stimuli[ORDER - 2], &mut rates);
        if !collocation.integrate(law, &stimuli.each_ref().map(|x| &x[..]), &mut y, &rates) {
            return (None, collocation.halvings);
        }
    }
    (Some(y[0]), collocation.halvings)
}

fn value(
    law: &RateLaw<impl Fn(f64, f64) -> f64>,
    size: f64,
    steps: usize,
    x: impl Fn(f64) -> f64,
    start: f64,
) -> f64 {
    integrated(law, size, steps, x, start)
        .0
        .expect("the step succeeds")
}

/// Returns log2 of the ratio of the errors with `steps` steps and twice as many.
fn observed_order(error: impl Fn(usize) -> f64, steps: usize) -> f64 {
    (error(steps) / error(2 * steps)).log2()
}

/// Response of a memory with y(0) = `start` to the cubic p = 1 + 2t − 3t² + t³. It is the sum of p
/// − τp' + τ²p'' − τ³p''' and a decaying exponential.
fn response_to_cubic(tau: f64, start: f64, t: f64) -> f64 {
    let particular = |t: f64| {
        let derivatives = [cubic(t), 2.0 - 6.0 * t + 3.0 * t * t, -6.0 + 6.0 * t, 6.0];
        derivatives.iter().rev().fold(0.0, |sum, p| p - tau * sum)
    };
    particular(t) + (start - particular(0.0)) * (-t / tau).exp()
}

fn cubic(t: f64) -> f64 {
    1.0 + t * (2.0 + t * (-3.0 + t))
}

/// Response of a memory with τ = 1 and y(0) = 1/2 to sin t.
fn response_to_sine(t: f64) -> f64 {
    0.5 * (t.sin() - t.cos()) + (-t).exp()
}

#[test]
fn a_memory_responds_exactly_to_a_cubic_stimulus_at_any_ratio_of_step_to_time_constant() {
    // The formula of the weights changes at the ratio 3.
    for ratio in [0.1, 1.0, 2.9, 3.1, 30.0, 1e4, 1e8] {
        let tau = 0.7 / ratio;
        let exact = response_to_cubic(tau, -2.0, 0.7);
        // The terms of the closed form, up to 6τ³, cancel. The other numbers are of order one.
        let tolerance = 1e-14 * (1.0 + 6.0 * tau.powi(3));
        assert_abs_diff_eq!(
            value(&memory(tau), 0.7, 1, cubic, -2.0),
            exact,
            epsilon = tolerance
        );
        // The iteration of the other law ends at a relative change of 1e-12.
        let iterated = value(&iterated_memory(tau), 0.7, 1, cubic, -2.0);
        assert_abs_diff_eq!(
            iterated,
            exact,
            epsilon = tolerance + TOLERANCE * exact.abs()
        );
    }
}

#[test]
fn the_closed_formula_of_memories_agrees_with_the_iteration_for_any_stimulus() {
    let stimulus = |t: f64| (3.0 * t).sin() + 2.0 * t.cos();
    for tau in [1e-3, 0.3, 40.0] {
        let closed = value(&memory(tau), 0.5, 8, stimulus, 0.2);
        let iterated = value(&iterated_memory(tau), 0.5, 8, stimulus, 0.2);
        // Sum of the tolerances of the iteration in eight steps.
        assert_relative_eq!(
            closed,
            iterated,
            epsilon = 0.0,
            max_relative = 8.0 * TOLERANCE
        );
    }
}

#[test]
fn a_memory_responds_to_a_sine_with_fourth_order() {
    let error = |steps: usize| {
        (value(&memory(1.0), 2.0 / steps as f64, steps, f64::sin, 0.5) - response_to_sine(2.0))
            .abs()
    };
    // With steps of 1/16 and 1/32 the next order changes the observed one by about 1/16. Orders 3
    // and 5 are excluded.
    assert_abs_diff_eq!(observed_order(error, 32), 4.0, epsilon = 0.1);
}

#[test]
fn a_linear_rate_with_a_variable_coefficient_converges_with_fourth_order() {
    // ẏ = cos(t) y has the solution exp(sin t): the interpolation of the stimulus limits the order.
    let law = free(|y, x| x * y);
    let error = |steps: usize| {
        (value(&law, 2.0 / steps as f64, steps, f64::cos, 1.0) - 2f64.sin().exp()).abs()
    };
    assert_abs_diff_eq!(observed_order(error, 32), 4.0, epsilon = 0.1);
}

#[test]
fn an_autonomous_law_without_relaxation_converges_with_the_sixth_order_of_lobatto_collocation() {
    // The logistic equation ẏ = y (1 − y).
    let exact = 1.0 / (1.0 + 9.0 * (-2f64).exp());
    let error = |steps: usize| {
        (value(
            &free(|y, _| y * (1.0 - y)),
            2.0 / steps as f64,
            steps,
            |_| 0.0,
            0.1,
        ) - exact)
            .abs()
    };
    // Four Lobatto points give the order 2·4 − 2. The errors, 3e-9 and 4e-11, are far above the
    // tolerance of 1e-12, and no step is halved.
    assert_abs_diff_eq!(observed_order(error, 5), 6.0, epsilon = 0.2);
}

#[test]
fn a_nonlinear_law_with_relaxation_converges_with_fourth_order_at_least() {
    // The logistic equation again. The term −y/τ with τ = 2 s and the cubic through 3y/2 − y² at
    // four points are integrated exactly. The errors, 6e-10 and 1e-11, are above the tolerance of
    // 1e-12, and no step is halved. The observed order is between four and six.
    let exact = 1.0 / (1.0 + 9.0 * (-2f64).exp());
    let law = RateLaw {
        variable: Variable::unread().relaxing_in(2.0),
        rate: |y: f64, _: f64| y * (1.0 - y),
    };
    let error = |steps: usize| (value(&law, 2.0 / steps as f64, steps, |_| 0.0, 0.1) - exact).abs();
    let order = observed_order(error, 8);
    assert!(order > 3.9, "{order}");
}

#[test]
fn a_memory_with_a_short_time_constant_equals_its_stimulus() {
    let tau = 1e-9;
    for closed in [true, false] {
        let y = if closed {
            value(&memory(tau), 1.0, 3, f64::sin, 5.0)
        } else {
            value(&iterated_memory(tau), 1.0, 3, f64::sin, 5.0)
        };
        // The lag is τ times the slope of the interpolated stimulus, which is of order one.
        assert_abs_diff_eq!(y, 3f64.sin(), epsilon = 2.0 * tau);
    }
}

#[test]
fn a_memory_with_a_long_time_constant_integrates_its_stimulus() {
    // For τ ẏ = x − y with y ≪ x, y = ∫ x/τ dt = (1 − cos t)/τ, with a relative error of t/τ.
    let tau = 1e9;
    let y = value(&memory(tau), 0.01, 100, f64::sin, 0.0);
    // The relative error of fourth order with steps of 1/100 and a mean slope of one is 1e-8 ·
    // 19/720.
    assert_relative_eq!(
        y * tau,
        1.0 - 1f64.cos(),
        epsilon = 0.0,
        max_relative = 1e-9
    );
}

#[test]
fn an_undeclared_fast_rate_halves_the_interval_and_stays_accurate() {
    // ẏ = k (x − y) without a declared relaxation; y grows from 0 to 1 − exp(−6).
    let law = free(|y, x| 6.0 * (x - y));
    let (y, halvings) = integrated(&law, 1.0, 1, |_| 1.0, 0.0);
    assert!(halvings > 0);
    // Collocation of order six has an error of (k δ)⁷/(7! · 6! · 20) in an interval δ ≤ 1/2, which
    // decays in later intervals.
    assert_abs_diff_eq!(y.unwrap(), -(-6f64).exp_m1(), epsilon = 1e-5);
    let (_, none) = integrated(&iterated_memory(1.0 / 6.0), 1.0, 1, |_| 1.0, 0.0);
    assert_eq!(none, 0, "a declared relaxation needs no halving");
}

/// A variable that follows a memory, which is declared as one on which no other rate depends.
struct Misdeclared;

impl TropismLaw for Misdeclared {
    fn declare(&self, to: &mut Declaration) {
        let stimulus = to.stimuli(1);
        to.variable(Variable::unread().relaxing_in(2.0));
        to.uncoupled_memories(1, stimulus, 1.0, None);
    }

    fn rates(&self, y: &[f64], x: &[f64], rates: &mut [f64]) {
        rates.copy_from_slice(&[0.5 * (y[1] - y[0]), x[0] - y[1]]);
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

#[test]
fn a_rate_that_reads_an_uncoupled_memory_is_a_failure() {
    // The memory is at the place after the only iterated variable. It is NaN with known and with
    // unknown rates at the start.
    for rates in [Some(&[0.0, 0.0][..]), None] {
        let mut collocation = ExponentialCollocation::default();
        collocation.prepare(&Declaration::of(&Misdeclared), 0.5, LEVELS);
        collocation.begin_step();
        let stimuli = LEVELS.times.map(|time| [time]);
        let ends = stimuli.each_ref().map(|x| &x[..]);
        assert!(
            !collocation.advance(&Misdeclared, &ends, (&mut [0.0, 0.0], rates), 0.0, 0),
            "{rates:?}"
        );
    }
}

/// Avalanches of statoliths, with the number of evaluations of their rates.
struct Counted(Statoliths, std::cell::Cell<usize>);

impl TropismLaw for Counted {
    fn declare(&self, to: &mut Declaration) {
        self.0.declare(to);
    }

    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        self.1.set(self.1.get() + 1);
        self.0.rates(variables, stimuli, rates);
    }

    fn gradient(&self, _at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::zeros()
    }
}

#[test]
fn avalanches_that_are_much_faster_than_the_step_need_one_sweep() {
    // The ratio of 1 µs to a step of 100 s.
    let tau = 1e-8;
    let law = Counted(
        Statoliths {
            avalanche_time: tau,
        },
        std::cell::Cell::new(0),
    );
    // A cell that turns by 0.3 rad in each step. The interpolated vertical differs from a unit
    // vector by 1e-4 inside the step. The pile lags behind the vertical by τ.
    let up = |t: f64| [(0.3 * t).sin(), 0.0, (0.3 * t).cos()];
    let (stimuli, mut y) = (LEVELS.times.map(up), up(-tau));
    let rates = [0.3 * y[2], 0.0, -0.3 * y[0]];
    let mut collocation = ExponentialCollocation::default();
    collocation.prepare(&Declaration::of(&law), 1.0, LEVELS);
    collocation.begin_step();
    assert!(collocation.integrate(&law, &stimuli.each_ref().map(|x| &x[..]), &mut y, &rates));
    assert_eq!(
        law.1.get(),
        ORDER - 1,
        "one evaluation at each node after the first"
    );
    for (y, up) in y.iter().zip(up(1.0 - tau)) {
        // The slope of the interpolated vertical has an error of 0.3⁴/4, which changes the lag.
        assert_abs_diff_eq!(*y, up, epsilon = 3e-3 * tau);
    }
}

#[test]
fn a_solution_that_blows_up_within_the_step_is_a_failure() {
    // ẏ = y² from 1 is infinite at t = 1.
    assert_eq!(
        integrated(&free(|y, _| y * y), 2.0, 1, |_| 0.0, 1.0).0,
        None
    );
}

#[test]
fn a_rate_that_is_not_a_number_is_a_failure() {
    assert_eq!(
        integrated(&free(|_, _| f64::NAN), 1.0, 1, |_| 0.0, 1.0).0,
        None
    );
    // The rate is finite at the start only.
    assert_eq!(
        integrated(
            &free(|_, x| if x == 0.0 { 1.0 } else { f64::NAN }),
            1.0,
            1,
            |t| t,
            1.0
        )
        .0,
        None
    );
}
