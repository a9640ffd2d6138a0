//! Oscillations of a tip track by least squares: periods, ellipses and standard errors.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;

use super::ellipse::Ellipse;
use super::harmonics::{Harmonics, Samples, Wave};
use super::least_squares::CONVERGED;
use super::outliers::good;
use super::search::{Search, find_waves};
use super::statistics::SIGNIFICANT;
use super::{Track, TrackingError};
use crate::error::ParameterError;

/// One oscillation of a tip.
///
/// Standard errors are those of a least-squares fit with the noise of the residual at the frequency
/// of the oscillation. The residual is described as white noise and first-order autoregressive
/// noise, by its autocorrelation. If the residual contains further oscillations, the noise is taken
/// as white noise with the variance of the residual. The errors do not contain that of a model that
/// does not apply, as for a period that changes during the track.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Oscillation {
    /// Period, s.
    pub period: f64,
    /// Standard error of the period, s. The interval of 1.64 standard errors on either side
    /// contains the true period in nine cases of ten.
    pub period_error: f64,
    /// The ellipse. Its sense is `None` unless the semi-minor axis exceeds three standard errors:
    /// noise would determine the sense of a swing in a plane.
    pub ellipse: Ellipse,
    /// Standard error of the semi-axes, m.
    pub axis_error: f64,
    /// Order n of the harmonic, if the frequency is n ≥ 2 times that of the largest oscillation
    /// within three standard errors of the difference, as for overtones of a nonlinear swing;
    /// otherwise `None`.
    pub harmonic: Option<u32>,
}

/// The oscillations of a track.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Oscillations {
    /// Oscillations in the order of decreasing amplitude.
    pub oscillations: Vec<Oscillation>,
    /// Standard deviation of the residual of a coordinate, m: noise, and motion other than drift
    /// and the oscillations.
    pub noise: f64,
    /// Degree of the polynomial that describes the drift.
    pub drift: usize,
    /// All positions less the drift, m.
    pub without_drift: Vec<Vector2<f64>>,
    /// Indices of the positions that were excluded as outliers.
    pub outliers: Vec<usize>,
}

impl Track {
    /// Finds the periods of a track and their ellipses. A track without motion has none. White
    /// noise alone is taken for an oscillation with a probability of 1e-4, and noise that is
    /// correlated over a large part of the track more often.
    ///
    /// # Errors
    /// Too few positions for the drift and one oscillation, or settings out of range.
    pub fn oscillations(&self, search: &Search) -> Result<Oscillations, TrackingError> {
        let (samples, half, unit) = self.checked(search)?;
        let (found, good) = samples.fitted(search);
        let rounding = samples.only(&good).rounding();
        let mut oscillations: Vec<Oscillation> = found
            .waves
            .iter()
            .map(|wave| oscillation(wave, half, unit, rounding))
            .collect();
        oscillations.sort_by(|a, b| b.ellipse.major.total_cmp(&a.ellipse.major));
        if let Some((largest, others)) = oscillations.split_first_mut() {
            others
                .iter_mut()
                .for_each(|other| other.harmonic = harmonic(largest, other));
        }
        let outliers = (0..good.len()).filter(|i| !good[*i]).collect();
        let (noise, drift) = (unit * found.variance.sqrt(), found.degree());
        let swing = Harmonics {
            waves: vec![],
            ..found
        }
        .residuals(&samples);
        let without_drift = swing.into_iter().map(|position| position * unit).collect();
        Ok(Oscillations {
            oscillations,
            noise,
            drift,
            without_drift,
            outliers,
        })
    }

