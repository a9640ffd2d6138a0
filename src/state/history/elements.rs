//! Changes of the elements of the growth zone, at every level of the history.

use super::History;
use crate::reference_element::MAX_POINTS;
use crate::rod::PartWeights;

/// Writes the weighted sum of the rows of an element's points.
// Not inlined, so that the sums are vectorised.
#[inline(never)]
fn combine(weights: &[f64; MAX_POINTS], rows: [&[f64]; MAX_POINTS], to: &mut [f64]) {
    let [w0, w1, w2, w3] = *weights;
    let [first, second, third, fourth] = rows;
    for ((((to, x0), x1), x2), x3) in to.iter_mut().zip(first).zip(second).zip(third).zip(fourth) {
        *to = w0 * x0 + w1 * x1 + w2 * x2 + w3 * x3;
    }
}

impl History {
    /// Replaces the `p` points of an element, from point `first` on, by the 2 `p` points of its two
    /// parts, at every level.
    pub fn split(&mut self, first: usize, p: usize, parts: &[PartWeights; 2]) {
        let width = self.width();
        for level in &mut self.levels {
            let rows = &mut level.rows;
            let end = rows.len();
            let (from, to, size) = (end - (first + p) * width, end - first * width, p * width);
            // The rows of the element are kept behind the new ones until these are computed.
            rows.resize(end + 2 * size, 0.0);
            rows.copy_within(to..end, to + size);
            rows.copy_within(from..to, end + size);
            let (rows_of_parts, old) = rows.split_at_mut(end + size);
            // Weights of points that an element of lower order does not have are zero.
            let old = std::array::from_fn(|g| &old[(p - 1 - g.min(p - 1)) * width..][..width]);
            let weights = parts.iter().flat_map(|part| &part[..p]);
            let new = rows_of_parts[from..to + size]
                .chunks_exact_mut(width.max(1))
                .rev();
            new.zip(weights)
                .for_each(|(to, weights)| combine(weights, old, to));
            rows.truncate(end + size);
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
