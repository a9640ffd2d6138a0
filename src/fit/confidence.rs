//! Covariance of the estimates, and combinations of parameters that have no effect on the data.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::noise::Noise;
use super::problem::{Point, Problem};
use crate::numerics::dense::most_iterations;

/// Ratio of a singular value to the largest one below which its combination has no effect on the
/// data. With extrapolated differences on a fixed grid, the ratios of combinations without effect
/// are 1e-10, and those of others have an error of this size.
const NO_EFFECT: f64 = 1e-8;

/// Component of a combination, relative to the largest one, above which an unknown belongs to the
/// combination.
const BELONGS: f64 = 1e-3;

/// Singular value decomposition of the matrix of a Jacobian and of the slopes of priors, whose
/// columns are divided by their norms.
///
/// The division makes the decomposition independent of the scales of the unknowns. Otherwise, wide
/// bounds of a linear parameter or a narrow prior would hide the effects of the other parameters.
pub(super) struct Singular {
    /// Singular values, the largest first.
    pub values: DVector<f64>,
    /// Norm of each column before the division.
    norms: DVector<f64>,
    /// Right singular vectors: combinations of the divided columns.
    vectors: DMatrix<f64>,
}

impl Singular {
    /// Decomposes a Jacobian and the slopes of `priors`, each with the index of its unknown. If the
    /// decomposition does not converge, no combination has a known effect.
    pub fn of(jacobian: &DMatrix<f64>, priors: &[(usize, f64)]) -> Self {
        let n = jacobian.ncols();
        let mut rows = jacobian
            .clone()
            .resize_vertically((jacobian.nrows() + priors.len()).max(n), 0.0);
        for (row, (i, slope)) in priors.iter().enumerate() {
            rows[(jacobian.nrows() + row, *i)] = *slope;
        }
        let norms = DVector::from_fn(n, |i, _| {
            Some(rows.column(i).norm())
                .filter(|norm| *norm > 0.0)
                .unwrap_or(1.0)
        });
        for i in 0..n {
            rows.column_mut(i).unscale_mut(norms[i]);
        }
        // The triangular factor is small and has the same singular values. nalgebra does not
        // decompose an empty matrix. If the decomposition is not found, no combination has a known
        // effect.
        let svd = if n > 0 {
            rows.qr()
                .r()
                .try_svd(false, true, f64::EPSILON, most_iterations(n))
        } else {
            None
        };
        let known = svd.and_then(|svd| Some((svd.singular_values, svd.v_t?.transpose())));
        let (values, vectors) =
            known.unwrap_or_else(|| (DVector::zeros(n), DMatrix::identity(n, n)));
        Self {
            values,
            norms,
            vectors,
        }
    }

    /// Whether combination `j` has no effect on the data.
    fn has_no_effect(&self, j: usize) -> bool {
        self.values[j] <= NO_EFFECT * self.values.max()
    }

    /// Combinations without effect: changes of the unknowns, the largest ±1. An unknown belongs to
    /// a combination if its change, or the effect of its change, is not small. The components of
    /// the others are zero.
    pub fn without_effect(&self) -> Vec<DVector<f64>> {
        let combination = |j| {
            let effects = self.vectors.column(j);
            let changes = effects.component_div(&self.norms);
            let belongs = |part: &DVector<f64>, i: usize| part[i].abs() > BELONGS * part.amax();
            let effects = effects.into_owned();
            let component = |i, _| {
                if belongs(&effects, i) || belongs(&changes, i) {
                    changes[i]
                } else {
                    0.0
                }
            };
            DVector::from_fn(changes.len(), component).unscale(changes.amax())
        };
        (0..self.values.len())
            .rev()
            .filter(|j| self.has_no_effect(*j))
            .map(combination)
            .collect()
    }

    /// (JᵀJ)⁻¹ of the Jacobian J and the slopes of the priors, without the combinations that have
    /// no effect.
    pub fn inverse(&self) -> DMatrix<f64> {
        let square = |j: usize, _: usize| {
            if self.has_no_effect(j) {
                0.0
            } else {
                self.values[j].powi(-2)
            }
        };
        let squares = DVector::from_fn(self.values.len(), square);
        let scaled = &self.vectors * DMatrix::from_diagonal(&squares) * self.vectors.transpose();
        DMatrix::from_fn(self.norms.len(), self.norms.len(), |i, k| {
            scaled[(i, k)] / (self.norms[i] * self.norms[k])
        })
    }
}

/// Uncertainty of the estimates in the linearised problem.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearTheory {
    /// Indices of the parameters with a standard error.
    pub free: Vec<usize>,
    /// Covariance of the unknowns of these parameters, without the combinations that have no
    /// effect.
    pub covariance: DMatrix<f64>,
    /// The same covariance for the loss of squares and white noise of the size in the problem.
    pub white: DMatrix<f64>,
    /// Number of successive residuals that contain the information of one.
    pub redundancy: f64,
    /// Combinations without effect on the data: changes of the unknowns.
    pub without_effect: Vec<DVector<f64>>,
}

