//! Uniform growth near the apex, in closed form.

use super::{GrowthLaw, check_zone};
use crate::error::ParameterError;

/// Uniform growth, equation (3): REGR = 1/τg within ℓg of the apex and 0 elsewhere; 1/τg everywhere
/// while the shoot is shorter than ℓg.
///
/// A point at distance σ from the apex at t = 0 has the distance σ exp(t/τg) and leaves the zone at
/// τg ln(ℓg/σ). A shoot longer than ℓg elongates at the rate ℓg/τg.
///
/// Usual values for *Arabidopsis thaliana* are ℓg = 7 cm and τg = 40 h, or 20 h for constant
/// length, and 3 cm and 20 h in figure 3 of Agostinelli, DeSimone and Noselli (2021). With the
/// first two the rate of elongation is 1.75 mm/h.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct UniformGrowth {
    /// Length of the growth zone ℓg, m; positive and finite.
    pub zone_length: f64,
    /// Growth time τg, s; positive.
    pub time: f64,
}

impl GrowthLaw for UniformGrowth {
    fn regr(&self, _sigma: f64, _t: f64) -> f64 {
        1.0 / self.time
    }

    fn zone_length(&self) -> f64 {
        self.zone_length
    }

    fn apical_speed(&self, sigma: f64, _t: f64) -> f64 {
        sigma / self.time
    }

    fn flow(&self, sigma: f64, from: f64, to: f64) -> (f64, f64) {
        let stretch = ((to - from) / self.time).exp();
        (sigma * stretch, stretch)
    }

    fn exit_time(&self, sigma: f64, from: f64, until: f64) -> Option<f64> {
        let exit = from + self.time * (self.zone_length / sigma).ln().max(0.0);
        (exit <= until).then_some(exit)
    }

    fn check(&self, _length: f64) -> Result<(), ParameterError> {
        check_zone(self.zone_length, self.time)
    }
}
