//! The search for periods: the strongest first, what is left for the next, and all of them fitted anew.

use std::f64::consts::PI;

use nalgebra::{DMatrix, Vector2};

use super::ellipse::Ellipse;
use super::harmonics::{Harmonics, Samples, Wave, legendre};
use super::robust::{despiked, median, median_gap};

/// Frequencies looked at, over the resolution of the path: the highest of them misses less than 3 % of a peak.
const DENSITY: f64 = 8.0;
/// Chance that noise alone makes a peak as high.
const CHANCE: f64 = 1e-4;
/// Oscillations smaller than this against the largest are not told from what the model leaves out.
const SMALLEST: f64 = 5e-3;
/// A position is an outlier beyond so many standard deviations of what is left: of ten thousand good ones, one is.
const OUTLIER: f64 = 4.3;
/// Rounds in which outliers are sought.
const ROUNDS: usize = 4;

/// How periods are sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Degree of the polynomial in time that the drift is taken for; 3 by default.
    pub drift: usize,
    /// A period must fit into the path so often at least; 2 by default. What is slower is drift.
    pub least_turns: f64,
    /// So many oscillations at most; 4 by default.
    pub most: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { drift: 3, least_turns: 2.0, most: 4 }
    }
}

/// All waves that are more than noise, and which positions are no outliers.
pub(super) fn pursue(samples: &Samples, search: &Search) -> (Harmonics, Vec<bool>) {
    let mut used = despiked(&samples.positions);
    let mut best = Harmonics::new(search.drift, &[]);
    let _ = best.fit(samples, &used, 0);
    let mut refused: Vec<f64> = Vec::new();
    while best.waves.len() < search.most {
        let known: Vec<f64> = best.waves.iter().map(|wave| wave.omega).chain(refused.iter().copied()).collect();
        let Some(omega) = strongest(samples, &best, &used, &known, search.least_turns) else { break };
        let omegas: Vec<f64> = best.waves.iter().map(|wave| wave.omega).chain([omega]).collect();
        let mut next = Harmonics::new(search.drift, &omegas);
        let mut kept = used.clone();
        let mut fitted = next.fit(samples, &kept, omegas.len());
        for _ in 0..ROUNDS {
            let good = without_outliers(&next.residuals(samples), &used);
            if !fitted || good == kept {
                break;
            }
            kept = good;
            fitted = next.fit(samples, &kept, omegas.len());
        }
        let size = |wave: &Wave| Ellipse::of(&wave.cosine, &wave.sine).major;
        let largest = next.waves.iter().map(size).fold(0.0, f64::max);
        // One that has moved below the lowest frequency looked at is drift, and may cancel it.
        let lowest = PI * (search.least_turns - 1.0 / DENSITY);
        let sound = fitted && next.waves.iter().all(|wave| wave.omega > lowest) && apart(&next.waves);
        if !sound {
            refused.push(omega);
            if refused.len() > search.most {
                break;
            }
            continue;
        }
        if next.waves.iter().any(|wave| size(wave) < SMALLEST * largest) {
            break;
        }
        (best, used) = (next, kept);
    }
    (best, used)
}

/// Whether any two frequencies differ by what the path resolves, a turn over all of it. A swing that swells is fitted by two that
/// are nearer as well as by one; they nearly cancel, and have any size.
fn apart(waves: &[Wave]) -> bool {
    let near = |a: &Wave, b: &Wave| (a.omega - b.omega).abs() < PI;
    !waves.iter().enumerate().any(|(i, a)| waves[..i].iter().any(|b| near(a, b)))
}

/// The frequency of the highest peak in what is left, none if noise may have made it. Frequencies that are known are not looked at.
fn strongest(samples: &Samples, fit: &Harmonics, used: &[bool], known: &[f64], least_turns: f64) -> Option<f64> {
    let rest = fit.residuals(samples);
    let chosen: Vec<usize> = (0..used.len()).filter(|i| used[*i]).collect();
    let times: Vec<f64> = chosen.iter().map(|i| samples.times[*i]).collect();
    let rest: Vec<Vector2<f64>> = chosen.iter().map(|i| rest[*i]).collect();
    let noise = rest.iter().map(Vector2::norm_squared).sum::<f64>() / (2 * rest.len()) as f64;
    if !(noise > samples.rounding()) {
        return None;
    }
    // Nothing that a drift can follow.
    let drift =
        DMatrix::from_fn(times.len(), samples.degree + 1, |i, j| legendre(samples.degree, times[i])[j]).qr().q();
    let (lowest, highest, step) = (PI * least_turns, PI / median_gap(&times), PI / DENSITY);
    let count = ((highest - lowest) / step).floor().max(0.0) as usize + 1;
    let mut phases: Vec<(f64, f64)> = times.iter().map(|t| (lowest * t).sin_cos()).collect();
    let turns: Vec<(f64, f64)> = times.iter().map(|t| (step * t).sin_cos()).collect();
    let mut best = (0.0, None);
    for k in 0..count {
        let omega = lowest + step * k as f64;
        if known.iter().all(|other| (omega - other).abs() >= PI) {
            let power = power(&phases, &rest, &drift);
            if power > best.0 {
                best = (power, Some(omega));
            }
        }
        for ((sine, cosine), (s, c)) in phases.iter_mut().zip(&turns) {
            (*sine, *cosine) = (*sine * c + *cosine * s, *cosine * c - *sine * s);
        }
    }
    // Of noise the power of two coordinates over its variance is distributed as χ² with four degrees of freedom.
    let half = 0.5 * best.0 / noise;
    let chance = (1.0 + half) * (-half).exp() * (count as f64 / DENSITY).max(1.0);
    best.1.filter(|_| chance < CHANCE)
}

/// By how much a cosine and a sine beside the drift lower the sum of squares.
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
    // What is left has no drift, so that its sums stay.
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

/// Which positions are no outliers of what is left, by the median of those used before.
fn without_outliers(residuals: &[Vector2<f64>], before: &[bool]) -> Vec<bool> {
    let squares = residuals.iter().zip(before).filter(|(_, used)| **used).map(|(r, _)| r.norm_squared()).collect();
    // The median of χ² with two degrees of freedom is 2 ln 2.
    let variance = median(squares) / (2.0 * std::f64::consts::LN_2);
    residuals.iter().map(|r| variance == 0.0 || r.norm_squared() <= OUTLIER * OUTLIER * variance).collect()
}
