//! Least-squares problem of a fit: residuals over the noise as functions of the free coordinates, and their Jacobian.

use nalgebra::{DMatrix, DVector};

use super::residuals::{Output, Row, Steps};
use super::{FitError, Parameter};
use crate::ensemble;
use crate::integrator::Grid;

/// Step of a coordinate in a central difference quotient. A coordinate is ln value, or the value over the distance of
/// its bounds.
///
/// On the grid of one run, the path of a growing shoot over ten hours is smooth to 1e-14 of its length. The quotients
/// then have relative errors below 1e-6 by curvature and below 1e-8 by rounding. Larger steps often displace the
/// boundary of the growth zone past a node, which the grid does not permit.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// Step of a coordinate in a one-sided difference quotient. The relative error by curvature, below 1e-4, displaces the
/// end of a search by less than 1e-4 standard errors.
const ONE_SIDED: f64 = 1e-6;

/// Ratio of the two steps of an extrapolated difference quotient.
pub(super) const RATIO: f64 = 3.0;

/// Largest number of times the step of a difference quotient is divided by [`RATIO`], when the shoot with displaced
/// parameters cannot follow the grid.
const DIVISIONS: usize = 6;

/// Function from the values of all parameters and a time (s) to the residuals (m, or rad) up to this time.
pub(super) type Run<'a> = dyn Fn(&[f64], f64, Steps) -> Result<Output, FitError> + Sync + 'a;

/// Residuals of the data up to a time.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    pub parameters: &'a [Parameter],
    /// Values of all parameters. Those of the parameters that are not free are used in every run.
    pub values: Vec<f64>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    pub run: &'a Run<'a>,
    /// Noise of each series, m, or rad for angles.
    pub noise: Vec<f64>,
    /// Time up to which the data are used, s.
    pub until: f64,
    pub threads: usize,
}

/// Residuals at a point.
pub(super) struct Evaluated {
    /// Simulated minus measured coordinates over the noise.
    pub residuals: DVector<f64>,
    /// Series, coordinate and time of each residual.
    pub rows: Vec<Row>,
    /// Grid of the run at this point.
    pub grid: Grid,
}

impl Evaluated {
    /// Matrix with the given columns, of which there may be none, and one row for each residual.
    fn matrix(&self, columns: &[DVector<f64>]) -> DMatrix<f64> {
        DMatrix::from_iterator(self.residuals.len(), columns.len(), columns.iter().flatten().copied())
    }
}

