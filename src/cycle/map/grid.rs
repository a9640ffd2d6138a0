//! A period in equal intervals, with Radau points in each.
//!
//! The last point of an interval is its end. What dies out much faster than an interval then does so on the grid, too; with Gauss
//! points it would stay, with its sign turning from interval to interval, and pass for a multiplier.

use crate::numerics::interpolation::lagrange;
use crate::numerics::quadrature::{gauss, legendre};

/// Times in units of an interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    /// Intervals in a period.
    pub intervals: usize,
    /// Radau points of an interval, in (0, 1], the last of them 1.
    pub stages: Vec<f64>,
    /// ∫ of the polynomial that is one at stage j and zero at the others, from 0 to stage i.
    pub upto: Vec<Vec<f64>>,
    /// The same over the whole interval.
    pub whole: Vec<f64>,
}

impl Grid {
    pub fn new(intervals: usize, stages: usize) -> Self {
        let mut out = Self { intervals, stages: radau(stages), upto: Vec::new(), whole: Vec::new() };
        out.whole = out.integrals(1.0);
        out.upto = out.stages.iter().map(|stage| out.integrals(*stage)).collect();
        out
    }

    /// Number of stages.
    pub fn order(&self) -> usize {
        self.stages.len()
    }

    /// ∫ of the same polynomials from 0 to `x`.
    pub fn integrals(&self, x: f64) -> Vec<f64> {
        let mut out = vec![0.0; self.order()];
        let mut values = out.clone();
        // Exact: Gauss's rule with as many points.
        let (points, weights) = gauss(self.order());
        for (point, weight) in points.iter().zip(weights) {
            lagrange(&self.stages, x * point, &mut values);
            out.iter_mut().zip(&values).for_each(|(sum, value)| *sum += x * weight * value);
        }
        out
    }
}

/// The `n` points of Radau's right rule on [0, 1], exact for polynomials of degree 2n − 2: the zeros of Pn − Pn−1.
fn radau(n: usize) -> Vec<f64> {
    let value = |x: f64| legendre(n, x).0 - legendre(n - 1, x).0;
    // One lies before each zero of Pn−1, and the last at the end.
    let (zeros, _) = gauss(n - 1);
    let mut before = -1.0;
    let inner = zeros.iter().map(|zero| {
        let (mut low, mut high) = (before, 2.0 * zero - 1.0);
        before = high;
        let sign = value(low).signum();
        // Halved to the last bit.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if value(middle).signum() == sign { low = middle } else { high = middle }
        }
        0.5 * (1.0 + low)
    });
    inner.chain([1.0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radau's rule integrates x^k for k ≤ 2n − 2 to rounding, and no further.
    #[test]
    fn as_exact_as_radau() {
        for n in 1..=16 {
            let grid = Grid::new(1, n);
            assert!(grid.stages.windows(2).all(|pair| pair[0] < pair[1]) && grid.stages[0] > 0.0);
            let error = |k: usize| {
                let sum: f64 = grid.stages.iter().zip(&grid.whole).map(|(x, w)| w * x.powi(k as i32)).sum();
                (sum - 1.0 / (k + 1) as f64).abs()
            };
            for k in 0..=2 * n - 2 {
                // Sums of at most sixteen numbers below one, whose polynomials multiply rounding by some tens.
                assert!(error(k) < 1e-13, "{n} {k} {}", error(k));
            }
            if n < 8 {
                assert!(error(2 * n - 1) > 1e-9, "{n} {}", error(2 * n - 1));
            }
        }
    }
}
