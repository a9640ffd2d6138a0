//! The laws' variables, their rates and the stimuli at the material points of the growth zone, at
//! several times.

mod elements;
mod reading;

use std::collections::VecDeque;
use std::ops::Range;

use super::CLOSE;
use crate::error::ParameterError;
pub(crate) use reading::Reading;

/// Order of the integrators in time. Stimuli are interpolated through this number of levels, and
/// the variables are collocated at this number of points. Between two levels the variables are
/// cubic. Three levels would give third order; five levels would still give the fourth order of the
/// cubic.
pub(crate) const ORDER: usize = 4;

/// Largest number of levels through which stimuli are interpolated: by a cubic and a transient.
pub(crate) const LEVELS: usize = ORDER + 1;

/// History of the growth zone at several times, the levels, oldest first. Two levels of the same
/// time mark a discontinuity of the rates.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct History {
    /// Number of variables at a point.
    variables: usize,
    /// Number of stimuli at a point.
    stimuli: usize,
    levels: VecDeque<Level>,
}

/// Growth zone at one time.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Level {
    time: f64,
    /// Number of delays through which a discontinuity of a law or the scene has caused the one
    /// before this level.
    generation: u8,
    /// One row for each point: the variables, their rates and the stimuli. The row of the point at
    /// the apex is the first, so that those that leave the growth zone are at the end.
    rows: Vec<f64>,
}

/// Mutable row of a point at one level.
#[derive(Debug)]
pub(crate) struct RecordMut<'a> {
    pub variables: &'a mut [f64],
    pub rates: &'a mut [f64],
    pub stimuli: &'a mut [f64],
}

/// Indices of the levels through which stimuli are interpolated, oldest first.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Nodes {
    levels: [usize; LEVELS],
    count: usize,
}

impl std::ops::Deref for Nodes {
    type Target = [usize];

    fn deref(&self) -> &[usize] {
        &self.levels[..self.count]
    }
}

/// Memory of dropped levels, which is used again for new levels.
pub(crate) type Spare = Vec<Vec<f64>>;

impl History {
    /// A history of zeros at the given times, with the given numbers of variables and stimuli at
    /// each of `points` points.
    pub fn zeros(
        (variables, stimuli): (usize, usize),
        points: usize,
        times: impl Iterator<Item = f64>,
    ) -> Self {
        let level = |time| Level {
            time,
            generation: 0,
            rows: vec![0.0; points * (2 * variables + stimuli)],
        };
        Self {
            variables,
            stimuli,
            levels: times.map(level).collect(),
        }
    }

    /// Copies `source` without new allocations if the capacity suffices.
    pub fn copy_from(&mut self, source: &Self) {
        (self.variables, self.stimuli) = (source.variables, source.stimuli);
        self.levels.resize_with(source.levels.len(), Level::default);
        for (to, from) in self.levels.iter_mut().zip(&source.levels) {
            (to.time, to.generation) = (from.time, from.generation);
            to.rows.clone_from(&from.rows);
        }
    }

    /// Numbers of variables and stimuli at a point.
    pub fn size(&self) -> (usize, usize) {
        (self.variables, self.stimuli)
    }

    /// Number of levels; zero before a run has started.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Time of a level, s.
    pub fn time(&self, level: usize) -> f64 {
        self.levels[level].time
    }

    /// Time of the oldest level, s.
    pub fn oldest(&self) -> Option<f64> {
        self.levels.front().map(|level| level.time)
    }

    /// Levels after a discontinuity of the rates. Each has the same time as the level before it.
    pub fn discontinuities(&self) -> impl DoubleEndedIterator<Item = usize> {
        (1..self.levels()).filter(|level| self.time(level - 1) == self.time(*level))
    }

    /// Number of delays through which a discontinuity of a law or the scene has caused that before
    /// a level.
    pub fn generation(&self, level: usize) -> u8 {
        self.levels[level].generation
    }

    /// Time between the last two levels, s; zero if there are fewer.
    pub fn last_step(&self) -> f64 {
        let before = self.levels().checked_sub(2);
        before.map_or(0.0, |before| self.time(before + 1) - self.time(before))
    }

    /// Length of the row of a point.
    fn width(&self) -> usize {
        2 * self.variables + self.stimuli
    }

    /// Places of the numbers of a point at a level with `numbers` numbers.
    #[inline]
    fn row(&self, numbers: usize, point: usize) -> Range<usize> {
        let end = numbers - point * self.width();
        end - self.width()..end
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.levels.back().map_or(0, |level| level.rows.len()) / self.width().max(1)
    }

