//! Exponential collocation: integration of the laws' variables at one material point over one step.
//!
//! The equation is ẏ = N(y, x(t)) − y/τ, with stimuli x that are polynomials in time, or a
//! polynomial and a transient. N is collocated at four Lobatto points. The integral of the cubic
//! through them times exp(−t/τ) is exact for every ratio of step to τ. For a memory, N = x/τ is
//! known, and the result is the exact response to x. If N depends on y, the collocation equations
//! are solved by Picard iteration, node by node. If that converges slowly, the interval is halved.
//! Memories on which no other rate depends are integrated after it.

use super::memories::{Memories, Parts};
use super::picard::Picard;
use super::relaxation::Kernel;
use super::{MAX_HALVINGS, ORDER};
use crate::numerics::interpolation::{lagrange, lagrange_with_transient};
use crate::numerics::quadrature::lobatto;
use crate::state::LEVELS;
use crate::tropism::{Declaration, TropismLaw};

/// Largest number of halvings in a step, summed over all points and corrections. It permits a
/// variable that is ten thousand times faster than the step at one point, or hundreds of times
/// faster at all points. Laws that cannot be integrated fail within a second.
const MAX_HALVINGS_IN_STEP: usize = 20_000;

/// Weights for one size of interval.
#[derive(Debug, Clone, Default)]
struct Weights {
    size: f64,
    /// Weights of the iterated variables, in groups.
    kernels: Vec<Kernel>,
    /// Weights of the memories of iterated variables.
    memories: Memories,
}

/// Solver of the collocation equations. It keeps only workspace and weights between calls.
#[derive(Debug, Clone, Default)]
pub(super) struct ExponentialCollocation {
    nodes: Vec<f64>,
    levels: Levels,
    /// Interpolation weights of the stimuli at the nodes of the step.
    at_nodes: [[f64; LEVELS]; ORDER],
    /// The level at each node of the step that is at the time of a level.
    level_at: [Option<usize>; ORDER],
    /// The variables for which the weights hold.
    parts: Parts,
    weights: Vec<Weights>,
    /// Memories of stimuli over the whole step, with weights of the stimuli at the nodes.
    at_nodes_memories: Memories,
    /// The same with weights of the stimuli at the levels.
    memories: Memories,
    /// Stimuli at the nodes of an interval.
    stimuli: Vec<f64>,
    picard: Picard,
    /// Number of halvings that the caller has not counted yet.
    pub halvings: usize,
    /// Number of halvings that are left in the present step.
    budget: usize,
}

/// Times of the levels of the stimuli: in units of the step, which starts at 0 and ends at 1, or in
/// s.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Levels {
    pub count: usize,
    /// Times of the levels. Entries from `count` on are not used.
    pub times: [f64; LEVELS],
    /// Time constant of the transient in the stimuli, in the same unit.
    pub transient: Option<f64>,
}

impl Levels {
    /// Returns the interpolation weights of the levels at a time.
    pub fn weights(&self, time: f64) -> [f64; LEVELS] {
        match self.transient {
            Some(tau) => lagrange_with_transient(&self.times[..self.count], tau, time),
            None => lagrange(&self.times[..self.count], time),
        }
    }
}

impl ExponentialCollocation {
    /// Computes the weights for a step of `size` seconds with stimuli at the given levels.
    pub fn prepare(&mut self, laws: &Declaration, size: f64, levels: Levels) {
        if self.nodes.is_empty() {
            self.nodes = lobatto(ORDER - 1);
            self.weights.resize_with(MAX_HALVINGS + 1, Weights::default);
        }
        self.levels = levels;
        for (j, c) in self.nodes.iter().enumerate() {
            self.at_nodes[j] = levels.weights(*c);
            self.level_at[j] = levels.times[..levels.count]
                .iter()
                .position(|time| time == c);
        }
        // The weights of the last step are kept if its size and the variables were the same.
        let same = self.parts.read(laws);
        if !(same && self.weights[0].size == size) {
            self.make_room(laws);
            self.fill(0, size);
        }
        self.memories
            .interpolate(&self.at_nodes_memories, &self.at_nodes);
        self.picard.begin_step();
    }

    /// Resets the number of halvings for a step and its corrections.
    pub fn begin_step(&mut self) {
        self.budget = MAX_HALVINGS_IN_STEP;
    }

