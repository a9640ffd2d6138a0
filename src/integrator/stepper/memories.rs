//! Linear memories of stimuli, τ ẏ = x − y, and damped oscillations ż = (x − z)/τ + iωz. Their exact solution over a
//! step is a sum with constant weights.

use nalgebra::Complex;

use super::ORDER;
use super::relaxation::{Kernel, LANES, relaxed_integral};
use crate::state::LEVELS;
use crate::tropism::{Declaration, Source, Variable};

/// Memory of a stimulus or of another variable.
#[derive(Debug, Clone, Copy)]
pub(super) struct DeclaredMemory {
    /// Place among the variables.
    variable: usize,
    /// Place of what it remembers, among the stimuli or among the variables.
    source: usize,
    /// Time constant, s.
    time: f64,
    /// Angular frequency ω (rad/s) of the oscillation of which it is the real part, −ω of the imaginary part, zero of
    /// others.
    frequency: f64,
}

/// Variable that is iterated.
#[derive(Debug, Clone, Copy)]
pub(super) struct Iterated {
    /// Place among the variables.
    pub variable: usize,
    /// The stimulus that it approaches.
    pub source: Option<usize>,
    /// Time constant, s.
    pub time: f64,
}

/// Variables of a point in three parts, in the order of their integration.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    /// The variables that are divided into the parts.
    variables: Vec<Variable>,
    /// Memories of stimuli, which are integrated first.
    pub of_stimuli: Vec<DeclaredMemory>,
    /// Variables that depend on each other in an undeclared way.
    pub iterated: Vec<Iterated>,
    /// Memories of iterated variables, which are integrated last.
    pub of_variables: Vec<DeclaredMemory>,
}

impl Parts {
    /// Divides the variables of the laws. Returns whether they are those of the last call.
    pub fn read(&mut self, laws: &Declaration) -> bool {
        let variables = laws.variables();
        if self.variables == variables {
            return true;
        }
        for list in [&mut self.of_stimuli, &mut self.of_variables] {
            list.clear();
        }
        self.iterated.clear();
        self.variables.clear();
        self.variables.extend(variables);
        let computes = variables.iter().any(|variable| variable.remembers == Source::Computed);
        // Memories on which an iterated variable may depend, or another memory does, are iterated.
        let is_read = |i: usize, variable: &Variable| {
            let read = |i| variables.iter().any(|other| other.remembers == Source::Variable(i));
            read(i) || variable.turns.is_some_and(|(_, other)| read(other)) || variable.coupled && computes
        };
        for (i, variable) in variables.iter().enumerate() {
            let frequency = variable.turns.map_or(0.0, |(frequency, _)| frequency);
            let memory = |source| DeclaredMemory { variable: i, source, time: variable.time_constant, frequency };
            match variable.remembers {
                Source::Stimulus(source) if !is_read(i, variable) => self.of_stimuli.push(memory(source)),
                Source::Variable(source) if !is_read(i, variable) => self.of_variables.push(memory(source)),
                _ => {
                    let of = |source| if let Source::Stimulus(k) = source { Some(k) } else { None };
                    let source = of(variable.approaches).or(of(variable.remembers));
                    self.iterated.push(Iterated { variable: i, source, time: variable.time_constant });
                }
            }
        }
        // Oscillations come last, each as its real part and its imaginary part.
        let place = |memory: &DeclaredMemory| match variables[memory.variable].turns {
            Some((frequency, _)) if frequency > 0.0 => (memory.variable + 1, 0),
            Some((_, other)) => (other + 1, 1),
            None => (0, memory.variable),
        };
        for list in [&mut self.of_stimuli, &mut self.of_variables] {
            list.sort_by_key(place);
        }
        false
    }

    /// Groups of at most [`LANES`] iterated variables at consecutive places.
    pub fn groups(&self) -> impl Iterator<Item = &[Iterated]> {
        self.iterated.chunk_by(|a, b| a.variable + 1 == b.variable).flat_map(|run| run.chunks(LANES))
    }

    /// The group of a variable and its lane, if it is iterated.
    fn lane(&self, variable: usize) -> Option<(usize, usize)> {
        let lane = |group: &[Iterated]| group.iter().position(|each| each.variable == variable);
        self.groups().enumerate().find_map(|(i, group)| Some((i, lane(group)?)))
    }
}

/// Exact integration of linear memories.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    each: Vec<MemoryWeights>,
    /// Real and imaginary parts of oscillations.
    pairs: Vec<[MemoryWeights; 2]>,
}

/// Weights in y at the end of an interval: of y and of the remembered quantity at the start, and of values on which the
/// course of the remembered quantity depends linearly. Those of an oscillation are the real and the imaginary parts of
/// the weights in z.
#[derive(Debug, Clone, Copy)]
struct MemoryWeights {
    variable: usize,
    /// The stimulus, or the group of the remembered variable times [`LANES`] plus its lane.
    source: usize,
    decay: f64,
    start: f64,
    weights: [f64; LEVELS],
}

