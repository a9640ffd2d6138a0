//! Response of a shoot to its own bending.

use nalgebra::Vector3;

use super::{Declaration, Growing, Perception, Response, Site, Source};
use crate::error::ParameterError;

/// Proprioception, equation (8): growth straightens the shoot. With u the visible strain, elastic
/// and intrinsic, and M̄ its [memory](super::Memory):
///
/// ```text
/// u̇1* = −η REGR M̄[u1],   u̇2* = −η REGR M̄[u2].
/// ```
///
/// [`remembered`](Response::remembered) adds M̄. Without other laws the shoot straightens within
/// τg/η. A steady shoot with gravitropism of sensitivity β bends over the length η r/β, 12.5 mm at
/// the usual values. The default η is 20, the value for *Arabidopsis thaliana* of Agostinelli,
/// DeSimone and Noselli (2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Proprioception {
    /// Sensitivity η, without unit.
    pub sensitivity: f64,
}

impl Default for Proprioception {
    fn default() -> Self {
        Self { sensitivity: 20.0 }
    }
}

impl Response for Proprioception {
    type Perception = Self;

    fn perception(&self) -> &Self {
        self
    }

    #[inline]
    fn gradient(&self, _at: &Growing, [u1, u2]: [f64; 2]) -> Vector3<f64> {
        Vector3::new(u1, u2, 0.0) * -self.sensitivity
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("proprioceptive sensitivity", self.sensitivity, "")
    }
}

/// The signal is the visible bending (u1, u2), 1/m.
impl Perception for Proprioception {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
    }
}
