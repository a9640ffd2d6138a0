//! Interpolation of the variables between two levels.
//!
//! Between two levels a variable is the cubic through its values and rates (Hermite). A variable y
//! with the time constant τ has the forcing N = y + τ ẏ, which is the stimulus of a linear memory.
//! After a discontinuity it contains a transient exp(−t/τ), which a cubic does not resolve in steps
//! that are not short compared with τ. The transient is then interpolated exactly. It is the
//! difference at the older level between y and the solution of τ ẏ = N − y that is a polynomial. N
//! is the polynomial through the forcings at the older level and the levels before it; in the first
//! piece after a discontinuity it is the line through the forcings at both ends.

use super::{History, ORDER};
use crate::numerics::interpolation::lagrange_powers;
use crate::state::CLOSE;

/// Ratio z of the length of a piece to the time constant below which a cubic resolves the
/// transient. Its error is z⁴/384 of the transient, which is 4e-6 here. After a discontinuity each
/// step doubles the time since then, whatever the longest step is. With a larger ratio, long pieces
/// with this error would be the same in all runs, whose differences would not show it.
const SLOW: f64 = 0.2;
/// Ratio above which there is no transient. Steps at most double, so that the transient has decayed
/// by exp(−z/2) in the step before.
const FAST: f64 = 100.0;

/// Interpolation weights between two levels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    pub(super) level: usize,
    /// Weights of the value and the rate at the older level, and of the value and the rate at the
    /// newer level.
    pub(super) weights: [f64; 4],
    /// Time constant (s), and weights of the forcings at levels before these.
    pub(super) forcings: Option<(f64, [(usize, f64); ORDER - 1])>,
}

impl History {
    /// Returns the older level of the piece that contains a time (s), its time and the length of
    /// the piece, s.
    fn piece(&self, time: f64) -> (usize, f64, f64) {
        let level = self
            .levels
            .partition_point(|level| level.time <= time)
            .clamp(1, self.levels.len() - 1)
            - 1;
        (
            level,
            self.time(level),
            self.time(level + 1) - self.time(level),
        )
    }

    /// Returns the interpolation at `time` (s) of variables with the time constant `tau` (s).
    /// Before the first level the variables are constant.
    pub fn reading(&self, time: f64, tau: f64) -> Reading {
        let (level, start, h) = self.piece(time);
        if time < self.time(0) || h <= 0.0 {
            return Reading {
                level,
                weights: [1.0, 0.0, 0.0, 0.0],
                forcings: None,
            };
        }
        let x = (time - start) / h;
        let y = 1.0 - x;
        let weights = [
            (1.0 + 2.0 * x) * y * y,
            x * y * y * h,
            x * x * (1.0 + 2.0 * y),
            -x * x * y * h,
        ];
        let cubic = Reading {
            level,
            weights,
            forcings: None,
        };
        if (SLOW..FAST).contains(&(h / tau)) {
            self.with_transient(cubic, (time - start, h), tau)
        } else {
            cubic
        }
    }

    /// The interpolation of a piece of `h` seconds, at the time `t` after its start (s). It is
    /// exact for the transient of variables with the time constant `tau` (s).
    fn with_transient(&self, cubic: Reading, (t, h): (f64, f64), tau: f64) -> Reading {
        let Reading {
            level,
            weights: [value, rate, next, next_rate],
            ..
        } = cubic;
        // The levels of the forcing, latest first, and their times in units of τ.
        let (mut levels, mut count) = ([level; ORDER], 1);
        let mut earliest = level;
        while count < ORDER && earliest > 0 && self.time(earliest - 1) < self.time(earliest) {
            earliest -= 1;
            if self.time(levels[count - 1]) - self.time(earliest) > CLOSE * h {
                levels[count] = earliest;
                count += 1;
            }
        }
        // The step after a discontinuity has a linear forcing. A history that was not integrated
        // has no transient.
        let first = earliest == level;
        if earliest == 0 && count < ORDER {
            return cubic;
        }
        if first {
            (levels[1], count) = (level + 1, 2);
        }
        let times = levels.map(|at| (self.time(at) - self.time(level)) / tau);
        let decayed = (-h / tau).exp();
        let missing =
            (-t / tau).exp() - value - next * decayed + (rate + next_rate * decayed) / tau;
        let mut weights = [value + missing, rate, next, next_rate];
        let mut forcings = [(level, 0.0); ORDER - 1];
        for (k, at) in levels[..count].iter().enumerate() {
            // y = N − N′ + N″ − N‴ with derivatives by t/τ.
            let [constant, linear, square, cube] = lagrange_powers::<ORDER>(&times[..count], k);
            let weight = -missing * (constant - linear + 2.0 * square - 6.0 * cube);
            if k == 0 {
                weights[0] += weight;
                weights[1] += weight * tau;
            } else if first {
                weights[2] += weight;
                weights[3] += weight * tau;
            } else {
                forcings[k - 1] = (*at, weight);
            }
        }
        Reading {
            level,
            weights,
            forcings: (!first).then_some((tau, forcings)),
        }
    }

    /// Returns the interpolation of the rates at `time` (s) by the derivative of the cubic through
    /// values and rates.
    pub fn slope(&self, time: f64) -> Reading {
        let (level, start, h) = self.piece(time);
        if h <= 0.0 {
            return Reading {
                level,
                weights: [0.0, 1.0, 0.0, 0.0],
                forcings: None,
            };
        }
        let x = (time - start) / h;
        let value = 6.0 * x * (1.0 - x) / h;
        Reading {
            level,
            weights: [
                -value,
                (1.0 - x) * (1.0 - 3.0 * x),
                value,
                x * (3.0 * x - 2.0),
            ],
            forcings: None,
        }
    }

    /// Interpolates the variables of a point.
    pub fn read(&self, at: &Reading, point: usize) -> Vec<f64> {
        let (all, mut values) = (
            (0..self.variables).collect::<Vec<_>>(),
            vec![0.0; self.variables],
        );
        self.read_some(at, point, &all, &mut values);
        values
    }

    /// Interpolates some of the variables of consecutive points from point `first` on, and writes
    /// them to `to`, which has numbers for all variables of each point.
    pub fn read_some(&self, at: &Reading, first: usize, variables: &[usize], to: &mut [f64]) {
        let (width, number, w) = (self.width().max(1), self.variables, at.weights);
        let rows = |level: usize| self.levels[level].rows.rchunks_exact(width).skip(first);
        for ((to, old), new) in to
            .chunks_exact_mut(number.max(1))
            .zip(rows(at.level))
            .zip(rows(at.level + 1))
        {
            let ((y0, rate0), (y1, rate1)) = (old.split_at(number), new.split_at(number));
            for &k in variables {
                to[k] = w[0] * y0[k] + w[1] * rate0[k] + w[2] * y1[k] + w[3] * rate1[k];
            }
        }
        let Some((tau, forcings)) = at.forcings else {
            return;
        };
        for (level, weight) in forcings.into_iter().filter(|(_, weight)| *weight != 0.0) {
            for (to, row) in to.chunks_exact_mut(number.max(1)).zip(rows(level)) {
                let (y, rate) = row.split_at(number);
                variables
                    .iter()
                    .for_each(|&k| to[k] += weight * (y[k] + tau * rate[k]));
            }
        }
    }
}
