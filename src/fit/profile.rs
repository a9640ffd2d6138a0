//! Intervals by profile likelihood.

use std::fmt::Display;

use super::error::refuse;
use super::estimate::QUANTILE_95;
use super::search::{StoppingRule, search};
use super::{Estimates, Family, Fit, FitError};
use crate::model::Model;
use crate::shoot::Shoot;

/// End of the searches of a profile.
const SEARCH: StoppingRule = StoppingRule {
    accuracy: 0.01,
    iterations: 40,
};

/// Relative accuracy of the distance to an end of the interval.
const DISTANCE: f64 = 0.02;

/// Largest number of searches for an end of the interval.
const SEARCHES: usize = 10;

impl Fit {
    /// Interval that contains the true value of a parameter with a probability of 90 %, by profile
    /// likelihood, in the unit of the parameter.
    ///
    /// The data, the noise and the loss are those of the estimates, and `build` is the function of
    /// their family. At an end of the interval, the minimum of χ² over all other parameters exceeds
    /// its value at the estimates by 2.71. This is the 90 % quantile of χ² with one degree of
    /// freedom. The number is multiplied by the factor by which correlated noise and outliers
    /// increase the variance. The interval need not be symmetric, and is valid for a path that is
    /// not linear in the parameters. The accuracy of its ends is 2 % of their distances from the
    /// estimate. An end at a bound of the parameter means that the data do not exclude the values
    /// next to the bound.
    ///
    /// # Errors
    /// [`Parameter`](FitError::Parameter) for a name without a finite standard error in the
    /// estimates; [`NoInterval`](FitError::NoInterval) if ten searches do not find an end; and the
    /// errors of [`run`](Self::run).
    pub fn profile<M: Model, E: Display>(
        &self,
        build: impl Fn(&[f64]) -> Result<Shoot<M>, E> + Sync,
        estimates: &Estimates,
        name: &str,
    ) -> Result<[f64; 2], FitError> {
        let family = &Family {
            parameters: estimates.family.clone(),
            build,
        };
        family.check(self, &estimates.data)?;
        let refused = |problem| FitError::Parameter {
            name: name.to_owned(),
            problem,
        };
        let position = estimates
            .linear
            .free
            .iter()
            .position(|k| family.parameters[*k].name == name);
        let i = position.ok_or_else(|| refused("is not among the estimates that have an error"))?;
        let k = estimates.linear.free[i];
        let problem =
            "belongs to a combination without effect on the data, so that its interval has no end";
        refuse(&[(estimates.parameters[k].error.is_infinite(), problem)]).map_err(refused)?;
        let [variance, white] =
            [&estimates.linear.covariance, &estimates.linear.white].map(|matrix| matrix[(i, i)]);
        // Correlated noise and outliers widen the interval by the same factor as the standard
        // error. Rounding may leave variances that are not positive.
        let wider = if white > 0.0 { variance / white } else { 1.0 };
        let (error, target) = (
            variance.max(0.0).sqrt(),
            QUANTILE_95 * wider.max(f64::MIN_POSITIVE).sqrt(),
        );
        let mut problem = family.problem_of(self, estimates, estimates.values());
        // Parameters at a bound may leave it.
        problem.free.retain(|other| *other != k);
        let (parameter, least) = (&family.parameters[k], 0.5 * estimates.chi_squared);
        let centre = parameter.unknown(estimates.parameters[k].value);
        let [low, high] = parameter.limits();
        let end = |sign: f64| -> Result<f64, FitError> {
            let room = if sign > 0.0 {
                high - centre
            } else {
                centre - low
            };
            let mut distance = if error > 0.0 {
                (QUANTILE_95 * error).min(room)
            } else {
                room
            };
            let mut problem = problem.clone();
            for _ in 0..SEARCHES {
                let unknown = centre + sign * distance;
                problem.values[k] = parameter.value(unknown);
                let reached = search(&problem, problem.unknowns(), SEARCH)?.point;
                let prior = parameter
                    .prior_residual(unknown)
                    .map_or(0.0, |[r, _]| 0.5 * r * r);
                let ratio = target / (2.0 * (reached.objective + prior - least)).max(0.0).sqrt();
                problem.values = problem.values_at(&reached.x);
                if distance >= room && ratio >= 1.0 {
                    return Ok(parameter.value(centre + sign * room));
                }
                if (ratio - 1.0).abs() < DISTANCE {
                    return Ok(parameter.value(centre + sign * distance * ratio));
                }
                distance = (distance * ratio.clamp(0.3, 3.0)).min(room);
            }
            Err(FitError::NoInterval {
                searches: SEARCHES,
                values: family.named(&problem.values),
            })
        };
        Ok([end(-1.0)?, end(1.0)?])
    }
}
