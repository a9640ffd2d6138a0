//! Linear memories of stimuli, τ ẏ = x − y, and damped oscillations ż = (x − z)/τ + iωz. Their exact solution over a
//! step is a sum with constant weights.

use nalgebra::Complex;

use super::ORDER;
use super::relaxation::{Kernel, LANES, relaxed_integral};
use crate::error::ParameterError;
use crate::state::LEVELS;
use crate::tropism::{Declaration, Source, Variable, is_memory_rate};

/// Memory of a stimulus or of another variable.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remembered {
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
    of_stimuli: Vec<Remembered>,
    /// Variables that depend on each other in an undeclared way.
    iterated: Vec<Iterated>,
    of_variables: Vec<Remembered>,
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
            let memory = |source| Remembered { variable: i, source, time: variable.time_constant, frequency };
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
        let place = |memory: &Remembered| match variables[memory.variable].turns {
            Some((frequency, _)) if frequency > 0.0 => (memory.variable + 1, 0),
            Some((_, other)) => (other + 1, 1),
            None => (0, memory.variable),
        };
        for list in [&mut self.of_stimuli, &mut self.of_variables] {
            list.sort_by_key(place);
        }
        false
    }

    /// Memories of stimuli, which are integrated first.
    pub fn of_stimuli(&self) -> &[Remembered] {
        &self.of_stimuli
    }

    /// Variables that are iterated.
    pub fn iterated(&self) -> &[Iterated] {
        &self.iterated
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

    /// Memories of iterated variables, which are integrated last.
    pub fn of_variables(&self) -> &[Remembered] {
        &self.of_variables
    }
}

/// Exact integration of linear memories.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    each: Vec<Memory>,
    /// Number of memories without oscillation. The parts of oscillations follow in pairs.
    single: usize,
}

/// Weights in y at the end of an interval: of y and of the remembered quantity at the start, and of values on which the
/// course of the remembered quantity depends linearly. Those of an oscillation are the real and the imaginary parts of
/// the weights in z.
#[derive(Debug, Clone, Copy)]
struct Memory {
    variable: usize,
    /// The stimulus, or the group of the remembered variable times [`LANES`] plus its lane.
    source: usize,
    decay: f64,
    start: f64,
    weights: [f64; LEVELS],
}

