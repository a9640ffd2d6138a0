//! Check of growth laws.

use nalgebra::{SVector, Vector1, Vector2};

use super::error::{At, Checked, LawError, Quantity, Where};
use super::{ROUNDING, STEP, WRONG, slope};
use crate::growth::{GrowthLaw, integrated_flow, length};
use crate::scene::before;

/// Checks a growth law at pairs of a positive distance σ from the apex (m) and a time (s), and its
/// motion over a time `span` (s) from there, or up to a discontinuity before. At the apex itself
/// only the speed is checked.
///
/// With v the [apical speed](GrowthLaw::apical_speed), ∂v/∂σ must be the [REGR](GrowthLaw::regr)
/// and v must be zero at the apex; [`flow`](GrowthLaw::flow) must integrate dσ/dt = v and d ln γ/dt
/// = REGR, forwards and backwards; a point must leave the zone at its
/// [`exit_time`](GrowthLaw::exit_time); and [`length`](GrowthLaw::length) must follow from these.
/// Of a point outside the zone only the exit time is checked. A law that does not elongate must not
/// move points.
///
/// # Errors
/// The first quantity that is not finite or contradicts the others, and a check without points. If
/// the speed contradicts the REGR, a `flow` in closed form decides which of them is wrong; without
/// one the speed is reported.
pub fn growth_law<G: GrowthLaw>(law: &G, points: &[(f64, f64)], span: f64) -> Result<(), LawError> {
    At::of_points::<G>(points.len())?;
    let arguments = At::of::<G>(Where::Arguments);
    if !(span > 0.0 && span.is_finite()) {
        return Err(arguments.error(Quantity::Span, [span, f64::NAN], "positive and finite"));
    }
    for &(sigma, time) in points {
        arguments.finite(Quantity::Point, sigma)?;
        arguments.finite(Quantity::Point, time)?;
        let until = (time + span).min(before(law.next_discontinuity(time)));
        let at = At::of::<G>(Where::Growing { sigma, time });
        let point = FollowedPoint {
            law,
            at,
            sigma,
            time,
            until,
        };
        if !law.elongates() {
            point.check_fixed()?;
            continue;
        }
        if sigma < law.zone_length() {
            point.check_rates()?;
            point.check_motion()?;
        }
        point.check_exit()?;
        point.check_length()?;
    }
    Ok(())
}

/// A point from which a growth law is followed.
struct FollowedPoint<'a, G> {
    law: &'a G,
    at: At,
    /// Distance from the apex, m.
    sigma: f64,
    /// Start and end, s.
    time: f64,
    until: f64,
}

