//! Search for periods: the strongest wave in the residual is added and all waves are fitted again, until only noise
//! is left.

use std::f64::consts::PI;

use nalgebra::{DMatrix, Vector2};

use super::background::Background;
use super::harmonics::{Harmonics, Samples, Wave};
use super::statistics::{FALSE_ALARM, SIGNIFICANT};
use crate::numerics::quadrature::legendre_sequence;

/// Number of examined frequencies in the resolution of the track. The highest of them misses less than 3 % of a
/// peak.
const DENSITY: f64 = 8.0;
/// Smallest amplitude over the largest. Smaller oscillations cannot be distinguished from the error of the model.
const SMALLEST: f64 = 5e-3;

/// Settings of the search for periods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Lowest degree of the polynomial in time that describes the drift; 3 by default. It is increased by up to 4
    /// while the residual has significantly more power along the next two Legendre polynomials than at the lowest
    /// frequencies above the drift. A track needs at least 2 (`drift` + 4) positions.
    pub drift: usize,
    /// Smallest number of periods in the track; 2 by default. Slower motion is drift. At least 1, and finite.
    pub least_turns: f64,
    /// Largest number of oscillations; 4 by default.
    pub most: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { drift: 3, least_turns: 2.0, most: 4 }
    }
}

/// Finds the drift and all waves that exceed noise.
pub(super) fn find_waves(samples: &Samples, search: &Search) -> Harmonics {
    let mut degree = search.drift;
    loop {
        let best = waves(samples, search, degree);
        // Slow motion above the degree of the drift disturbs all waves and the estimate of the noise.
        let higher = raised(&best, samples, search);
        if higher == degree {
            return best;
        }
        degree = higher;
    }
}

/// Finds all waves beside a drift of a given degree. If the residual contains others, the standard errors allow for
/// them.
fn waves(samples: &Samples, search: &Search, degree: usize) -> Harmonics {
    let mut best = Harmonics::new(degree, &[]);
    let _ = best.fit(samples, 0);
    let mut refused: Vec<f64> = Vec::new();
    let range = [PI * search.least_turns, samples.highest];
    while best.waves.len() < search.most && refused.len() <= search.most {
        let known = [best.omegas(), refused.clone()].concat();
        let Some(omega) = strongest(samples, &best, &known, range) else { break };
        let omegas = [best.omegas(), vec![omega]].concat();
        let mut next = Harmonics::new(degree, &omegas);
        if !next.fit(samples, omegas.len()) || !sound(&next, search.least_turns) {
            refused.push(omega);
            continue;
        }
        let smallest = SMALLEST * next.largest();
        if next.waves.iter().any(|wave| wave.ellipse().major < smallest) {
            best.widen();
            return best;
        }
        best = next;
    }
    let known = [best.omegas(), refused.clone()].concat();
    let more = best.waves.len() == search.most && strongest(samples, &best, &known, range).is_some();
    // A rejected wave, as one that is too close to another, leaves its motion in the residual.
    if more || !refused.is_empty() {
        best.widen();
    }
    best
}

/// The lowest degree of the drift with which no significant drift is left beside the waves of a fit, or the highest
/// permitted one.
fn raised(fit: &Harmonics, samples: &Samples, search: &Search) -> usize {
    let omegas = fit.omegas();
    // A polynomial follows half a turn for each degree. The slowest wave has at least one turn more.
    let turns = omegas.iter().copied().fold(f64::INFINITY, f64::min) / PI;
    // With the default cubic, raised by four degrees, the residual of a sinusoid of one turn is 3e-3 of its
    // amplitude.
    let highest = (search.drift + 4).min((2.0 * (turns - 1.0)) as usize);
    let smallest = SMALLEST * fit.largest();
    let mut last = fit.clone();
    while last.degree() < highest && last.drifts(samples, smallest) {
        let mut next = Harmonics::new(last.degree() + 1, &omegas);
        if !next.fit(samples, omegas.len()) || !sound(&next, search.least_turns) {
            break;
        }
        last = next;
    }
    last.degree()
}

/// Whether the waves of a fit are resolved. No frequency is below the lowest one of the search, where a wave would
/// cancel the drift. Any two differ by a turn over the whole track: two closer ones fit a swing with growing
/// amplitude as well as one does, but they nearly cancel and their amplitudes are undetermined. Each wave exceeds
/// three standard errors.
fn sound(fit: &Harmonics, least_turns: f64) -> bool {
    let near = |a: &Wave, b: &Wave| (a.omega - b.omega).abs() < PI;
    let lowest = PI * (least_turns - 1.0 / DENSITY);
    let resolved = |(i, a): (usize, &Wave)| {
        let size = a.ellipse().major;
        a.omega > lowest && size > SIGNIFICANT * a.error() && !fit.waves[..i].iter().any(|b| near(a, b))
    };
    fit.waves.iter().enumerate().all(resolved)
}

