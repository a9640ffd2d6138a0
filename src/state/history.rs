//! What was at the material points of the growth zone, at several times: the laws' variables, their rates, their stimuli.

use std::collections::VecDeque;
use std::ops::Range;

use super::error::StateError;
use crate::reference_element::MAX_POINTS;

/// Weights that turn the values at the points of an element into those at the points of a part of it.
type PartWeights = [[f64; MAX_POINTS]; MAX_POINTS];

/// The history of the growth zone at a few times, the levels, oldest first. Two levels of one time mark a discontinuity of
/// the rates.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct History {
    /// Variables at a point.
    variables: usize,
    /// Stimuli at a point.
    stimuli: usize,
    levels: VecDeque<Level>,
}

/// The zone at one time.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Level {
    time: f64,
    /// For every point its variables, their rates and its stimuli.
    rows: Vec<f64>,
}

/// A point at one level, to be written.
#[derive(Debug)]
pub(crate) struct RecordMut<'a> {
    pub variables: &'a mut [f64],
    pub rates: &'a mut [f64],
    pub stimuli: &'a mut [f64],
}

/// How the variables are read between two levels: by the cubic through values and rates (Hermite).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    level: usize,
    /// Of the older value and rate, of the newer value and rate.
    weights: [f64; 4],
}

/// Levels through which stimuli are interpolated, oldest first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nodes<const N: usize> {
    chosen: [usize; N],
    count: usize,
}

impl<const N: usize> std::ops::Deref for Nodes<N> {
    type Target = [usize];

    fn deref(&self) -> &[usize] {
        &self.chosen[..self.count]
    }
}

/// Levels that are not in use, whose memory serves again.
pub(crate) type Spare = Vec<Vec<f64>>;

impl History {
    /// Zeros at the given times for so many points, each with so many variables and stimuli.
    pub fn zeros((variables, stimuli): (usize, usize), points: usize, times: impl Iterator<Item = f64>) -> Self {
        let level = |time| Level { time, rows: vec![0.0; points * (2 * variables + stimuli)] };
        Self { variables, stimuli, levels: times.map(level).collect() }
    }

    /// Becomes equal to `source` without new allocations, if there is room.
    pub fn copy_from(&mut self, source: &Self) {
        (self.variables, self.stimuli) = (source.variables, source.stimuli);
        self.levels.resize_with(source.levels.len(), Level::default);
        for (to, from) in self.levels.iter_mut().zip(&source.levels) {
            to.time = from.time;
            to.rows.clone_from(&from.rows);
        }
    }

    /// How many variables and stimuli there are at a point.
    pub fn size(&self) -> (usize, usize) {
        (self.variables, self.stimuli)
    }

    /// The number of levels; zero before a run has started.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// The time of a level, s.
    pub fn time(&self, level: usize) -> f64 {
        self.levels[level].time
    }

    /// The time from which on something is known, s.
    pub fn oldest(&self) -> Option<f64> {
        self.levels.front().map(|level| level.time)
    }

    /// The levels behind a discontinuity of the rates: those of the same time as the one before.
    pub fn discontinuities(&self) -> impl Iterator<Item = usize> {
        (1..self.levels()).filter(|level| self.time(level - 1) == self.time(*level))
    }

    /// The time between the last two levels, s.
    pub fn last_step(&self) -> f64 {
        match self.levels.len() {
            0 | 1 => 0.0,
            levels => self.time(levels - 1) - self.time(levels - 2),
        }
    }

    /// Numbers in a row.
    fn width(&self) -> usize {
        2 * self.variables + self.stimuli
    }

    fn row(&self, point: usize) -> Range<usize> {
        point * self.width()..(point + 1) * self.width()
    }

    /// The number of points.
    pub fn points(&self) -> usize {
        self.levels.back().map_or(0, |level| level.rows.len()) / self.width().max(1)
    }

    /// The variables of a point at a level.
    #[inline]
    pub fn variables(&self, level: usize, point: usize) -> &[f64] {
        &self.levels[level].rows[self.row(point)][..self.variables]
    }

    /// The stimuli of a point at a level.
    #[inline]
    pub fn stimuli(&self, level: usize, point: usize) -> &[f64] {
        &self.levels[level].rows[self.row(point)][2 * self.variables..]
    }

