//! Normal equations of a polynomial drift and waves with unknown frequencies.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::harmonics::{Harmonics, Samples};
use crate::numerics::quadrature::legendre_sequence;
use crate::numerics::sines::sines;

/// Number of samples that are added at once. Columns are filled with zeros up to a multiple of it.
const LANES: usize = 4;

/// Values of the model, of its derivatives and of the residual at all samples, one column for each.
///
/// The columns are: the polynomials of the drift, cos ωt and sin ωt of all waves, t cos ωt and t
/// sin ωt of the waves with unknown frequencies, both coordinates r of the residual, and those of t
/// r.
pub(super) struct Columns<'a> {
    samples: &'a Samples,
    values: Vec<f64>,
    /// Length of a column.
    length: usize,
    drift: usize,
}

impl<'a> Columns<'a> {
    /// Columns for a number of polynomials and waves.
    pub fn new(samples: &'a Samples, drift: usize, waves: usize) -> Self {
        let length = samples.times.len().next_multiple_of(LANES);
        let mut values = vec![0.0; length * (drift + 4 * waves + 4)];
        for (i, t) in samples.times.iter().enumerate() {
            for (j, value) in legendre_sequence(*t).take(drift).enumerate() {
                values[j * length + i] = value;
            }
        }
        Self {
            samples,
            values,
            length,
            drift,
        }
    }

    /// Computes all columns for the coefficients and frequencies of a fit. The first `moves`
    /// frequencies are unknown.
    pub fn set(&mut self, fit: &Harmonics, moves: usize) {
        let (length, times) = (self.length, &self.samples.times);
        let (drift, others) = self.values.split_at_mut(self.drift * length);
        let (waves, others) = others.split_at_mut(2 * fit.waves.len() * length);
        let (moved, others) = others.split_at_mut(2 * moves * length);
        let (rest, moved_rest) = others[..4 * length].split_at_mut(2 * length);
        for (wave, columns) in fit.waves.iter().zip(waves.chunks_exact_mut(2 * length)) {
            let (cosine, sine) = columns.split_at_mut(length);
            sines(
                wave.omega,
                times,
                &mut sine[..times.len()],
                &mut cosine[..times.len()],
            );
        }
        for (c, rest) in rest.chunks_exact_mut(length).enumerate() {
            rest.iter_mut()
                .zip(&self.samples.positions)
                .for_each(|(rest, position)| *rest = position[c]);
            let coefficients = fit
                .drift
                .iter()
                .chain(fit.waves.iter().flat_map(|wave| [&wave.cosine, &wave.sine]));
            for (column, x) in drift
                .chunks_exact(length)
                .chain(waves.chunks_exact(length))
                .zip(coefficients)
            {
                rest.iter_mut()
                    .zip(column)
                    .for_each(|(value, y)| *value -= x[c] * y);
            }
        }
        for (to, from) in [(moved, &*waves), (moved_rest, &*rest)] {
            for (to, from) in to.chunks_exact_mut(length).zip(from.chunks_exact(length)) {
                to.iter_mut()
                    .zip(from)
                    .zip(times)
                    .for_each(|((to, value), t)| *to = value * t);
            }
        }
    }

    /// Writes the scalar products of a column with others to `to`.
    fn products(&self, left: usize, others: Range<usize>, to: &mut [f64]) {
        let column = |k: usize| {
            self.values[k * self.length..][..self.length]
                .as_chunks::<LANES>()
                .0
        };
        // Four products at once read the first factor once. The last ones may be computed in vain.
        let four = |j: usize| [0, 1, 2, 3].map(|k| column((j + k).min(others.end - 1)));
        for (to, j) in to.chunks_mut(4).zip(others.clone().step_by(4)) {
            let sums = partial_products(column(left), four(j));
            to.iter_mut()
                .zip(sums)
                .for_each(|(to, [a, b, c, d])| *to = (a + b) + (c + d));
        }
    }
}

