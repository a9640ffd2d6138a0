//! Jacobian of the residuals of a fit by differences on the grid of one run.

use nalgebra::{DMatrix, DVector};

use super::FitError;
use super::problem::{Point, Problem};
use crate::ensemble;

/// Step of an unknown in a central difference quotient. An unknown is ln value, or the value over
/// the distance of its bounds.
///
/// On the grid of one run, the path of a growing shoot over ten hours is smooth to 1e-14 of its
/// length. The quotients then have relative errors below 1e-6 by curvature and below 1e-8 by
/// rounding. Larger steps often displace the boundary of the growth zone past a node, which the
/// grid does not permit.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// Step of an unknown in a one-sided difference quotient. The relative error by curvature, below
/// 1e-4, displaces the end of a search by less than 1e-4 standard errors.
const ONE_SIDED: f64 = 1e-6;

/// Ratio of successive steps of central quotients, and their largest number. The last step is
/// 7e-13.
const RATIO: f64 = 3.0;
const STEPS: usize = 16;
/// Number of steps of one-sided quotients. With the last one, rounding is 1e-6 of the derivative.
const SHORTER: usize = 5;

/// Relative difference of two successive quotients up to which both steps are short enough. The
/// extrapolated quotient is then accurate to a few thousandths.
const STABLE: f64 = 0.03;

/// Change of the residuals over the norm of the data below which the change is rounding: a hundred
/// times that of a path.
const ROUNDING: f64 = 1e-12;

/// Derivatives of all residuals with respect to one unknown, or the error of a run.
type FoundColumn = Result<DVector<f64>, FitError>;