/// The angular frequency of the highest peak of the residual in a range, among those that exceed the background of
/// white and red noise. Frequencies near the known ones are excluded. Among peaks of almost the same height the one
/// with the lowest frequency is returned: the others are its aliases if the positions were taken in pairs or
/// bursts.
fn strongest(samples: &Samples, fit: &Harmonics, known: &[f64], range: [f64; 2]) -> Option<f64> {
    let rest = fit.residuals(samples);
    let times = &samples.times;
    let noise = rest.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * rest.len()) as f64;
    if !(noise > samples.rounding.powi(2)) {
        return None;
    }
    // Orthonormal basis of the drift.
    let rows = times.iter().flat_map(|t| legendre_sequence(*t).take(fit.drift.len()));
    let drift = DMatrix::from_row_iterator(times.len(), fit.drift.len(), rows).qr().q();
    let ([lowest, highest], step) = (range, PI / DENSITY);
    if !(highest >= lowest) {
        return None;
    }
    let count = ((highest - lowest) / step).floor().max(0.0) as usize + 1;
    let mut phases: Vec<(f64, f64)> = times.iter().map(|t| (lowest * t).sin_cos()).collect();
    let turns: Vec<(f64, f64)> = times.iter().map(|t| (step * t).sin_cos()).collect();
    let background = Background::of(times, &rest);
    // The power of noise in two coordinates over its variance is distributed as χ² with four degrees of freedom.
    let chance = |half: f64| (1.0 + half) * (-half).exp() * (count as f64 / DENSITY).max(1.0);
    let mut powers = vec![0.0; count];
    for (k, found) in powers.iter_mut().enumerate() {
        let omega = lowest + step * k as f64;
        if known.iter().all(|other| (omega - other).abs() >= PI) {
            let power = power(&phases, &rest, &drift);
            if chance(0.5 * power / (noise * background.at(omega))) < FALSE_ALARM {
                *found = power;
            }
        }
        for ((sine, cosine), (s, c)) in phases.iter_mut().zip(&turns) {
            (*sine, *cosine) = (*sine * c + *cosine * s, *cosine * c - *sine * s);
        }
    }
    let highest = powers.iter().copied().fold(0.0, f64::max);
    let at = |k: usize| powers.get(k).copied().unwrap_or(0.0);
    let is_peak = |k: &usize| at(*k) > 0.0 && at(*k) >= at(k + 1) && (*k == 0 || at(*k) > at(k - 1));
    // The grid misses up to 3 % of the height of a peak, so that peaks that differ by 5 % may be aliases.
    (0..count).filter(is_peak).find(|k| at(*k) >= 0.95 * highest).map(|k| lowest + step * k as f64)
}

/// The decrease of the sum of squares by a cosine and a sine that are fitted beside the drift.
fn power(phases: &[(f64, f64)], rest: &[Vector2<f64>], drift: &DMatrix<f64>) -> f64 {
    let (mut squares, mut with_rest) = ([0.0; 3], [Vector2::zeros(); 2]);
    let mut with_drift = vec![[0.0; 2]; drift.ncols()];
    for (i, ((sine, cosine), rest)) in phases.iter().zip(rest).enumerate() {
        squares[0] += cosine * cosine;
        squares[1] += cosine * sine;
        squares[2] += sine * sine;
        with_rest[0] += rest * *cosine;
        with_rest[1] += rest * *sine;
        for (j, sums) in with_drift.iter_mut().enumerate() {
            sums[0] += drift[(i, j)] * cosine;
            sums[1] += drift[(i, j)] * sine;
        }
    }
    // The residual is orthogonal to the drift: its products with the waves do not change.
    for [cosine, sine] in with_drift {
        squares[0] -= cosine * cosine;
        squares[1] -= cosine * sine;
        squares[2] -= sine * sine;
    }
    let determinant = squares[0] * squares[2] - squares[1] * squares[1];
    if !(determinant > 1e-9 * squares[0] * squares[2]) {
        return 0.0;
    }
    let [a, b] = with_rest;
    (squares[2] * a.norm_squared() - 2.0 * squares[1] * a.dot(&b) + squares[0] * b.norm_squared()) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DVector;

    /// The sum of squares of least squares with the drift alone, less that with the drift and a wave. The wave has
    /// 0.7 turns, so that it resembles the drift.
    #[test]
    fn power_of_a_wave_is_the_decrease_of_the_sum_of_squares() {
        let times: Vec<f64> = (0..40).map(|k| -1.0 + f64::from(k) / 19.5).collect();
        let position = |t: f64| Vector2::new((3.0 * t).sin() + t * t, (2.0 * t + 1.0).cos() - t.exp());
        let positions = DMatrix::from_fn(times.len(), 2, |i, c| position(times[i])[c]);
        let drift = DMatrix::from_fn(times.len(), 3, |i, j| times[i].powi(j as i32)).qr().q();
        let phases: Vec<(f64, f64)> = times.iter().map(|t| (2.2 * t).sin_cos()).collect();
        let column = |f: fn(&(f64, f64)) -> f64| DVector::from_iterator(phases.len(), phases.iter().map(f));
        let left = |basis: &DMatrix<f64>| {
            let q = basis.clone().qr().q();
            &positions - &q * (q.transpose() * &positions)
        };
        let without = left(&drift);
        let mut both = drift.clone().resize_horizontally(5, 0.0);
        both.set_column(3, &column(|phase| phase.0));
        both.set_column(4, &column(|phase| phase.1));
        let expected = without.norm_squared() - left(&both).norm_squared();
        let rest: Vec<Vector2<f64>> = without.row_iter().map(|row| Vector2::new(row[0], row[1])).collect();
        // Rounding of sums of 40 terms, magnified by the likeness of wave and drift.
        assert_relative_eq!(power(&phases, &rest, &drift), expected, max_relative = 1e-9);
    }
}
