//! The variables at one material point over one step, driven by stimuli that are polynomials in time: exponential
//! collocation.
//!
//! ẏ = N(y, x(t)) − y/τ with the relaxation −y/τ treated exactly: N is collocated on four Lobatto points and its integral
//! against exp(−t/τ) is exact for the cubic through them, at any ratio of step to τ. For a memory, where N = x/τ is known,
//! the answer is the exact response to x. Where N depends on y the collocation equations are solved by Picard's
//! iteration, node after node; if that does not contract fast, the interval is halved.

use nalgebra::{Matrix4, Vector4};

use super::ORDER;
use crate::quadrature::{lagrange, lobatto, rule};
use crate::tropism::{Declaration, TropismLaw};

/// Collocation points: the stimuli are polynomials through as many levels.
const NODES: usize = ORDER;
/// Sweeps after which an interval is halved: a contraction by 1/10 a sweep reaches the tolerance in them, and means that
/// the nonlinearity is well resolved.
const SWEEPS: usize = 12;
/// Change in a sweep, relative to the largest variable, that ends the iteration: below any error in time by far.
const TOLERANCE: f64 = 1e-12;
/// Halvings after which it is given up.
const DEPTH: usize = 40;

/// Halvings in a step of one point after which it is given up: enough to follow a variable ten thousand times faster than
/// the step, and an end for laws that cannot be followed.
const BUDGET: usize = 20_000;

/// Weights that belong to one size of interval.
#[derive(Debug, Clone, Default)]
struct Weights {
    size: f64,
    variables: Vec<Kernel>,
}

/// The weights of one variable.
#[derive(Debug, Clone, Copy, Default)]
struct Kernel {
    /// exp(−c δ/τ) at every node.
    decay: [f64; NODES],
    /// ∫ from 0 to node j of exp(−(cj − c) δ/τ) × polynomial l, times δ.
    integral: [[f64; NODES]; NODES],
}

/// Solves for the variables; keeps nothing between calls but workspace and weights.
#[derive(Debug, Clone, Default)]
pub(super) struct ExponentialCollocation {
    nodes: Vec<f64>,
    levels: Levels,
    /// Interpolation weights of the stimuli at the nodes of the whole step.
    at_nodes: [[f64; ORDER]; NODES],
    /// Stimuli of a point.
    sensed: usize,
    constants: Vec<f64>,
    /// 1/τ.
    inverse: Vec<f64>,
    weights: Vec<Weights>,
    stimuli: Vec<f64>,
    forcing: Vec<f64>,
    values: Vec<f64>,
    rates: Vec<f64>,
    first_rates: Vec<f64>,
    /// Intervals that had to be halved since this was last set to zero.
    pub halvings: usize,
    /// Intervals that may still be halved for the present point.
    budget: usize,
}

/// The times of a few levels of stimuli; time counts in steps, 0 the start of the present one and 1 its end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Levels {
    pub count: usize,
    pub times: [f64; ORDER],
}

impl Levels {
    /// Interpolation weights at a time.
    fn weights(&self, time: f64) -> [f64; ORDER] {
        let mut weights = [0.0; ORDER];
        lagrange(&self.times[..self.count], time, &mut weights[..self.count]);
        weights
    }
}

impl ExponentialCollocation {
    /// Prepares for a step of `size` seconds with stimuli at the given levels.
    pub fn prepare(&mut self, laws: &Declaration, size: f64, levels: Levels) {
        if self.nodes.is_empty() {
            self.nodes = lobatto(NODES - 1);
            self.weights.resize_with(DEPTH + 1, Weights::default);
        }
        self.levels = levels;
        for (at, c) in self.at_nodes.iter_mut().zip(&self.nodes) {
            *at = levels.weights(*c);
        }
        let v = laws.size().variables;
        let constants = || laws.variables().iter().map(|variable| variable.time_constant);
        // Weights belong to a size of step and to the laws' time constants.
        let known = self.weights[0].size == size && self.constants.iter().copied().eq(constants());
        self.constants.clear();
        self.constants.extend(constants());
        self.inverse.clear();
        self.inverse.extend(self.constants.iter().map(|tau| 1.0 / tau));
        self.sensed = laws.size().stimuli;
        self.stimuli.resize(NODES * self.sensed, 0.0);
        self.rates.resize(v, 0.0);
        self.forcing.resize(NODES * v, 0.0);
        self.values.resize(NODES * v, 0.0);
        self.first_rates.resize(v, 0.0);
        if !known {
            for weights in &mut self.weights {
                weights.size = 0.0;
                // Room now, so that no later step allocates when it first halves its interval.
                weights.variables.resize(v, Kernel::default());
            }
            self.fill(0, size);
        }
    }

    fn fill(&mut self, depth: usize, size: f64) {
        let weights = &mut self.weights[depth];
        weights.size = size;
        for (kernel, tau) in weights.variables.iter_mut().zip(&self.constants) {
            let z = size / tau;
            for (j, c) in self.nodes.iter().enumerate() {
                kernel.decay[j] = (-c * z).exp();
                kernel.integral[j] = relaxed_integral(&self.nodes, z, *c).map(|w| w * size);
            }
        }
    }

