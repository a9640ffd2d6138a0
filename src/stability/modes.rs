//! Modes: how the shoot moves at a characteristic root.

use nalgebra::{Complex, DVector, Vector3};

use super::block::Block;
use crate::tropism::Handedness;

/// How a mode moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarisation {
    /// To and fro, as seen along the tangent of the apex; the displacement of the apex says in which direction. A shoot that
    /// leans and moves in the plane of its bend is one, though its tip goes on a thin ellipse in that plane.
    Planar,
    /// Round: seen along the tangent of the apex, the tip goes on an ellipse, in this sense.
    Turning(Handedness),
    /// A double root of an isotropic shoot: to and fro in any plane, or round in either sense.
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
    /// By how much the mesh puts λ off, estimated, 1/s; none if nobody has asked for it, see
    /// [`with_error`](Self::with_error) and [`Refinement`](super::Refinement).
    pub error: Option<f64>,
    /// How many of the shoot's uncoupled parts share it.
    pub multiplicity: usize,
    /// How the mode moves.
    pub polarisation: Polarisation,
    /// The disturbance of the intrinsic strain at the points of the growth zone, components along the directors, 1/m.
    pub strain: Vec<Vector3<Complex<f64>>>,
    /// The displacement of the ends of the elements that goes with it, base first, in the fixed frame, m: at the places of
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
    let problem = &block.problem;
    let matrix = block.matrix(value, &problem.transfers_at(value)).value;
    let lu = matrix.clone().lu();
    let n = block.unknowns.len();
    // No mode is orthogonal to this: its entries have no pattern.
    let mut v = DVector::from_fn(n, |i, _| Complex::new(1.0 + 0.1 * (i as f64).sin(), 0.3 * (i as f64).cos()));
    for _ in 0..3 {
        if let Some(next) = lu.solve(&v).filter(|next| next.norm().is_normal()) {
            v = next.normalize();
        }
    }
    let residual = (&matrix * &v).norm() / (matrix.norm() * v.norm());
    let moved = problem.displacement.select_columns(&block.unknowns).map(Complex::from) * &v;
    let rows = moved.nrows();
    let apex = moved.rows(rows - 3, 3);
    // Moved by 1 m, and the component that moves most is real.
    let most = apex.iter().copied().fold(Complex::<f64>::ZERO, |a, b| if b.norm() > a.norm() { b } else { a });
    let scale = if most.norm() > 0.0 { most.conj() / (most.norm() * apex.norm()) } else { Complex::ONE };
    let displacement: Vec<Vector3<Complex<f64>>> =
        (0..rows / 3).map(|k| Vector3::from_fn(|i, _| moved[3 * k + i] * scale)).collect();
    let mut strain = vec![Vector3::zeros(); problem.kind.len()];
    for (&unknown, z) in block.unknowns.iter().zip(v.iter()) {
        let (i, c) = problem.unknowns[unknown];
        strain[i][c] = *z * scale;
    }
    let multiplicity = block.multiplicity;
    let polarisation = match displacement.last() {
        Some(tip) if multiplicity == 1 => polarisation(tip, &problem.apex_tangent),
        _ => Polarisation::Isotropic,
    };
    Root { value, residual, error: None, multiplicity, polarisation, strain, displacement }
}

/// A displacement a exp(iωt) is planar if, seen along the tangent, its real and imaginary parts are parallel. Else the tip is at
/// Re a at first and moves along −Im a.
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
