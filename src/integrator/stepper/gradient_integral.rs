//! Change of the intrinsic strain over a step, by quadrature of the growth gradient.
//!
//! u*(t1) − u*(t0) = ∫ REGR · gradient dt. The delayed variables are interpolated between the
//! levels of the history. Each piece of the step has three Gauss points. The step is one piece if
//! it is not longer than the distances between the levels at the delayed times, as in a sequence of
//! equal steps. The interpolated variables have a continuous slope at a level, and a second
//! derivative that jumps by a multiple of the square of the step. The quadrature across the level
//! then has an error of fifth order. A step that passes several levels is divided at them.

use nalgebra::Vector3;

use super::IntegrationError;
use super::collocation::Levels;
use crate::growth::GrowthLaw;
use crate::numerics::quadrature::rule;
use crate::state::{History, LEVELS, Nodes, Reading};
use crate::tropism::{Declaration, Growing, TropismLaw};

/// Largest number of levels that a delayed time passes inside a piece.
const MOST_INSIDE: usize = 1;

/// Gauss points of a step, with the interpolation of the delayed variables at each of them. They
/// are the same for all material points.
#[derive(Debug, Clone, Default)]
pub(super) struct GradientIntegral {
    nodes: Vec<Node>,
    /// Interpolations of the delayed variables: for each node, one for each delay and time
    /// constant.
    readings: Vec<Reading>,
    /// Distinct pairs of delay and time constant of the variables, s.
    delays: Vec<[f64; 2]>,
    /// The variables with each pair.
    delayed: Vec<Vec<usize>>,
    /// Levels through which the present stimuli are interpolated, and their times.
    levels: (Nodes, Levels),
    /// Start of the step and ends of the pieces, s.
    ends: Vec<f64>,
    /// Delayed variables of each point.
    past: Vec<f64>,
    present: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    time: f64,
    weight: f64,
    /// Interpolation weights of the present stimuli.
    interpolation: [f64; LEVELS],
}

impl GradientIntegral {
    /// Begins a step: lists the delays of the laws, and keeps the levels through which the present
    /// stimuli are interpolated if the gradient depends on them.
    pub fn begin_step(&mut self, laws: &Declaration, levels: (Nodes, Levels)) {
        self.levels = levels;
        let (variables, size) = (laws.variables(), laws.size());
        self.present
            .resize(if size.reads_present { size.stimuli } else { 0 }, 0.0);
        self.delays.clear();
        self.delayed.iter_mut().for_each(Vec::clear);
        for (k, variable) in variables.iter().enumerate() {
            let Some(delay) = variable.delay else {
                continue;
            };
            let pair = [delay, variable.time_constant];
            let place = self
                .delays
                .iter()
                .position(|known| *known == pair)
                .unwrap_or_else(|| {
                    self.delays.push(pair);
                    self.delays.len() - 1
                });
            if place == self.delayed.len() {
                self.delayed.push(Vec::new());
            }
            self.delayed[place].push(k);
        }
    }

    /// Computes the quadrature for the interval from `from` to `to` (s).
    pub fn prepare(&mut self, history: &History, [from, to]: [f64; 2]) {
        self.clear();
        self.ends.extend([from, to]);
        for [delay, _] in &self.delays {
            let passings = history.passings(*delay, from, to);
            if passings.clone().count() > MOST_INSIDE {
                self.ends.extend(passings);
            }
        }
        self.ends.sort_unstable_by(f64::total_cmp);
        let (x, w) = rule::<3>();
        for piece in 1..self.ends.len() {
            let [a, b] = [self.ends[piece - 1], self.ends[piece]];
            if b <= a {
                continue;
            }
            for (x, w) in x.iter().zip(w) {
                self.push(history, (a + (b - a) * x, w * (b - a)));
            }
        }
    }

    /// Prepares [`add`](Self::add) for the rate of the intrinsic strain at a `time` (s) in a step,
    /// 1/(m s), instead of its change in an interval.
    pub fn prepare_rate(&mut self, history: &History, time: f64) {
        self.clear();
        self.push(history, (time, 1.0));
    }

    /// Removes all times.
    fn clear(&mut self) {
        self.ends.clear();
        self.nodes.clear();
        self.readings.clear();
    }

