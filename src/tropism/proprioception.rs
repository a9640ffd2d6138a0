//! The response of a shoot to its own bending.

use nalgebra::Vector3;

use super::{Growing, LawDerivatives, Memory, Site, TropismLaw};
use crate::error::ParameterError;

/// Equation (8): `u̇j* = −η REGR M̄[uj]`, j = 1, 2: the shoot straightens. It senses the visible strain u, elastic and
/// intrinsic together.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Proprioception {
    /// Sensitivity η.
    pub sensitivity: f64,
    /// Memory and reaction time, τ̄m and τ̄r.
    pub memory: Memory,
}

impl TropismLaw for Proprioception {
    #[inline]
    fn gradient(&self, _at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        Vector3::new(-self.sensitivity * past[0], -self.sensitivity * past[1], 0.0)
    }

    #[inline]
    fn variables(&self) -> usize {
        2
    }

    #[inline]
    fn stimuli(&self) -> usize {
        2
    }

    #[inline]
    fn delays(&self, delays: &mut [f64]) {
        delays.fill(self.memory.delay);
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        stimuli.copy_from_slice(&[site.strain.x, site.strain.y]);
    }

    #[inline]
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
        variables.copy_from_slice(stimuli);
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        for ((rate, y), x) in rates.iter_mut().zip(variables).zip(stimuli) {
            *rate = self.memory.rate(*y, *x);
        }
    }

    #[inline]
    fn time_constants(&self, constants: &mut [f64]) {
        constants.fill(self.memory.time);
    }

    fn derivatives(&self, _at: &Growing, _variables: &[f64], _stimuli: &[f64], out: &mut LawDerivatives) {
        for j in 0..2 {
            out.rates_by_variables[(j, j)] = -1.0 / self.memory.time;
            out.rates_by_stimuli[(j, j)] = 1.0 / self.memory.time;
            out.gradient_by_variables[(j, j)] = -self.sensitivity;
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("proprioceptive sensitivity", self.sensitivity)?;
        self.memory.check()
    }
}
