//! What does not couple: planes of an upright shoot, say.

use nalgebra::{Complex, DMatrix};

use super::Linearisation;
use super::characteristic::Part;

/// Couplings weaker than this against the strongest are rounding.
const UNCOUPLED: f64 = 1e-7;

impl Linearisation {
    /// Finds what does not couple, in the whole and in the local problems.
    pub(super) fn find_blocks(&mut self) {
        // No coupling vanishes at all of them.
        let places = self.probes();
        let strength = |matrix: &dyn Fn(Complex<f64>) -> DMatrix<Complex<f64>>| {
            places.iter().map(|z| matrix(*z).map(|entry| entry.norm()) / z.norm()).reduce(|a, b| a + b)
        };
        let all: Vec<usize> = (0..self.unknowns.len()).collect();
        self.blocks = strength(&|z| self.matrix(z, &all).0).map_or_else(Vec::new, |s| components(&s));
        self.local_blocks.clear();
        for kind in 0..self.transfers.len() {
            let transfer = &self.transfers[kind];
            let driven: Vec<usize> = (0..3).filter(|&c| transfer.drives(c)).collect();
            // A law that does not answer to the strain at its own place has no short waves of its own.
            let answers = |z: &Complex<f64>| {
                let (t, _) = transfer.at(*z);
                let answer = (&t * transfer.local.map(Complex::from)).map(|x| x.norm());
                // More than the rounding of a sum that cancels.
                let terms = t.map(|x| x.norm()) * transfer.local.abs();
                answer.iter().zip(&terms).any(|(answer, terms)| *answer > 1e-12 * terms)
            };
            // So has one whose variables grow by themselves.
            let grows = transfer.memory.iter().any(|rate| rate.re > 0.0);
            if !grows && !places.iter().any(answers) {
                continue;
            }
            let strength = strength(&|z| self.local_matrix(z, &self.transfers_at(z), kind, &driven).0);
            for block in strength.map_or_else(Vec::new, |s| components(&s)) {
                let components: Vec<usize> = block.iter().map(|&i| driven[i]).collect();
                self.local_blocks.push((kind, components));
            }
        }
    }

    /// Finds blocks with equal characteristic functions, up to the accuracy of the differences.
    pub(super) fn find_twins(&mut self) {
        let places = self.probes();
        let values =
            |block: usize| places.iter().map(|z| self.characteristic(*z, Part::Block(block)).value).collect::<Vec<_>>();
        let all: Vec<_> = (0..self.blocks.len()).map(values).collect();
        let alike = |a: usize, b: usize| all[a].iter().zip(&all[b]).all(|(x, y)| (x - y).norm() <= 1e-6 * x.norm());
        let first = |block: usize| (0..block).find(|&other| alike(other, block)).unwrap_or(block);
        self.twins = (0..self.blocks.len()).map(first).collect();
    }

    /// All parts of the spectrum that differ: the essential one, then the blocks.
    pub(super) fn parts(&self) -> impl Iterator<Item = Part> {
        let blocks = self.distinct_blocks().into_iter().map(|(block, _)| Part::Block(block));
        (0..self.local_blocks.len()).map(Part::Essential).chain(blocks)
    }

    /// Blocks with different characteristic functions, and how many there are of each.
    pub(super) fn distinct_blocks(&self) -> Vec<(usize, usize)> {
        let own = |&block: &usize| self.twins[block] == block;
        let size = |block: usize| self.twins.iter().filter(|&&twin| twin == block).count();
        (0..self.blocks.len()).filter(own).map(|block| (block, size(block))).collect()
    }
}

/// Sets of indices that are coupled, directly or through others, by entries that are more than rounding.
fn components(strength: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let n = strength.nrows();
    let pairs = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|(i, j)| i != j);
    let threshold = UNCOUPLED * pairs().map(|at| strength[at]).fold(f64::MIN_POSITIVE, f64::max);
    // Couplings below rounding of the diagonal do not count either.
    let threshold = threshold.max(1e-9 * strength.diagonal().max());
    let mut label: Vec<usize> = (0..n).collect();
    loop {
        let mut changed = false;
        for (i, j) in pairs() {
            if strength[(i, j)] > threshold && label[i] != label[j] {
                let least = label[i].min(label[j]);
                (label[i], label[j]) = (least, least);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    let mut names = label.clone();
    names.sort_unstable();
    names.dedup();
    names.iter().map(|name| (0..n).filter(|&i| label[i] == *name).collect()).collect()
}
