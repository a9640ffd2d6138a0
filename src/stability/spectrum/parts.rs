//! The spectrum in parts that do not couple, such as the two planes of an upright shoot.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix};

use super::analytic::Analytic;
use super::block::{Block, LocalBlock};
use super::characteristic::CharacteristicMatrix;
use super::sets::connected;
use super::transfer::{ROUNDING, TransferFunction};
use crate::linearisation::Outcome;

/// Identifies a part of the spectrum in all linearisations of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::stability) enum SpectrumPart {
    /// A block of unknowns.
    Isolated(usize),
    /// A kind of point, or some of its components.
    Essential(usize),
}

/// A root, and the part that it belongs to.
#[derive(Debug, Clone, Copy)]
pub(in crate::stability) struct PartRoot {
    pub part: SpectrumPart,
    pub value: Complex<f64>,
}

/// Divides a characteristic matrix into local matrices of points, and blocks.
///
/// # Errors
/// Roots next to zero that are not found.
pub(super) fn divide(
    characteristic: &Arc<CharacteristicMatrix>,
) -> Outcome<(Vec<LocalBlock>, Vec<Block>)> {
    // No coupling vanishes at all of these λ.
    let probes = characteristic.probes();
    let mut blocks: Vec<Block> = sets_that_couple(&probes, |z| characteristic.whole(z))
        .into_iter()
        .map(|set| Block::new(characteristic, set))
        .collect::<Result<_, _>>()?;
    count_equal(&mut blocks, &probes);
    let mut points = Vec::new();
    for (kind, transfer) in characteristic
        .transfers
        .iter()
        .enumerate()
        .filter(|(_, t)| has_short_waves(t, &probes))
    {
        let characteristic = Arc::clone(characteristic);
        let whole = LocalBlock {
            characteristic,
            kind,
            components: transfer.driven(),
        };
        let sets = sets_that_couple(&probes, |z| whole.matrix(z, &transfer.at(z)).value);
        let components = |set: &[usize]| set.iter().map(|&i| whole.components[i]).collect();
        points.extend(sets.iter().map(|set| LocalBlock {
            components: components(set),
            ..whole.clone()
        }));
    }
    Ok((points, blocks))
}

/// Finds blocks whose characteristic functions are equal up to the accuracy of the differences, and
/// counts them in the first of them.
fn count_equal(blocks: &mut [Block], probes: &[Complex<f64>]) {
    let values: Vec<Vec<Complex<f64>>> = blocks
        .iter()
        .map(|block| probes.iter().map(|z| block.at(*z).value).collect())
        .collect();
    // All characteristic functions tend to one far right. Equal blocks agree relative to their
    // difference from one. The values have rounding errors of some 1e-12.
    let close = |x: &Complex<f64>, y: &Complex<f64>| {
        (x - y).norm() <= 1e-6 * (x - Complex::ONE).norm() + 1e-11
    };
    let equal = |a: usize, b: usize| values[a].iter().zip(&values[b]).all(|(x, y)| close(x, y));
    for i in 1..blocks.len() {
        if let Some(first) = (0..i).find(|&first| blocks[first].multiplicity > 0 && equal(first, i))
        {
            blocks[first].multiplicity += 1;
            blocks[i].multiplicity = 0;
        }
    }
}

/// Whether the gradients at the points of a kind depend on the strain at their own place, or
/// variables grow without a stimulus.
fn has_short_waves(transfer: &TransferFunction, probes: &[Complex<f64>]) -> bool {
    let answers = |z: &Complex<f64>| {
        let t = transfer.at(*z).value;
        let answer = (&t * transfer.local.map(Complex::from)).map(|x| x.norm());
        // The threshold is the rounding of a sum that cancels.
        let terms = t.map(|x| x.norm()) * transfer.local.abs();
        answer
            .iter()
            .zip(&terms)
            .any(|(answer, terms)| *answer > 1e-12 * terms)
    };
    transfer.own_rates.iter().any(|rate| rate.re > 0.0) || probes.iter().any(answers)
}

/// Sets of indices that couple, directly or through others, by entries of a matrix that are more
/// than rounding at some λ.
fn sets_that_couple(
    probes: &[Complex<f64>],
    matrix: impl Fn(Complex<f64>) -> DMatrix<Complex<f64>>,
) -> Vec<Vec<usize>> {
    let strengths = probes
        .iter()
        .map(|z| matrix(*z).map(|entry| entry.norm()) / z.norm());
    let Some(strength) = strengths.reduce(|a, b| a + b) else {
        return Vec::new();
    };
    let n = strength.nrows();
    let pairs = || {
        (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .filter(|(i, j)| i != j)
    };
    // Rounding of the responses, with a margin, relative to the strongest coupling.
    let threshold = 10.0
        * ROUNDING
        * pairs()
            .map(|at| strength[at])
            .fold(f64::MIN_POSITIVE, f64::max);
    // Couplings below the rounding of the diagonal are ignored, too.
    let threshold = threshold.max(1e-9 * strength.diagonal().max());
    connected(n, pairs().filter(|&at| strength[at] > threshold))
}
