//! Everything that the future of a shoot depends on, as one plain value.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::rod::{Rod, merge_rotations, part_weights, split_rotations};

/// The state of a shoot: material points with their intrinsic strains, frames, the laws' variables and their history,
/// and time.
///
/// A plain value: clone it, compare it, keep it, give it back with [`Shoot::restore`](crate::Shoot::restore). A run that
/// goes on from a restored state repeats the original bit by bit.
#[derive(Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    pub(crate) time: f64,
    pub(crate) rod: Rod,
    /// Rotation vectors of earlier equilibria, latest first, from which the next first guess is extrapolated.
    pub(crate) earlier: Vec<Earlier>,
    /// How many of them there are; the rest are room.
    pub(crate) known: usize,
    pub(crate) history: History,
    /// When the run began or passed a jump: no interpolation in time reaches back across it.
    pub(crate) smooth_since: f64,
}

/// How many equilibria before the last are kept: a first guess is quadratic in time.
pub(crate) const EARLIER: usize = 2;

/// The rotation vectors of an earlier equilibrium, on the present elements.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Earlier {
    pub time: f64,
    pub rotations: Vec<Vector3<f64>>,
}

/// Variables, their rates and stimuli at the material points of the growth zone, at several times.
#[derive(Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct History {
    /// Variables at a point.
    pub variables: usize,
    /// Stimuli at a point.
    pub stimuli: usize,
    /// Oldest first. Two levels of the same time mark a jump of the rates.
    pub levels: VecDeque<Level>,
}

/// The history at one time.
#[derive(Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Level {
    pub time: f64,
    /// A row for every material point of the growth zone: variables, their rates, stimuli.
    pub rows: Vec<f64>,
}

impl Clone for Level {
    fn clone(&self) -> Self {
        Self { time: self.time, rows: self.rows.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.time = source.time;
        self.rows.clone_from(&source.rows);
    }
}

impl Clone for History {
    fn clone(&self) -> Self {
        Self { variables: self.variables, stimuli: self.stimuli, levels: self.levels.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.variables = source.variables;
        self.stimuli = source.stimuli;
        self.levels.truncate(source.levels.len());
        let kept = self.levels.len();
        for (to, from) in self.levels.iter_mut().zip(&source.levels) {
            to.clone_from(from);
        }
        self.levels.extend(source.levels.iter().skip(kept).cloned());
    }
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self {
            time: self.time,
            rod: self.rod.clone(),
            earlier: self.earlier.clone(),
            known: self.known,
            history: self.history.clone(),
            smooth_since: self.smooth_since,
        }
    }

    /// Reuses the memory of `self`.
    fn clone_from(&mut self, source: &Self) {
        self.time = source.time;
        self.smooth_since = source.smooth_since;
        self.known = source.known;
        self.rod.clone_from(&source.rod);
        self.history.clone_from(&source.history);
        self.earlier.truncate(source.earlier.len());
        let kept = self.earlier.len();
        for (to, from) in self.earlier.iter_mut().zip(&source.earlier) {
            to.time = from.time;
            to.rotations.clone_from(&from.rotations);
        }
        self.earlier.extend_from_slice(&source.earlier[kept..]);
    }
}

impl History {
    /// Numbers in a row.
    pub fn width(&self) -> usize {
        2 * self.variables + self.stimuli
    }
}

impl State {
    /// A shoot at rest at t = 0 that no integrator has started yet.
    pub(crate) fn new(rod: Rod) -> Self {
        Self { time: 0.0, rod, earlier: Vec::new(), known: 0, history: History::default(), smooth_since: 0.0 }
    }

    /// Time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The rod: its material points and its shape.
    #[must_use]
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// The variables that the tropism laws keep at a material point of the growth zone, by the point's index among all
    /// points of the rod; nothing for a mature point, or before an integrator has started.
    #[must_use]
    pub fn variables(&self, point: usize) -> Option<&[f64]> {
        let level = self.history.levels.back()?;
        let first = self.rod.first_growing() * self.rod.order().points();
        let at = point.checked_sub(first)? * self.history.width();
        level.rows.get(at..at + self.history.variables)
    }

    /// Forgets earlier equilibria and makes room for as many as a guess is extrapolated from.
    pub(crate) fn make_room_for_guesses(&mut self) {
        self.known = 0;
        self.earlier.clear();
        let room = || Earlier { time: self.time, rotations: self.rod.rotations.clone() };
        self.earlier.extend((0..EARLIER).map(|_| room()));
    }

    /// Cuts an element, with everything that lives on it now and in the past.
    pub(crate) fn split(&mut self, e: usize, x: f64) {
        let basis = self.rod.basis();
        for earlier in &mut self.earlier {
            split_rotations(basis, &mut earlier.rotations, e, x);
        }
        let width = self.history.width();
        if e >= self.rod.first_growing && width > 0 {
            let (p, block) = (basis.p, e - self.rod.first_growing);
            let (left, right) = (part_weights(basis, 0.0, x), part_weights(basis, x, 1.0));
            for level in &mut self.history.levels {
                split_rows(&mut level.rows, block * p * width, p, width, &left, &right);
            }
        }
        self.rod.split(e, x);
    }

    /// Makes two mature elements one if that loses no more than `tolerance`, rad.
    pub(crate) fn merge(&mut self, e: usize, tolerance: f64) -> bool {
        let first = self.rod.element_length(e);
        let share = first / (first + self.rod.element_length(e + 1));
        if !self.rod.merge(e, tolerance) {
            return false;
        }
        for earlier in &mut self.earlier {
            merge_rotations(self.rod.basis(), &mut earlier.rotations, e, share);
        }
        true
    }

    /// Takes the first `elements` growing elements out of the growth zone.
    pub(crate) fn mature(&mut self, elements: usize) {
        let gone = elements * self.rod.order.points() * self.history.width();
        self.rod.first_growing += elements;
        for level in &mut self.history.levels {
            level.rows.drain(..gone);
        }
    }
}

/// Replaces the `p` rows from `at` by the 2 `p` rows of the two parts.
fn split_rows(
    rows: &mut Vec<f64>,
    at: usize,
    p: usize,
    width: usize,
    left: &[[f64; crate::basis::MAX_POINTS]; crate::basis::MAX_POINTS],
    right: &[[f64; crate::basis::MAX_POINTS]; crate::basis::MAX_POINTS],
) {
    let size = p * width;
    let end = rows.len();
    // The old rows move to the end of the gap's far side: make room for one more element, then overwrite both.
    rows.resize(end + size, 0.0);
    rows.copy_within(at + size..end, at + 2 * size);
    for column in 0..width {
        let mut old = [0.0; crate::basis::MAX_POINTS];
        for g in 0..p {
            old[g] = rows[at + g * width + column];
        }
        for g in 0..p {
            let sum = |weights: &[f64; crate::basis::MAX_POINTS]| -> f64 {
                weights.iter().zip(old).map(|(w, v)| w * v).sum()
            };
            rows[at + g * width + column] = sum(&left[g]);
            rows[at + size + g * width + column] = sum(&right[g]);
        }
    }
}