/// Independent partial sums of the scalar products of a column with four others. The function is
/// not inlined: otherwise the compiler combines the four products in its vectors, which takes twice
/// the instructions.
#[inline(never)]
fn partial_products(column: &[[f64; LANES]], others: [&[[f64; LANES]]; 4]) -> [[f64; LANES]; 4] {
    let mut sums = [[0.0; LANES]; 4];
    let [a, b, c, d] = others;
    for ((((values, a), b), c), d) in column.iter().zip(a).zip(b).zip(c).zip(d) {
        for (sums, other) in sums.iter_mut().zip([a, b, c, d]) {
            for lane in 0..LANES {
                sums[lane] += values[lane] * other[lane];
            }
        }
    }
    sums
}

/// Coefficients of both coordinates (drift, then cosine and sine of each wave), and frequencies: a
/// step, or variances.
pub(super) struct Unknowns {
    pub coefficients: [DVector<f64>; 2],
    pub omegas: DVector<f64>,
}

/// Normal equations for a step of all coefficients and of the first frequencies.
///
/// Both coordinates have the same matrix A for their coefficients. The mixed terms have the
/// matrices B, and the frequencies have the matrix D:
///
/// ```text
/// A x₁ + B₁ ω = r₁,   A x₂ + B₂ ω = r₂,   B₁ᵀ x₁ + B₂ᵀ x₂ + D ω = r.
/// ```
pub(super) struct NormalEquations {
    coefficients: Cholesky<f64, Dyn>,
    mixed: [DMatrix<f64>; 2],
    omegas: DMatrix<f64>,
    /// What Newton's method adds to B and D: the residual times second derivatives of the model.
    mixed_curvature: [DMatrix<f64>; 2],
    curvature: DVector<f64>,
    right: Unknowns,
}

impl NormalEquations {
    /// The equations for a fit, with the columns computed for it. The first `moves` frequencies are
    /// unknown. `None` if the samples do not determine the coefficients.
    pub fn of(columns: &Columns, fit: &Harmonics, moves: usize) -> Option<Self> {
        let linear = fit.drift.len() + 2 * fit.waves.len();
        let (rest, moved_rest) = (linear + 2 * moves, linear + 2 * moves + 2);
        let mut products = DMatrix::zeros(moved_rest, moved_rest);
        for i in 0..moved_rest {
            columns.products(
                i,
                i..moved_rest,
                &mut products.column_mut(i).as_mut_slice()[i..],
            );
        }
        let product = |i: usize, j: usize| products[(i.max(j), i.min(j))];
        // Products with the derivative of a coordinate of the model by a frequency, t (b cos ωt − a
        // sin ωt).
        let derivative = |i: usize, k: usize, c: usize| {
            let (wave, at) = (&fit.waves[k], linear + 2 * k);
            wave.sine[c] * product(i, at) - wave.cosine[c] * product(i, at + 1)
        };
        let mixed = [0, 1].map(|c| DMatrix::from_fn(linear, moves, |i, k| derivative(i, k, c)));
        let omegas = DMatrix::from_fn(moves, moves, |k, l| {
            let (wave, at) = (&fit.waves[k], linear + 2 * k);
            let of = |c: usize| {
                wave.sine[c] * derivative(at, l, c) - wave.cosine[c] * derivative(at + 1, l, c)
            };
            of(0) + of(1)
        });
        let right = Unknowns {
            coefficients: [0, 1].map(|c| DVector::from_fn(linear, |i, _| product(rest + c, i))),
            omegas: DVector::from_fn(moves, |k, _| {
                derivative(rest, k, 0) + derivative(rest + 1, k, 1)
            }),
        };
        let mut mixed_curvature = [0, 1].map(|_| DMatrix::zeros(linear, moves));
        for (c, mixed) in mixed_curvature.iter_mut().enumerate() {
            for k in 0..moves {
                let row = fit.drift.len() + 2 * k;
                mixed[(row, k)] = product(rest + c, linear + 2 * k + 1);
                mixed[(row + 1, k)] = -product(rest + c, linear + 2 * k);
            }
        }
        let with_rest = [0, 1].map(|c| {
            let mut products = vec![0.0; 2 * moves];
            columns.products(moved_rest + c, linear..linear + 2 * moves, &mut products);
            products
        });
        let curvature = DVector::from_fn(moves, |k, _| {
            let wave = &fit.waves[k];
            let of = |c: usize| {
                wave.cosine[c] * with_rest[c][2 * k] + wave.sine[c] * with_rest[c][2 * k + 1]
            };
            of(0) + of(1)
        });
        // The factorisation reads the lower triangle.
        let coefficients = products
            .view((0, 0), (linear, linear))
            .into_owned()
            .cholesky()?;
        Some(Self {
            coefficients,
            mixed,
            omegas,
            mixed_curvature,
            curvature,
            right,
        })
    }

