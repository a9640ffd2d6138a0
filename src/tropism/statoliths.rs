//! How a cell feels gravity: by the pile of its statoliths.

use nalgebra::Vector3;

use super::Site;
use crate::error::ParameterError;

/// A sense of gravity: gives the unit normal h of the pile of statoliths, components along the directors.
///
/// h points up when the pile is settled; then h1 and h2 are the components of the upward vertical along d1 and d2.
pub trait Graviception {
    /// How many variables it keeps at a material point.
    fn variables(&self) -> usize;

    /// How many stimuli it senses.
    fn stimuli(&self) -> usize;

    /// The stimuli at a place.
    fn sense(&self, site: &Site, stimuli: &mut [f64]);

    /// The variables when the pile has settled under these stimuli.
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]);

    /// The rates of the variables, 1/s.
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]);

    /// The times in which the variables relax, s.
    fn time_constants(&self, constants: &mut [f64]);

    /// The components (h1, h2) of the normal.
    fn normal(&self, variables: &[f64], stimuli: &[f64]) -> (f64, f64);

    /// Refuses parameters that make no sense.
    ///
    /// # Errors
    /// The first such parameter.
    fn check(&self) -> Result<(), ParameterError>;
}

/// The fast limit τa → 0: the pile is always settled, h = −ĝ. No variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SettledStatoliths;

impl Graviception for SettledStatoliths {
    #[inline]
    fn variables(&self) -> usize {
        0
    }

    #[inline]
    fn stimuli(&self) -> usize {
        2
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli.copy_from_slice(&[up.x, up.y]);
    }

    #[inline]
    fn settled(&self, _stimuli: &[f64], _variables: &mut [f64]) {}

    #[inline]
    fn rates(&self, _variables: &[f64], _stimuli: &[f64], _rates: &mut [f64]) {}

    #[inline]
    fn time_constants(&self, _constants: &mut [f64]) {}

    #[inline]
    fn normal(&self, _variables: &[f64], stimuli: &[f64]) -> (f64, f64) {
        (stimuli[0], stimuli[1])
    }

    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// Equation (6): `ḣj = (1/τa) [−ĝ + (ĝ·h) h]·dj`, the normal of a pile that avalanches towards the horizontal.
///
/// The rate acts on the components along the directors: the pile is carried by the cell. Without gravity nothing moves.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Statoliths {
    /// Avalanche time τa, s.
    pub avalanche_time: f64,
}

impl Graviception for Statoliths {
    #[inline]
    fn variables(&self) -> usize {
        3
    }

    #[inline]
    fn stimuli(&self) -> usize {
        3
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli.copy_from_slice(up.as_slice());
    }

    #[inline]
    fn settled(&self, stimuli: &[f64], variables: &mut [f64]) {
        variables.copy_from_slice(stimuli);
        // Without gravity a pile has nowhere to settle: it lies at the base end of its cell, and asks for nothing.
        if stimuli.iter().all(|x| *x == 0.0) {
            variables[2] = 1.0;
        }
    }

    #[inline]
    fn rates(&self, variables: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        let h = Vector3::from_column_slice(variables);
        let up = Vector3::from_column_slice(stimuli);
        // On the unit sphere this is equation (6). Off it, where only rounding leads, |h|² returns to 1 in τa whatever way
        // the pile points, and what is left beside −h/τa is small near the settled state in every direction.
        // `up` is zero where there is no gravity, and then nothing moves.
        let n = h.norm_squared();
        let rate = (up * n - h * (up.dot(&h) - 0.5 * (1.0 - n) * up.norm_squared())) / self.avalanche_time;
        rates.copy_from_slice(rate.as_slice());
    }

    #[inline]
    fn time_constants(&self, constants: &mut [f64]) {
        // Near the settled state h relaxes as ḣ = (up − h)/τa.
        constants.fill(self.avalanche_time);
    }

    #[inline]
    fn normal(&self, variables: &[f64], _stimuli: &[f64]) -> (f64, f64) {
        (variables[0], variables[1])
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("avalanche time", self.avalanche_time)
    }
}