impl Problem<'_> {
    /// Free coordinates of values of all parameters.
    pub fn coordinates(&self, values: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.free.len(), self.free.iter().map(|k| self.parameters[*k].coordinate(values[*k])))
    }

    /// Values of all parameters at free coordinates.
    pub fn values_at(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut values = self.values.clone();
        for (k, x) in self.free.iter().zip(x.iter()) {
            values[*k] = self.parameters[*k].value(*x);
        }
        values
    }

    /// Residuals at a point, on a new grid.
    pub fn evaluate(&self, x: &DVector<f64>) -> Result<Evaluated, FitError> {
        let Output { residuals, rows, grid } = (self.run)(&self.values_at(x), self.until, Steps::Record)?;
        let residuals = self.over_noise(&residuals, &rows);
        Ok(Evaluated { residuals, rows, grid })
    }

    /// Residuals (m, or rad) over the noise of their series.
    pub fn over_noise(&self, residuals: &[f64], rows: &[Row]) -> DVector<f64> {
        let scaled = residuals.iter().zip(rows).map(|(residual, row)| residual / self.noise[row.series]);
        DVector::from_iterator(residuals.len(), scaled)
    }

    /// Jacobians of the residuals at a point, one for each of the `steps` of the coordinates, by differences on the
    /// grid of the run at this point. A column is a central difference, or a one-sided difference of second order
    /// where the family has no shoot on the other side.
    pub fn jacobians<const N: usize>(
        &self,
        x: &DVector<f64>,
        at: &Evaluated,
        steps: [f64; N],
    ) -> Result<[DMatrix<f64>; N], FitError> {
        let n = self.free.len();
        let columns = ensemble::collect(n * N, self.threads, |index| self.column(x, at, index % n, steps[index / n]));
        let columns = columns.into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(std::array::from_fn(|i| at.matrix(&columns[i * n..(i + 1) * n])))
    }

    /// Jacobian by one-sided differences of first order on the grid of the run at the point. It needs half the runs of
    /// a Jacobian by central differences.
    pub fn one_sided_jacobian(&self, x: &DVector<f64>, at: &Evaluated) -> Result<DMatrix<f64>, FitError> {
        let n = self.free.len();
        let column = |k: usize| -> Result<DVector<f64>, FitError> {
            let quotient = |h: f64| Ok((self.displaced(x, at, k, h)? - &at.residuals) / h);
            let h = if self.is_inside(k, x[k] + ONE_SIDED) { ONE_SIDED } else { -ONE_SIDED };
            let other = || if self.is_inside(k, x[k] - h) { quotient(-h) } else { quotient(h) };
            match quotient(h) {
                Err(FitError::Run { .. } | FitError::Family { .. }) => match other() {
                    Err(FitError::Run { .. }) => self.column(x, at, k, ONE_SIDED),
                    result => result,
                },
                result => result,
            }
        };
        let columns = ensemble::collect(n, self.threads, column).into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(at.matrix(&columns))
    }

    /// Residuals over the noise at the point with coordinate `k` changed by `change`, on the grid of the run at the
    /// point.
    fn displaced(&self, x: &DVector<f64>, at: &Evaluated, k: usize, change: f64) -> Result<DVector<f64>, FitError> {
        let mut x = x.clone();
        x[k] += change;
        let output = (self.run)(&self.values_at(&x), self.until, Steps::Follow(&at.grid))?;
        Ok(self.over_noise(&output.residuals, &output.rows))
    }

    /// Whether free coordinate `k` is within its bounds at a value.
    fn is_inside(&self, k: usize, value: f64) -> bool {
        let [low, high] = self.parameters[self.free[k]].limits();
        (low..=high).contains(&value)
    }

    /// Derivative of the residuals with respect to coordinate `k`. The step is divided as long as a displaced shoot
    /// cannot follow the grid.
    fn column(&self, x: &DVector<f64>, at: &Evaluated, k: usize, step: f64) -> Result<DVector<f64>, FitError> {
        let mut step = step;
        for _ in 0..DIVISIONS {
            match self.difference(x, at, k, step) {
                Err(FitError::Run { .. }) => step /= RATIO,
                result => return result,
            }
        }
        self.difference(x, at, k, step)
    }

    /// Difference quotient of the residuals for coordinate `k` with the step `h`, with an error of second order.
    fn difference(&self, x: &DVector<f64>, at: &Evaluated, k: usize, h: f64) -> Result<DVector<f64>, FitError> {
        // The family is not evaluated beyond the bounds, where it need not have a shoot.
        let displaced = |change: f64| self.is_inside(k, x[k] + change).then(|| self.displaced(x, at, k, change));
        let one_sided = |near: &DVector<f64>, h: f64| -> Result<DVector<f64>, FitError> {
            let far = self.displaced(x, at, k, 2.0 * h)?;
            Ok((near * 4.0 - &at.residuals * 3.0 - far) / (2.0 * h))
        };
        match (displaced(h), displaced(-h)) {
            (Some(Ok(above)), Some(Ok(below))) => Ok((above - below) / (2.0 * h)),
            (Some(Ok(above)), None | Some(Err(FitError::Family { .. }))) => one_sided(&above, h),
            (None | Some(Err(FitError::Family { .. })), Some(Ok(below))) => one_sided(&below, -h),
            (Some(Err(error)), _) | (_, Some(Err(error))) => Err(error),
            // This case does not occur, because the distance of valid bounds exceeds twice the step.
            (None, None) => Ok(DVector::zeros(at.residuals.len())),
        }
    }
}

/// Extrapolates two Jacobians with an error of second order to one of fourth order. The step of `fine` is smaller than
/// that of `coarse` by the factor [`RATIO`].
pub(super) fn extrapolated(coarse: &DMatrix<f64>, fine: &DMatrix<f64>) -> DMatrix<f64> {
    let square = RATIO * RATIO;
    (fine * square - coarse) / (square - 1.0)
}
