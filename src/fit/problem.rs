//! Least-squares problem of a fit: residuals over the noise as functions of the unknowns.

use std::fmt::Display;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use nalgebra::DVector;

use super::parameter::free;
use super::residuals::{Origin, Output, Work, simulate};
use super::series::Series;
use super::{Family, Fit, FitError, Loss, Parameter};
use crate::integrator::Grid;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::tracking::{robust_deviation, root_mean_square};

/// Relative change below which the estimate of a noise has converged. The standard error of a noise
/// from a thousand coordinates is 2 %.
const NOISE_ACCURACY: f64 = 0.01;

/// Residuals of a run with the values of all parameters, up to a time (s), that follows a grid or
/// records one.
pub(super) type Run<'a> =
    dyn Fn(&[f64], f64, Option<&Grid>) -> Result<Output, FitError> + Send + Sync + 'a;

/// Residuals of the data up to a time, as functions of the unknowns of a search, one for each free
/// parameter.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    pub parameters: &'a [Parameter],
    pub data: &'a [Series],
    pub loss: Loss,
    /// Values of all parameters. Those of the parameters that are not free are used in every run.
    pub values: Vec<f64>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Noise of each series, in the unit of the data, or rad for angles.
    pub noise: Vec<f64>,
    /// Time up to which the data are used, s.
    pub until: f64,
    pub threads: usize,
    pub run: Arc<Run<'a>>,
}

/// Residuals at a point.
pub(super) struct Point {
    /// Unknowns.
    pub x: DVector<f64>,
    /// Simulated minus measured coordinates over the noise.
    pub residuals: DVector<f64>,
    /// Origin of each residual.
    pub rows: Vec<Origin>,
    /// Sum of the losses of all residuals and of half the squares of the priors.
    pub objective: f64,
    /// Grid of the run at this point.
    grid: Grid,
}

impl<M: Model, E: Display, F: Fn(&[f64]) -> Result<Shoot<M>, E> + Sync> Family<F> {
    /// Problem of all data, with the rough noise of each series whose noise is not given. All
    /// parameters without a known value are free.
    pub(super) fn problem<'a>(
        &'a self,
        fit: &Fit,
        data: &'a [Series],
        values: Vec<f64>,
    ) -> Problem<'a> {
        let (step, work) = (
            fit.step,
            Work {
                limit: fit.max_work,
                done: AtomicUsize::new(0),
            },
        );
        Problem {
            parameters: &self.parameters,
            data,
            loss: fit.loss,
            values,
            free: free(&self.parameters),
            noise: data
                .iter()
                .map(|series| series.noise.unwrap_or_else(|| series.scatter()))
                .collect(),
            until: f64::INFINITY,
            threads: fit.threads,
            run: Arc::new(move |values, until, grid| {
                simulate(self, data, (step, &work), (values, until), grid)
            }),
        }
    }
}

impl Problem<'_> {
    /// Unknowns of the values in the problem.
    pub fn unknowns(&self) -> DVector<f64> {
        let unknown = |k: &usize| self.parameters[*k].unknown(self.values[*k]);
        DVector::from_iterator(self.free.len(), self.free.iter().map(unknown))
    }

    /// Values of all parameters for the unknowns `x`.
    pub fn values_at(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut values = self.values.clone();
        for (k, x) in self.free.iter().zip(x.iter()) {
            values[*k] = self.parameters[*k].value(*x);
        }
        values
    }

    /// Bounds of unknown `i`.
    pub fn limits(&self, i: usize) -> [f64; 2] {
        self.parameters[self.free[i]].limits()
    }

    /// Indices of the unknowns with a prior, each with the residual of the prior and its
    /// derivative.
    pub fn priors<'a>(
        &'a self,
        x: &'a DVector<f64>,
    ) -> impl Iterator<Item = (usize, [f64; 2])> + 'a {
        let residual =
            |(i, k): (usize, &usize)| Some((i, self.parameters[*k].prior_residual(x[i])?));
        self.free.iter().enumerate().filter_map(residual)
    }

    /// Residuals for the unknowns `x`, on a new grid. The error is that of the family or of the
    /// run.
    pub fn at(&self, x: DVector<f64>) -> Result<Point, FitError> {
        let (residuals, grid) = (self.run)(&self.values_at(&x), self.until, None)?;
        let rows = residuals.iter().map(|(row, _)| *row).collect();
        let residuals = self.over_noise(&residuals);
        let data: f64 = residuals.iter().map(|r| self.loss.value(*r)).sum();
        let objective = data + self.priors(&x).map(|(_, [r, _])| 0.5 * r * r).sum::<f64>();
        Ok(Point {
            x,
            residuals,
            rows,
            objective,
            grid,
        })
    }

    /// Residuals over the noise for the unknowns `x`, on the grid of the run at a point.
    pub fn near(&self, point: &Point, x: &DVector<f64>) -> Result<DVector<f64>, FitError> {
        let (residuals, _) = (self.run)(&self.values_at(x), self.until, Some(&point.grid))?;
        Ok(self.over_noise(&residuals))
    }

    /// Residuals of a run (m, or rad) over the noise of their series.
    fn over_noise(&self, residuals: &[(Origin, f64)]) -> DVector<f64> {
        let scaled = residuals
            .iter()
            .map(|(row, residual)| residual / self.noise[row.series]);
        DVector::from_iterator(residuals.len(), scaled)
    }

    /// Estimates the noise of each series for which it is not given from the residuals at a point.
    /// Returns whether a noise has changed.
    pub fn estimate_noise(&mut self, point: &Point) -> bool {
        let mut changed = false;
        // Part of the squares that the fit does not absorb.
        let share = 1.0 - self.free.len() as f64 / point.residuals.len() as f64;
        for (index, _) in self
            .data
            .iter()
            .enumerate()
            .filter(|(_, series)| series.noise.is_none())
        {
            let all = point.rows.iter().zip(&point.residuals);
            let residuals: Vec<f64> = all
                .filter(|(row, _)| row.series == index)
                .map(|(_, r)| *r)
                .collect();
            let deviation = match self.loss {
                Loss::Squares => root_mean_square(&residuals),
                Loss::Huber(_) => robust_deviation(residuals.into_iter()),
            };
            let ratio = deviation / share.sqrt();
            // Exact data have residuals of the size of rounding errors. Their noise is not reduced
            // further.
            if ratio > f64::EPSILON && (ratio - 1.0).abs() > NOISE_ACCURACY {
                self.noise[index] *= ratio;
                changed = true;
            }
        }
        changed
    }
}
