//! Combinations of parameters that have no effect on the data.

use nalgebra::{DMatrix, DVector};

/// Ratio of a singular value to the largest one below which the combination has no effect on the data. Extrapolated
/// differences on a frozen grid give 1e-10 for combinations without effect, and have an error of this size for others.
const NO_EFFECT: f64 = 1e-8;

/// Relative change of a column with the step of its differences above which the column is rounding. Otherwise the change
/// is of the order of the square of the step.
const ROUNDING: f64 = 0.3;

/// Component of a combination above which a coordinate belongs to it, relative to the largest one.
const BELONGS: f64 = 1e-3;

/// Singular value decomposition of a Jacobian and of the slopes of priors, whose columns are divided by their norms.
///
/// Without the division, wide bounds of a linear parameter or a narrow prior of another one would hide the effects of
/// all others.
#[derive(Clone)]
pub(super) struct Singular {
    /// Singular values, the largest first.
    pub values: DVector<f64>,
    /// Norm of each column.
    norms: DVector<f64>,
    /// Combinations of the divided columns.
    scaled: DMatrix<f64>,
}

impl Singular {
    /// Decomposition of a Jacobian, without its columns that are rounding, and of the slopes of priors of coordinates.
    pub fn of(jacobian: &DMatrix<f64>, rounding: &[bool], priors: &[(usize, f64)]) -> Option<Self> {
        let n = jacobian.ncols();
        if n == 0 {
            return None;
        }
        let mut rows = jacobian.clone().resize_vertically(jacobian.nrows() + priors.len(), 0.0);
        for i in (0..n).filter(|i| rounding[*i]) {
            rows.column_mut(i).fill(0.0);
        }
        for (row, (i, slope)) in priors.iter().enumerate() {
            rows[(jacobian.nrows() + row, *i)] = *slope;
        }
        let norm = |i: usize| Some(rows.column(i).norm()).filter(|norm| *norm > 0.0).unwrap_or(1.0);
        let norms = DVector::from_fn(n, |i, _| norm(i));
        for i in 0..n {
            rows.column_mut(i).unscale_mut(norms[i]);
        }
        // The triangular factor has the same singular values, and is small. Fewer rows than columns are filled up.
        let rows = if rows.nrows() < n { rows.resize_vertically(n, 0.0) } else { rows };
        let svd = rows.qr().r().try_svd(false, true, f64::EPSILON, 0)?;
        let scaled = svd.v_t?.transpose();
        Some(Self { values: svd.singular_values, norms, scaled })
    }

    /// Whether combination `j` has no effect on the data.
    fn has_no_effect(&self, j: usize) -> bool {
        self.values[j] <= NO_EFFECT * self.values.max()
    }

    /// Combinations without effect: changes of the coordinates, the largest ±1. A coordinate belongs to a combination by
    /// its change or by the effect of its change; the others are zero.
    pub fn without_effect(&self) -> Vec<DVector<f64>> {
        let of = |j| {
            let effects = self.scaled.column(j);
            let changes = effects.component_div(&self.norms);
            let belongs = |part: &DVector<f64>, i: usize| part[i].abs() > BELONGS * part.amax();
            let effects = effects.into_owned();
            let of = |i, _| if belongs(&effects, i) || belongs(&changes, i) { changes[i] } else { 0.0 };
            DVector::from_fn(changes.len(), of).unscale(changes.amax())
        };
        (0..self.values.len()).rev().filter(|j| self.has_no_effect(*j)).map(of).collect()
    }

    /// (JᵀJ)⁻¹ of the Jacobian J and the slopes of the priors, without the combinations that have no effect.
    pub fn inverse(&self) -> DMatrix<f64> {
        let of = |j: usize| if self.has_no_effect(j) { 0.0 } else { self.values[j].powi(-2) };
        let inverse = DVector::from_fn(self.values.len(), |j, _| of(j));
        let scaled = &self.scaled * DMatrix::from_diagonal(&inverse) * self.scaled.transpose();
        DMatrix::from_fn(self.norms.len(), self.norms.len(), |i, k| scaled[(i, k)] / (self.norms[i] * self.norms[k]))
    }
}

