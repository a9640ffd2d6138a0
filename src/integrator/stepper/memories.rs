//! Linear memories of stimuli, τ ẏ = x − y. Their exact solution over a step is a sum with constant weights.

use super::ORDER;
use super::relaxation::{Kernel, LANES};
use crate::error::ParameterError;
use crate::tropism::{Declaration, Source};

/// Exact integration of the variables if all of them are linear memories of stimuli, as in the reduced model.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    /// One memory for each variable.
    each: Vec<Memory>,
}

/// Weights of y at the start of a step and of the stimulus at each level in y at the end of the step.
#[derive(Debug, Clone, Copy)]
struct Memory {
    stimulus: usize,
    decay: f64,
    weights: [f64; ORDER],
}

impl Memories {
    /// Computes the weights for a step from those of the variables, `kernels`, and the interpolation weights of
    /// the stimuli at the nodes. Returns whether all variables are memories of stimuli.
    pub fn prepare(&mut self, laws: &Declaration, kernels: &[Kernel], at_nodes: &[[f64; ORDER]; ORDER]) -> bool {
        self.each.clear();
        for (i, variable) in laws.variables().iter().enumerate() {
            let Source::Stimulus(stimulus) = variable.remembers else { return false };
            let (kernel, lane) = (&kernels[i / LANES], i % LANES);
            // The integral of x/τ up to the last node.
            let mut weights = [0.0; ORDER];
            for (integral, at) in kernel.integral[ORDER - 1].iter().zip(at_nodes) {
                for (weight, at) in weights.iter_mut().zip(at) {
                    *weight += integral[lane] / variable.time_constant * at;
                }
            }
            self.each.push(Memory { stimulus, decay: kernel.decay[ORDER - 1][lane], weights });
        }
        true
    }

    /// Integrates the variables `y` of a point over the step, with its stimuli at each level.
    #[inline]
    pub fn integrate(&self, stimuli: &[&[f64]], y: &mut [f64]) {
        for (memory, y) in self.each.iter().zip(y) {
            *y *= memory.decay;
            for (stimuli, weight) in stimuli.iter().zip(memory.weights) {
                *y += weight * stimuli[memory.stimulus];
            }
        }
    }
}

/// Returns an error unless the rates are those of the linear memories that the laws declare.
pub(super) fn check_memories(
    laws: &Declaration,
    variables: &[f64],
    rates: &[f64],
    stimuli: &[f64],
) -> Result<(), ParameterError> {
    for ((variable, y), rate) in laws.variables().iter().zip(variables).zip(rates) {
        let x = match variable.remembers {
            Source::Stimulus(k) => stimuli[k],
            Source::Variable(k) => variables[k],
            Source::Computed => continue,
        };
        let change = rate * variable.time_constant;
        // Rounding of one subtraction and one quotient, whose results may be subnormal numbers.
        let rounding = 16.0 * f64::EPSILON * (x.abs() + y.abs()) + f64::MIN_POSITIVE * (1.0 + variable.time_constant);
        let linear = (change - (x - y)).abs() <= rounding;
        let name = "rate of a variable that is declared a memory, times its time constant";
        ParameterError::unless(linear, name, change, "the remembered quantity minus the variable")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
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
        let mut kernels = vec![Kernel::default(); 1];
        TAUS.iter().enumerate().for_each(|(lane, tau)| kernels[0].set(lane, &nodes, size, *tau));
        let mut at_nodes = [[0.0; ORDER]; ORDER];
        for (at, node) in at_nodes.iter_mut().zip(&nodes) {
            lagrange(&[-2.0, -1.0, 0.0, 1.0], *node, at);
        }
        let mut memories = Memories::default();
        assert!(memories.prepare(&laws(), &kernels, &at_nodes));
        let lines = [|t: f64| 4.0 - t, |t: f64| 1.0 + 2.0 * t];
        let stimuli = [-2.0, -1.0, 0.0, 1.0].map(|time| lines.map(|x| x(time * size)));
        let mut y = [-1.0, 7.0];
        memories.integrate(&stimuli.each_ref().map(|x| &x[..]), &mut y);
        // x = a + b t gives y = a + b (t − τ) + C exp(−t/τ).
        let exact =
            |a: f64, b: f64, tau: f64, start: f64| a + b * (size - tau) + (start - a + b * tau) * (-size / tau).exp();
        // Rounding of sums of a few numbers below ten.
        assert_abs_diff_eq!(y[0], exact(1.0, 2.0, TAUS[0], -1.0), epsilon = 1e-14);
        assert_abs_diff_eq!(y[1], exact(4.0, -1.0, TAUS[1], 7.0), epsilon = 1e-14);
    }

    #[test]
    fn variables_that_are_not_memories_of_stimuli_are_not_integrated_in_closed_form() {
        let kernels = [Kernel::default()];
        let at_nodes = [[0.0; ORDER]; ORDER];
        let mut chained = laws();
        chained.memories(1, Source::Variable(0), 1.0, None);
        let mut computed = laws();
        computed.variable(crate::tropism::Variable::unread());
        for other in [chained, computed] {
            assert!(!Memories::default().prepare(&other, &kernels, &at_nodes));
        }
    }

    #[test]
    fn declared_memories_are_accepted_up_to_rounding_of_their_rates() {
        let (y, x) = ([0.3, -2.0], [0.7, 1.1]);
        let rates = [(x[1] - y[0]) / TAUS[0], (x[0] - y[1]) / TAUS[1]];
        assert!(check_memories(&laws(), &y, &rates, &x).is_ok());
        for k in 0..2 {
            for share in [1e-13, f64::NAN] {
                let mut wrong = rates;
                wrong[k] *= 1.0 + share;
                assert!(check_memories(&laws(), &y, &wrong, &x).is_err(), "rate {k} changed by {share}");
            }
        }
    }
}
