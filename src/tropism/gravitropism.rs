//! Response to gravity or another stimulus with a direction.

use nalgebra::Vector3;

use super::{Growing, Perception, Response, SettledStatoliths};
use crate::error::ParameterError;

/// Response to a perceived direction: growth bends the tissue towards it, or away from it if the
/// sensitivity is negative.
///
/// Equation (7), with h the perceived direction and M its [memory](super::Memory):
///
/// ```text
/// r u̇1* = −β REGR M[h2],   r u̇2* = +β REGR M[h1].
/// ```
///
/// u1 and u2 are bending about d1 and d2: positive u2 bends towards d1, and negative u1 towards d2.
/// In an elliptic section r is the semi-axis along d2 for u1, and that along d1 for u2.
/// [`remembered`](Response::remembered) adds M.
///
/// β is the product of the radius and the curvature that a horizontal shoot gains in one growth
/// time. A usual value is 0.8, for *Arabidopsis thaliana* (Agostinelli, DeSimone and Noselli 2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DirectionalTropism<P> {
    /// Sensitivity β, without unit.
    pub sensitivity: f64,
    /// Perception of the direction. Its signal is (h1, h2), the components along d1 and d2.
    pub perception: P,
}

/// Gravitropism, equation (7): the perceived direction is the upward vertical, which
/// [settled](SettledStatoliths) or [avalanching](super::Statoliths) statoliths indicate.
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

    #[inline]
    fn gradient(&self, at: &Growing, [h1, h2]: [f64; 2]) -> Vector3<f64> {
        Vector3::new(-h2 / at.section.along_d2, h1 / at.section.along_d1, 0.0) * self.sensitivity
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("tropic sensitivity", self.sensitivity, "")?;
        self.perception.check()
    }
}
