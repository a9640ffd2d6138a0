//! What short waves feel: a point by itself, an element by itself.
//!
//! Waves that are short against everything leave the couple as it is. What is left of the linear problem is the strain at
//! a point and the turn of the frames above it, a Volterra operator, which has no roots of its own. Its discretisation
//! has some, where |a| h is not small, a the gain from turn to strain and h the length of an element. They are divided out.

use nalgebra::{Complex, DMatrix};

use super::Linearisation;
use super::characteristic::{Pair, Part, Sample};
use super::linear::Transfers;
use super::settled::Settled;
use crate::rod::Rod;

/// Elements whose own problems differ by less than this share of their response are alike: rounding of the differences.
const ALIKE: f64 = 1e-8;

/// Below this variation of the characteristic function no error of the short waves is worth a look.
const NEGLIGIBLE: f64 = 0.1;
/// Steeper than this the function is only next to a root, which the error moves.
const STEEP: f64 = 10.0;

/// The own problem of an element in a block: the frame at its start and its elastic strain are kept.
#[derive(Debug, Clone)]
pub(super) struct Element {
    /// The first of its material points, and how many it has.
    first: usize,
    points: usize,
    /// Its length, m.
    length: f64,
    /// ∂stimuli/∂turn of the frame, where it is largest.
    turn: DMatrix<f64>,
    /// Its unknowns: point and component.
    pub unknowns: Vec<(usize, usize)>,
    /// Its response: rows (point of the element, stimulus), columns its unknowns.
    pub response: DMatrix<f64>,
    /// How many elements of the block are like it.
    pub number: usize,
}

impl Linearisation {
    /// Finds the own problems of the elements of every block.
    pub(super) fn find_elements(&mut self, rod: &Rod, settled: &Settled) {
        let (p, m) = (rod.order().points(), self.stimuli);
        self.elements.clear();
        for block in &self.blocks {
            let mut elements: Vec<Element> = Vec::new();
            let mut of_block: Vec<(usize, usize)> = block.iter().map(|&unknown| self.unknowns[unknown]).collect();
            of_block.sort_unstable();
            for unknowns in of_block.chunk_by(|a, b| a.0 / p == b.0 / p) {
                let (e, first) = (unknowns[0].0 / p, unknowns[0].0 / p * p);
                let points = rod.element_points(rod.first_growing() + e);
                let response = DMatrix::from_fn(p * m, unknowns.len(), |row, col| {
                    let (g, k) = (row / m, row % m);
                    let (j, c) = (unknowns[col].0 - first, unknowns[col].1);
                    let turn = rod.basis().upto[g][j] * points[j].jacobian;
                    let own = if g == j { settled.local[first + g][(k, c)] } else { 0.0 };
                    own + settled.turn[first + g][(k, c)] * turn
                });
                let turns = settled.turn[first..first + p].iter();
                let element = Element {
                    first,
                    points: p,
                    length: rod.element_length(rod.first_growing() + e),
                    turn: turns.max_by(|a, b| a.norm().total_cmp(&b.norm())).cloned().unwrap_or_default(),
                    unknowns: unknowns.to_vec(),
                    response,
                    number: 1,
                };
                match elements.iter_mut().find(|other| self.are_alike(other, &element)) {
                    Some(other) => other.number += 1,
                    None => elements.push(element),
                }
            }
            self.elements.push(elements);
        }
    }

    fn are_alike(&self, a: &Element, b: &Element) -> bool {
        let places =
            |of: &Element| -> Vec<_> { of.unknowns.iter().map(|&(i, c)| (i - of.first, c, self.kind[i])).collect() };
        places(a) == places(b) && (&a.response - &b.response).amax() <= ALIKE * a.response.amax()
    }

