//! Growth laws: the relative elemental growth rate (REGR), and the motion of material points that
//! follows from it.

mod fixed;
mod profile;
mod trace;
mod uniform;

pub use fixed::Ongoing;
pub use profile::{CosineProfile, LinearProfile};
pub use trace::Trace;
pub(crate) use trace::{exit_before_start, length, zone_elongation};
pub use uniform::UniformGrowth;

use crate::error::ParameterError;
use crate::numerics::quadrature::integral;
use crate::numerics::scalar::newton;
use crate::pointers::forward_pointers;

/// Growth of the zone near the apex, equation (2): γ̇ = γ REGR.
///
/// Places are given by their distance σ from the apex along the shoot (m), which changes with the
/// rate σ̇ = ∫ REGR from 0 to σ. Unlike arc lengths from the base, small distances do not suffer
/// from cancellation. Lengths are unstretched: elastic stretch by a load does not affect growth.
/// `()` is no growth.
///
/// A law must implement [`regr`](Self::regr) and [`zone_length`](Self::zone_length). The motion is
/// integrated numerically unless the law implements it in closed form.
///
/// Growth that is fastest at the apex and vanishes at the end of the zone
/// ([chapter](crate::guide::own_laws)):
///
/// ```
/// use morphorod::growth::GrowthLaw;
///
/// struct FadingGrowth {
///     /// ℓg, m.
///     zone_length: f64,
///     /// τg, s.
///     time: f64,
/// }
///
/// impl GrowthLaw for FadingGrowth {
///     fn regr(&self, sigma: f64, _t: f64) -> f64 {
///         1.5 * (1.0 - (sigma / self.zone_length).powi(2)) / self.time
///     }
///
///     fn zone_length(&self) -> f64 {
///         self.zone_length
///     }
/// }
///
/// let law = FadingGrowth { zone_length: 0.04, time: 72e3 };
/// assert_eq!(morphorod::check::growth_law(&law, &[(0.01, 0.0), (0.03, 0.0)], 10e3), Ok(()));
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a growth law",
    note = "`Shoot::builder` takes the elastic law, `.growth`, `.tropism`, `.load` and `.scene` take the others",
    note = "growth laws implement `morphorod::growth::GrowthLaw`: `UniformGrowth` and others, \
        `Ongoing(law)` for constant length"
)]
pub trait GrowthLaw {
    /// Relative elemental growth rate at distance `sigma` ≤ zone length from the apex at time `t`
    /// (s), in 1/s.
    fn regr(&self, sigma: f64, t: f64) -> f64;

    /// Length of the growth zone ℓg, measured from the apex, m; positive, infinite if no point ever
    /// leaves it.
    fn zone_length(&self) -> f64;

    /// Whether the shoot elongates. If not, points keep their places, and [`regr`](Self::regr) is
    /// the rate of differential growth alone.
    fn elongates(&self) -> bool {
        true
    }

    /// Speed of the apex relative to the point at distance `sigma` (m) from it, at time `t` (s): ∫
    /// REGR dσ from 0 to `sigma`, m/s. The default is adaptive Gauss–Lobatto quadrature, for
    /// profiles that are piecewise smooth over the zone. It evaluates a smooth profile at 24
    /// places. The builder of a shoot compares it with a finer integral at t = 0.
    fn apical_speed(&self, sigma: f64, t: f64) -> f64 {
        integral(&|place| self.regr(place, t), 0.0, sigma)
    }

    /// Moves a point from distance `sigma` (m) from the apex at time `from` (s) to time `to` (s,
    /// earlier or later), without regard to the end of the zone. Returns its new distance from the
    /// apex (m) and its stretch, the length of tissue at `to` over that at `from`. The default
    /// integrates dσ/dt = [`apical_speed`](Self::apical_speed) by the classical Runge–Kutta method.
    fn flow(&self, sigma: f64, from: f64, to: f64) -> (f64, f64) {
        if self.elongates() {
            integrated_flow(self, sigma, from, to)
        } else {
            (sigma, 1.0)
        }
    }

    /// Time (s) at which the point with distance `sigma` (m) at time `from` (s) leaves the zone.
    /// For a point that is outside already it is `from`. `None` if it is later than `until` (s), or
    /// if the shoot does not elongate.
    fn exit_time(&self, sigma: f64, from: f64, until: f64) -> Option<f64> {
        if self.elongates() {
            search_exit(self, sigma, from, until)
        } else {
            None
        }
    }

    /// The length of a shoot at time `t` ≥ 0 (s) whose length at t = 0 is `initial` (m), in m.
    fn length(&self, initial: f64, t: f64) -> f64 {
        trace::length(self, initial, t)
    }