    /// A point at a level, to be written.
    pub fn at_mut(&mut self, level: usize, point: usize) -> RecordMut<'_> {
        let row = self.row(point);
        RecordMut::of(&mut self.levels[level].rows[row], self.variables)
    }

    /// The variables of a point at the last level, if it has some.
    pub fn present(&self, point: usize) -> Option<&[f64]> {
        if point >= self.points() {
            return None;
        }
        let row = &self.levels.back()?.rows[self.row(point)];
        Some(&row[..self.variables])
    }

    /// Every point at the last level, to be written.
    pub fn each_present(&mut self) -> impl Iterator<Item = RecordMut<'_>> {
        let (width, variables) = (self.width().max(1), self.variables);
        let rows = self.levels.back_mut().into_iter().flat_map(move |level| level.rows.chunks_exact_mut(width));
        rows.map(move |row| RecordMut::of(row, variables))
    }

    /// The largest value of a variable at a level, and its largest rate.
    pub fn largest(&self, level: usize, variable: usize) -> (f64, f64) {
        let rows = self.levels[level].rows.iter();
        let column = |k: usize| rows.clone().skip(k).step_by(self.width()).fold(0.0, |a: f64, x| a.max(x.abs()));
        (column(variable), column(self.variables + variable))
    }

    /// Calls `visit` with every point: its variables at the last level but one, its stimuli at the levels of `levels`, at
    /// most `N`, which end with the last, and its variables and their rates at the last level, to be written. Stops at the
    /// first point for which `visit` fails, and returns its number.
    pub fn each_step<const N: usize>(
        &mut self,
        levels: &[usize],
        mut visit: impl FnMut(&[f64], &[&[f64]; N], &mut [f64], &mut [f64]) -> bool,
    ) -> Result<(), usize> {
        let (variables, width, known) = (self.variables, self.width(), levels.len() - 1);
        let Some(mut last) = self.levels.pop_back() else { return Ok(()) };
        let before = self.levels.back().map_or(&[][..], |level| &level.rows);
        let mut rows: [&[f64]; N] = [&[]; N];
        for (to, level) in rows.iter_mut().zip(&levels[..known]) {
            *to = &self.levels[*level].rows;
        }
        let failed = last.rows.chunks_exact_mut(width.max(1)).enumerate().position(|(point, now)| {
            let row = point * width..(point + 1) * width;
            let mut stimuli: [&[f64]; N] = [&[]; N];
            for (to, rows) in stimuli.iter_mut().zip(&rows[..known]) {
                *to = &rows[row.clone()][2 * variables..];
            }
            let now = RecordMut::of(now, variables);
            stimuli[known] = now.stimuli;
            !visit(&before[row][..variables], &stimuli, now.variables, now.rates)
        });
        self.levels.push_back(last);
        failed.map_or(Ok(()), Err)
    }

    /// Appends a level at `time` (s) at which the variables have gone on at their rates; the stimuli stay. A first guess:
    /// what reads only the past does not see it.
    pub fn push(&mut self, time: f64, spare: &mut Spare) {
        let Some(last) = self.levels.back() else { return };
        let mut rows = spare.pop().unwrap_or_default();
        rows.clone_from(&last.rows);
        let step = time - last.time;
        self.levels.push_back(Level { time, rows });
        for point in self.each_present() {
            point.variables.iter_mut().zip(point.rates).for_each(|(y, rate)| *y += step * *rate);
        }
    }

    /// Makes room for `levels` levels, so that none of them asks for memory later.
    pub fn reserve(&mut self, levels: usize, spare: &mut Spare) {
        let numbers = self.points() * self.width();
        self.levels.reserve(levels.saturating_sub(self.levels.len()));
        spare.reserve(levels.saturating_sub(spare.len()));
        while spare.len() + self.levels.len() < levels {
            spare.push(Vec::with_capacity(numbers));
        }
    }

    /// Drops levels that nothing will read that looks back to `horizon` (s), keeping at least `least`.
    pub fn forget(&mut self, horizon: f64, least: usize, spare: &mut Spare) {
        while self.levels.len() > least && self.levels[1].time <= horizon {
            spare.extend(self.levels.pop_front().map(|level| level.rows));
        }
    }

    /// The last levels, at most `N`, none from before the time `since` (s): those through which one may interpolate. Of levels that
    /// are closer to each other than `gap` (s) the later ones: others would magnify rounding.
    pub fn smooth<const N: usize>(&self, since: f64, gap: f64) -> Nodes<N> {
        let first = self.levels.partition_point(|level| level.time <= since).saturating_sub(1);
        let (mut chosen, mut count, mut after) = ([0; N], 0, f64::INFINITY);
        for level in (first..self.levels.len()).rev() {
            if count == N {
                break;
            }
            if after - self.time(level) > gap {
                (chosen[count], after) = (level, self.time(level));
                count += 1;
            }
        }
        chosen[..count].reverse();
        Nodes { chosen, count }
    }

    /// The times (s) between `from` and `to` at which what is read `delay` seconds ago passes a level.
    pub fn passings(&self, delay: f64, from: f64, to: f64) -> impl Iterator<Item = f64> {
        self.levels.iter().map(move |level| level.time + delay).filter(move |t| *t > from && *t < to)
    }

    /// How to read at `time` (s), on the piece between two levels that holds `inside` (s). Before the first level the
    /// variables are constant.
    pub fn reading(&self, inside: f64, time: f64) -> Reading {
        let after = self.levels.partition_point(|level| level.time <= inside);
        let level = after.clamp(1, self.levels.len() - 1) - 1;
        let (a, b) = (self.levels[level].time, self.levels[level + 1].time);
        let h = b - a;
        if time <= a && after == 0 || h <= 0.0 {
            return Reading { level, weights: [1.0, 0.0, 0.0, 0.0] };
        }
        let x = (time - a) / h;
        let y = 1.0 - x;
        let weights = [(1.0 + 2.0 * x) * y * y, x * y * y * h, x * x * (1.0 + 2.0 * y), -x * x * y * h];
        Reading { level, weights }
    }

    /// How to read the rates at `time` (s): those of the cubic that [`reading`](Self::reading) takes.
    pub fn slope(&self, time: f64) -> Reading {
        let level = self.levels.partition_point(|level| level.time <= time).clamp(1, self.levels.len() - 1) - 1;
        let (a, b) = (self.levels[level].time, self.levels[level + 1].time);
        let h = b - a;
        if h <= 0.0 {
            return Reading { level, weights: [0.0, 1.0, 0.0, 0.0] };
        }
        let x = (time - a) / h;
        let value = 6.0 * x * (1.0 - x) / h;
        Reading { level, weights: [-value, (1.0 - x) * (1.0 - 3.0 * x), value, x * (3.0 * x - 2.0)] }
    }

    /// The variables of a point at an earlier time.
    #[inline]
    pub fn read<'a>(&'a self, at: &Reading, point: usize) -> impl Iterator<Item = f64> + 'a {
        let (row, v, w) = (self.row(point), self.variables, at.weights);
        let (old, new) = (&self.levels[at.level].rows[row.clone()], &self.levels[at.level + 1].rows[row]);
        let old = old[..v].iter().zip(&old[v..2 * v]);
        let new = new[..v].iter().zip(&new[v..2 * v]);
        old.zip(new).map(move |((y0, rate0), (y1, rate1))| w[0] * y0 + w[1] * rate0 + w[2] * y1 + w[3] * rate1)
    }

    /// Replaces the `p` points from `first` on by the 2 `p` points of two parts, at every level.
    pub fn split(&mut self, first: usize, p: usize, parts: [&PartWeights; 2]) {
        let width = self.width();
        let (at, size) = (first * width, p * width);
        for level in &mut self.levels {
            let rows = &mut level.rows;
            let end = rows.len();
            rows.resize(end + size, 0.0);
            rows.copy_within(at + size..end, at + 2 * size);
            for column in 0..width {
                let old: [f64; MAX_POINTS] =
                    std::array::from_fn(|g| if g < p { rows[at + g * width + column] } else { 0.0 });
                for (part, weights) in parts.iter().enumerate() {
                    for g in 0..p {
                        let value = weights[g].iter().zip(old).map(|(w, v)| w * v).sum();
                        rows[at + (part * p + g) * width + column] = value;
                    }
                }
            }
        }
    }

    /// Drops the first `points` points at every level: they have left the zone.
    pub fn drain(&mut self, points: usize) {
        let gone = points * self.width();
        for level in &mut self.levels {
            level.rows.drain(..gone);
        }
    }

    /// Refuses a history that is not one of so many `points` up to `time` (s), smooth since `since` (s).
    pub fn check(&self, points: usize, time: f64, since: f64) -> Result<(), StateError> {
        let Some(last) = self.levels.back() else { return Ok(()) };
        let levels = self.levels.len();
        // What is read lies between two of them.
        StateError::size("levels of the history", levels, levels.max(2))?;
        // A width that overflows is that of no list.
        let width = self.variables.checked_mul(2).and_then(|twice| twice.checked_add(self.stimuli));
        let numbers = width.and_then(|width| width.checked_mul(points)).unwrap_or(usize::MAX);
        for level in &self.levels {
            StateError::size("numbers at a time of the history", level.rows.len(), numbers)?;
            let bad = level.rows.iter().find(|x| !x.is_finite());
            StateError::unless(bad.is_none(), "number in the history", bad.copied().unwrap_or(0.0), "finite")?;
        }
        let mut before = f64::MIN;
        for level in &self.levels {
            // Two levels of one time mark a discontinuity, after which the history is smooth.
            let ok = level.time > before || level.time == before && level.time <= since;
            StateError::unless(ok, "time of a level of the history", level.time, "later than the one before (s)")?;
            before = level.time;
        }
        StateError::unless(last.time == time, "time of the history's end", last.time, "that of the state (s)")
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.levels.iter().all(|level| level.rows.iter().all(|x| x.is_finite()))
    }
}

impl<'a> RecordMut<'a> {
    #[inline]
    fn of(row: &'a mut [f64], size: usize) -> Self {
        let (variables, rest) = row.split_at_mut(size);
        let (rates, stimuli) = rest.split_at_mut(size);
        Self { variables, rates, stimuli }
    }
}

#[cfg(test)]
mod tests;