    /// Step of the Gauss–Newton method; `None` if the samples do not determine the frequencies.
    pub fn gauss_newton_step(&self) -> Option<Unknowns> {
        self.step(&self.mixed, &self.omegas)
    }

    /// Step of Newton's method; `None` unless the sum of squares is convex.
    pub fn newton_step(&self) -> Option<Unknowns> {
        let mixed = [0, 1].map(|c| &self.mixed[c] + &self.mixed_curvature[c]);
        self.step(
            &mixed,
            &(&self.omegas + DMatrix::from_diagonal(&self.curvature)),
        )
    }

    /// Solution for given mixed terms and terms of the frequencies.
    fn step(&self, mixed: &[DMatrix<f64>; 2], omegas: &DMatrix<f64>) -> Option<Unknowns> {
        let solved = [0, 1].map(|c| self.coefficients.solve(&self.right.coefficients[c]));
        let (eliminated, schur) = self.eliminate(mixed, omegas);
        let right = &self.right.omegas - mixed[0].tr_mul(&solved[0]) - mixed[1].tr_mul(&solved[1]);
        let omegas = schur.cholesky()?.solve(&right);
        let coefficients = [0, 1].map(|c| &solved[c] - &eliminated[c] * &omegas);
        Some(Unknowns {
            coefficients,
            omegas,
        })
    }

    /// A⁻¹ B, and the Schur complement D − Σ Bᵀ A⁻¹ B.
    fn eliminate(
        &self,
        mixed: &[DMatrix<f64>; 2],
        omegas: &DMatrix<f64>,
    ) -> ([DMatrix<f64>; 2], DMatrix<f64>) {
        let eliminated = [0, 1].map(|c| self.coefficients.solve(&mixed[c]));
        let schur = omegas - mixed[0].tr_mul(&eliminated[0]) - mixed[1].tr_mul(&eliminated[1]);
        (eliminated, schur)
    }

