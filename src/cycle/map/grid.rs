//! The grid in time: a period has equal intervals with Radau points in each.
//!
//! The last Radau point of an interval is its end, so that the collocation method is stiffly
//! accurate (E. Hairer & G. Wanner, *Solving ordinary differential equations II*, 2nd ed. (1996),
//! section IV.5). A component that decays much faster than an interval then decays on the grid,
//! too. With Gauss points it would alternate from interval to interval and appear as a multiplier
//! of modulus one.

use std::convert::Infallible;

use crate::error::ParameterError;
use crate::numerics::interpolation::lagrange_value;
use crate::numerics::quadrature::{gauss, legendre};
use crate::numerics::scalar::bracketed_root;

/// Radau points and quadrature weights, in units of an interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TimeGrid {
    /// Number of intervals in a period.
    pub intervals: usize,
    /// Radau points of an interval, in (0, 1], the last of them 1.
    pub stages: Vec<f64>,
    /// Integrals of the Lagrange polynomials of the stages from 0 to each stage: a row for each
    /// stage.
    pub upto: Vec<Vec<f64>>,
    /// Integrals of the Lagrange polynomials over the interval.
    pub whole: Vec<f64>,
}

impl TimeGrid {
    pub fn new(intervals: usize, stages: usize) -> Self {
        let mut out = Self {
            intervals,
            stages: radau(stages),
            upto: Vec::new(),
            whole: Vec::new(),
        };
        out.whole = out.integrals(1.0);
        out.upto = out
            .stages
            .iter()
            .map(|stage| out.integrals(*stage))
            .collect();
        out
    }

    /// Number of stages.
    pub fn order(&self) -> usize {
        self.stages.len()
    }

    /// Integrals of the Lagrange polynomials from 0 to `x`.
    pub fn integrals(&self, x: f64) -> Vec<f64> {
        let mut out = vec![0.0; self.order()];
        // The Gauss rule with as many points is exact.
        let (points, weights) = gauss(self.order());
        for (point, weight) in points.iter().zip(weights) {
            let value = |k: usize| lagrange_value(&self.stages, k, x * point);
            out.iter_mut()
                .enumerate()
                .for_each(|(k, sum)| *sum += x * weight * value(k));
        }
        out
    }
}

/// Number of intervals of the past that contain the longest delay (s), with half an interval in
/// reserve, since the period (s) is an unknown.
pub(crate) fn kept(longest: f64, intervals: usize, period: f64) -> Result<usize, ParameterError> {
    let (what, periods) = ("longest delay, in periods", longest / period);
    let requirement = "at most 16: check the unit of the period (s), since a state contains the past over the delay";
    ParameterError::unless(periods <= 16.0, what, periods, requirement)?;
    Ok(((longest * intervals as f64 / period + 0.5).ceil() as usize).max(1))
}

/// The `n` points of the right Radau rule on [0, 1], the zeros of Pn − Pn−1. The rule is exact for
/// polynomials of degree 2n − 2.
fn radau(n: usize) -> Vec<f64> {
    let value = |x: f64| legendre(n, x).0 - legendre(n - 1, x).0;
    // One zero lies before each zero of Pn−1, and the last at the end.
    let (zeros, _) = gauss(n - 1);
    let mut before = -1.0;
    let inner = zeros.iter().map(|zero| {
        let ends = [before, 2.0 * zero - 1.0];
        before = ends[1];
        let Ok([low, high]) = bracketed_root(ends.map(|x| (x, value(x))), 0.0, |x| {
            Ok::<_, Infallible>(value(x))
        });
        0.5 * (1.0 + 0.5 * (low + high))
    });
    inner.chain([1.0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rule integrates x^k to rounding for k ≤ 2n − 2, and not for k = 2n − 1.
    #[test]
    fn the_rule_is_exact_up_to_degree_2n_minus_2() {
        for n in 1..=16 {
            let grid = TimeGrid::new(1, n);
            assert!(grid.stages.windows(2).all(|pair| pair[0] < pair[1]) && grid.stages[0] > 0.0);
            let error = |k: usize| {
                let sum: f64 = grid
                    .stages
                    .iter()
                    .zip(&grid.whole)
                    .map(|(x, w)| w * x.powi(k as i32))
                    .sum();
                (sum - 1.0 / (k + 1) as f64).abs()
            };
            for k in 0..=2 * n - 2 {
                // Sums of at most sixteen numbers below one, whose polynomials multiply rounding by
                // some tens.
                assert!(error(k) < 1e-13, "{n} {k} {}", error(k));
            }
            if n < 8 {
                assert!(error(2 * n - 1) > 1e-9, "{n} {}", error(2 * n - 1));
            }
        }
    }
}
