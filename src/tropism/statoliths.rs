//! How a cell perceives gravity: by the pile of its statoliths.

use nalgebra::Vector3;

use super::{Declaration, Perception, Rotation, Site, Source, Variable};
use crate::error::ParameterError;

/// The fast limit τa → 0: the pile is always settled, h = −ĝ. No variables. The signal is (h1, h2), the components of the
/// upward vertical along d1 and d2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SettledStatoliths;

impl Perception for SettledStatoliths {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        to.stimulus_pair()
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli.copy_from_slice(&[up.x, up.y]);
    }
}

/// The unit normal h of a pile that avalanches towards the horizontal. Equation (6):
///
/// ```text
/// ḣj = (1/τa) [−ĝ + (ĝ·h) h]·dj.
/// ```
///
/// Usual value: τa = 2 min (Agostinelli, DeSimone and Noselli 2021).
///
/// The rate acts on the components along the directors: the pile is carried by the cell. Without gravity nothing moves.
/// The signal is (h1, h2).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Statoliths {
    /// Avalanche time τa, s.
    pub avalanche_time: f64,
}

impl Perception for Statoliths {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        // The stimuli are the upward vertical. Near it h relaxes as ḣ = (up − h)/τa.
        to.stimulus_pair();
        to.stimulus(Rotation::Invariant);
        let component = Variable::unread().relaxing_in(self.avalanche_time);
        let h = to.variable(component.turning(Rotation::First));
        to.variable(component.turning(Rotation::Second));
        to.variable(component.turning(Rotation::Invariant));
        h
    }

    #[inline]
    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let up = site.along_directors(&site.environment.up());
        stimuli.copy_from_slice(up.as_slice());
    }

    #[inline]
    fn signal(&self, h: &[f64], _stimuli: &[f64]) -> [f64; 2] {
        [h[0], h[1]]
    }

    #[inline]
    fn rates(&self, h: &[f64], stimuli: &[f64], rates: &mut [f64]) {
        let (h, up) = (Vector3::from_column_slice(h), Vector3::from_column_slice(stimuli));
        // On the unit sphere this is equation (6). Off it, where only rounding leads, |h|² returns to 1 in τa whatever way
        // the pile points, and what is left beside −h/τa is small near the settled state in every direction.
        // `up` is zero where there is no gravity, and then nothing moves.
        let n = h.norm_squared();
        let rate = (up * n - h * (up.dot(&h) - 0.5 * (1.0 - n) * up.norm_squared())) / self.avalanche_time;
        rates.copy_from_slice(rate.as_slice());
    }

    #[inline]
    fn steady(&self, stimuli: &[f64], h: &mut [f64]) {
        h.copy_from_slice(stimuli);
        // Without gravity a pile has nowhere to settle: it lies at the base end of its cell, and asks for nothing.
        if stimuli.iter().all(|x| *x == 0.0) {
            h[2] = 1.0;
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("avalanche time", self.avalanche_time)
    }
}