impl LinearTheory {
    /// Linearised problem at a point, with the Jacobian there, its decomposition, and the noise.
    ///
    /// The covariance is A B A with A = (m JᵀJ)⁻¹ and B = s² Jᵀ R J (P. J. Huber, Robust
    /// Statistics, 1981, section 7.6). Here m is the share of residuals inside the threshold, s²
    /// the mean square of the derivative of the loss in a series, and R the correlation of its
    /// successive residuals. For white noise and squares the covariance is s² (JᵀJ)⁻¹. Residuals
    /// that are smaller than the noise do not narrow the intervals: m is at most its value for
    /// normal noise, and white noise is added until the mean square has at least its value for
    /// normal noise. Priors add the inverse squares of their standard deviations to A⁻¹ and to B.
    pub fn of(
        problem: &Problem,
        point: &Point,
        jacobian: &DMatrix<f64>,
        singular: &Singular,
        noise: &Noise,
    ) -> Self {
        let (normal_variance, normal_share) = problem.loss.for_normal_noise();
        let inside = point
            .residuals
            .iter()
            .filter(|r| problem.loss.is_inside(**r))
            .count()
            .max(1) as f64;
        let inside = (inside / point.residuals.len() as f64).min(normal_share);
        let mut middle = noise.covariance(jacobian, normal_variance) / (inside * inside);
        for (i, [_, slope]) in problem.priors(&point.x) {
            middle[(i, i)] += slope * slope;
        }
        let white = singular.inverse();
        Self {
            free: problem.free.clone(),
            covariance: &white * middle * &white,
            white,
            redundancy: noise.redundancy(),
            without_effect: singular.without_effect(),
        }
    }
}

/// Combinations of unknowns with a standard error above `widest`, the largest error first. Each has
/// its components, the largest ±1, and its standard error.
pub(super) fn uncertain(covariance: &DMatrix<f64>, widest: f64) -> Vec<(DVector<f64>, f64)> {
    let (n, matrix) = (covariance.nrows(), covariance.clone());
    // nalgebra does not decompose an empty matrix.
    let eigen = if n > 0 {
        SymmetricEigen::try_new(matrix, f64::EPSILON, most_iterations(n))
    } else {
        None
    };
    let Some(eigen) = eigen else { return vec![] };
    let combination = |j: usize| {
        let direction = eigen.eigenvectors.column(j);
        (
            direction.unscale(direction.amax()),
            eigen.eigenvalues[j].max(0.0).sqrt() * direction.amax(),
        )
    };
    let mut all: Vec<_> = (0..eigen.eigenvalues.len())
        .map(combination)
        .filter(|(_, error)| *error > widest)
        .collect();
    all.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The first two columns differ by a factor, and the third is independent.
    fn jacobian(scales: [f64; 3]) -> DMatrix<f64> {
        let rows = [
            [1.0, -1.0, 0.3],
            [2.0, -2.0, -0.5],
            [0.5, -0.5, 0.1],
            [3.0, -3.0, 2.0],
        ];
        DMatrix::from_fn(4, 3, |i, k| rows[i][k] * scales[k])
    }

    /// Whether each unknown belongs to a combination without effect.
    fn belonging(found: &Singular) -> [bool; 3] {
        [0, 1, 2].map(|i| found.without_effect().iter().any(|change| change[i] != 0.0))
    }

    #[test]
    fn scales_of_unknowns_do_not_hide_a_combination_without_effect() {
        for scales in [
            [1.0; 3],
            [1e-5, 1e7, 1.0],
            [1.0, 1.0, 1e12],
            [1.0, 1.0, 1e-12],
        ] {
            let found = Singular::of(&jacobian(scales), &[]);
            let combinations = found.without_effect();
            assert_eq!(combinations.len(), 1);
            // The error is rounding of four rows.
            let quotient = combinations[0][0] / combinations[0][1];
            assert_relative_eq!(
                quotient,
                scales[1] / scales[0],
                epsilon = 0.0,
                max_relative = 1e-12
            );
            assert_eq!(belonging(&found), [true, true, false]);
        }
    }

    #[test]
    fn a_narrow_prior_determines_its_unknown_only() {
        let matrix = jacobian([1.0; 3]);
        let found = Singular::of(&matrix, &[(2, 1e12)]);
        assert_eq!(belonging(&found), [true, true, false]);
        let found = Singular::of(&matrix, &[(0, 1e12)]);
        assert!(found.without_effect().is_empty());
        // Variance of the prior. Then variance of the second unknown with the first one known: the
        // inverse square of the part of its column that is orthogonal to the third column.
        let inverse = found.inverse();
        assert_relative_eq!(inverse[(0, 0)], 1e-24, epsilon = 0.0, max_relative = 1e-12);
        let (second, third) = (matrix.column(1), matrix.column(2));
        let rest = second - third * (second.dot(&third) / third.norm_squared());
        assert_relative_eq!(
            inverse[(1, 1)],
            rest.norm_squared().recip(),
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }

    /// One equation for two unknowns.
    #[test]
    fn fewer_rows_than_columns_leave_a_combination_without_effect() {
        let found = Singular::of(&DMatrix::from_row_slice(1, 2, &[1.0, 2.0]), &[]);
        let combination = &found.without_effect()[0];
        assert_relative_eq!(combination[0] + 2.0 * combination[1], 0.0, epsilon = 1e-15);
    }
}
