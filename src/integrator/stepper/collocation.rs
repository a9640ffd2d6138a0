//! Exponential collocation: integration of the laws' variables at one material point over one step.
//!
//! The equation is ẏ = N(y, x(t)) − y/τ, with stimuli x that are polynomials in time. N is collocated at four
//! Lobatto points. The integral of the cubic through them times exp(−t/τ) is exact for every ratio of step to
//! τ. For a memory, N = x/τ is known, and the result is the exact response to x. If N depends on y, the
//! collocation equations are solved by Picard iteration, node by node. If that converges slowly, the interval
//! is halved.

use super::memories::Memories;
use super::relaxation::{Kernel, LANES, Lanes};
use super::{MAX_HALVINGS, ORDER};
use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::lobatto;
use crate::tropism::{Declaration, TropismLaw};

/// Largest number of sweeps over an interval before it is halved. An interval that resolves the nonlinearity
/// well has a contraction by 1/10 in each sweep, and reaches [`TOLERANCE`] in this number of sweeps.
const MAX_SWEEPS: usize = 12;
/// Largest error of a converged variable, relative to its size and its change in the interval: far below any
/// error in time.
const TOLERANCE: f64 = 1e-12;
/// Largest number of halvings in a step, summed over all points and corrections. It permits a variable that is
/// ten thousand times faster than the step at one point, or hundreds of times faster at all points. Laws that
/// cannot be integrated fail within a second.
const MAX_HALVINGS_IN_STEP: usize = 20_000;

/// Weights for one size of interval.
#[derive(Debug, Clone, Default)]
struct Weights {
    size: f64,
    kernels: Vec<Kernel>,
}

/// Group of variables of a point. Unused entries of the last group are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    /// 1/τ.
    inverse: Lanes,
    /// Variables at the start of the interval.
    start: Lanes,
    /// Absolute change of the variables over the interval at the initial rate.
    motion: Lanes,
    /// N at each node.
    forcing: [Lanes; ORDER],
}

impl Group {
    /// Returns the variables at node `j`.
    // Not inlined, so that the operations on one group are vectorised.
    #[inline(never)]
    fn at(&self, j: usize, kernel: &Kernel) -> Lanes {
        let mut value = [0.0; LANES];
        for i in 0..LANES {
            value[i] = kernel.decay[j][i] * self.start[i];
        }
        for l in 0..ORDER {
            for i in 0..LANES {
                value[i] += kernel.integral[j][l][i] * self.forcing[l][i];
            }
        }
        value
    }

    /// Sets N = ẏ + y/τ at node `j`. Returns the largest effect of its change on a variable of the group,
    /// relative to the size and the motion of that variable, since variables may have different units.
    #[inline(never)]
    fn force(&mut self, j: usize, value: &Lanes, rate: &Lanes, kernel: &Kernel) -> f64 {
        let (forcing, mut change) = (&mut self.forcing[j], [0.0; LANES]);
        for i in 0..LANES {
            let new = rate[i] + value[i] * self.inverse[i];
            let motion = kernel.reach[i] * (new - forcing[i]).abs();
            change[i] = motion / (value[i].abs() + self.motion[i] + f64::MIN_POSITIVE);
            forcing[i] = new;
        }
        change.into_iter().fold(0.0, |a, b| if b > a { b } else { a })
    }
}

/// Solver of the collocation equations. It keeps only workspace and weights between calls.
#[derive(Debug, Clone, Default)]
pub(super) struct ExponentialCollocation {
    nodes: Vec<f64>,
    levels: Levels,
    /// Interpolation weights of the stimuli at the nodes of the step.
    at_nodes: [[f64; ORDER]; ORDER],
    /// Number of variables and number of stimuli of a point.
    variables: usize,
    sensed: usize,
    /// Time constants, s.
    constants: Vec<f64>,
    weights: Vec<Weights>,
    /// Whether the last interval of this step converged. Its N is then the initial guess of the next one.
    follows: bool,
    /// Whether all variables are memories of stimuli, which need no iteration.
    remember: bool,
    memories: Memories,
    stimuli: Vec<f64>,
    groups: Vec<Group>,
    /// Variables at each node.
    values: [Vec<Lanes>; ORDER],
    rates: Vec<Lanes>,
    /// Number of halvings since the start of the run.
    pub halvings: usize,
    /// Number of halvings that are left in the present step.
    budget: usize,
}