impl<G: GrowthLaw> FollowedPoint<'_, G> {
    /// Compares the speed, the REGR and the rates of the motion with each other.
    fn check_rates(&self) -> Checked {
        let Self {
            law,
            at,
            sigma,
            time,
            ..
        } = *self;
        let (regr, speed) = (law.regr(sigma, time), law.apical_speed(sigma, time));
        at.finite(Quantity::Regr, regr)?;
        at.finite(Quantity::ApicalSpeed, speed)?;
        if sigma <= 0.0 {
            return at.equal(Quantity::ApicalSpeed, [speed, 0.0], 0.0, "zero at the apex");
        }
        let rate = regr.abs().max((speed / sigma).abs());
        at.equal(
            Quantity::ApicalSpeed,
            [law.apical_speed(0.0, time), 0.0],
            WRONG * rate * sigma,
            "zero at the apex",
        )?;
        let step = (STEP * sigma).min(0.5 * (law.zone_length() - sigma));
        let (by_sigma, error) = slope(|x| Vector1::new(law.apical_speed(sigma + x, time)), step);
        let tolerance =
            |error: f64, size: f64, step: f64| WRONG * size + error + ROUNDING * size / step;
        if (by_sigma[0] - regr).abs() <= tolerance(error[0], rate, step / sigma) {
            return Ok(());
        }
        // The motion tells whether the speed or the REGR is wrong.
        let step = STEP / rate;
        let moved = |x| {
            let (distance, stretch) = law.flow(sigma, time, time + x);
            Vector2::new(distance, stretch.ln())
        };
        let (moves, error) = slope(moved, step);
        let size: SVector<f64, 2> = Vector2::new(sigma, 1.0);
        let agrees = |k: usize, expected: f64| {
            (moves[k] - expected).abs()
                <= tolerance(error[k], rate * size[k], step * rate) + ROUNDING * time.abs()
        };
        if agrees(0, speed) && !agrees(1, regr) {
            return Err(at.error(
                Quantity::Regr,
                [regr, by_sigma[0]],
                "the derivative of the apical speed",
            ));
        }
        Err(at.error(Quantity::ApicalSpeedSlope, [by_sigma[0], regr], "the REGR"))
    }

    /// Compares the motion with that by numerical integration.
    fn check_motion(&self) -> Checked {
        let Self {
            law,
            at,
            sigma,
            time,
            until,
        } = *self;
        let (distance, stretch) = law.flow(sigma, time, until);
        let expected = integrated_flow(law, sigma, time, until);
        let requirement = "the integral of the apical speed";
        at.equal(
            Quantity::Distance,
            [distance, expected.0],
            WRONG * expected.0.abs(),
            requirement,
        )?;
        let requirement = "the exponential of the integral of the REGR";
        at.equal(
            Quantity::Stretch,
            [stretch, expected.1],
            WRONG * expected.1.abs(),
            requirement,
        )?;
        let (start, shrink) = law.flow(distance, until, time);
        at.equal(
            Quantity::Distance,
            [start, sigma],
            WRONG * sigma,
            "that at the start, after motion back in time",
        )?;
        let requirement = "one, after motion back in time";
        at.equal(
            Quantity::Stretch,
            [stretch * shrink, 1.0],
            WRONG,
            requirement,
        )
    }

    /// Compares the exit time with the motion.
    fn check_exit(&self) -> Checked {
        let Self {
            law,
            at,
            sigma,
            time,
            until,
        } = *self;
        let zone = law.zone_length();
        if sigma >= zone {
            let exit = law.exit_time(sigma, time, until).unwrap_or(f64::NAN);
            return at.equal(
                Quantity::ExitTime,
                [exit, time],
                0.0,
                "that at which it is requested, outside the zone",
            );
        }
        if !zone.is_finite() {
            return Ok(());
        }
        // A point that reaches the end of the zone in the middle of the span.
        let middle = 0.5 * (time + until);
        let sigma = law.flow(zone, middle, time).0;
        // Points rest while growth pauses.
        if sigma >= zone || middle <= time {
            return Ok(());
        }
        let at = At {
            place: Where::Growing { sigma, time },
            ..at
        };
        let exit = law.exit_time(sigma, time, until).unwrap_or(f64::NAN);
        let tolerance = WRONG * (until - time);
        at.equal(
            Quantity::ExitTime,
            [exit, middle],
            tolerance,
            "the time at which `flow` is at the end of the zone",
        )?;
        let before = 0.5 * (time + middle);
        law.exit_time(sigma, time, before).map_or(Ok(()), |exit| {
            Err(at.error(
                Quantity::ExitTime,
                [exit, f64::NAN],
                "`None` if the point leaves later than requested",
            ))
        })
    }

    /// Compares the length of shoots that begin with this distance, and with twice the zone, with
    /// the speed.
    fn check_length(&self) -> Checked {
        let Self {
            law,
            at,
            sigma,
            time,
            until,
        } = *self;
        let zone = law.zone_length();
        let long = if zone.is_finite() { 2.0 * zone } else { sigma };
        // Lengths begin at t = 0.
        let span = until - time;
        [sigma, long].into_iter().try_for_each(|initial| {
            let values = [law.length(initial, span), length(law, initial, span)];
            let at = At {
                place: Where::Growing {
                    sigma: initial,
                    time: 0.0,
                },
                ..at
            };
            at.equal(
                Quantity::Length,
                values,
                WRONG * values[1].abs(),
                "the integral of the apical speed",
            )
        })
    }

    /// Checks that points keep their places.
    fn check_fixed(&self) -> Checked {
        let Self {
            law,
            at,
            sigma,
            time,
            until,
        } = *self;
        at.finite(Quantity::Regr, law.regr(sigma.min(law.zone_length()), time))?;
        let (distance, stretch) = law.flow(sigma, time, until);
        at.equal(
            Quantity::Distance,
            [distance, sigma],
            0.0,
            "constant, since the law does not elongate",
        )?;
        at.equal(
            Quantity::Stretch,
            [stretch, 1.0],
            0.0,
            "one, since the law does not elongate",
        )?;
        at.equal(
            Quantity::Length,
            [law.length(sigma, until), sigma],
            0.0,
            "constant, since the law does not elongate",
        )
    }
}
