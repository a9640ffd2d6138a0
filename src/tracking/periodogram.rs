//! Periodogram beside a drift: power of a wave at equally spaced frequencies.

use std::f64::consts::PI;

use nalgebra::{Complex, DVector, Vector2};

use super::harmonics::Samples;
use crate::numerics::fourier::FourierSums;
use crate::numerics::krylov::orthogonalise;
use crate::numerics::quadrature::legendre;

/// Number of examined frequencies for each turn over the whole track. The highest of them misses
/// less than 3 % of a peak.
pub(super) const DENSITY: f64 = 8.0;
/// Interval of angular frequencies.
const STEP: f64 = PI / DENSITY;
/// Smallest part of the squares of a cosine and a sine that is orthogonal to the drift and to each
/// other. Waves with a smaller one cannot be distinguished from drift.
const LEAST_DETERMINANT: f64 = 1e-9;

/// Decrease of the sum of squares by a cosine and a sine that are fitted beside a drift: the
/// periodogram of Lomb (1976) with a polynomial instead of a constant mean.
///
/// All sums that do not depend on the positions are computed once for all residuals of the same
/// samples.
pub(super) struct Periodogram<'a> {
    samples: &'a Samples,
    /// Index of the lowest frequency. Frequencies are multiples of [`STEP`].
    lowest: usize,
    /// Number of frequencies.
    pub count: usize,
    sums: FourierSums,
    /// Orthonormal basis of the drift, by increasing degree.
    basis: Vec<DVector<f64>>,
    /// Sums of squared cosines, of products of cosines and sines, and of squared sines, for each
    /// frequency: first those of waves, and then those of the parts of waves that are orthogonal to
    /// polynomials of degree 0, 1, ….
    squares: Vec<Vec<[f64; 3]>>,
}

impl<'a> Periodogram<'a> {
    /// Periodogram at angular frequencies in a range. Times of samples are from −1 to 1.
    pub fn new(samples: &'a Samples, [from, to]: [f64; 2]) -> Self {
        let lowest = (from / STEP).ceil().max(1.0) as usize;
        let end = if to >= from {
            (to / STEP).floor() as usize + 1
        } else {
            0
        };
        let count = end.saturating_sub(lowest);
        let sums = |step: f64| {
            FourierSums::new(
                &samples.times.iter().map(|t| step * t).collect::<Vec<_>>(),
                end,
            )
        };
        let total = samples.times.len() as f64;
        let double = sums(2.0 * STEP).of(samples.times.iter().map(|_| Complex::ONE));
        // cos² = (1 + cos 2ωt)/2, cos sin = (sin 2ωt)/2, sin² = (1 − cos 2ωt)/2.
        let squares = |sum: &[Complex<f64>; 2]| {
            [
                0.5 * (total + sum[0].re),
                0.5 * sum[0].im,
                0.5 * (total - sum[0].re),
            ]
        };
        Self {
            samples,
            lowest,
            count,
            sums: sums(STEP),
            basis: Vec::new(),
            squares: vec![double.iter().skip(lowest).map(squares).collect()],
        }
    }

    /// Angular frequency with an index.
    pub fn omega(&self, index: usize) -> f64 {
        STEP * (self.lowest + index) as f64
    }

    /// Sums of two series with cosines (real part) and sines, for each frequency.
    fn transform(
        &self,
        values: impl Iterator<Item = Complex<f64>>,
    ) -> impl Iterator<Item = [Complex<f64>; 2]> {
        self.sums.of(values).into_iter().skip(self.lowest)
    }

    /// Powers of a residual that is orthogonal to polynomials of a `degree`, for each frequency.
    /// The power is zero where drift and wave are nearly dependent.
    pub fn powers(&mut self, rest: &[Vector2<f64>], degree: usize) -> Vec<f64> {
        while self.basis.len() <= degree {
            self.extend();
        }
        let with_rest = self.transform(rest.iter().map(|rest| Complex::new(rest.x, rest.y)));
        // The residual is orthogonal to the drift: its products with the waves do not change.
        with_rest
            .zip(&self.squares[degree + 1])
            .map(|(with_rest, squares)| power(with_rest, *squares))
            .collect()
    }