    /// Share of a period (s) in the motion: the mean square of the oscillation with this period
    /// over the sum of the mean squares of this and of all other oscillations. Zero for a track
    /// without oscillations.
    ///
    /// # Errors
    /// The errors of [`oscillations`](Self::oscillations), or a period that is shorter than two
    /// sampling intervals or longer than the track.
    pub fn share(&self, period: f64, search: &Search) -> Result<f64, TrackingError> {
        let (samples, half, _) = self.checked(search)?;
        // The highest frequency of the search is one resolved turn below that of the sampling.
        let fits = period <= 2.0 * half && TAU * half / period <= samples.highest + PI;
        let requirement =
            "positive, at least two sampling intervals, and not longer than the track (s)";
        ParameterError::unless(
            period > 0.0 && fits,
            "period of a share",
            period,
            requirement,
        )?;
        let (found, good) = samples.fitted(search);
        let omega = TAU * half / period;
        let power = |wave: &Wave| wave.ellipse().power();
        // A wave that was found within the resolution of the track has the given period.
        let (own, all) = match found
            .waves
            .iter()
            .find(|wave| (wave.omega - omega).abs() < PI)
        {
            Some(wave) => (power(wave), found.waves.iter().map(power).sum()),
            None => {
                let mut with =
                    Harmonics::new(found.degree(), &[found.omegas(), vec![omega]].concat());
                let used = samples.only(&good);
                let fitted = with.fit(&used, found.waves.len());
                let waves = if fitted { with.waves } else { Vec::new() };
                let significant = |wave: &&Wave| {
                    let size = wave.cosine.norm_squared() + wave.sine.norm_squared();
                    size > (2.0 * SIGNIFICANT * wave.error()).powi(2) + used.rounding().powi(2)
                };
                let own = waves.last().filter(significant).map_or(0.0, power);
                (
                    own,
                    own + waves.iter().take(found.waves.len()).map(power).sum::<f64>(),
                )
            }
        };
        Ok(if all > 0.0 { own / all } else { 0.0 })
    }

    /// Samples with times from −1 to 1, half the duration (s), and the unit of their positions (m).
    ///
    /// # Errors
    /// Settings out of range, too few positions, and more turns than the positions resolve.
    fn checked(&self, search: &Search) -> Result<(Samples, f64, f64), TrackingError> {
        let (name, turns, unit) = ("least number of turns", search.least_turns, self.unit());
        ParameterError::unless(turns >= 1.0 && turns.is_finite(), name, turns, "1 or more")?;
        // Two coordinates each are twice as many data as coefficients of the drift, an ellipse and
        // a frequency.
        let needed = search.drift.saturating_add(4).saturating_mul(2);
        TrackingError::unless_positions(needed, self.times.len())?;
        let (samples, half) = self.in_unit(unit).samples();
        let requirement =
            "at most the number of turns that the sampling intervals resolve, one in two intervals";
        ParameterError::unless(turns <= samples.highest / PI, name, turns, requirement)?;
        Ok((samples, half, unit))
    }

    /// Samples with times from −1 to 1, and half the duration, s.
    pub(super) fn samples(self) -> (Samples, f64) {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let times = self.times.iter().map(|t| (t - middle) / half).collect();
        (Samples::new(times, self.positions), half)
    }
}

impl Samples {
    /// Finds waves, and returns true for positions that are not outliers. Outliers do not depend on
    /// the settings of the search. They are sought first in the positions, and then in the residual
    /// of a search with default settings, from which the oscillations are removed.
    pub(super) fn fitted(&self, search: &Search) -> (Harmonics, Vec<bool>) {
        let (first, usual) = (good(&self.times, &self.positions, 0.0), Search::default());
        let used = self.only(&first);
        let found = find_waves(&used, &usual);
        let good = good(&self.times, &found.residuals(self), used.rounding());
        if good == first && *search == usual {
            return (found, good);
        }
        (find_waves(&self.only(&good), search), good)
    }
}

/// Converts a wave to seconds and metres. The track has a duration of 2 `half` (s). Its positions
/// are in multiples of `unit` (m) and have the error `rounding`.
fn oscillation(wave: &Wave, half: f64, unit: f64, rounding: f64) -> Oscillation {
    let period = TAU / wave.omega * half;
    let (axis_error, mut ellipse) = (wave.error(), wave.ellipse());
    // The signed minor axis of a thin ellipse is a linear function of the coefficients and has
    // their standard error.
    ellipse.sense = ellipse
        .sense
        .filter(|_| ellipse.minor > SIGNIFICANT * axis_error + rounding);
    let period_error = period * wave.omega_error / wave.omega;
    Oscillation {
        period,
        period_error,
        ellipse: ellipse.scaled(unit),
        axis_error: unit * axis_error,
        harmonic: None,
    }
}

/// The order of an oscillation that is a harmonic of a fundamental.
fn harmonic(fundamental: &Oscillation, other: &Oscillation) -> Option<u32> {
    let ratio = fundamental.period / other.period;
    let order = ratio.round();
    let errors = [fundamental, other].map(|wave| wave.period_error / wave.period);
    let error = ratio * errors[0].hypot(errors[1]);
    let agrees = (ratio - order).abs() <= SIGNIFICANT * error + ratio * CONVERGED;
    // The interval of three standard errors on either side may cover at most a tenth of the
    // frequencies between two harmonics.
    let precise = 2.0 * SIGNIFICANT * error < 0.1;
    (order >= 2.0 && precise && agrees).then_some(order as u32)
}
