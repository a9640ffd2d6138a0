//! Search for periods: the strongest wave in the residual is added and all waves are fitted again,
//! until only noise is left.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::background::Background;
use super::harmonics::{Harmonics, Samples, Wave};
use super::periodogram::{DENSITY, Periodogram};
use super::statistics::{FALSE_ALARM, SIGNIFICANT};

/// Smallest amplitude over the largest. Smaller oscillations cannot be distinguished from the error
/// of the model.
const SMALLEST: f64 = 5e-3;

/// Settings of the search for periods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Lowest degree of the polynomial in time that describes the drift; 3 by default. It is
    /// increased by up to 4 while the residual has significantly more power along one of the next
    /// two Legendre polynomials than at the lowest frequencies above the drift. A track needs at
    /// least 2 (`drift` + 4) positions.
    pub drift: usize,
    /// Smallest number of periods in the track; 2 by default. Slower motion is drift. At least 1,
    /// and at most the number of turns that the sampling intervals resolve, one in two intervals.
    pub least_turns: f64,
    /// Largest number of oscillations; 4 by default.
    pub most: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            drift: 3,
            least_turns: 2.0,
            most: 4,
        }
    }
}

/// Finds the drift and all waves that exceed noise.
pub(super) fn find_waves(samples: &Samples, search: &Search) -> Harmonics {
    let mut degree = search.drift;
    let mut periodogram = Periodogram::new(samples, [PI * search.least_turns, samples.highest]);
    loop {
        let best = waves(samples, search, degree, &mut periodogram);
        // Slow motion above the degree of the drift disturbs all waves and the estimate of the
        // noise.
        let higher = raised(&best, samples, search);
        if higher == degree {
            return best;
        }
        degree = higher;
    }
}

/// Finds all waves beside a drift of a given degree. If the residual contains others, the standard
/// errors allow for them.
fn waves(
    samples: &Samples,
    search: &Search,
    degree: usize,
    periodogram: &mut Periodogram,
) -> Harmonics {
    let mut best = Harmonics::new(degree, &[]);
    let _ = best.fit(samples, 0);
    let mut refused: Vec<f64> = Vec::new();
    // Whether the residual contains more waves. A rejected wave, such as one that is too close to
    // another, leaves its motion there.
    let more = loop {
        let known = [best.omegas(), refused.clone()].concat();
        let Some(omega) = strongest(samples, &best, &known, periodogram) else {
            break !refused.is_empty();
        };
        if best.waves.len() >= search.most || refused.len() > search.most {
            break true;
        }
        let Some(next) = resolved(
            samples,
            search,
            degree,
            &[best.omegas(), vec![omega]].concat(),
        ) else {
            refused.push(omega);
            continue;
        };
        let smallest = SMALLEST * next.largest();
        if next
            .waves
            .iter()
            .any(|wave| wave.ellipse().major < smallest)
        {
            break true;
        }
        best = next;
    };
    if more {
        best.widen();
    }
    best
}

/// The lowest degree of the drift with which no significant drift is left beside the waves of a
/// fit, or the highest permitted one.
fn raised(fit: &Harmonics, samples: &Samples, search: &Search) -> usize {
    let omegas = fit.omegas();
    // A polynomial follows half a turn for each degree. The slowest wave has at least one turn
    // more.
    let turns = omegas.iter().copied().fold(f64::INFINITY, f64::min) / PI;
    // With the default cubic, raised by four degrees, the residual of a sinusoid of one turn is
    // 3e-3 of its amplitude.
    let highest = (search.drift + 4).min((2.0 * (turns - 1.0)) as usize);
    let smallest = SMALLEST * fit.largest();
    let mut last = fit.clone();
    while last.degree() < highest && last.drifts(samples, smallest) {
        let Some(next) = resolved(samples, search, last.degree() + 1, &omegas) else {
            break;
        };
        last = next;
    }
    last.degree()
}

