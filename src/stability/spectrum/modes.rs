//! Modes: the motion of the shoot at a characteristic root.

use nalgebra::{Complex, DVector, Vector3};

use super::block::Block;
use crate::tropism::Handedness;

/// The path of the tip in a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarisation {
    /// A line, as seen along the tangent of the apex; the displacement of the apex gives its direction. The tip of a shoot
    /// that leans and moves in the plane of its bend is on a thin ellipse in that plane, which counts as a line.
    Planar,
    /// An ellipse in this sense, as seen along the tangent of the apex.
    Turning(Handedness),
    /// A double root of an isotropic shoot: a line in any plane, or a circle in either sense.
    Isotropic,
}

/// A characteristic root, with Im λ ≥ 0; its conjugate is one too.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Root {
    /// λ, 1/s: growth rate and angular frequency.
    pub value: Complex<f64>,
    /// The smallest singular direction's |M(λ) v| relative to |M(λ)| |v|.
    pub residual: f64,
    /// Estimate of the error of λ due to the mesh, 1/s; see [`with_error`](Self::with_error) and
    /// [`Refinement`](crate::stability::Refinement).
    pub error: Option<f64>,
    /// Number of uncoupled parts of the shoot that have this root.
    pub multiplicity: usize,
    /// The path of the tip.
    pub polarisation: Polarisation,
    /// The disturbance of the intrinsic strain at the points of the growth zone, components along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// The displacement of the ends of the elements that belongs to it, base first, in the fixed frame, m: at the places of
    /// [`Rod::centre_line`](crate::rod::Rod::centre_line). That of the apex has the norm 1 m, and its largest component is
    /// real and positive.
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
}

/// The mode of a root of a block, by inverse iteration.
pub(super) fn mode(block: &Block, value: Complex<f64>) -> Root {
    let characteristic = &block.characteristic;
    let matrix = block.matrix(value, &characteristic.transfers_at(value)).value;
    let lu = matrix.clone().lu();
    let n = block.unknowns.len();
    // Entries without a pattern: no mode is orthogonal to this vector.
    let mut v = DVector::from_fn(n, |i, _| Complex::new(1.0 + 0.1 * (i as f64).sin(), 0.3 * (i as f64).cos()));
    for _ in 0..3 {
        if let Some(next) = lu.solve(&v).filter(|next| next.norm().is_normal()) {
            v = next.normalize();
        }
    }
    let residual = (&matrix * &v).norm() / (matrix.norm() * v.norm());
    let moved = characteristic.displacement.select_columns(&block.unknowns).map(Complex::from) * &v;
    let rows = moved.nrows();
    let apex = moved.rows(rows - 3, 3);
    // The displacement of the apex is scaled to 1 m, with its largest component real.
    let most = apex.iter().copied().fold(Complex::<f64>::ZERO, |a, b| if b.norm() > a.norm() { b } else { a });
    let scale = if most.norm() > 0.0 { most.conj() / (most.norm() * apex.norm()) } else { Complex::ONE };
    let displacement: Vec<Vector3<Complex<f64>>> =
        (0..rows / 3).map(|k| Vector3::from_fn(|i, _| moved[3 * k + i] * scale)).collect();
    let mut strain = vec![Vector3::zeros(); characteristic.kind.len()];
    for (&unknown, z) in block.unknowns.iter().zip(v.iter()) {
        let (i, c) = characteristic.unknowns[unknown];
        strain[i][c] = *z * scale;
    }
    let multiplicity = block.multiplicity;
    let polarisation = match displacement.last() {
        Some(tip) if multiplicity == 1 => polarisation(tip, &characteristic.apex_tangent),
        _ => Polarisation::Isotropic,
    };
    Root { value, residual, error: None, multiplicity, polarisation, strain, displacement }
}

/// The path of a displacement a exp(iωt). It is a line if, seen along the tangent, the real and imaginary parts of a are
/// parallel. Else the tip is at Re a at first and moves along −Im a.
fn polarisation(tip: &Vector3<Complex<f64>>, tangent: &Vector3<f64>) -> Polarisation {
    let (re, im) = (tip.map(|z| z.re), tip.map(|z| z.im));
    let area = -re.cross(&im).dot(tangent);
    if area.abs() < 1e-6 * tip.norm_squared() {
        Polarisation::Planar
    } else if area > 0.0 {
        Polarisation::Turning(Handedness::Counterclockwise)
    } else {
        Polarisation::Turning(Handedness::Clockwise)
    }
}
