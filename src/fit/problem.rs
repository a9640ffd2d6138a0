//! Least-squares problem of a fit: residuals over the noise as functions of the free coordinates.

use nalgebra::DVector;

use super::residuals::{Output, Row, Steps};
use super::{FitError, Parameter};
use crate::integrator::Grid;

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
}
