//! Linear memories of stimuli, τ ẏ = x − y, and damped oscillations ż = (x − z)/τ + iωz. Their
//! exact solution over a step is a sum with constant weights.

use nalgebra::Complex;

use super::ORDER;
use super::relaxation::{Kernel, LANES, relaxed_integral};
use crate::state::LEVELS;
use crate::tropism::{Declaration, Source, Variable};

/// A variable in one of the parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    /// Place among the variables.
    pub variable: usize,
    /// Place of what a memory remembers, among the stimuli or among the variables. For an iterated
    /// variable, the place of the stimulus that it approaches, or `usize::MAX` if it approaches
    /// none.
    pub source: usize,
    /// Time constant, s.
    pub time: f64,
    /// Angular frequency ω (rad/s) of the oscillation of which it is the real part, −ω of the
    /// imaginary part, zero of others.
    frequency: f64,
}

/// Variables of a point in three parts, in the order of their integration.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    /// The variables that are divided into the parts.
    variables: Vec<Variable>,
    /// Memories of stimuli, which are integrated first.
    pub of_stimuli: Vec<Member>,
    /// Variables that depend on each other in an undeclared way.
    pub iterated: Vec<Member>,
    /// Memories of iterated variables, which are integrated last.
    pub of_variables: Vec<Member>,
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
        let computes = variables
            .iter()
            .any(|variable| variable.remembers == Source::Computed);
        // Memories on which an iterated variable may depend, or another memory does, are iterated.
        let is_read = |i: usize, variable: &Variable| {
            let read = |i| {
                variables
                    .iter()
                    .any(|other| other.remembers == Source::Variable(i))
            };
            read(i)
                || variable.turns.is_some_and(|(_, other)| read(other))
                || variable.coupled && computes
        };
        for (i, variable) in variables.iter().enumerate() {
            let frequency = variable.turns.map_or(0.0, |(frequency, _)| frequency);
            let memory = |source| Member {
                variable: i,
                source,
                time: variable.time_constant,
                frequency,
            };
            match variable.remembers {
                Source::Stimulus(source) if !is_read(i, variable) => {
                    self.of_stimuli.push(memory(source))
                }
                Source::Variable(source) if !is_read(i, variable) => {
                    self.of_variables.push(memory(source))
                }
                _ => {
                    let of = |source| {
                        if let Source::Stimulus(k) = source {
                            Some(k)
                        } else {
                            None
                        }
                    };
                    let source = of(variable.approaches).or(of(variable.remembers));
                    self.iterated.push(memory(source.unwrap_or(usize::MAX)));
                }
            }
        }
        // Oscillations come last, each as its real part and its imaginary part.
        let place = |memory: &Member| match variables[memory.variable].turns {
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
    pub fn groups(&self) -> impl Iterator<Item = &[Member]> {
        self.iterated
            .chunk_by(|a, b| a.variable + 1 == b.variable)
            .flat_map(|run| run.chunks(LANES))
    }

    /// The group of a variable and its lane, if it is iterated.
    fn lane(&self, variable: usize) -> Option<(usize, usize)> {
        let lane = |group: &[Member]| group.iter().position(|each| each.variable == variable);
        self.groups()
            .enumerate()
            .find_map(|(i, group)| Some((i, lane(group)?)))
    }
}

/// Exact integration of linear memories.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    /// Weights of all memories. Oscillations come last, each as its real part and its imaginary
    /// part.
    each: Vec<MemoryWeights>,
    /// Number of memories that are no oscillations.
    single: usize,
}

/// Weights in y at the end of an interval: of y and of the remembered quantity at the start, and of
/// values on which the course of the remembered quantity depends linearly. Those of an oscillation
/// are the real and the imaginary parts of the weights in z.
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
    /// Computes the weights of the remembered quantities at the `nodes` of an interval of `size`
    /// seconds.
    fn each<'a>(
        memories: &'a [Member],
        nodes: &'a [f64],
        size: f64,
    ) -> impl Iterator<Item = Self> + 'a {
        // Successive memories with the same time constant have the same weights.
        let mut known = (f64::NAN, 0.0, [0.0; LEVELS]);
        memories.iter().map(
            move |&Member {
                      variable,
                      source,
                      time,
                      frequency,
                  }| {
                let z = size / time;
                if frequency != 0.0 {
                    let turning = Complex::new(z, -frequency.abs() * size);
                    let part =
                        |value: Complex<f64>| if frequency > 0.0 { value.re } else { value.im };
                    let mut weights = [0.0; LEVELS];
                    weights[..ORDER].copy_from_slice(
                        &relaxed_integral(nodes, turning, 1.0).map(|value| part(value) * z),
                    );
                    return Self {
                        variable,
                        source,
                        decay: part((-turning).exp()),
                        start: 0.0,
                        weights,
                    };
                }
                if known.0 != time {
                    // The integral of x/τ up to the last node.
                    known = (time, (-z).exp(), [0.0; LEVELS]);
                    known.2[..ORDER].copy_from_slice(
                        &relaxed_integral(nodes, z, 1.0).map(|integral| integral * z),
                    );
                }
                let (_, decay, weights) = known;
                Self {
                    variable,
                    source,
                    decay,
                    start: 0.0,
                    weights,
                }
            },
        )
    }
}

