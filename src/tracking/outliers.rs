//! Outliers: positions far from the smooth path through their neighbours.

use std::ops::Range;

use nalgebra::Vector2;

use super::statistics::{median, median_gap};
use crate::numerics::interpolation::lagrange;

/// Distance of an outlier from the position expected there, over the median of such distances.
/// Normal noise exceeds it with probability exp(−8² ln 2) = 5e-20. The first position of an
/// exponential transient is not an outlier if the time constant is longer than one interval.
const FAR: f64 = 8.0;
/// Number of positions on either side over which the median of distances is taken.
const AROUND: usize = 15;
/// Number of neighbours on either side from which the expected position is computed: the median of
/// five positions, or a cubic.
const BESIDE: usize = 2;
/// Largest distance of the neighbours of an outlier from a smooth path without it, over the
/// distance of the outlier. For other positions the fraction is larger: 0.27 at a discontinuity of
/// the speed, and more than 2 on a smooth path.
const SMOOTH: f64 = 0.25;
/// Largest number of rounds. Each round finds at most one of several neighbouring outliers.
const ROUNDS: usize = 12;

/// Returns true for positions that are not outliers.
///
/// First spikes are rejected, which are far from the median of their neighbours. Then each position
/// is compared with the cubic through two neighbours on either side. It is an outlier if it is much
/// farther off than the positions around it, and if its neighbours lie on a smooth path without it.
/// The second condition keeps a fast transient, where the cubic misses every position. One
/// comparison finds one of several neighbouring outliers; it is repeated without the outliers
/// found. Distances up to `rounding` are rounding errors.
pub(super) fn good(times: &[f64], positions: &[Vector2<f64>], rounding: f64) -> Vec<bool> {
    let mut good = despiked(positions);
    for _ in 0..ROUNDS {
        let kept: Vec<usize> = (0..good.len()).filter(|i| good[*i]).collect();
        let off = distances(times, positions, &kept);
        let range =
            |k: usize, reach: usize| k.saturating_sub(reach)..(k + reach + 1).min(off.len());
        let candidate = |k: usize| {
            off[k] > rounding
                && off[range(k, BESIDE)].iter().all(|other| *other <= off[k])
                && off[k] > FAR * median(off[range(k, AROUND)].to_vec())
        };
        let (candidates, others): (Vec<_>, Vec<_>) = (0..kept.len()).partition(|k| candidate(*k));
        let others: Vec<usize> = others.into_iter().map(|k| kept[k]).collect();
        let without = distances(times, positions, &others);
        let smooth = |k: &usize| {
            let next = others.partition_point(|i| *i < kept[*k]);
            let beside = &without[next.saturating_sub(1)..(next + 1).min(without.len())];
            beside.iter().all(|other| *other < SMOOTH * off[*k])
        };
        let found: Vec<usize> = candidates
            .into_iter()
            .filter(smooth)
            .map(|k| kept[k])
            .collect();
        if found.is_empty() {
            break;
        }
        found.into_iter().for_each(|i| good[i] = false);
    }
    good
}

/// Distances of chosen positions from the cubic through their neighbours, over the standard
/// deviation of this distance in white noise of variance one. The distance is zero near an end or a
/// gap, where the neighbours span more than twice the usual time.
fn distances(times: &[f64], positions: &[Vector2<f64>], chosen: &[usize]) -> Vec<f64> {
    let times: Vec<f64> = chosen.iter().map(|i| times[*i]).collect();
    let near = 2.0 * BESIDE as f64 * median_gap(&times);
    let mut distances = vec![0.0; chosen.len()];
    for k in BESIDE..chosen.len().saturating_sub(BESIDE) {
        let nodes = [k - 2, k - 1, k + 1, k + 2];
        if times[k] - times[k - BESIDE] > near || times[k + BESIDE] - times[k] > near {
            continue;
        }
        let weights: [f64; 2 * BESIDE] = lagrange(&nodes.map(|j| times[j]), times[k]);
        let position = |k: usize| positions[chosen[k]];
        let change: Vector2<f64> = nodes
            .iter()
            .zip(weights)
            .map(|(j, weight)| (position(*j) - position(k)) * weight)
            .sum();
        distances[k] = change.norm()
            / (1.0 + weights.iter().map(|weight| weight * weight).sum::<f64>()).sqrt();
    }
    distances
}

/// Returns true for positions that are not spikes: they are near the median of themselves and their
/// neighbours, or the neighbours are as far from that median.
fn despiked(positions: &[Vector2<f64>]) -> Vec<bool> {
    let n = positions.len();
    // Near an end these are the first or the last positions.
    let around = |i: usize| -> Range<usize> {
        let first = i
            .saturating_sub(BESIDE)
            .min(n.saturating_sub(2 * BESIDE + 1));
        first..(first + 2 * BESIDE + 1).min(n)
    };
    let middle =
        |i: usize| Vector2::from_fn(|c, _| median(around(i).map(|j| positions[j][c]).collect()));
    let middles: Vec<Vector2<f64>> = (0..n).map(middle).collect();
    let distances: Vec<f64> = positions
        .iter()
        .zip(&middles)
        .map(|(p, middle)| (p - middle).norm())
        .collect();
    let step = median(positions.windows(2).map(|w| (w[1] - w[0]).norm()).collect());
    // At a turning point of a smooth path with at least four samples in a period, a position is
    // about one step from the median of its neighbours. The threshold is at least twice this
    // distance: `FAR` times a quarter of a step.
    let usual = median(distances.clone()).max(0.25 * step);
    let alone = |i: usize| {
        let beside = around(i)
            .filter(|j| *j != i)
            .map(|j| (positions[j] - middles[i]).norm());
        distances[i] > FAR * median(beside.collect())
    };
    (0..n)
        .map(|i| usual == 0.0 || distances[i] <= FAR * usual || !alone(i))
        .collect()
}
