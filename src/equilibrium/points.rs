//! Quantities at all Gauss points of an element, which are computed together.

use nalgebra::{Matrix3, Vector3};

use crate::constitutive::{Constitutive, LineResponse, Tissue};
use crate::reference_element::AtPoints;
use crate::rod::{MaterialPoint, centre_line_tangent};

/// Evaluates an expression in which `P` is a constant, the number of Gauss points in an element.
macro_rules! with_points {
    (const $number:literal, $body:expr) => {{
        const P: usize = $number;
        $body
    }};
    ($points:expr, $body:expr) => {
        match $points {
            1 => with_points!(const 1, $body),
            2 => with_points!(const 2, $body),
            3 => with_points!(const 3, $body),
            _ => with_points!(const 4, $body),
        }
    };
}

pub(super) use with_points;

/// A number at each of the first `P` points, and `idle` in the other lanes.
#[inline]
pub(super) fn at_points<const P: usize>(idle: f64, value: impl Fn(usize) -> f64) -> AtPoints {
    AtPoints::from(std::array::from_fn(|g| if g < P { value(g) } else { idle }))
}

/// A vector at each of the first `P` points, and zero in the other lanes.
#[inline]
pub(super) fn vectors_at_points<const P: usize>(
    vector: impl Fn(usize) -> Vector3<f64>,
) -> Vector3<AtPoints> {
    Vector3::from_fn(|i, _| at_points::<P>(0.0, |g| vector(g)[i]))
}

/// Responses of an elastic law at the points.
pub(super) struct Responses {
    /// Elastic energy per length, with that of the centre line.
    pub energy: AtPoints,
    pub couple: Vector3<AtPoints>,
    pub tangent: Matrix3<AtPoints>,
    /// Largest stiffness.
    pub stiffness: AtPoints,
    /// Strain of the centre line.
    pub along: Vector3<AtPoints>,
    /// Compliance of the centre line; `None` for a law without shear and stretch.
    pub line: Option<Matrix3<AtPoints>>,
}

impl Responses {
    /// Responses to elastic strains, and to forces along the directors, at a time (s). In lanes
    /// without a point the stiffness is one, and the other quantities are zero.
    #[inline]
    pub fn of<const P: usize>(
        material: &impl Constitutive,
        (points, time): (&[MaterialPoint], f64),
        strain: &Vector3<AtPoints>,
        force: &Vector3<AtPoints>,
    ) -> Self {
        let tissue: [Tissue; P] = std::array::from_fn(|g| Tissue::of(&points[g], time));
        let strain = strain.map(AtPoints::into_arr);
        let responses: [_; P] = std::array::from_fn(|g| {
            material.respond(&tissue[g], &strain.map(|at_points| at_points[g]))
        });
        let force = force.map(AtPoints::into_arr);
        let lines: [_; P] = std::array::from_fn(|g| {
            material.line_response(&tissue[g], &force.map(|at_points| at_points[g]))
        });
        let line = |g: usize| lines[g].unwrap_or_else(unyielding);
        Self {
            energy: at_points::<P>(0.0, |g| responses[g].energy + line(g).energy),
            couple: vectors_at_points::<P>(|g| responses[g].couple),
            tangent: Matrix3::from_fn(|i, j| at_points::<P>(0.0, |g| responses[g].tangent[(i, j)])),
            stiffness: at_points::<P>(1.0, |g| responses[g].tangent.diagonal().max()),
            along: vectors_at_points::<P>(|g| line(g).strain),
            line: lines[0].map(|_| {
                Matrix3::from_fn(|i, j| at_points::<P>(0.0, |g| line(g).compliance[(i, j)]))
            }),
        }
    }
}

/// Response of a centre line without shear and stretch.
#[inline]
fn unyielding() -> LineResponse {
    LineResponse {
        strain: centre_line_tangent(),
        energy: 0.0,
        compliance: Matrix3::zeros(),
    }
}
