//! Positions that are far from where the tip must have been.

use super::OrbitError;
use super::path::PlanePath;
use super::robust::{despiked, median, median_gap};

/// A position is an outlier if it is so many times as far off as is usual around it: noise is, in one place of 1e19.
const FAR: f64 = 8.0;
/// Neighbours on either side that tell what is usual.
const AROUND: usize = 15;
/// Neighbours on either side that an outlier draws off with it: they are judged again without it.
const DRAWN: usize = 2;
/// Rounds, each of which takes away one of neighbouring outliers.
const ROUNDS: usize = 12;
/// Neighbours on either side must be nearer than this part of a period, or so many intervals: a parabola says nothing at an end.
const NEAR: (f64, f64) = (0.6, 3.0);

impl PlanePath {
    /// Which positions are no outliers, of motion that has no periods shorter than `shortest` (s): those near the median of their
    /// neighbours, and of them those near the smooth path through the others.
    ///
    /// # Errors
    /// Those of [`drift`](Self::drift).
    pub(super) fn good(&self, shortest: f64) -> Result<Vec<bool>, OrbitError> {
        let mut good = despiked(&self.positions);
        for _ in 0..ROUNDS {
            let kept: Vec<usize> = (0..good.len()).filter(|i| good[*i]).collect();
            let path = self.filtered(&good);
            let (n, times) = (kept.len(), &path.times);
            let near = (NEAR.0 * shortest).max(NEAR.1 * median_gap(times));
            let off: Vec<f64> = path.without_drift(shortest)?.positions.iter().map(|p| p.norm()).collect();
            let outlier = |i: usize| {
                let beside = i - DRAWN..i + DRAWN + 1;
                let among = times[i] - times[i - DRAWN] <= near && times[i + DRAWN] - times[i] <= near;
                let usual = || median(off[i.saturating_sub(AROUND)..(i + AROUND + 1).min(n)].to_vec());
                among && off[beside].iter().all(|other| *other <= off[i]) && off[i] > FAR * usual()
            };
            let found: Vec<usize> = (DRAWN..n.saturating_sub(DRAWN)).filter(|i| outlier(*i)).collect();
            if found.is_empty() {
                break;
            }
            found.into_iter().for_each(|i| good[kept[i]] = false);
        }
        Ok(good)
    }

    /// The positions that are marked.
    pub(super) fn filtered(&self, good: &[bool]) -> Self {
        let kept = || (0..good.len()).filter(|i| good[*i]);
        Self { times: kept().map(|i| self.times[i]).collect(), positions: kept().map(|i| self.positions[i]).collect() }
    }
}