/// Whether each column is rounding, from differences with two steps.
pub(super) fn rounding(coarse: &DMatrix<f64>, fine: &DMatrix<f64>) -> Vec<bool> {
    let is = |i: usize| !((coarse.column(i) - fine.column(i)).norm() < ROUNDING * fine.column(i).norm());
    (0..fine.ncols()).map(is).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The first two columns differ by a factor, and the third is independent.
    fn jacobian(scales: [f64; 3]) -> DMatrix<f64> {
        let rows = [[1.0, -1.0, 0.3], [2.0, -2.0, -0.5], [0.5, -0.5, 0.1], [3.0, -3.0, 2.0]];
        DMatrix::from_fn(4, 3, |i, k| rows[i][k] * scales[k])
    }

    fn belonging(found: &Singular) -> [bool; 3] {
        [0, 1, 2].map(|i| found.without_effect().iter().any(|change| change[i] != 0.0))
    }

    #[test]
    fn scales_of_coordinates_do_not_hide_a_combination_without_effect() {
        for scales in [[1.0; 3], [1e-5, 1e7, 1.0], [1.0, 1.0, 1e12], [1.0, 1.0, 1e-12]] {
            let found = Singular::of(&jacobian(scales), &[false; 3], &[]).unwrap();
            let combinations = found.without_effect();
            assert_eq!(combinations.len(), 1);
            // Rounding of four rows.
            let quotient = combinations[0][0] / combinations[0][1];
            assert_relative_eq!(quotient, scales[1] / scales[0], epsilon = 0.0, max_relative = 1e-12);
            assert_eq!(belonging(&found), [true, true, false]);
        }
    }

    #[test]
    fn a_narrow_prior_determines_a_coordinate_and_hides_no_other() {
        let matrix = jacobian([1.0; 3]);
        let found = Singular::of(&matrix, &[false; 3], &[(2, 1e12)]).unwrap();
        assert_eq!(belonging(&found), [true, true, false]);
        let found = Singular::of(&matrix, &[false; 3], &[(0, 1e12)]).unwrap();
        assert!(found.without_effect().is_empty());
        // The variance of the prior, and that of the second column given the first and the third, 1/|column|².
        let inverse = found.inverse();
        assert_relative_eq!(inverse[(0, 0)], 1e-24, epsilon = 0.0, max_relative = 1e-12);
        let (second, third) = (matrix.column(1), matrix.column(2));
        let rest = second - third * (second.dot(&third) / third.norm_squared());
        assert_relative_eq!(inverse[(1, 1)], rest.norm_squared().recip(), epsilon = 0.0, max_relative = 1e-12);
    }

    #[test]
    fn columns_of_rounding_have_no_effect() {
        let fine =
            jacobian([1.0, 0.0, 1.0]) + DMatrix::from_fn(4, 3, |i, k| if k == 1 { 1e-9 * i as f64 } else { 0.0 });
        let mut coarse = fine.clone();
        coarse.column_mut(1).unscale_mut(3.0);
        let rounding = rounding(&coarse, &fine);
        assert_eq!(rounding, [false, true, false]);
        let found = Singular::of(&fine, &rounding, &[]).unwrap();
        assert_eq!(belonging(&found), [false, true, false]);
    }

    /// One equation for two coordinates.
    #[test]
    fn fewer_rows_than_columns_leave_a_combination_without_effect() {
        let found = Singular::of(&DMatrix::from_row_slice(1, 2, &[1.0, 2.0]), &[false; 2], &[]).unwrap();
        let combination = &found.without_effect()[0];
        assert_relative_eq!(combination[0] + 2.0 * combination[1], 0.0, epsilon = 1e-15);
    }
}