/// Times of the levels of the stimuli, in units of the step, which starts at 0 and ends at 1.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Levels {
    pub count: usize,
    pub times: [f64; ORDER],
}

impl Levels {
    /// Returns the interpolation weights of the levels at a time.
    fn weights(&self, time: f64) -> [f64; ORDER] {
        let mut weights = [0.0; ORDER];
        lagrange(&self.times[..self.count], time, &mut weights[..self.count]);
        weights
    }
}

impl ExponentialCollocation {
    /// Computes the weights for a step of `size` seconds with stimuli at the given levels.
    pub fn prepare(&mut self, laws: &Declaration, size: f64, levels: Levels) {
        if self.nodes.is_empty() {
            self.nodes = lobatto(ORDER - 1);
            self.weights.resize_with(MAX_HALVINGS + 1, Weights::default);
        }
        (self.levels, self.follows) = (levels, false);
        for (at, c) in self.at_nodes.iter_mut().zip(&self.nodes) {
            *at = levels.weights(*c);
        }
        let constants = || laws.variables().iter().map(|variable| variable.time_constant);
        // The weights of the last step are kept if its size and the time constants were the same.
        let known = self.weights[0].size == size && self.constants.iter().copied().eq(constants());
        if !known {
            self.constants.clear();
            self.constants.extend(constants());
            self.make_room(laws);
            self.fill(0, size);
        }
        self.remember = self.memories.prepare(laws, &self.weights[0].kernels, &self.at_nodes);
    }

    /// Resets the number of halvings for a step and its corrections.
    pub fn begin_step(&mut self) {
        self.budget = MAX_HALVINGS_IN_STEP;
    }

    /// Allocates the workspace of all levels of halving, so that later steps need no allocation.
    fn make_room(&mut self, laws: &Declaration) {
        (self.variables, self.sensed) = (laws.size().variables, laws.size().stimuli);
        self.stimuli.resize(ORDER * self.sensed, 0.0);
        let groups = self.variables.div_ceil(LANES);
        self.groups.clear();
        self.groups.resize(groups, Group::default());
        for (i, tau) in self.constants.iter().enumerate() {
            self.groups[i / LANES].inverse[i % LANES] = 1.0 / tau;
        }
        for numbers in self.values.iter_mut().chain([&mut self.rates]) {
            numbers.clear();
            numbers.resize(groups, [0.0; LANES]);
        }
        for weights in &mut self.weights {
            weights.size = 0.0;
            weights.kernels.clear();
            weights.kernels.resize(groups, Kernel::default());
        }
    }

    /// Computes the weights for intervals of `size` (s), which are halved `depth` times.
    fn fill(&mut self, depth: usize, size: f64) {
        let weights = &mut self.weights[depth];
        weights.size = size;
        for (i, tau) in self.constants.iter().enumerate() {
            weights.kernels[i / LANES].set(i % LANES, &self.nodes, size, *tau);
        }
    }

    /// Integrates the variables `y` of a point over the step, with its stimuli at each level. Returns whether
    /// it succeeded.
    pub fn integrate(&mut self, law: &impl TropismLaw, stimuli: &[&[f64]; ORDER], y: &mut [f64]) -> bool {
        if self.remember {
            self.memories.integrate(&stimuli[..self.levels.count], y);
            return true;
        }
        self.advance(law, stimuli, y, 0.0, 0)
    }

    /// Evaluates the rates at node `j`.
    fn evaluate_rates(&mut self, law: &impl TropismLaw, j: usize) {
        let (v, m) = (self.variables, self.sensed);
        // A rate that a law does not write is NaN.
        let rates = &mut self.rates.as_flattened_mut()[..v];
        rates.fill(f64::NAN);
        law.rates(&self.values[j].as_flattened()[..v], &self.stimuli[j * m..(j + 1) * m], rates);
    }

