//! Perception of gravity by the pile of statoliths in a cell.

use nalgebra::Vector3;

use super::{Declaration, Perception, Rotation, Site, Source, Variable};
use crate::error::ParameterError;

/// Statoliths in the limit τa → 0, in which the pile is always settled, h = −ĝ. There are no
/// variables. The signal is (h1, h2), the components of the upward vertical along d1 and d2.
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

/// Statoliths whose pile approaches the horizontal by avalanches, equation (6) for its unit normal
/// h:
///
/// ```text
/// ḣj = (1/τa) [−ĝ + (ĝ·h) h]·dj.
/// ```
///
/// The cell moves the pile with it, so that the rate is that of the components along the directors.
/// Without gravity it is zero. The signal is (h1, h2). The default is τa = 2 min (Agostinelli,
/// DeSimone and Noselli 2021).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Statoliths {
    /// Avalanche time τa, s.
    pub avalanche_time: f64,
}

impl Default for Statoliths {
    fn default() -> Self {
        Self {
            avalanche_time: 120.0,
        }
    }
}

impl Perception for Statoliths {
    type Signal = [f64; 2];

    #[inline(always)]
    fn declare(&self, to: &mut Declaration) -> Source {
        // The stimuli are the components of the upward vertical, near which ḣ = (up − h)/τa.
        let up = to.stimulus_pair();
        to.stimulus(Rotation::Invariant);
        let component = |k| {
            Variable::unread()
                .relaxing_in(self.avalanche_time)
                .approaching(up.offset(k))
        };
        let h = to.variable(component(0).turning(Rotation::First));
        to.variable(component(1).turning(Rotation::Second));
        to.variable(component(2).turning(Rotation::Invariant));
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
        let (h, up) = (
            Vector3::from_column_slice(h),
            Vector3::from_column_slice(stimuli),
        );
        // The rate is that of equation (6) if |h| = |up| = 1. Rounding changes |h|, and
        // interpolation in time changes
        // |up|. The length of h approaches that of `up`, and one without gravity, where `up` is zero. The time constant
        // is τa for any length. Only the direction of h determines the part of the rate across h.
        // Near the settled state the rate then differs little from (up − h)/τa, and the integrator
        // needs few sweeps.
        let (n, u) = (h.norm_squared().max(f64::MIN_POSITIVE), up.norm_squared());
        let target = if u > 0.0 { u } else { 1.0 };
        let excess = (n - target) * target / (n * n + target * target);
        let rate = (up - h * (up.dot(&h) / n + excess)) / self.avalanche_time;
        rates.copy_from_slice(rate.as_slice());
    }

    #[inline]
    fn steady(&self, stimuli: &[f64], h: &mut [f64]) {
        h.copy_from_slice(stimuli);
        // Every direction is steady if there is no gravity. The pile is placed at the basal end of
        // its cell, where it causes no bending.
        if stimuli.iter().all(|x| *x == 0.0) {
            h[2] = 1.0;
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::positive("avalanche time", self.avalanche_time, "s")
    }
}
