//! Uniform growth near the apex, in closed form.

use super::GrowthLaw;
use crate::error::ParameterError;

/// Equation (3): REGR = 1/τg within ℓg of the apex, 0 elsewhere; 1/τg everywhere while the shoot is shorter than ℓg.
///
/// Usual values: ℓg = 7 cm and τg = 40 h (20 h where the length is constant) for a shoot of *Arabidopsis thaliana* in
/// Agostinelli, DeSimone and Noselli (2021), 3 cm and 20 h in their map of growth (figure 3). The shoot then becomes
/// ℓg/τg longer in a second: 1.75 mm in an hour.
///
/// A point in the zone moves as σ exp(t/τg) and leaves at τg ln(ℓg/σ).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct UniformGrowth {
    /// Length of the growth zone ℓg, m.
    pub zone_length: f64,
    /// Growth time τg, s.
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
        ParameterError::positive("length of the growth zone", self.zone_length)?;
        ParameterError::positive("growth time", self.time)
    }
}