    /// Sets the initial guess of an interval. N changes as in the last interval that converged in this step, or
    /// is constant.
    fn begin(&mut self, law: &impl TropismLaw, y: &[f64], depth: usize) {
        let follows = std::mem::replace(&mut self.follows, true);
        self.values[0].as_flattened_mut()[..y.len()].copy_from_slice(y);
        self.evaluate_rates(law, 0);
        let groups = self.groups.iter_mut().zip(&self.weights[depth].kernels);
        for ((group, kernel), (value, rate)) in groups.zip(self.values[0].iter().zip(&self.rates)) {
            let mut forcing = [0.0; LANES];
            for i in 0..LANES {
                group.motion[i] = kernel.reach[i] * rate[i].abs();
                forcing[i] = rate[i] + value[i] * group.inverse[i];
            }
            group.start = *value;
            let first = group.forcing[0];
            for at in &mut group.forcing {
                for i in 0..LANES {
                    at[i] = if follows { at[i] + (forcing[i] - first[i]) } else { forcing[i] };
                }
            }
        }
    }

    /// Evaluates the variables at node `j` from N at all nodes.
    #[inline]
    fn integrate_to(&mut self, j: usize, depth: usize) {
        let groups = self.values[j].iter_mut().zip(&self.weights[depth].kernels).zip(&self.groups);
        for ((value, kernel), group) in groups {
            *value = group.at(j, kernel);
        }
    }

    /// Evaluates N at node `j`. Returns the largest relative effect of its change on a variable.
    #[inline]
    fn force(&mut self, law: &impl TropismLaw, j: usize, depth: usize) -> f64 {
        self.evaluate_rates(law, j);
        let mut largest = 0.0;
        let groups = self.groups.iter_mut().zip(&self.weights[depth].kernels);
        for ((group, kernel), (value, rate)) in groups.zip(self.values[j].iter().zip(&self.rates)) {
            let change = group.force(j, value, rate, kernel);
            largest = if change > largest { change } else { largest };
        }
        largest
    }

    /// Integrates the variables `y` over the part [`start`, `start` + 2^−`depth`] of the step, with the stimuli
    /// of a point at each level. Returns whether it succeeded.
    fn advance(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; ORDER],
        y: &mut [f64],
        start: f64,
        depth: usize,
    ) -> bool {
        let m = self.sensed;
        let part = 0.5_f64.powi(depth as i32);
        if self.weights[depth].size == 0.0 {
            self.fill(depth, self.weights[0].size * part);
        }
        for (j, c) in self.nodes.iter().enumerate() {
            // The weights of the whole step are the same for all points. Parts of the step are rare.
            let at = if depth == 0 { self.at_nodes[j] } else { self.levels.weights(start + part * c) };
            let sensed = &mut self.stimuli[j * m..(j + 1) * m];
            sensed.fill(0.0);
            for (stimuli, weight) in stimuli[..self.levels.count].iter().zip(at) {
                for (x, stimulus) in sensed.iter_mut().zip(*stimuli) {
                    *x += weight * stimulus;
                }
            }
        }
        self.begin(law, y, depth);
        if self.sweep(law, depth) {
            y.copy_from_slice(&self.values[ORDER - 1].as_flattened()[..y.len()]);
            return true;
        }
        // Values that did not converge may be NaN, and are not used as an initial guess.
        self.follows = false;
        if depth == MAX_HALVINGS || self.budget == 0 {
            return false;
        }
        self.budget -= 1;
        self.halvings += 1;
        self.advance(law, stimuli, y, start, depth + 1) && self.advance(law, stimuli, y, start + 0.5 * part, depth + 1)
    }

    /// Iterates from the initial guess of N at all nodes. Returns whether the iteration converged.
    fn sweep(&mut self, law: &impl TropismLaw, depth: usize) -> bool {
        // The contraction of the sweeps may alternate between large and small if two variables depend on each other.
        let (mut last, mut last_ratio, mut known) = (f64::INFINITY, 0.0_f64, false);
        for _ in 0..MAX_SWEEPS {
            let mut change = 0.0_f64;
            // Each node uses the new values at the nodes before it (Gauss–Seidel).
            for j in 1..ORDER {
                self.integrate_to(j, depth);
                change = change.max(self.force(law, j, depth));
            }
            if change == f64::INFINITY {
                break;
            }
            // The error estimate is the expected next change, by the slower contraction of the last two sweeps.
            let ratio = change / last;
            let next = change * ratio.max(last_ratio);
            if change <= TOLERANCE || (known && next <= TOLERANCE) {
                self.integrate_to(ORDER - 1, depth);
                return self.values[ORDER - 1].as_flattened().iter().all(|y| y.is_finite());
            }
            known = last.is_finite();
            (last, last_ratio) = (change, ratio);
        }
        false
    }
}

#[cfg(test)]
mod tests;
