//! Changes of the elements of the growth zone, at every level of the history.

use super::History;
use crate::reference_element::MAX_POINTS;

/// Weights that map the values at the points of an element to the values at the points of a part of it.
type PartWeights = [[f64; MAX_POINTS]; MAX_POINTS];

/// Number of columns of the rows that are interpolated at once: a multiple of the width of vector registers.
const COLUMNS: usize = 8;

/// Returns the weighted sum of some rows.
#[inline]
fn combined(weights: &[f64; MAX_POINTS], rows: &[[f64; COLUMNS]; MAX_POINTS]) -> [f64; COLUMNS] {
    let mut sum = [0.0; COLUMNS];
    for (weight, row) in weights.iter().zip(rows) {
        for (sum, x) in sum.iter_mut().zip(row) {
            *sum += weight * x;
        }
    }
    sum
}

impl History {
    /// Replaces the `p` points of an element, from point `first` on, by the 2 `p` points of its two parts, at
    /// every level.
    pub fn split(&mut self, first: usize, p: usize, parts: [&PartWeights; 2]) {
        let width = self.width();
        for level in &mut self.levels {
            let rows = &mut level.rows;
            let end = rows.len();
            let (from, to) = (end - (first + p) * width, end - first * width);
            rows.resize(end + p * width, 0.0);
            rows.copy_within(to..end, to + p * width);
            let rows = &mut rows[from..to + p * width];
            for column in (0..width).step_by(COLUMNS) {
                let columns = column..width.min(column + COLUMNS);
                let mut old = [[0.0; COLUMNS]; MAX_POINTS];
                for (g, old) in old.iter_mut().enumerate().take(p) {
                    let row = (p - 1 - g) * width;
                    old[..columns.len()].copy_from_slice(&rows[row + columns.start..row + columns.end]);
                }
                for (part, weights) in parts.iter().enumerate() {
                    for g in 0..p {
                        let row = (2 * p - 1 - (part * p + g)) * width;
                        let sum = combined(&weights[g], &old);
                        rows[row + columns.start..row + columns.end].copy_from_slice(&sum[..columns.len()]);
                    }
                }
            }
        }
    }

    /// Drops the first `points` points at every level. They have left the growth zone.
    pub fn drain(&mut self, points: usize) {
        let gone = points * self.width();
        for level in &mut self.levels {
            level.rows.truncate(level.rows.len().saturating_sub(gone));
        }
    }
}