    /// Allocates the workspace of all levels of halving, so that later steps need no allocation.
    fn make_room(&mut self, laws: &Declaration) {
        self.stimuli.resize(ORDER * laws.size().stimuli, 0.0);
        self.picard.set(laws.size().variables, &self.parts);
        for weights in &mut self.weights {
            weights.size = 0.0;
            weights.kernels.clear();
            weights
                .kernels
                .resize(self.parts.groups().count(), Kernel::default());
            weights.memories.reserve(self.parts.of_variables.len());
        }
    }

    /// Computes the weights for intervals of `size` (s), which are halved `depth` times.
    fn fill(&mut self, depth: usize, size: f64) {
        let weights = &mut self.weights[depth];
        weights.size = size;
        for (kernel, group) in weights.kernels.iter_mut().zip(self.parts.groups()) {
            for (lane, iterated) in group.iter().enumerate() {
                match group[..lane]
                    .iter()
                    .position(|other| other.time == iterated.time)
                {
                    Some(same) => kernel.repeat(lane, same),
                    None => kernel.set(lane, &self.nodes, size, iterated.time),
                }
            }
        }
        weights
            .memories
            .set_of_iterated(&self.parts, &weights.kernels, &self.nodes, size);
        if depth == 0 {
            self.at_nodes_memories
                .set(&self.parts.of_stimuli, &self.nodes, size);
        }
    }

    /// Integrates the variables `y` of a point over the step, with its stimuli at each level and
    /// the `rates` at the start. Returns whether it succeeded.
    #[inline]
    pub fn integrate(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; LEVELS],
        y: &mut [f64],
        rates: &[f64],
    ) -> bool {
        // Levels that do not exist have the weight zero.
        let last = self.levels.count - 1;
        self.memories.integrate(y, |source| {
            (
                0.0,
                std::array::from_fn(|level| stimuli[level.min(last)][source]),
            )
        });
        self.parts.iterated.is_empty() || self.advance(law, stimuli, (y, Some(rates)), 0.0, 0)
    }

    /// Integrates the iterated variables among `y`, and their memories, over the part [`start`,
    /// `start` + 2^−`depth`] of the step, with the stimuli of a point at each level, and the rates
    /// at the start if they are known. Returns whether it succeeded.
    fn advance(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; LEVELS],
        (y, rates): (&mut [f64], Option<&[f64]>),
        start: f64,
        depth: usize,
    ) -> bool {
        let part = 0.5_f64.powi(depth as i32);
        if self.weights[depth].size == 0.0 {
            self.fill(depth, self.weights[0].size * part);
        }
        let (count, m) = (self.levels.count, stimuli[0].len());
        let mut sensed = [&[][..]; ORDER];
        for (j, (sensed, to)) in sensed
            .iter_mut()
            .zip(self.stimuli.chunks_exact_mut(m.max(1)))
            .enumerate()
        {
            // The weights of the whole step are the same for all points. Parts of the step are
            // rare.
            let (at, level) = match depth {
                0 => (self.at_nodes[j], self.level_at[j]),
                _ => (self.levels.weights(start + part * self.nodes[j]), None),
            };
            if let Some(level) = level {
                *sensed = stimuli[level];
                continue;
            }
            // Levels that do not exist have the weight zero.
            let [first, second, third, fourth, fifth] =
                std::array::from_fn(|level| stimuli[level.min(count - 1)]);
            let rows = first.iter().zip(second).zip(third).zip(fourth).zip(fifth);
            for (x, ((((x0, x1), x2), x3), x4)) in to.iter_mut().zip(rows) {
                *x = at[0] * x0 + at[1] * x1 + at[2] * x2 + at[3] * x3 + at[4] * x4;
            }
            *sensed = to;
        }
        let Weights {
            kernels, memories, ..
        } = &self.weights[depth];
        self.picard.begin(law, &sensed, (y, rates), kernels);
        if self.picard.sweep(law, &sensed, y, kernels) {
            memories.integrate(y, |source| self.picard.course(source));
            return true;
        }
        if depth == MAX_HALVINGS || self.budget == 0 {
            return false;
        }
        self.budget -= 1;
        self.halvings += 1;
        self.advance(law, stimuli, (y, rates), start, depth + 1)
            && self.advance(law, stimuli, (y, None), start + 0.5 * part, depth + 1)
    }
}

#[cfg(test)]
mod tests;