    /// The matrix of an element's own problem and its derivative.
    pub(super) fn element_matrix(&self, z: Complex<f64>, transfers: &Transfers, element: &Element) -> Pair {
        let columns: Vec<usize> = (0..element.unknowns.len()).collect();
        self.assemble(z, transfers, &element.unknowns, &element.response, &columns, element.first)
    }

    /// By what share of itself the characteristic function of a block may change at λ for the error of the short waves.
    ///
    /// They go as exp(−κs), κ the gain from turn to strain, and Gauss collocation makes of exp(−κh) its diagonal Padé
    /// approximant. Waves that are not resolved matter only where the function feels them, and so varies.
    pub(super) fn blur(&self, z: Complex<f64>, at: &Sample, part: Part) -> f64 {
        let Part::Block(block) = part else { return 0.0 };
        if !((z * at.log_slope).norm() >= NEGLIGIBLE) {
            return 0.0;
        }
        let transfers = self.transfers_at(z);
        let (mut error, mut waves) = (0.0, 0.0);
        for element in &self.elements[block] {
            let p = element.points as u32;
            let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
            let factor = factorial(p).powi(2) / (factorial(2 * p) * factorial(2 * p + 1));
            let (wave, number) = (self.wave(z, &transfers, element), element.number as f64);
            error += number * factor * wave.powi(2 * p as i32 + 1);
            waves += number * wave;
        }
        // A share A exp(−κℓ) of the function varies by |A κ'| ℓ, where κ' is of the size of κ over the distance to zero or
        // to the essential spectrum, whichever is nearer.
        let rate = at.nearness.max(1.0 / z.norm()) * waves.max(1.0);
        (at.log_slope.norm() / rate).min(STEEP) * f64::min(error, 1.0)
    }

    /// |κ| h of an element.
    fn wave(&self, z: Complex<f64>, transfers: &Transfers, element: &Element) -> f64 {
        let (kind, driven) = self.first_point(element);
        let own = self.local_matrix(z, transfers, kind, &driven).0;
        let gain = &transfers[kind].0 * element.turn.map(Complex::from);
        let gain = DMatrix::from_fn(driven.len(), driven.len(), |i, j| gain[(driven[i], driven[j])]);
        own.lu().solve(&gain).map_or(f64::INFINITY, |kappa| kappa.norm()) * element.length
    }

    /// The inverse distance of the essential spectrum of an element's first point, s.
    pub(super) fn nearness(&self, z: Complex<f64>, transfers: &Transfers, element: &Element) -> f64 {
        let (kind, driven) = self.first_point(element);
        let (own, slope) = self.local_matrix(z, transfers, kind, &driven);
        own.lu().solve(&slope).map_or(f64::INFINITY, |quotient| quotient.norm())
    }

    /// The kind of the first point of an element, and the components that are driven there.
    fn first_point(&self, element: &Element) -> (usize, Vec<usize>) {
        let (point, _) = element.unknowns[0];
        let here = element.unknowns.iter().take_while(|unknown| unknown.0 == point);
        (self.kind[point], here.map(|unknown| unknown.1).collect())
    }

    /// The local problem at the points of one kind: what infinitely short waves feel. Their elastic strain and their
    /// turn of the shoot vanish, so a point sees its own intrinsic strain alone.
    pub(super) fn local_matrix(&self, z: Complex<f64>, transfers: &Transfers, kind: usize, driven: &[usize]) -> Pair {
        let (t, dt) = &transfers[kind];
        let n = driven.len();
        let local = self.transfers[kind].local.map(Complex::from);
        let (t, dt) = (t * &local, dt * &local);
        let value = DMatrix::from_fn(n, n, |i, j| {
            let diagonal = if i == j { z } else { Complex::ZERO };
            diagonal - t[(driven[i], driven[j])]
        });
        let slope = DMatrix::from_fn(n, n, |i, j| {
            let diagonal: Complex<f64> = if i == j { Complex::ONE } else { Complex::ZERO };
            diagonal - dt[(driven[i], driven[j])]
        });
        (value, slope)
    }
}