impl Memories {
    /// Allocates the memory for a `number` of memories.
    pub fn reserve(&mut self, number: usize) {
        self.single = 0;
        self.each.clear();
        self.each.reserve(number);
    }

    /// Replaces the memories by those of a list, in which the parts of oscillations follow the
    /// others in pairs.
    fn replace(&mut self, memories: &[Member], weights: impl Iterator<Item = MemoryWeights>) {
        self.each.clear();
        self.each.extend(weights);
        let single = memories
            .iter()
            .take_while(|memory| memory.frequency == 0.0)
            .count();
        self.single = single.min(self.each.len());
    }

    /// Computes the weights of stimuli at the `nodes` of an interval of `size` seconds.
    pub fn set(&mut self, memories: &[Member], nodes: &[f64], size: f64) {
        self.replace(memories, MemoryWeights::each(memories, nodes, size));
    }

    /// Computes the weights of the forcing of the remembered variables at the `nodes`, with the
    /// weights of these variables in `kernels`.
    pub fn set_of_iterated(&mut self, parts: &Parts, kernels: &[Kernel], nodes: &[f64], size: f64) {
        let of_forcing = |of_nodes: MemoryWeights| {
            let (group, lane) = parts.lane(of_nodes.source)?;
            let kernel = &kernels[group];
            let mut sum = MemoryWeights {
                source: group * LANES + lane,
                weights: [0.0; LEVELS],
                ..of_nodes
            };
            for (j, weight) in of_nodes.weights[..ORDER].iter().copied().enumerate() {
                sum.start += weight * kernel.decay[j][lane];
                let integrals = sum.weights.iter_mut().zip(kernel.integral[j]);
                integrals.for_each(|(sum, integral)| *sum += weight * integral[lane]);
            }
            Some(sum)
        };
        let memories = &parts.of_variables;
        self.replace(
            memories,
            MemoryWeights::each(memories, nodes, size).filter_map(of_forcing),
        );
    }

    /// Computes the weights of levels from those of nodes, and from the interpolation weights of
    /// the levels at the nodes.
    pub fn interpolate(&mut self, memories: &Self, at_nodes: &[[f64; LEVELS]; ORDER]) {
        self.each.clone_from(&memories.each);
        self.single = memories.single;
        for memory in &mut self.each {
            let of_nodes = std::mem::take(&mut memory.weights);
            for (node, at) in of_nodes.iter().zip(at_nodes) {
                memory
                    .weights
                    .iter_mut()
                    .zip(at)
                    .for_each(|(weight, at)| *weight += node * at);
            }
        }
    }

    /// Integrates the memories among the variables `y` of a point. `course` returns what the
    /// weights multiply: a source at the start of the interval, and four values of it.
    #[inline]
    pub fn integrate(&self, y: &mut [f64], course: impl Fn(usize) -> (f64, [f64; LEVELS])) {
        let (single, pairs) = self.each.split_at(self.single);
        for memory in single {
            let (start, values) = course(memory.source);
            let sum = y[memory.variable] * memory.decay + memory.start * start;
            y[memory.variable] = values
                .iter()
                .zip(memory.weights)
                .fold(sum, |sum, (x, weight)| sum + weight * x);
        }
        if !pairs.is_empty() {
            Self::integrate_pairs(pairs.as_chunks().0, y, course);
        }
    }

    /// Integrates the oscillations among the variables `y` of a point.
    #[inline(never)]
    fn integrate_pairs(
        pairs: &[[MemoryWeights; 2]],
        y: &mut [f64],
        course: impl Fn(usize) -> (f64, [f64; LEVELS]),
    ) {
        for pair in pairs {
            let (start, values) = course(pair[0].source);
            let [p, q] = [0, 1].map(|k| y[pair[k].variable]);
            let decayed = [
                p * pair[0].decay - q * pair[1].decay,
                q * pair[0].decay + p * pair[1].decay,
            ];
            for (memory, decayed) in pair.iter().zip(decayed) {
                let sum = decayed + memory.start * start;
                y[memory.variable] = values
                    .iter()
                    .zip(memory.weights)
                    .fold(sum, |sum, (x, weight)| sum + weight * x);
            }
        }
    }
}

#[cfg(test)]
mod tests;