impl Memory {
    /// Computes the weights of the remembered quantities at the `nodes` of an interval of `size` seconds.
    fn each<'a>(memories: &'a [Remembered], nodes: &'a [f64], size: f64) -> impl Iterator<Item = Self> + 'a {
        // Successive memories with the same time constant have the same weights.
        let mut known = (f64::NAN, 0.0, [0.0; LEVELS]);
        memories.iter().map(move |&Remembered { variable, source, time, frequency }| {
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
        self.each.clear();
        self.each.reserve(number);
    }

    /// Computes the weights of stimuli at the `nodes` of an interval of `size` seconds.
    pub fn set(&mut self, memories: &[Remembered], nodes: &[f64], size: f64) {
        self.each.clear();
        self.each.extend(Memory::each(memories, nodes, size));
        self.single = singles(memories);
    }

    /// Computes the weights of the forcing of the remembered variables at the `nodes`, with the weights of these
    /// variables in `kernels`.
    pub fn set_of_iterated(&mut self, parts: &Parts, kernels: &[Kernel], nodes: &[f64], size: f64) {
        self.each.clear();
        self.single = singles(&parts.of_variables);
        for of_nodes in Memory::each(&parts.of_variables, nodes, size) {
            let Some((group, lane)) = parts.lane(of_nodes.source) else { continue };
            let kernel = &kernels[group];
            let mut sum = Memory { source: group * LANES + lane, weights: [0.0; LEVELS], ..of_nodes };
            for (j, weight) in of_nodes.weights[..ORDER].iter().copied().enumerate() {
                sum.start += weight * kernel.decay[j][lane];
                sum.weights
                    .iter_mut()
                    .zip(kernel.integral[j])
                    .for_each(|(sum, integral)| *sum += weight * integral[lane]);
            }
            self.each.push(sum);
        }
    }

    /// Computes the weights of levels from those of nodes, and from the interpolation weights of the levels at the
    /// nodes.
    pub fn interpolate(&mut self, memories: &Self, at_nodes: &[[f64; LEVELS]; ORDER]) {
        self.each.clone_from(&memories.each);
        self.single = memories.single;
        for (memory, from) in self.each.iter_mut().zip(&memories.each) {
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
        let (single, oscillations) = self.each.split_at(self.single.min(self.each.len()));
        for memory in single {
            let (start, values) = course(memory.source);
            let sum = y[memory.variable] * memory.decay + memory.start * start;
            y[memory.variable] = values.iter().zip(memory.weights).fold(sum, |sum, (x, weight)| sum + weight * x);
        }
        for pair in oscillations.chunks_exact(2) {
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

/// Number of memories without oscillation, which come first.
fn singles(memories: &[Remembered]) -> usize {
    memories.iter().take_while(|memory| memory.frequency == 0.0).count()
}

/// Declared memories: their places among the variables, what they remember, and their time constants (s).
#[derive(Debug, Clone, Default)]
pub(super) struct Declared {
    single: Vec<(usize, Source, f64)>,
    /// Variables of oscillations, with the signed angular frequency (rad/s) and the place of the other variable.
    turning: Vec<(usize, Source, f64, (f64, usize))>,
}

impl Declared {
    /// Lists the memories that the laws declare.
    pub fn read(&mut self, laws: &Declaration) {
        self.single.clear();
        self.turning.clear();
        for (i, variable) in laws.variables().iter().enumerate() {
            let (source, time) = (variable.remembers, variable.time_constant);
            match variable.turns {
                _ if source == Source::Computed => (),
                None => self.single.push((i, source, time)),
                Some(turns) => self.turning.push((i, source, time, turns)),
            }
        }
    }

    /// Returns an error unless the rates of a point are those of the memories.
    #[inline]
    pub fn check(&self, variables: &[f64], rates: &[f64], stimuli: &[f64]) -> Result<(), ParameterError> {
        let check = |i: usize, source: Source, time: f64, turns: Option<(f64, f64)>| {
            let y = variables[i];
            let x = match source {
                Source::Stimulus(k) => stimuli[k],
                Source::Variable(k) => variables[k],
                Source::Computed => return Ok(()),
            };
            let linear = is_memory_rate(rates[i], [x, y], time, turns);
            let name = "time constant times the rate of a variable that is declared a memory";
            let requirement = "the remembered quantity minus the variable: `rates` contradicts `declare`";
            ParameterError::unless(linear, name, rates[i] * time, requirement)
        };
        for &(i, source, time) in &self.single {
            check(i, source, time, None)?;
        }
        for &(i, source, time, (frequency, other)) in &self.turning {
            check(i, source, time, Some((frequency, variables[other])))?;
        }
        Ok(())
    }
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
        let mut at_nodes = [[0.0; LEVELS]; ORDER];
        for (at, node) in at_nodes.iter_mut().zip(&nodes) {
            lagrange(&[-2.0, -1.0, 0.0, 1.0], *node, &mut at[..4]);
        }
        let (mut parts, mut of_nodes, mut memories) = (Parts::default(), Memories::default(), Memories::default());
        assert!(!parts.read(&laws()) && parts.read(&laws()), "only the second call finds them known");
        of_nodes.set(parts.of_stimuli(), &nodes, size);
        memories.interpolate(&of_nodes, &at_nodes);
        let lines = [|t: f64| 4.0 - t, |t: f64| 1.0 + 2.0 * t];
        let stimuli = [-2.0, -1.0, 0.0, 1.0, 0.0].map(|time| lines.map(|x| x(time * size)));
        let mut y = [-1.0, 7.0];
        memories.integrate(&mut y, |source| (0.0, stimuli.map(|stimuli| stimuli[source])));
        // x = a + b t gives y = a + b (t − τ) + C exp(−t/τ).
        let exact =
            |a: f64, b: f64, tau: f64, start: f64| a + b * (size - tau) + (start - a + b * tau) * (-size / tau).exp();
        // Rounding of sums of a few numbers below ten.
        assert_abs_diff_eq!(y[0], exact(1.0, 2.0, TAUS[0], -1.0), epsilon = 1e-14);
        assert_abs_diff_eq!(y[1], exact(4.0, -1.0, TAUS[1], 7.0), epsilon = 1e-14);
    }

    /// Numbers of memories of stimuli, of iterated variables, and of memories of these.
    fn parts(laws: &Declaration) -> [usize; 3] {
        let mut parts = Parts::default();
        parts.read(laws);
        [parts.of_stimuli().len(), parts.iterated().len(), parts.of_variables().len()]
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
        let places = |group: &[Iterated]| group.iter().map(|each| each.variable).collect();
        let groups: Vec<Vec<usize>> = parts.groups().map(places).collect();
        assert_eq!(groups, [vec![0, 1, 2], vec![4, 5, 6, 7], vec![8, 9]]);
        assert_eq!([2, 3, 7, 9].map(|variable| parts.lane(variable)), [Some((0, 2)), None, Some((1, 3)), Some((2, 1))]);
    }

    #[test]
    fn declared_memories_are_accepted_up_to_rounding_of_their_rates() {
        let (y, x) = ([0.3, -2.0], [0.7, 1.1]);
        let rates = [(x[1] - y[0]) / TAUS[0], (x[0] - y[1]) / TAUS[1]];
        let mut declared = Declared::default();
        declared.read(&laws());
        assert!(declared.check(&y, &rates, &x).is_ok());
        for k in 0..2 {
            for share in [1e-13, f64::NAN] {
                let mut wrong = rates;
                wrong[k] *= 1.0 + share;
                assert!(declared.check(&y, &wrong, &x).is_err(), "rate {k} changed by {share}");
            }
        }
    }
}
