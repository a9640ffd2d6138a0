//! The response of a shoot to its own bending.

use nalgebra::Vector3;

use super::{Declaration, Growing, Perception, Response, Site, Source};
use crate::error::ParameterError;

/// The shoot straightens. Equation (8), with u the visible strain, elastic and intrinsic together, and M̄ what is
/// remembered of it:
///
/// ```text
/// u̇1* = −η REGR M̄[u1],   u̇2* = −η REGR M̄[u2].
/// ```
///
/// The law asks for u̇*/REGR; [`remembered`](Response::remembered) adds M̄.
///
/// η has no unit: by itself it straightens a shoot in τg/η. Usual value: 20 for *Arabidopsis thaliana* (Agostinelli, DeSimone and
/// Noselli 2021). With gravitropism of sensitivity β a shoot at rest bends over the length η r/β, 12.5 mm at the usual values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Proprioception {
    /// Sensitivity η.
    pub sensitivity: f64,
}

impl Response for Proprioception {
    type Perception = VisibleBending;

    fn perception(&self) -> &VisibleBending {
        &VisibleBending
    }

    fn gradient(&self, _at: &Growing, [u1, u2]: [f64; 2]) -> Vector3<f64> {
        Vector3::new(u1, u2, 0.0) * -self.sensitivity
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("proprioceptive sensitivity", self.sensitivity)
    }
}

/// Tissue perceives how it is bent: the signal is (u1, u2), 1/m.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VisibleBending;

impl Perception for VisibleBending {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
    }
}