impl Problem<'_> {
    /// Jacobian of the residuals at a point. Each column is extrapolated from central difference
    /// quotients with two steps. A column of rounding errors is zero.
    pub fn jacobian(&self, point: &Point) -> Result<DMatrix<f64>, FitError> {
        self.columns(point, |k| self.extrapolated(point, k))
    }

    /// Jacobian by one-sided difference quotients of first order, with half the runs.
    pub fn one_sided_jacobian(&self, point: &Point) -> Result<DMatrix<f64>, FitError> {
        self.columns(point, |k| {
            let quotient =
                |h: f64| Ok::<_, FitError>((self.displaced(point, k, h)? - &point.residuals) / h);
            // At a bound, or at the edge of the domain of the family, only one side has a shoot.
            let steps = std::iter::successors(Some(ONE_SIDED), |h| Some(h / RATIO)).take(SHORTER);
            let found = steps
                .flat_map(|h| [h, -h])
                .map(quotient)
                .find_map(Result::ok);
            found.map_or_else(|| self.extrapolated(point, k), Ok)
        })
    }

    /// Matrix with a column for each unknown.
    fn columns(
        &self,
        point: &Point,
        column: impl Fn(usize) -> FoundColumn + Sync,
    ) -> Result<DMatrix<f64>, FitError> {
        let n = self.free.len();
        let columns = ensemble::collect(n, self.threads, column)
            .into_iter()
            .collect::<Result<Vec<_>, _>>()?;
        Ok(DMatrix::from_iterator(
            point.residuals.len(),
            n,
            columns.iter().flatten().copied(),
        ))
    }

    /// Derivatives of the residuals with respect to unknown `k`, with an error of fourth order, or
    /// of third order if a quotient is one-sided: extrapolated from the first two successive
    /// quotients that agree.
    ///
    /// Long steps may fail, because a displaced shoot cannot follow the grid, or is beyond a bound
    /// or the domain of the family. They may also be longer than the range in which the path is
    /// smooth, because the bounds of a linear parameter, which determine them, may be wide.
    fn extrapolated(&self, point: &Point, k: usize) -> Result<DVector<f64>, FitError> {
        let sizes: Vec<f64> = self
            .data
            .iter()
            .zip(&self.noise)
            .map(|(series, noise)| series.size() / noise)
            .collect();
        let size = point
            .rows
            .iter()
            .map(|row| sizes[row.series].powi(2))
            .sum::<f64>()
            .sqrt();
        let steps = std::iter::successors(Some(DIFFERENCE), |h| Some(h / RATIO)).take(STEPS);
        let (mut longer, mut last) = (None, Ok(DVector::zeros(point.residuals.len())));
        for h in steps {
            let quotient = match self.quotient(point, k, h) {
                Err(error @ (FitError::Run { .. } | FitError::Family { .. })) => {
                    (longer, last) = (None, Err(error));
                    continue;
                }
                other => other?,
            };
            if !(quotient.norm() * h > ROUNDING * size) {
                return Ok(DVector::zeros(quotient.len()));
            }
            if let Some(coarse) = longer.replace(quotient.clone()) {
                let square = RATIO * RATIO;
                let extrapolated = (&quotient * square - &coarse) / (square - 1.0);
                if (coarse - &quotient).norm() <= STABLE * quotient.norm() {
                    return Ok(extrapolated);
                }
                last = Ok(extrapolated);
            }
        }
        last
    }

    /// Returns a difference quotient of second order for unknown `k` with the step `h`. It is
    /// one-sided if the runs on one side fail, as where they cannot follow the grid of the point.
    fn quotient(&self, point: &Point, k: usize, h: f64) -> Result<DVector<f64>, FitError> {
        let one_sided = |h: f64, near: DVector<f64>| {
            Ok(
                (near * 4.0 - self.displaced(point, k, 2.0 * h)? - &point.residuals * 3.0)
                    / (2.0 * h),
            )
        };
        match [h, -h].map(|h| self.displaced(point, k, h)) {
            [Ok(ahead), Ok(behind)] => Ok((ahead - behind) / (2.0 * h)),
            [Ok(ahead), Err(FitError::Run { .. })] => one_sided(h, ahead),
            [Err(FitError::Run { .. }), Ok(behind)] => one_sided(-h, behind),
            [Err(error), _] | [_, Err(error)] => Err(error),
        }
    }

    /// Residuals over the noise with unknown `k` changed by `h`, on the grid of the run at the
    /// point. Values beyond the bounds, where the family need not have a shoot, are an error.
    fn displaced(&self, point: &Point, k: usize, h: f64) -> Result<DVector<f64>, FitError> {
        let mut x = point.x.clone();
        x[k] += h;
        let [low, high] = self.limits(k);
        if (low..=high).contains(&x[k]) {
            return self.near(point, &x);
        }
        let names = self
            .parameters
            .iter()
            .map(|parameter| parameter.name.clone());
        let values = names.zip(self.values_at(&x)).collect();
        Err(FitError::Family {
            values,
            problem: format!("{} is beyond a bound", self.parameters[self.free[k]].name),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use approx::assert_relative_eq;
    use nalgebra::Vector3;

    use super::*;
    use crate::fit::residuals::Origin;
    use crate::fit::{Loss, Parameter, Series};
    use crate::integrator::{Grid, IntegrationError};

    /// A problem with the unknowns ln a and ln b at a = 2 and b = 3, and three equal residuals of a
    /// and b.
    fn problem<'a>(
        parameters: &'a [Parameter; 2],
        data: &'a [Series; 1],
        residual: impl Fn(&[f64]) -> Result<f64, FitError> + Send + Sync + 'a,
    ) -> Problem<'a> {
        let run = move |values: &[f64], _: f64, _: Option<&Grid>| {
            let (residual, rows) = (
                residual(values)?,
                (0..3).map(|index| Origin {
                    series: 0,
                    index,
                    time: 1.0,
                }),
            );
            Ok((rows.map(|row| (row, residual)).collect(), Grid::default()))
        };
        Problem {
            parameters,
            data,
            loss: Loss::Squares,
            values: vec![2.0, 3.0],
            free: vec![0, 1],
            noise: vec![1.0],
            until: f64::INFINITY,
            threads: 1,
            run: Arc::new(run),
        }
    }

    fn parameters() -> [Parameter; 2] {
        ["a", "b"].map(|name| Parameter::positive(name, [0.1, 10.0]))
    }

    #[test]
    fn derivative_on_one_side_where_shoots_on_the_other_have_no_residuals() {
        let (parameters, data) = (parameters(), [Series::tips(vec![1.0], &[Vector3::x()])]);
        let refused = |values: &[f64]| {
            let error = IntegrationError::Grid {
                time: 0.0,
                problem: "an element that it changes does not exist",
            };
            FitError::Run {
                values: vec![("a".to_owned(), values[0])],
                error: Box::new(error),
            }
        };
        for side in [1.0, -1.0] {
            let problem = problem(&parameters, &data, |values| {
                if side * (values[0] - 2.0) > 1e-12 {
                    Err(refused(values))
                } else {
                    Ok(values[0].ln().sin())
                }
            });
            let point = problem.at(problem.unknowns()).unwrap();
            let jacobian = problem.jacobian(&point).unwrap();
            // The steps are at most 1e-5. The error by rounding is below 1e-10, and a quotient of
            // first order would have an error of 3e-6.
            assert_relative_eq!(jacobian[(0, 0)], 2.0_f64.ln().cos(), epsilon = 1e-9);
        }
    }

    /// The first unknown x has the effect sin x, and the second one an effect of the size of
    /// rounding.
    #[test]
    fn column_of_rounding_is_zero() {
        let (parameters, data) = (parameters(), [Series::tips(vec![1.0], &[Vector3::x()])]);
        let problem = problem(&parameters, &data, |values| {
            Ok(values[0].ln().sin() + 1e-14 * (1e6 * values[1].ln()).sin())
        });
        let point = problem.at(problem.unknowns()).unwrap();
        let jacobian = problem.jacobian(&point).unwrap();
        // The error of fourth order is 1e-20, and that by rounding 1e-16 over the step of 3e-6.
        assert_relative_eq!(jacobian[(0, 0)], 2.0_f64.ln().cos(), epsilon = 1e-9);
        assert_eq!(jacobian.column(1).amax(), 0.0);
    }
}
