//! Jacobian of the residuals of a fit by differences on the grid of one run.

use nalgebra::{DMatrix, DVector};

use super::FitError;
use super::problem::{Evaluated, Problem};
use super::residuals::Steps;
use crate::ensemble;

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
const RATIO: f64 = 3.0;

/// Largest number of times the step of a difference quotient is divided by [`RATIO`], when the shoot with displaced
/// parameters cannot follow the grid.
const DIVISIONS: usize = 6;

/// Relative difference of the columns of both steps up to which the steps are short enough, and largest number of times
/// they are divided by ten otherwise. The extrapolated column is then accurate to a few thousandths.
const STABLE: f64 = 0.03;
const SHORTER: usize = 8;

/// Change of the residuals over the norm of the data below which the change is rounding: a hundred times that of a
/// path.
const ROUNDING: f64 = 1e-12;

/// Jacobian of the residuals by central differences with two steps.
pub(super) struct Jacobian {
    /// Quotients with the longer and with the shorter step.
    pub coarse: DMatrix<f64>,
    fine: DMatrix<f64>,
    /// Whether each column is rounding.
    pub rounding: Vec<bool>,
}

impl Jacobian {
    /// Extrapolates the quotients, with errors of second order, to one of fourth order.
    pub fn extrapolated(&self) -> DMatrix<f64> {
        let square = RATIO * RATIO;
        (&self.fine * square - &self.coarse) / (square - 1.0)
    }
}

impl Evaluated {
    /// Matrix with the given columns, of which there may be none, and one row for each residual.
    fn matrix<'a>(&self, columns: impl ExactSizeIterator<Item = &'a DVector<f64>>) -> DMatrix<f64> {
        DMatrix::from_iterator(self.residuals.len(), columns.len(), columns.flatten().copied())
    }
}

impl Problem<'_> {
    /// Jacobian of the residuals at a point by differences on the grid of the run at this point. `size` is the norm of
    /// the data over the noise.
    pub fn jacobian(&self, x: &DVector<f64>, at: &Evaluated, size: f64) -> Result<Jacobian, FitError> {
        let n = self.free.len();
        let columns = ensemble::collect(n, self.threads, |k| self.stable_columns(x, at, k, size));
        let columns = columns.into_iter().collect::<Result<Vec<_>, _>>()?;
        let [coarse, fine] = [0, 1].map(|i| at.matrix(columns.iter().map(|(column, _)| &column[i])));
        Ok(Jacobian { coarse, fine, rounding: columns.iter().map(|(_, rounding)| *rounding).collect() })
    }

    /// Derivatives of the residuals with respect to coordinate `k` with two steps, and whether they are rounding. The
    /// steps are divided by ten as long as both differ, because the bounds of a linear parameter, which determine them,
    /// may be far wider than the range in which the path is smooth.
    fn stable_columns(
        &self,
        x: &DVector<f64>,
        at: &Evaluated,
        k: usize,
        size: f64,
    ) -> Result<([DVector<f64>; 2], bool), FitError> {
        let mut step = DIFFERENCE;
        let mut shorter = 0;
        loop {
            let [coarse, fine] = [self.column(x, at, k, step)?, self.column(x, at, k, step / RATIO)?];
            let rounding = !(fine.norm() * step > ROUNDING * size);
            let stable = (&coarse - &fine).norm() <= STABLE * fine.norm();
            if rounding || stable || shorter == SHORTER {
                return Ok(([coarse, fine], rounding));
            }
            step /= 10.0;
            shorter += 1;
        }
    }

    /// Jacobian by one-sided differences of first order on the grid of the run at the point. It needs half the runs of
    /// a Jacobian by central differences.
    pub fn one_sided_jacobian(&self, x: &DVector<f64>, at: &Evaluated) -> Result<DMatrix<f64>, FitError> {
        let n = self.free.len();
        let column = |k: usize| -> Result<DVector<f64>, FitError> {
            let quotient = |h: f64| Ok((self.displaced(x, at, k, h)? - &at.residuals) / h);
            let mut error = None;
            for h in [ONE_SIDED, -ONE_SIDED].into_iter().filter(|h| self.is_inside(k, x[k] + h)) {
                match quotient(h) {
                    Err(failure @ (FitError::Run { .. } | FitError::Family { .. })) => error = error.or(Some(failure)),
                    result => return result,
                }
            }
            // A run that cannot follow the grid may follow it with a smaller change.
            match error {
                Some(error @ FitError::Family { .. }) => Err(error),
                _ => self.column(x, at, k, ONE_SIDED),
            }
        };
        let columns = ensemble::collect(n, self.threads, column).into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(at.matrix(columns.iter()))
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