/// Fit of a drift and waves with initial frequencies, if it converges and the waves are resolved.
/// No frequency is then below the lowest one of the search, where a wave would cancel the drift.
/// Any two differ by a turn over the whole track: two closer ones fit a swing with growing
/// amplitude as well as one does, but they nearly cancel and their amplitudes are undetermined.
/// Each wave exceeds three standard errors.
fn resolved(
    samples: &Samples,
    search: &Search,
    degree: usize,
    omegas: &[f64],
) -> Option<Harmonics> {
    let mut fit = Harmonics::new(degree, omegas);
    let converged = fit.fit(samples, omegas.len());
    let lowest = PI * (search.least_turns - 1.0 / DENSITY);
    let near = |a: &Wave, b: &Wave| (a.omega - b.omega).abs() < PI;
    let sound = |(i, a): (usize, &Wave)| {
        let size = a.ellipse().major;
        a.omega > lowest
            && size > SIGNIFICANT * a.error()
            && !fit.waves[..i].iter().any(|b| near(a, b))
    };
    (converged && fit.waves.iter().enumerate().all(sound)).then_some(fit)
}

/// Power over the variance of white noise above which a peak is significant, for a number of
/// independent frequencies.
///
/// The power of noise in two coordinates over its variance p is distributed as χ² with four degrees
/// of freedom: it exceeds p = 2h at one frequency with probability (1 + h) e⁻ʰ.
fn significant_power(independent: f64) -> f64 {
    let odds = independent / FALSE_ALARM;
    // A fixed-point iteration for h = ln(odds (1 + h)) divides the error by 1 + h > 10. Twenty of
    // them reach rounding.
    2.0 * (0..20).fold(odds.ln(), |half, _| (odds * (1.0 + half)).ln())
}

/// The angular frequency of the highest peak of the residual, among those that exceed the
/// background of white and red noise. Frequencies near the known ones are excluded. Among peaks of
/// almost the same height the one with the lowest frequency is returned: the others are its aliases
/// if the positions were taken in pairs or bursts.
fn strongest(
    samples: &Samples,
    fit: &Harmonics,
    known: &[f64],
    periodogram: &mut Periodogram,
) -> Option<f64> {
    let rest = fit.residuals(samples);
    let noise = rest.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * rest.len()) as f64;
    if !(noise > samples.rounding().powi(2)) {
        return None;
    }
    let background = Background::of(&samples.times, &rest);
    let independent = (periodogram.count as f64 / DENSITY).max(1.0);
    let significant = noise * significant_power(independent);
    let least = significant * background.least();
    let mut powers = periodogram.powers(&rest, fit.degree());
    for (k, power) in powers.iter_mut().enumerate() {
        let omega = periodogram.omega(k);
        let free = || known.iter().all(|other| (omega - other).abs() >= PI);
        // The first comparison rejects most frequencies, and requires no evaluation of the
        // background.
        if !(*power > least && free() && *power > significant * background.at(omega)) {
            *power = 0.0;
        }
    }
    let highest = powers.iter().copied().fold(0.0, f64::max);
    let at = |k: usize| powers.get(k).copied().unwrap_or(0.0);
    let is_peak =
        |k: &usize| at(*k) > 0.0 && at(*k) >= at(k + 1) && (*k == 0 || at(*k) > at(k - 1));
    // The grid misses up to 3 % of the height of a peak, so that peaks that differ by 5 % may be
    // aliases.
    (0..powers.len())
        .filter(is_peak)
        .find(|k| at(*k) >= 0.95 * highest)
        .map(|k| periodogram.omega(k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_exceeds_the_significant_power_with_the_probability_of_a_false_alarm() {
        for independent in [1.0, 80.0, 1e6] {
            let half = 0.5 * significant_power(independent);
            let chance = independent * (1.0 + half) * (-half).exp();
            // Rounding of h, which is below 40, is magnified by h in the exponential.
            approx::assert_relative_eq!(
                chance,
                FALSE_ALARM,
                max_relative = 40.0 * 4.0 * f64::EPSILON
            );
        }
    }
}
