//! The intrinsic strain over a step: the exact integral of what the laws ask for, given the variables' past.
//!
//! u*(t1) − u*(t0) = ∫ REGR · gradient dt. Between the times at which a delayed variable passes a level of the history,
//! the variables are cubic (Hermite) in time and the integrand is smooth: three Gauss points on every such piece.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::growth::GrowthLaw;
use crate::quadrature::{lagrange, rule};
use crate::state::Level;
use crate::tropism::{Growing, TropismLaw};

/// The Gauss points of a step and how the past is read at each of them; the same for all material points.
#[derive(Debug, Default)]
pub(super) struct Quadrature {
    nodes: Vec<Node>,
    /// For every node, one entry for every variable.
    reads: Vec<Read>,
    breaks: Vec<f64>,
    past: Vec<f64>,
    now: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    time: f64,
    weight: f64,
    /// First of the levels through which the present stimuli are interpolated, and their weights.
    first_level: usize,
    now: [f64; 4],
}

/// A variable is read by Hermite's cubic between two levels.
#[derive(Debug, Clone, Copy)]
enum Read {
    Never,
    Between { level: usize, weights: [f64; 4] },
}

impl Quadrature {
    /// Prepares for the interval from `from` to `to`; `interpolated` are the levels through which present stimuli are
    /// read, if they are.
    pub fn prepare(
        &mut self,
        levels: &VecDeque<Level>,
        delays: &[f64],
        interpolated: Option<std::ops::Range<usize>>,
        from: f64,
        to: f64,
    ) {
        self.nodes.clear();
        self.reads.clear();
        self.breaks.clear();
        self.breaks.extend([from, to]);
        for (v, delay) in delays.iter().enumerate() {
            if delay.is_finite() && !delays[..v].contains(delay) {
                let passed = levels.iter().map(|level| level.time + delay);
                self.breaks.extend(passed.filter(|t| *t > from && *t < to));
            }
        }
        self.breaks.sort_unstable_by(f64::total_cmp);
        let (x, w) = rule::<3>();
        for pair in 0..self.breaks.len() - 1 {
            let (a, b) = (self.breaks[pair], self.breaks[pair + 1]);
            if b <= a {
                continue;
            }
            for (x, w) in x.iter().zip(w) {
                let time = a + (b - a) * x;
                let mut now = [0.0; 4];
                let mut first_level = 0;
                if let Some(range) = &interpolated {
                    first_level = range.start;
                    let mut times = [0.0; 4];
                    for (to, level) in times.iter_mut().zip(levels.range(range.clone())) {
                        *to = level.time;
                    }
                    lagrange(&times[..range.len()], time, &mut now[..range.len()]);
                }
                self.nodes.push(Node { time, weight: w * (b - a), first_level, now });
                for delay in delays {
                    self.reads.push(if delay.is_finite() {
                        // Every Gauss point of a piece lies between the same two levels as its middle does.
                        between(levels, 0.5 * (a + b) - delay, time - delay)
                    } else {
                        Read::Never
                    });
                }
            }
        }
    }

    /// The change of a point's intrinsic strain over the interval. `row` is where the point stands in the rows of the
    /// levels, `place` its distance from the apex at the time `start`.
    pub fn integrate(
        &mut self,
        growth: &impl GrowthLaw,
        tropism: &impl TropismLaw,
        levels: &VecDeque<Level>,
        row: std::ops::Range<usize>,
        radius: f64,
        (place, start): (f64, f64),
    ) -> Vector3<f64> {
        let variables = tropism.variables();
        let stimuli = if tropism.senses_now() { tropism.stimuli() } else { 0 };
        self.past.resize(variables, 0.0);
        self.now.resize(stimuli, 0.0);
        let moves = growth.elongates();
        let mut sum = Vector3::zeros();
        for (i, node) in self.nodes.iter().enumerate() {
            for (v, read) in self.reads[i * variables..(i + 1) * variables].iter().enumerate() {
                self.past[v] = match read {
                    Read::Never => 0.0,
                    Read::Between { level, weights } => {
                        let (old, new) = (&levels[*level].rows[row.clone()], &levels[level + 1].rows[row.clone()]);
                        weights[0] * old[v]
                            + weights[1] * old[variables + v]
                            + weights[2] * new[v]
                            + weights[3] * new[variables + v]
                    }
                };
            }
            for (m, value) in self.now.iter_mut().enumerate() {
                let used = levels.iter().skip(node.first_level).zip(node.now);
                *value = used.map(|(level, w)| w * level.rows[row.clone()][2 * variables + m]).sum();
            }
            let apex_distance = if moves { growth.flow(place, start, node.time).0 } else { place };
            let at = Growing { time: node.time, radius, apex_distance };
            let rate = growth.regr(apex_distance, node.time);
            sum += tropism.gradient(&at, &self.past, &self.now) * (rate * node.weight);
        }
        sum
    }
}

/// Hermite weights for `time` on the piece that holds `inside`. Before the first level the past is constant.
fn between(levels: &VecDeque<Level>, inside: f64, time: f64) -> Read {
    let after = levels.partition_point(|level| level.time <= inside);
    let level = after.clamp(1, levels.len() - 1) - 1;
    let (a, b) = (levels[level].time, levels[level + 1].time);
    let h = b - a;
    if time <= a && after == 0 || h <= 0.0 {
        return Read::Between { level, weights: [1.0, 0.0, 0.0, 0.0] };
    }
    let x = (time - a) / h;
    let y = 1.0 - x;
    let weights = [(1.0 + 2.0 * x) * y * y, x * y * y * h, x * x * (1.0 + 2.0 * y), -x * x * y * h];
    Read::Between { level, weights }
}
