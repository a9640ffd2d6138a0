//! Exact integration of memories, their division into parts, and the check of declared ones.

use approx::assert_abs_diff_eq;

use super::*;
use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::lobatto;

/// Time constants of a memory of stimulus 1 and of a memory of stimulus 0, s.
const TAUS: [f64; 2] = [0.25, 3.0];

fn laws() -> Declaration {
    let mut laws = Declaration::default();
    let first = laws.stimuli(2);
    laws.memories(1, first.offset(1), TAUS[0], None);
    laws.memories(1, first, TAUS[1], None);
    laws
}

#[test]
fn memories_of_linear_stimuli_are_exact() {
    let (size, nodes) = (0.5, lobatto(ORDER - 1));
    let mut at_nodes = [[0.0; LEVELS]; ORDER];
    for (at, node) in at_nodes.iter_mut().zip(&nodes) {
        *at = lagrange(&[-2.0, -1.0, 0.0, 1.0], *node);
    }
    let (mut parts, mut of_nodes, mut memories) =
        (Parts::default(), Memories::default(), Memories::default());
    assert!(
        !parts.read(&laws()) && parts.read(&laws()),
        "only the second call finds them known"
    );
    of_nodes.set(&parts.of_stimuli, &nodes, size);
    memories.interpolate(&of_nodes, &at_nodes);
    let lines = [|t: f64| 4.0 - t, |t: f64| 1.0 + 2.0 * t];
    let stimuli = [-2.0, -1.0, 0.0, 1.0, 0.0].map(|time| lines.map(|x| x(time * size)));
    let mut y = [-1.0, 7.0];
    memories.integrate(&mut y, |source| {
        (0.0, stimuli.map(|stimuli| stimuli[source]))
    });
    // x = a + b t gives y = a + b (t − τ) + C exp(−t/τ).
    let exact = |a: f64, b: f64, tau: f64, start: f64| {
        a + b * (size - tau) + (start - a + b * tau) * (-size / tau).exp()
    };
    // Rounding of sums of a few numbers below ten.
    assert_abs_diff_eq!(y[0], exact(1.0, 2.0, TAUS[0], -1.0), epsilon = 1e-14);
    assert_abs_diff_eq!(y[1], exact(4.0, -1.0, TAUS[1], 7.0), epsilon = 1e-14);
}

/// Numbers of memories of stimuli, of iterated variables, and of memories of these.
fn parts(laws: &Declaration) -> [usize; 3] {
    let mut parts = Parts::default();
    parts.read(laws);
    [
        parts.of_stimuli.len(),
        parts.iterated.len(),
        parts.of_variables.len(),
    ]
}

#[test]
fn only_variables_that_may_depend_on_each_other_are_iterated() {
    assert_eq!(parts(&laws()), [2, 0, 0]);
    // The memory of a memory needs the latter at the nodes.
    let mut chained = laws();
    chained.memories(1, Source::Variable(0), 1.0, None);
    assert_eq!(parts(&chained), [1, 1, 1]);
    // A computed rate may depend on the memories, unless they are declared uncoupled.
    let mut coupled = laws();
    let computed = coupled.variable(Variable::unread());
    coupled.memories(1, computed, 1.0, None);
    assert_eq!(parts(&coupled), [0, 4, 0]);
    let mut uncoupled = Declaration::default();
    let first = uncoupled.stimuli(2);
    let computed = uncoupled.variable(Variable::unread());
    uncoupled.uncoupled_memories(2, first, TAUS[0], None);
    uncoupled.uncoupled_memories(1, computed, TAUS[1], None);
    assert_eq!(parts(&uncoupled), [2, 1, 1]);
    // Two memories of each other are a linear system.
    let mut mutual = Declaration::default();
    mutual.uncoupled_memories(1, Source::Variable(1), 1.0, None);
    mutual.uncoupled_memories(1, Source::Variable(0), 1.0, None);
    assert_eq!(parts(&mutual), [0, 2, 0]);
}

#[test]
fn groups_are_runs_of_at_most_four_consecutive_iterated_variables() {
    let mut laws = Declaration::default();
    let stimulus = laws.stimuli(1);
    for iterated in [3, 6] {
        for _ in 0..iterated {
            laws.variable(Variable::unread());
        }
        laws.uncoupled_memories(1, stimulus, TAUS[0], None);
    }
    let mut parts = Parts::default();
    parts.read(&laws);
    let places = |group: &[Member]| group.iter().map(|each| each.variable).collect();
    let groups: Vec<Vec<usize>> = parts.groups().map(places).collect();
    assert_eq!(groups, [vec![0, 1, 2], vec![4, 5, 6, 7], vec![8, 9]]);
    assert_eq!(
        [2, 3, 7, 9].map(|variable| parts.lane(variable)),
        [Some((0, 2)), None, Some((1, 3)), Some((2, 1))]
    );
}

#[test]
fn declared_memories_are_accepted_up_to_rounding_of_their_rates() {
    let (y, x) = ([0.3, -2.0], [0.7, 1.1]);
    let rates = [(x[1] - y[0]) / TAUS[0], (x[0] - y[1]) / TAUS[1]];
    let declared = laws();
    assert!(declared.check_rates(&y, &rates, &x).is_ok());
    for k in 0..2 {
        for share in [1e-13, f64::NAN] {
            let mut wrong = rates;
            wrong[k] *= 1.0 + share;
            assert!(
                declared.check_rates(&y, &wrong, &x).is_err(),
                "rate {k} changed by {share}"
            );
        }
    }
}

#[test]
fn declared_oscillations_are_accepted_up_to_rounding_of_their_rates() {
    let mut laws = Declaration::default();
    let first = laws.stimuli(2);
    laws.oscillations(2, first, (TAUS[1], 0.8), None);
    assert_eq!(parts(&laws), [4, 0, 0]);
    // p and q of stimulus 0 and of stimulus 1 are at places 0, 2 and 1, 3.
    let (y, x) = ([0.3, -2.0, 1.4, 0.6], [0.7, 1.1]);
    let real = |k: usize| (x[k] - y[k]) / TAUS[1] - 0.8 * y[k + 2];
    let imaginary = |k: usize| -y[k + 2] / TAUS[1] + 0.8 * y[k];
    let rates = [real(0), real(1), imaginary(0), imaginary(1)];
    assert!(laws.check_rates(&y, &rates, &x).is_ok());
    for k in 0..4 {
        let mut wrong = rates;
        wrong[k] *= 1.0 + 1e-12;
        assert!(laws.check_rates(&y, &wrong, &x).is_err(), "rate {k}");
    }
    // A memory of one of the variables makes both iterated.
    laws.memories(1, Source::Variable(3), 1.0, None);
    assert_eq!(parts(&laws), [2, 2, 1]);
}
