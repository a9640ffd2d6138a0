//! What a path is made of.

use std::f64::consts::{PI, TAU};

use super::OrbitError;
use super::ellipse::Ellipse;
use super::harmonics::{CONVERGED, Harmonics, SIGNIFICANT, Samples, Wave};
use super::path::PlanePath;
use super::search::{Search, pursue};
use crate::error::ParameterError;

/// Largest standard error of a frequency, over that of the fundamental, with which a harmonic is recognised. The interval of three standard
/// errors on either side of a harmonic then covers at most a tenth of the frequencies between two harmonics.
const RECOGNISED: f64 = 1.0 / 60.0;

/// One oscillation of a tip.
///
/// Standard errors are those of a least-squares fit with the noise that the residual has at the frequency of the oscillation: the residual
/// is described as white noise and first-order autoregressive noise, by its autocorrelation. If the residual contains further oscillations,
/// the noise is taken as white noise of the variance of the residual. They do not contain the error of a model that
/// does not apply, as for a period that changes during the path.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Oscillation {
    /// Period, s.
    pub period: f64,
    /// Standard error of the period, s. The interval of 1.64 standard errors on either side contains the true period in nine cases of ten.
    pub period_error: f64,
    /// The ellipse. Its sense is `None` unless the semi-minor axis exceeds three standard errors: the sense of a swing in a plane would
    /// otherwise be that of the noise.
    pub ellipse: Ellipse,
    /// Standard error of the semi-axes, m.
    pub axis_error: f64,
    /// Order n of the harmonic, if the frequency is n ≥ 2 times that of the largest oscillation within three standard errors of the
    /// difference. Overtones of a nonlinear swing are harmonics. `None` for the largest oscillation and for all others.
    pub harmonic: Option<u32>,
}

/// What a path is made of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Oscillations {
    /// The largest first.
    pub oscillations: Vec<Oscillation>,
    /// Standard deviation of the residual of a coordinate, m: noise, and motion that is neither drift nor one of the oscillations.
    pub noise: f64,
    /// Degree of the polynomial that describes the drift.
    pub drift: usize,
    /// Positions that were left out as outliers, by their places in the path.
    pub outliers: Vec<usize>,
}

impl PlanePath {
    /// Finds the periods of a path, the largest first, and their ellipses.
    ///
    /// A path that does not move, or in which nothing but noise is left, has none: an answer, not an error.
    ///
    /// # Errors
    /// Too few positions for the drift and one oscillation, or settings that make no sense.
    pub fn oscillations(&self, search: &Search) -> Result<Oscillations, OrbitError> {
        self.check(search)?;
        let (samples, half) = self.scaled();
        let (found, used) = self.fitted(&samples, search);
        let rounding = samples.rounding().sqrt();
        let mut oscillations: Vec<Oscillation> = found.waves.iter().map(|wave| told(wave, half, rounding)).collect();
        oscillations.sort_by(|a, b| b.ellipse.major.total_cmp(&a.ellipse.major));
        if let Some((largest, others)) = oscillations.split_first_mut() {
            others.iter_mut().for_each(|other| other.harmonic = harmonic(largest, other));
        }
        let outliers = (0..used.len()).filter(|i| !used[*i]).collect();
        Ok(Oscillations { oscillations, noise: found.variance.sqrt(), drift: found.degree(), outliers })
    }

