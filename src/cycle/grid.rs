//! A period in equal intervals, with Gauss points in each.

use crate::quadrature::{gauss, lagrange};

/// Times in units of an interval.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    /// Intervals in a period.
    pub intervals: usize,
    /// Gauss points of an interval, in (0, 1).
    pub stages: Vec<f64>,
    /// ∫ of the polynomial that is one at stage j and zero at the others, from 0 to stage i.
    pub upto: Vec<Vec<f64>>,
    /// The same over the whole interval.
    pub whole: Vec<f64>,
}

impl Grid {
    pub fn new(intervals: usize, stages: usize) -> Self {
        let (points, weights) = gauss(stages);
        let mut out = Self { intervals, stages: points, upto: Vec::new(), whole: weights };
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
