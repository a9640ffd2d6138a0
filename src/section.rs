//! The cross section of a shoot.

use std::f64::consts::PI;

use crate::error::ParameterError;

/// An elliptic cross section whose axes lie along the directors d1 and d2; a circle if both are
/// equal.
///
/// ```
/// use morphorod::Section;
/// let blade = Section::ellipse(2e-3, 1e-3);
/// // Bending about d1 moves tissue along d2, where the blade is thin: I1 = π a1 a2³/4, I2 = π a1³ a2/4.
/// let [first, second] = blade.second_moments();
/// assert!((second / first - 4.0).abs() < 1e-14);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub struct Section {
    /// Semi-axis a1 along d1, m.
    pub along_d1: f64,
    /// Semi-axis a2 along d2, m.
    pub along_d2: f64,
}

impl Section {
    /// A circle of the given radius, m.
    pub fn circle(radius: f64) -> Self {
        Self::ellipse(radius, radius)
    }

    /// An ellipse with the given semi-axes along d1 and d2, m.
    pub fn ellipse(along_d1: f64, along_d2: f64) -> Self {
        Self { along_d1, along_d2 }
    }

    /// The radius of the circle of equal area, √(a1 a2), m.
    #[must_use]
    #[inline]
    pub fn radius(&self) -> f64 {
        // The square root would round the radius of a circle.
        if self.along_d1 == self.along_d2 {
            self.along_d1
        } else {
            (self.along_d1 * self.along_d2).sqrt()
        }
    }

    /// The area A = π a1 a2, m².
    #[must_use]
    #[inline]
    pub fn area(&self) -> f64 {
        PI * self.along_d1 * self.along_d2
    }

    /// The second moments of area for bending about d1 and about d2, I1 = π a1 a2³/4 and I2 = π a1³
    /// a2/4, m⁴.
    #[must_use]
    #[inline]
    pub fn second_moments(&self) -> [f64; 2] {
        let (a, b) = (self.along_d1, self.along_d2);
        let quarter = 0.25 * PI * (a * b);
        [quarter * (b * b), quarter * (a * a)]
    }

    /// The torsion constant J = π a1³ a2³/(a1² + a2²) of Saint-Venant, m⁴; I1 + I2 for a circle.
    #[must_use]
    #[inline]
    pub fn torsion_constant(&self) -> f64 {
        let [first, second] = self.second_moments();
        // This is 4 I1 I2/(I1 + I2).
        4.0 * first / (first + second) * second
    }

    /// Returns an error for a semi-axis that is not between 0 and `most` (m), both excluded.
    pub(crate) fn check(&self, most: f64, requirement: &'static str) -> Result<(), ParameterError> {
        let circle = self.along_d1.to_bits() == self.along_d2.to_bits();
        let name = if circle {
            "radius"
        } else {
            "semi-axis of the section"
        };
        [self.along_d1, self.along_d2]
            .into_iter()
            .try_for_each(|semi_axis| {
                ParameterError::unless(
                    semi_axis > 0.0 && semi_axis < most,
                    name,
                    semi_axis,
                    requirement,
                )
            })
    }
}

/// A circle of the given radius, m.
impl From<f64> for Section {
    fn from(radius: f64) -> Self {
        Self::circle(radius)
    }
}