    /// The material point with arc length `start` (m) at t = 0, in a shoot of length `initial` (m),
    /// at time `t` ≥ 0 (s).
    fn trace(&self, initial: f64, start: f64, t: f64) -> Trace {
        trace::trace(self, initial, start, t)
    }

    /// First time after `t` (s) at which REGR or its time derivative is discontinuous; infinite by
    /// default. Integrators step onto it and evaluate the law a few units of rounding before and
    /// after it.
    fn next_discontinuity(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Checks the parameters for a shoot with the given initial length (m).
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn check(&self, _length: f64) -> Result<(), ParameterError> {
        Ok(())
    }
}

/// Checks the parameters of a law with a zone length (m) and a growth time (s).
fn check_zone(length: f64, time: f64) -> Result<(), ParameterError> {
    ParameterError::positive("length of the growth zone", length, "m")?;
    ParameterError::positive("growth time", time, "s")
}

/// Number of parts of the zone in which the integral is computed for the check, and largest
/// relative difference: far above the error of the quadrature of a peak, and below that of a
/// measured profile.
const SPEED_PARTS: usize = 64;
const SPEED_ERROR: f64 = 1e-6;

/// Requirement of the rate of growth of a shoot that elongates.
pub(crate) const NOT_SHRINKING: &str =
    "zero or positive: tissue that shrinks does not leave the growth zone (1/s)";

/// Checks that the rate of growth of a shoot of some length (m) is not negative at t = 0, and that
/// the speed of its apex is the integral of this rate.
///
/// # Errors
/// A negative rate. Speed and integral differ, for example since the default quadrature misses a
/// narrow peak. The check does not notice a peak that is narrower than the distance of its own
/// places, 1/1500 of the zone on average.
pub(crate) fn check_speed(law: &impl GrowthLaw, length: f64) -> Result<(), ParameterError> {
    if !law.elongates() {
        return Ok(());
    }
    let zone = law.zone_length().min(length);
    let parts = SPEED_PARTS as f64;
    for sigma in (0..SPEED_PARTS).map(|k| zone * (k as f64 + 0.5) / parts) {
        let (name, rate) = ("growth rate REGR at t = 0", law.regr(sigma, 0.0));
        ParameterError::unless(!(rate < 0.0), name, rate, NOT_SHRINKING)
            .map_err(|error| error.at(length - sigma))?;
    }
    let pieces = (0..SPEED_PARTS).map(|k| [k, k + 1].map(|k| zone * k as f64 / parts));
    let exact: f64 = pieces
        .map(|[a, b]| integral(&|sigma| law.regr(sigma, 0.0), a, b))
        .sum();
    let speed = law.apical_speed(zone, 0.0);
    let what = "integral of the growth rate (`regr`, which must be bounded) over the zone at t = 0";
    ParameterError::finite(what, exact, "m/s")?;
    ParameterError::finite("apical speed of the zone at t = 0", speed, "m/s")?;
    let (what, excess) = (
        "apical speed minus the integral of the growth rate over the zone at t = 0",
        speed - exact,
    );
    let requirement =
        "zero: correct `apical_speed`, or implement it if the growth rate has a narrow peak (m/s)";
    ParameterError::unless(
        excess.abs() <= SPEED_ERROR * exact.abs(),
        what,
        excess,
        requirement,
    )
}

/// Number of steps of the classical fourth-order Runge–Kutta method for (σ, ln γ). A step is 1/512
/// of the fastest growth time: the error is about 1e-13 over a growth time, and rounding over a
/// time step of a simulation.
fn steps_for<G: GrowthLaw + ?Sized>(law: &G, sigma: f64, from: f64, to: f64) -> usize {
    let end = law.zone_length().min(2.0 * sigma);
    let places = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| part * end);
    let times = [from, 0.5 * (from + to), to].into_iter();
    let rates = times.flat_map(|time| places.map(|place| law.regr(place, time).abs()));
    let wanted = (512.0 * rates.fold(0.0, f64::max) * (to - from).abs()).ceil();
    // The bound limits the work for an infinite rate. The caller checks the result.
    if wanted.is_finite() {
        wanted.clamp(1.0, 1e6) as usize
    } else {
        1
    }
}

/// Moves a point by integration of the speed and of the rate of growth, see [`GrowthLaw::flow`].
pub(crate) fn integrated_flow(
    law: &(impl GrowthLaw + ?Sized),
    sigma: f64,
    from: f64,
    to: f64,
) -> (f64, f64) {
    integrate(law, sigma, from, to, steps_for(law, sigma, from, to))
}