    /// Variables of a point at a level.
    #[inline]
    pub fn variables(&self, level: usize, point: usize) -> &[f64] {
        let rows = &self.levels[level].rows;
        &rows[self.row(rows.len(), point)][..self.variables]
    }

    /// Stimuli of a point at a level.
    #[inline]
    pub fn stimuli(&self, level: usize, point: usize) -> &[f64] {
        let rows = &self.levels[level].rows;
        &rows[self.row(rows.len(), point)][2 * self.variables..]
    }

    /// Mutable row of a point at a level.
    pub fn at_mut(&mut self, level: usize, point: usize) -> RecordMut<'_> {
        let row = self.row(self.levels[level].rows.len(), point);
        RecordMut::of(&mut self.levels[level].rows[row], self.variables)
    }

    /// Variables of a point at the last level; `None` if the history does not have that point.
    pub fn present(&self, point: usize) -> Option<&[f64]> {
        (point < self.points()).then(|| self.variables(self.levels() - 1, point))
    }

    /// Mutable rows of all points at the last level.
    pub fn each_present(&mut self) -> impl Iterator<Item = RecordMut<'_>> {
        let (width, variables) = (self.width().max(1), self.variables);
        let rows = self
            .levels
            .back_mut()
            .into_iter()
            .flat_map(move |level| level.rows.chunks_exact_mut(width).rev());
        rows.map(move |row| RecordMut::of(row, variables))
    }

    /// Largest absolute value of a variable at a level, and of its rate.
    pub fn largest(&self, level: usize, variable: usize) -> (f64, f64) {
        let rows = self.levels[level].rows.iter();
        let column = |k: usize| {
            rows.clone()
                .skip(k)
                .step_by(self.width())
                .fold(0.0, |a: f64, x| a.max(x.abs()))
        };
        (column(variable), column(self.variables + variable))
    }

    /// Calls `visit` with the data of a step at every point from `first` on: the variables and
    /// rates at the last level but one, the stimuli at `levels`, which end with the last level, and
    /// the variables and rates at the last level, to be written.
    ///
    /// # Errors
    /// The first point for which `visit` returns false.
    pub fn each_step(
        &mut self,
        (levels, first): (&Nodes, usize),
        mut visit: impl FnMut([&[f64]; 2], &[&[f64]; LEVELS], &mut [f64], &mut [f64]) -> bool,
    ) -> Result<(), usize> {
        let (variables, width, known) = (self.variables, self.width(), levels.len() - 1);
        let Some(mut last) = self.levels.pop_back() else {
            return Ok(());
        };
        let numbers = last.rows.len();
        let before = self.levels.back().map_or(&[][..], |level| &level.rows);
        let mut rows: [&[f64]; LEVELS] = [&[]; LEVELS];
        for (to, level) in rows.iter_mut().zip(&levels[..known]) {
            *to = &self.levels[*level].rows;
        }
        let mut points = last
            .rows
            .chunks_exact_mut(width.max(1))
            .rev()
            .enumerate()
            .skip(first);
        let failed = points.find_map(|(point, now)| {
            let row = self.row(numbers, point);
            let mut stimuli: [&[f64]; LEVELS] = [&[]; LEVELS];
            for (to, rows) in stimuli.iter_mut().zip(&rows[..known]) {
                *to = &rows[row.clone()][2 * variables..];
            }
            let now = RecordMut::of(now, variables);
            stimuli[known] = now.stimuli;
            let (start, rates) = before[row].split_at(variables);
            let succeeded = visit(
                [start, &rates[..variables]],
                &stimuli,
                now.variables,
                now.rates,
            );
            (!succeeded).then_some(point)
        });
        self.levels.push_back(last);
        failed.map_or(Ok(()), Err)
    }

    /// Appends a level at `time` (s). Its variables are extrapolated linearly at their rates, and
    /// its stimuli are those of the level before. This is an initial guess, on which an explicit
    /// step does not depend. At a discontinuity, `time` is that of the last level, and `generation`
    /// is the number of delays through which a discontinuity of a law or the scene has caused it.
    /// `generation` is zero for other levels.
    pub fn push(&mut self, time: f64, generation: u8, spare: &mut Spare) {
        let Some(last) = self.levels.back() else {
            return;
        };
        let mut rows = spare.pop().unwrap_or_default();
        rows.clone_from(&last.rows);
        let step = time - last.time;
        self.levels.push_back(Level {
            time,
            generation,
            rows,
        });
        for point in self.each_present() {
            point
                .variables
                .iter_mut()
                .zip(point.rates)
                .for_each(|(y, rate)| *y += step * *rate);
        }
    }

    /// Allocates the memory of `levels` levels in advance.
    pub fn reserve(&mut self, levels: usize, spare: &mut Spare) {
        let numbers = self.points() * self.width();
        self.levels
            .reserve(levels.saturating_sub(self.levels.len()));
        spare.reserve(levels.saturating_sub(spare.len()));
        while spare.len() + self.levels.len() < levels {
            spare.push(Vec::with_capacity(numbers));
        }
    }

    /// Drops the levels that are not needed to interpolate from `horizon` (s) on, and keeps those
    /// of the forcing before it.
    pub fn forget(&mut self, horizon: f64, spare: &mut Spare) {
        while self.levels.len() > ORDER && self.levels[ORDER].time <= horizon {
            spare.extend(self.levels.pop_front().map(|level| level.rows));
        }
    }

    /// Returns the levels for interpolation: the last ones, at most `most`, none from before the
    /// time `since` (s). Of two levels that are closer to each other than `gap` (s) only the later
    /// one is returned, since their difference would magnify rounding.
    pub fn smooth(&self, most: usize, since: f64, gap: f64) -> Nodes {
        let first = self
            .levels
            .partition_point(|level| level.time <= since)
            .saturating_sub(1);
        let (mut nodes, mut after) = (Nodes::default(), f64::INFINITY);
        for level in (first..self.levels.len()).rev() {
            if nodes.count < most && after - self.time(level) > gap {
                (nodes.levels[nodes.count], after) = (level, self.time(level));
                nodes.count += 1;
            }
        }
        nodes.levels[..nodes.count].reverse();
        nodes
    }

    /// Times (s) between `from` and `to` at which the time `delay` seconds earlier is that of a
    /// level. Times closer to an end than [`CLOSE`] times the interval are not between them.
    pub fn passings(&self, delay: f64, from: f64, to: f64) -> impl Iterator<Item = f64> + Clone {
        let close = CLOSE * (to - from);
        let inside = move |t: &f64| *t > from + close && *t < to - close;
        self.levels
            .iter()
            .map(move |level| level.time + delay)
            .filter(inside)
    }

    /// Returns an error unless this is a valid history of `points` points up to `time` (s) that is
    /// smooth since `since` (s).
    pub fn check(&self, points: usize, time: f64, since: f64) -> Result<(), ParameterError> {
        let Some(last) = self.levels.back() else {
            return Ok(());
        };
        let count = self.levels();
        ParameterError::unless(
            count >= 2,
            "number of levels of the history",
            count as f64,
            "zero, or two or more",
        )?;
        // The width of a damaged history may overflow.
        let width = self
            .variables
            .checked_mul(2)
            .and_then(|twice| twice.checked_add(self.stimuli));
        let numbers = width
            .and_then(|width| width.checked_mul(points))
            .unwrap_or(usize::MAX);
        let mut before = f64::MIN;
        for level in &self.levels {
            let (name, size) = (
                "number of values at a level of the history",
                level.rows.len(),
            );
            ParameterError::unless(
                size == numbers,
                name,
                size as f64,
                "that of the points times that of the laws' values",
            )?;
            level
                .rows
                .iter()
                .try_for_each(|x| ParameterError::finite("value in the history", *x, ""))?;
            // Two levels of the same time mark a discontinuity, since which the history is smooth.
            let ok = level.time > before || level.time == before && level.time <= since;
            ParameterError::unless(
                ok,
                "time of a level of the history",
                level.time,
                "later than the one before (s)",
            )?;
            before = level.time;
        }
        ParameterError::unless(
            last.time == time,
            "time of the history's end",
            last.time,
            "that of the state (s)",
        )
    }

    /// Returns whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.levels
            .iter()
            .all(|level| level.rows.iter().all(|x| x.is_finite()))
    }
}

impl<'a> RecordMut<'a> {
    #[inline]
    fn of(row: &'a mut [f64], size: usize) -> Self {
        let (variables, rest) = row.split_at_mut(size);
        let (rates, stimuli) = rest.split_at_mut(size);
        Self {
            variables,
            rates,
            stimuli,
        }
    }
}

#[cfg(test)]
mod tests;
