//! Differential growth in a part of the growth zone.

use nalgebra::Vector3;

use super::compose::forward_state;
use super::{Declaration, Growing, Site, TropismLaw};
use crate::error::ParameterError;

/// A law that acts only between two distances from the apex. The part of the zone stays at these
/// distances while the tissue grows through it.
///
/// The growth gradient of the inner law is multiplied by a window w(σ) of the distance σ from the
/// apex, which rises from zero to one and falls to zero over the length `edge` about each end. It
/// has two continuous derivatives, and its integral is the distance between the ends.
///
/// The hook of *Averrhoa carambola* swings in a plane by differential growth at the basal edge of
/// its growth zone (Rivière, Peaucelle, Derr and Douady, *Plant nutation relies on steady
/// propagation of spatially asymmetric growth pattern*, Cambridge University Press, online 1 July
/// 2025). The growth rates on the axis and at the radius R (m) differ by at most δ̇0 (1/s) on a
/// length ΔL (m), with the angular frequency ω (rad/s). The apex then rotates by
///
/// ```text
/// Δφ = 2 ΔL δ̇0/(ω R),
/// ```
///
/// (rad) from one side to the other, if tissue passes a small part of ΔL in a period. Two
/// [oscillators](super::Oscillator) of opposite senses oscillate in a plane:
///
/// ```
/// use morphorod::tropism::{Handedness, Localised, Oscillator};
///
/// // δ̇0 = 4.5e-3/h, at REGR = 1.4e-2/h, is the sensitivity 4.5/14, half of it for each sense. The period is 2.1 h.
/// let forwards = Oscillator::new(0.5 * 4.5 / 14.0, 2.1 * 3600.0);
/// let backwards = Oscillator { handedness: Handedness::Clockwise, ..forwards };
/// let law = Localised { law: (forwards, backwards), from: 7.4e-3, to: 19.6e-3, edge: 2e-3 };
/// # assert_eq!(law.window(0.01), 1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Localised<L> {
    /// The law.
    pub law: L,
    /// Distance from the apex of the apical end, m. The window includes the apex if it is at most
    /// −`edge`/2.
    pub from: f64,
    /// Distance from the apex of the basal end, m.
    pub to: f64,
    /// Length over which the window rises or falls, m; positive. Tissue that passes it in less than
    /// a time step reduces the order in time.
    pub edge: f64,
}

impl<L> Localised<L> {
    /// Share of the gradient at a distance from the apex (m), from zero to one.
    #[must_use]
    pub fn window(&self, apex_distance: f64) -> f64 {
        let rise = |end: f64| rise((apex_distance - end) / self.edge + 0.5);
        rise(self.from) - rise(self.to)
    }
}

/// Function that rises from zero at x = 0 to one at x = 1 with two continuous derivatives, and is
/// constant beyond.
#[inline]
pub(super) fn rise(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

impl<L: TropismLaw> TropismLaw for Localised<L> {
    #[inline]
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> {
        match self.window(at.apex_distance) {
            0.0 => Vector3::zeros(),
            window => self.law.gradient(at, past, now) * window,
        }
    }

    forward_state!(self, self.law);

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite(
            "distance from the apex at which a law begins",
            self.from,
            "m",
        )?;
        let name = "distance from the apex at which a law ends";
        let ok = self.to.is_finite() && self.to > self.from;
        ParameterError::unless(ok, name, self.to, "finite, and beyond its beginning (m)")?;
        ParameterError::positive("edge of a localised law", self.edge, "m")?;
        self.law.check()
    }
}