/// Moves a point by `steps` steps of the classical fourth-order Runge–Kutta method, see
/// [`GrowthLaw::flow`].
fn integrate<G: GrowthLaw + ?Sized>(
    law: &G,
    sigma: f64,
    from: f64,
    to: f64,
    steps: usize,
) -> (f64, f64) {
    let h = (to - from) / steps as f64;
    let (mut sigma, mut log_stretch) = (sigma, 0.0);
    let slope = |sigma: f64, t: f64| (law.apical_speed(sigma, t), law.regr(sigma, t));
    for i in 0..steps {
        let t = from + h * i as f64;
        let (v1, r1) = slope(sigma, t);
        let (v2, r2) = slope(sigma + 0.5 * h * v1, t + 0.5 * h);
        let (v3, r3) = slope(sigma + 0.5 * h * v2, t + 0.5 * h);
        let (v4, r4) = slope(sigma + h * v3, t + h);
        sigma += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4);
        log_stretch += h / 6.0 * (r1 + 2.0 * (r2 + r3) + r4);
    }
    (sigma, log_stretch.exp())
}

fn search_exit<G: GrowthLaw + ?Sized>(law: &G, sigma: f64, from: f64, until: f64) -> Option<f64> {
    let end = law.zone_length();
    if sigma >= end {
        return Some(from);
    }
    if law.flow(sigma, from, until).0 < end {
        return None;
    }
    // The distance increases with time.
    let excess = |t: f64| {
        let distance = law.flow(sigma, from, t).0;
        (distance - end, law.apical_speed(distance, t))
    };
    let accuracy = 4.0 * f64::EPSILON * until.abs().max(until - from);
    Some(newton([from, until], until, accuracy, excess))
}

forward_pointers!(GrowthLaw {
    fn regr(sigma: f64, t: f64) -> f64;
    fn zone_length() -> f64;
    fn elongates() -> bool;
    fn apical_speed(sigma: f64, t: f64) -> f64;
    fn flow(sigma: f64, from: f64, to: f64) -> (f64, f64);
    fn exit_time(sigma: f64, from: f64, until: f64) -> Option<f64>;
    fn length(initial: f64, t: f64) -> f64;
    fn trace(initial: f64, start: f64, t: f64) -> Trace;
    fn next_discontinuity(t: f64) -> f64;
    fn check(length: f64) -> Result<(), ParameterError>;
});

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn integrated_motion_converges_at_fourth_order() {
        let law = LinearProfile {
            zone_length: 0.03,
            time: 72_000.0,
        };
        let exact = law.flow(0.004, 0.0, law.time);
        let errors = [8, 16, 32, 64].map(|steps| {
            let (distance, stretch) = integrate(&law, 0.004, 0.0, law.time, steps);
            [distance / exact.0 - 1.0, stretch / exact.1 - 1.0]
        });
        // Four is the design order of the classical Runge–Kutta method. The last error is 1e-9 and
        // far above rounding.
        for component in 0..2 {
            let order = (errors[2][component] / errors[3][component]).log2();
            assert_abs_diff_eq!(order, 4.0, epsilon = 0.2);
        }
    }

    #[test]
    fn speed_that_is_not_the_integral_of_the_rate_is_refused() {
        /// A constant rate with a higher one in a band of some width (m), 2.1 cm from the apex, and
        /// the error of a speed that is given in closed form.
        struct Band {
            width: f64,
            error: Option<f64>,
        }
        impl GrowthLaw for Band {
            fn regr(&self, sigma: f64, _t: f64) -> f64 {
                if 2.0 * (sigma - 0.021).abs() < self.width {
                    1.1e-5
                } else {
                    1e-6
                }
            }
            fn zone_length(&self) -> f64 {
                0.05
            }
            fn apical_speed(&self, sigma: f64, t: f64) -> f64 {
                let within = (sigma - 0.021 + 0.5 * self.width).clamp(0.0, self.width);
                let exact = 1e-6 * sigma + 1e-5 * within;
                self.error.map_or_else(
                    || integral(&|place| self.regr(place, t), 0.0, sigma),
                    |error| exact + error,
                )
            }
        }
        let check = |width, error| check_speed(&Band { width, error }, 0.1);
        // None of the 24 places is in a band of 0.2 mm.
        assert!(check(5e-3, None).is_ok() && check(2e-4, Some(0.0)).is_ok());
        let error = check(2e-4, None).unwrap_err().to_string();
        assert!(error.contains("apical speed"), "{error}");
        // An error of 1e-5 of the speed, which is 1e-7 m/s.
        assert!(check(5e-3, Some(1e-12)).is_err());
    }
}
