//! The response to gravity, and to whatever else has a direction.

use nalgebra::Vector3;

use super::{Growing, Perception, Response, SettledStatoliths};
use crate::error::ParameterError;

/// Tissue turns towards a direction, or away from it if the sensitivity is negative.
///
/// Equation (7), with h the direction that is perceived and M what is remembered of it:
///
/// ```text
/// r u̇1* = −β REGR M[h2],   r u̇2* = +β REGR M[h1].
/// ```
///
/// In an elliptic section r is the semi-axis across which growth differs: along d2 for u1, along d1 for u2.
/// β has no unit: it is the curvature times the radius that a shoot laid on its side gains in one growth time. Usual value: 0.8
/// for *Arabidopsis thaliana* (Agostinelli, DeSimone and Noselli 2021).
///
/// u1 and u2 bend about d1 and d2, so positive u2 bends towards d1 and negative u1 towards d2. The law asks for u̇*/REGR;
/// [`remembered`](Response::remembered) adds M.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DirectionalTropism<P> {
    /// Sensitivity β.
    pub sensitivity: f64,
    /// What perceives the direction: its signal is (h1, h2), the components along d1 and d2.
    pub perception: P,
}

/// The tip turns upwards, equation (7): statoliths perceive the upward vertical.
///
/// ```
/// use morphorod::tropism::{Gravitropism, Memory, Response, SettledStatoliths};
/// let law = Gravitropism { sensitivity: 0.8, perception: SettledStatoliths }
///     .remembered(Memory { time: 720.0, delay: 720.0 });
/// # let _ = law;
/// ```
pub type Gravitropism<S = SettledStatoliths> = DirectionalTropism<S>;

impl<P: Perception<Signal = [f64; 2]>> Response for DirectionalTropism<P> {
    type Perception = P;

    fn perception(&self) -> &P {
        &self.perception
    }

    fn gradient(&self, at: &Growing, [h1, h2]: [f64; 2]) -> Vector3<f64> {
        Vector3::new(-h2 / at.section.along_d2, h1 / at.section.along_d1, 0.0) * self.sensitivity
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("tropic sensitivity", self.sensitivity)?;
        self.perception.check()
    }
}