    /// Appends a time (s) with its weight.
    fn push(&mut self, history: &History, (time, weight): (f64, f64)) {
        let interpolation = if self.present.is_empty() {
            [0.0; LEVELS]
        } else {
            self.levels.1.weights(time)
        };
        self.nodes.push(Node {
            time,
            weight,
            interpolation,
        });
        let read = |[delay, tau]: [f64; 2]| history.reading(time - delay, tau);
        self.readings.extend(self.delays.iter().copied().map(read));
    }

    /// The error of a change of the intrinsic strain that is not finite. It names the first value
    /// of a law that causes it, or else the change itself at the time `end` (s). The point is given
    /// by its index in the zone and its place at the time `start` (s), when the shoot has the given
    /// `length` (m).
    pub fn undefined<G: GrowthLaw, T: TropismLaw>(
        &mut self,
        (growth, tropism): (&G, &T),
        history: &History,
        (index, [start, end]): (usize, [f64; 2]),
        (point, length): (&Growing, f64),
    ) -> IntegrationError {
        let (nodes, readings) = (
            std::mem::take(&mut self.nodes),
            std::mem::take(&mut self.readings),
        );
        let (size, delays) = (history.size().0, self.delays.len());
        for (i, node) in nodes.into_iter().enumerate() {
            let mut sum = [Vector3::zeros()];
            (self.nodes, self.readings) =
                (vec![node], readings[i * delays..(i + 1) * delays].to_vec());
            self.add(
                (growth, tropism),
                history,
                (index, start),
                std::slice::from_ref(point),
                &mut sum,
            );
            if sum[0].sum().is_finite() {
                continue;
            }
            let moves = growth.elongates();
            let apex_distance = if moves {
                growth.flow(point.apex_distance, start, node.time).0
            } else {
                point.apex_distance
            };
            let (at, past) = (
                Growing {
                    time: node.time,
                    apex_distance,
                    ..*point
                },
                &self.past[..size],
            );
            let gradient = tropism.gradient(&at, past, &self.present);
            let names = [
                "growth gradient along d1",
                "growth gradient along d2",
                "growth gradient along d3",
            ];
            let component = names
                .into_iter()
                .zip(gradient.iter())
                .find(|(_, x)| !x.is_finite());
            let (what, law) = match component {
                Some((name, _)) => (name, tropism.name_of_undefined(&at, past, &self.present)),
                None => ("REGR", std::any::type_name::<G>()),
            };
            let (arc_length, time) = (length - apex_distance, node.time);
            return IntegrationError::Undefined {
                what,
                law,
                arc_length,
                time,
            };
        }
        IntegrationError::NotFinite {
            what: "growth gradient",
            time: end,
        }
    }

    /// Adds to `sums` the changes of the intrinsic strain over the interval (1/m) of consecutive
    /// points of the zone, from point `first` on, with their places at the time `start` (s).
    // The loop over the times is outside, so that parts of laws that depend only on time are
    // evaluated once for each.
    pub fn add(
        &mut self,
        (growth, tropism): (&impl GrowthLaw, &impl TropismLaw),
        history: &History,
        (first, start): (usize, f64),
        points: &[Growing],
        sums: &mut [Vector3<f64>],
    ) {
        let (moves, size) = (growth.elongates(), history.size().0);
        // Variables without a delay stay zero.
        self.past.clear();
        self.past.resize(points.len() * size, 0.0);
        for (i, &node) in self.nodes.iter().enumerate() {
            let delays = self.delays.len();
            let readings = &self.readings[i * delays..(i + 1) * delays];
            for (reading, variables) in readings.iter().zip(&self.delayed) {
                history.read_some(reading, first, variables, &mut self.past);
            }
            for (k, (place, sum)) in points.iter().zip(sums.iter_mut()).enumerate() {
                for (m, value) in self.present.iter_mut().enumerate() {
                    let levels = self.levels.0.iter().zip(node.interpolation);
                    *value = levels
                        .map(|(level, w)| w * history.stimuli(*level, first + k)[m])
                        .sum();
                }
                let apex_distance = if moves {
                    growth.flow(place.apex_distance, start, node.time).0
                } else {
                    place.apex_distance
                };
                let at = Growing {
                    time: node.time,
                    apex_distance,
                    ..*place
                };
                let rate = growth.regr(apex_distance, node.time);
                *sum += tropism.gradient(&at, &self.past[k * size..(k + 1) * size], &self.present)
                    * (rate * node.weight);
            }
        }
    }
}