    /// Adds two polynomials to the basis, and their sums. One Fourier transform computes the sums
    /// of both.
    fn extend(&mut self) {
        for _ in 0..2 {
            let degree = self.basis.len();
            let times = &self.samples.times;
            let mut next = DVector::from_fn(times.len(), |i, _| legendre(degree, times[i]).0);
            orthogonalise(&self.basis, &mut next, |_, _| ());
            let norm = next.norm();
            // A polynomial that is zero at all times has no share in the drift.
            next.apply(|x| *x = if norm > 0.0 { *x / norm } else { 0.0 });
            self.basis.push(next);
        }
        let [first, second] = [2, 1].map(|back| &self.basis[self.basis.len() - back]);
        let pairs = self.transform(first.iter().zip(second).map(|(a, b)| Complex::new(*a, *b)));
        let (first, second): (Vec<_>, Vec<_>) = pairs.map(|[a, b]| (a, b)).unzip();
        for drift in [first, second] {
            let last = &self.squares[self.squares.len() - 1];
            let without = last.iter().zip(drift).map(
                |(
                    [cc, cs, ss],
                    Complex {
                        re: cosine,
                        im: sine,
                    },
                )| { [cc - cosine * cosine, cs - cosine * sine, ss - sine * sine] },
            );
            self.squares.push(without.collect());
        }
    }
}

/// Power of a wave with given sums of squares and given sums with both coordinates of a residual.
fn power(with_rest: [Complex<f64>; 2], [cc, cs, ss]: [f64; 3]) -> f64 {
    let determinant = cc * ss - cs * cs;
    if !(determinant > LEAST_DETERMINANT * cc * ss) {
        return 0.0;
    }
    let [x, y] =
        with_rest.map(|Complex { re: a, im: b }| ss * a * a - 2.0 * cs * a * b + cc * b * b);
    (x + y) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    /// The sum of squares of least squares with the drift alone, less that with the drift and a
    /// wave. The slowest wave has half a turn, so that it resembles the drift.
    #[test]
    fn power_of_a_wave_is_the_decrease_of_the_sum_of_squares() {
        let times: Vec<f64> = (0..40).map(|k| -1.0 + f64::from(k) / 19.5).collect();
        let position =
            |t: f64| Vector2::new((3.0 * t).sin() + t * t, (2.0 * t + 1.0).cos() - t.exp());
        let positions = DMatrix::from_fn(times.len(), 2, |i, c| position(times[i])[c]);
        let drift = DMatrix::from_fn(times.len(), 3, |i, j| times[i].powi(j as i32));
        let left = |basis: &DMatrix<f64>| {
            let q = basis.clone().qr().q();
            &positions - &q * (q.transpose() * &positions)
        };
        let without = left(&drift);
        let rest: Vec<Vector2<f64>> = without
            .row_iter()
            .map(|row| Vector2::new(row[0], row[1]))
            .collect();
        let samples = Samples::new(times.clone(), rest.clone());
        let mut periodogram = Periodogram::new(&samples, [0.5 * PI, 10.0 * PI]);
        let powers = periodogram.powers(&rest, 2);
        assert_eq!(powers.len(), 77);
        for (k, power) in powers.into_iter().enumerate() {
            let omega = periodogram.omega(k);
            let mut both = drift.clone().resize_horizontally(5, 0.0);
            both.set_column(
                3,
                &DVector::from_fn(times.len(), |i, _| (omega * times[i]).sin()),
            );
            both.set_column(
                4,
                &DVector::from_fn(times.len(), |i, _| (omega * times[i]).cos()),
            );
            let expected = without.norm_squared() - left(&both).norm_squared();
            // Rounding of sums of 40 terms, magnified by the likeness of wave and drift.
            assert_relative_eq!(power, expected, max_relative = 1e-9);
        }
    }
}
