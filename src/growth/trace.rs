//! Motion of material points by the growth law alone, without a simulation.

use super::GrowthLaw;
use crate::numerics::quadrature::rule;

/// Number of intervals in time of the quadrature: each resolves speeds that vary more slowly than a sixty-fourth of a
/// run.
const PIECES: u32 = 64;

/// A material point at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Trace {
    /// Arc length s from the base, m.
    pub arc_length: f64,
    /// Stretch γ = ∂s/∂S since t = 0.
    pub stretch: f64,
    /// Time at which it left the growth zone, s; `None` inside. A point that starts outside left before t = 0.
    pub exit_time: Option<f64>,
}

/// The length of the shoot at time `t` ≥ 0 (s), if it was `initial` (m) at t = 0.
#[must_use]
pub fn length(law: &impl GrowthLaw, initial: f64, t: f64) -> f64 {
    if !law.elongates() {
        return initial;
    }
    let zone = law.zone_length();
    if initial >= zone {
        return initial + zone_elongation(law, 0.0, t, PIECES);
    }
    match law.exit_time(initial, 0.0, t) {
        None => law.flow(initial, 0.0, t).0,
        Some(full) => zone + zone_elongation(law, full, t, PIECES),
    }
}

/// Increase of the length by a whole growth zone between two times, m: the integral of its apical speed, on `pieces`
/// intervals.
pub(crate) fn zone_elongation(law: &impl GrowthLaw, from: f64, to: f64, pieces: u32) -> f64 {
    let zone = law.zone_length();
    let (x, w) = rule::<8>();
    let h = (to - from) / f64::from(pieces);
    (0..pieces)
        .flat_map(|i| x.iter().zip(w).map(move |(x, w)| (from + h * (f64::from(i) + x), w * h)))
        .map(|(t, w)| w * law.apical_speed(zone, t))
        .sum()
}

/// The material point that was at arc length `start` (m) of a shoot of length `initial` (m) at t = 0, at time `t` ≥ 0
/// (s).
#[must_use]
pub fn trace(law: &impl GrowthLaw, initial: f64, start: f64, t: f64) -> Trace {
    let sigma = initial - start;
    let zone = law.zone_length();
    if !law.elongates() {
        return Trace { arc_length: start, stretch: 1.0, exit_time: None };
    }
    if sigma >= zone {
        return Trace { arc_length: start, stretch: 1.0, exit_time: Some(exit_before_start(law, sigma)) };
    }
    match law.exit_time(sigma, 0.0, t) {
        None => {
            let (now, stretch) = law.flow(sigma, 0.0, t);
            Trace { arc_length: length(law, initial, t) - now, stretch, exit_time: None }
        }
        Some(exit) => {
            let (_, stretch) = law.flow(sigma, 0.0, exit);
            Trace { arc_length: length(law, initial, exit) - zone, stretch, exit_time: Some(exit) }
        }
    }
}

/// Exit time (s) of a point outside the zone at t = 0: it has moved since with the speed of the zone at t = 0.
pub(crate) fn exit_before_start(law: &impl GrowthLaw, sigma: f64) -> f64 {
    let zone = law.zone_length();
    -(sigma - zone) / law.apical_speed(zone, 0.0)
}
