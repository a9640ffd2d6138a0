//! The response to gravity.

use nalgebra::Vector3;

use super::{Graviception, Growing, Memory, SettledStatoliths, Site, TropismLaw};
use crate::error::ParameterError;

/// Equation (7): `r u̇1* = −β REGR M[h2]`, `r u̇2* = +β REGR M[h1]`: the shoot turns its tip upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gravitropism<S = SettledStatoliths> {
    /// Sensitivity β.
    pub sensitivity: f64,
    /// Memory and reaction time, τm and τr.
    pub memory: Memory,
    /// How gravity is felt: with statoliths that take their time, or at once.
    pub statoliths: S,
}

impl<S: Graviception> TropismLaw for Gravitropism<S> {
    #[inline]
    fn gradient(&self, at: &Growing, past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let size = self.sensitivity / at.radius;
        let v = self.statoliths.variables();
        Vector3::new(-size * past[v + 1], size * past[v], 0.0)
    }

    #[inline]
    fn variables(&self) -> usize {
        self.statoliths.variables() + 2
    }

    #[inline]
    fn stimuli(&self) -> usize {
        self.statoliths.stimuli()
    }

    #[inline]
    fn delays(&self, delays: &mut [f64]) {
        // Only the memories of h1 and h2 are read; the statoliths act through them.
        let (statoliths, memories) = delays.split_at_mut(self.statoliths.variables());
        statoliths.fill(f64::INFINITY);
        memories.fill(self.memory.delay);
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        self.statoliths.sense(site, stimuli);
    }

    fn at_rest(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (statoliths, memories) = variables.split_at_mut(self.statoliths.variables());
        self.statoliths.settled(stimuli, statoliths);
        memories.fill(0.0);
    }

    #[inline]
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
        let (statoliths, memories) = variables.split_at_mut(self.statoliths.variables());
        self.statoliths.settled(stimuli, statoliths);
        (memories[0], memories[1]) = self.statoliths.normal(statoliths, stimuli);
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        let v = self.statoliths.variables();
        let (h1, h2) = self.statoliths.normal(&variables[..v], stimuli);
        self.statoliths.rates(&variables[..v], stimuli, &mut rates[..v]);
        rates[v] = self.memory.rate(variables[v], h1);
        rates[v + 1] = self.memory.rate(variables[v + 1], h2);
    }

    #[inline]
    fn time_constants(&self, constants: &mut [f64]) {
        let (statoliths, memories) = constants.split_at_mut(self.statoliths.variables());
        self.statoliths.time_constants(statoliths);
        memories.fill(self.memory.time);
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("gravitropic sensitivity", self.sensitivity)?;
        self.memory.check()?;
        self.statoliths.check()
    }
}