    /// Variances of all unknowns for noise of variance one: the diagonal of the inverse matrix of
    /// the Gauss–Newton method. `None` if the samples do not determine the frequencies.
    pub fn variances(&self) -> Option<Unknowns> {
        let (eliminated, schur) = self.eliminate(&self.mixed, &self.omegas);
        let inverse = schur.cholesky()?.inverse();
        let alone = self.coefficients.inverse().diagonal();
        let coefficients =
            eliminated.map(|e| &alone + (&e * &inverse).component_mul(&e).column_sum());
        Some(Unknowns {
            coefficients,
            omegas: inverse.diagonal(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::harmonics::Wave;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use nalgebra::Vector2;

    /// Eighteen samples at irregular times, and a fit with a quadratic drift and two waves. The
    /// residual is a quarter of the waves.
    fn scene() -> (Samples, Harmonics) {
        let times: Vec<f64> = (0..18)
            .map(|k| (0.18 * f64::from(k) - 1.55).sin())
            .collect();
        let mut fit = Harmonics::new(2, &[]);
        fit.drift = vec![
            Vector2::new(0.1, -0.2),
            Vector2::new(0.7, 0.3),
            Vector2::new(-0.1, 0.05),
        ];
        for (omega, cosine, sine) in [
            (5.1, [0.9, 0.2], [-0.1, 0.4]),
            (8.3, [0.3, -0.2], [0.1, 0.5]),
        ] {
            fit.waves.push(Wave {
                cosine: cosine.into(),
                sine: sine.into(),
                omega,
                ..Wave::default()
            });
        }
        let rest = |t: f64| 0.2 * Vector2::new((14.0 * t).cos(), (13.0 * t + 1.0).sin());
        let zero = Samples::new(times.clone(), vec![Vector2::zeros(); times.len()]);
        let positions = times
            .iter()
            .zip(fit.residuals(&zero))
            .map(|(t, model)| rest(*t) - model)
            .collect();
        (Samples::new(times, positions), fit)
    }

    fn equations(samples: &Samples, fit: &Harmonics) -> NormalEquations {
        let mut columns = Columns::new(samples, 3, 2);
        columns.set(fit, 2);
        NormalEquations::of(&columns, fit, 2).unwrap()
    }

    /// The unknowns as one vector: both coordinates of all coefficients, then frequencies.
    fn joined(of: &Unknowns) -> DVector<f64> {
        let [x, y] = &of.coefficients;
        DVector::from_iterator(16, x.iter().chain(y).chain(&of.omegas).copied())
    }

    /// Derivatives of all coordinates of the model with respect to the unknowns, and the residual.
    fn dense(samples: &Samples, fit: &Harmonics) -> (DMatrix<f64>, DVector<f64>) {
        let row = |c: usize, t: f64| {
            let mut row = vec![0.0; 16];
            legendre_sequence(t)
                .take(3)
                .enumerate()
                .for_each(|(j, value)| row[7 * c + j] = value);
            for (k, wave) in fit.waves.iter().enumerate() {
                let (sine, cosine) = (wave.omega * t).sin_cos();
                (row[7 * c + 3 + 2 * k], row[7 * c + 4 + 2 * k]) = (cosine, sine);
                row[14 + k] = t * (wave.sine[c] * cosine - wave.cosine[c] * sine);
            }
            row
        };
        let rows: Vec<f64> = (0..36)
            .flat_map(|i| row(i % 2, samples.times[i / 2]))
            .collect();
        let rest = fit.residuals(samples);
        (
            DMatrix::from_row_slice(36, 16, &rows),
            DVector::from_fn(36, |i, _| rest[i / 2][i % 2]),
        )
    }

    #[test]
    fn gauss_newton_step_and_variances_are_those_of_dense_least_squares() {
        let (samples, fit) = scene();
        let (jacobian, rest) = dense(&samples, &fit);
        let inverse = (jacobian.transpose() * &jacobian).try_inverse().unwrap();
        let equations = equations(&samples, &fit);
        // Rounding, magnified by the condition number of the dense normal equations, 923.
        let expected = &inverse * jacobian.transpose() * rest;
        assert_abs_diff_eq!(
            joined(&equations.gauss_newton_step().unwrap()),
            expected,
            epsilon = 1e-12
        );
        let variances = joined(&equations.variances().unwrap());
        assert_relative_eq!(
            variances,
            inverse.diagonal(),
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }

    /// The derivative of the gradient by central differences along Newton's step is minus the
    /// gradient.
    #[test]
    fn newtons_step_makes_the_linearised_gradient_zero() {
        let (samples, fit) = scene();
        let step = equations(&samples, &fit).newton_step().unwrap();
        let gradient = |size: f64| {
            let mut moved = fit.clone();
            let scaled = Unknowns {
                coefficients: [0, 1].map(|c| &step.coefficients[c] * size),
                omegas: &step.omegas * size,
            };
            moved.add(&scaled);
            let (jacobian, rest) = dense(&samples, &moved);
            jacobian.transpose() * rest
        };
        // The error of the differences is of the order of the square of the size, and rounding over
        // the size.
        let change = (gradient(1e-5) - gradient(-1e-5)) / 2e-5;
        assert_abs_diff_eq!(
            change,
            -gradient(0.0),
            epsilon = 1e-8 * gradient(0.0).norm()
        );
    }
}