impl MemoryWeights {
    /// Computes the weights of the remembered quantities at the `nodes` of an interval of `size` seconds.
    fn each<'a>(memories: &'a [DeclaredMemory], nodes: &'a [f64], size: f64) -> impl Iterator<Item = Self> + 'a {
        // Successive memories with the same time constant have the same weights.
        let mut known = (f64::NAN, 0.0, [0.0; LEVELS]);
        memories.iter().map(move |&DeclaredMemory { variable, source, time, frequency }| {
            let z = size / time;
            if frequency != 0.0 {
                let turning = Complex::new(z, -frequency.abs() * size);
                let part = |value: Complex<f64>| if frequency > 0.0 { value.re } else { value.im };
                let mut weights = [0.0; LEVELS];
                let integrals = relaxed_integral(nodes, turning, 1.0);
                weights.iter_mut().zip(integrals).for_each(|(weight, integral)| *weight = part(integral) * z);
                return Self { variable, source, decay: part((-turning).exp()), start: 0.0, weights };
            }
            if known.0 != time {
                // The integral of x/τ up to the last node.
                known = (time, (-z).exp(), [0.0; LEVELS]);
                known.2[..ORDER].copy_from_slice(&relaxed_integral(nodes, z, 1.0).map(|integral| integral * z));
            }
            let (_, decay, weights) = known;
            Self { variable, source, decay, start: 0.0, weights }
        })
    }
}

impl Memories {
    /// Allocates the memory for a `number` of memories.
    pub fn reserve(&mut self, number: usize) {
        self.clear();
        self.each.reserve(number);
        self.pairs.reserve(number / 2);
    }

    /// Removes all memories.
    fn clear(&mut self) {
        self.each.clear();
        self.pairs.clear();
    }

    /// Appends the memories of a list, in which the parts of oscillations follow those without in pairs.
    fn extend(&mut self, memories: &[DeclaredMemory], mut weights: impl Iterator<Item = MemoryWeights>) {
        let single = memories.iter().take_while(|memory| memory.frequency == 0.0).count();
        self.each.extend(weights.by_ref().take(single));
        while let (Some(real), Some(imaginary)) = (weights.next(), weights.next()) {
            self.pairs.push([real, imaginary]);
        }
    }

    /// Computes the weights of stimuli at the `nodes` of an interval of `size` seconds.
    pub fn set(&mut self, memories: &[DeclaredMemory], nodes: &[f64], size: f64) {
        self.clear();
        self.extend(memories, MemoryWeights::each(memories, nodes, size));
    }

    /// Computes the weights of the forcing of the remembered variables at the `nodes`, with the weights of these
    /// variables in `kernels`.
    pub fn set_of_iterated(&mut self, parts: &Parts, kernels: &[Kernel], nodes: &[f64], size: f64) {
        self.clear();
        let of_nodes = MemoryWeights::each(&parts.of_variables, nodes, size);
        self.extend(
            &parts.of_variables,
            of_nodes.filter_map(|of_nodes| {
                let (group, lane) = parts.lane(of_nodes.source)?;
                let kernel = &kernels[group];
                let mut sum = MemoryWeights { source: group * LANES + lane, weights: [0.0; LEVELS], ..of_nodes };
                for (j, weight) in of_nodes.weights[..ORDER].iter().copied().enumerate() {
                    sum.start += weight * kernel.decay[j][lane];
                    let integrals = sum.weights.iter_mut().zip(kernel.integral[j]);
                    integrals.for_each(|(sum, integral)| *sum += weight * integral[lane]);
                }
                Some(sum)
            }),
        );
    }

    /// Computes the weights of levels from those of nodes, and from the interpolation weights of the levels at the
    /// nodes.
    pub fn interpolate(&mut self, memories: &Self, at_nodes: &[[f64; LEVELS]; ORDER]) {
        self.each.clone_from(&memories.each);
        self.pairs.clone_from(&memories.pairs);
        let from = memories.each.iter().chain(memories.pairs.as_flattened());
        for (memory, from) in self.each.iter_mut().chain(self.pairs.as_flattened_mut()).zip(from) {
            memory.weights = [0.0; LEVELS];
            for (node, at) in from.weights.iter().zip(at_nodes) {
                for (weight, at) in memory.weights.iter_mut().zip(at) {
                    *weight += node * at;
                }
            }
        }
    }

    /// Integrates the memories among the variables `y` of a point. `course` returns what the weights multiply: a
    /// source at the start of the interval, and four values of it.
    #[inline]
    pub fn integrate(&self, y: &mut [f64], course: impl Fn(usize) -> (f64, [f64; LEVELS])) {
        for memory in &self.each {
            let (start, values) = course(memory.source);
            let sum = y[memory.variable] * memory.decay + memory.start * start;
            y[memory.variable] = values.iter().zip(memory.weights).fold(sum, |sum, (x, weight)| sum + weight * x);
        }
        if !self.pairs.is_empty() {
            self.integrate_pairs(y, course);
        }
    }

    /// Integrates the oscillations among the variables `y` of a point.
    #[inline(never)]
    fn integrate_pairs(&self, y: &mut [f64], course: impl Fn(usize) -> (f64, [f64; LEVELS])) {
        for pair in &self.pairs {
            let (start, values) = course(pair[0].source);
            let [p, q] = [0, 1].map(|k| y[pair[k].variable]);
            let decayed = [p * pair[0].decay - q * pair[1].decay, q * pair[0].decay + p * pair[1].decay];
            for (memory, decayed) in pair.iter().zip(decayed) {
                let sum = decayed + memory.start * start;
                y[memory.variable] = values.iter().zip(memory.weights).fold(sum, |sum, (x, weight)| sum + weight * x);
            }
        }
    }
}

#[cfg(test)]
mod tests;
