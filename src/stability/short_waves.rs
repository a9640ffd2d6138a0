//! What short waves feel: a point by itself, an element by itself.
//!
//! Waves that are short against everything leave the couple as it is. What is left of the linear problem is the strain at
//! a point and the turn of the frames above it, a Volterra operator, which has no roots of its own. Its discretisation
//! has some, where |a| h is not small, a the gain from turn to strain and h the length of an element. They are divided out.

use nalgebra::{Complex, DMatrix, Vector3};

use super::Linearisation;
use super::characteristic::{Pair, Part, Sample};
use super::linear::Transfers;
use super::settled::Settled;
use crate::rod::Rod;

/// Elements whose own problems differ by less than this share of their response are alike: rounding of the differences.
const ALIKE: f64 = 1e-8;

/// An error of the short waves that changes the characteristic function by less than this share of itself does not change
/// the number of its zeros (Rouché asks for less than one; the error is an estimate, hence a quarter).
pub(super) const BLURRED: f64 = 0.25;
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
    /// They go as exp(Gs), G the gain from turn to strain, and Gauss collocation makes of exp(Gh) its diagonal Padé
    /// approximant. Waves that are not resolved matter as far as the function feels them: by elasticity, which couples the
    /// far end of the shoot, where they have grown, to its base.
    pub(super) fn blur(&self, z: Complex<f64>, transfers: &Transfers, at: &Sample, part: Part) -> f64 {
        let Part::Block(block) = part else { return 0.0 };
        let (mut error, mut waves, mut growth, mut local) = (0.0, 0.0, 0.0, 0.0_f64);
        for element in &self.elements[block] {
            let p = element.points as u32;
            let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
            let factor = factorial(p).powi(2) / (factorial(2 * p) * factorial(2 * p + 1));
            let (gain, own) = self.gain(z, transfers, element);
            if !gain.iter().all(|x| x.is_finite()) {
                return f64::INFINITY;
            }
            let (wave, number) = (gain.norm() * element.length, element.number as f64);
            error += number * factor * wave.powi(2 * p as i32 + 1);
            waves += number * wave;
            let symmetric = (&gain + gain.adjoint()) * Complex::from(0.5 * element.length);
            growth += number * symmetric.symmetric_eigenvalues().max();
            local = local.max((own * z).norm());
        }
        if !(error > 0.1 * BLURRED / STEEP) {
            return 0.0;
        }
        // What waves that have grown along the shoot may have of the function ...
        let expected = self.elasticity[block] * local * growth.exp() / (waves * waves).max(1.0);
        // ... and what they have of what the mesh makes of it: a share A exp(−κℓ) varies by |A κ'| ℓ, where κ' is of the
        // size of κ over the distance to zero or to the essential spectrum, whichever is nearer.
        let found = at.log_slope.norm() / (at.nearness.max(1.0 / z.norm()) * waves.max(1.0));
        expected.max(found).min(STEEP) * f64::min(error, 1.0)
    }

    /// The gain from turn to strain of an element, (λ − T ∂x/∂u)⁻¹ T ∂x/∂φ in 1/m, and its first factor.
    fn gain(&self, z: Complex<f64>, transfers: &Transfers, element: &Element) -> Pair {
        let (kind, driven) = self.first_point(element);
        let n = driven.len();
        let own = self.local_matrix(z, transfers, kind, &driven).0.try_inverse();
        let own = own.unwrap_or_else(|| DMatrix::from_element(n, n, Complex::from(f64::INFINITY)));
        let turn = &transfers[kind].0 * element.turn.map(Complex::from);
        let gain = &own * DMatrix::from_fn(n, n, |i, j| turn[(driven[i], driven[j])]);
        (gain, own)
    }

    /// How much of the response to a turn is elastic, in every block: its norm relative to that of a rigid shoot. One at
    /// most: next to buckling it has no bound, but what grows there is the longest wave.
    pub(super) fn find_elasticity(&mut self, rod: &Rod, settled: &Settled) {
        let (p, m, first) = (rod.order().points(), self.stimuli, rod.first_growing());
        let points = settled.places.len();
        let frames: Vec<_> = (0..points).map(|point| rod.frame_at_point(first + point / p, point % p)).collect();
        let weight = |i: usize, j: usize| {
            let at = |point: usize| rod.element_points(first + point / p)[point % p].jacobian;
            match (j / p).cmp(&(i / p)) {
                std::cmp::Ordering::Less => rod.basis().weights[j % p] * at(j),
                std::cmp::Ordering::Equal => rod.basis().upto[i % p][j % p] * at(j),
                std::cmp::Ordering::Greater => 0.0,
            }
        };
        self.elasticity.clear();
        for block in &self.blocks {
            let (mut elastic, mut rigid) = (vec![0.0; m], vec![0.0; m]);
            // A unit of every unknown, in the fixed frame.
            let axes: Vec<Vector3<f64>> = block
                .iter()
                .map(|&unknown| self.unknowns[unknown])
                .map(|(j, c)| frames[j] * Vector3::ith(c, 1.0))
                .collect();
            for i in 0..points {
                let back = frames[i].inverse();
                for (&unknown, axis) in block.iter().zip(&axes) {
                    let (j, c) = self.unknowns[unknown];
                    // The turn at i, along its directors, by a bend at j.
                    let turn = back * axis * weight(i, j);
                    for k in 0..m {
                        let turned: f64 = (0..3).map(|d| settled.turn[i][(k, d)] * turn[d]).sum();
                        let own = if i == j { settled.local[i][(k, c)] } else { 0.0 };
                        rigid[k] += turned * turned;
                        elastic[k] += (self.response[(i * m + k, unknown)] - own - turned).powi(2);
                    }
                }
            }
            let shares = elastic.iter().zip(&rigid).filter(|(_, rigid)| **rigid > 0.0).map(|(e, r)| (e / r).sqrt());
            self.elasticity.push(shares.fold(0.0, f64::max).min(1.0));
        }
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
