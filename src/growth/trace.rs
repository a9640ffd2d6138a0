//! Motion of material points by the growth law alone, without a simulation.

use super::GrowthLaw;
use crate::numerics::quadrature::rule;

/// Number of intervals in time of the quadrature of the apical speed, each with eight Gauss points.
/// It resolves speeds that vary over a sixty-fourth of the time.
const PIECES: u32 = 64;

/// A material point at one time, see [`GrowthLaw::trace`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Trace {
    /// Arc length s from the base, m.
    pub arc_length: f64,
    /// Stretch γ = ∂s/∂S since t = 0.
    pub stretch: f64,
    /// Time at which the point left the growth zone, s; `None` inside the zone. It is negative for
    /// a point that is outside at t = 0.
    pub exit_time: Option<f64>,
}

/// See [`GrowthLaw::length`].
pub(crate) fn length(law: &(impl GrowthLaw + ?Sized), initial: f64, t: f64) -> f64 {
    let zone = law.zone_length();
    match law.exit_time(initial, 0.0, t) {
        _ if !law.elongates() => initial,
        _ if initial >= zone => initial + zone_elongation(law, 0.0, t, PIECES),
        None => law.flow(initial, 0.0, t).0,
        Some(full) => zone + zone_elongation(law, full, t, PIECES),
    }
}

/// Increase of the length by a whole growth zone between two times, m: the integral of its apical
/// speed, on `pieces` intervals.
pub(crate) fn zone_elongation(
    law: &(impl GrowthLaw + ?Sized),
    from: f64,
    to: f64,
    pieces: u32,
) -> f64 {
    let zone = law.zone_length();
    let (x, w) = rule::<8>();
    let h = (to - from) / f64::from(pieces);
    (0..pieces)
        .flat_map(|i| {
            x.iter()
                .zip(w)
                .map(move |(x, w)| (from + h * (f64::from(i) + x), w * h))
        })
        .map(|(t, w)| w * law.apical_speed(zone, t))
        .sum()
}

/// See [`GrowthLaw::trace`].
pub(super) fn trace(law: &(impl GrowthLaw + ?Sized), initial: f64, start: f64, t: f64) -> Trace {
    let (sigma, zone) = (initial - start, law.zone_length());
    let before = (law.elongates() && sigma >= zone).then(|| exit_before_start(law, sigma));
    if !law.elongates() || before.is_some() {
        return Trace {
            arc_length: start,
            stretch: 1.0,
            exit_time: before,
        };
    }
    let exit_time = law.exit_time(sigma, 0.0, t);
    let last = exit_time.unwrap_or(t);
    let (distance, stretch) = law.flow(sigma, 0.0, last);
    let distance = if exit_time.is_some() { zone } else { distance };
    Trace {
        arc_length: length(law, initial, last) - distance,
        stretch,
        exit_time,
    }
}

/// Exit time (s) of a point outside the zone at t = 0. The zone is taken to have moved with its
/// speed of t = 0 before.
pub(crate) fn exit_before_start(law: &(impl GrowthLaw + ?Sized), sigma: f64) -> f64 {
    let zone = law.zone_length();
    -(sigma - zone) / law.apical_speed(zone, 0.0)
}
