//! Stochastic drive of differential growth.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Growing, TropismLaw};
use crate::error::ParameterError;

/// Number of knots in a correlation time. The spline between them averages the process over this
/// time.
const KNOTS: f64 = 8.0;
/// Base-2 logarithm of the number of knots between two independent values of the process: 32
/// correlation times, over which its correlation is 1e-14.
const LEVELS: u32 = 8;

/// Differential growth in a direction that varies at random, the same in the whole growth zone:
///
/// ```text
/// r u̇1* = α REGR x1(t),   r u̇2* = α REGR x2(t).
/// ```
///
/// Here u1* and u2* (1/m) are the intrinsic curvatures, r (m) is the radius, and REGR (1/s) the
/// relative elemental growth rate. x1 and x2 are independent Ornstein–Uhlenbeck processes with mean
/// zero, variance one and the correlation exp(−|s|/τ) at a distance s in time. In an elliptic
/// section r is the semi-axis along d2 for u1, and that along d1 for u2.
///
/// The process is a function of the seed and the time. Its values at knots τ/8 apart have the exact
/// distribution: each is drawn between two known ones from a random number that depends on the seed
/// and the place of the knot alone. They are the coefficients of a cubic B-spline, which has two
/// continuous derivatives. It averages over short times: its variance is 0.934, and its covariance
/// is 1.005 exp(−s/τ) from s = τ/2 on.
///
/// A run repeats bit for bit, also after it is resumed from its [`State`](crate::State). A rejected
/// step does not change the process, and the law does not reduce the order in time. Time steps of
/// more than τ/8 are refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[doc(alias = "noise")]
pub struct RandomDrive {
    /// Sensitivity α, without unit: the root mean square of each component of the growth gradient
    /// times r.
    pub sensitivity: f64,
    /// Correlation time τ, s.
    pub correlation_time: f64,
    /// Seed. Drives with different seeds are independent.
    pub seed: u64,
}

impl RandomDrive {
    /// The processes (x1, x2) at a time (s).
    #[must_use]
    pub fn value(&self, t: f64) -> [f64; 2] {
        let place = t / self.correlation_time * KNOTS;
        let (first, x) = (place.floor(), place - place.floor());
        let y = 1.0 - x;
        // The four cubic B-splines that are not zero here, times six.
        let weights = [
            y * y * y,
            4.0 - 3.0 * x * x * (1.0 + y),
            4.0 - 3.0 * y * y * (1.0 + x),
            x * x * x,
        ];
        // No time of a run is near this bound.
        let knots = self.knots(first.clamp(-1e15, 1e15) as i64 - 1);
        let mut sum = [0.0; 2];
        for (knot, weight) in knots.iter().zip(weights) {
            sum = [0, 1].map(|k| sum[k] + weight * knot[k]);
        }
        sum.map(|x| x / 6.0)
    }

    /// The values at four successive knots from `first` on.
    fn knots(&self, first: i64) -> [[f64; 2]; 4] {
        let width = 1_i64 << LEVELS;
        let mut out = [[0.0; 2]; 4];
        let start = first & !(width - 1);
        for low in (start..first + 4).step_by(width as usize) {
            self.divide(
                (low, width),
                [self.normal(low), self.normal(low + width)],
                first,
                &mut out,
            );
        }
        out
    }

    /// Writes the values at those of the four knots from `first` on that are in the interval from
    /// `low` on of a width, without its end. The values at its ends are given. Between two values
    /// at distances d in time the mean is their sum over 2 cosh(d/τ), and the variance tanh(d/τ).
    fn divide(
        &self,
        (low, width): (i64, i64),
        [a, b]: [[f64; 2]; 2],
        first: i64,
        out: &mut [[f64; 2]; 4],
    ) {
        if let Some(out) = usize::try_from(low - first)
            .ok()
            .and_then(|k| out.get_mut(k))
        {
            *out = a;
        }
        let (half, last) = (width / 2, first + 3);
        if half == 0 || last <= low || first >= low + width {
            return;
        }
        let middle = low + half;
        // exp(−2 d/τ).
        let decay = (-2.0 * half as f64 / KNOTS).exp();
        let (mean, deviation) = (
            decay.sqrt() / (1.0 + decay),
            ((1.0 - decay) / (1.0 + decay)).sqrt(),
        );
        let random = self.normal(middle);
        let between = [0, 1].map(|k| mean * (a[k] + b[k]) + deviation * random[k]);
        if first < middle {
            self.divide((low, half), [a, between], first, out);
        }
        if last >= middle {
            self.divide((middle, half), [between, b], first, out);
        }
    }

    /// Two independent standard normal numbers for a knot, by the method of Box and Muller.
    fn normal(&self, knot: i64) -> [f64; 2] {
        // Two steps of SplitMix64 (Steele, Lea and Flood, 2014) from a state that depends on seed
        // and knot.
        let mixed = |z: u64| {
            let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        };
        let golden = 0x9E37_79B9_7F4A_7C15_u64;
        let state =
            mixed(self.seed.wrapping_add(golden)).wrapping_add((knot as u64).wrapping_mul(golden));
        let unit = |z: u64| ((mixed(z) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        let first = mixed(state);
        let (radius, (sin, cos)) = (
            (-2.0 * unit(first).ln()).sqrt(),
            (TAU * unit(first.wrapping_add(golden))).sin_cos(),
        );
        [radius * cos, radius * sin]
    }
}

impl TropismLaw for RandomDrive {
    #[inline]
    fn gradient(&self, at: &Growing, _past: &[f64], _now: &[f64]) -> Vector3<f64> {
        let [x1, x2] = self.value(at.time);
        Vector3::new(x1 / at.section.along_d2, x2 / at.section.along_d1, 0.0) * self.sensitivity
    }

    /// Two distances of knots, so that a time step is at most one.
    fn shortest_period(&self) -> f64 {
        if self.sensitivity == 0.0 {
            f64::INFINITY
        } else {
            2.0 * self.correlation_time / KNOTS
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        ParameterError::finite("sensitivity of the random drive", self.sensitivity, "")?;
        ParameterError::positive(
            "correlation time of the random drive",
            self.correlation_time,
            "s",
        )
    }
}
