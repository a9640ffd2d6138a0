//! Variables that remember stimuli, τ ẏ = x − y: the exact answer is a sum with fixed weights.

use super::ORDER;
use super::relaxation::{Kernel, LANES, NODES};
use crate::error::ParameterError;
use crate::tropism::{Declaration, Source};

/// Shoots all of whose variables are linear memories of stimuli, as in the reduced model.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    /// One for every variable; none if one of them is not the memory of a stimulus.
    each: Vec<Memory>,
}

/// y at the end of a step is a part of what it was, and a part of the stimulus at every level.
#[derive(Debug, Clone, Copy)]
struct Memory {
    stimulus: usize,
    decay: f64,
    weights: [f64; ORDER],
}

impl Memories {
    /// Prepares for a step with the given weights of the variables, under stimuli that `at_nodes` interpolates at its nodes.
    /// Returns whether all variables are memories of stimuli.
    pub fn prepare(&mut self, laws: &Declaration, kernels: &[Kernel], at_nodes: &[[f64; ORDER]; NODES]) -> bool {
        self.each.clear();
        for (i, variable) in laws.variables().iter().enumerate() {
            let Source::Stimulus(stimulus) = variable.remembers else { return false };
            let (kernel, lane) = (&kernels[i / LANES], i % LANES);
            // N = x/τ, integrated to the last node.
            let mut weights = [0.0; ORDER];
            for (integral, at) in kernel.integral[NODES - 1].iter().zip(at_nodes) {
                for (weight, at) in weights.iter_mut().zip(at) {
                    *weight += integral[lane] / variable.time_constant * at;
                }
            }
            self.each.push(Memory { stimulus, decay: kernel.decay[NODES - 1][lane], weights });
        }
        true
    }

    /// Carries the variables `y` of a point over the step, under its stimuli at every level.
    #[inline]
    pub fn carry(&self, stimuli: &[&[f64]], y: &mut [f64]) {
        for (memory, y) in self.each.iter().zip(y) {
            *y *= memory.decay;
            for (stimuli, weight) in stimuli.iter().zip(memory.weights) {
                *y += weight * stimuli[memory.stimulus];
            }
        }
    }
}

/// Refuses laws whose rates are not those of the linear memories that they declare.
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
        // One subtraction and one quotient, however the law writes them, of numbers that may be too small for all their digits.
        let rounding = 16.0 * f64::EPSILON * (x.abs() + y.abs()) + f64::MIN_POSITIVE * (1.0 + variable.time_constant);
        let linear = (change - (x - y)).abs() <= rounding;
        let name = "rate of a variable that is declared a memory, times its time constant";
        ParameterError::unless(linear, name, change, "what it remembers minus itself")?;
    }
    Ok(())
}
