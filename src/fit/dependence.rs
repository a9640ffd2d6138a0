//! Dependence of the estimates on the values that are given.

use std::fmt::Display;

use nalgebra::{DMatrix, DVector};

use super::confidence::Singular;
use super::problem::Problem;
use super::{Estimates, Family, Fit, FitError};
use crate::model::Model;
use crate::shoot::Shoot;

/// Relative change of the unit of the data in a difference quotient. The steps of both runs differ
/// if the times differ, and the error of the path, 1e-6, causes an error of 1e-3.
const CHANGE: f64 = 1e-3;

/// Dependence of the estimates on a given value.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Dependence {
    /// Name of a fixed parameter, `unit of length` or `unit of time` of the data.
    pub given: String,
    /// Names of the estimated parameters with the derivative of the estimate with respect to the
    /// logarithm of the given value: that of ln estimate for a logarithmic parameter, otherwise
    /// that of the estimate, in its unit.
    pub slopes: Vec<(String, f64)>,
}

impl Fit {
    /// Dependence of the estimates on every fixed parameter that is not zero, and on the units of
    /// the data. The slope 1 means that an error of 1 % of the given value causes an error of 1 %
    /// of the estimate, however small its standard error. `build` is the function of the family.
    ///
    /// The slopes are those of the linearised problem. Combinations without effect on the data do
    /// not change.
    ///
    /// # Errors
    /// The errors of [`run`](Self::run) for the shoot at the estimates and close to them.
    pub fn dependences<M: Model, E: Display>(
        &self,
        build: impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync,
        estimates: &Estimates,
    ) -> Result<Vec<Dependence>, FitError> {
        let free = &estimates.linear.free;
        let is_given =
            |k: &usize| estimates.family[*k].is_fixed() && estimates.family[*k].start != 0.0;
        let given: Vec<usize> = (0..estimates.family.len()).filter(is_given).collect();
        let mut parameters = estimates.family.clone();
        for k in &given {
            // The unknown of this parameter is its value over the absolute value.
            let (value, size) = (parameters[*k].start, parameters[*k].start.abs());
            parameters[*k].bounds = [value - 0.5 * size, value + 0.5 * size];
        }
        let family = Family { parameters, build };
        let values = estimates.values();
        let all = free.iter().chain(&given).copied().collect();
        let problem = Problem {
            free: all,
            ..family.problem_of(self, estimates, values.clone())
        };
        let at = problem.at(problem.unknowns())?;
        let jacobian = problem.one_sided_jacobian(&at)?;
        let in_units = |factors: [f64; 2]| -> Result<DVector<f64>, FitError> {
            let data: Vec<_> = estimates
                .data
                .iter()
                .map(|series| series.scaled(factors))
                .collect();
            let scaled = Problem {
                noise: estimates.noise.clone(),
                ..family.problem(self, &data, values.clone())
            };
            Ok(scaled.at(scaled.unknowns())?.residuals)
        };
        let [smaller, larger] = [1.0 - CHANGE, 1.0 + CHANGE];
        let length = (in_units([larger, 1.0])? - in_units([smaller, 1.0])?) / (2.0 * CHANGE);
        let time = (in_units([1.0, larger])? - in_units([1.0, smaller])?) / (2.0 * CHANGE);
        let units = [length.column(0), time.column(0)];
        let mut columns =
            DMatrix::from_columns(&jacobian.column_iter().chain(units).collect::<Vec<_>>());
        // Residuals in the linear part of Huber's loss have no influence on the change.
        for i in (0..at.residuals.len()).filter(|i| !estimates.loss.is_inside(at.residuals[*i])) {
            columns.row_mut(i).fill(0.0);
        }
        // Changes of the unknowns that compensate changes of the others, whose effects are the
        // other columns.
        let (jacobian, others) = columns.columns_range_pair(..free.len(), free.len()..);
        let priors = problem
            .priors(&at.x)
            .filter(|(i, _)| *i < free.len())
            .map(|(i, [_, slope])| (i, slope));
        let inverse = Singular::of(&jacobian.clone_owned(), &priors.collect::<Vec<_>>()).inverse();
        let slopes = -inverse * jacobian.tr_mul(&others);
        let names = given.iter().map(|k| {
            (
                estimates.family[*k].name.as_str(),
                estimates.family[*k].start.signum(),
            )
        });
        let names = names.chain([("unit of length", 1.0), ("unit of time", 1.0)]);
        let of = |(j, (name, sign)): (usize, (&str, f64))| {
            let slope = |(i, k): (usize, &usize)| {
                let parameter = &estimates.family[*k];
                (
                    parameter.name.clone(),
                    sign * parameter.unit() * slopes[(i, j)],
                )
            };
            Dependence {
                given: name.to_owned(),
                slopes: free.iter().enumerate().map(slope).collect(),
            }
        };
        Ok(names.enumerate().map(of).collect())
    }
}
