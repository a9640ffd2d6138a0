//! The spectrum in parts: what does not couple, planes of an upright shoot say.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix};

use super::analytic::Analytic;
use super::block::Block;
use super::linear::LinearProblem;
use super::sets::connected;
use super::short_waves::LocalProblem;

/// Couplings weaker than this against the strongest are rounding.
const UNCOUPLED: f64 = 1e-7;

/// Names a part of the spectrum, the same one in the linear problems of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// A block of unknowns.
    Isolated(usize),
    /// A local problem.
    Essential(usize),
}

/// A root, and the part that it belongs to.
pub(super) type Found = (Part, Complex<f64>);

/// All parts of a linear problem.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    pub local: Vec<LocalProblem>,
    blocks: Vec<Block>,
}

impl Spectrum {
    pub fn of(problem: &Arc<LinearProblem>) -> Self {
        // No coupling vanishes at all of them.
        let probes = problem.probes();
        let all: Vec<usize> = (0..problem.unknowns.len()).collect();
        let whole = |z| problem.matrix(z, &problem.transfers_at(z), &problem.response, &all).value;
        let mut blocks: Vec<Block> =
            sets_that_couple(&probes, whole).into_iter().map(|set| Block::new(problem, set)).collect();
        count_equal(&mut blocks, &probes);
        let mut local = Vec::new();
        for kind in 0..problem.transfers.len() {
            let driven = problem.transfers[kind].driven();
            let components = driven.clone();
            let whole = LocalProblem { problem: Arc::clone(problem), kind, components };
            if has_short_waves(problem, kind, &probes) {
                for set in sets_that_couple(&probes, |z| whole.matrix(z, &problem.transfers[kind].at(z)).value) {
                    local.push(LocalProblem { components: set.iter().map(|&i| driven[i]).collect(), ..whole.clone() });
                }
            }
        }
        Self { local, blocks }
    }

    /// The part of a name; a problem of a family may lack it.
    pub fn part(&self, name: Part) -> Option<&dyn Analytic> {
        match name {
            Part::Isolated(i) => self.blocks.get(i).map(|block| block as &dyn Analytic),
            Part::Essential(i) => self.local.get(i).map(|local| local as &dyn Analytic),
        }
    }

    /// All parts that differ: the essential ones, then the isolated ones.
    pub fn names(&self) -> impl Iterator<Item = Part> {
        (0..self.local.len()).map(Part::Essential).chain(self.blocks().map(|(name, _)| name))
    }

    /// All blocks, equal ones too.
    pub fn all_blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The blocks that differ.
    pub fn blocks(&self) -> impl Iterator<Item = (Part, &Block)> {
        let named = self.blocks.iter().enumerate().map(|(i, block)| (Part::Isolated(i), block));
        named.filter(|(_, block)| block.multiplicity > 0)
    }
}

/// Finds blocks with equal characteristic functions, up to the accuracy of the differences; the first of them stands for
/// all.
fn count_equal(blocks: &mut [Block], probes: &[Complex<f64>]) {
    let values: Vec<Vec<Complex<f64>>> =
        blocks.iter().map(|block| probes.iter().map(|z| block.at(*z).value).collect()).collect();
    let equal = |a: usize, b: usize| values[a].iter().zip(&values[b]).all(|(x, y)| (x - y).norm() <= 1e-6 * x.norm());
    for i in 1..blocks.len() {
        if let Some(first) = (0..i).find(|&first| blocks[first].multiplicity > 0 && equal(first, i)) {
            blocks[first].multiplicity += 1;
            blocks[i].multiplicity = 0;
        }
    }
}

/// Whether the laws at the points of a kind answer to the strain at their own place, or have variables that grow
/// without being driven.
fn has_short_waves(problem: &LinearProblem, kind: usize, probes: &[Complex<f64>]) -> bool {
    let transfer = &problem.transfers[kind];
    let answers = |z: &Complex<f64>| {
        let t = transfer.at(*z).value;
        let answer = (&t * transfer.local.map(Complex::from)).map(|x| x.norm());
        // More than the rounding of a sum that cancels.
        let terms = t.map(|x| x.norm()) * transfer.local.abs();
        answer.iter().zip(&terms).any(|(answer, terms)| *answer > 1e-12 * terms)
    };
    transfer.own_rates.iter().any(|rate| rate.re > 0.0) || probes.iter().any(answers)
}

/// Sets of indices that couple, directly or through others, by entries of a matrix that are more than rounding at some λ.
fn sets_that_couple(
    probes: &[Complex<f64>],
    matrix: impl Fn(Complex<f64>) -> DMatrix<Complex<f64>>,
) -> Vec<Vec<usize>> {
    let strengths = probes.iter().map(|z| matrix(*z).map(|entry| entry.norm()) / z.norm());
    let Some(strength) = strengths.reduce(|a, b| a + b) else { return Vec::new() };
    let n = strength.nrows();
    let pairs = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|(i, j)| i != j);
    let threshold = UNCOUPLED * pairs().map(|at| strength[at]).fold(f64::MIN_POSITIVE, f64::max);
    // Couplings below rounding of the diagonal do not count either.
    let threshold = threshold.max(1e-9 * strength.diagonal().max());
    connected(n, pairs().filter(|&at| strength[at] > threshold))
}
