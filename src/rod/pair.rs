//! Merging of two neighbouring elements: the projection of the fields, and its error.

use nalgebra::Vector3;

use super::loss::{MergedPart, MergingLoss};
use super::{MaterialPoint, Rod, weighted};
use crate::numerics::quadrature::legendre_sequence;
use crate::numerics::scalar::largest;
use crate::reference_element::{MAX_POINTS, ReferenceElement};

/// Two elements that may be merged.
pub(super) struct Pair<'a> {
    reference: &'static ReferenceElement,
    source: &'a [MaterialPoint],
    /// Lengths of the two elements, m.
    lengths: [f64; 2],
    /// Coordinate of every point in the merged element by arc length, and its weight.
    places: [(f64, f64); 2 * MAX_POINTS],
    /// Weights of the points of the merged element for the value at each point.
    interpolation: [[f64; MAX_POINTS]; 2 * MAX_POINTS],
}

impl<'a> Pair<'a> {
    /// The elements `e` and `e` + 1 of a rod.
    pub fn of(rod: &'a Rod, e: usize) -> Self {
        let reference = rod.reference();
        let p = reference.p;
        let lengths = [e, e + 1].map(|e| rod.length_of(e));
        let total = lengths[0] + lengths[1];
        let mut places = [(0.0, 0.0); 2 * MAX_POINTS];
        for (side, start) in [0.0, lengths[0]].into_iter().enumerate() {
            let points = rod.element_points(e + side);
            for g in 0..p {
                let s: f64 = (0..p)
                    .map(|j| reference.upto[g][j] * points[j].jacobian)
                    .sum();
                places[side * p + g] = (
                    (start + s) / total,
                    reference.weights[g] * points[g].jacobian / total,
                );
            }
        }
        let interpolation = places.map(|(x, _)| reference.at_points(x));
        Self {
            reference,
            source: &rod.points[e * p..(e + 2) * p],
            lengths,
            places,
            interpolation,
        }
    }

    /// Length of the merged element, m.
    pub fn length(&self) -> f64 {
        self.lengths[0] + self.lengths[1]
    }

    /// Length of the first element over that of the merged one.
    pub fn share(&self) -> f64 {
        self.lengths[0] / self.length()
    }

    /// The points of the two elements with their places and weights.
    fn each(&self) -> impl Iterator<Item = (&MaterialPoint, f64, f64)> {
        self.source
            .iter()
            .zip(&self.places)
            .map(|(point, (x, w))| (point, *x, *w))
    }

    /// Weights of the points of both elements for the values at the points of the merged element:
    /// the L² projection onto its polynomials.
    fn projection(&self) -> [[f64; 2 * MAX_POINTS]; MAX_POINTS] {
        let p = self.reference.p;
        let polynomials = |x: f64| legendre_sequence(2.0 * x - 1.0).zip(0..p);
        let mut shares = [[0.0; 2 * MAX_POINTS]; MAX_POINTS];
        for (i, (_, x, w)) in self.each().enumerate() {
            for (value, k) in polynomials(x) {
                shares[k][i] = (2 * k + 1) as f64 * w * value;
            }
        }
        let mut weights = [[0.0; 2 * MAX_POINTS]; MAX_POINTS];
        for (weights, x) in weights.iter_mut().zip(&self.reference.points) {
            for (value, k) in polynomials(*x) {
                weights
                    .iter_mut()
                    .zip(shares[k])
                    .for_each(|(weight, share)| *weight += value * share);
            }
        }
        weights
    }

    /// The points of the merged element.
    pub fn projected(&self) -> [MaterialPoint; MAX_POINTS] {
        let projection = self.projection();
        projection.map(|weights| MaterialPoint {
            jacobian: self.length(),
            ..MaterialPoint::weighted(self.source, &weights)
        })
    }

    /// The strains of the centre line at the points of the merged element.
    pub fn projected_strains(&self, strains: &[Vector3<f64>]) -> [Vector3<f64>; MAX_POINTS] {
        self.projection().map(|weights| weighted(strains, &weights))
    }

    /// The loss of intrinsic strain, including the earlier `losses` of both elements, and the
    /// resulting decrease of the rotation along the merged element (rad).
    pub fn loss(
        &self,
        losses: [MergingLoss; 2],
        new: &[MaterialPoint],
    ) -> (MergingLoss, Vector3<f64>) {
        // A straight rod loses nothing.
        if losses == <[MergingLoss; 2]>::default()
            && self
                .source
                .iter()
                .all(|point| point.intrinsic == Vector3::zeros())
        {
            return Default::default();
        }
        let p = self.reference.p;
        let parts = [0, 1].map(|side| {
            let mut difference = [Vector3::zeros(); MAX_POINTS];
            let points = self
                .source
                .iter()
                .zip(&self.interpolation)
                .skip(side * p)
                .take(p);
            for (to, (point, weights)) in difference.iter_mut().zip(points) {
                *to = new
                    .iter()
                    .zip(weights)
                    .fold(point.intrinsic, |sum, (new, w)| sum - new.intrinsic * *w);
            }
            MergedPart {
                loss: &losses[side],
                length: self.lengths[side],
                difference,
            }
        });
        MergingLoss::merged(self.reference, parts)
    }

    /// The largest relative change of a semi-axis at the points of both elements.
    pub fn change_of_section(&self, new: &[MaterialPoint]) -> f64 {
        let axes: [fn(&MaterialPoint) -> f64; 2] = [
            |point| point.section.along_d1,
            |point| point.section.along_d2,
        ];
        let changes = self
            .source
            .iter()
            .zip(&self.interpolation)
            .flat_map(|(point, weights)| {
                axes.map(|axis| {
                    let merged: f64 = new
                        .iter()
                        .zip(weights)
                        .map(|(point, w)| w * axis(point))
                        .sum();
                    (merged - axis(point)).abs() / axis(point)
                })
            });
        largest(changes)
    }

    /// The largest relative change of the bending of the element under a couple that is constant or
    /// linear along it. The stiffness increases fast in young tissue, and is evaluated at the Gauss
    /// points only.
    pub fn change_of_compliance(
        &self,
        new: &[MaterialPoint],
        compliance: impl Fn(&MaterialPoint) -> f64,
    ) -> f64 {
        let add = |bend: [f64; 2], (point, x, w): (&MaterialPoint, f64, f64)| {
            let c = w * compliance(point);
            [bend[0] + c, bend[1] + c * x]
        };
        let rule = self.reference.points.iter().zip(&self.reference.weights);
        let before = self.each().fold([0.0; 2], add);
        let after = new
            .iter()
            .zip(rule)
            .map(|(point, (x, w))| (point, *x, *w))
            .fold([0.0; 2], add);
        largest((0..2).map(|n| (after[n] - before[n]).abs() / before[0]))
    }
}
