//! What outliers do not spoil: medians, quartiles, and which positions are spikes.

use nalgebra::Vector2;

/// A spike is farther from the median of its neighbours than positions usually are, by this factor, and than these neighbours are, by the
/// same factor. The first position of an exponential transient is no spike if the time constant is longer than one interval.
const SPIKE: f64 = 8.0;
/// Neighbours on either side.
const BESIDE: usize = 2;
/// A smooth path that turns back differs from the median of its neighbours by less than an eighth of this part of a step for every
/// sample that it takes in a period, if there are four of them or more: no turn of it is a spike.
const TURN: f64 = 0.25;

/// The median: of an even number, the upper one of both in the middle. Zero of nothing.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The median of the times between samples.
pub(super) fn median_gap(times: &[f64]) -> f64 {
    median(times.windows(2).map(|w| w[1] - w[0]).collect())
}

/// The value below which a part (0 to 1) of sorted values lies, linear between neighbours.
pub(super) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * sorted.len().saturating_sub(1) as f64;
    let (lower, upper) = (place.floor() as usize, place.ceil() as usize);
    match (sorted.get(lower), sorted.get(upper)) {
        (Some(a), Some(b)) => a + (b - a) * place.fract(),
        _ => 0.0,
    }
}

/// For each position whether it is near the median of itself and its neighbours, or those are as far from it.
pub(super) fn despiked(positions: &[Vector2<f64>]) -> Vec<bool> {
    let n = positions.len();
    // Near an end the first or the last positions.
    let around = |i: usize| {
        let first = i.saturating_sub(BESIDE).min(n.saturating_sub(2 * BESIDE + 1));
        first..(first + 2 * BESIDE + 1).min(n)
    };
    let middle = |i: usize| {
        let median = |c: usize| median(around(i).map(|j| positions[j][c]).collect());
        Vector2::new(median(0), median(1))
    };
    let middles: Vec<Vector2<f64>> = (0..n).map(middle).collect();
    let off: Vec<f64> = positions.iter().zip(&middles).map(|(position, middle)| (position - middle).norm()).collect();
    let step = median(positions.windows(2).map(|w| (w[1] - w[0]).norm()).collect());
    let usual = median(off.clone()).max(TURN * step);
    let alone = |i: usize| {
        let beside = around(i).filter(|j| *j != i).map(|j| (positions[j] - middles[i]).norm());
        off[i] > SPIKE * median(beside.collect())
    };
    (0..n).map(|i| usual == 0.0 || off[i] <= SPIKE * usual || !alone(i)).collect()
}