    /// Evaluates N = ẏ + y/τ at node `j`.
    fn force(&mut self, law: &impl TropismLaw, j: usize) {
        let (v, m) = (self.constants.len(), self.sensed);
        let values = &self.values[j * v..(j + 1) * v];
        // What a law does not write is not a number, whatever stood there before.
        self.rates.fill(f64::NAN);
        law.rates(values, &self.stimuli[j * m..(j + 1) * m], &mut self.rates);
        if j == 0 {
            self.first_rates.copy_from_slice(&self.rates);
        }
        for i in 0..v {
            self.forcing[j * v + i] = self.rates[i] + values[i] * self.inverse[i];
        }
    }

    /// Carries the variables `y` of a point over the step, under its stimuli at every level. Returns whether it succeeded.
    pub fn carry(&mut self, law: &impl TropismLaw, stimuli: &[&[f64]; ORDER], y: &mut [f64]) -> bool {
        self.budget = BUDGET;
        self.advance(law, stimuli, y, 0.0, 0)
    }

    /// Carries the variables `y` over the part [`start`, `start` + 2^−`depth`] of the step, under the stimuli of a point
    /// at every level. Returns whether it succeeded.
    fn advance(
        &mut self,
        law: &impl TropismLaw,
        stimuli: &[&[f64]; ORDER],
        y: &mut [f64],
        start: f64,
        depth: usize,
    ) -> bool {
        let (v, m) = (self.constants.len(), self.sensed);
        let part = 0.5_f64.powi(depth as i32);
        if self.weights[depth].size == 0.0 {
            self.fill(depth, self.weights[0].size * part);
        }
        for (j, c) in self.nodes.iter().enumerate() {
            // The whole step is the same for every point; parts of it are rare.
            let at = if depth == 0 { self.at_nodes[j] } else { self.levels.weights(start + part * c) };
            for (i, x) in self.stimuli[j * m..(j + 1) * m].iter_mut().enumerate() {
                *x = (0..self.levels.count).map(|k| at[k] * stimuli[k][i]).sum();
            }
        }
        // The first guess goes on at the first rates; the forcing at the first node stays for all sweeps.
        self.values[..v].copy_from_slice(y);
        self.force(law, 0);
        for j in 1..NODES {
            let time = self.nodes[j] * self.weights[depth].size;
            for i in 0..v {
                self.values[j * v + i] = y[i] + time * self.first_rates[i];
            }
            self.force(law, j);
        }
        for _ in 0..SWEEPS {
            let (mut converged, mut finite) = (true, true);
            // Each node uses what the ones before it have become in this sweep.
            for j in 1..NODES {
                let weights = &self.weights[depth];
                for i in 0..v {
                    let kernel = &weights.variables[i];
                    let mut value = kernel.decay[j] * y[i];
                    for l in 0..NODES {
                        value += kernel.integral[j][l] * self.forcing[l * v + i];
                    }
                    let old = std::mem::replace(&mut self.values[j * v + i], value);
                    // Every variable is measured against itself and its own motion: they need not share a unit.
                    let scale = value.abs() + weights.size * self.first_rates[i].abs();
                    converged &= (value - old).abs() <= TOLERANCE * scale;
                    finite &= value.is_finite();
                }
                self.force(law, j);
            }
            if !finite {
                break;
            }
            if converged {
                y.copy_from_slice(&self.values[(NODES - 1) * v..]);
                return true;
            }
        }
        if depth == DEPTH || self.budget == 0 {
            return false;
        }
        self.budget -= 1;
        self.halvings += 1;
        self.advance(law, stimuli, y, start, depth + 1) && self.advance(law, stimuli, y, start + 0.5 * part, depth + 1)
    }
}

/// ∫ from 0 to `c` of exp(−(c − t) z) times each Lagrange polynomial through `nodes`, dt.
fn relaxed_integral(nodes: &[f64], z: f64, c: f64) -> [f64; NODES] {
    let mut out = [0.0; NODES];
    if c == 0.0 {
        return out;
    }
    if c * z <= 3.0 {
        let (points, weights) = rule::<8>();
        for (x, w) in points.iter().zip(weights) {
            let mut values = [0.0; NODES];
            lagrange(nodes, c * x, &mut values);
            let kernel = w * c * (-(c - c * x) * z).exp();
            for (o, v) in out.iter_mut().zip(values) {
                *o += kernel * v;
            }
        }
        return out;
    }
    // Moments ∫ exp(−(c − t) z) t^m dt by the recurrence Im = (c^m − m Im−1)/z, stable for c z > 3.
    let mut moments = [0.0; NODES];
    moments[0] = -(-c * z).exp_m1() / z;
    for m in 1..NODES {
        moments[m] = (c.powi(m as i32) - m as f64 * moments[m - 1]) / z;
    }
    // Weights that reproduce the moments reproduce the integral of every polynomial through the nodes. The nodes are
    // distinct, so there are some.
    let powers = Matrix4::from_fn(|m, k| nodes[k].powi(m as i32));
    powers.lu().solve(&Vector4::from(moments)).map_or(out, Into::into)
}
