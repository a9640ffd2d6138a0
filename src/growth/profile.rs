//! Growth rates that vary over the zone: a linear profile with closed-form motion, and a cosine
//! profile whose motion is integrated.

use std::f64::consts::TAU;

use super::{GrowthLaw, check_zone};
use crate::error::ParameterError;

/// Linear profile REGR = 2ξ/(τg ℓg), with ξ = ℓg − σ the distance from the basal end of the growth
/// zone, and σ that from the apex. Growth is fastest at the apex.
///
/// The shoot elongates at the rate ℓg/τg, as with [`UniformGrowth`](super::UniformGrowth). A point
/// in the zone has the distance σ = 2ℓg/(1 + c exp(−2t/τg)) from the apex with c = 2ℓg/σ(0) − 1,
/// and leaves the zone at (τg/2) ln c.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinearProfile {
    /// Length of the growth zone ℓg, m; positive and finite.
    pub zone_length: f64,
    /// Growth time τg, s, positive: the mean of REGR over the zone is 1/τg.
    pub time: f64,
}

impl GrowthLaw for LinearProfile {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        2.0 * (1.0 - sigma / self.zone_length) / self.time
    }

    fn zone_length(&self) -> f64 {
        self.zone_length
    }

    fn apical_speed(&self, sigma: f64, _t: f64) -> f64 {
        sigma * (2.0 - sigma / self.zone_length) / self.time
    }

    fn flow(&self, sigma: f64, from: f64, to: f64) -> (f64, f64) {
        // σ̇ = 2σ (1 − σ/2ℓg)/τg is logistic growth towards 2ℓg.
        let (limit, decay) = (
            2.0 * self.zone_length,
            (2.0 * (from - to) / self.time).exp(),
        );
        let factor = limit / (sigma + (limit - sigma) * decay);
        (sigma * factor, factor * factor * decay)
    }

    fn exit_time(&self, sigma: f64, from: f64, until: f64) -> Option<f64> {
        let exit = from + 0.5 * self.time * (2.0 * self.zone_length / sigma - 1.0).ln().max(0.0);
        (exit <= until).then_some(exit)
    }

    fn check(&self, _length: f64) -> Result<(), ParameterError> {
        check_zone(self.zone_length, self.time)
    }
}

/// Cosine profile REGR = (1 + cos(2π(ξ − ℓg/2)/ℓg))/τg with ξ = ℓg − σ the distance from the basal
/// end of the growth zone, and σ that from the apex. Growth is fastest in the middle of the zone
/// and vanishes at both ends. The paper does not use this profile.
///
/// The shoot elongates at the rate ℓg/τg, as with [`UniformGrowth`](super::UniformGrowth).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CosineProfile {
    /// Length of the growth zone ℓg, m; positive and finite.
    pub zone_length: f64,
    /// Growth time τg, s, positive: the mean of REGR over the zone is 1/τg.
    pub time: f64,
}

impl GrowthLaw for CosineProfile {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        // cos(2π(ξ − ℓg/2)/ℓg) = −cos(2πσ/ℓg), and 1 − cos = 2 sin² does not suffer from
        // cancellation near the ends.
        let sin = (0.5 * TAU * sigma / self.zone_length).sin();
        2.0 * sin * sin / self.time
    }

    fn zone_length(&self) -> f64 {
        self.zone_length
    }

    fn apical_speed(&self, sigma: f64, _t: f64) -> f64 {
        let phase = TAU * sigma / self.zone_length;
        // Near the apex x − sin x suffers from cancellation, and its series x³/6 (1 − x²/20 (1 −
        // x²/42 (1 − x²/72))) does not.
        let rest = if phase < 0.1 {
            let x2 = phase * phase;
            phase * x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0)))
        } else {
            phase - phase.sin()
        };
        rest * self.zone_length / (TAU * self.time)
    }

    fn check(&self, _length: f64) -> Result<(), ParameterError> {
        check_zone(self.zone_length, self.time)
    }
}