    /// The share of a period (s) in the motion: the squared radii of both circles at that period over those of all periods found, itself
    /// included. Zero for a path without any.
    ///
    /// # Errors
    /// Those of [`oscillations`](Self::oscillations), or a period that is not positive, or longer than the path.
    pub fn share(&self, period: f64, search: &Search) -> Result<f64, OrbitError> {
        self.check(search)?;
        let (samples, half) = self.scaled();
        let fits = period > 0.0 && period <= 2.0 * half;
        ParameterError::unless(
            fits,
            "period whose share is asked for",
            period,
            "positive and not longer than the path (s)",
        )?;
        let (found, used) = self.fitted(&samples, search);
        let omega = TAU * half / period;
        let power = |wave: &Wave| Ellipse::of(&wave.cosine, &wave.sine).power();
        // One that was found there is it.
        let (own, all) = match found.waves.iter().find(|wave| (wave.omega - omega).abs() < PI) {
            Some(wave) => (power(wave), found.waves.iter().map(power).sum()),
            None => {
                let omegas: Vec<f64> = found.waves.iter().map(|wave| wave.omega).chain([omega]).collect();
                let mut with = Harmonics::new(found.degree(), &omegas);
                let waves = if with.fit(&samples, &used, found.waves.len()) { with.waves } else { Vec::new() };
                // One that is not more than its error is none.
                let told = |wave: &&Wave| {
                    let size = wave.cosine.norm_squared() + wave.sine.norm_squared();
                    let error = wave.cosine_error.norm_squared() + wave.sine_error.norm_squared();
                    size > SIGNIFICANT * SIGNIFICANT * error + samples.rounding()
                };
                let own = waves.last().filter(told).map_or(0.0, power);
                (own, own + waves.iter().take(found.waves.len()).map(power).sum::<f64>())
            }
        };
        Ok(if all > 0.0 { own / all } else { 0.0 })
    }

    /// Refuses settings that make no sense, and too few positions for them.
    fn check(&self, search: &Search) -> Result<(), OrbitError> {
        let turns = search.least_turns;
        ParameterError::unless(turns >= 1.0 && turns.is_finite(), "least number of turns", turns, "1 or more")?;
        // Twice as many numbers as unknowns.
        let needed = 2 * (search.drift + 4);
        if self.times.len() < needed {
            return Err(OrbitError::TooFew { positions: self.times.len(), needed });
        }
        Ok(())
    }

    /// All waves that a search finds, and for each position whether it is no outlier. Outliers are the same for every search: they are
    /// detected in the residual of the default search, which does not contain the oscillations.
    pub(super) fn fitted(&self, samples: &Samples, search: &Search) -> (Harmonics, Vec<bool>) {
        let (first, usual) = (self.good(), Search::default());
        let found = pursue(samples, &usual, &first);
        let residual = Self { times: self.times.clone(), positions: found.residuals(samples) };
        let good = residual.good();
        if good == first && *search == usual {
            return (found, good);
        }
        (pursue(samples, search, &good), good)
    }

    /// Times from −1 to 1, and half the duration, s.
    pub(super) fn scaled(&self) -> (Samples, f64) {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let times = self.times.iter().map(|t| (t - middle) / half).collect();
        (Samples { times, positions: self.positions.clone() }, half)
    }
}

/// Converts a wave to seconds; the path is twice `half` seconds long, and its positions have an error by `rounding` (m).
pub(super) fn told(wave: &Wave, half: f64, rounding: f64) -> Oscillation {
    let period = TAU / wave.omega * half;
    let (axis_error, mut ellipse) = (wave.error(), Ellipse::of(&wave.cosine, &wave.sine));
    // In a thin ellipse the minor axis, with a sign for the sense, is a linear function of the coefficients, with their standard error.
    ellipse.sense = ellipse.sense.filter(|_| ellipse.minor > SIGNIFICANT * axis_error + rounding);
    Oscillation { period, period_error: period * wave.omega_error / wave.omega, ellipse, axis_error, harmonic: None }
}

/// The order of the harmonic of a fundamental that an oscillation is.
fn harmonic(fundamental: &Oscillation, other: &Oscillation) -> Option<u32> {
    let ratio = fundamental.period / other.period;
    let order = ratio.round();
    let errors = [fundamental, other].map(|wave| wave.period_error / wave.period);
    let error = ratio * errors[0].hypot(errors[1]);
    let agrees = (ratio - order).abs() <= SIGNIFICANT * error + ratio * CONVERGED;
    (order >= 2.0 && error < RECOGNISED && agrees).then_some(order as u32)
}
