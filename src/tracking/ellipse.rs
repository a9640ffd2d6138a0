//! Ellipse of an oscillation in a plane.

use nalgebra::{Matrix2, Vector2};

use crate::tropism::Handedness;

/// The ellipse a cos ωt + b sin ωt.
///
/// It is the sum of two circular motions with opposite senses. The radius of the one with the sense
/// of the ellipse is half the sum of both semi-axes, that of the other one half their difference.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Ellipse {
    /// Semi-major axis, the amplitude, m.
    pub major: f64,
    /// Semi-minor axis, m.
    pub minor: f64,
    /// Direction of the major axis, from the first coordinate towards the second, from −π/2 to π/2,
    /// rad.
    pub direction: f64,
    /// Sense of rotation; `None` for a line segment. In an analysis of a track it is `None` where
    /// the minor axis does not exceed three standard errors.
    pub sense: Option<Handedness>,
}

impl Ellipse {
    /// The ellipse with given coefficients of the cosine and of the sine (m).
    #[must_use]
    pub fn of(cosine: &Vector2<f64>, sine: &Vector2<f64>) -> Self {
        let matrix = Matrix2::from_columns(&[*cosine, *sine]);
        let determinant = matrix.determinant();
        let turned = Vector2::new(sine.y, -sine.x);
        let outer = matrix * matrix.transpose();
        let direction = 0.5 * (2.0 * outer[(0, 1)]).atan2(outer[(0, 0)] - outer[(1, 1)]);
        let sense = Handedness::of(determinant);
        // Sum and difference of both semi-axes are twice the radii of the circular motions.
        let major = 0.5 * ((cosine + turned).norm() + (cosine - turned).norm());
        // The difference of both radii would suffer from cancellation for a thin ellipse.
        let minor = if major > 0.0 {
            determinant.abs() / major
        } else {
            0.0
        };
        Self {
            major,
            minor,
            direction,
            sense,
        }
    }

    /// The ellipse with all lengths multiplied by a factor.
    pub(super) fn scaled(self, by: f64) -> Self {
        Self {
            major: by * self.major,
            minor: by * self.minor,
            ..self
        }
    }

    /// Minor over major axis: 1 for a circle, 0 for a line segment.
    #[must_use]
    pub fn roundness(&self) -> f64 {
        if self.major > 0.0 {
            self.minor / self.major
        } else {
            0.0
        }
    }

    /// The mean square of the distance from the centre, m².
    pub(super) fn power(&self) -> f64 {
        0.5 * (self.major.powi(2) + self.minor.powi(2))
    }
}
