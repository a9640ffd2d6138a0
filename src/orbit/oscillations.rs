//! What a path is made of.

use std::f64::consts::{PI, TAU};

use super::OrbitError;
use super::ellipse::Ellipse;
use super::harmonics::{Harmonics, Samples, Wave};
use super::path::PlanePath;
use super::search::{Search, pursue};
use crate::error::ParameterError;

/// A wave that is asked for is told from noise if it is so many standard errors large.
const TOLD: f64 = 3.0;

/// One oscillation of a tip.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Oscillation {
    /// Period, s.
    pub period: f64,
    /// Its standard error, s, as white noise leaves it: the true one is within 1.64 of them in nine of ten cases.
    pub period_error: f64,
    /// The ellipse.
    pub ellipse: Ellipse,
    /// The standard error of its semi-axes, m.
    pub axis_error: f64,
}

/// What a path is made of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Oscillations {
    /// The largest first.
    pub oscillations: Vec<Oscillation>,
    /// Standard deviation of what is left of a coordinate, m: noise, and what is no oscillation.
    pub noise: f64,
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
        let (samples, half) = self.scaled(search.drift);
        let (found, used) = pursue(&samples, search);
        let mut oscillations: Vec<Oscillation> = found.waves.iter().map(|wave| told(wave, half)).collect();
        oscillations.sort_by(|a, b| b.ellipse.major.total_cmp(&a.ellipse.major));
        let outliers = (0..used.len()).filter(|i| !used[*i]).collect();
        Ok(Oscillations { oscillations, noise: found.variance.sqrt(), outliers })
    }

    /// The share of a period (s) in the motion: the squared radii of both circles at that period over those of all periods found, itself
    /// included. Zero for a path without any.
    ///
    /// # Errors
    /// Those of [`oscillations`](Self::oscillations), or a period that is not positive, or longer than the path.
    pub fn share(&self, period: f64, search: &Search) -> Result<f64, OrbitError> {
        self.check(search)?;
        let (samples, half) = self.scaled(search.drift);
        let fits = period > 0.0 && period <= 2.0 * half;
        ParameterError::unless(
            fits,
            "period whose share is asked for",
            period,
            "positive and not longer than the path (s)",
        )?;
        let (found, used) = pursue(&samples, search);
        let omega = TAU * half / period;
        let power = |wave: &Wave| Ellipse::of(&wave.cosine, &wave.sine).power();
        // One that was found there is it.
        let (own, all) = match found.waves.iter().find(|wave| (wave.omega - omega).abs() < PI) {
            Some(wave) => (power(wave), found.waves.iter().map(power).sum()),
            None => {
                let omegas: Vec<f64> = found.waves.iter().map(|wave| wave.omega).chain([omega]).collect();
                let mut with = Harmonics::new(search.drift, &omegas);
                let waves = if with.fit(&samples, &used, found.waves.len()) { with.waves } else { Vec::new() };
                // One that is not more than its error is none.
                let told = |wave: &&Wave| {
                    let size = wave.cosine.norm_squared() + wave.sine.norm_squared();
                    let error = wave.cosine_error.norm_squared() + wave.sine_error.norm_squared();
                    size > TOLD * TOLD * error + samples.rounding()
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

    /// Times from −1 to 1, and half the duration, s.
    fn scaled(&self, degree: usize) -> (Samples, f64) {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let times = self.times.iter().map(|t| (t - middle) / half).collect();
        (Samples { times, positions: self.positions.clone(), degree }, half)
    }
}

/// A wave in seconds, where the path is twice `half` s long.
fn told(wave: &Wave, half: f64) -> Oscillation {
    let period = TAU / wave.omega * half;
    let squares = (wave.cosine_error.norm_squared() + wave.sine_error.norm_squared()) / 4.0;
    Oscillation {
        period,
        period_error: period * wave.omega_error / wave.omega,
        ellipse: Ellipse::of(&wave.cosine, &wave.sine),
        axis_error: squares.sqrt(),
    }
}
