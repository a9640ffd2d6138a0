//! The ellipse that a point goes round in one period.

use nalgebra::{Matrix2, Vector2};

use crate::tropism::Handedness;

/// The ellipse a cos ωt + b sin ωt.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Ellipse {
    /// The semi-major axis: the amplitude, m.
    pub major: f64,
    /// The semi-minor axis, m.
    pub minor: f64,
    /// The direction of the major axis, from the first coordinate towards the second, from −π/2 to π/2, rad.
    pub direction: f64,
    /// The sense of rotation; `None` for a segment of a line. In a reading of a path it is `None` where the minor axis does not exceed
    /// three times its standard error.
    pub sense: Option<Handedness>,
    /// Radii of the two circles that it is made of, gone round counterclockwise and clockwise, m.
    pub circles: [f64; 2],
}

impl Ellipse {
    /// The ellipse of a cosine and a sine.
    #[must_use]
    pub fn of(cosine: &Vector2<f64>, sine: &Vector2<f64>) -> Self {
        let matrix = Matrix2::from_columns(&[*cosine, *sine]);
        let determinant = matrix.determinant();
        // The radii of both circles. The semi-major axis is their sum.
        let turned = Vector2::new(sine.y, -sine.x);
        let circles = [0.5 * (cosine + turned).norm(), 0.5 * (cosine - turned).norm()];
        let outer = matrix * matrix.transpose();
        let direction = 0.5 * (2.0 * outer[(0, 1)]).atan2(outer[(0, 0)] - outer[(1, 1)]);
        let sense = match determinant {
            d if d > 0.0 => Some(Handedness::Counterclockwise),
            d if d < 0.0 => Some(Handedness::Clockwise),
            _ => None,
        };
        let major = circles[0] + circles[1];
        // The difference of both radii would lose the digits of a thin ellipse.
        let minor = if major > 0.0 { determinant.abs() / major } else { 0.0 };
        Self { major, minor, direction, sense, circles }
    }

    /// The ellipse so many times as large.
    pub(super) fn scaled(self, by: f64) -> Self {
        Self { major: by * self.major, minor: by * self.minor, circles: self.circles.map(|radius| by * radius), ..self }
    }

    /// The semi-minor axis over the semi-major one: 1 of a circle, 0 of a line.
    #[must_use]
    pub fn roundness(&self) -> f64 {
        if self.major > 0.0 { self.minor / self.major } else { 0.0 }
    }

    /// √(1 − minor²/major²): 0 of a circle, 1 of a line.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        (1.0 - self.roundness().powi(2)).max(0.0).sqrt()
    }

    /// The squared radii of both circles, added up, m²: the mean square of the distance from the centre.
    #[must_use]
    pub fn power(&self) -> f64 {
        self.circles[0].powi(2) + self.circles[1].powi(2)
    }
}
