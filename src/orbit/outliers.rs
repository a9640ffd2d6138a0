//! Outliers: positions that are far from the smooth path through their neighbours.

use nalgebra::Vector2;

use super::path::PlanePath;
use super::robust::{despiked, median, median_gap};

/// An outlier is off by more than this multiple of the median distance around it. Normal noise is with probability exp(−8² ln 2) = 5e-20.
const FAR: f64 = 8.0;
/// Number of positions on either side of which the median is taken.
const AROUND: usize = 15;
/// Without an outlier its neighbours are off by less than this fraction of its own distance. At a sudden start of motion, where the speed
/// jumps, the fraction is 0.27, and where the motion is smooth it is larger than 2.
const SMOOTH: f64 = 0.25;
/// Number of neighbours on either side through which the path is interpolated.
const BESIDE: usize = 2;
/// Longest time between a position and the last of these neighbours, in median intervals.
const NEAR: f64 = 4.0;
/// Largest number of rounds. Of neighbouring outliers each round finds one.
const ROUNDS: usize = 12;

impl PlanePath {
    /// For each position whether it is no outlier.
    ///
    /// First spikes are rejected, which are far from the median of their neighbours. Then each position is compared with the cubic through
    /// two neighbours on either side. It is an outlier if it is much farther off than the positions around it, and if its neighbours lie
    /// on a smooth path without it. The second condition keeps a fast transient, on which the cubic fails with every position.
    pub(super) fn good(&self) -> Vec<bool> {
        let mut good = despiked(&self.positions);
        for _ in 0..ROUNDS {
            let kept: Vec<usize> = (0..good.len()).filter(|i| good[*i]).collect();
            let off = self.off(&kept);
            let candidate = |k: usize| {
                let beside = k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(off.len());
                let around = k.saturating_sub(AROUND)..(k + AROUND + 1).min(off.len());
                off[k] > 0.0
                    && off[beside].iter().all(|other| *other <= off[k])
                    && off[k] > FAR * median(off[around].to_vec())
            };
            let candidates: Vec<usize> = (0..kept.len()).filter(|k| candidate(*k)).collect();
            let mut others = good.clone();
            candidates.iter().for_each(|k| others[kept[*k]] = false);
            let others: Vec<usize> = (0..others.len()).filter(|i| others[*i]).collect();
            let without = self.off(&others);
            let smooth = |k: &usize| {
                let next = others.partition_point(|i| *i < kept[*k]);
                let beside = &without[next.saturating_sub(1)..(next + 1).min(without.len())];
                beside.iter().all(|other| *other < SMOOTH * off[*k])
            };
            let found: Vec<usize> = candidates.into_iter().filter(smooth).map(|k| kept[k]).collect();
            if found.is_empty() {
                break;
            }
            found.into_iter().for_each(|i| good[i] = false);
        }
        good
    }

    /// Distances (m) of chosen positions from the cubic through their neighbours, over the standard deviation that white noise of variance
    /// one gives them. Positions near an end or a gap have none, and the distance zero.
    fn off(&self, chosen: &[usize]) -> Vec<f64> {
        let times: Vec<f64> = chosen.iter().map(|i| self.times[*i]).collect();
        let near = NEAR * median_gap(&times);
        let mut off = vec![0.0; chosen.len()];
        for k in BESIDE..chosen.len().saturating_sub(BESIDE) {
            let nodes = [k - 2, k - 1, k + 1, k + 2];
            if times[k] - times[k - BESIDE] > near || times[k + BESIDE] - times[k] > near {
                continue;
            }
            // Lagrange's polynomials at the time of the position.
            let weights = nodes.map(|j| {
                let others = nodes.iter().filter(|other| **other != j);
                others.map(|other| (times[k] - times[*other]) / (times[j] - times[*other])).product::<f64>()
            });
            let position = |k: usize| self.positions[chosen[k]];
            let change: Vector2<f64> =
                nodes.iter().zip(weights).map(|(j, weight)| (position(*j) - position(k)) * weight).sum();
            off[k] = change.norm() / (1.0 + weights.iter().map(|weight| weight * weight).sum::<f64>()).sqrt();
        }
        off
    }

    /// The path of the chosen positions.
    pub(super) fn filtered(&self, good: &[bool]) -> Self {
        let kept = || (0..good.len()).filter(|i| good[*i]);
        Self { times: kept().map(|i| self.times[i]).collect(), positions: kept().map(|i| self.positions[i]).collect() }
    }
}
