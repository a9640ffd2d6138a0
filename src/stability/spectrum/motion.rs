//! Motions of a shoot next to a steady state: modes at characteristic roots, and responses to
//! periodic forcing.

use nalgebra::{Complex, DVector, Vector3};

use super::block::Block;
use super::characteristic::CharacteristicMatrix;
use crate::numerics::krylov::null_vector;
use crate::tropism::Handedness;

/// Displacement of a held apex relative to the largest: rounding, and the error of differences.
const STILL: f64 = 1e-6;

/// The motion Re[(…) exp(iωt)] of a shoot under periodic forcing, after transients have decayed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ForcedResponse {
    /// Change of the intrinsic strain at the points of the growth zone, components along the
    /// directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// Displacement of the ends of the elements, base first, in the fixed frame, m: at the places
    /// of [`Rod::centre_line`](crate::rod::Rod::centre_line).
    pub displacement: Vec<Vector3<Complex<f64>>>,
}

impl CharacteristicMatrix {
    /// The motion with given amplitudes of some unknowns.
    pub(super) fn motion(
        &self,
        unknowns: &[usize],
        amplitudes: &DVector<Complex<f64>>,
    ) -> ForcedResponse {
        let mut strain = vec![Vector3::zeros(); self.kind.len()];
        for (&unknown, z) in unknowns.iter().zip(amplitudes.iter()) {
            let (i, c) = self.unknowns[unknown];
            strain[i][c] = *z;
        }
        let moved = self
            .displacement
            .select_columns(unknowns)
            .map(Complex::from)
            * amplitudes;
        let displacement = (0..moved.nrows() / 3)
            .map(|k| moved.fixed_rows::<3>(3 * k).into_owned())
            .collect();
        ForcedResponse {
            strain,
            displacement,
        }
    }
}

/// A characteristic root with Im λ ≥ 0, and its mode. Its conjugate is a root, too.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Root {
    /// λ, 1/s: growth rate and angular frequency.
    pub value: Complex<f64>,
    /// |M(λ) v| relative to |M(λ)| |v|, with v the mode.
    pub residual: f64,
    /// Estimate of the error of λ due to the mesh, 1/s; see [`with_error`](Self::with_error) and
    /// [`Refinement`](crate::stability::Refinement). `None` if it was not estimated.
    pub error: Option<f64>,
    /// Number of uncoupled parts of the shoot that have this root. The root of an isotropic shoot
    /// is double: its tip moves on a line in any plane, or on a circle in either sense.
    pub multiplicity: usize,
    /// Sense in which the tip moves on an ellipse, as seen from the apex towards the base. None if
    /// it moves on a line, whose direction is that of its displacement, or if the root is multiple.
    /// The tip of a shoot that leans and moves in the plane of its bend is on a thin ellipse in
    /// that plane, which counts as a line.
    pub handedness: Option<Handedness>,
    /// Change of the intrinsic strain in the mode at the points of the growth zone, components
    /// along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// Displacement of the ends of the elements that belongs to it, base first, in the fixed frame,
    /// m: at the places of [`Rod::centre_line`](crate::rod::Rod::centre_line). That of the apex has
    /// the norm 1 m, and its largest component is real and positive; if the apex is held, this
    /// holds for the place that moves most.
    pub displacement: Vec<Vector3<Complex<f64>>>,
}

impl Root {
    /// The growth rate, 1/s: positive if the disturbance grows.
    #[must_use]
    pub fn growth_rate(&self) -> f64 {
        self.value.re
    }

    /// The period, s; infinite if the mode does not oscillate.
    #[must_use]
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.value.im.abs()
    }

    /// The root of a block, with its mode by inverse iteration.
    pub(super) fn new(block: &Block, value: Complex<f64>) -> Self {
        let characteristic = &block.characteristic;
        let matrix = block.matrix(&characteristic.transfers_at(value)).value;
        let v = null_vector(matrix.clone());
        let residual = (&matrix * &v).norm() / (matrix.norm() * v.norm());
        let ForcedResponse {
            mut strain,
            mut displacement,
        } = characteristic.motion(&block.unknowns, &v);
        let moving = place_that_moves(&displacement);
        let most = moving.iter().copied().fold(Complex::<f64>::ZERO, |a, b| {
            if b.norm() > a.norm() { b } else { a }
        });
        if most.norm() > 0.0 {
            let scale = most.conj() / (most.norm() * moving.norm());
            strain
                .iter_mut()
                .chain(&mut displacement)
                .for_each(|amplitude| *amplitude *= scale);
        }
        let handedness =
            handedness(&moving, &characteristic.apex_tangent).filter(|_| block.multiplicity == 1);
        let multiplicity = block.multiplicity;
        Self {
            value,
            residual,
            error: None,
            multiplicity,
            handedness,
            strain,
            displacement,
        }
    }
}

/// The displacement of the apex, or of the place that moves most if the apex is held.
fn place_that_moves(displacement: &[Vector3<Complex<f64>>]) -> Vector3<Complex<f64>> {
    let apex = displacement.last().copied().unwrap_or_default();
    let most = displacement
        .iter()
        .copied()
        .fold(apex, |a, b| if b.norm() > a.norm() { b } else { a });
    if apex.norm() > STILL * most.norm() {
        apex
    } else {
        most
    }
}

/// The sense of a displacement Re[a exp(iωt)], as seen from the apex towards the base, against the
/// tangent. It is at Re a at first and moves along −Im a. None if it moves on a line, because Re a
/// and Im a are parallel.
fn handedness(a: &Vector3<Complex<f64>>, tangent: &Vector3<f64>) -> Option<Handedness> {
    let area = -a.map(|z| z.re).cross(&a.map(|z| z.im)).dot(tangent);
    Handedness::of(area).filter(|_| area.abs() >= 1e-6 * a.norm_squared())
}
